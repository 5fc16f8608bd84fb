//! The friction cone (10): each contact force pushes, and inside the pyramid that the cone contains.
//!
//! |f_x|, |f_y| <= mu / sqrt(2) f_z, f_z >= 0: four rays; z is straight off the ground under the foot, x and y are the
//! world's, laid on it. Points that do not stand have no force at all, nor has the
//! first and the last node of a stance, so that forces interpolated in time act on standing points only. Both rows keep
//! a little inside of the cone, [`SPARE`]. Unit: m g.

use nalgebra::Vector3;

use super::node::View;
use super::terms::{Family, Row, Sink};

/// Share of the cone's slope that is left for the knots half-way between the nodes ([`super::assemble`]).
const RESERVE: f64 = 0.1;
/// What is kept free of the cone, as a share of m g.
pub(crate) const SPARE: f64 = 3e-4;

pub(crate) fn rows(view: &View, sink: &mut Sink) {
    let slope = (1.0 - RESERVE) * view.plan.settings.friction * std::f64::consts::FRAC_1_SQRT_2;
    for (i, (&point, f)) in view.node.pushing.iter().zip(view.f.chunks(3)).enumerate() {
        let [x, y, up] = view.plan.footing(view.k, point);
        let along = |axis: &Vector3<f64>| axis[0] * f[0] + axis[1] * f[1] + axis[2] * f[2];
        let fill = |row: &mut Row, axis: &Vector3<f64>| row.f[3 * i..3 * i + 3].copy_from_slice(axis.as_slice());
        sink.at_most(Family::Friction, 3.0 * SPARE - along(&up), |row| fill(row, &-up));
        for axis in [x, y] {
            for sign in [1.0, -1.0] {
                let side = axis * sign;
                sink.at_most(Family::Friction, along(&side) - slope * along(&up) + SPARE, |row| {
                    fill(row, &(side - up * slope));
                });
            }
        }
    }
}
