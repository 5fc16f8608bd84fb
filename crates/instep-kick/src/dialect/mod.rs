//! Kick requests as other teams write them, read from JSON (as rosbridge, protobuf's JSON form or a log would give
//! them): dialects A to F of facts/kick-interfaces.md, and our own form.
//!
//! What a dialect does not say (where the ball is, how fast 5 of 5 is) comes from the [`Context`]. Fields that we do
//! not use may be present. Every place must already be in the robot's footprint frame; a message that names another
//! frame is refused rather than kicked wrongly, which is what paper 2's public code did with the direction.

use instep_motion::phase::Side;
use serde::Deserialize;

use crate::request::{KickRequest, Strength};

/// Whose message it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialect {
    /// Our own: the fields of [`KickRequest`].
    Instep,
    /// A: `bitbots_msgs/action/Kick` of paper 2.
    BitbotsDynamic,
    /// B: `bitbots_msgs/action/Kick`, 2026 form.
    Bitbots2026,
    /// C: Booster's `brain/msg/Kick`.
    Booster,
    /// D: NUbots' `message.skill.Kick`.
    Nubots,
    /// E: NaoTH's `KickRequest`.
    Naoth,
    /// F: B-Human's `MotionRequest`, walk to the ball and kick.
    Bhuman,
}

/// What the caller knows and a dialect may not say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Context {
    /// Ball's place in the footprint frame, m.
    pub ball: Option<[f64; 2]>,
    /// Ball speed meant by the greatest strength, m/s.
    pub fastest: f64,
    /// Ball speed where the dialect asks for none, m/s.
    pub usual: f64,
}

impl Default for Context {
    fn default() -> Self {
        Self { ball: None, fastest: 1.5, usual: 1.0 }
    }
}

/// A message that cannot be read as a request.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DialectError {
    /// Not JSON, or a field is missing or of another type.
    #[error("{dialect}: {detail}")]
    Parse {
        /// Which dialect was expected.
        dialect: &'static str,
        /// Line, column and cause.
        detail: String,
    },
    /// A field with a value that cannot be.
    #[error("{dialect}: {field}: {found}; expected {expected}")]
    Field {
        /// Which dialect.
        dialect: &'static str,
        /// The field.
        field: &'static str,
        /// Its value.
        found: String,
        /// What would be right.
        expected: &'static str,
    },
    /// The dialect does not say where the ball is, and neither did the caller.
    #[error("{dialect}: the message does not say where the ball is; give it beside the message")]
    NoBall {
        /// Which dialect.
        dialect: &'static str,
    },
}

impl Dialect {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Instep, Self::BitbotsDynamic, Self::Bitbots2026, Self::Booster, Self::Nubots, Self::Naoth, Self::Bhuman];

    /// Its name on a command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Instep => "instep",
            Self::BitbotsDynamic => "bitbots-dynamic",
            Self::Bitbots2026 => "bitbots-2026",
            Self::Booster => "booster",
            Self::Nubots => "nubots",
            Self::Naoth => "naoth",
            Self::Bhuman => "bhuman",
        }
    }

    /// Reads one message.
    ///
    /// # Errors
    /// When the message is not of this dialect, or does not say enough. Numbers that are not finite and places out of
    /// reach are the engine's to refuse.
    pub fn parse(self, text: &str, context: &Context) -> Result<KickRequest, DialectError> {
        match self {
            Self::Instep => read(self, text),
            Self::BitbotsDynamic => bitbots_dynamic(read(self, text)?),
            Self::Bitbots2026 => bitbots_2026(&read(self, text)?, context),
            Self::Booster => Ok(booster(&read(self, text)?)),
            Self::Nubots => nubots(&read(self, text)?),
            Self::Naoth => naoth(&read(self, text)?, context),
            Self::Bhuman => bhuman(&read(self, text)?, context),
        }
    }
}

fn read<T: for<'a> Deserialize<'a>>(dialect: Dialect, text: &str) -> Result<T, DialectError> {
    serde_json::from_str(text).map_err(|e| DialectError::Parse { dialect: dialect.name(), detail: e.to_string() })
}

#[derive(Deserialize)]
struct Point {
    x: f64,
    y: f64,
}

#[derive(Deserialize)]
struct Turn {
    #[serde(default)]
    x: f64,
    #[serde(default)]
    y: f64,
    z: f64,
    w: f64,
}

#[derive(Deserialize, Default)]
struct Header {
    #[serde(default)]
    frame_id: String,
}

#[derive(Deserialize)]
struct BitbotsDynamic {
    #[serde(default)]
    header: Header,
    ball_position: Point,
    kick_direction: Turn,
    kick_speed: f64,
}

fn bitbots_dynamic(message: BitbotsDynamic) -> Result<KickRequest, DialectError> {
    if !matches!(message.header.frame_id.as_str(), "" | "base_footprint") {
        return Err(DialectError::Field {
            dialect: Dialect::BitbotsDynamic.name(),
            field: "header.frame_id",
            found: message.header.frame_id,
            expected: "\"base_footprint\": transform ball and direction first",
        });
    }
    let Turn { x, y, z, w } = message.kick_direction;
    let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    let ball = [message.ball_position.x, message.ball_position.y];
    Ok(KickRequest { strength: Strength::FootSpeed(message.kick_speed), ..KickRequest::new(ball, yaw, 1.0) })
}

#[derive(Deserialize)]
struct Bitbots2026 {
    x: f64,
    y: f64,
    strength: f64,
    #[serde(default = "no_timeout")]
    timeout: f64,
}

fn no_timeout() -> f64 {
    -1.0
}

fn bitbots_2026(message: &Bitbots2026, context: &Context) -> Result<KickRequest, DialectError> {
    let dialect = Dialect::Bitbots2026.name();
    let ball = context.ball.ok_or(DialectError::NoBall { dialect })?;
    if !(1.0..=5.0).contains(&message.strength) {
        let found = message.strength.to_string();
        return Err(DialectError::Field { dialect, field: "strength", found, expected: "a number from 1 to 5" });
    }
    let speed = context.fastest * message.strength / 5.0;
    let deadline = (message.timeout > 0.0).then_some(message.timeout);
    Ok(KickRequest { deadline, ..KickRequest::new(ball, message.y.atan2(message.x), speed) })
}

#[derive(Deserialize)]
struct Booster {
    x: f64,
    y: f64,
    dir: f64,
    power: f64,
}

fn booster(message: &Booster) -> KickRequest {
    let strength = Strength::Distance(message.power);
    KickRequest { strength, ..KickRequest::new([message.x, message.y], message.dir, 1.0) }
}

#[derive(Deserialize)]
struct Nubots {
    #[serde(default)]
    leg: u32,
    target: Point,
    direction: Point,
}

/// NUbots' `LimbID`: 1 is the left, 2 the right leg; 0 leaves it open. The force is read as the ball's speed in m/s.
fn nubots(message: &Nubots) -> Result<KickRequest, DialectError> {
    let foot = match message.leg {
        0 => None,
        1 => Some(Side::Left),
        2 => Some(Side::Right),
        other => {
            return Err(DialectError::Field {
                dialect: Dialect::Nubots.name(),
                field: "leg",
                found: other.to_string(),
                expected: "0 (either), 1 (left) or 2 (right)",
            });
        }
    };
    let Point { x, y } = message.direction;
    let target = [message.target.x, message.target.y];
    Ok(KickRequest { foot, ..KickRequest::new(target, y.atan2(x), x.hypot(y)) })
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Naoth {
    kick_point: Point,
    kick_direction: f64,
    #[serde(default)]
    kick_foot: i32,
    #[serde(default)]
    finish_kick: bool,
}

fn naoth(message: &Naoth, context: &Context) -> Result<KickRequest, DialectError> {
    let foot = match message.kick_foot {
        0 => None,
        1 => Some(Side::Left),
        -1 => Some(Side::Right),
        other => {
            return Err(DialectError::Field {
                dialect: Dialect::Naoth.name(),
                field: "kickFoot",
                found: other.to_string(),
                expected: "1 (left), -1 (right) or 0 (either)",
            });
        }
    };
    let ball = [message.kick_point.x / 1000.0, message.kick_point.y / 1000.0];
    let request = KickRequest::new(ball, message.kick_direction, context.usual);
    Ok(KickRequest { foot, hold: !message.finish_kick, ..request })
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Bhuman {
    target_direction: f64,
    #[serde(default)]
    direction_precision: Option<Limits>,
    kick_length: f64,
    #[serde(default)]
    ball_estimate: Option<Estimate>,
}

#[derive(Deserialize)]
struct Limits {
    min: f64,
    max: f64,
}

#[derive(Deserialize)]
struct Estimate {
    position: Point,
    #[serde(default)]
    velocity: Option<Point>,
}

fn bhuman(message: &Bhuman, context: &Context) -> Result<KickRequest, DialectError> {
    let dialect = Dialect::Bhuman.name();
    let metres = |p: &Point| [p.x / 1000.0, p.y / 1000.0];
    let ball = message.ball_estimate.as_ref().map(|e| metres(&e.position)).or(context.ball);
    let velocity = message.ball_estimate.as_ref().and_then(|e| e.velocity.as_ref()).map(metres);
    let request = KickRequest::new(ball.ok_or(DialectError::NoBall { dialect })?, message.target_direction, 1.0);
    Ok(KickRequest {
        ball_velocity: velocity.unwrap_or_default(),
        strength: Strength::Distance(message.kick_length / 1000.0),
        // The two ends of the wanted sector: its half is what one standard deviation may be.
        precision: message.direction_precision.as_ref().map(|p| 0.5 * (p.max - p.min)),
        ..request
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(dialect: Dialect, text: &str) -> KickRequest {
        dialect.parse(text, &Context { ball: Some([0.2, 0.1]), ..Context::default() }).unwrap()
    }

    #[test]
    fn each_dialect_means_what_its_team_means() {
        let a = parse(
            Dialect::BitbotsDynamic,
            r#"{"header":{"frame_id":"base_footprint"},"ball_position":{"x":0.198,"y":-0.148,"z":0},
               "kick_direction":{"x":0,"y":0,"z":-0.342897807,"w":0.939372713},"kick_speed":1.0,"unstable":false}"#,
        );
        assert!((a.direction + 0.70).abs() < 1e-6 && a.strength == Strength::FootSpeed(1.0));
        assert_eq!(a.ball, [0.198, -0.148]);
        let b = parse(Dialect::Bitbots2026, r#"{"x":1.0,"y":1.0,"strength":5,"timeout":-1}"#);
        assert!((b.direction - 0.25 * std::f64::consts::PI).abs() < 1e-12 && b.deadline.is_none());
        assert_eq!((b.ball, b.strength), ([0.2, 0.1], Strength::BallSpeed(1.5)));
        let c = parse(Dialect::Booster, r#"{"x":0.3,"y":0.0,"dir":0.2,"goal_x":4,"goal_y":0,"power":2.5}"#);
        assert_eq!((c.direction, c.strength), (0.2, Strength::Distance(2.5)));
        let d = parse(
            Dialect::Nubots,
            r#"{"leg":2,"target":{"x":0.2,"y":-0.1,"z":0},"direction":{"x":0.6,"y":0.8,"z":0}}"#,
        );
        assert_eq!((d.foot, d.strength), (Some(Side::Right), Strength::BallSpeed(1.0)));
        let e = parse(
            Dialect::Naoth,
            r#"{"kickPoint":{"x":180,"y":-50},"kickDirection":0.1,"kickFoot":-1,"finishKick":false}"#,
        );
        assert_eq!((e.ball, e.foot, e.hold), ([0.18, -0.05], Some(Side::Right), true));
        let f = parse(
            Dialect::Bhuman,
            r#"{"targetDirection":0.3,"directionPrecision":{"min":-0.1,"max":0.1},"kickType":"forwardFast",
               "kickLength":1600,"alignPrecisely":"precisely","ballEstimate":{"position":{"x":200,"y":50}}}"#,
        );
        assert_eq!((f.precision, f.strength, f.ball), (Some(0.1), Strength::Distance(1.6), [0.2, 0.05]));
    }

    #[test]
    fn what_cannot_be_read_is_refused_with_its_place() {
        let context = Context::default();
        let odom = r#"{"header":{"frame_id":"odom"},"ball_position":{"x":1,"y":0},"kick_direction":{"z":0,"w":1},"kick_speed":1}"#;
        assert!(matches!(
            Dialect::BitbotsDynamic.parse(odom, &context),
            Err(DialectError::Field { field: "header.frame_id", .. })
        ));
        assert!(matches!(
            Dialect::Bitbots2026.parse(r#"{"x":1,"y":0,"strength":3}"#, &context),
            Err(DialectError::NoBall { .. })
        ));
        assert!(matches!(Dialect::Nubots.parse("{}", &context), Err(DialectError::Parse { .. })));
        for dialect in Dialect::ALL {
            assert!(dialect.parse("not json", &context).is_err(), "{}", dialect.name());
        }
    }
}
