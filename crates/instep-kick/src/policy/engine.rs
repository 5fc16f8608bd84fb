//! The engine `policy`: runs a trained policy from its track's first pose, behind the trait of all engines.
//!
//! The track is laid so that its ball is where the request's ball is and its kick goes where the request wants it. The
//! kick begins in the track's first pose at that place; a robot that stands otherwise is refused. What a policy was not trained
//! for it cannot do: there is one strength, one foot, no wait with the foot back, and a cancel ends in the pose of the moment.

use std::sync::Arc;

use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion, Vector3};

use super::file::Policy;
use super::follower::Follower;
use super::network::Network;
use super::track::TrackState;
use crate::engine::{Face, KickEngine, KickPlan, KickStatus, Phase, Progress};
use crate::request::{KickRequest, Refusal};
use crate::{KickError, Strength};

/// Period at which the drives' targets are renewed, s.
const TICK: f64 = 0.002;
/// How long the stand after the track counts as part of the kick, s.
const SETTLE: f64 = 0.5;
/// Standard deviation of the direction that is stated for every kick, rad.
const PRECISION: f64 = 0.1;

/// The engine.
#[derive(Debug, Clone)]
pub struct PolicyKick {
    robot: Arc<Robot>,
    follower: Follower,
    network: Network,
    observation: Vec<f32>,
    foot: instep_motion::phase::Side,
    /// Sensor time at which the policy is asked next, s.
    next: f64,
    /// Track time at the start, s.
    start: f64,
    status: KickStatus,
    /// Sensor time at which the status was decided, s.
    now: f64,
}

impl PolicyKick {
    /// Runs `policy` on `robot`, from `start` (s, in the track's time).
    ///
    /// # Errors
    /// When policy and robot do not fit, or the track does not hold `start`.
    pub fn new(robot: Arc<Robot>, policy: &Policy, start: f64) -> Result<Self, KickError> {
        let follower = policy.follower(&robot)?;
        let duration = follower.track().duration();
        if !(0.0..duration).contains(&start) {
            return Err(KickError::Start { start, duration });
        }
        Ok(Self {
            observation: vec![0.0; follower.observation_len()],
            network: policy.network.clone(),
            foot: policy.reference.phases.kick_foot,
            follower,
            robot,
            next: 0.0,
            start,
            status: KickStatus::Idle,
            now: 0.0,
        })
    }

    /// The state from which it starts: q (7 + n) and v (6 + n), in the reference's world.
    #[must_use]
    pub fn initial_state(&self) -> (Vec<f64>, Vec<f64>) {
        let mut state = TrackState::default();
        self.follower.track().clone().sample_into(self.start, &mut state);
        (state.q, state.v)
    }

    /// Starts at the sensors' time zero with the robot in its initial state, in the reference's world.
    pub fn begin(&mut self) {
        let (q, v) = self.initial_state();
        let (position, velocity) = (Vector3::new(q[0], q[1], q[2]), Vector3::new(v[0], v[1], v[2]));
        self.follower.start(0.0, self.start, Isometry3::identity(), position, velocity);
        (self.next, self.now, self.status) = (0.0, 0.0, KickStatus::Running);
    }

    /// The follower's state of things, for whoever measures the policy.
    #[must_use]
    pub fn follower(&self) -> &Follower {
        &self.follower
    }

    fn end(&self) -> f64 {
        self.follower.track().duration() + SETTLE
    }
}

impl Controller for PolicyKick {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        self.now = sensors.time;
        if self.status == KickStatus::Idle {
            command.positions.copy_from_slice(&self.robot.stand[7..]);
            command.velocities.fill(0.0);
            command.torques.fill(0.0);
            return;
        }
        self.follower.sense(sensors);
        // Half a tick of grace: times are sums of rounded periods.
        if sensors.time + 0.5 * TICK >= self.next {
            self.next += self.follower.settings().period;
            self.follower.observe(sensors, &mut self.observation);
            let action = self.network.run(&self.observation);
            self.follower.act(action);
        }
        self.follower.command(sensors.time, command);
        if self.status == KickStatus::Running && self.follower.track_time(sensors.time) >= self.end() {
            self.status = KickStatus::Finished;
        }
    }
}

impl KickEngine for PolicyKick {
    fn name(&self) -> &'static str {
        "policy"
    }

    fn control_period(&self) -> f64 {
        TICK
    }

    fn plan(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<KickPlan, Refusal> {
        request.check()?;
        if self.status == KickStatus::Running {
            return Err(Refusal::Busy);
        }
        let (q, v) = self.initial_state();
        for (joint, (&is, &should)) in sensors.joint_positions.iter().zip(&q[7..]).enumerate() {
            if (is - should).abs() > 0.25 {
                return Err(Refusal::NotStanding { joint, off: is - should });
            }
        }
        // The footprint lies where it does under the track's first pose.
        let mut data = self.robot.data();
        data.set_position(&q);
        let [left, right] = [0, 1].map(|leg| data.point(&self.robot.legs[leg].sole));
        let heading =
            [0, 1].map(|leg| data.link_rotation(self.robot.legs[leg].foot) * Vector3::x()).iter().sum::<Vector3<f64>>();
        let yaw = heading.y.atan2(heading.x);
        let footprint = Isometry3::new(0.5 * (left + right), Vector3::z() * yaw);
        let ball = footprint * Point3::new(request.ball[0], request.ball[1], 0.0);
        let place = self.follower.track().reference().ball;
        let off = (ball.x - place[0]).hypot(ball.y - place[1]);
        if off > 0.1 {
            return Err(Refusal::Unreachable { foot: self.foot, place: crate::Place::Contact, gap: off });
        }
        let turned = (yaw + request.direction).sin().atan2((yaw + request.direction).cos());
        if turned.abs() > PRECISION {
            return Err(Refusal::TooImprecise { asked: turned.abs(), possible: PRECISION });
        }
        // `track_from_world`: the sensors' world has its own origin and yaw.
        let [w, x, y, z] = sensors.orientation;
        let measured = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)).euler_angles().2;
        let expected = UnitQuaternion::new_normalize(Quaternion::new(q[3], q[4], q[5], q[6])).euler_angles().2;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), expected - measured);
        let contact = self.follower.track().contact_time() - self.start;
        let deadline = request.deadline.unwrap_or(f64::INFINITY);
        if contact > deadline {
            return Err(Refusal::TooLate { contact, deadline });
        }
        let placement = Isometry3::from_parts(Vector3::new(q[0], q[1], 0.0).into(), turn);
        let velocity = turn.inverse() * Vector3::new(v[0], v[1], v[2]);
        self.follower.start(sensors.time, self.start, placement, Vector3::new(0.0, 0.0, q[2]), velocity);
        (self.next, self.now, self.status) = (sensors.time, sensors.time, KickStatus::Running);
        let foot_speed = match request.strength {
            Strength::BallSpeed(speed) | Strength::FootSpeed(speed) => speed,
            Strength::Distance(_) => 0.0,
        };
        Ok(KickPlan {
            foot: self.foot,
            face: Face::Front,
            contact,
            duration: self.end() - self.start,
            foot_speed,
            ball_speed: foot_speed,
            precision: PRECISION,
        })
    }

    fn release(&mut self) {}

    fn cancel(&mut self) {}

    fn progress(&self) -> Progress {
        let at = self.follower.track_time(self.now);
        let contact = self.follower.track().contact_time();
        let running = self.status == KickStatus::Running;
        Progress {
            status: self.status,
            phase: match running {
                false => Phase::Stand,
                true if at < contact - 0.15 => Phase::WindUp,
                true if at < contact + 0.1 => Phase::Kick,
                true => Phase::MoveBack,
            },
            done: if running { (at / self.end()).clamp(0.0, 1.0) } else { 0.0 },
            to_contact: running.then_some(contact - at),
            foot: running.then_some(self.foot),
        }
    }
}
