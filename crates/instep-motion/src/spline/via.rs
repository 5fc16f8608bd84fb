//! The kick trajectory of paper 5 (ZMP preview kick engine), section 5: two cubics that meet in a via point.
//!
//! Source: the eight constraints before equation (12). From rest at the retraction point, through the via point with
//! velocity and acceleration continuous there, to the contact point. Each coordinate is independent.
//!
//! The system (12) as printed has slips, so the constraints are implemented and not the print:
//! - its second right-hand side divides by `t_via^2`; the row `a21 + a22 tf + a23 tf^2` asks for `t_f`;
//! - the third and later rows fit (`tf` and `t_f` are one and the same: the time *from the via point* to the end, as
//!   the constraint `alpha_2(t_f)` says of a polynomial that starts at 0);
//! - of `alpha_2(t_via)` on the right, `alpha_2(0)` is meant, the via point.
//!
//! The paper ends at rest at the contact point. An end velocity is a parameter here: zero gives the paper's.

use crate::MotionError;
use crate::spline::Cubic;
use crate::spline::segment::check_duration;

/// Two cubics over `0..=t_via + t_f` seconds in `D` coordinates, C2 at the via point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViaPoint<const D: usize> {
    first: Cubic<D>,
    second: Cubic<D>,
}

impl<const D: usize> ViaPoint<D> {
    /// From rest at `start` through `via` after `t_via` seconds to `end` another `t_f` seconds later, arriving there
    /// with `end_velocity` (zero in paper 5).
    ///
    /// # Errors
    ///
    /// [`MotionError::Argument`] if a time is not finite and positive.
    pub fn new(
        start: [f64; D],
        (t_via, via): (f64, [f64; D]),
        (t_f, end): (f64, [f64; D]),
        end_velocity: [f64; D],
    ) -> Result<Self, MotionError> {
        check_duration("t_via", t_via)?;
        check_duration("t_f", t_f)?;
        // Equal accelerations at the via point leave one unknown, the velocity v there (the cubics' closed forms):
        // 2 (v0 + 2 v)/t_via - 6 (via - start)/t_via^2 = 6 (end - via)/t_f^2 - 2 (2 v + v1)/t_f, with v0 = 0.
        let mut velocity = [0.0; D];
        for i in 0..D {
            let right = 6.0 * (end[i] - via[i]) / (t_f * t_f) + 6.0 * (via[i] - start[i]) / (t_via * t_via)
                - 2.0 * end_velocity[i] / t_f;
            velocity[i] = right / (4.0 / t_via + 4.0 / t_f);
        }
        Ok(Self {
            first: Cubic::between(t_via, (start, [0.0; D]), (via, velocity))?,
            second: Cubic::between(t_f, (via, velocity), (end, end_velocity))?,
        })
    }

    /// From the start to the end, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.first.duration() + self.second.duration()
    }

    /// When the via point is passed, s.
    #[must_use]
    pub fn t_via(&self) -> f64 {
        self.first.duration()
    }

    fn at(&self, t: f64) -> (&Cubic<D>, f64) {
        let via = self.t_via();
        if t < via { (&self.first, t) } else { (&self.second, t - via) }
    }

    /// Position at `t` seconds, clamped to the curve.
    #[must_use]
    pub fn position(&self, t: f64) -> [f64; D] {
        let (cubic, t) = self.at(t);
        cubic.position(t)
    }

    /// Velocity at `t` seconds, clamped to the curve.
    #[must_use]
    pub fn velocity(&self, t: f64) -> [f64; D] {
        let (cubic, t) = self.at(t);
        cubic.velocity(t)
    }

    /// Acceleration at `t` seconds, clamped to the curve.
    #[must_use]
    pub fn acceleration(&self, t: f64) -> [f64; D] {
        let (cubic, t) = self.at(t);
        cubic.acceleration(t)
    }
}
