//! A small cost on jerk, the third differences of the coefficients; not in the paper.
//!
//! Without it the optimum may swing a light limb to and fro from node to node: at the nodes the speed is then zero and
//! the momentum as wanted, between them it is not. The cost is 400 times dearer for that than for a kick.

use super::plan::Plan;
use super::solver::CoefficientSink;

pub(crate) fn rows(plan: &Plan, c: &[f64], sink: &mut CoefficientSink) {
    let nv = plan.tree.nv;
    let weight = plan.step * plan.settings.weights.q_j / plan.step.powi(6);
    for i in 0..c.len().saturating_sub(3 * nv) {
        let at = [i, i + nv, i + 2 * nv, i + 3 * nv];
        let jerk = c[at[3]] - 3.0 * c[at[2]] + 3.0 * c[at[1]] - c[at[0]];
        sink.cost(weight, jerk, &[(at[0], -1.0), (at[1], 3.0), (at[2], -3.0), (at[3], 1.0)]);
    }
}
