//! cf-MPC's problem (paper 4, eqs 7 and 8) as both solvers take it: one objective of tracking, effort and slack.
//!
//! What is printed and what is meant. Eq 7 wraps no angle and pulls every command toward standstill: here angles are wrapped,
//! effort counts from the reference's own velocity, and changes of the command cost too. Eq 8 with eq 7 squares the slack in
//! constraint and cost: its derivative vanishes at zero slack, so a QP about it is infeasible inside a keep-out. Here the
//! slack is a depth in metres, d + s >= R with s >= 0, at a cost in s^2 (nonlinear) or s and s^2 (QP); the obstacle moves on
//! through the horizon instead of standing still.

use instep_field::wrap;

use crate::model::{DT, Response, STAGES, State};

/// Keep-outs of a prediction at most; the nearest count.
pub const MOST_KEEP_OUTS: usize = 12;
/// Weights of x, y (1/m^2) and heading (1/rad^2); the last stage counts thrice.
pub(crate) const TRACKING: [f64; 3] = [10.0, 10.0, 2.0];
pub(crate) const TERMINAL: f64 = 3.0;
/// Weights of the command's distance from the reference's velocity.
pub(crate) const EFFORT: [f64; 3] = [0.1, 0.1, 0.05];
/// Weights of the command's change from stage to stage.
pub(crate) const CHANGE: [f64; 3] = [0.5, 0.5, 0.1];
/// Cost of a square metre of depth in a keep-out or beyond the border.
pub(crate) const DEPTH: f64 = 500.0;
/// Cost of what a change exceeds the robot's acceleration by, squared.
pub(crate) const EXCESS: f64 = 20.0;

/// A disc that moves on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct KeepOut {
    /// Middle at the horizon's start, m.
    pub position: [f64; 2],
    /// m/s
    pub velocity: [f64; 2],
    /// m
    pub radius: f64,
}

/// Where to be, and how fast, at the end of each stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// x, y, heading.
    pub poses: [[f64; 3]; STAGES],
    /// In the robot's heading.
    pub velocities: [[f64; 3]; STAGES],
}

impl Default for Reference {
    fn default() -> Self {
        Self { poses: [[0.0; 3]; STAGES], velocities: [[0.0; 3]; STAGES] }
    }
}

/// Commands of all stages.
pub type Commands = [[f64; 3]; STAGES];

/// The problem of one tick.
#[derive(Debug, Clone)]
pub struct Problem {
    /// When the command takes effect.
    pub start: State,
    /// The command before.
    pub last: [f64; 3],
    /// The robot's answer over [`DT`].
    pub response: Response,
    /// Lowest and highest command.
    pub bounds: [[f64; 3]; 2],
    /// Largest change of a command in [`DT`].
    pub change: [f64; 3],
    /// What to follow.
    pub reference: Reference,
    /// Whether effort counts from standstill (eq 7 as printed).
    pub effort_from_rest: bool,
    /// Keep-outs, the first `count` of them.
    pub keep_outs: [KeepOut; MOST_KEEP_OUTS],
    /// How many.
    pub count: usize,
    /// Half length and half width that the robot's middle stays in, m.
    pub half: [f64; 2],
}

impl Problem {
    /// The keep-outs.
    pub fn keep_outs(&self) -> &[KeepOut] {
        &self.keep_outs[..self.count]
    }

    /// States at the end of each stage.
    pub fn predict(&self, commands: &Commands) -> [State; STAGES] {
        let mut state = self.start;
        std::array::from_fn(|i| {
            state = self.response.advance(&state, &commands[i]);
            state
        })
    }

    pub(crate) fn effort_target(&self, stage: usize) -> [f64; 3] {
        if self.effort_from_rest { [0.0; 3] } else { self.reference.velocities[stage] }
    }

    /// The objective, and its gradient where one is asked.
    pub fn cost(&self, commands: &Commands, gradient: Option<&mut Commands>) -> f64 {
        let states = self.predict(commands);
        let mut by_pose = [[0.0; 3]; STAGES];
        let mut cost = 0.0;
        for (i, state) in states.iter().enumerate() {
            let (wanted, by) = (&self.reference.poses[i], &mut by_pose[i]);
            let error = [state.pose[0] - wanted[0], state.pose[1] - wanted[1], wrap(state.pose[2] - wanted[2])];
            let scale = if i + 1 == STAGES { TERMINAL } else { 1.0 };
            for k in 0..3 {
                cost += scale * TRACKING[k] * error[k] * error[k];
                by[k] = 2.0 * scale * TRACKING[k] * error[k];
            }
            let time = DT * (i + 1) as f64;
            for keep_out in self.keep_outs() {
                let away: [f64; 2] =
                    std::array::from_fn(|k| state.pose[k] - keep_out.position[k] - keep_out.velocity[k] * time);
                let square = away[0] * away[0] + away[1] * away[1];
                if square < keep_out.radius * keep_out.radius {
                    let distance = square.sqrt();
                    let depth = keep_out.radius - distance;
                    cost += DEPTH * depth * depth;
                    if distance > 1e-9 {
                        by[0] -= 2.0 * DEPTH * depth * away[0] / distance;
                        by[1] -= 2.0 * DEPTH * depth * away[1] / distance;
                    }
                }
            }
            for k in 0..2 {
                let beyond = (state.pose[k].abs() - self.half[k]).max(0.0);
                cost += DEPTH * beyond * beyond;
                by[k] += 2.0 * DEPTH * beyond * state.pose[k].signum();
            }
        }
        let mut direct = [[0.0; 3]; STAGES];
        for i in 0..STAGES {
            let target = self.effort_target(i);
            for k in 0..3 {
                let effort = commands[i][k] - target[k];
                cost += EFFORT[k] * effort * effort;
                direct[i][k] += 2.0 * EFFORT[k] * effort;
                let change = commands[i][k] - if i == 0 { self.last[k] } else { commands[i - 1][k] };
                let excess = (change.abs() - self.change[k]).max(0.0);
                cost += CHANGE[k] * change * change + EXCESS * excess * excess;
                let by = 2.0 * CHANGE[k] * change + 2.0 * EXCESS * excess * change.signum();
                direct[i][k] += by;
                if i > 0 {
                    direct[i - 1][k] -= by;
                }
            }
        }
        if let Some(gradient) = gradient {
            let mut back = [0.0; 6];
            for i in (0..STAGES).rev() {
                for k in 0..3 {
                    back[k] += by_pose[i][k];
                }
                let before = if i == 0 { &self.start } else { &states[i - 1] };
                let by_command = self.response.pull_back(before, &commands[i], &mut back);
                gradient[i] = std::array::from_fn(|k| direct[i][k] + by_command[k]);
            }
        }
        cost
    }

    /// A command within its bounds.
    pub(crate) fn clip(&self, u: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| u[k].clamp(self.bounds[0][k], self.bounds[1][k]))
    }
}
