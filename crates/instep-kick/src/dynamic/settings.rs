//! The numbers of the dynamic engine for one robot: `robots/<name>/dynamic.toml`. Each field says its meaning, unit,
//! range and effect; a file with an unknown field is refused, and so is a value that cannot be, with its path.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::KickError;
use crate::settings::{Settings, within};
use crate::whole_body::motion::Manner;
use crate::whole_body::{Feedback, Limits, Stance, Times};

/// All numbers of the engine for one robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DynamicSettings {
    /// Period between ticks, s, in [0.001, 0.02]: the robot's own control rate.
    pub control_period: f64,
    /// Pairs of joints that one motor turns; they get the same angle and share the torque.
    #[serde(default)]
    pub coupled: Vec<[String; 2]>,
    /// Geometry of the swing.
    pub swing: Swing,
    /// How long phases take.
    pub times: Times,
    /// Where body and centre of mass go.
    pub stance: Stance,
    /// Joint angles (rad) that arms and head take while the foot is up, so that they are out of the legs' way; joints
    /// not named keep their standing angle. No joint of a leg.
    #[serde(default)]
    pub arms: BTreeMap<String, f64>,
    /// What counts as possible.
    pub limits: Limits,
    /// Stated accuracy.
    pub accuracy: Accuracy,
    /// The closed loop.
    pub feedback: Feedback,
}

/// Geometry of the swing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Swing {
    /// Wind-up distance w of equation (2), m: longer needs less force and more room.
    pub windup: f64,
    /// Least wind-up distance when there is no room for the full one, m.
    pub windup_least: f64,
    /// Way after the contact until the foot rests, m.
    pub follow: f64,
    /// Height of the sole over its place before and after the swing, m.
    pub lift: f64,
    /// Height of the striking face's centre over that of the ball's, m; negative strikes below the centre and lifts.
    pub height: f64,
    /// Least height of the sole in the swing, m.
    pub sole_least: f64,
    /// How much the foot pitches up on its way, rad a metre: relieves the ankle of turning as fast as the shank. The
    /// foot is level at the contact and turns about the striking face's axis.
    pub pitch: f64,
    /// Foot speed asked of the plan over the one that the impact needs; makes up for drives that lag. About 1.
    pub speed_gain: f64,
    /// Width of the corridor around the x axis in which equation (1) chooses the foot, m.
    pub corridor: f64,
    /// Largest yaw of the foot, rad.
    pub yaw: f64,
    /// Share of the foot's yaw that the base turns, 0 to 1.
    pub base_yaw: f64,
}

/// Stated standard deviation of the ball's direction, rad, measured with KickBench.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Accuracy {
    /// With the front of the foot.
    pub front: f64,
    /// With a side of the foot.
    pub side: f64,
}

impl DynamicSettings {
    /// What the motion takes from them.
    pub(crate) fn manner(&self) -> Manner<'_> {
        let (swing, times, stance) = (&self.swing, &self.times, &self.stance);
        Manner { times, stance, lift: swing.lift, follow: swing.follow, base_yaw: swing.base_yaw }
    }
}

impl Settings for DynamicSettings {
    const FILE: &'static str = "dynamic.toml";
    const HOLDS: &'static str = "the dynamic engine's settings";

    fn validate(&self) -> Result<(), KickError> {
        let s = &self.swing;
        for (field, value, low, high) in [
            ("control_period", self.control_period, 0.001, 0.02),
            ("swing.speed_gain", s.speed_gain, 0.3, 3.0),
            ("swing.windup", s.windup, 0.01, 0.6),
            ("swing.windup_least", s.windup_least, 0.005, s.windup),
            ("swing.follow", s.follow, 0.01, 0.6),
            ("swing.lift", s.lift, 0.005, 0.3),
            ("swing.height", s.height, -0.1, 0.1),
            ("swing.sole_least", s.sole_least, 0.002, 0.2),
            ("swing.pitch", s.pitch, 0.0, 5.0),
            ("swing.corridor", s.corridor, 0.0, 2.0),
            ("swing.yaw", s.yaw, 0.0, 1.6),
            ("swing.base_yaw", s.base_yaw, 0.0, 1.0),
            ("accuracy.front", self.accuracy.front, 0.0, 3.2),
            ("accuracy.side", self.accuracy.side, 0.0, 3.2),
        ] {
            within(field, value, low, high)?;
        }
        self.times.validate()?;
        self.stance.validate()?;
        self.limits.validate()?;
        self.feedback.validate()
    }
}
