//! A situation as a file: what one player believes, for `instep decide` and for tests.

use std::path::Path;

use arrayvec::ArrayVec;
use instep_field::{Field, Pose};
use serde::{Deserialize, Serialize};

use crate::belief::{Beliefs, GameState, MAX_TEAM, Mate, Opponent, OwnState, View};
use crate::error::{read, within};
use crate::geometry::Point;
use crate::kick::KickModel;
use crate::memory::{BallMemory, BallState};
use crate::strategy::Strategy;
use crate::{BehaviourError, Role};

/// What all nodes of the trees read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pitch<'a> {
    pub field: &'a Field,
    pub strategy: &'a Strategy,
    pub kicks: &'a [KickModel],
}

/// A situation, in the own team's field frame. TOML or JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Situation {
    /// A field's name, or the path of its TOML file.
    pub field: String,
    /// s.
    #[serde(default = "ten")]
    pub time: f64,
    /// Own number.
    #[serde(default = "two")]
    pub number: u8,
    /// Oneself.
    pub own: OwnPlace,
    /// The ball; without one, it is lost.
    #[serde(default)]
    pub ball: Option<BallPlace>,
    /// Mates.
    #[serde(default)]
    pub mates: Vec<Mate>,
    /// Opponents.
    #[serde(default)]
    pub opponents: Vec<OpponentPlace>,
    /// The game.
    #[serde(default)]
    pub game: GameState,
    /// What a test expects, and nobody else reads.
    #[serde(default)]
    pub expect: Expectation,
}

/// What a scenario expects.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Expectation {
    /// The action.
    pub action: Option<String>,
    /// The role.
    pub role: Option<Role>,
    /// The option of a reason that was not rejected.
    pub chosen: Option<String>,
}

/// Oneself, in a file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OwnPlace {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// rad.
    #[serde(default)]
    pub heading: f64,
    /// Robot frame, m/s, m/s, rad/s.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Standard deviation of the position, m.
    #[serde(default)]
    pub std: f64,
    /// On the ground.
    #[serde(default)]
    pub fallen: bool,
}

/// The ball, in a file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BallPlace {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// m/s.
    #[serde(default)]
    pub velocity: [f64; 2],
    /// What is known of it.
    #[serde(default = "in_view")]
    pub state: BallState,
}

/// An opponent, in a file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpponentPlace {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// m.
    #[serde(default = "body")]
    pub radius: f64,
    /// Being taken off.
    #[serde(default)]
    pub penalised: bool,
}

fn ten() -> f64 {
    10.0
}
fn two() -> u8 {
    2
}
fn body() -> f64 {
    0.3
}
fn in_view() -> BallState {
    BallState::InView
}

impl Situation {
    /// Reads a situation: JSON where the name ends in `.json`, else TOML.
    ///
    /// # Errors
    /// [`BehaviourError`] with file and place.
    pub fn load(path: &Path) -> Result<Self, BehaviourError> {
        let text = read(path)?;
        let situation: Self = if path.extension().is_some_and(|e| e == "json") {
            serde_json::from_str(&text).map_err(|e| BehaviourError::file(path, e))?
        } else {
            toml::from_str(&text).map_err(|e| BehaviourError::file(path, e))?
        };
        situation.validate(&path.display().to_string())?;
        Ok(situation)
    }

    /// Checks every number; `file` is what an error names.
    ///
    /// # Errors
    /// [`BehaviourError::Value`] for the first that cannot be.
    pub fn validate(&self, file: &str) -> Result<(), BehaviourError> {
        let field = Field::named_or_load(&self.field).map_err(|e| BehaviourError::Value {
            file: file.to_owned(),
            field: "field".to_owned(),
            found: format!("\"{}\"", self.field),
            expected: e.to_string(),
        })?;
        let (x, y) = (field.length / 2.0 + field.border, field.width / 2.0 + field.border);
        let on_field = |what: &str, p: Point| {
            within(file, &format!("{what}.x"), p[0], -x, x)?;
            within(file, &format!("{what}.y"), p[1], -y, y)
        };
        within(file, "time", self.time, 0.0, 1e6)?;
        within(file, "number", f64::from(self.number), 1.0, MAX_TEAM as f64)?;
        within(file, "mates (players)", self.mates.len() as f64, 0.0, (MAX_TEAM - 1) as f64)?;
        within(file, "opponents (players)", self.opponents.len() as f64, 0.0, MAX_TEAM as f64)?;
        on_field("own", [self.own.x, self.own.y])?;
        within(file, "own.heading", self.own.heading, -100.0, 100.0)?;
        within(file, "own.std", self.own.std, 0.0, 100.0)?;
        for (axis, v) in self.own.velocity.iter().enumerate() {
            within(file, &format!("own.velocity[{axis}]"), *v, -20.0, 20.0)?;
        }
        if let Some(ball) = &self.ball {
            on_field("ball", [ball.x, ball.y])?;
            for (axis, v) in ball.velocity.iter().enumerate() {
                within(file, &format!("ball.velocity[{axis}]"), *v, -40.0, 40.0)?;
            }
        }
        for (i, mate) in self.mates.iter().enumerate() {
            within(file, &format!("mates[{i}].number"), f64::from(mate.number), 1.0, MAX_TEAM as f64)?;
            let twice = self.mates[..i].iter().any(|m| m.number == mate.number) || mate.number == self.number;
            if twice {
                return Err(BehaviourError::Value {
                    file: file.to_owned(),
                    field: format!("mates[{i}].number"),
                    found: mate.number.to_string(),
                    expected: "a number that nobody else of the team has".to_owned(),
                });
            }
            on_field(&format!("mates[{i}].pose"), mate.pose.position())?;
            within(file, &format!("mates[{i}].pose.heading"), mate.pose.heading, -100.0, 100.0)?;
            within(file, &format!("mates[{i}].time_to_ball"), mate.time_to_ball, 0.0, 1e6)?;
        }
        for (i, opponent) in self.opponents.iter().enumerate() {
            on_field(&format!("opponents[{i}]"), [opponent.x, opponent.y])?;
            within(file, &format!("opponents[{i}].radius"), opponent.radius, 0.05, 2.0)?;
        }
        within(file, "game.time_left", self.game.time_left, -1e5, 1e5)
    }

    /// The beliefs of the player whose situation it is.
    pub fn beliefs(&self) -> Beliefs {
        let mut own = OwnState::at(Pose::new(self.own.x, self.own.y, self.own.heading));
        own.velocity = self.own.velocity;
        own.fallen = self.own.fallen;
        let variance = self.own.std * self.own.std / 2.0;
        (own.covariance[0][0], own.covariance[1][1]) = (variance, variance);
        let ball =
            self.ball.map_or(BallMemory::default(), |b| BallMemory::known(self.time, [b.x, b.y], b.velocity, b.state));
        let opponents: ArrayVec<Opponent, MAX_TEAM> = self
            .opponents
            .iter()
            .take(MAX_TEAM)
            .map(|o| Opponent {
                circle: crate::Circle { center: [o.x, o.y], radius: o.radius },
                velocity: [0.0; 2],
                penalised: o.penalised,
            })
            .collect();
        Beliefs {
            time: self.time,
            number: self.number,
            own,
            ball,
            mates: self.mates.iter().copied().take(MAX_TEAM).collect(),
            opponents,
            game: self.game,
            view: View::default(),
        }
    }
}
