//! Runs a policy: 50 times a second the network corrects the track that the drives follow.

use std::sync::Arc;

use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use nalgebra::Vector3;

use super::file::Policy;
use super::follower::Follower;
use super::network::Network;
use crate::KickError;

/// Times are sums of rounded periods: a policy is asked this much early at most, s.
const GRACE: f64 = 0.001;

/// A controller that follows a policy's track from a given instant, in the track's own world.
#[derive(Debug, Clone)]
pub struct PolicyKick {
    follower: Follower,
    network: Network,
    observation: Vec<f32>,
    /// Sensor time at which the policy is asked next, s.
    next: f64,
    /// Track time at the start, s.
    start: f64,
}

impl PolicyKick {
    /// Runs `policy` on `robot` from `start` (s, in the track's time), with the robot in [`Self::initial_state`].
    ///
    /// # Errors
    /// When policy and robot do not fit, or the track does not hold `start`.
    pub fn new(robot: &Arc<Robot>, policy: &Policy, start: f64) -> Result<Self, KickError> {
        let follower = policy.follower(robot)?;
        let duration = follower.track().duration();
        if !(0.0..duration).contains(&start) {
            return Err(KickError::Start { start, duration });
        }
        let observation = vec![0.0; follower.observation_len()];
        let mut kick = Self { follower, network: policy.network.clone(), observation, next: 0.0, start };
        kick.begin(0.0);
        Ok(kick)
    }

    /// Begins anew at the sensors' `time` (s), with the robot in [`Self::initial_state`].
    pub fn begin(&mut self, time: f64) {
        let (q, v) = self.initial_state();
        self.follower.start(time, self.start, Vector3::new(q[0], q[1], q[2]), Vector3::new(v[0], v[1], v[2]));
        self.next = time;
    }

    /// The state from which it starts: q (7 + n) and v (6 + n), in the reference's world.
    #[must_use]
    pub fn initial_state(&self) -> (Vec<f64>, Vec<f64>) {
        self.follower.track().initial_state(self.start)
    }

    /// What it follows.
    #[must_use]
    pub fn follower(&self) -> &Follower {
        &self.follower
    }
}

impl Controller for PolicyKick {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        self.follower.sense(sensors);
        if sensors.time + GRACE >= self.next {
            self.next += self.follower.settings().period;
            self.follower.observe(sensors, &mut self.observation);
            self.follower.act(self.network.run(&self.observation));
        }
        self.follower.command(sensors.time, command);
    }
}
