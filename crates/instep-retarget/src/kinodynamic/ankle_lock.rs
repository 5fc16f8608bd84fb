//! Ankle lock (19): the kicking foot's ankle keeps its angles from T^lock to the impact.
//!
//! Both ankle joints. All coefficients that the spline sees in that time are equal, so the speed is zero throughout and
//! not at the nodes only. Unit: share of the speed limit.

use super::plan::Plan;
use super::solver::CoefficientSink;
use super::terms::Family;

pub(crate) fn rows(plan: &Plan, c: &[f64], sink: &mut CoefficientSink) {
    let nv = plan.tree.nv;
    let leg = plan.robot.leg(plan.phases.kick_foot);
    let [first, last] = plan.lock;
    for joint in [Some(leg.ankle_pitch), leg.ankle_roll].into_iter().flatten() {
        let scale = 1.0 / (plan.step * plan.robot.joints[joint].speed);
        for b in first..last + 2 {
            let i = b * nv + 6 + joint;
            sink.equal(Family::AnkleLock, b, (c[i + nv] - c[i]) * scale, &[(i, -scale), (i + nv, scale)]);
        }
    }
}
