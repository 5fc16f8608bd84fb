//! Cost (4) with the window (5): the kicking foot should be fast from the start of the swing to the impact.
//!
//! J_imp = -zeta || J_foot v ||^2_Qi, a concave cost. The Gauss-Newton step takes its gradient and no curvature, which
//! is the step of the concave-convex procedure: each step minimises a linear bound of it. Where a foot speed is asked
//! for, the missing part of it at the impact is a cost too. At the impact the striking point belongs behind the ball,
//! wherever that lies; not in the paper, whose ball lies where the clip's foot comes by.

use nalgebra::Vector3;

use super::node::View;
use super::terms::Sink;

pub(crate) fn rows(view: &View, sink: &mut Sink) {
    let plan = view.plan;
    let w = &plan.settings.weights;
    if !view.node.swing {
        return;
    }
    let link = plan.strike.link;
    let at = view.s.dynamics.pose.point(&plan.strike);
    let speed = view.velocity(link, &at);
    if w.q_i.iter().any(|q| *q > 0.0) {
        let weighted = Vector3::from(w.q_i).component_mul(&speed) * plan.step;
        let value = -weighted.dot(&speed);
        sink.gradient_only(value, |row| view.velocity_row(link, &at, &(weighted * -2.0), row));
    }
    if view.node.impact {
        for axis in 0..3 {
            let direction = Vector3::ith(axis, 1.0);
            sink.cost(w.q_ball, at[axis] - plan.strike_place[axis], |row| {
                view.point_row(link, &at, &direction, &mut row.q);
            });
        }
    }
    if let (Some(wanted), true) = (plan.settings.foot_speed, view.node.impact) {
        let missing = (wanted - speed.x).max(0.0);
        sink.cost(w.q_target, missing, |row| {
            if missing > 0.0 {
                view.velocity_row(link, &at, &-Vector3::x(), row);
            }
        });
    }
}
