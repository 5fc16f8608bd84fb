//! What the detector knows (paper 4, section IV-A1): six classes, in the order of every file and table here.

use instep_field::LandmarkClass;
use serde::{Deserialize, Serialize};

/// A class of the detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// The ball.
    Ball,
    /// A goal post.
    GoalPost,
    /// A robot of either team.
    Robot,
    /// A corner of two lines.
    L,
    /// A line that ends on another.
    T,
    /// Two lines that cross.
    X,
}

/// A team, told by its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Team {
    /// Red.
    Red,
    /// Blue.
    Blue,
}

impl Class {
    /// All classes in their order.
    pub const ALL: [Class; 6] = [Class::Ball, Class::GoalPost, Class::Robot, Class::L, Class::T, Class::X];

    /// Its place in [`Class::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }

    /// The name in files and tables.
    pub fn name(self) -> &'static str {
        ["ball", "goal_post", "robot", "L", "T", "X"][self.index()]
    }

    /// The class of a name, also as other sets spell it.
    pub fn named(name: &str) -> Option<Class> {
        let plain = name.to_ascii_lowercase().replace([' ', '-'], "_");
        Some(match plain.trim_end_matches("_intersection").trim_end_matches("_junction") {
            "ball" | "soccer_ball" | "football" => Class::Ball,
            "goal_post" | "goalpost" | "post" => Class::GoalPost,
            "robot" => Class::Robot,
            "l" => Class::L,
            "t" => Class::T,
            "x" | "cross" => Class::X,
            _ => return None,
        })
    }

    /// Whether it is a point of lines on the ground.
    pub fn is_intersection(self) -> bool {
        matches!(self, Class::L | Class::T | Class::X)
    }

    /// As a landmark of the map.
    pub fn landmark(self) -> Option<LandmarkClass> {
        match self {
            Class::GoalPost => Some(LandmarkClass::GoalPost),
            Class::L => Some(LandmarkClass::L),
            Class::T => Some(LandmarkClass::T),
            Class::X => Some(LandmarkClass::X),
            Class::Ball | Class::Robot => None,
        }
    }
}

impl Team {
    /// The name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Team::Red => "red",
            Team::Blue => "blue",
        }
    }
}
