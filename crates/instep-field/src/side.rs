//! Goals, and the two teams' frames.

use serde::{Deserialize, Serialize};

use crate::{Field, Pose};

/// A team, by the side that it plays from. The frame of [`Side::Home`] is the one of whoever watches (referee, game
/// simulator, report); in its own frame each team attacks toward +x.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Attacks toward the watcher's +x.
    Home,
    /// Attacks toward the watcher's -x.
    Away,
}

impl Side {
    /// The other team.
    #[must_use]
    pub fn other(self) -> Side {
        match self {
            Side::Home => Side::Away,
            Side::Away => Side::Home,
        }
    }

    /// A pose from this team's frame to the watcher's, or back: the same half turn.
    #[must_use]
    pub fn pose(self, pose: &Pose) -> Pose {
        match self {
            Side::Home => *pose,
            Side::Away => pose.mirrored(),
        }
    }

    /// A point or a velocity from this team's frame to the watcher's, or back.
    pub fn point(self, point: [f64; 2]) -> [f64; 2] {
        match self {
            Side::Home => point,
            Side::Away => [-point[0], -point[1]],
        }
    }
}

/// A goal in the field frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Middle of the goal on the goal line, m.
    pub center: [f64; 2],
    /// The posts' middles on the goal line: the one with the larger y first, m.
    pub posts: [[f64; 2]; 2],
    /// Height under the bar, m.
    pub height: f64,
    /// Depth behind the goal line, m.
    pub depth: f64,
}

impl Field {
    /// The goal that we attack, at +x.
    pub fn opponent_goal(&self) -> Goal {
        self.goal_at(1.0)
    }

    /// The goal that we defend, at -x.
    pub fn own_goal(&self) -> Goal {
        self.goal_at(-1.0)
    }

    fn goal_at(&self, sign: f64) -> Goal {
        let (x, half) = (sign * self.length / 2.0, self.goal.width / 2.0);
        Goal { center: [x, 0.0], posts: [[x, half], [x, -half]], height: self.goal.height, depth: self.goal.depth }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_other_teams_goal_is_ours_in_its_frame() {
        let field = Field::named("adult-2024").unwrap();
        for side in [Side::Home, Side::Away] {
            assert_eq!(side.point(field.opponent_goal().center), side.other().point(field.own_goal().center));
            let pose = Pose::new(1.0, 2.0, 0.5);
            let back = side.pose(&side.pose(&pose));
            assert!(back.distance(&pose) < 1e-12 && (back.heading - pose.heading).abs() < 1e-12);
        }
    }
}
