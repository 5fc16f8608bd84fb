//! From contact time and restitution to MuJoCo's stiffness and damping.
//!
//! With a negative `solref` = (-k, -b) MuJoCo makes a contact obey r'' = -k r - b r' whatever the masses (MuJoCo
//! documentation, "Solver parameters"), and the force never pulls. With w0 = sqrt(k) and the damping ratio
//! z = b / (2 w0) < 1, a collision of free bodies ends when the force reaches zero, and its restitution is
//!
//! e = exp(-z / sqrt(1 - z^2) (pi - atan2(2 z sqrt(1 - z^2), 1 - 2 z^2)))
//!
//! (Schwager and Poeschel, Coefficient of restitution and linear-dashpot model revisited, 2007, equation 21), so it
//! depends on z alone and does not fall with speed, as a real ball's does. Contact time is taken as pi / w0.

use crate::settings::ImpactLaw;

/// Impedance of ball contacts. It must be constant: one that rises with depth raises the restitution
/// (facts/mujoco-from-rust.md, section 5).
pub const SOLIMP: [f64; 5] = [0.99, 0.99, 0.001, 0.5, 2.0];

/// MuJoCo's `solref` for a collision law.
#[must_use]
pub fn solref(law: &ImpactLaw) -> [f64; 2] {
    let natural = std::f64::consts::PI / law.contact_time;
    [-natural * natural, -2.0 * damping_ratio(law.restitution) * natural]
}

/// Restitution of free bodies for the damping ratio `z` in [0, 1).
#[must_use]
pub fn restitution(z: f64) -> f64 {
    let root = (1.0 - z * z).sqrt();
    (-z / root * (std::f64::consts::PI - (2.0 * z * root).atan2(1.0 - 2.0 * z * z))).exp()
}

/// The damping ratio that gives the restitution `e` in (0, 1). Below the restitution of a nearly critical damping
/// (about 0.14) that nearly critical damping is returned.
#[must_use]
pub fn damping_ratio(e: f64) -> f64 {
    let (mut low, mut high) = (0.0, 0.999);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if restitution(middle) > e { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_inverts() {
        for e in [0.3, 0.5, 0.7, 0.82, 0.95] {
            assert!((restitution(damping_ratio(e)) - e).abs() < 1e-12);
        }
    }

    /// facts/mujoco-from-rust.md measured 0.749 with solref (-121847, -67.8).
    #[test]
    fn it_agrees_with_what_was_measured() {
        assert!((restitution(67.8 / (2.0 * 121_847_f64.sqrt())) - 0.749).abs() < 0.002);
        let [k, _] = solref(&ImpactLaw { contact_time: 0.009, restitution: 0.7, friction: 0.5 });
        assert!((k + 121_847.0).abs() < 1.0);
    }

    /// An independent oracle: the law integrated step by step.
    #[test]
    fn it_agrees_with_the_integrated_law() {
        let [k, b] = solref(&ImpactLaw { contact_time: 0.009, restitution: 0.7, friction: 0.5 });
        let (mut r, mut v, dt) = (0.0, -10.0, 1e-7);
        loop {
            let force = k * r + b * v;
            if force < 0.0 && r < 0.0 && v > 0.0 {
                break;
            }
            v += force.max(0.0) * dt;
            r += v * dt;
        }
        assert!((v / 10.0 - 0.7).abs() < 1e-4, "{v}");
    }
}
