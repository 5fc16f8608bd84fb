//! Joint range (16) and joint speed (17), on the spline's coefficients.
//!
//! A B-spline stays within the range of its coefficients, and its derivative within that of their differences over the
//! step (de Boor 2001, chapter IX): bounds on those hold at every instant, not at the nodes only. Units: rad; share of
//! the speed limit.

use super::plan::Plan;
use super::solver::CoefficientSink;
use super::terms::Family;

pub(crate) fn rows(plan: &Plan, c: &[f64], sink: &mut CoefficientSink) {
    let nv = plan.tree.nv;
    let margin = plan.settings.joint_margin;
    let greatest = 1.0 - plan.settings.speed_margin;
    let blocks = c.len() / nv;
    for b in 0..blocks {
        for (j, joint) in plan.robot.joints.iter().enumerate() {
            let i = b * nv + 6 + j;
            sink.at_most(Family::JointLimit, b, c[i] - (joint.range[1] - margin), &[(i, 1.0)]);
            sink.at_most(Family::JointLimit, b, joint.range[0] + margin - c[i], &[(i, -1.0)]);
            if b + 1 < blocks {
                let scale = 1.0 / (plan.step * joint.speed);
                let share = (c[i + nv] - c[i]) * scale;
                sink.at_most(Family::JointSpeed, b, share - greatest, &[(i, -scale), (i + nv, scale)]);
                sink.at_most(Family::JointSpeed, b, -share - greatest, &[(i, scale), (i + nv, -scale)]);
            }
        }
    }
}
