//! Cost (6): J_reg = (1 - zeta) ||v||^2_Qv + ||h||^2_Qh + sum ||f||^2_Qf, and small costs on accelerations and torques.
//!
//! Speeds of joints only: the base has to travel. h is the angular momentum about the centre of mass, A_CAM(q) v.

use super::node::View;
use super::terms::Sink;

pub(crate) fn rows(view: &View, sink: &mut Sink) {
    let plan = view.plan;
    let w = &plan.settings.weights;
    let step = plan.step;
    if !view.node.swing {
        for (i, v) in view.v.iter().enumerate().skip(6) {
            sink.cost(step * w.q_v, *v, |row| row.v[i] = 1.0);
        }
    }
    if w.q_h > 0.0 {
        let (_, h) = view.s.dynamics.momentum();
        for axis in 0..3 {
            sink.cost(step * w.q_h, h[axis], |row| {
                for i in 0..plan.tree.nv {
                    let (by_position, by_speed) = view.s.dynamics.angular_momentum_by(&plan.tree, i);
                    row.q[i] = by_position[axis];
                    row.v[i] = by_speed[axis];
                }
            });
        }
    }
    for (i, f) in view.f.iter().enumerate() {
        sink.cost(step * w.q_f, *f, |row| row.f[i] = 1.0);
    }
    for (i, a) in view.a.iter().enumerate() {
        sink.cost(step * w.q_a, *a, |row| row.a[i] = 1.0);
    }
    if w.q_tau > 0.0 {
        for (j, joint) in plan.robot.joints.iter().enumerate() {
            let scale = 1.0 / joint.torque;
            sink.cost(step * w.q_tau, view.s.generalised[6 + j] * scale, |row| view.generalised_row(6 + j, scale, row));
        }
    }
}
