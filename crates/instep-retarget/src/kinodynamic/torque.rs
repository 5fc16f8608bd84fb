//! Torque limits (18), with the whole of (33) instead of the estimate (15).
//!
//! (15) leaves the inertia of the moving limbs out, which in a kick is most of the torque; the paper then iterates
//! with (33). Here the rows are those of (33) from the start. What a drive can give falls from its corner speed to
//! zero at its limit ([`instep_robot::control::torque_range`]), so each bound is two lines in torque and speed.
//! Unit: share of the joint's limit.

use super::node::View;
use super::terms::{Family, Sink};

pub(crate) fn rows(view: &View, sink: &mut Sink) {
    let margin = 1.0 - view.plan.settings.torque_margin;
    for (j, joint) in view.plan.robot.joints.iter().enumerate() {
        let i = 6 + j;
        let scale = 1.0 / (margin * joint.torque);
        let share = view.s.generalised[i] * scale;
        let slope = 1.0 / (joint.speed * (1.0 - joint.corner));
        for sign in [1.0, -1.0] {
            sink.at_most(Family::Torque, sign * share - 1.0, |row| view.generalised_row(i, sign * scale, row));
            let falling = sign * (share + slope * view.v[i]) - 1.0 / (1.0 - joint.corner);
            sink.at_most(Family::Torque, falling, |row| {
                view.generalised_row(i, sign * scale, row);
                row.v[i] += sign * slope;
            });
        }
    }
}
