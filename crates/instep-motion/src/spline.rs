//! Cubic and quintic polynomials between boundary conditions, and curves made of them.
//!
//! Problem: trajectories of feet, centre of mass and joints through given points. All of them are polynomials in the
//! time since a segment's start, `D` coordinates at once; the unit of the coordinates is the caller's. Coefficients
//! are found once; evaluation allocates nothing and holds the end state outside the curve's span: position of the
//! nearer end, and the derivatives there.
//!
//! - [`Cubic`] and [`Quintic`]: one segment between two states (positions and speeds; accelerations too).
//! - [`CubicSpline`]: through knots, twice continuously differentiable, natural or clamped ends.
//! - [`QuinticSpline`]: through knots with given speeds and accelerations.
//! - [`ViaPoint`]: the kick trajectory of paper 5, equation (12): two cubics that meet in a via point.

mod piecewise;
mod segment;
mod via;

pub use piecewise::{CubicSpline, Ends, QuinticSpline, State};
pub use segment::{Cubic, Quintic};
pub use via::ViaPoint;
