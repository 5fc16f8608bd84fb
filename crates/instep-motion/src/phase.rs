//! When things happen in a kick (paper 1, section II-A.1), found from the human's feet.

use serde::{Deserialize, Serialize};

/// Left or right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The robot's or human's left.
    Left,
    /// The robot's or human's right.
    Right,
}

impl Side {
    /// The other one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Left => "left",
            Self::Right => "right",
        })
    }
}

/// The kick's instants, s, in the time of the clip or reference they belong to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KickPhases {
    /// The foot that strikes the ball.
    pub kick_foot: Side,
    /// The support foot has settled on the ground (phase b).
    pub t_plant: f64,
    /// The kicking leg starts forward: T^swing, start of phases d and e.
    pub t_swing: f64,
    /// The ankle locks: T^lock of (19).
    pub t_lock: f64,
    /// The foot meets the ball, taken as the peak of the foot's speed. The paper's T^impact, the end of the
    /// impact, is this plus the time of contact.
    pub t_impact: f64,
}
