//! No contact point below the ground (13). Points held by [`super::contact`] are on it; the others keep a clearance.
//!
//! Unit: m, upwards. See [`super::height_map`].

use nalgebra::Vector3;

use super::node::View;
use super::terms::{Family, Sink};

pub(crate) fn rows(view: &View, sink: &mut Sink) {
    for (point, contact) in view.plan.robot.contacts.iter().enumerate() {
        if view.node.standing[point] {
            continue;
        }
        // A point whose stance has just ended or will start is still at the ground.
        let count = view.plan.nodes.len();
        let beside = [view.k.saturating_sub(1), (view.k + 1).min(count - 1)];
        let near = beside.iter().any(|&n| view.plan.nodes[n].standing[point]);
        let clearance = if near { 0.0 } else { view.plan.settings.ground_clearance };
        let at = view.s.dynamics.pose.point(&contact.at);
        let (rest, slope) = view.plan.settings.ground.rest(at.x, at.y, contact.radius);
        sink.at_most(Family::Ground, rest + clearance - at.z, |row| {
            view.point_row(contact.at.link, &at, &Vector3::new(slope.x, slope.y, -1.0), &mut row.q);
        });
    }
}
