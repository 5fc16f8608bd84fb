//! The gait on a known state: stands, starts, steps, stops; chooses footholds, leads the swing foot and the body, and has the
//! whole-body controller find the torques.
//!
//! On both feet the centre of mass is led; on one foot it falls as it must and the next foothold catches it
//! ([`crate::footsteps`]). There is no double support between steps. A start pushes off from the foot that is lifted first ([`crate::start`]); a
//! stop is a step in place after which both feet stay. Estimates of the state come from outside ([`StateEstimate`]).

use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::control::JointCommand;
use instep_robot::{Robot, RobotData};
use nalgebra::{Rotation2, UnitQuaternion, Vector2, Vector3};

use crate::footsteps::{Pendulum, PendulumState, Plan, Reach};
use crate::offsets::{Learner, Offsets};
use crate::settings::{GRAVITY, Velocity, WalkSettings};
use crate::start::Start;
use crate::swing::{Swing, Waypoint};
use crate::whole_body::{Outcome, Targets, WholeBody};
use crate::{StateEstimate, WalkError};

/// How far the capture point may be from the middle of the feet when a gait ends, and how far before a standing robot steps:
/// share of the half length of a foot, and share of half the distance across.
const STOP: [f64; 2] = [0.7, 0.75];
/// See [`STOP`].
const BALANCE: [f64; 2] = [0.9, 0.9];
/// Farthest apart that the feet may be ahead when a gait ends, as a share of the height of the centre of mass.
const STAGGER: f64 = 0.27;
/// How much faster a gait slows down than it speeds up.
const BRAKE: f64 = 16.0;
/// How much faster the last steps are.
const HURRY: f64 = 1.35;
/// Where a body that has stopped is led first, as a share of the way from the middle of the feet to its capture point: short of that it comes to
/// rest sooner.
const SETTLE: f64 = 0.65;
/// What is left between the feet when they come closest in a walk sideways, m, beyond the nearest foothold.
const SPARE: f64 = 0.01;
/// How soon the rate of a step follows what is wanted of it, s.
const RATE_LAG: f64 = 0.02;
/// A step whose rate is farther off the nominal one than this share was disturbed.
const DISTURBED: f64 = 0.25;
/// How fast a standing body goes back over the middle of its feet, as a share of sqrt(g H): slower than what counts as a stop.
const CREEP: f64 = 0.02;
/// Fastest change of the height of the centre of mass that is asked, as a share of the height a second.
const HEIGHT_RATE: f64 = 0.35;

/// What the gait does.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Mode {
    /// Stands on both feet.
    #[default]
    Stand,
    /// On both feet, the weight going over `support`.
    Shift {
        /// The first support foot.
        support: Side,
    },
    /// On `support`, the other foot swinging.
    Step {
        /// The support foot.
        support: Side,
    },
}

/// One step that was made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footstep {
    /// When the foot came down, s.
    pub time: f64,
    /// The foot.
    pub side: Side,
    /// Where its reference point came down, m, odometry frame.
    pub position: Vector3<f64>,
    /// Heading of the gait, rad.
    pub heading: f64,
}

/// How often something out of the ordinary happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Control ticks.
    pub ticks: usize,
    /// Ticks whose problem was solved without joint ranges.
    pub relaxed: usize,
    /// Ticks without solution: the last accelerations were used, without their speed.
    pub unsolved: usize,
    /// Touchdowns taken for granted because the time was up.
    pub late: usize,
    /// Steps.
    pub steps: usize,
}

/// What the gait wants and sees in a tick; for reports and for the kick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GaitView {
    /// What it does.
    pub mode: Mode,
    /// Phase of the step, 0 at lift-off, 1 when the foot is due.
    pub phase: f64,
    /// Momentum about the contact over m H, (L_y, -L_x) in the heading's axes, now and as wanted at the end of the step, m/s.
    pub momentum: Vector2<f64>,
    /// See `momentum`; as wanted at the end of the step.
    pub wanted: Vector2<f64>,
    /// The next foothold, odometry frame, m.
    pub foothold: Vector3<f64>,
    /// Heading, rad, odometry frame.
    pub heading: f64,
    /// Centre of mass, m, odometry frame.
    pub com: Vector3<f64>,
    /// Its velocity, m/s.
    pub com_velocity: Vector3<f64>,
    /// Reference points of both feet, m, odometry frame.
    pub feet: [Vector3<f64>; 2],
}

/// The gait with all that it needs.
#[derive(Debug)]
pub struct Gait {
    robot: Arc<Robot>,
    settings: WalkSettings,
    data: RobotData,
    body: WholeBody,
    pendulum: Pendulum,
    learner: Learner,
    mode: Mode,
    /// When the present mode or step began, s.
    since: f64,
    /// Of the step, and how fast it runs, 1/s.
    phase: f64,
    rate: f64,
    last_time: f64,
    /// Since the tick before, s.
    period: f64,
    heading: f64,
    /// Heading of a standing body from the mean one of its feet, rad.
    toe: f64,
    height: f64,
    asked: Velocity,
    velocity: Velocity,
    /// Velocity ahead at the last two lift-offs, m/s.
    paced: [f64; 2],
    /// Where the swing foot left the ground, m, and its heading then, rad.
    lift_off: (Vector3<f64>, f64),
    /// Waypoint of the swing foot at phase 1/2, m, odometry frame, for the present step.
    waypoint: Option<Vector3<f64>>,
    /// Where a standing body is led, from the middle of the feet, odometry's axes, m: first about where it comes to rest by itself.
    rest: Vector2<f64>,
    /// The shift that is under way, or the last one.
    start: Start,
    reference: JointCommand,
    started: bool,
    counts: Counts,
    view: GaitView,
    footstep: Option<Footstep>,
}

impl Gait {
    /// For `robot` with `settings`; stands.
    ///
    /// # Errors
    /// When the robot has not what walking needs.
    pub fn new(robot: Arc<Robot>, settings: WalkSettings) -> Result<Self, WalkError> {
        WalkSettings::of(&robot)?;
        let data = robot.data();
        let body = WholeBody::new(Arc::clone(&robot), settings.control.clone());
        let gait = &settings.gait;
        let step_time = gait.step_time;
        let pendulum = Pendulum::of(gait);
        let zero = Vector3::zeros();
        Ok(Self {
            reference: JointCommand::zeros(robot.joints.len()),
            height: data.com().z,
            robot,
            settings,
            data,
            body,
            learner: Learner::new(pendulum.lambda, pendulum.step_time),
            pendulum,
            mode: Mode::Stand,
            since: 0.0,
            phase: 0.0,
            rate: 1.0 / step_time,
            last_time: 0.0,
            period: 0.0,
            heading: 0.0,
            toe: 0.0,
            asked: Velocity::default(),
            velocity: Velocity::default(),
            paced: [0.0; 2],
            lift_off: (zero, 0.0),
            waypoint: None,
            rest: Vector2::zeros(),
            start: Start::default(),
            started: false,
            counts: Counts::default(),
            view: GaitView::default(),
            footstep: None,
        })
    }

    /// Asks for a velocity from now on; returns what the robot is allowed.
    pub fn set_velocity(&mut self, velocity: Velocity) -> Velocity {
        self.asked = self.settings.limits.clip(velocity);
        self.asked
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &WalkSettings {
        &self.settings
    }

    /// What is seen and wanted.
    #[must_use]
    pub fn view(&self) -> &GaitView {
        &self.view
    }

    /// The velocity that the gait is at on its way to what was asked.
    #[must_use]
    pub fn velocity(&self) -> Velocity {
        self.velocity
    }

    /// The whole-body controller's last solution.
    #[must_use]
    pub fn body(&self) -> &WholeBody {
        &self.body
    }

    /// What the pendulum leaves out, as learned so far.
    #[must_use]
    pub fn offsets(&self) -> Offsets {
        self.learner.offsets
    }

    /// What happened how often.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The step that ended in the last tick, if one did.
    #[must_use]
    pub fn footstep(&self) -> Option<Footstep> {
        self.footstep
    }

    /// Velocity ahead along `heading` (rad, odometry frame) with which the support foot of the step that is `steps` from now
    /// will stand `way` (m) along it from the present one; `None` when nothing can be told: no step is under way.
    pub fn velocity_for(&mut self, steps: usize, way: f64, heading: f64) -> Option<f64> {
        let Mode::Step { support } = self.mode else { return None };
        if steps == 0 {
            return None;
        }
        let left = self.left();
        let raw = self.pendulum_state(support, heading);
        let Offsets { touchdown, speed, .. } = self.learner.offsets;
        let after = |x: f64| {
            let state = self.learner.corrected(&raw, self.fed(x));
            let velocity = Vector2::new(x, 0.0) + speed;
            self.pendulum.contact_after(&state, left, velocity, touchdown, support, steps).x
        };
        let (still, slope) = (after(0.0), after(1.0) - after(0.0));
        (slope.abs() > 1e-6).then(|| (way - still) / slope)
    }

    /// The present swing, as it would be led through `waypoint` (m, odometry frame).
    #[must_use]
    pub fn swing(&self, waypoint: Option<Vector3<f64>>) -> Swing {
        let gait = &self.settings.gait;
        Swing {
            from: self.lift_off.0,
            waypoint,
            clearance: gait.clearance,
            to: self.view.foothold,
            landing_speed: gait.landing_speed,
            duration: gait.step_time,
        }
    }

    /// Leads the present swing through `waypoint` (m, odometry frame) at phase 1/2; until the foot comes down.
    pub fn set_waypoint(&mut self, waypoint: Vector3<f64>) {
        self.waypoint = Some(waypoint);
    }

    /// One tick: reads `state`, writes `command`. The three stages can be called one by one, to time them.
    pub fn tick(&mut self, state: &StateEstimate, command: &mut JointCommand) {
        let targets = self.plan(state);
        let outcome = self.solve(&targets);
        self.write(state, outcome, command);
    }

    /// First stage: what is wanted in this tick.
    pub fn plan(&mut self, state: &StateEstimate) -> Targets {
        self.data.set_state(&state.q, &state.v);
        let period = if self.started { (state.time - self.last_time).max(0.0) } else { 0.0 };
        self.period = period;
        self.last_time = state.time;
        self.footstep = None;
        self.look(state);
        if !self.started {
            self.started = true;
            self.since = state.time;
            self.heading = self.link_heading(self.robot.base);
            self.toe = wrap(self.heading - self.feet_heading());
            self.view.heading = self.heading;
            self.height = self.view.com.z - self.ground();
            self.reference.positions.copy_from_slice(&state.q[7..]);
            self.reference.velocities.fill(0.0);
        }
        self.counts.ticks += 1;
        self.approach(period);
        self.change(state);
        self.heading += if matches!(self.mode, Mode::Step { .. }) {
            self.velocity.turn * period
        } else {
            wrap(self.feet_heading() + self.toe - self.heading)
        };
        self.view.heading = self.heading;
        let lowest = self.height - HEIGHT_RATE * self.settings.gait.height * period;
        self.height = self.settings.gait.height.max(lowest);
        match self.mode {
            Mode::Stand => self.stand(None),
            Mode::Shift { support } => self.stand(Some(support)),
            Mode::Step { support } => self.step(support, state.time),
        }
    }

    /// Second stage: accelerations, forces and torques for `targets`.
    pub fn solve(&mut self, targets: &Targets) -> Outcome {
        self.body.solve(&mut self.data, targets)
    }

    /// Positions and momentum of this tick.
    fn look(&mut self, _state: &StateEstimate) {
        let momentum = self.data.momentum();
        self.view.com = self.data.com();
        self.view.com_velocity = Vector3::new(momentum[0], momentum[1], momentum[2]) / self.robot.mass();
        for (at, foot) in self.view.feet.iter_mut().zip(&self.body.feet) {
            *at = self.data.point(&foot.reference);
        }
        self.view.mode = self.mode;
    }

    /// The pendulum's state about the reference of `support`, in the axes of `heading`.
    fn pendulum_state(&mut self, support: Side, heading: f64) -> PendulumState {
        let momentum = self.data.momentum();
        let arm = self.view.com - self.view.feet[support as usize];
        let about = Vector3::new(momentum[3], momentum[4], momentum[5])
            + arm.cross(&Vector3::new(momentum[0], momentum[1], momentum[2]));
        let scale = 1.0 / (self.robot.mass() * self.settings.gait.height);
        let turn = Rotation2::new(-heading);
        PendulumState { position: turn * arm.xy(), momentum: turn * Vector2::new(about.y, -about.x) * scale }
    }

    /// Time until the swing foot is expected to come down, s.
    fn left(&self) -> f64 {
        let due = self.learner.offsets.step_time / self.settings.gait.step_time;
        ((due - self.phase) / self.rate).max(0.0)
    }

    /// What the momentum of a gait ahead at `speed` (m/s) has beyond that of the pendulum, m/s.
    fn fed(&self, speed: f64) -> Vector2<f64> {
        Vector2::new(speed * (1.0 / self.settings.gait.speed_gain - 1.0), 0.0)
    }

    fn link_heading(&self, link: usize) -> f64 {
        let ahead = self.data.link_matrix(link).column(0).into_owned();
        ahead.y.atan2(ahead.x)
    }

    /// Mean heading of the feet, rad.
    fn feet_heading(&self) -> f64 {
        let [left, right] = self.body.feet.each_ref().map(|foot| self.link_heading(foot.reference.link));
        right + 0.5 * wrap(left - right)
    }

    /// Speed ahead of a gait whose legs all swing as in the present step, m/s: from where the one before the last put the foot to where it is to
    /// be now. (Told by the foothold itself it would feed back on the foothold.)
    fn swung(&self) -> f64 {
        0.5 * (self.paced[0] + self.paced[1])
    }

    /// Height of the ground under the feet that carry, m.
    fn ground(&self) -> f64 {
        match self.mode {
            Mode::Step { support } => self.view.feet[support as usize].z,
            _ => 0.5 * (self.view.feet[0].z + self.view.feet[1].z),
        }
    }

    /// The velocity goes toward what was asked as fast as the limits allow.
    fn approach(&mut self, period: f64) {
        self.velocity = match self.mode {
            Mode::Step { .. } => self.settings.limits.approach(self.velocity, self.asked, BRAKE, period),
            _ => Velocity::default(),
        };
    }

    /// A standing body's rest creeps to the middle of the feet.
    fn creep(&mut self) {
        let way = CREEP * (GRAVITY * self.settings.gait.height).sqrt() * self.period;
        let length = self.rest.norm();
        self.rest *= if length > way { 1.0 - way / length } else { 0.0 };
    }

    /// Changes of the mode: start, touchdown, stop.
    fn change(&mut self, state: &StateEstimate) {
        let gait = &self.settings.gait;
        let elapsed = state.time - self.since;
        match self.mode {
            Mode::Stand => {
                let capture = self.capture();
                if !self.is_held(capture, BALANCE) {
                    // A push: the foot on the side that it falls to carries, the other steps.
                    let support = if capture.y > 0.0 { Side::Left } else { Side::Right };
                    self.lift(support, state.time);
                } else if !self.asked.is_zero() {
                    let leftward = self.asked.y > 0.0 || (self.asked.y == 0.0 && self.asked.turn > 0.0);
                    let support = if leftward { Side::Right } else { Side::Left };
                    let middle = 0.5 * (self.view.feet[0] + self.view.feet[1]);
                    let from = Rotation2::new(-self.heading) * (self.view.com - middle).xy();
                    let foot = if support == Side::Left { 0.5 } else { -0.5 } * self.apart();
                    // The sway of a walk with the feet as far apart as they are.
                    self.pendulum.width = self.apart().y;
                    self.start =
                        Start::new(from, foot, -self.pendulum.sway(support), self.pendulum.lambda, gait.start_time);
                    self.mode = Mode::Shift { support };
                    self.since = state.time;
                }
            }
            Mode::Shift { support } => {
                if elapsed >= self.start.duration() {
                    self.lift(support, state.time);
                }
            }
            Mode::Step { support } => {
                let swing = support.other();
                self.phase += self.rate * self.period;
                let late = self.phase > 1.0 + gait.latest * self.rate;
                if late || (self.phase > gait.earliest && state.contact[swing as usize]) {
                    self.counts.late += usize::from(late && !state.contact[swing as usize]);
                    self.counts.steps += 1;
                    let position = self.view.feet[swing as usize];
                    self.footstep = Some(Footstep { time: state.time, side: swing, position, heading: self.heading });
                    self.learner.touch_down();
                    if self.may_stop() {
                        self.mode = Mode::Stand;
                        self.rest = Rotation2::new(self.heading) * self.capture() * SETTLE;
                        self.toe = wrap(self.heading - self.feet_heading());
                        self.since = state.time;
                        self.waypoint = None;
                    } else {
                        self.lift(swing, state.time);
                    }
                }
            }
        }
        self.view.mode = self.mode;
    }

    /// The capture point from the middle of the feet, in the heading's axes, m.
    fn capture(&self) -> Vector2<f64> {
        let middle = 0.5 * (self.view.feet[0] + self.view.feet[1]);
        let point = self.view.com + self.view.com_velocity / self.pendulum.lambda;
        Rotation2::new(-self.heading) * (point - middle).xy()
    }

    /// Left foot from the right one, in the heading's axes, m.
    fn apart(&self) -> Vector2<f64> {
        Rotation2::new(-self.heading) * (self.view.feet[0] - self.view.feet[1]).xy()
    }

    /// Whether both feet can hold a body whose capture point is at `capture`, with `shares` of what they have.
    fn is_held(&self, capture: Vector2<f64>, shares: [f64; 2]) -> bool {
        let apart = self.apart();
        // The feet are two parallel lines: their hull is as long as a foot everywhere, about the line that joins the middles.
        let along = capture.x - capture.y / apart.y.max(1e-3) * apart.x;
        along.abs() < shares[0] * self.body.feet[0].half_length && capture.y.abs() < 0.5 * shares[1] * apart.y
    }

    /// Whether the gait may end on both feet.
    fn may_stop(&self) -> bool {
        self.asked.is_zero()
            && self.velocity.is_zero()
            && self.apart().x.abs() < STAGGER * self.settings.gait.height
            && self.is_held(self.capture(), STOP)
    }

    /// The foot other than `support` leaves the ground.
    fn lift(&mut self, support: Side, time: f64) {
        let swing = support.other();
        let heading = self.link_heading(self.body.feet[swing as usize].reference.link);
        self.lift_off = (self.view.feet[swing as usize], self.heading + wrap(heading - self.heading));
        self.paced = [self.paced[1], self.velocity.x];
        self.mode = Mode::Step { support };
        self.since = time;
        self.waypoint = None;
        (self.phase, self.rate) = (0.0, 1.0 / self.settings.gait.step_time);
    }

    fn base(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(0.0, self.settings.gait.lean, self.heading)
    }

    /// On both feet; with `support` the weight goes over it.
    fn stand(&mut self, support: Option<Side>) -> Targets {
        let [left, right] = self.view.feet;
        let middle = 0.5 * (left + right);
        let mut shift = Waypoint { position: middle, velocity: Vector3::zeros(), acceleration: Vector3::zeros() };
        if support.is_none() {
            self.creep();
            shift.position += Vector3::new(self.rest.x, self.rest.y, 0.0);
        }
        if support.is_some() {
            let turn = Rotation2::new(self.heading);
            let [position, velocity, acceleration] =
                self.start.at(self.last_time - self.since).map(|moved| turn * moved);
            shift.position += Vector3::new(position.x, position.y, 0.0);
            shift.velocity += Vector3::new(velocity.x, velocity.y, 0.0);
            shift.acceleration += Vector3::new(acceleration.x, acceleration.y, 0.0);
        }
        self.view.phase = 0.0;
        // A standing body keeps its heading to its feet, which its legs tell exactly. Held to the world, it turns as fast as its gyro
        // is wrong: the feet creep along, and the estimate, which believes that they stand, takes that for a bias.
        let [left, right] = [0, 1].map(|side| self.body.feet[side].reference.link);
        let turn = 0.5 * (self.data.link_rate(left).z + self.data.link_rate(right).z);
        Targets {
            support: [true; 2],
            base: self.base(),
            turn,
            height: [middle.z + self.height, 0.0],
            shift: Some(shift),
            swing: None,
            swing_pitch: 0.0,
        }
    }

    /// On `support`.
    fn step(&mut self, support: Side, time: f64) -> Targets {
        let gait = &self.settings.gait;
        let step_time = gait.step_time;
        let reach = Reach { ahead: gait.reach, across: gait.across };
        let (swing, phase) = (support.other(), self.phase);
        let velocity = Vector2::new(self.velocity.x, self.velocity.y);
        self.pendulum.width = gait.width.max(velocity.y.abs() * step_time + reach.across[0] + SPARE);
        // A stop takes all momentum away at once.
        self.pendulum.alpha = if self.asked.is_zero() { 1.0 } else { gait.alpha };
        let (turn, fed, touchdown) = (self.velocity.turn, self.fed(self.swung()), self.learner.offsets.touchdown);
        // Frames turn: the foothold is chosen in the axes that the gait will have at the touchdown.
        self.pendulum.step_time = self.learner.offsets.step_time;
        let hurry = if self.asked.is_zero() { HURRY } else { 1.0 };
        self.pendulum.step_time /= hurry;
        let left = self.left();
        let heading = self.heading + turn * left;
        let raw = self.pendulum_state(support, heading);
        let state = self.learner.corrected(&raw, fed);
        let foothold =
            |pendulum: &Pendulum, left: f64| pendulum.foothold(&state, left, velocity, turn, touchdown, swing);
        if self.waypoint.is_none() {
            let Plan { rate, .. } = self.pendulum.time(left * self.rate, hurry / step_time, &reach, swing, foothold);
            self.rate += (rate - self.rate) * (1.0 - (-self.period / RATE_LAG).exp());
        }
        if (self.rate * step_time - 1.0).abs() > DISTURBED {
            self.learner.forget_step();
        }
        let step = reach.clip(foothold(&self.pendulum, left), swing);
        let end = self.pendulum.ahead(&state, left);
        let begins = PendulumState { position: end.position - step, momentum: end.momentum };
        self.learner.look(time, heading, &raw, fed, &begins);
        let moved = Rotation2::new(heading) * step;
        let contact = self.view.feet[support as usize];
        let foothold = contact + Vector3::new(moved.x, moved.y, 0.0);
        // The swing foot turns to the heading of the middle of its stance.
        let to = heading + 0.5 * turn * step_time;
        let (turned, rate) = ease(self.lift_off.1, to, phase, 1.0 / self.rate);
        self.view.phase = phase;
        self.view.momentum = state.momentum;
        self.view.wanted = self.pendulum.wanted(velocity, support);
        self.view.foothold = foothold;
        let mut way = self.swing(self.waypoint).at(phase);
        let pace = self.rate * step_time;
        way.velocity *= pace;
        way.acceleration *= pace * pace;
        let mut carries = [false; 2];
        carries[support as usize] = true;
        Targets {
            support: carries,
            base: self.base(),
            turn,
            height: [contact.z + self.height, 0.0],
            shift: None,
            swing: Some((swing, way, [turned, rate])),
            swing_pitch: 0.0,
        }
    }

    /// Counts how a tick was solved.
    fn count(&mut self, outcome: Outcome) {
        match outcome {
            Outcome::Solved => {}
            Outcome::Relaxed => self.counts.relaxed += 1,
            Outcome::Unsolved => self.counts.unsolved += 1,
        }
    }

    /// Last stage: torques, with a joint reference that is integrated from the accelerations and leaks to what is measured.
    pub fn write(&mut self, state: &StateEstimate, outcome: Outcome, command: &mut JointCommand) {
        let period = self.period;
        self.count(outcome);
        if outcome == Outcome::Unsolved {
            // The last torques, and the drives brake the joints where they are.
            self.reference.velocities.fill(0.0);
            command.velocities.fill(0.0);
            command.positions.copy_from_slice(&state.q[7..]);
            return;
        }
        let share = 1.0 - (-self.settings.drive.leak * period).exp();
        for j in 0..self.robot.joints.len() {
            let (q, v) = (state.q[7 + j], state.v[6 + j]);
            let (position, velocity) = (&mut self.reference.positions[j], &mut self.reference.velocities[j]);
            *position += *velocity * period + share * (q - *position);
            *velocity += self.body.acceleration[6 + j] * period + share * (v - *velocity);
            command.positions[j] = *position;
            command.velocities[j] = *velocity;
            command.torques[j] = self.body.torques[j];
        }
    }
}

/// An angle that goes smoothly from `from` to `to` over phases 0 to 1, with its rate.
fn ease(from: f64, to: f64, phase: f64, duration: f64) -> (f64, f64) {
    let s = phase.clamp(0.0, 1.0);
    let way = to - from;
    (from + way * s * s * (3.0 - 2.0 * s), way * 6.0 * s * (1.0 - s) / duration)
}

fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}
