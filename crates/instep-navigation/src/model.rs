//! How a walking robot answers a velocity: what the prediction knows (paper 4, eq 6, and what it leaves out).
//!
//! Printed: the pose moves by the commanded velocity, in the heading of the step's start. A walking robot follows its command
//! with a lag of about a step and after a delay, so here the state is pose and velocity, v' = v + (1 - exp(-dt / lag)) (u - v),
//! and the pose moves by the mean velocity at the middle heading. The delay is the caller's: it rolls the state forward
//! through what it has commanded ([`Response::advance`]).

use crate::settings::{Model, RobotLimits};

/// Steps of a prediction.
pub const STAGES: usize = 20;
/// Time of a step, s.
pub const DT: f64 = 0.1;

/// x, y (m), heading (rad, not wrapped) in the field; velocity ahead, to the left (m/s) and turn (rad/s) in the robot's heading.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// Pose.
    pub pose: [f64; 3],
    /// Velocity.
    pub velocity: [f64; 3],
}

/// The answer over one step of a fixed time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    pub(crate) dt: f64,
    /// Shares of velocity and command in the mean velocity of the step.
    pub(crate) mean: [f64; 2],
    /// Shares of both in the velocity at its end.
    pub(crate) next: [f64; 2],
    /// How far into the step the heading is taken, s.
    pub(crate) half: f64,
}

impl Response {
    /// Of a robot, over `dt` seconds.
    #[must_use]
    pub fn new(limits: &RobotLimits, model: Model, dt: f64) -> Self {
        match model {
            Model::Printed => Self { dt, mean: [0.0, 1.0], next: [0.0, 1.0], half: 0.0 },
            Model::Lagged => {
                let b = if limits.lag > 0.0 { 1.0 - (-dt / limits.lag).exp() } else { 1.0 };
                Self { dt, mean: [1.0 - 0.5 * b, 0.5 * b], next: [1.0 - b, b], half: 0.5 * dt }
            }
        }
    }

    /// The state after a step with command `u`.
    #[must_use]
    pub fn advance(&self, state: &State, u: &[f64; 3]) -> State {
        let v = &state.velocity;
        let m: [f64; 3] = std::array::from_fn(|i| self.mean[0] * v[i] + self.mean[1] * u[i]);
        let (s, c) = (state.pose[2] + self.half * m[2]).sin_cos();
        State {
            pose: [
                state.pose[0] + self.dt * (c * m[0] - s * m[1]),
                state.pose[1] + self.dt * (s * m[0] + c * m[1]),
                state.pose[2] + self.dt * m[2],
            ],
            velocity: std::array::from_fn(|i| self.next[0] * v[i] + self.next[1] * u[i]),
        }
    }

    /// Takes the gradient of a cost by the state after the step back to the one before (`gradient`, pose then velocity) and
    /// gives that by the command.
    pub(crate) fn pull_back(&self, state: &State, u: &[f64; 3], gradient: &mut [f64; 6]) -> [f64; 3] {
        let v = &state.velocity;
        let m: [f64; 3] = std::array::from_fn(|i| self.mean[0] * v[i] + self.mean[1] * u[i]);
        let (s, c) = (state.pose[2] + self.half * m[2]).sin_cos();
        let [a, e, by_heading] = [gradient[0], gradient[1], gradient[2]];
        let by_angle = self.dt * (a * (-s * m[0] - c * m[1]) + e * (c * m[0] - s * m[1]));
        let by_mean =
            [self.dt * (a * c + e * s), self.dt * (-a * s + e * c), self.dt * by_heading + self.half * by_angle];
        let by_next = [gradient[3], gradient[4], gradient[5]];
        gradient[2] = by_heading + by_angle;
        for i in 0..3 {
            gradient[3 + i] = self.mean[0] * by_mean[i] + self.next[0] * by_next[i];
        }
        std::array::from_fn(|i| self.mean[1] * by_mean[i] + self.next[1] * by_next[i])
    }
}
