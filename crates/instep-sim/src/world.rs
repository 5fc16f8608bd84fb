//! Robot, pitch and ball in one MuJoCo model, stepped under the robot's real limits.
//!
//! All contacts are explicit pairs: soles and body with the ground, striking geoms with the ball, the ball with the
//! ground, and the robot's own self-collision pairs; nothing else touches. Drives are computed here at every physics
//! step from the command and the state, so that no controller can ask for more torque or speed than the motors have.
//! Commands are taken once a tick, which is a whole number of far steps; while the ball is near a striking geom a far
//! step is divided into near steps (facts/mujoco-from-rust.md, section 5).

use std::sync::Arc;

use instep_robot::Robot;
use instep_robot::control::{JointCommand, drive_torque, torque_range_over_step};
use instep_robot::drive::{Drives, Measured};
use instep_robot::senses::Camera;
use mujoco_rs::mujoco_c;
use mujoco_rs::prelude::*;
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::SimError;
use crate::impact::ImpactWatch;
use crate::model::{BALL, FLOOR, build, foot_links, solid_geoms};
use crate::sensors::orientation;
use crate::settings::{Fidelity, WorldSettings};

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

/// Robot, pitch and ball.
pub struct World {
    robot: Arc<Robot>,
    settings: WorldSettings,
    data: MjData<Box<MjModel>>,
    ball_geom: usize,
    ball_body: usize,
    floor_geom: usize,
    /// Striking geoms as (geom, bounding radius).
    strike: Vec<(usize, f64)>,
    /// Geoms that the ball cannot be inside of: the robot's and the ground.
    obstacles: Vec<usize>,
    /// For each geom of the world: the contact point that it is, if any.
    contact_of_geom: Vec<Option<usize>>,
    /// For each geom of the world: whether it belongs to the robot's body above the feet.
    is_body: Vec<bool>,
    /// `None`: ideal ones.
    drives: Option<Drives>,
    /// Zeros of the encoders, which drives and sensors share, rad.
    encoder_offsets: Vec<f64>,
    peaks: Vec<JointPeak>,
    time: f64,
    motor_work: f64,
    /// Force on the base link's centre of mass, N.
    push: Vector3<f64>,
    push_work: f64,
    near: bool,
    steps: Option<Steps>,
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
}

/// A contact of the ball with the robot.
pub(crate) struct Strike {
    /// Body index of the link.
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
        f.debug_struct("World").field("robot", &self.robot.name).field("time", &self.time).finish_non_exhaustive()
    }
}

impl World {
    /// Builds a world around `robot`: the robot in its standing pose at the origin, the ball at rest 1 m ahead.
    ///
    /// # Errors
    /// When a setting cannot be, or MuJoCo refuses the world.
    pub fn new(robot: Arc<Robot>, settings: &WorldSettings) -> Result<Self, SimError> {
        settings.validate()?;
        let name = robot.name.clone();
        let refused = |detail: String| SimError::World { robot: name.clone(), detail };
        let mut spec = robot.spec()?;
        build(&mut spec, &robot, settings).map_err(|e| refused(e.to_string()))?;
        let model = spec.compile().map_err(|e| refused(e.to_string()))?;

        let geom = |name: &str| model.name_to_id(MjtObjBase::mjOBJ_GEOM, name);
        let (Some(ball_geom), Some(floor_geom)) = (geom(BALL), geom(FLOOR)) else {
            return Err(refused("ball or floor were lost in compilation".into()));
        };
        let world_geom = |robot_geom: usize| {
            robot
                .model()
                .id_to_name(MjtObjBase::mjOBJ_GEOM, robot_geom)
                .and_then(geom)
                .ok_or_else(|| refused(format!("geom {robot_geom} was lost in compilation")))
        };
        let mut strike = Vec::new();
        for &robot_geom in robot.legs.iter().flat_map(|leg| &leg.strike) {
            let id = world_geom(robot_geom)?;
            strike.push((id, model.geom_rbound()[id]));
        }
        let mut obstacles = vec![floor_geom];
        for robot_geom in solid_geoms(&robot) {
            obstacles.push(world_geom(robot_geom)?);
        }
        let ball_body = usize::try_from(model.geom_bodyid()[ball_geom]).unwrap_or(0);
        let geoms = model.geom_bodyid().len();
        let mut contact_of_geom = vec![None; geoms];
        for (i, contact) in robot.contacts.iter().enumerate() {
            contact_of_geom[world_geom(contact.geom)?] = Some(i);
        }
        let feet = foot_links(&robot);
        let bodies = robot.model().body_parentid().len();
        let is_body = model
            .geom_bodyid()
            .iter()
            .map(|&body| {
                let body = usize::try_from(body).unwrap_or(0);
                (1..bodies).contains(&body) && !feet.contains(&body)
            })
            .collect();
        let joints = robot.joints.len();
        let mut world = Self {
            drives: (settings.drives == Fidelity::AsBuilt).then(|| Drives::new(&robot)),
            encoder_offsets: vec![0.0; joints],
            robot,
            settings: *settings,
            data: MjData::try_new(Box::new(model)).map_err(|e| refused(e.to_string()))?,
            ball_geom,
            ball_body,
            floor_geom,
            strike,
            obstacles,
            contact_of_geom,
            is_body,
            peaks: vec![JointPeak::default(); joints],
            time: 0.0,
            motor_work: 0.0,
            push: Vector3::zeros(),
            push_work: 0.0,
            near: false,
            steps: None,
        };
        let stand = world.robot.stand.clone();
        let still = vec![0.0; world.robot.nv()];
        world.reset(&stand, &still, &BallState::at_rest([1.0, 0.0, settings.ball.radius]))?;
        Ok(world)
    }

    /// Starts again from a state of the robot (q: 7 + n, v: 6 + n, see instep-robot) and of the ball.
    ///
    /// # Errors
    /// When a vector has another length or holds something that is not finite.
    pub fn reset(&mut self, q: &[f64], v: &[f64], ball: &BallState) -> Result<(), SimError> {
        let (nq, nv) = (self.robot.nq(), self.robot.nv());
        let wrong = |found: String, expected: String| Err(SimError::State { found, expected });
        if q.len() != nq || v.len() != nv {
            let found = format!("{} positions and {} speeds", q.len(), v.len());
            return wrong(found, format!("{nq} and {nv} for {}", self.robot.name));
        }
        let ball_numbers = ball.position.iter().chain(&ball.orientation).chain(&ball.velocity);
        if let Some(bad) = q.iter().chain(v).chain(ball_numbers).find(|x| !x.is_finite()) {
            return wrong(bad.to_string(), "finite numbers".into());
        }
        self.data.reset();
        let qpos = self.data.qpos_mut();
        qpos[..nq].copy_from_slice(q);
        qpos[nq..nq + 3].copy_from_slice(&ball.position);
        qpos[nq + 3..nq + 7].copy_from_slice(&ball.orientation);
        let qvel = self.data.qvel_mut();
        qvel[..nv].copy_from_slice(v);
        qvel[nv..nv + 3].copy_from_slice(&ball.velocity);
        qvel[nv + 3..nv + 6].copy_from_slice(&ball.angular_velocity);
        self.data.forward();
        if let Some(drives) = &mut self.drives {
            drives.reset();
        }
        self.peaks.fill(JointPeak::default());
        self.time = 0.0;
        self.motor_work = 0.0;
        self.push = Vector3::zeros();
        self.push_work = 0.0;
        self.near = self.is_near();
        if let Some(steps) = &mut self.steps {
            *steps = Steps::default();
        }
        Ok(())
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
    pub fn advance(&mut self, command: &JointCommand, mut watch: Option<&mut ImpactWatch>) -> Result<(), SimError> {
        let step = self.settings.step;
        for _ in 0..step.far_per_tick() {
            self.near = self.is_near();
            if let Some(drives) = &mut self.drives {
                drives.offer(self.time, command);
            }
            let (count, dt) = if self.near { (step.near_per_far(), step.near) } else { (1, step.far) };
            for _ in 0..count {
                if let Some(watch) = watch.as_deref_mut() {
                    watch.before(self);
                }
                self.step(command, dt)?;
                if let Some(watch) = watch.as_deref_mut() {
                    watch.after(self);
                }
            }
        }
        Ok(())
    }

    /// Pushes the base link's centre of mass with `force` (N, world frame) from now on; zero ends the push.
    pub fn push(&mut self, force: [f64; 3]) {
        let base = self.robot.base;
        self.data.xfrc_applied_mut()[base][..3].copy_from_slice(&force);
        self.push = force.into();
    }

    /// Puts the ball where `ball` says, as a hand or another player would.
    pub fn place_ball(&mut self, ball: &BallState) {
        let (nq, nv) = (self.robot.nq(), self.robot.nv());
        let qpos = self.data.qpos_mut();
        qpos[nq..nq + 3].copy_from_slice(&ball.position);
        qpos[nq + 3..nq + 7].copy_from_slice(&ball.orientation);
        let qvel = self.data.qvel_mut();
        qvel[nv..nv + 3].copy_from_slice(&ball.velocity);
        qvel[nv + 3..nv + 6].copy_from_slice(&ball.angular_velocity);
        self.data.forward();
    }

    /// One physics step of `dt` (s).
    fn step(&mut self, command: &JointCommand, dt: f64) -> Result<(), SimError> {
        self.drag_ball();
        let pushed = self.push != Vector3::zeros();
        if pushed {
            self.push_work += 0.5 * dt * self.push.dot(&self.base_com_velocity());
        }
        let joints = &self.robot.joints;
        let (mut torque_sum, mut load) = (0.0, 0.0);
        for (i, joint) in joints.iter().enumerate() {
            let (q, v) = (self.data.qpos()[7 + i], self.data.qvel()[6 + i]);
            // 1 / D of M = L^T D L: the joint's inertia with the links below it free and those above it held.
            let inverse_inertia = self.data.q_ldiag_inv()[6 + i];
            let torque = match &mut self.drives {
                Some(drives) => {
                    let position = q + self.encoder_offsets[i];
                    let now = Measured { position, velocity: v, voltage: 1.0, step: dt, inverse_inertia };
                    drives.torque(i, joint, now)
                }
                None => {
                    let target = (command.positions[i], command.velocities[i], command.torques[i]);
                    let wanted = drive_torque(joint, target.0, target.1, target.2, q, v);
                    let [least, greatest] = torque_range_over_step(joint, v, dt * inverse_inertia, 1.0);
                    wanted.clamp(least, greatest)
                }
            };
            load += torque.abs();
            torque_sum += torque;
            self.motor_work += 0.5 * dt * torque * v;
            self.data.qfrc_applied_mut()[6 + i] = torque;
            let peak = &mut self.peaks[i];
            if torque.abs() > peak.torque {
                (peak.torque, peak.torque_time) = (torque.abs(), self.time);
            }
            if v.abs() > peak.speed {
                (peak.speed, peak.speed_time) = (v.abs(), self.time);
            }
        }
        if let Some(drives) = &mut self.drives {
            drives.loaded(load);
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
            for body in [self.robot.base, self.ball_body] {
                steps.rows.extend_from_slice(&self.data.xfrc_applied()[body]);
            }
            steps.width = steps.rows.len() - before;
            self.steps = Some(steps);
        }
        self.data.model_opt_mut().timestep = dt;
        self.data.step();
        self.time += dt;
        // Work by the mean of the speeds before and after the step.
        let mut speed_sum = 0.0;
        for i in 6..6 + joints.len() {
            let v = self.data.qvel()[i];
            speed_sum += v;
            self.motor_work += 0.5 * dt * self.data.qfrc_applied()[i] * v;
        }
        if pushed {
            self.push_work += 0.5 * dt * self.push.dot(&self.base_com_velocity());
        }
        if !(speed_sum + self.data.qpos()[2]).is_finite() {
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

    /// Velocity of the base link's centre of mass, m/s.
    fn base_com_velocity(&self) -> Vector3<f64> {
        let v = self.v();
        let centre = Vector3::from(self.data.model().body_ipos()[self.robot.base]);
        let spin = orientation(self.q()) * Vector3::new(v[3], v[4], v[5]).cross(&centre);
        Vector3::new(v[0], v[1], v[2]) + spin
    }

    /// Whether the gap between the ball and a striking geom is under the near distance and what they approach each other
    /// in [`NEAR_STEPS`] far steps.
    fn is_near(&mut self) -> bool {
        let step = self.settings.step;
        let ball = Vector3::from(self.data.geom_xpos()[self.ball_geom]);
        let ball_velocity = Vector3::from(self.ball().velocity);
        let radius = self.settings.ball.radius;
        (0..self.strike.len()).any(|i| {
            let (geom, bound) = self.strike[i];
            let [wx, wy, wz, vx, vy, vz] = self.data.object_velocity(MjtObjBase::mjOBJ_GEOM, geom, false);
            let speed = (Vector3::new(vx, vy, vz) - ball_velocity).norm() + Vector3::new(wx, wy, wz).norm() * bound;
            let reach = step.near_distance + NEAR_STEPS * step.far * speed;
            let centre = Vector3::from(self.data.geom_xpos()[geom]);
            (ball - centre).norm() < reach + radius + bound
                && self.data.geom_distance(geom, self.ball_geom, 2.0 * reach, None) < reach
        })
    }

    /// The robot.
    #[must_use]
    pub fn robot(&self) -> &Arc<Robot> {
        &self.robot
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

    /// Work that the motors have done since the last reset, J.
    #[must_use]
    pub fn motor_work(&self) -> f64 {
        self.motor_work
    }

    /// Work that pushes have done since the last reset, J.
    #[must_use]
    pub fn push_work(&self) -> f64 {
        self.push_work
    }

    /// Kinetic and potential energy (J) of robot and ball in a state, which becomes the world's.
    pub(crate) fn energy(&mut self, q: &[f64], v: &[f64], ball: &BallState) -> [f64; 2] {
        let (nq, nv) = (self.robot.nq(), self.robot.nv());
        self.data.qpos_mut()[..nq].copy_from_slice(q);
        self.data.qvel_mut()[..nv].copy_from_slice(v);
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
        let body = usize::try_from(self.data.model().geom_bodyid()[geom]).unwrap_or(0);
        let name = if body == 0 { "the ground" } else { self.robot.link_name(body) };
        (depth > OVERLAP).then(|| (name.to_owned(), depth))
    }

    /// The robot's position, 7 + n.
    #[must_use]
    pub fn q(&self) -> &[f64] {
        &self.data.qpos()[..self.robot.nq()]
    }

    /// The robot's speed, 6 + n.
    #[must_use]
    pub fn v(&self) -> &[f64] {
        &self.data.qvel()[..self.robot.nv()]
    }

    /// The torques of the last step, N m.
    #[must_use]
    pub fn torques(&self) -> &[f64] {
        &self.data.qfrc_applied()[6..self.robot.nv()]
    }

    /// The ball.
    #[must_use]
    pub fn ball(&self) -> BallState {
        let q = &self.data.qpos()[self.robot.nq()..];
        let v = &self.data.qvel()[self.robot.nv()..];
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
        &self.peaks
    }

    /// Whether the last step was a near one.
    #[must_use]
    pub fn is_near_step(&self) -> bool {
        self.near
    }

    /// Force of the ground on each contact point in the world, N, as of the last step; `forces` has one entry a point.
    pub fn contact_forces_into(&self, forces: &mut [Vector3<f64>]) {
        forces.fill(Vector3::zeros());
        for (i, contact) in self.data.contact().iter().enumerate() {
            let [a, b] = contact.geom.map(|geom| usize::try_from(geom).unwrap_or(usize::MAX));
            let (point, sign) = match (a == self.floor_geom, b == self.floor_geom) {
                (true, false) => (b, 1.0),
                (false, true) => (a, -1.0),
                _ => continue,
            };
            if let Some(index) = self.contact_of_geom.get(point).copied().flatten() {
                forces[index] += contact_force(&self.data, i) * sign;
            }
        }
    }

    /// Whether a part of the robot other than its feet touches the ground.
    #[must_use]
    pub fn body_touches_ground(&self) -> bool {
        self.data.contact().iter().any(|contact| {
            let [a, b] = contact.geom.map(|geom| usize::try_from(geom).unwrap_or(usize::MAX));
            let other = if a == self.floor_geom {
                b
            } else if b == self.floor_geom {
                a
            } else {
                return false;
            };
            contact.dist < 0.0 && self.is_body.get(other).copied().unwrap_or(false)
        })
    }

    /// Origin of a link (m) and `world_from_link`, as of the start of the last step.
    pub(crate) fn link_pose(&self, link: usize) -> (Vector3<f64>, Matrix3<f64>) {
        (self.data.xpos()[link].into(), Matrix3::from_row_slice(&self.data.xmat()[link]))
    }

    /// `world_from_camera` of the robot's `camera`, m, as of the start of the last step.
    #[must_use]
    pub fn camera_pose(&self, camera: &Camera) -> Isometry3<f64> {
        let (origin, rotation) = self.link_pose(camera.at.link);
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Isometry3::from_parts((origin + rotation * camera.at.point).into(), turn * camera.link_from_camera)
    }

    /// `world_from_heading`: the base link's ground projection and its heading.
    #[must_use]
    pub fn heading(&self) -> Isometry3<f64> {
        let q = self.q();
        let yaw = orientation(q).euler_angles().2;
        Isometry3::new(Vector3::new(q[0], q[1], 0.0), Vector3::z() * yaw)
    }

    /// Whether nothing but the link `but` stands between `from` and the ball at `to` (m).
    pub(crate) fn sees(&self, from: Vector3<f64>, to: Vector3<f64>, but: usize) -> bool {
        let way = to - from;
        let distance = way.norm();
        let (from, way) = ([from.x, from.y, from.z], [way.x / distance, way.y / distance, way.z / distance]);
        let mut geom = -1;
        // SAFETY: model and data belong together, the vectors have three numbers, no groups and no normal are asked for.
        let hit = unsafe {
            mujoco_c::mj_ray(
                self.data.model().ffi(),
                self.data.ffi(),
                &raw const from,
                &raw const way,
                std::ptr::null(),
                true,
                i32::try_from(but).unwrap_or(-1),
                &raw mut geom,
                std::ptr::null_mut(),
            )
        };
        usize::try_from(geom).is_ok_and(|geom| geom == self.ball_geom)
            || !(0.0..distance - self.settings.ball.radius).contains(&hit)
    }

    /// Fits other encoders, whose zeros (rad) are off by `offsets`.
    pub(crate) fn set_encoder_offsets(&mut self, offsets: &[f64]) {
        self.encoder_offsets.copy_from_slice(offsets);
    }

    /// Every contact of the ball with the robot in the last step.
    pub(crate) fn ball_strikes(&self) -> impl Iterator<Item = Strike> {
        self.data.contact().iter().enumerate().filter_map(|(i, contact)| {
            let [a, b] = contact.geom.map(|geom| usize::try_from(geom).unwrap_or(usize::MAX));
            if a == self.floor_geom || b == self.floor_geom {
                return None;
            }
            let (striker, sign) = match (a == self.ball_geom, b == self.ball_geom) {
                (false, true) => (a, 1.0),
                (true, false) => (b, -1.0),
                _ => return None,
            };
            let link = usize::try_from(self.data.model().geom_bodyid()[striker]).ok()?;
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
