//! The state between the knots of a reference.
//!
//! Base position and joints: the cubic through both knots' positions and velocities; the velocities returned are its
//! derivatives, so they are those of the motion and equal the stored ones at the knots.
//!
//! Base orientation: `q(s) = q0 exp(phi(s))` with `phi` the cubic through `0` and `log(q0^-1 q1)` whose derivatives
//! at the ends give the stored angular velocities. In the base frame `omega = Jr(phi) phi'`, with the right Jacobian
//! of SO(3) (J. Sola et al., A micro Lie theory, 2018, equations 143 and 144), so `phi'(0) = omega0` and
//! `phi'(1) = Jr(phi1)^-1 omega1`; between them the same relation gives the angular velocity returned. So it too is
//! the derivative of the orientation returned. Knots must be less than half a turn apart.
//!
//! Forces, torques, centre of mass and momentum: linear. Contacts: those of the earlier knot.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::{Knot, Reference};

impl Reference {
    /// The state at the time `t`, s (zero at the first knot), clamped to the reference: outside, it is the state of
    /// the nearer end, its velocities too. Allocates only while `knot` has not yet the capacity. The reference must
    /// be valid ([`Self::validate`]).
    ///
    /// # Panics
    ///
    /// If the reference has no knot.
    pub fn sample_into(&self, t: f64, knot: &mut Knot) {
        let last = self.knots.len() - 1;
        // NaN clamps to NaN and the cast makes it 0.
        let place = (t * self.rate).clamp(0.0, last as f64);
        let i = (place as usize).min(last.saturating_sub(1));
        let (a, b) = (&self.knots[i], &self.knots[(i + 1).min(last)]);
        let between = Between { s: place - i as f64, step: 1.0 / self.rate };
        for axis in 0..3 {
            let ends = [a, b].map(|k| (k.base_position[axis], k.base_velocity[axis]));
            (knot.base_position[axis], knot.base_velocity[axis]) = between.cubic(ends);
        }
        (knot.base_orientation, knot.base_angular_velocity) = between.orientation(a, b);
        knot.joints.clear();
        knot.joint_velocities.clear();
        for j in 0..a.joints.len() {
            let (position, velocity) = between.cubic([a, b].map(|k| (k.joints[j], k.joint_velocities[j])));
            knot.joints.push(position);
            knot.joint_velocities.push(velocity);
        }
        // At the very last knot, that knot is the earlier one.
        let earlier = if place >= last as f64 { &self.knots[last] } else { a };
        knot.contacts.clone_from(&earlier.contacts);
        knot.forces.clear();
        knot.forces.extend(a.forces.iter().zip(&b.forces).map(|(p, q)| between.linear(*p, *q)));
        knot.torques.clear();
        knot.torques.extend(a.torques.iter().zip(&b.torques).map(|(p, q)| between.linear([*p], [*q])[0]));
        knot.com = between.linear(a.com, b.com);
        knot.momentum = between.linear(a.momentum, b.momentum);
    }
}

/// A place between two knots.
struct Between {
    /// From 0 at the first to 1 at the second.
    s: f64,
    /// Time between them, s.
    step: f64,
}

impl Between {
    fn linear<const N: usize>(&self, a: [f64; N], b: [f64; N]) -> [f64; N] {
        std::array::from_fn(|i| a[i] + self.s * (b[i] - a[i]))
    }

    /// Value and derivative of the cubic with these values and derivatives at the ends.
    fn cubic(&self, [(p0, v0), (p1, v1)]: [(f64, f64); 2]) -> (f64, f64) {
        let (s, h) = (self.s, self.step);
        let (r, rise) = (1.0 - s, p1 - p0);
        let value = p0 + rise * s * s * (3.0 - 2.0 * s) + h * (v0 * s * r * r - v1 * s * s * r);
        let slope = rise / h * 6.0 * s * r + v0 * r * (1.0 - 3.0 * s) + v1 * s * (3.0 * s - 2.0);
        (value, slope)
    }

    fn orientation(&self, a: &Knot, b: &Knot) -> ([f64; 4], [f64; 3]) {
        let [q0, q1] = [a, b].map(|knot| unit(knot.base_orientation));
        let [omega0, omega1] = [a, b].map(|knot| Vector3::from(knot.base_angular_velocity));
        // The logarithm takes the short way round, whatever the signs of the quaternions.
        let end = (q0.inverse() * q1).scaled_axis();
        let speed = inverse_right_jacobian(&end, &omega1);
        let (mut phi, mut slope) = (Vector3::zeros(), Vector3::zeros());
        for axis in 0..3 {
            (phi[axis], slope[axis]) = self.cubic([(0.0, omega0[axis]), (end[axis], speed[axis])]);
        }
        let mut q = q0 * UnitQuaternion::from_scaled_axis(phi);
        q.renormalize();
        let omega = right_jacobian(&phi, &slope);
        ([q.w, q.i, q.j, q.k], omega.into())
    }
}

fn unit([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

/// `Jr(phi) v`.
fn right_jacobian(phi: &Vector3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    let angle2 = phi.norm_squared();
    let (a, b) = if angle2 < 1e-6 {
        (0.5 - angle2 / 24.0, 1.0 / 6.0 - angle2 / 120.0)
    } else {
        let angle = angle2.sqrt();
        ((1.0 - angle.cos()) / angle2, (angle - angle.sin()) / (angle2 * angle))
    };
    v - phi.cross(v) * a + phi.cross(&phi.cross(v)) * b
}

/// `Jr(phi)^-1 v`, for `phi` shorter than a full turn.
fn inverse_right_jacobian(phi: &Vector3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    let angle2 = phi.norm_squared();
    let c = if angle2 < 1e-6 {
        1.0 / 12.0 + angle2 / 720.0
    } else {
        let half = angle2.sqrt() / 2.0;
        (1.0 - half / half.tan()) / angle2
    };
    v + phi.cross(v) * 0.5 + phi.cross(&phi.cross(v)) * c
}
