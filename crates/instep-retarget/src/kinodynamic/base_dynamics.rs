//! The dynamics of the unactuated base: six rows a node, (1), (2), (7) and (8) with their momenta eliminated.
//!
//! The first six generalised forces of (33) are the rates of linear and angular momentum less the wrench of gravity
//! and contact forces: zero for a motion that is possible. The first three are (1) as they stand; the other three are
//! (2) about the base's origin instead of the centre of mass, along the axes of yaw, pitch and roll. See [`super`].
//! Unit: the robot's weight m g, and m g times 1 m.

use super::node::View;
use super::terms::{Family, Sink};

pub(crate) fn rows(view: &View, sink: &mut Sink) {
    let scale = 1.0 / view.plan.weight;
    for i in 0..6 {
        sink.equal(Family::BaseDynamics, view.s.generalised[i] * scale, |row| view.generalised_row(i, scale, row));
    }
}
