//! The numbers of the dynamic engine for one robot: `robots/<name>/dynamic.toml`. Each field says its meaning, unit,
//! range and effect; a file with an unknown field is refused, and so is a value that cannot be, with its path.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::KickError;

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

/// How long phases take; the swing's times follow from distance and speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Times {
    /// Shift of the weight over the support foot, s.
    pub shift: f64,
    /// Pause on the support foot before the foot is raised, s.
    pub settle: f64,
    /// Fastest mean speed of the foot outside the kick, m/s.
    pub foot_speed: f64,
    /// Least time of a foot motion outside the kick, s.
    pub foot_least: f64,
    /// Pause at the wind-up point, s.
    pub aim: f64,
    /// Lowering of the foot, s.
    pub lower: f64,
    /// Shift of the weight back, s.
    pub shift_back: f64,
}

/// Where body and centre of mass go.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stance {
    /// Centre of mass over the support sole while the other foot is up, m: forward, and toward the other foot.
    pub balance: [f64; 2],
    /// How much lower the base is than in the stand, m: bent knees reach farther.
    pub crouch: f64,
    /// Pitch of the base while the foot is up, rad, forward positive.
    pub pitch: f64,
    /// Roll of the base toward the support side while the foot is up, rad.
    pub roll: f64,
}

/// What counts as possible.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Largest planned share of a joint's speed limit.
    pub speed: f64,
    /// Largest planned share of a motor's torque at its speed.
    pub torque: f64,
    /// Largest share of a motor's torque that holding a pose on one foot may take.
    pub hold: f64,
    /// Kept from every joint limit, rad.
    pub joint_margin: f64,
    /// Least bend of the knees, rad: near a straight leg small ways ask for great joint speeds.
    pub knee_bend: f64,
    /// Largest miss of the planned foot, m.
    pub reach: f64,
    /// Least gap between parts of the robot, m.
    pub clearance: f64,
    /// How far inside the support foot's outline the planned centre of pressure stays, m.
    pub edge: f64,
    /// Largest difference from the standing pose with which a kick may start, rad.
    pub stand: f64,
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

/// The closed loop.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Feedback {
    /// Whether it is on.
    pub on: bool,
    /// From the error of the centre of pressure, forward, to the shift of the centre of mass.
    pub x: Pid,
    /// The same to the left.
    pub y: Pid,
    /// Time constant of each of the two stages of the low-pass on the shift, s. Above sqrt(p h / g), or the loop shakes.
    pub filter: f64,
    /// Ankle moment against the base's tilt, in units of m g h a radian; h is the centre of mass's height.
    pub tilt: f64,
    /// Ankle moment against the base's rate, in units of m g h a rad/s.
    pub rate: f64,
    /// Largest ankle moment of both together, in units of m g times the foot's half-length or half-width.
    pub moment: f64,
    /// Lean toward the swing foot (tilt, plus rate times sqrt(h / g)), rad, beyond which that foot goes straight to the
    /// ground once the ball is gone: 0.05 to 0.3.
    pub catch: f64,
    /// Follow the ball that is seen moving during the wind-up.
    pub follow_ball: bool,
}

/// Gains of one PID controller: error in m, output in m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pid {
    /// Proportional, m/m.
    pub p: f64,
    /// Integral, 1/s.
    pub i: f64,
    /// Derivative, s.
    pub d: f64,
    /// Largest output, m; the integral stops growing there (anti-windup).
    pub limit: f64,
}

impl DynamicSettings {
    /// Reads and validates the settings from a robot's folder or the file itself.
    ///
    /// # Errors
    /// When the file is missing, is not TOML of this layout, or a value cannot be.
    pub fn load(path: &Path) -> Result<Self, KickError> {
        let file = if path.is_dir() { path.join("dynamic.toml") } else { path.to_owned() };
        let name = file.display().to_string();
        let text = std::fs::read_to_string(&file).map_err(|e| KickError::Read {
            file: name.clone(),
            detail: format!("{e}; expected the dynamic engine's settings for this robot"),
        })?;
        Self::parse(&name, &text)
    }

    /// Reads and validates the settings from `text`; `name` stands in errors.
    ///
    /// # Errors
    /// As [`DynamicSettings::load`].
    pub fn parse(name: &str, text: &str) -> Result<Self, KickError> {
        let settings: Self = toml::from_str(text)
            .map_err(|e| KickError::Parse { file: name.to_owned(), detail: e.to_string().trim_end().to_owned() })?;
        settings.validate()?;
        Ok(settings)
    }

    /// Checks every value.
    ///
    /// # Errors
    /// Names the first field whose value cannot be.
    pub fn validate(&self) -> Result<(), KickError> {
        let within = |field: &str, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            let expected = format!("a number in [{low}, {high}]");
            Err(KickError::Setting { field: field.to_owned(), found: value.to_string(), expected })
        };
        let (s, t, l, f) = (&self.swing, &self.times, &self.limits, &self.feedback);
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
            ("times.shift", t.shift, 0.1, 5.0),
            ("times.settle", t.settle, 0.0, 5.0),
            ("times.foot_speed", t.foot_speed, 0.01, 5.0),
            ("times.foot_least", t.foot_least, 0.02, 5.0),
            ("times.aim", t.aim, 0.0, 5.0),
            ("times.lower", t.lower, 0.02, 5.0),
            ("times.shift_back", t.shift_back, 0.1, 5.0),
            ("stance.balance[0]", self.stance.balance[0], -0.2, 0.2),
            ("stance.balance[1]", self.stance.balance[1], -0.2, 0.2),
            ("stance.crouch", self.stance.crouch, -0.1, 0.3),
            ("stance.pitch", self.stance.pitch, -0.5, 0.8),
            ("stance.roll", self.stance.roll, -0.5, 0.5),
            ("limits.speed", l.speed, 0.05, 2.0),
            ("limits.torque", l.torque, 0.05, 2.0),
            ("limits.hold", l.hold, 0.05, 2.0),
            ("limits.joint_margin", l.joint_margin, 0.0, 0.2),
            ("limits.knee_bend", l.knee_bend, 0.0, 1.0),
            ("limits.reach", l.reach, 1e-4, 0.05),
            ("limits.clearance", l.clearance, -0.01, 0.1),
            ("limits.edge", l.edge, -0.2, 0.1),
            ("limits.stand", l.stand, 0.01, 3.2),
            ("accuracy.front", self.accuracy.front, 0.0, 3.2),
            ("accuracy.side", self.accuracy.side, 0.0, 3.2),
            ("feedback.filter", f.filter, 0.0, 1.0),
            ("feedback.tilt", f.tilt, 0.0, 10.0),
            ("feedback.rate", f.rate, 0.0, 10.0),
            ("feedback.moment", f.moment, 0.0, 1.0),
            ("feedback.catch", f.catch, 0.05, 0.3),
        ] {
            within(field, value, low, high)?;
        }
        for (axis, pid) in [("x", &f.x), ("y", &f.y)] {
            for (part, value, high) in
                [("p", pid.p, 10.0), ("i", pid.i, 50.0), ("d", pid.d, 5.0), ("limit", pid.limit, 0.2)]
            {
                within(&format!("feedback.{axis}.{part}"), value, 0.0, high)?;
            }
        }
        Ok(())
    }
}
