//! The preview controller of the zero-moment point: paper 5, section 3.2, after Kajita et al., Biped walking pattern
//! generation by using preview control of zero-moment point (2003).
//!
//! Model, one axis at a time: the cart on the table with the state x = (position, speed, acceleration) of the centre of
//! mass and its jerk u as input, x+ = A x + b u, whose zero-moment point is p = c x with c = (1, 0, -z / g). The control
//!
//! u = -K x + f_1 p_ref(1) + ... + f_N p_ref(N)
//!
//! minimises the sum of Q (p_ref - p)^2 + R u^2 over all time for a reference known N samples ahead. K and f come from the
//! discrete Riccati equation, once. Where the paper prints `Ru^2j`, R u_j^2 is meant.
//!
//! The paper's reference never moves, and its sum of f is one number then. Here it moves twice in a kick, over to the
//! support foot and back, and carries what the swinging leg does to the zero-moment point, so the sum is made in full:
//! N multiplications an axis.

use nalgebra::{Matrix3, RowVector3, SMatrix, Vector3};

use crate::KickError;
use crate::preview::riccati;
use crate::whole_body::drive::GRAVITY;

/// The controller of one axis; the same for both.
#[derive(Debug, Clone, PartialEq)]
pub struct Regulator {
    a: Matrix3<f64>,
    b: Vector3<f64>,
    c: RowVector3<f64>,
    gain: RowVector3<f64>,
    preview: Vec<f64>,
}

/// A, b and c for samples `dt` (s) apart and a centre of mass `height` (m) over the ground.
#[must_use]
pub fn cart_table(dt: f64, height: f64) -> (Matrix3<f64>, Vector3<f64>, RowVector3<f64>) {
    let a = Matrix3::new(1.0, dt, dt * dt / 2.0, 0.0, 1.0, dt, 0.0, 0.0, 1.0);
    let b = Vector3::new(dt.powi(3) / 6.0, dt * dt / 2.0, dt);
    (a, b, RowVector3::new(1.0, 0.0, -height / GRAVITY))
}

impl Regulator {
    /// For samples `dt` (s) apart, a centre of mass `height` (m) over the ground, the weights `q` (on the zero-moment
    /// point's error) and `r` (on the jerk), and a reference known `count` samples ahead.
    ///
    /// # Errors
    /// When the weights cannot be.
    pub fn new(dt: f64, height: f64, (q, r): (f64, f64), count: usize) -> Result<Self, KickError> {
        let (a, b, c) = cart_table(dt, height);
        let weight = c.transpose() * q * c;
        let solution = riccati::solve(&a, &b, &weight, &SMatrix::<f64, 1, 1>::new(r));
        let Some(p) = solution.filter(|_| q > 0.0 && r > 0.0) else {
            return Err(KickError::Setting {
                field: "regulator".into(),
                found: format!("q = {q}, r = {r}"),
                expected: "weights above 0 for which the Riccati equation has a solution".into(),
            });
        };
        let scale = 1.0 / (r + (b.transpose() * p * b)[0]);
        let gain = b.transpose() * p * a * scale;
        // f_i = scale b^T (A - b K)^T^(i-1) c^T Q: the vector on the right is carried from one to the next.
        let closed = (a - b * gain).transpose();
        let mut carried: Vector3<f64> = c.transpose() * q;
        let mut preview = Vec::with_capacity(count);
        for _ in 0..count {
            preview.push(scale * b.dot(&carried));
            carried = closed * carried;
        }
        Ok(Self { a, b, c, gain, preview })
    }

    /// The state gains K.
    #[must_use]
    pub fn gain(&self) -> RowVector3<f64> {
        self.gain
    }

    /// The preview gains f_1 to f_N.
    #[must_use]
    pub fn preview(&self) -> &[f64] {
        &self.preview
    }

    /// The jerk (m/s^3) for the present `state`; `reference` gives the wanted zero-moment point (m) so many samples ahead,
    /// 1 and more.
    pub fn jerk(&self, state: &Vector3<f64>, reference: impl Fn(usize) -> f64) -> f64 {
        let ahead: f64 = self.preview.iter().enumerate().map(|(i, f)| f * reference(i + 1)).sum();
        ahead - (self.gain * state)[0]
    }

    /// The state one sample later.
    #[must_use]
    pub fn advance(&self, state: &Vector3<f64>, jerk: f64) -> Vector3<f64> {
        self.a * state + self.b * jerk
    }

    /// The zero-moment point of a state, m.
    #[must_use]
    pub fn zmp(&self, state: &Vector3<f64>) -> f64 {
        (self.c * state)[0]
    }
}
