//! Soccer fields: sizes, lines, goals, landmarks by class, sides, and the numbers of the rules.
//!
//! The one place that knows a field's numbers. A field's frame has its origin at the centre mark, x toward the goal
//! that the team attacks, y to the left; the other team's frame is the same turned by half a turn ([`Side`]). It knows
//! no robots and no balls in flight. Nothing here draws or moves.

mod error;
mod field;
mod line;
mod pose;
mod presets;
mod rules;
mod side;

pub use error::FieldError;
pub use field::{Area, Ball, Field, GoalSize, Landmark, LandmarkClass};
pub use line::Line;
pub use pose::{Pose, wrap};
pub use presets::FIELD_NAMES;
pub use rules::Rules;
pub use side::{Goal, Side};
