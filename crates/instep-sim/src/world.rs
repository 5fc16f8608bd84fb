//! Robots, pitch and ball in one MuJoCo model, stepped under the robots' real limits.
//!
//! Contacts are explicit pairs: soles and body with the ground, striking geoms with the ball, the ball with ground and goals,
//! and each robot's own self-collision pairs; robots meet each other and the posts by MuJoCo's bits. Nothing else touches.
//! A world of one robot is asked directly; of several, robot by robot through [`World::on`]. Drives are computed here at every physics
//! step from the command and the state, so that no controller can ask for more torque or speed than the motors have.
//! Commands are taken once a tick, which is a whole number of far steps; while the ball is near a striking geom a far
//! step is divided into near steps (facts/mujoco-from-rust.md, section 5).

mod body;
mod view;

use std::sync::Arc;

use instep_field::{Field, Pose, Side};
use instep_robot::Robot;
use instep_robot::control::JointCommand;
use instep_robot::senses::Camera;
use mujoco_rs::prelude::*;
use nalgebra::{Isometry3, Vector3};

use crate::SimError;
use crate::impact::ImpactWatch;
use crate::model::{BALL, FLOOR, MOST_ROBOTS, build};
use crate::sensors::orientation;
use crate::settings::WorldSettings;
use body::Body;
pub use view::View;

/// How deep the ball may be in something at the start, m: what its own weight presses it in, and a little more.
const OVERLAP: f64 = 1e-3;
/// Far steps before a possible contact from which the near step holds: one that is taken, one by which what MuJoCo last
/// computed is late, and one for what speeds up meanwhile.
const NEAR_STEPS: f64 = 3.0;

/// Where the ball is and how it moves, world frame, SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallState {
    /// Centre, m.
    pub position: [f64; 3],
    /// `world_from_ball`, w, x, y, z.
    pub orientation: [f64; 4],
    /// Velocity of the centre, m/s.
    pub velocity: [f64; 3],
    /// Angular velocity in the ball's frame, rad/s.
    pub angular_velocity: [f64; 3],
}

impl BallState {
    /// A ball at rest with its centre at `position` (m).
    #[must_use]
    pub fn at_rest(position: [f64; 3]) -> Self {
        Self { position, orientation: [1.0, 0.0, 0.0, 0.0], velocity: [0.0; 3], angular_velocity: [0.0; 3] }
    }
}

/// The greatest torque and speed that a joint has had since the last reset, with their times.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointPeak {
    /// N m, absolute.
    pub torque: f64,
    /// s.
    pub torque_time: f64,
    /// rad/s, absolute.
    pub speed: f64,
    /// s.
    pub speed_time: f64,
}

/// A robot that is to be put on a field.
#[derive(Debug, Clone)]
pub struct Entrant {
    /// With its own model, drives and senses.
    pub robot: Arc<Robot>,
    /// Whose player it is.
    pub team: Side,
    /// Where it stands at the start: its base over the ground, in the watcher's frame.
    pub pose: Pose,
}

/// Robots, pitch and ball.
pub struct World {
    settings: WorldSettings,
    data: MjData<Box<MjModel>>,
    field: Option<Arc<Field>>,
    bodies: Vec<Body>,
    ball_geom: usize,
    ball_body: usize,
    /// Where the ball's numbers begin in the world's q and v.
    ball_at: [usize; 2],
    floor_geom: usize,
    /// Geoms that the ball cannot be inside of: the robots', the ground and the goals.
    obstacles: Vec<usize>,
    geoms: Vec<GeomRole>,
    time: f64,
    near: bool,
    steps: Option<Steps>,
}

/// What a geom of the world is.
#[derive(Debug, Clone, Copy, Default)]
struct GeomRole {
    /// Whose it is.
    robot: Option<usize>,
    /// The contact point that it is.
    contact: Option<usize>,
    /// Whether it belongs to a robot's body above the feet.
    above_feet: bool,
}

/// Every physics step of a trial, for a program of its own to do again: `tools/replay.py`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Steps {
    /// For each step its length (s), positions and speeds of the whole world before it, forces on its degrees of freedom, and
    /// force and moment on the base link and on the ball (N, N m, world frame).
    pub rows: Vec<f64>,
    /// Positions and speeds after the last one.
    pub end: Vec<f64>,
    /// Numbers in a row.
    pub width: usize,
    /// For each command that was offered to the drives: when (s), angles, speeds and torques of all joints.
    pub commands: Vec<f64>,
}

/// A contact of the ball with a robot.
pub(crate) struct Strike {
    /// Body index of the link in the robot's own model.
    pub(crate) link: usize,
    /// Where, m.
    pub(crate) point: Vector3<f64>,
    /// On the ball, N.
    pub(crate) force: Vector3<f64>,
    /// How deep the two are in one another, m.
    pub(crate) depth: f64,
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let robots: Vec<&str> = self.bodies.iter().map(|body| body.robot.name.as_str()).collect();
        f.debug_struct("World").field("robots", &robots).field("time", &self.time).finish_non_exhaustive()
    }
}

impl World {
    /// Builds a world around `robot`: the robot in its standing pose at the origin, the ball at rest 1 m ahead, no goals.
    ///
    /// # Errors
    /// When a setting cannot be, or MuJoCo refuses the world.
    pub fn new(robot: Arc<Robot>, settings: &WorldSettings) -> Result<Self, SimError> {
        let entrant = Entrant { robot, team: Side::Home, pose: Pose::default() };
        let mut world = Self::build(None, std::slice::from_ref(&entrant), settings)?;
        world.start_again(&BallState::at_rest([1.0, 0.0, settings.ball.radius]))?;
        Ok(world)
    }

    /// Builds a world with `field`'s goals and all of `entrants` in their standing poses, the ball at rest on the centre mark.
    ///
    /// # Errors
    /// When there is no robot or there are too many, one stands outside the field and its border, two overlap or one stands in
    /// a post, a setting cannot be, or MuJoCo refuses the world.
    pub fn on_field(field: Arc<Field>, entrants: &[Entrant], settings: &WorldSettings) -> Result<Self, SimError> {
        if !(1..=MOST_ROBOTS).contains(&entrants.len()) {
            let found = format!("{} robots", entrants.len());
            return Err(SimError::State { found, expected: format!("1 to {MOST_ROBOTS}") });
        }
        for (i, Entrant { robot, pose, .. }) in entrants.iter().enumerate() {
            let finite = (pose.x + pose.y + pose.heading).is_finite();
            if !finite || !field.contains([pose.x, pose.y], field.border) {
                let [x, y] = [0.5 * field.length + field.border, 0.5 * field.width + field.border];
                let found = format!("x {:.3}, y {:.3} m, heading {:.3} rad", pose.x, pose.y, pose.heading);
                let expected = format!("within {x} m of the centre mark along the field and {y} m across");
                return Err(SimError::Place { robot: i, name: robot.name.clone(), found, expected });
            }
        }
        let mut world = Self::build(Some(field), entrants, settings)?;
        world.start_again(&BallState::at_rest([0.0, 0.0, settings.ball.radius]))?;
        match world.overlap() {
            Some((robot, other, depth)) => {
                let found = format!("{depth:.3} m inside {other}");
                let name = entrants[robot].robot.name.clone();
                Err(SimError::Place { robot, name, found, expected: "a place where it touches nothing".into() })
            }
            None => Ok(world),
        }
    }

    fn build(field: Option<Arc<Field>>, entrants: &[Entrant], settings: &WorldSettings) -> Result<Self, SimError> {
        settings.validate()?;
        let robots: Vec<&Robot> = entrants.iter().map(|entrant| &*entrant.robot).collect();
        let names = robots.iter().map(|robot| robot.name.as_str()).collect::<Vec<_>>().join(", ");
        let refused = |detail: String| SimError::World { robot: names.clone(), detail };
        let mut spec = build(&robots, field.as_deref(), settings)?;
        let model = spec.compile().map_err(|e| refused(e.to_string()))?;

        let geom = |name: &str| model.name_to_id(MjtObjBase::mjOBJ_GEOM, name);
        let (Some(ball_geom), Some(floor_geom)) = (geom(BALL), geom(FLOOR)) else {
            return Err(refused("ball or floor were lost in compilation".into()));
        };
        let mut geoms = vec![GeomRole::default(); model.geom_bodyid().len()];
        let mut obstacles = vec![floor_geom];
        let mut bodies: Vec<Body> = Vec::with_capacity(entrants.len());
        let (mut q, mut v, mut link) = (0, 0, 0);
        for (i, entrant) in entrants.iter().enumerate() {
            let body =
                Body::new(i, entrant, [q, v, link], &model, settings, &mut geoms, &mut obstacles).map_err(&refused)?;
            q += entrant.robot.nq();
            v += entrant.robot.nv();
            link += entrant.robot.model().body_parentid().len() - 1;
            bodies.push(body);
        }
        if [q + 7, v + 6] != [model.ffi().nq, model.ffi().nv].map(|n| usize::try_from(n).unwrap_or(0)) {
            return Err(refused("the world has other joints than the robots and the ball".into()));
        }
        if field.is_some() {
            let in_goal = |geom: &usize| {
                model.geom_bodyid()[*geom] == 0 && *geom != floor_geom && model.geom_rgba()[*geom][3] > 0.0
            };
            obstacles.extend((0..geoms.len()).filter(in_goal));
        }
        Ok(Self {
            settings: *settings,
            field,
            bodies,
            ball_geom,
            ball_body: usize::try_from(model.geom_bodyid()[ball_geom]).unwrap_or(0),
            ball_at: [q, v],
            data: MjData::try_new(Box::new(model)).map_err(|e| refused(e.to_string()))?,
            floor_geom,
            obstacles,
            geoms,
            time: 0.0,
            near: false,
            steps: None,
        })
    }

    /// Starts again from a state of the robot (q: 7 + n, v: 6 + n, see instep-robot) and of the ball; where there are several
    /// robots, of the first one, with all others where they stood.
    ///
    /// # Errors
    /// When a vector has another length or holds something that is not finite.
    pub fn reset(&mut self, q: &[f64], v: &[f64], ball: &BallState) -> Result<(), SimError> {
        self.check_state(0, q, v)?;
        let numbers = ball.position.iter().chain(&ball.orientation).chain(&ball.velocity);
        if let Some(bad) = numbers.into_iter().find(|x| !x.is_finite()) {
            return Err(SimError::State { found: bad.to_string(), expected: "finite numbers".into() });
        }
        self.data.reset();
        for body in self.bodies.iter_mut().skip(1) {
            let [at, _] = body.at;
            self.data.qpos_mut()[at..at + body.start.len()].copy_from_slice(&body.start);
        }
        self.data.qpos_mut()[..q.len()].copy_from_slice(q);
        self.data.qvel_mut()[..v.len()].copy_from_slice(v);
        self.place_ball(ball);
        self.bodies.iter_mut().for_each(Body::reset);
        self.time = 0.0;
        self.near = self.is_near();
        if let Some(steps) = &mut self.steps {
            *steps = Steps::default();
        }
        Ok(())
    }

    /// Starts again with every robot at rest where it stood at first.
    ///
    /// # Errors
    /// When the ball's numbers are not finite.
    pub fn start_again(&mut self, ball: &BallState) -> Result<(), SimError> {
        let (q, v) = (self.bodies[0].start.clone(), vec![0.0; self.bodies[0].robot.nv()]);
        self.reset(&q, &v, ball)
    }

    /// Puts robot `index` into a state (q: 7 + n, v: 6 + n), as hands would that carry it; its drives have no command
    /// until the next one. Its [`crate::sensors::SensorSuite`] is to be told.
    ///
    /// # Errors
    /// When a vector has another length or holds something that is not finite.
    pub fn place_robot(&mut self, index: usize, q: &[f64], v: &[f64]) -> Result<(), SimError> {
        self.check_state(index, q, v)?;
        let [q_at, v_at] = self.bodies[index].at;
        self.data.qpos_mut()[q_at..q_at + q.len()].copy_from_slice(q);
        self.data.qvel_mut()[v_at..v_at + v.len()].copy_from_slice(v);
        self.data.forward();
        if let Some(drives) = &mut self.bodies[index].drives {
            drives.reset();
        }
        Ok(())
    }

    fn check_state(&self, index: usize, q: &[f64], v: &[f64]) -> Result<(), SimError> {
        let robot = &self.bodies[index].robot;
        let (nq, nv) = (robot.nq(), robot.nv());
        let wrong = |found: String, expected: String| Err(SimError::State { found, expected });
        if q.len() != nq || v.len() != nv {
            let found = format!("{} positions and {} speeds", q.len(), v.len());
            return wrong(found, format!("{nq} and {nv} for {}", robot.name));
        }
        match q.iter().chain(v).find(|x| !x.is_finite()) {
            Some(bad) => wrong(bad.to_string(), "finite numbers".into()),
            None => Ok(()),
        }
    }

    /// Keeps every physics step from the next reset on, until they are taken.
    pub fn keep_steps(&mut self) {
        self.steps = Some(Steps::default());
    }

    /// The steps since the last reset, where they were kept; no more are.
    pub fn take_steps(&mut self) -> Option<Steps> {
        let mut steps = self.steps.take()?;
        steps.end = [self.data.qpos(), self.data.qvel()].concat();
        Some(steps)
    }

    /// Advances one tick under `command`, in far steps, or near ones while the ball is near; tells `watch` of every step.
    ///
    /// # Errors
    /// When the command or the state is no longer finite.
    pub fn advance(&mut self, command: &JointCommand, watch: Option<&mut ImpactWatch>) -> Result<(), SimError> {
        self.advance_all(std::slice::from_ref(command), watch)
    }

    /// As [`World::advance`], with one command a robot.
    ///
    /// # Errors
    /// Also when there are more or fewer commands than robots.
    pub fn advance_all(
        &mut self,
        commands: &[JointCommand],
        mut watch: Option<&mut ImpactWatch>,
    ) -> Result<(), SimError> {
        if commands.len() != self.bodies.len() {
            let found = format!("{} commands", commands.len());
            return Err(SimError::State { found, expected: format!("one for each of {} robots", self.bodies.len()) });
        }
        let step = self.settings.step;
        for _ in 0..step.far_per_tick() {
            self.near = self.is_near();
            for (body, command) in self.bodies.iter_mut().zip(commands) {
                if let Some(drives) = &mut body.drives {
                    drives.offer(self.time, command);
                }
            }
            if let (Some(steps), Some(command)) = (&mut self.steps, commands.first()) {
                steps.commands.push(self.time);
                for part in [&command.positions, &command.velocities, &command.torques] {
                    steps.commands.extend_from_slice(part);
                }
            }
            let (count, dt) = if self.near { (step.near_per_far(), step.near) } else { (1, step.far) };
            for _ in 0..count {
                if let Some(watch) = watch.as_deref_mut() {
                    watch.before(self);
                }
                self.step(commands, dt)?;
                if let Some(watch) = watch.as_deref_mut() {
                    watch.after(self);
                }
            }
        }
        Ok(())
    }

    /// Pushes the (first) robot's base link at its centre of mass with `force` (N, world frame) from now on; zero ends the push.
    pub fn push(&mut self, force: [f64; 3]) {
        self.push_robot(0, force);
    }

    /// Pushes robot `index` likewise.
    pub fn push_robot(&mut self, index: usize, force: [f64; 3]) {
        let body = &mut self.bodies[index];
        self.data.xfrc_applied_mut()[body.base()][..3].copy_from_slice(&force);
        body.push = force.into();
    }

    /// Puts the ball where `ball` says, as a hand or another player would.
    pub fn place_ball(&mut self, ball: &BallState) {
        let [q, v] = self.ball_at;
        let qpos = self.data.qpos_mut();
        qpos[q..q + 3].copy_from_slice(&ball.position);
        qpos[q + 3..q + 7].copy_from_slice(&ball.orientation);
        let qvel = self.data.qvel_mut();
        qvel[v..v + 3].copy_from_slice(&ball.velocity);
        qvel[v + 3..v + 6].copy_from_slice(&ball.angular_velocity);
        self.data.forward();
    }

    /// One physics step of `dt` (s).
    fn step(&mut self, commands: &[JointCommand], dt: f64) -> Result<(), SimError> {
        self.drag_ball();
        let mut torque_sum = 0.0;
        for (body, command) in self.bodies.iter_mut().zip(commands) {
            torque_sum += body.drive(&mut self.data, command, self.time, dt);
        }
        if !torque_sum.is_finite() {
            return Err(SimError::Diverged { time: self.time, what: "a joint torque" });
        }
        if let Some(mut steps) = self.steps.take() {
            let before = steps.rows.len();
            steps.rows.push(dt);
            for part in [self.data.qpos(), self.data.qvel(), self.data.qfrc_applied()] {
                steps.rows.extend_from_slice(part);
            }
            for body in self.bodies.iter().map(Body::base).chain([self.ball_body]) {
                steps.rows.extend_from_slice(&self.data.xfrc_applied()[body]);
            }
            steps.width = steps.rows.len() - before;
            self.steps = Some(steps);
        }
        self.data.model_opt_mut().timestep = dt;
        self.data.step();
        self.time += dt;
        let mut state_sum = 0.0;
        for body in &mut self.bodies {
            state_sum += body.account(&self.data, dt);
        }
        if !state_sum.is_finite() {
            return Err(SimError::Diverged { time: self.time, what: "a joint speed" });
        }
        Ok(())
    }

    /// Puts the air's force on the ball, as of its present velocity.
    fn drag_ball(&mut self) {
        let velocity = self.ball().velocity;
        let damping = self.settings.ball.air_damping(Vector3::from(velocity).norm());
        self.data.xfrc_applied_mut()[self.ball_body][..3].copy_from_slice(&velocity.map(|v| -damping * v));
    }

    /// Whether the gap between the ball and a striking geom is under the near distance and what they approach each other
    /// in [`NEAR_STEPS`] far steps.
    fn is_near(&mut self) -> bool {
        let step = self.settings.step;
        let ball = Vector3::from(self.data.geom_xpos()[self.ball_geom]);
        let ball_velocity = Vector3::from(self.ball().velocity);
        let radius = self.settings.ball.radius;
        let data = &mut self.data;
        self.bodies.iter().flat_map(|body| &body.strike).any(|&(geom, bound)| {
            let [wx, wy, wz, vx, vy, vz] = data.object_velocity(MjtObjBase::mjOBJ_GEOM, geom, false);
            let speed = (Vector3::new(vx, vy, vz) - ball_velocity).norm() + Vector3::new(wx, wy, wz).norm() * bound;
            let reach = step.near_distance + NEAR_STEPS * step.far * speed;
            let centre = Vector3::from(data.geom_xpos()[geom]);
            (ball - centre).norm() < reach + radius + bound
                && data.geom_distance(geom, self.ball_geom, 2.0 * reach, None) < reach
        })
    }

    /// What robot `index` is and does. The calls of a single robot below are those of the first.
    ///
    /// # Panics
    /// When there is no such robot.
    #[must_use]
    pub fn on(&self, index: usize) -> View<'_> {
        View::new(self, &self.bodies[index])
    }

    /// All robots, in the order in which they entered.
    pub fn robots(&self) -> impl ExactSizeIterator<Item = View<'_>> {
        self.bodies.iter().map(|body| View::new(self, body))
    }

    /// The field whose goals stand here, where there is one.
    #[must_use]
    pub fn field(&self) -> Option<&Arc<Field>> {
        self.field.as_ref()
    }

    /// The robot.
    #[must_use]
    pub fn robot(&self) -> &Arc<Robot> {
        self.on(0).robot()
    }

    /// The constants.
    #[must_use]
    pub fn settings(&self) -> &WorldSettings {
        &self.settings
    }

    /// Since the last reset, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Work that all motors have done since the last reset, J.
    #[must_use]
    pub fn motor_work(&self) -> f64 {
        self.bodies.iter().map(|body| body.motor_work).sum()
    }

    /// Work that pushes have done since the last reset, J.
    #[must_use]
    pub fn push_work(&self) -> f64 {
        self.bodies.iter().map(|body| body.push_work).sum()
    }

    /// Kinetic and potential energy (J) of robot and ball in a state, which becomes the world's.
    pub(crate) fn energy(&mut self, q: &[f64], v: &[f64], ball: &BallState) -> [f64; 2] {
        self.data.qpos_mut()[..q.len()].copy_from_slice(q);
        self.data.qvel_mut()[..v.len()].copy_from_slice(v);
        self.place_ball(ball);
        self.data.energy_pos();
        self.data.energy_vel();
        let [potential, kinetic] = *self.data.energy();
        [kinetic, potential]
    }

    /// A part of the robot, or the ground, that the ball is inside of, and how deep (m).
    pub(crate) fn ball_overlap(&mut self) -> Option<(String, f64)> {
        let (ball, radius) = (self.ball_geom, self.settings.ball.radius);
        let data = &mut self.data;
        let deepest = self.obstacles.iter().map(|&geom| (geom, -data.geom_distance(geom, ball, radius, None)));
        let (geom, depth) = deepest.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let name = match self.geoms[geom].robot {
            Some(robot) => self.bodies[robot].link_name(&self.data, geom),
            None if geom == self.floor_geom => "the ground",
            None => "a goal",
        };
        (depth > OVERLAP).then(|| (name.to_owned(), depth))
    }

    /// A robot that is inside of another or of a post, what it is inside of, and how deep (m), as of the last forward step.
    fn overlap(&self) -> Option<(usize, String, f64)> {
        let mut deepest: Option<(usize, String, f64)> = None;
        for contact in self.data.contact() {
            let [a, b] = contact.geom.map(|geom| usize::try_from(geom).ok().map(|g| (g, self.geoms[g].robot)));
            let (Some(a), Some(b)) = (a, b) else { continue };
            let apart = [a, b].iter().any(|(geom, _)| *geom == self.floor_geom || *geom == self.ball_geom);
            // The later of two stands in the earlier one's way.
            let (Some(robot), other) = (a.1.max(b.1), a.1.min(b.1)) else { continue };
            let depth = -contact.dist;
            if apart || other == Some(robot) || depth <= OVERLAP || deepest.as_ref().is_some_and(|d| d.2 >= depth) {
                continue;
            }
            let name = match other {
                Some(other) => format!("robot {other} ({})", self.bodies[other].robot.name),
                None => "a goal post".to_owned(),
            };
            deepest = Some((robot, name, depth));
        }
        deepest
    }

    /// The robot's position, 7 + n.
    #[must_use]
    pub fn q(&self) -> &[f64] {
        self.on(0).q()
    }

    /// The robot's speed, 6 + n.
    #[must_use]
    pub fn v(&self) -> &[f64] {
        self.on(0).v()
    }

    /// The torques of the last step, N m.
    #[must_use]
    pub fn torques(&self) -> &[f64] {
        self.on(0).torques()
    }

    /// The ball.
    #[must_use]
    pub fn ball(&self) -> BallState {
        let (q, v) = (&self.data.qpos()[self.ball_at[0]..], &self.data.qvel()[self.ball_at[1]..]);
        BallState {
            position: [q[0], q[1], q[2]],
            orientation: [q[3], q[4], q[5], q[6]],
            velocity: [v[0], v[1], v[2]],
            angular_velocity: [v[3], v[4], v[5]],
        }
    }

    /// Each joint's peaks since the last reset.
    #[must_use]
    pub fn peaks(&self) -> &[JointPeak] {
        self.on(0).peaks()
    }

    /// Whether the last step was a near one.
    #[must_use]
    pub fn is_near_step(&self) -> bool {
        self.near
    }

    /// Force of the ground on each contact point in the world, N, as of the last step; `forces` has one entry a point.
    pub fn contact_forces_into(&self, forces: &mut [Vector3<f64>]) {
        self.on(0).contact_forces_into(forces);
    }

    /// Whether a part of the robot other than its feet touches the ground.
    #[must_use]
    pub fn body_touches_ground(&self) -> bool {
        self.on(0).body_touches_ground()
    }

    /// `world_from_camera` of the robot's `camera`, m, as of the start of the last step.
    #[must_use]
    pub fn camera_pose(&self, camera: &Camera) -> Isometry3<f64> {
        self.on(0).camera_pose(camera)
    }

    /// `world_from_heading`: the base link's ground projection and its heading.
    #[must_use]
    pub fn heading(&self) -> Isometry3<f64> {
        self.on(0).heading()
    }

    /// Fits robot `index` with other encoders, whose zeros (rad) are off by `offsets`.
    pub(crate) fn set_encoder_offsets(&mut self, index: usize, offsets: &[f64]) {
        self.bodies[index].encoder_offsets.copy_from_slice(offsets);
    }

    /// Robots that touched the ball in the last step; one that did so twice may come twice.
    pub fn robots_on_ball(&self) -> impl Iterator<Item = usize> {
        self.ball_contacts().map(|(robot, ..)| robot)
    }

    /// How far the encoders' zeros of the first robot are off, rad.
    #[must_use]
    pub fn encoder_offsets(&self) -> &[f64] {
        &self.bodies[0].encoder_offsets
    }

    /// Pairs of robots that touched each other in the last step; a pair may come more than once.
    pub fn robots_touching(&self) -> impl Iterator<Item = [usize; 2]> {
        self.data.contact().iter().filter(|contact| contact.dist < 0.0).filter_map(|contact| {
            let [a, b] = contact.geom.map(|geom| usize::try_from(geom).ok().and_then(|geom| self.geoms[geom].robot));
            let (a, b) = (a?, b?);
            (a != b).then_some([a.min(b), a.max(b)])
        })
    }

    /// Contacts of the ball with robots in the last step: robot, its geom, index of the contact, sign of its force on the ball.
    fn ball_contacts(&self) -> impl Iterator<Item = (usize, usize, usize, f64)> {
        self.data.contact().iter().enumerate().filter_map(|(i, contact)| {
            let [a, b] = contact.geom.map(|geom| usize::try_from(geom).unwrap_or(usize::MAX));
            let (striker, sign) = match (a == self.ball_geom, b == self.ball_geom) {
                (false, true) => (a, 1.0),
                (true, false) => (b, -1.0),
                _ => return None,
            };
            Some((self.geoms.get(striker)?.robot?, striker, i, sign))
        })
    }

    /// Every contact of the ball with the (first) robot in the last step.
    pub(crate) fn ball_strikes(&self) -> impl Iterator<Item = Strike> {
        self.ball_contacts().filter(|(robot, ..)| *robot == 0).filter_map(|(_, geom, i, sign)| {
            let contact = &self.data.contact()[i];
            let link = usize::try_from(self.data.model().geom_bodyid()[geom]).ok()?;
            let force = contact_force(&self.data, i) * sign;
            Some(Strike { link, point: contact.pos.into(), force, depth: -contact.dist })
        })
    }

    /// Changes the time steps; for a re-run in finer ones.
    pub(crate) fn set_step(&mut self, step: crate::settings::Step) {
        self.settings.step = step;
    }

    /// Makes the steps cheaper, for a training that takes millions of them: the contact solver ends after `iterations`, or when an
    /// iteration gains less than `tolerance` (MuJoCo's scaled cost). Trials are measured with the world's own, finer limits.
    ///
    /// The other two choices cost no exactness. Euler's step treats the joints' damping implicitly as `implicitfast` does, and takes
    /// the solver's accelerations as they are instead of solving for them again; a sparse Jacobian gives the same product.
    pub fn make_cheap(&mut self, iterations: usize, tolerance: f64) {
        let options = self.data.model_opt_mut();
        options.iterations = i32::try_from(iterations).unwrap_or(i32::MAX);
        options.tolerance = tolerance;
        options.integrator = MjtIntegrator::mjINT_EULER as i32;
        options.jacobian = MjtJacobian::mjJAC_SPARSE as i32;
    }

    /// The bare MuJoCo data, for the benchmark that compares with a plain `mj_step` loop.
    pub fn mujoco(&mut self) -> &mut MjData<Box<MjModel>> {
        &mut self.data
    }
}

/// Force that geom 1 puts on geom 2 at contact `i`, world frame, N.
fn contact_force(data: &MjData<Box<MjModel>>, i: usize) -> Vector3<f64> {
    let Ok(local) = data.try_contact_force(i) else { return Vector3::zeros() };
    let frame = &data.contact()[i].frame;
    let axis = |k: usize| Vector3::new(frame[3 * k], frame[3 * k + 1], frame[3 * k + 2]);
    axis(0) * local[0] + axis(1) * local[1] + axis(2) * local[2]
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]
mod tests {
    use super::*;

    /// In the air, where nothing else does work, what the motors do is what robot and ball gain of energy.
    #[test]
    fn the_motors_work_is_the_energy_that_a_floating_robot_gains() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/prestoe");
        let robot = Arc::new(Robot::load(&folder).unwrap());
        let mut world = World::new(Arc::clone(&robot), &WorldSettings::default()).unwrap();
        let mut q = robot.stand.clone();
        q[2] += 3.0;
        world.reset(&q, &vec![0.0; robot.nv()], &BallState::at_rest([9.0, 0.0, 0.11])).unwrap();
        let still = world.ball();
        let [kinetic, potential] = world.energy(&q, &vec![0.0; robot.nv()], &still);
        let before = kinetic + potential;
        world.reset(&q, &vec![0.0; robot.nv()], &still).unwrap();
        let mut command = JointCommand::zeros(robot.joints.len());
        command.positions.copy_from_slice(&q[7..]);
        // Both arms and one leg swing out.
        for name in ["left_elbow", "right_elbow", "left_hip_pitch"] {
            command.positions[robot.joint_index(name).unwrap()] -= 0.8;
        }
        for _ in 0..60 {
            world.advance(&command, None).unwrap();
        }
        let (q, v, work) = (world.q().to_vec(), world.v().to_vec(), world.motor_work());
        let [kinetic, potential] = world.energy(&q, &v, &still);
        let gained = kinetic + potential - before;
        assert!(work > 1.0, "{work} J");
        assert!((gained / work - 1.0).abs() < 0.05, "{gained} J gained, {work} J of work");
    }
}
