//! A standing kick with the way to it: walks to where the engine can kick the ball from, stops, looks, and has it kicked.
//!
//! The place is the engine's own word ([`KickEngine::where_to_stand`]); on the way the ball is seen as the robot's senses show it, and the place
//! moves with it. When the engine refuses from where the robot came to stand, it says where else, and the robot steps there; after [`TRIES`]
//! refusals it gives up. Its start is the stand, the ball a walk away. Knows no obstacles.

use std::sync::Arc;

use instep_kick::{
    BreakOff, KickEngine, KickPlan, KickRequest, KickStart, KickStatus, Phase, Progress, Refusal, Standing,
};
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_walk::ball::BallMemory;
use instep_walk::gait::Mode;
use instep_walk::{Velocity, WalkSettings, Walker, approach};
use nalgebra::{Rotation2, Vector2};
use serde::{Deserialize, Serialize};

use crate::BenchError;
use crate::run_up;

/// How often the robot steps to another place before it gives up.
const TRIES: usize = 4;
/// How long a robot stands before it goes over into the engine's stand, how long that takes, and how long it then looks at the ball, s.
const PAUSES: [f64; 3] = [0.4, 1.5, 0.4];
/// Forecast of the walk, m/s as a share of the fastest, and what starts and stops take, s.
const WAY: (f64, f64) = (0.5, 4.0);
/// A walk that takes so many times its forecast is given up.
const PATIENCE: f64 = 3.0;

/// `walk-up.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WalkUpSettings {
    /// The engine that kicks.
    pub engine: String,
    /// The kick of its own start: ball in the footprint frame, m, and speed, m/s.
    pub ball: [f64; 2],
    /// See `ball`.
    pub speed: f64,
}

/// What it does, since when in s.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    Idle,
    Approach,
    Stop(f64),
    Settle(f64),
    Kick,
    Done,
}

/// A kick as it was asked, told in the odometry's frame.
#[derive(Debug, Clone, Copy)]
struct Asked {
    request: KickRequest,
    direction: f64,
    /// Where to stand, from the ball along the kick (m), and the heading there from the kick's direction, rad.
    place: (Vector2<f64>, f64),
}

/// The engine with its legs.
pub struct WalkUp {
    engine: Box<dyn KickEngine + Send>,
    walker: Walker,
    walk: WalkSettings,
    start: KickStart,
    /// From the base's ground projection to the footprint while the robot stands, m.
    footprint: Vector2<f64>,
    ball: BallMemory,
    stage: Stage,
    asked: Option<Asked>,
    tries: usize,
    plan: Option<KickPlan>,
    /// When it was planned, and now, s.
    times: [f64; 2],
    cancelled: bool,
    given_up: Option<BreakOff>,
    from: Vec<f64>,
    scratch: JointCommand,
}

impl WalkUp {
    /// `engine` on the legs of `robot`, whose footprint is at `footprint` (m, world frame) in its stand.
    ///
    /// # Errors
    /// When the robot cannot walk.
    pub fn new(
        robot: &Arc<Robot>,
        engine: Box<dyn KickEngine + Send>,
        settings: &WalkUpSettings,
        footprint: [f64; 2],
    ) -> Result<Self, BenchError> {
        let walk = WalkSettings::load(robot)?;
        let joints = robot.joints.len();
        let start = KickStart {
            q: robot.stand.clone(),
            v: vec![0.0; robot.nv()],
            footprint,
            request: KickRequest::new(settings.ball, 0.0, settings.speed),
        };
        Ok(Self {
            walker: Walker::new(Arc::clone(robot), walk.clone())?,
            walk,
            engine,
            start,
            footprint: Vector2::new(footprint[0] - robot.stand[0], footprint[1] - robot.stand[1]),
            ball: BallMemory::default(),
            stage: Stage::Idle,
            asked: None,
            tries: 0,
            plan: None,
            times: [0.0; 2],
            cancelled: false,
            given_up: None,
            from: vec![0.0; joints],
            scratch: JointCommand::zeros(joints),
        })
    }

    /// Pose of the footprint in the odometry's frame.
    fn pose(&self) -> (Vector2<f64>, f64) {
        let [x, y, heading] = self.walker.odometry();
        (Vector2::new(x, y) + Rotation2::new(heading) * self.footprint, heading)
    }

    /// The kick as it is asked from where the robot is now.
    fn local(&self, asked: &Asked) -> Option<KickRequest> {
        let ball = self.ball.position()?;
        let (at, heading) = self.pose();
        let ball = Rotation2::new(-heading) * (ball - at);
        Some(KickRequest { ball: ball.into(), direction: wrap(asked.direction - heading), ..asked.request })
    }

    /// Velocity toward the place, which goes with the ball; zero when there.
    fn toward(&self, asked: &Asked) -> Velocity {
        let Some(ball) = self.ball.position() else { return Velocity::default() };
        let (place, turned) = asked.place;
        let goal = ball + Rotation2::new(asked.direction) * place;
        let (at, heading) = self.pose();
        approach::toward([at.x, at.y, heading], [goal.x, goal.y, asked.direction + turned], &self.walk.limits)
    }

    fn is_running(&self) -> bool {
        !matches!(self.stage, Stage::Idle | Stage::Done)
    }

    /// Whether there will be no kick: it stops, and goes over into the engine's stand all the same.
    fn is_off(&self) -> bool {
        self.cancelled || self.given_up.is_some()
    }

    /// From the stand: kicks, or steps elsewhere.
    fn begin(&mut self, sensors: &Sensors) {
        let Some((asked, local)) = self.asked.and_then(|asked| Some((asked, self.local(&asked)?))) else { return };
        match self.engine.plan(&local, sensors) {
            Ok(_) => {
                self.stage = Stage::Kick;
            }
            Err(_) if self.tries < TRIES => {
                self.tries += 1;
                match self.engine.where_to_stand(&local) {
                    Some(stand) => {
                        self.asked = Some(Asked { place: place(&local, &stand), ..asked });
                        self.walker.resume();
                        self.stage = Stage::Approach;
                    }
                    None => (self.given_up, self.stage) = (Some(BreakOff::Unaimed), Stage::Done),
                }
            }
            Err(_) => (self.given_up, self.stage) = (Some(BreakOff::Unaimed), Stage::Done),
        }
    }

    fn go_on(&mut self, sensors: &Sensors) {
        let now = sensors.time;
        match self.stage {
            Stage::Approach => {
                let velocity = self.asked.map_or_else(Velocity::default, |asked| self.toward(&asked));
                self.walker.set_velocity(velocity);
                if self.plan.is_some_and(|plan| now - self.times[0] > PATIENCE * plan.contact) {
                    self.given_up = Some(BreakOff::Late);
                }
                if velocity.is_zero() || self.is_off() {
                    self.stage = Stage::Stop(now);
                }
            }
            Stage::Stop(since) => {
                self.walker.set_velocity(Velocity::default());
                if self.walker.view().mode != Mode::Stand {
                    self.stage = Stage::Stop(now);
                } else if now - since > PAUSES[0] {
                    self.stage = Stage::Settle(now);
                }
            }
            Stage::Settle(since) if now - since > PAUSES[1] + PAUSES[2] => {
                if self.is_off() {
                    self.stage = Stage::Done;
                } else {
                    self.begin(sensors);
                }
            }
            Stage::Kick => {
                let status = self.engine.progress().status;
                if matches!(status, KickStatus::Finished | KickStatus::Cancelled) {
                    self.stage = Stage::Done;
                }
            }
            _ => {}
        }
    }
}

/// Where `stand` is from the ball of `request`, along the kick.
fn place(request: &KickRequest, stand: &Standing) -> (Vector2<f64>, f64) {
    let way = Vector2::from(stand.position) - Vector2::from(request.ball);
    (Rotation2::new(-request.direction) * way, wrap(stand.heading - request.direction))
}

fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

impl Controller for WalkUp {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        self.times[1] = sensors.time;
        self.ball.see(sensors);
        self.go_on(sensors);
        match self.stage {
            Stage::Approach | Stage::Stop(_) => {
                self.walker.tick(sensors, command);
                self.from.copy_from_slice(&command.positions);
            }
            _ => {
                // The walker stands on beside it, so that it knows where it is.
                self.walker.tick(sensors, &mut self.scratch);
                self.engine.tick(sensors, command);
            }
        }
        if let Stage::Settle(since) = self.stage {
            let s = ((sensors.time - since) / PAUSES[1]).clamp(0.0, 1.0);
            let share = s * s * (3.0 - 2.0 * s);
            for (position, from) in command.positions.iter_mut().zip(&self.from) {
                *position = from + (*position - from) * share;
            }
        }
        self.ball.at(sensors.time, self.walker.odometry());
    }
}

impl KickEngine for WalkUp {
    fn name(&self) -> &'static str {
        "walk-up"
    }

    fn control_period(&self) -> f64 {
        self.engine.control_period()
    }

    fn own_start(&self) -> Option<KickStart> {
        Some(self.start.clone())
    }

    fn plan(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<KickPlan, Refusal> {
        run_up::distance(request, self.is_running())?;
        // Where no place will do, the one for its own kick tells why.
        let own = KickRequest { strength: self.start.request.strength, ..*request };
        let stand = self.engine.where_to_stand(request).or_else(|| self.engine.where_to_stand(&own));
        let Some(stand) = stand else {
            // From here or from nowhere.
            let plan = self.engine.plan(request, sensors)?;
            (self.stage, self.plan) = (Stage::Kick, Some(plan));
            (self.times, self.cancelled, self.given_up) = ([sensors.time; 2], false, None);
            return Ok(plan);
        };
        let way = stand.position[0].hypot(stand.position[1]);
        let contact = WAY.1 + way / (WAY.0 * self.walk.limits.forward);
        if let Some(deadline) = request.deadline.filter(|&deadline| contact > deadline) {
            return Err(Refusal::TooLate { contact, deadline });
        }
        // What the engine itself forecasts there.
        let forecast = self.engine.plan(&stand.seen_from(request), sensors)?;
        self.engine.cancel();
        let (at, heading) = self.pose();
        self.ball.expect(at + Rotation2::new(heading) * Vector2::from(request.ball));
        self.asked = Some(Asked {
            request: *request,
            direction: wrap(heading + request.direction),
            place: place(request, &stand),
        });
        let plan = KickPlan { contact: contact + forecast.contact, duration: contact + forecast.duration, ..forecast };
        self.walker.resume();
        self.stage = Stage::Approach;
        self.plan = Some(plan);
        (self.times, self.tries) = ([sensors.time; 2], 0);
        (self.cancelled, self.given_up) = (false, None);
        Ok(plan)
    }

    /// Nothing is ever held.
    fn release(&mut self) {}

    fn cancel(&mut self) {
        self.cancelled = self.is_running();
        if self.stage == Stage::Kick {
            self.engine.cancel();
        }
    }

    fn progress(&self) -> Progress {
        let inner = self.engine.progress();
        let status = match (self.stage, self.cancelled) {
            (Stage::Idle, _) => KickStatus::Idle,
            (Stage::Done, false) => KickStatus::Finished,
            (Stage::Done, true) => KickStatus::Cancelled,
            (_, false) => KickStatus::Running,
            (_, true) => KickStatus::Cancelling,
        };
        let phase = match self.stage {
            Stage::Idle | Stage::Done => Phase::Stand,
            Stage::Kick => inner.phase,
            _ => Phase::Shift,
        };
        let running = self.is_running();
        let at = self.times[1] - self.times[0];
        let done = match (self.stage, self.plan) {
            (Stage::Done, _) => 1.0,
            (_, Some(plan)) if running => (at / plan.duration).clamp(0.0, 0.99),
            _ => 0.0,
        };
        let to_contact = match self.stage {
            Stage::Kick => inner.to_contact,
            _ => self.plan.filter(|_| running).map(|plan| plan.contact - at),
        };
        Progress { status, phase, done, to_contact, foot: inner.foot.filter(|_| running) }
    }

    fn broken_off(&self) -> Option<BreakOff> {
        self.given_up.or_else(|| self.engine.broken_off())
    }
}
