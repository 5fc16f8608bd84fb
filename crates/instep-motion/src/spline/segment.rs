//! One polynomial between two states: the cubic by position and velocity at both ends, the quintic by acceleration
//! too. Closed forms of the Hermite conditions, in the time since the segment's start.

use crate::MotionError;
use crate::spline::State;

/// A polynomial of degree 3 in `D` coordinates over `0..=duration` seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cubic<const D: usize> {
    /// Coefficient of `t^i` at index `i`.
    coefficients: [[f64; D]; 4],
    duration: f64,
}

/// A polynomial of degree 5 in `D` coordinates over `0..=duration` seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quintic<const D: usize> {
    /// Coefficient of `t^i` at index `i`.
    coefficients: [[f64; D]; 6],
    duration: f64,
}

/// A span must be positive, or the polynomial is not determined.
pub(super) fn check_duration(name: &str, duration: f64) -> Result<(), MotionError> {
    if duration.is_finite() && duration > 0.0 {
        return Ok(());
    }
    Err(MotionError::argument(name, duration.to_string(), "a positive number of seconds"))
}

/// The `derivative`-th derivative at `t` of the polynomial with `coefficients`, by Horner's rule.
fn evaluate<const N: usize, const D: usize>(coefficients: &[[f64; D]; N], derivative: usize, t: f64) -> [f64; D] {
    let mut sum = [0.0; D];
    for i in (derivative..N).rev() {
        // i (i-1) ... (i-derivative+1): what differentiating t^i brings down.
        let factor: f64 = (0..derivative).map(|k| (i - k) as f64).product();
        for (s, c) in sum.iter_mut().zip(&coefficients[i]) {
            *s = *s * t + factor * c;
        }
    }
    sum
}

impl<const D: usize> Cubic<D> {
    /// The cubic with these positions and velocities at time 0 and at `duration` seconds.
    ///
    /// # Errors
    ///
    /// [`MotionError::Argument`] if `duration` is not finite and positive.
    pub fn between(
        duration: f64,
        (p0, v0): ([f64; D], [f64; D]),
        (p1, v1): ([f64; D], [f64; D]),
    ) -> Result<Self, MotionError> {
        check_duration("duration", duration)?;
        let mut coefficients = [[0.0; D]; 4];
        let t = duration;
        for i in 0..D {
            let rise = p1[i] - p0[i];
            coefficients[0][i] = p0[i];
            coefficients[1][i] = v0[i];
            coefficients[2][i] = (3.0 * rise / t - 2.0 * v0[i] - v1[i]) / t;
            coefficients[3][i] = (v0[i] + v1[i] - 2.0 * rise / t) / (t * t);
        }
        Ok(Self { coefficients, duration })
    }

    /// From coefficients of `1, t, t^2, t^3`.
    pub(super) fn from_coefficients(coefficients: [[f64; D]; 4], duration: f64) -> Self {
        Self { coefficients, duration }
    }

    /// Length of the segment, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Position at `t` seconds, clamped to the segment.
    #[must_use]
    pub fn position(&self, t: f64) -> [f64; D] {
        evaluate(&self.coefficients, 0, t.clamp(0.0, self.duration))
    }

    /// Velocity at `t` seconds, clamped to the segment.
    #[must_use]
    pub fn velocity(&self, t: f64) -> [f64; D] {
        evaluate(&self.coefficients, 1, t.clamp(0.0, self.duration))
    }

    /// Acceleration at `t` seconds, clamped to the segment.
    #[must_use]
    pub fn acceleration(&self, t: f64) -> [f64; D] {
        evaluate(&self.coefficients, 2, t.clamp(0.0, self.duration))
    }
}

impl<const D: usize> Quintic<D> {
    /// The quintic with these states at time 0 and at `duration` seconds.
    ///
    /// # Errors
    ///
    /// [`MotionError::Argument`] if `duration` is not finite and positive.
    pub fn between(duration: f64, from: &State<D>, to: &State<D>) -> Result<Self, MotionError> {
        check_duration("duration", duration)?;
        let t = duration;
        // What is left of the end state after the first three coefficients, in units of position.
        let left = |i: usize| {
            let (p, v, a) = (from.position[i], from.velocity[i], from.acceleration[i]);
            let dp = to.position[i] - (p + v * t + a * t * t / 2.0);
            let dv = (to.velocity[i] - (v + a * t)) * t;
            let da = (to.acceleration[i] - a) * t * t;
            (dp, dv, da)
        };
        let of = |f: &dyn Fn((f64, f64, f64)) -> f64| std::array::from_fn(|i| f(left(i)));
        let coefficients = [
            from.position,
            from.velocity,
            from.acceleration.map(|a| a / 2.0),
            of(&|(dp, dv, da)| (10.0 * dp - 4.0 * dv + da / 2.0) / t.powi(3)),
            of(&|(dp, dv, da)| (-15.0 * dp + 7.0 * dv - da) / t.powi(4)),
            of(&|(dp, dv, da)| (6.0 * dp - 3.0 * dv + da / 2.0) / t.powi(5)),
        ];
        Ok(Self { coefficients, duration })
    }

    /// Length of the segment, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Position at `t` seconds, clamped to the segment.
    #[must_use]
    pub fn position(&self, t: f64) -> [f64; D] {
        evaluate(&self.coefficients, 0, t.clamp(0.0, self.duration))
    }

    /// Velocity at `t` seconds, clamped to the segment.
    #[must_use]
    pub fn velocity(&self, t: f64) -> [f64; D] {
        evaluate(&self.coefficients, 1, t.clamp(0.0, self.duration))
    }

    /// Acceleration at `t` seconds, clamped to the segment.
    #[must_use]
    pub fn acceleration(&self, t: f64) -> [f64; D] {
        evaluate(&self.coefficients, 2, t.clamp(0.0, self.duration))
    }
}
