//! A robot without legs that answers as a walking one: late, with a lag, within its acceleration, unsteadily, and believing
//! to be somewhat beside where it is. Written apart from the prediction's model, in fine steps, so that it checks it.

use std::collections::VecDeque;

use instep_field::Pose;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::trial::Body;
use crate::{NavigationError, RobotLimits};

/// Time of its own steps, s.
const STEP: f64 = 0.005;
/// Errors of a believed pose: lasting (1 s) and new, m; lasting of the heading, rad.
const BELIEF: [f64; 3] = [0.04, 0.02, 0.017];
/// Unsteadiness of the velocity, a standard deviation: m/s, m/s, rad/s.
const GAIT: [f64; 3] = [0.05, 0.04, 0.08];

/// The robot.
#[derive(Debug, Clone)]
pub struct PointRobot {
    limits: RobotLimits,
    pose: Pose,
    velocity: [f64; 3],
    commands: VecDeque<[f64; 3]>,
    rng: ChaCha8Rng,
    lasting: [f64; 3],
    unsteady: [f64; 3],
    noise: f64,
}

impl PointRobot {
    /// At `pose`; `noise` 1 is a robot, 0 an ideal one.
    #[must_use]
    pub fn new(limits: RobotLimits, pose: Pose, noise: f64, seed: u64) -> Self {
        let waiting = (limits.delay / STEP).round() as usize;
        Self {
            limits,
            pose,
            velocity: [0.0; 3],
            commands: std::iter::repeat_n([0.0; 3], waiting).collect(),
            rng: ChaCha8Rng::seed_from_u64(seed),
            lasting: [0.0; 3],
            unsteady: [0.0; 3],
            noise,
        }
    }

    fn normal(&mut self) -> f64 {
        // Twelve even numbers: near enough to a normal one, and never far out.
        (0..12).map(|_| self.rng.random::<f64>()).sum::<f64>() - 6.0
    }

    /// A noise that forgets itself within `time` seconds.
    fn drift(&mut self, value: f64, sigma: f64, dt: f64, time: f64) -> f64 {
        let kept = (-dt / time).exp();
        kept * value + sigma * (1.0 - kept * kept).sqrt() * self.normal()
    }
}

impl Body for PointRobot {
    fn pose(&self) -> Pose {
        self.pose
    }

    fn believe(&mut self) -> Pose {
        let white = [BELIEF[1] * self.normal(), BELIEF[1] * self.normal()];
        Pose::new(
            self.pose.x + self.noise * (self.lasting[0] + white[0]),
            self.pose.y + self.noise * (self.lasting[1] + white[1]),
            self.pose.heading + self.noise * self.lasting[2],
        )
    }

    fn advance(&mut self, velocity: [f64; 3], dt: f64) -> Result<(), NavigationError> {
        for k in 0..3 {
            let sigma = if k < 2 { BELIEF[0] } else { BELIEF[2] };
            self.lasting[k] = self.drift(self.lasting[k], sigma, dt, 1.0);
            self.unsteady[k] = self.drift(self.unsteady[k], GAIT[k], dt, 0.3);
        }
        for _ in 0..(dt / STEP).round() as usize {
            self.commands.push_back(velocity);
            let wanted = self.commands.pop_front().unwrap_or(velocity);
            let moving = wanted.iter().any(|w| w.abs() > 1e-6);
            for (k, v) in self.velocity.iter_mut().enumerate() {
                *v = if self.limits.lag > 0.0 { *v + STEP / self.limits.lag * (wanted[k] - *v) } else { wanted[k] };
            }
            let shake = if moving { self.noise } else { 0.0 };
            let step: [f64; 3] = std::array::from_fn(|k| STEP * (self.velocity[k] + shake * self.unsteady[k]));
            self.pose = self.pose.then(&Pose::new(step[0], step[1], step[2]));
        }
        Ok(())
    }
}
