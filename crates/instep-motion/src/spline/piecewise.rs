//! Curves of several polynomials through knots at given times.
//!
//! [`CubicSpline`] solves the tridiagonal system for the second derivatives at the knots (the textbook form, e.g. de
//! Boor, A Practical Guide to Splines, chapter IV) by Thomas's algorithm; the system is diagonally dominant, so no
//! pivoting is needed. [`QuinticSpline`] has nothing to solve: each segment follows from its two knots.

use crate::MotionError;
use crate::spline::segment::check_duration;
use crate::spline::{Cubic, Quintic};

/// Position and its first two derivatives in `D` coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State<const D: usize> {
    /// Position, in the caller's unit.
    pub position: [f64; D],
    /// Velocity, that unit a second.
    pub velocity: [f64; D],
    /// Acceleration, that unit a second squared.
    pub acceleration: [f64; D],
}

impl<const D: usize> State<D> {
    /// At rest at `position`.
    #[must_use]
    pub fn at_rest(position: [f64; D]) -> Self {
        Self { position, velocity: [0.0; D], acceleration: [0.0; D] }
    }
}

/// What a cubic spline does at its two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ends<const D: usize> {
    /// No acceleration at either end.
    Natural,
    /// These velocities at the first and the last knot.
    Clamped([f64; D], [f64; D]),
}

/// A cubic spline through knots, twice continuously differentiable.
#[derive(Debug, Clone, PartialEq)]
pub struct CubicSpline<const D: usize> {
    /// Start of each segment, s.
    starts: Vec<f64>,
    segments: Vec<Cubic<D>>,
}

/// A quintic spline through knots whose velocities and accelerations are given, so twice continuously differentiable.
#[derive(Debug, Clone, PartialEq)]
pub struct QuinticSpline<const D: usize> {
    /// Start of each segment, s.
    starts: Vec<f64>,
    segments: Vec<Quintic<D>>,
}

/// Knot times must grow and be two at least.
fn check_times(times: impl Iterator<Item = f64>) -> Result<(), MotionError> {
    let times: Vec<f64> = times.collect();
    if times.len() < 2 {
        return Err(MotionError::argument("knots", times.len().to_string(), "two at least"));
    }
    times.windows(2).enumerate().try_for_each(|(i, pair)| {
        check_duration(&format!("time of knots[{}] after knots[{i}]", i + 1), pair[1] - pair[0])
    })
}

/// The segment that holds `t`, and the time since its start.
fn locate(starts: &[f64], t: f64) -> (usize, f64) {
    let i = starts.partition_point(|start| *start <= t).saturating_sub(1);
    (i, t - starts[i])
}

impl<const D: usize> CubicSpline<D> {
    /// Through `knots`, each a time in seconds and a position, times growing.
    ///
    /// # Errors
    ///
    /// [`MotionError::Argument`] for fewer than two knots or times that do not grow.
    pub fn through(knots: &[(f64, [f64; D])], ends: Ends<D>) -> Result<Self, MotionError> {
        check_times(knots.iter().map(|(t, _)| *t))?;
        let n = knots.len();
        let step = |i: usize| knots[i + 1].0 - knots[i].0;
        let slope = |i: usize, d: usize| (knots[i + 1].1[d] - knots[i].1[d]) / step(i);
        // Rows: lower m[i-1] + diagonal m[i] + upper m[i+1] = right, m the second derivatives.
        let mut upper = vec![0.0; n];
        let mut m = vec![[0.0; D]; n];
        for i in 0..n {
            let (low, diagonal, up) = match (i, ends) {
                (0, Ends::Natural) => (0.0, 1.0, 0.0),
                (0, Ends::Clamped(..)) => (0.0, 2.0 * step(0), step(0)),
                (i, Ends::Natural) if i + 1 == n => (0.0, 1.0, 0.0),
                (i, Ends::Clamped(..)) if i + 1 == n => (step(i - 1), 2.0 * step(i - 1), 0.0),
                (i, _) => (step(i - 1), 2.0 * (step(i - 1) + step(i)), step(i)),
            };
            let pivot = diagonal - if i > 0 { low * upper[i - 1] } else { 0.0 };
            upper[i] = up / pivot;
            for d in 0..D {
                let right = match (i, ends) {
                    (0, Ends::Clamped(v, _)) => 6.0 * (slope(0, d) - v[d]),
                    (i, Ends::Clamped(_, v)) if i + 1 == n => 6.0 * (v[d] - slope(i - 1, d)),
                    (0, Ends::Natural) => 0.0,
                    (i, Ends::Natural) if i + 1 == n => 0.0,
                    (i, _) => 6.0 * (slope(i, d) - slope(i - 1, d)),
                };
                let before = if i > 0 { m[i - 1][d] } else { 0.0 };
                m[i][d] = (right - low * before) / pivot;
            }
        }
        for i in (0..n - 1).rev() {
            let after = m[i + 1];
            for (here, after) in m[i].iter_mut().zip(after) {
                *here -= upper[i] * after;
            }
        }
        let segments = (0..n - 1).map(|i| {
            let mut c = [[0.0; D]; 4];
            for d in 0..D {
                c[0][d] = knots[i].1[d];
                c[1][d] = slope(i, d) - step(i) * (2.0 * m[i][d] + m[i + 1][d]) / 6.0;
                c[2][d] = m[i][d] / 2.0;
                c[3][d] = (m[i + 1][d] - m[i][d]) / (6.0 * step(i));
            }
            Cubic::from_coefficients(c, step(i))
        });
        let segments = segments.collect();
        Ok(Self { starts: knots[..n - 1].iter().map(|(t, _)| *t).collect(), segments })
    }

    /// Position at `t` seconds, clamped to the curve.
    #[must_use]
    pub fn position(&self, t: f64) -> [f64; D] {
        let (i, t) = locate(&self.starts, t);
        self.segments[i].position(t)
    }

    /// Velocity at `t` seconds, clamped to the curve.
    #[must_use]
    pub fn velocity(&self, t: f64) -> [f64; D] {
        let (i, t) = locate(&self.starts, t);
        self.segments[i].velocity(t)
    }

    /// Acceleration at `t` seconds, clamped to the curve.
    #[must_use]
    pub fn acceleration(&self, t: f64) -> [f64; D] {
        let (i, t) = locate(&self.starts, t);
        self.segments[i].acceleration(t)
    }
}

impl<const D: usize> QuinticSpline<D> {
    /// Through `knots`, each a time in seconds and a state, times growing.
    ///
    /// # Errors
    ///
    /// [`MotionError::Argument`] for fewer than two knots or times that do not grow.
    pub fn through(knots: &[(f64, State<D>)]) -> Result<Self, MotionError> {
        check_times(knots.iter().map(|(t, _)| *t))?;
        let segments = knots.windows(2).map(|k| Quintic::between(k[1].0 - k[0].0, &k[0].1, &k[1].1));
        let segments = segments.collect::<Result<_, _>>()?;
        Ok(Self { starts: knots[..knots.len() - 1].iter().map(|(t, _)| *t).collect(), segments })
    }

    /// Position at `t` seconds, clamped to the curve.
    #[must_use]
    pub fn position(&self, t: f64) -> [f64; D] {
        let (i, t) = locate(&self.starts, t);
        self.segments[i].position(t)
    }

    /// Velocity at `t` seconds, clamped to the curve.
    #[must_use]
    pub fn velocity(&self, t: f64) -> [f64; D] {
        let (i, t) = locate(&self.starts, t);
        self.segments[i].velocity(t)
    }

    /// Acceleration at `t` seconds, clamped to the curve.
    #[must_use]
    pub fn acceleration(&self, t: f64) -> [f64; D] {
        let (i, t) = locate(&self.starts, t);
        self.segments[i].acceleration(t)
    }
}
