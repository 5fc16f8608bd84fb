//! The friction cone (10): each contact force pushes, and inside the pyramid that the cone contains.
//!
//! |f_x|, |f_y| <= mu / sqrt(2) f_z, f_z >= 0: four rays. Points that do not stand have no force at all, nor has the
//! first and the last node of a stance, so that forces interpolated in time act on standing points only. Both rows keep
//! a little inside of the cone, [`SPARE`]. Unit: m g.

use super::node::View;
use super::terms::{Family, Sink};

/// Share of the cone's slope that is left for the knots half-way between the nodes ([`super::assemble`]).
const RESERVE: f64 = 0.1;
/// What is kept free of the cone, as a share of m g.
pub(crate) const SPARE: f64 = 3e-4;

pub(crate) fn rows(view: &View, sink: &mut Sink) {
    let slope = (1.0 - RESERVE) * view.plan.settings.friction * std::f64::consts::FRAC_1_SQRT_2;
    for (i, f) in view.f.chunks(3).enumerate() {
        sink.at_most(Family::Friction, 3.0 * SPARE - f[2], |row| row.f[3 * i + 2] = -1.0);
        for axis in 0..2 {
            for sign in [1.0, -1.0] {
                sink.at_most(Family::Friction, sign * f[axis] - slope * f[2] + SPARE, |row| {
                    row.f[3 * i + axis] = sign;
                    row.f[3 * i + 2] = -slope;
                });
            }
        }
    }
}
