//! cf-MPC, linearised: one quadratic program about the last solution.
//!
//! Dynamics and keep-outs are linearised about the last solution, shifted to now (its normals are defined where the
//! reference's are not: a reference may meet a keep-out's middle). Commands are held over blocks of stages; states are
//! eliminated (condensed), so the unknowns are the blocks' changes and one slack, the greatest depth in any keep-out, at
//! a linear and a square cost: always feasible. Solved exactly by [`instep_qp`]; nothing is allocated in a tick.

use instep_field::wrap;
use instep_qp::{Qp, QpSolver, QpStatus};

use crate::model::{DT, STAGES};
use crate::problem::{CHANGE, Commands, DEPTH, EFFORT, Problem, TERMINAL, TRACKING};

/// Stages of each block of equal commands.
const BLOCKS: [usize; 8] = [1, 1, 2, 2, 3, 3, 4, 4];
/// Unknowns: three for each block.
const CONTROLS: usize = 3 * BLOCKS.len();
/// Linear cost of the slack: more than any gain of tracking by a metre of depth.
const LINEAR: f64 = 500.0;
/// Keep-outs farther than this from the last solution need no row, m.
const NEAR: f64 = 0.8;
/// Rows at most.
const ROWS: usize = 2 * CONTROLS + 1 + 4 * STAGES;

/// The solver with its memory.
#[derive(Debug, Clone)]
pub struct Linearised {
    qp: Qp,
    solver: QpSolver,
    row: Vec<f64>,
}

impl Default for Linearised {
    fn default() -> Self {
        let n = CONTROLS + 1;
        Self { qp: Qp::with_capacity(n, ROWS), solver: QpSolver::with_capacity(n, ROWS), row: vec![0.0; n] }
    }
}

impl Linearised {
    /// Improves `commands`, the last solution.
    pub fn solve(&mut self, problem: &Problem, commands: &mut Commands) -> QpStatus {
        let mut stage = 0;
        for length in BLOCKS {
            let held = problem.clip(commands[stage]);
            commands[stage..stage + length].fill(held);
            stage += length;
        }
        self.qp.reset(CONTROLS + 1);
        let mut sensitivity = [[0.0; CONTROLS]; 6];
        let mut state = problem.start;
        let (mut stage, r) = (0, problem.response);
        let mut keep_out_rows = [([0.0; CONTROLS], 0.0); 4 * STAGES];
        let mut count = 0;
        for (block, length) in BLOCKS.iter().enumerate() {
            let used = 3 * (block + 1);
            for _ in 0..*length {
                let u = commands[stage];
                let m: [f64; 3] = std::array::from_fn(|i| r.mean[0] * state.velocity[i] + r.mean[1] * u[i]);
                let (s, c) = (state.pose[2] + r.half * m[2]).sin_cos();
                let across = [-s * m[0] - c * m[1], c * m[0] - s * m[1]];
                for column in 0..used {
                    let of_block = |i: usize| if column == 3 * block + i { 1.0 } else { 0.0 };
                    let dv: [f64; 3] = std::array::from_fn(|i| sensitivity[3 + i][column]);
                    let dm: [f64; 3] = std::array::from_fn(|i| r.mean[0] * dv[i] + r.mean[1] * of_block(i));
                    let dh = sensitivity[2][column] + r.half * dm[2];
                    sensitivity[0][column] += r.dt * (c * dm[0] - s * dm[1] + across[0] * dh);
                    sensitivity[1][column] += r.dt * (s * dm[0] + c * dm[1] + across[1] * dh);
                    sensitivity[2][column] += r.dt * dm[2];
                    for i in 0..3 {
                        sensitivity[3 + i][column] = r.next[0] * dv[i] + r.next[1] * of_block(i);
                    }
                }
                state = r.advance(&state, &u);
                let wanted = &problem.reference.poses[stage];
                let missing = [wanted[0] - state.pose[0], wanted[1] - state.pose[1], wrap(wanted[2] - state.pose[2])];
                let scale = if stage + 1 == STAGES { TERMINAL } else { 1.0 };
                for k in 0..3 {
                    self.qp.add_cost(2.0 * scale * TRACKING[k], 0, &sensitivity[k][..used], missing[k]);
                }
                let target = problem.effort_target(stage);
                for k in 0..3 {
                    self.qp.add_cost_at(2.0 * EFFORT[k], 3 * block + k, target[k] - u[k]);
                }
                // Every second stage is enough: a robot walks no 0.2 m between them.
                if stage % 2 == 1 || stage == 0 {
                    let time = DT * (stage + 1) as f64;
                    for keep_out in problem.keep_outs() {
                        let away: [f64; 2] =
                            std::array::from_fn(|k| state.pose[k] - keep_out.position[k] - keep_out.velocity[k] * time);
                        let distance = away[0].hypot(away[1]);
                        if distance > keep_out.radius + NEAR || count == keep_out_rows.len() {
                            continue;
                        }
                        let normal =
                            if distance > 1e-6 { [away[0] / distance, away[1] / distance] } else { [1.0, 0.0] };
                        let (row, bound) = &mut keep_out_rows[count];
                        for column in 0..used {
                            row[column] = normal[0] * sensitivity[0][column] + normal[1] * sensitivity[1][column];
                        }
                        *bound = keep_out.radius - distance;
                        count += 1;
                    }
                    for k in 0..2 {
                        let room = problem.half[k] - state.pose[k].abs();
                        if room < NEAR && count < keep_out_rows.len() {
                            let (row, bound) = &mut keep_out_rows[count];
                            for column in 0..used {
                                row[column] = -state.pose[k].signum() * sensitivity[k][column];
                            }
                            *bound = -room;
                            count += 1;
                        }
                    }
                }
                stage += 1;
            }
        }
        self.add_changes(problem, commands);
        self.qp.add_cost_at(2.0 * DEPTH, CONTROLS, -LINEAR / (2.0 * DEPTH));
        let mut stage = 0;
        for (block, length) in BLOCKS.iter().enumerate() {
            for k in 0..3 {
                let at = commands[stage][k];
                let row = self.qp.add_row(problem.bounds[0][k] - at, problem.bounds[1][k] - at);
                row[3 * block + k] = 1.0;
            }
            stage += length;
        }
        self.qp.add_row(0.0, f64::INFINITY)[CONTROLS] = 1.0;
        for (row, bound) in &keep_out_rows[..count] {
            let to = self.qp.add_row(*bound, f64::INFINITY);
            to[..CONTROLS].copy_from_slice(row);
            to[CONTROLS] = 1.0;
        }
        let status = self.solver.solve(&self.qp);
        if status == QpStatus::Optimal {
            let mut stage = 0;
            for (block, length) in BLOCKS.iter().enumerate() {
                for u in &mut commands[stage..stage + length] {
                    for k in 0..3 {
                        u[k] += self.solver.x[3 * block + k];
                    }
                    *u = problem.clip(*u);
                }
                stage += length;
            }
        }
        status
    }

    /// Cost of changes between blocks, the first from the last command.
    fn add_changes(&mut self, problem: &Problem, commands: &Commands) {
        let mut stage = 0;
        for (block, length) in BLOCKS.iter().enumerate() {
            for k in 0..3 {
                let column = 3 * block + k;
                if block == 0 {
                    self.qp.add_cost_at(2.0 * CHANGE[k], column, problem.last[k] - commands[0][k]);
                } else {
                    let row = &mut self.row[..4];
                    row.copy_from_slice(&[-1.0, 0.0, 0.0, 1.0]);
                    let target = commands[stage - 1][k] - commands[stage][k];
                    self.qp.add_cost(2.0 * CHANGE[k], column - 3, row, target);
                }
            }
            stage += length;
        }
    }
}
