//! cf-MPC, nonlinear: the whole objective by projected gradients.
//!
//! Spectral projected gradient (Birgin, Martinez, Raydan, Nonmonotone spectral projected gradient methods on convex sets, SIAM
//! J. Optim. 10 (2000), algorithm 2.2) with the gradient of [`Problem::cost`] by the adjoint. The only hard bounds are those
//! of the commands, so the projection is a clip. Warm start from the last solution. No memory but arrays on the stack.

use crate::model::STAGES;
use crate::problem::{Commands, Problem};

/// Steps at most.
const STEPS: usize = 40;
/// Costs that a step may rise to.
const MEMORY: usize = 5;
/// Largest part of the projected gradient at which it is solved.
const TOLERANCE: f64 = 2e-3;

fn each(a: &Commands, b: &Commands, mut f: impl FnMut(f64, f64)) {
    for (a, b) in a.iter().zip(b) {
        for k in 0..3 {
            f(a[k], b[k]);
        }
    }
}

fn dot(a: &Commands, b: &Commands) -> f64 {
    let mut sum = 0.0;
    each(a, b, |a, b| sum += a * b);
    sum
}

/// Improves `commands`; gives their cost.
pub fn solve(problem: &Problem, commands: &mut Commands) -> f64 {
    for u in commands.iter_mut() {
        *u = problem.clip(*u);
    }
    let mut gradient = [[0.0; 3]; STAGES];
    let mut cost = problem.cost(commands, Some(&mut gradient));
    let mut recent = [cost; MEMORY];
    let mut length = 0.02;
    let (mut best, mut best_cost) = (*commands, cost);
    for step in 0..STEPS {
        let mut direction = [[0.0; 3]; STAGES];
        let mut largest = 0.0_f64;
        for i in 0..STAGES {
            let target = problem.clip(std::array::from_fn(|k| commands[i][k] - length * gradient[i][k]));
            direction[i] = std::array::from_fn(|k| target[k] - commands[i][k]);
            largest = direction[i].iter().fold(largest, |most, d| most.max(d.abs()));
        }
        if largest < TOLERANCE * length.clamp(0.05, 1.0) {
            break;
        }
        let slope = dot(&direction, &gradient);
        let ceiling = recent.iter().fold(f64::NEG_INFINITY, |most, c| most.max(*c));
        let mut share = 1.0;
        let mut next = *commands;
        let mut next_gradient = gradient;
        let mut accepted = false;
        for _ in 0..12 {
            for i in 0..STAGES {
                next[i] = std::array::from_fn(|k| commands[i][k] + share * direction[i][k]);
            }
            let next_cost = problem.cost(&next, Some(&mut next_gradient));
            if next_cost <= ceiling + 1e-4 * share * slope {
                cost = next_cost;
                accepted = true;
                break;
            }
            // The minimum of the parabola, kept away from both ends.
            let parabola = -0.5 * share * share * slope / (next_cost - cost - share * slope);
            share = if parabola.is_finite() { parabola.clamp(0.1 * share, 0.5 * share) } else { 0.5 * share };
        }
        if !accepted {
            break;
        }
        let (mut ss, mut sy) = (0.0, 0.0);
        for i in 0..STAGES {
            for k in 0..3 {
                let s = next[i][k] - commands[i][k];
                ss += s * s;
                sy += s * (next_gradient[i][k] - gradient[i][k]);
            }
        }
        length = if sy > 0.0 { (ss / sy).clamp(1e-4, 1.0) } else { 0.1 };
        (*commands, gradient) = (next, next_gradient);
        recent[step % MEMORY] = cost;
        if cost < best_cost {
            (best, best_cost) = (next, cost);
        }
    }
    *commands = best;
    best_cost
}
