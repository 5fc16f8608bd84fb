//! Cost (3): the keypoints stay near the human's, rescaled; and every coordinate near the kinematic stage's.
//!
//! J_ref = || phi_FK(q) - p_mocap ||^2_Qm. The second part is for what no keypoint sees, like a wrist's turn.

use super::node::View;
use super::terms::Sink;
use nalgebra::Vector3;

pub(crate) fn rows(view: &View, sink: &mut Sink) {
    let plan = view.plan;
    let w = &plan.settings.weights;
    for ((at, weight), target) in plan.keypoints.iter().zip(&view.node.targets) {
        let world = view.s.dynamics.pose.point(at);
        let weight = plan.step * w.q_m * weight;
        if weight == 0.0 {
            continue;
        }
        for axis in 0..3 {
            let direction = Vector3::ith(axis, 1.0);
            sink.cost(weight, world[axis] - target[axis], |row| {
                view.point_row(at.link, &world, &direction, &mut row.q);
            });
        }
    }
    for (i, (x, wanted)) in view.q.iter().zip(&view.node.posture).enumerate() {
        sink.cost(plan.step * w.q_posture, x - wanted, |row| row.q[i] = 1.0);
    }
}
