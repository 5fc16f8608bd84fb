//! How a trial's start differs from the state that its controller expects: nobody stands still and exactly as planned after
//! walking. The deviations are assumptions: what is left of a step's sway when a robot has come to a stop.

use instep_robot::Robot;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// Standard deviations of a start's errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StartErrors {
    /// Of each joint's angle, rad.
    pub joint: f64,
    /// Of each joint's speed, rad/s.
    pub joint_speed: f64,
    /// Of the base's velocity on each axis, m/s.
    pub base_speed: f64,
}

impl Default for StartErrors {
    fn default() -> Self {
        Self { joint: 0.01, joint_speed: 0.1, base_speed: 0.03 }
    }
}

impl StartErrors {
    /// Adds random errors to a start state q (7 + n), v (6 + n) of `robot`. The lowest contact point keeps its height, so that
    /// no foot starts inside the ground.
    pub fn disturb(&self, robot: &Robot, q: &mut [f64], v: &mut [f64], rng: &mut ChaCha8Rng) {
        let mut data = robot.data();
        let mut lowest = |q: &[f64]| {
            data.set_position(q);
            robot.contacts.iter().map(|contact| data.point(&contact.at).z).reduce(f64::min).unwrap_or(0.0)
        };
        let before = lowest(q);
        let mut draw = |deviation: f64| {
            let sample: f64 = StandardNormal.sample(rng);
            deviation * sample
        };
        for (i, joint) in robot.joints.iter().enumerate() {
            q[7 + i] = (q[7 + i] + draw(self.joint)).clamp(joint.range[0], joint.range[1]);
            v[6 + i] += draw(self.joint_speed);
        }
        v[..3].iter_mut().for_each(|v| *v += draw(self.base_speed));
        q[2] += before - lowest(q);
    }
}
