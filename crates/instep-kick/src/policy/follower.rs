//! What stands between a policy and the drives: it turns sensor readings into the policy's observation, and the policy's
//! action into joint commands.
//!
//! Observation, equation (41) of paper 1: the reference 0.02, 0.68 and 1.34 s ahead, the present state, the last
//! action. The present state is given as its difference from the reference now, which holds the same and needs no network
//! to subtract; the base's part of it comes from the inertial sensor and from [`super::odometry`], since no robot can read its
//! position. Where the ball lies beside its place in the reference, the load on each foot, and the time are added.
//!
//! Command: the policy's action `a` is added to the reference, q_des = q_ref + s a with s = 0.25 tau_max / kp, at 50 Hz.
//! Between two actions the reference goes on: its angles, speeds and torques are the targets of the drives' law (42), which so holds
//! about the reference. A reference held for 20 ms would be wrong by 0.2 rad in a swing of 10 rad/s.

use instep_robot::Robot;
use instep_robot::control::{JointCommand, Sensors};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::odometry::Odometry;
use crate::track::{Track, TrackState};

/// A ball farther from its place than this is no longer the one to be kicked, m.
const BALL_REACH: f64 = 0.4;

/// What an observation holds and what an action means.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FollowerSettings {
    /// How far ahead the reference is seen, s; equation (41).
    pub horizons: Vec<f64>,
    /// Period of the policy, s.
    pub period: f64,
    /// An action of one moves a joint's target by as much as makes its drive ask for this share of its torque limit.
    pub scale: f64,
}

impl Default for FollowerSettings {
    fn default() -> Self {
        Self { horizons: vec![0.02, 0.68, 1.34], period: 0.02, scale: 0.25 }
    }
}

/// Follows one track on one robot with a policy's corrections.
#[derive(Debug, Clone)]
pub struct Follower {
    settings: FollowerSettings,
    track: Track,
    odometry: Odometry,
    /// Target shift for an action of one, rad.
    scale: Vec<f64>,
    weight: f64,
    legs_of_contacts: Vec<usize>,
    action: Vec<f32>,
    /// Track time at sensor time zero, s.
    offset: f64,
    now: TrackState,
    ahead: TrackState,
}

impl Follower {
    /// For `robot` along `track`.
    #[must_use]
    pub fn new(robot: &Robot, mut track: Track, settings: FollowerSettings) -> Self {
        // The states get their size here, not in a tick.
        let mut state = TrackState::default();
        track.sample_into(0.0, &mut state);
        Self {
            odometry: Odometry::new(robot),
            scale: robot.joints.iter().map(|joint| settings.scale * joint.torque / joint.kp).collect(),
            weight: robot.mass() * 9.81,
            legs_of_contacts: robot
                .contacts
                .iter()
                .map(|contact| usize::from(contact.leg == instep_motion::phase::Side::Right))
                .collect(),
            action: vec![0.0; robot.joints.len()],
            offset: 0.0,
            now: state.clone(),
            ahead: state,
            settings,
            track,
        }
    }

    /// The track.
    #[must_use]
    pub fn track(&self) -> &Track {
        &self.track
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &FollowerSettings {
        &self.settings
    }

    /// Length of an observation.
    #[must_use]
    pub fn observation_len(&self) -> usize {
        let n = self.scale.len();
        3 * n + 21 + self.settings.horizons.len() * (2 * n + 10)
    }

    /// Length of an action.
    #[must_use]
    pub fn action_len(&self) -> usize {
        self.scale.len()
    }

    /// Starts at the sensors' time `time` (s) and the track's time `at` (s) with the robot's base at `position` (m) and
    /// `velocity` (m/s) in the reference's world, in which the sensors' orientation is told too.
    pub fn start(&mut self, time: f64, at: f64, position: Vector3<f64>, velocity: Vector3<f64>) {
        self.offset = at - time;
        self.odometry.start(time, position, velocity);
        self.action.fill(0.0);
    }

    /// Takes in one set of readings; to be called at every control tick.
    pub fn sense(&mut self, sensors: &Sensors) {
        self.odometry.update(sensors);
    }

    /// The action that holds now.
    #[must_use]
    pub fn action(&self) -> &[f32] {
        &self.action
    }

    /// Takes the policy's next action; each entry is kept within +-5.
    pub fn act(&mut self, action: &[f32]) {
        for (kept, &new) in self.action.iter_mut().zip(action) {
            *kept = new.clamp(-5.0, 5.0);
        }
    }

    /// Track time at the sensors' time, s.
    #[must_use]
    pub fn track_time(&self, time: f64) -> f64 {
        self.offset + time
    }

    /// Targets for the drives at `time` (s, of the sensors).
    pub fn command(&mut self, time: f64, command: &mut JointCommand) {
        let at = self.track_time(time);
        self.track.sample_into(at, &mut self.now);
        for (i, &action) in self.action.iter().enumerate() {
            command.positions[i] = self.now.q[7 + i] + self.scale[i] * f64::from(action);
            command.velocities[i] = self.now.v[6 + i];
            command.torques[i] = self.now.torques[i];
        }
    }

    /// Writes the observation for `sensors`, which must have been taken in by [`Self::sense`].
    ///
    /// Layout, with n joints: angle errors (n), speed errors (n), base orientation error (3, rotation vector), rate error
    /// (3), up (3), base position error (3), base velocity error (3), load on each foot over the weight (2), ball's place
    /// error (2), time until contact and until the window's end (2), last action (n); then for each horizon joint angles (n), speeds (n),
    /// base height (1), up (3), velocity (3), rate (3). Vectors are in the base frame, those of errors in the reference's.
    ///
    /// # Panics
    /// When `observation` is shorter than [`Self::observation_len`].
    pub fn observe(&mut self, sensors: &Sensors, observation: &mut [f32]) {
        let at = self.track_time(sensors.time);
        self.track.sample_into(at, &mut self.now);
        let mut out = Writer { to: observation, at: 0 };
        let n = self.scale.len();
        for i in 0..n {
            out.push(sensors.joint_positions[i] - self.now.q[7 + i]);
        }
        for i in 0..n {
            out.push(sensors.joint_velocities[i] - self.now.v[6 + i]);
        }
        let reference = base(&self.now.q);
        let back = reference.rotation.inverse();
        let measured = orientation(&sensors.orientation);
        out.push3((back * measured).scaled_axis());
        out.push3(Vector3::from(sensors.gyro) - Vector3::new(self.now.v[3], self.now.v[4], self.now.v[5]));
        out.push3(measured.inverse() * Vector3::z());
        let position = self.odometry.position();
        out.push3(back * (position - reference.translation.vector));
        out.push3(back * (self.odometry.velocity() - Vector3::new(self.now.v[0], self.now.v[1], self.now.v[2])));
        let mut loads = [0.0; 2];
        for (&leg, force) in self.legs_of_contacts.iter().zip(&sensors.contact_forces) {
            loads[leg] += force / self.weight;
        }
        loads.iter().for_each(|&load| out.push(load.min(3.0)));
        let ball = self.ball_error(sensors, at, &position, &measured);
        ball.iter().for_each(|&error| out.push(error));
        out.push(self.track.contact_time() - at);
        out.push((self.track.duration() - at).max(0.0));
        self.action.iter().for_each(|&action| out.push(f64::from(action)));
        for &horizon in &self.settings.horizons {
            self.track.sample_into(at + horizon, &mut self.ahead);
            let ahead = &self.ahead;
            ahead.q[7..].iter().for_each(|&q| out.push(q));
            ahead.v[6..].iter().for_each(|&v| out.push(v));
            let back = base(&ahead.q).rotation.inverse();
            out.push(ahead.q[2]);
            out.push3(back * Vector3::z());
            out.push3(back * Vector3::new(ahead.v[0], ahead.v[1], ahead.v[2]));
            out.push3(Vector3::new(ahead.v[3], ahead.v[4], ahead.v[5]));
        }
        debug_assert_eq!(out.at, self.scale.len() * 3 + 21 + self.settings.horizons.len() * (2 * n + 10));
    }

    /// How far the ball lies from its place in the reference (m, the reference's axes); zero after the kick, and where
    /// there is no such ball.
    fn ball_error(
        &self,
        sensors: &Sensors,
        at: f64,
        position: &Vector3<f64>,
        measured: &UnitQuaternion<f64>,
    ) -> [f64; 2] {
        let Some(seen) = sensors.ball.filter(|_| at < self.track.contact_time()) else { return [0.0; 2] };
        let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), measured.euler_angles().2);
        let ball = heading * Vector3::from(seen.position) + Vector3::new(position.x, position.y, 0.0);
        let place = self.track.reference().ball;
        let error = [ball.x - place[0], ball.y - place[1]];
        if error[0].hypot(error[1]) > BALL_REACH { [0.0; 2] } else { error }
    }
}

/// Writes numbers one after the other.
struct Writer<'a> {
    to: &'a mut [f32],
    at: usize,
}

impl Writer<'_> {
    fn push(&mut self, value: f64) {
        self.to[self.at] = value as f32;
        self.at += 1;
    }

    fn push3(&mut self, value: Vector3<f64>) {
        value.iter().for_each(|&x| self.push(x));
    }
}

/// A quaternion w, x, y, z.
fn orientation(&[w, x, y, z]: &[f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

/// `world_from_base` of a position vector.
fn base(q: &[f64]) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(q[0], q[1], q[2]), orientation(&[q[3], q[4], q[5], q[6]]))
}
