//! The numbers of the adaptive engine for one robot: `robots/<name>/adaptive.toml`. Each field says its meaning, unit,
//! range and effect; a file with an unknown field is refused, and so is a value that cannot be, with its path.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::KickError;
use crate::settings::{Settings, within};
use crate::whole_body::motion::Manner;
use crate::whole_body::{Feedback, Inclination, Limits, Stance, Times};

/// All numbers of the engine for one robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveSettings {
    /// Period between ticks, s, in [0.001, 0.02]: the robot's own control rate.
    pub control_period: f64,
    /// Pairs of joints that one motor turns; they get the same angle and share the torque.
    #[serde(default)]
    pub coupled: Vec<[String; 2]>,
    /// Geometry of the kick.
    pub kick: Kick,
    /// How long phases take.
    pub times: Times,
    /// Where body and centre of mass go.
    pub stance: Stance,
    /// Joint angles (rad) that arms and head take while the foot is up; joints not named keep their standing angle.
    #[serde(default)]
    pub arms: BTreeMap<String, f64>,
    /// What counts as possible.
    pub limits: Limits,
    /// How far the direction may be off.
    pub accuracy: Accuracy,
    /// What keeps the robot upright.
    pub stabiliser: Stabiliser,
    /// Body inclination, used when chosen.
    pub inclination: Inclination,
    /// Centre of pressure and inertial sensor, used when chosen; `follow_ball` is the re-planning of the retraction.
    pub feedback: Feedback,
}

/// Which closed loop keeps the robot upright.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stabiliser {
    /// The paper's: the trunk leans against the error of the centre of mass.
    Inclination,
    /// The dynamic engine's: centre of pressure and inertial sensor.
    Pressure,
}

/// Geometry of the kick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kick {
    /// Weight of the direction against the distance in equation (2), whose distance is in mm as the paper's.
    pub delta: f64,
    /// Whether the foot target is corrected for the foot's true shape and the ball's throw; without it the foot is the
    /// paper's sphere.
    pub true_shape: bool,
    /// Least and largest distance of the retraction point from the foot target, m.
    pub retraction: [f64; 2],
    /// Way after the contact until the foot rests, m.
    pub follow: f64,
    /// Height of the sole over its place before and after the swing, m.
    pub lift: f64,
    /// Height of the striking part's centre over that of the ball's, m; negative strikes below the centre and lifts.
    pub height: f64,
    /// Least height of the sole in the swing, m.
    pub sole_least: f64,
    /// Largest yaw of the foot, rad.
    pub yaw: f64,
    /// Share of the foot's yaw that the base turns, 0 to 1.
    pub base_yaw: f64,
    /// Sliding friction of foot on ball: how far it can throw the ball to the foot's side.
    pub friction: f64,
    /// Forecast g below which a kick is refused or broken off.
    pub forecast_least: f64,
    /// Foot speed asked of the plan over the one that the impact needs; makes up for drives that lag. About 1.
    pub speed_gain: f64,
    /// Share of the asked speed below which a kick is refused; above it the plan says what speed comes.
    pub speed_least: f64,
    /// Longest wait at the retraction point for a ball that is on its way, s.
    pub wait: f64,
}

/// How far the direction may be off: the stated standard deviation is base + slope |yaw| + angle acos(g), rad, with the
/// foot's yaw and the forecast g. Base (rad) and slope of each part of the foot are measured with KickBench's `sweep`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Accuracy {
    /// With the front of the foot: base and slope.
    pub front: [f64; 2],
    /// The same with a side of the foot.
    pub side: [f64; 2],
    /// The same with a corner of the foot.
    pub corner: [f64; 2],
    /// Share of the angle between the foot's way and the wanted direction.
    pub angle: f64,
}

impl AdaptiveSettings {
    /// What the motion takes from them.
    pub(crate) fn manner(&self) -> Manner<'_> {
        let (kick, times, stance) = (&self.kick, &self.times, &self.stance);
        Manner { times, stance, lift: kick.lift, follow: kick.follow, base_yaw: kick.base_yaw }
    }
}

impl Settings for AdaptiveSettings {
    const FILE: &'static str = "adaptive.toml";
    const HOLDS: &'static str = "the adaptive engine's settings";

    fn validate(&self) -> Result<(), KickError> {
        let (k, a) = (&self.kick, &self.accuracy);
        for (field, value, low, high) in [
            ("control_period", self.control_period, 0.001, 0.02),
            ("kick.delta", k.delta, 0.0, 1.0),
            ("kick.retraction[0]", k.retraction[0], 0.005, k.retraction[1]),
            ("kick.retraction[1]", k.retraction[1], k.retraction[0], 0.6),
            ("kick.follow", k.follow, 0.01, 0.6),
            ("kick.lift", k.lift, 0.005, 0.3),
            ("kick.height", k.height, -0.1, 0.1),
            ("kick.sole_least", k.sole_least, 0.002, 0.2),
            ("kick.yaw", k.yaw, 0.0, 1.6),
            ("kick.base_yaw", k.base_yaw, 0.0, 1.0),
            ("kick.friction", k.friction, 0.0, 2.0),
            ("kick.forecast_least", k.forecast_least, -1.0, 1.0),
            ("kick.speed_gain", k.speed_gain, 0.3, 3.0),
            ("kick.wait", k.wait, 0.0, 60.0),
            ("kick.speed_least", k.speed_least, 0.0, 1.0),
            ("accuracy.front[0]", a.front[0], 0.0, 3.2),
            ("accuracy.front[1]", a.front[1], -1.0, 1.0),
            ("accuracy.side[0]", a.side[0], 0.0, 3.2),
            ("accuracy.side[1]", a.side[1], -1.0, 1.0),
            ("accuracy.corner[0]", a.corner[0], 0.0, 3.2),
            ("accuracy.corner[1]", a.corner[1], -1.0, 1.0),
            ("accuracy.angle", a.angle, 0.0, 3.2),
        ] {
            within(field, value, low, high)?;
        }
        self.times.validate()?;
        self.stance.validate()?;
        self.limits.validate()?;
        self.inclination.validate()?;
        self.feedback.validate()
    }
}
