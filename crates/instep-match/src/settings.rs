//! What a match is played with: bodies and eyes. The same for both teams.

use std::sync::Arc;

use instep_behaviour::{MAX_TEAM, View};
use instep_field::Field;

use crate::{MatchError, RuleBook};

/// A match's settings.
#[derive(Debug, Clone)]
pub struct MatchSettings {
    /// The field.
    pub field: Arc<Field>,
    /// The rules.
    pub book: RuleBook,
    /// Players of a team.
    pub players: usize,
    /// A draw is followed by extra time and a shoot-out.
    pub knockout: bool,
    /// How robots walk, collide and fall.
    pub body: BodySettings,
    /// How they see.
    pub sight: SightSettings,
}

/// How robots walk, collide and fall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodySettings {
    /// Fastest walk ahead, m/s. Back it is 0.6 of it.
    pub forward: f64,
    /// Fastest walk sideways, m/s.
    pub side: f64,
    /// Fastest turn, rad/s.
    pub turn: f64,
    /// Acceleration, m/s^2; of a turn, rad/s^2, three times it.
    pub acceleration: f64,
    /// Radius against other robots, m.
    pub radius: f64,
    /// Radius against the ball, m: the feet.
    pub feet: f64,
    /// Two that meet faster than this may fall, m/s.
    pub fall_speed: f64,
    /// Chance to fall for each m/s above it.
    pub fall_chance: f64,
    /// Time to get up, s.
    pub get_up: f64,
    /// Chance that an attempt to get up succeeds.
    pub get_up_chance: f64,
}

impl Default for BodySettings {
    /// An adult-size robot of 2024 with in-gait kicks; a guess by what teams say, not measured.
    fn default() -> Self {
        Self {
            forward: 0.6,
            side: 0.3,
            turn: 1.2,
            acceleration: 0.8,
            radius: 0.25,
            feet: 0.14,
            fall_speed: 0.5,
            fall_chance: 0.3,
            get_up: 5.0,
            get_up_chance: 0.9,
        }
    }
}

/// How robots see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SightSettings {
    /// Cone, range and neck.
    pub view: View,
    /// Distance error, of the distance (paper 4: 5 % under 6 m).
    pub range_noise: f64,
    /// Direction error, rad.
    pub angle_noise: f64,
    /// Share of frames in which a visible ball or robot is not found.
    pub misses: f64,
    /// Own position's standard deviation, m (CLAP in paper 4: 0.165 m mean absolute error).
    pub position_noise: f64,
    /// Own heading's, rad.
    pub heading_noise: f64,
    /// Time constant of both errors, s.
    pub noise_time: f64,
    /// Fastest neck, rad/s.
    pub neck_speed: f64,
}

impl Default for SightSettings {
    fn default() -> Self {
        Self {
            view: View::default(),
            range_noise: 0.04,
            angle_noise: 0.015,
            misses: 0.1,
            position_noise: 0.12,
            heading_noise: 0.03,
            noise_time: 2.0,
            neck_speed: 4.0,
        }
    }
}

impl BodySettings {
    /// The body of a robot of this name; guesses by what teams say of their walks, not measured.
    pub fn for_robot(name: &str) -> Self {
        match name {
            "nao" | "wolfgang" | "prestoe" => {
                Self { forward: 0.3, side: 0.15, radius: 0.18, feet: 0.08, ..Self::default() }
            }
            _ => Self::default(),
        }
    }
}

impl MatchSettings {
    /// The settings for a field's name (one of [`instep_field::FIELD_NAMES`]) or the path of its TOML file.
    ///
    /// # Errors
    /// [`MatchError::Field`], or [`MatchError::Value`] where so many players cannot be.
    pub fn new(rules: &str, players: Option<usize>) -> Result<Self, MatchError> {
        let field = Field::named_or_load(rules)?;
        let book = RuleBook::for_field(&field.name);
        let players = players.unwrap_or(book.rules.players);
        if players == 0 || players > MAX_TEAM {
            return Err(MatchError::Value {
                what: "players of a team",
                found: players.to_string(),
                expected: format!("1 to {MAX_TEAM}"),
            });
        }
        Ok(Self {
            field: Arc::new(field),
            book,
            players,
            knockout: false,
            body: BodySettings::default(),
            sight: SightSettings::default(),
        })
    }
}
