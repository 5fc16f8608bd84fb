//! The numbers of the preview engine for one robot: `robots/<name>/preview.toml`. Each field says its meaning, unit, range
//! and effect; a file with an unknown field is refused, and so is a value that cannot be, with its path.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::KickError;
use crate::dynamic::Accuracy;
use crate::preview::zmp::Trust;
use crate::settings::{Settings, within};
use crate::whole_body::{Feedback, Limits, Pid, Stance, Times};

/// All numbers of the engine for one robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PreviewSettings {
    /// Period between ticks, s, in [0.001, 0.02]: the robot's own control rate.
    pub control_period: f64,
    /// How the centre of mass is put to its place.
    pub com: Com,
    /// Which loops are closed, any of them.
    #[serde(default)]
    pub stabilisers: Vec<Stabiliser>,
    /// Pairs of joints that one motor turns; they get the same angle and share the torque.
    #[serde(default)]
    pub coupled: Vec<[String; 2]>,
    /// The preview controller.
    pub regulator: Weights,
    /// The Kalman filter.
    pub trust: Trust,
    /// The curve of the kick: what paper 5 tunes.
    pub kick: Kick,
    /// Geometry of the swing.
    pub swing: Swing,
    /// How long phases take; the zero-moment point goes over, and back, in the middle half of the shift.
    pub times: Times,
    /// Where body and zero-moment point go: `balance` is the latter's constant reference in the support sole.
    pub stance: Stance,
    /// Joint angles (rad) that arms and head take while the foot is up, so that they are out of the legs' way; joints
    /// not named keep their standing angle. No joint of a leg.
    #[serde(default)]
    pub arms: BTreeMap<String, f64>,
    /// What counts as possible.
    pub limits: Limits,
    /// Stated accuracy.
    pub accuracy: Accuracy,
    /// The gains of the stabilisers.
    pub feedback: Gains,
}

/// How the centre of mass is put to its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Com {
    /// By the inverse kinematics of the whole body.
    General,
    /// By the paper's two-link arm of ankle and hip, equations (8) to (11).
    TwoLink,
}

/// A loop from the sensors back to the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stabiliser {
    /// The preview controller goes on from the filter's estimate, drawn to it at the rate `feedback.preview`.
    Preview,
    /// The error of the filter's zero-moment point shifts the centre of mass (paper 2's loop, by PID).
    Pressure,
    /// The inertial sensor's tilt and rate become a moment at the support ankle.
    Inertial,
}

/// The preview controller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weights {
    /// Weight Q of the zero-moment point's error, 1/m^2.
    pub q: f64,
    /// Weight R of the jerk, s^6/m^2: larger moves the body more gently and leaves the reference farther.
    pub r: f64,
    /// How far ahead the reference is seen, s. Under about 1 s the body is late; over 2 s nothing changes.
    pub horizon: f64,
}

/// The curve of the kick at full strength.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kick {
    /// From the retraction point to rest behind the ball at full strength, s. Weaker kicks take longer; stronger ones are
    /// refused.
    pub time: f64,
    /// Share of the time from the retraction to the via point, 0.1 to 0.9.
    pub share: f64,
    /// Share of the straight way from the retraction point to the end at which the via point lies, in x, y and z alike,
    /// 0.05 to 0.95.
    pub via: f64,
    /// Distance of the via point from there: along the kick, to the left, up, m.
    pub offset: [f64; 3],
}

/// Geometry of the swing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Swing {
    /// Distance from the retraction point to the contact, m.
    pub retraction: f64,
    /// The same when there is no room for the full one, m.
    pub retraction_least: f64,
    /// Height of the striking face at the retraction point over that at the contact, m.
    pub rise: f64,
    /// Way after the contact until the foot rests, m.
    pub follow: f64,
    /// Height of the striking face there over that at the contact, m.
    pub follow_rise: f64,
    /// Height of the sole over its place before and after the swing, m.
    pub lift: f64,
    /// Height of the striking face's centre over that of the ball's at the contact, m; negative strikes below and lifts.
    pub height: f64,
    /// Least height of the sole at the contact, m.
    pub sole_least: f64,
    /// How much the foot pitches up on its way, rad a metre: relieves the ankle of turning as fast as the shank.
    pub pitch: f64,
    /// Foot speed asked of the plan over the one that the impact needs; makes up for drives that lag. About 1.
    pub speed_gain: f64,
    /// Width of the corridor around the x axis in which paper 2's equation (1) prefers the foot, m.
    pub corridor: f64,
    /// Largest yaw of the foot, rad.
    pub yaw: f64,
    /// Share of the foot's yaw that the base turns, 0 to 1.
    pub base_yaw: f64,
}

/// The gains of the stabilisers; those that are not in `stabilisers` do nothing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// Rate at which the preview controller's state is drawn to the estimate, 1/s.
    pub preview: f64,
    /// Pressure: error forward to shift of the centre of mass.
    pub x: Pid,
    /// The same to the left.
    pub y: Pid,
    /// Pressure: time constant of each of the two stages of the low-pass on the shift, s.
    pub filter: f64,
    /// Inertial: ankle moment against the base's tilt, in units of m g h a radian.
    pub tilt: f64,
    /// Inertial: ankle moment against the base's rate, in units of m g h a rad/s.
    pub rate: f64,
    /// Inertial: largest ankle moment, in units of m g times the foot's half-length or half-width.
    pub moment: f64,
}

impl PreviewSettings {
    /// Whether a loop is closed.
    #[must_use]
    pub fn has(&self, stabiliser: Stabiliser) -> bool {
        self.stabilisers.contains(&stabiliser)
    }

    /// The gains of [`crate::whole_body::balance`], zero where a loop is open.
    #[must_use]
    pub(crate) fn balance(&self) -> Feedback {
        let (pressure, inertial) = (self.has(Stabiliser::Pressure), self.has(Stabiliser::Inertial));
        let g = &self.feedback;
        let open = Pid { p: 0.0, i: 0.0, d: 0.0, limit: 0.0 };
        let only = |on: bool, value: f64| if on { value } else { 0.0 };
        Feedback {
            on: pressure || inertial,
            x: if pressure { g.x } else { open },
            y: if pressure { g.y } else { open },
            filter: g.filter,
            tilt: only(inertial, g.tilt),
            rate: only(inertial, g.rate),
            moment: g.moment,
            catch: 0.3,
            follow_ball: false,
        }
    }
}

impl Settings for PreviewSettings {
    const FILE: &'static str = "preview.toml";
    const HOLDS: &'static str = "the preview engine's settings";

    fn validate(&self) -> Result<(), KickError> {
        let (w, k, s, f) = (&self.regulator, &self.kick, &self.swing, &self.feedback);
        for (field, value, low, high) in [
            ("control_period", self.control_period, 0.001, 0.02),
            ("regulator.q", w.q, 1e-6, 1e6),
            ("regulator.r", w.r, 1e-12, 1e3),
            ("regulator.horizon", w.horizon, 0.2, 4.0),
            ("trust.jerk", self.trust.jerk, 1e-3, 1e4),
            ("trust.com", self.trust.com, 1e-5, 1.0),
            ("trust.zmp", self.trust.zmp, 1e-5, 1.0),
            ("kick.time", k.time, 0.05, 3.0),
            ("kick.share", k.share, 0.1, 0.9),
            ("kick.via", k.via, 0.05, 0.95),
            ("kick.offset[0]", k.offset[0], -0.1, 0.1),
            ("kick.offset[1]", k.offset[1], -0.1, 0.1),
            ("kick.offset[2]", k.offset[2], -0.1, 0.1),
            ("swing.retraction", s.retraction, 0.01, 0.6),
            ("swing.retraction_least", s.retraction_least, 0.005, s.retraction),
            ("swing.rise", s.rise, -0.1, 0.2),
            ("swing.follow", s.follow, 0.01, 0.6),
            ("swing.follow_rise", s.follow_rise, -0.1, 0.2),
            ("swing.lift", s.lift, 0.005, 0.3),
            ("swing.height", s.height, -0.1, 0.1),
            ("swing.sole_least", s.sole_least, 0.002, 0.2),
            ("swing.pitch", s.pitch, -5.0, 5.0),
            ("swing.speed_gain", s.speed_gain, 0.3, 3.0),
            ("swing.corridor", s.corridor, 0.0, 2.0),
            ("swing.yaw", s.yaw, 0.0, 1.6),
            ("swing.base_yaw", s.base_yaw, 0.0, 1.0),
            ("accuracy.front", self.accuracy.front, 0.0, 3.2),
            ("accuracy.side", self.accuracy.side, 0.0, 3.2),
            ("feedback.preview", f.preview, 0.0, 50.0),
            ("feedback.filter", f.filter, 0.0, 1.0),
            ("feedback.tilt", f.tilt, 0.0, 10.0),
            ("feedback.rate", f.rate, 0.0, 10.0),
            ("feedback.moment", f.moment, 0.0, 1.0),
        ] {
            within(field, value, low, high)?;
        }
        f.x.validate("feedback.x")?;
        f.y.validate("feedback.y")?;
        self.times.validate()?;
        self.stance.validate()?;
        self.limits.validate()
    }
}
