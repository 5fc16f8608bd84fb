//! A policy as a kick engine: the one kick that it has learned, out of a run-up.
//!
//! It cannot start from the stand: its kicks begin in the first state of its track ([`KickEngine::own_start`]), at the speeds of
//! the run-up. It takes the speeds and the base's place there as given; only the joints' angles are checked. A request for
//! another ball, direction or speed is refused. After the kick it goes on balancing in the track's last pose, which is not the
//! robot's stand. Before contact the run-up cannot be stopped, after it there is nothing to stop: a cancel changes the status
//! alone.

use std::sync::Arc;

use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};

use super::file::Policy;
use super::run::PolicyKick;
use super::settings::PolicySettings;
use crate::KickError;
use crate::ball::BallModel;
use crate::engine::{Face, KickEngine, KickPlan, KickStart, KickStatus, Phase, Progress};
use crate::request::{KickRequest, Learned, Refusal, Strength};
use crate::whole_body::foot::wrap;

/// Period at which the commands are renewed, s; the policy itself is asked at its own, longer one.
pub const PERIOD: f64 = 0.002;
/// How far a speed that is asked may be from the policy's own, as a share of it.
const SPEED_SHARE: f64 = 0.15;
/// How fast a ball may roll that is taken to lie still, m/s.
const STILL: f64 = 0.05;
/// How long after the contact the leg still swings, s.
const SWING_OUT: f64 = 0.1;

/// The engine.
#[derive(Debug, Clone)]
pub struct LearnedKick {
    kick: PolicyKick,
    settings: PolicySettings,
    ball: BallModel,
    start: KickStart,
    plan: KickPlan,
    /// The robot's stand, joint angles, rad.
    stand: Vec<f64>,
    status: KickStatus,
    /// Sensor time of the plan and of the last tick, s.
    times: [f64; 2],
}

impl LearnedKick {
    /// For `robot`, that plays `ball`, with `policy`.
    ///
    /// # Errors
    /// When policy and robot do not fit, or the policy's window holds no contact.
    pub fn new(
        robot: &Arc<Robot>,
        ball: BallModel,
        policy: &Policy,
        settings: PolicySettings,
    ) -> Result<Self, KickError> {
        let kick = PolicyKick::new(robot, policy, 0.0)?;
        let track = kick.follower().track();
        let (contact, duration) = (track.contact_time(), track.duration());
        if !(contact > 0.0 && contact < duration) {
            return Err(KickError::Setting {
                field: "the policy's window".into(),
                found: format!("the contact {contact:.3} s after its start"),
                expected: format!("a contact within its {duration:.3} s"),
            });
        }
        let foot = policy.reference.phases.kick_foot;
        let mut data = robot.data();
        let (q, v) = track.initial_state(contact);
        data.set_state(&q, &v);
        let foot_speed = data.point_velocity(&robot.leg(foot).sole).norm();
        let (q, v) = kick.initial_state();
        data.set_position(&q);
        let [left, right] = [0, 1].map(|side| data.point(&robot.legs[side].sole));
        let footprint = [0.5 * (left.x + right.x), 0.5 * (left.y + right.y)];
        let place = policy.reference.ball;
        let request = KickRequest::new([place[0] - footprint[0], place[1] - footprint[1]], 0.0, settings.ball_speed);
        let plan = KickPlan {
            foot,
            face: Face::Front,
            contact,
            duration,
            foot_speed,
            ball_speed: settings.ball_speed,
            precision: settings.precision,
        };
        Ok(Self {
            kick,
            settings,
            ball,
            start: KickStart { q, v, footprint, request },
            plan,
            stand: robot.stand[7..].to_vec(),
            status: KickStatus::Idle,
            times: [0.0; 2],
        })
    }

    fn is_running(&self) -> bool {
        matches!(self.status, KickStatus::Running | KickStatus::Cancelling)
    }

    /// Whether `request` asks for the kick that was learned.
    fn check(&self, request: &KickRequest) -> Result<(), Refusal> {
        request.check()?;
        let plan = &self.plan;
        if request.hold {
            return Err(Refusal::CannotHold);
        }
        if request.foot.is_some_and(|foot| foot != plan.foot) {
            return Err(Refusal::OtherFoot { foot: plan.foot });
        }
        let own = &self.start.request;
        let norm = |[x, y]: [f64; 2]| x.hypot(y);
        let turn = request.direction - own.direction;
        let asked = match request.strength {
            Strength::FootSpeed(speed) => speed / plan.foot_speed * plan.ball_speed,
            // No gain between foot and ball is asked for here, so no foot's mass.
            other => other.ball_speed(&self.ball, 1.0),
        };
        for (what, off, most) in [
            (Learned::Rest, norm(request.ball_velocity), STILL),
            (Learned::Ball, norm([0, 1].map(|k| request.ball[k] - own.ball[k])), self.settings.reach),
            (Learned::Direction, wrap(turn).abs(), plan.precision),
            (Learned::Speed, (asked - plan.ball_speed).abs(), SPEED_SHARE * plan.ball_speed),
        ] {
            if off > most {
                let (ball, direction) = (own.ball, own.direction);
                return Err(Refusal::OtherKick { what, off, most, ball, direction, ball_speed: plan.ball_speed });
            }
        }
        if let Some(deadline) = request.deadline.filter(|&deadline| plan.contact > deadline) {
            return Err(Refusal::TooLate { contact: plan.contact, deadline });
        }
        match request.precision.filter(|&asked| plan.precision > asked) {
            Some(asked) => Err(Refusal::TooImprecise { asked, possible: plan.precision }),
            None => Ok(()),
        }
    }
}

impl Controller for LearnedKick {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        self.times[1] = sensors.time;
        if self.status == KickStatus::Idle {
            command.positions.copy_from_slice(&self.stand);
            command.velocities.fill(0.0);
            command.torques.fill(0.0);
            return;
        }
        self.kick.tick(sensors, command);
        if self.is_running() && sensors.time - self.times[0] >= self.plan.duration {
            let cancelled = self.status == KickStatus::Cancelling;
            self.status = if cancelled { KickStatus::Cancelled } else { KickStatus::Finished };
        }
    }
}

impl KickEngine for LearnedKick {
    fn name(&self) -> &'static str {
        "policy"
    }

    fn control_period(&self) -> f64 {
        PERIOD
    }

    fn own_start(&self) -> Option<KickStart> {
        Some(self.start.clone())
    }

    fn plan(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<KickPlan, Refusal> {
        if self.is_running() {
            return Err(Refusal::Busy);
        }
        for (joint, (now, start)) in sensors.joint_positions.iter().zip(&self.start.q[7..]).enumerate() {
            let off = now - start;
            // Written so that a NaN fails.
            if !(off.abs() <= self.settings.pose) {
                return Err(Refusal::NotAtStart { joint, off });
            }
        }
        self.check(request)?;
        self.kick.begin(sensors.time);
        self.times = [sensors.time; 2];
        self.status = KickStatus::Running;
        Ok(self.plan)
    }

    /// Nothing is ever held.
    fn release(&mut self) {}

    fn cancel(&mut self) {
        if self.status == KickStatus::Running {
            self.status = KickStatus::Cancelling;
        }
    }

    fn progress(&self) -> Progress {
        let running = self.is_running();
        let at = self.times[1] - self.times[0];
        let track = self.kick.follower().track();
        let phases = &track.reference().phases;
        let [plant, swing] = [phases.t_plant, phases.t_swing].map(|time| time - track.window()[0]);
        let phase = match at {
            _ if !running => Phase::Stand,
            at if at < plant.min(swing) => Phase::Shift,
            at if at < swing => Phase::WindUp,
            at if at < self.plan.contact + SWING_OUT => Phase::Kick,
            _ => Phase::MoveBack,
        };
        let done = match self.status {
            KickStatus::Idle => 0.0,
            _ => (at / self.plan.duration).clamp(0.0, 1.0),
        };
        Progress {
            status: self.status,
            phase,
            done,
            to_contact: running.then_some(self.plan.contact - at),
            foot: running.then_some(self.plan.foot),
        }
    }
}
