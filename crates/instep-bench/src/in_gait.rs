//! The kick within a step (paper 4's PLMK) as a kick engine: from the stand it walks up to the ball, kicks without stopping,
//! and comes to a stand. Its start is the stand, a run-up away from the ball.

use std::sync::Arc;

use instep_kick::{
    BallModel, BreakOff, Face, KickEngine, KickPlan, KickRequest, KickStart, KickStatus, Phase, Progress, Refusal,
    Strength,
};
use instep_motion::phase::Side;
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_walk::WalkSettings;
use instep_walk::in_gait::{Aim, InGait, InGaitSettings, Stage};

use crate::BenchError;
use crate::run_up;
use crate::walking::PERIOD;

/// The ball of its own start, footprint frame, m, and its speed as a share of the greatest.
const OWN: ([f64; 2], f64) = ([1.5, 0.1], 0.8);
/// Nearest ball that can be walked up to, m from the footprint.
const NEAREST: f64 = 0.45;
/// A kick that has not come this long after its forecast is given up, s.
const PATIENCE: f64 = 15.0;
/// Time from the contact to the stand, s, and from the ask to the first step.
const AFTER: f64 = 4.0;
/// See [`AFTER`].
const BEFORE: f64 = 1.2;

/// The engine.
#[derive(Debug)]
pub struct InGaitKick {
    kick: InGait,
    ball: BallModel,
    start: KickStart,
    plan: Option<KickPlan>,
    /// When it was planned, and now, s.
    times: [f64; 2],
    cancelled: bool,
    given_up: Option<BreakOff>,
}

impl InGaitKick {
    /// For `robot`.
    ///
    /// # Errors
    /// When the robot cannot walk, or its settings cannot be.
    pub fn new(
        robot: &Arc<Robot>,
        ball: BallModel,
        settings: InGaitSettings,
        footprint: [f64; 2],
    ) -> Result<Self, BenchError> {
        let walk = WalkSettings::load(robot)?;
        let speed = OWN.1 * settings.speeds()[1];
        let kick = InGait::new(Arc::clone(robot), walk, settings, ball.radius)?;
        let start = KickStart {
            q: robot.stand.clone(),
            v: vec![0.0; robot.nv()],
            footprint,
            request: KickRequest::new(OWN.0, 0.0, speed),
        };
        Ok(Self { kick, ball, start, plan: None, times: [0.0; 2], cancelled: false, given_up: None })
    }

    fn is_running(&self) -> bool {
        !matches!(self.kick.stage(), Stage::Idle | Stage::Done)
    }

    fn ball_speed(&self, strength: Strength) -> f64 {
        match strength {
            Strength::BallSpeed(speed) => speed,
            Strength::FootSpeed(speed) => speed * self.kick.settings().gain,
            Strength::Distance(distance) => (2.0 * self.ball.deceleration * distance).sqrt(),
        }
    }
}

impl Controller for InGaitKick {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        self.times[1] = sensors.time;
        let waits = matches!(self.kick.stage(), Stage::Approach | Stage::RunUp);
        if waits && self.plan.is_some_and(|plan| sensors.time - self.times[0] > plan.contact + PATIENCE) {
            self.kick.cancel();
            self.given_up = Some(BreakOff::Late);
        }
        self.kick.tick(sensors, command);
    }
}

impl KickEngine for InGaitKick {
    fn name(&self) -> &'static str {
        "in-gait"
    }

    fn control_period(&self) -> f64 {
        PERIOD
    }

    fn own_start(&self) -> Option<KickStart> {
        Some(self.start.clone())
    }

    fn plan(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<KickPlan, Refusal> {
        let distance = run_up::distance(request, self.is_running())?;
        if distance < NEAREST {
            return Err(Refusal::BallUnderRobot {
                gap: distance - self.ball.radius,
                least: NEAREST - self.ball.radius,
            });
        }
        let settings = self.kick.settings();
        let (speed, [_, most]) = (self.ball_speed(request.strength), settings.speeds());
        let foot = request.foot.unwrap_or(if request.ball[1] > 0.0 { Side::Left } else { Side::Right });
        if speed > most * 1.05 {
            let [asked, most] = [speed, most].map(|speed| speed / settings.gain);
            return Err(Refusal::TooStrong { foot, asked, most });
        }
        let contact = BEFORE + distance / settings.walk(speed);
        if let Some(deadline) = request.deadline.filter(|&deadline| contact > deadline) {
            return Err(Refusal::TooLate { contact, deadline });
        }
        let precision = settings.precision;
        if let Some(asked) = request.precision.filter(|&asked| precision > asked) {
            return Err(Refusal::TooImprecise { asked, possible: precision });
        }
        let foot_speed = speed / settings.gain;
        self.kick.ask(Aim { ball: request.ball, direction: request.direction, speed, foot: request.foot });
        let plan = KickPlan {
            foot: self.kick.foot(),
            face: Face::Front,
            contact,
            duration: contact + AFTER,
            foot_speed,
            ball_speed: speed,
            precision,
        };
        self.plan = Some(plan);
        self.times = [sensors.time; 2];
        (self.cancelled, self.given_up) = (false, None);
        Ok(plan)
    }

    /// Nothing is ever held.
    fn release(&mut self) {}

    fn cancel(&mut self) {
        self.cancelled = self.is_running();
        self.kick.cancel();
    }

    fn progress(&self) -> Progress {
        let stage = self.kick.stage();
        let phase = match stage {
            Stage::Idle | Stage::Done => Phase::Stand,
            Stage::Approach | Stage::RunUp => Phase::Shift,
            Stage::Kick => Phase::Kick,
            Stage::FollowThrough => Phase::MoveBack,
            Stage::Stop => Phase::ShiftBack,
        };
        let status = match (stage, self.cancelled) {
            (Stage::Idle, _) => KickStatus::Idle,
            (Stage::Done, false) => KickStatus::Finished,
            (Stage::Done, true) => KickStatus::Cancelled,
            (_, false) => KickStatus::Running,
            (_, true) => KickStatus::Cancelling,
        };
        let at = self.times[1] - self.times[0];
        let running = self.is_running();
        let done = match (stage, self.plan) {
            (Stage::Done, _) => 1.0,
            (_, Some(plan)) if running => (at / plan.duration).clamp(0.0, 0.99),
            _ => 0.0,
        };
        let to_contact = self.plan.filter(|_| running).map(|plan| plan.contact - at);
        Progress { status, phase, done, to_contact, foot: running.then_some(self.kick.foot()) }
    }

    fn broken_off(&self) -> Option<BreakOff> {
        self.given_up
    }
}
