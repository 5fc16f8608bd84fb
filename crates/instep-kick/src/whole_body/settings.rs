//! Settings that several engines have in their files: how long phases take, the stance, what counts as possible, and the closed loop on the centre of pressure.

use serde::{Deserialize, Serialize};

use crate::KickError;
use crate::settings::within;

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

/// How long phases take; the strike's times follow from distance and speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Times {
    /// Shift of the weight over the support foot, s.
    pub shift: f64,
    /// Pause on the support foot before the foot is raised, s.
    pub settle: f64,
    /// Fastest mean speed of the foot outside the strike, m/s.
    pub foot_speed: f64,
    /// Least time of a foot motion outside the strike, s.
    pub foot_least: f64,
    /// Pause at the wind-up point, s.
    pub aim: f64,
    /// Lowering of the foot, s.
    pub lower: f64,
    /// Shift of the weight back, s.
    pub shift_back: f64,
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

impl Pid {
    /// Checks every value; `field` is the path of the controller.
    ///
    /// # Errors
    /// Names the first field whose value cannot be.
    pub fn validate(&self, field: &str) -> Result<(), KickError> {
        for (part, value, high) in
            [("p", self.p, 10.0), ("i", self.i, 50.0), ("d", self.d, 5.0), ("limit", self.limit, 0.2)]
        {
            within(&format!("{field}.{part}"), value, 0.0, high)?;
        }
        Ok(())
    }
}

impl Times {
    /// Checks every value.
    ///
    /// # Errors
    /// Names the first field whose value cannot be.
    pub fn validate(&self) -> Result<(), KickError> {
        for (field, value, low, high) in [
            ("times.shift", self.shift, 0.1, 5.0),
            ("times.settle", self.settle, 0.0, 5.0),
            ("times.foot_speed", self.foot_speed, 0.01, 5.0),
            ("times.foot_least", self.foot_least, 0.02, 5.0),
            ("times.aim", self.aim, 0.0, 5.0),
            ("times.lower", self.lower, 0.02, 5.0),
            ("times.shift_back", self.shift_back, 0.1, 5.0),
        ] {
            within(field, value, low, high)?;
        }
        Ok(())
    }
}

impl Stance {
    /// Checks every value.
    ///
    /// # Errors
    /// Names the first field whose value cannot be.
    pub fn validate(&self) -> Result<(), KickError> {
        for (field, value, low, high) in [
            ("stance.balance[0]", self.balance[0], -0.2, 0.2),
            ("stance.balance[1]", self.balance[1], -0.2, 0.2),
            ("stance.crouch", self.crouch, -0.1, 0.3),
            ("stance.pitch", self.pitch, -0.5, 0.8),
            ("stance.roll", self.roll, -0.5, 0.5),
        ] {
            within(field, value, low, high)?;
        }
        Ok(())
    }
}

impl Limits {
    /// Checks every value.
    ///
    /// # Errors
    /// Names the first field whose value cannot be.
    pub fn validate(&self) -> Result<(), KickError> {
        let l = self;
        for (field, value, low, high) in [
            ("limits.speed", l.speed, 0.05, 2.0),
            ("limits.torque", l.torque, 0.05, 2.0),
            ("limits.hold", l.hold, 0.05, 2.0),
            ("limits.joint_margin", l.joint_margin, 0.0, 0.2),
            ("limits.knee_bend", l.knee_bend, 0.0, 1.0),
            ("limits.reach", l.reach, 1e-4, 0.05),
            ("limits.clearance", l.clearance, -0.01, 0.1),
            ("limits.edge", l.edge, -0.2, 0.1),
            ("limits.stand", l.stand, 0.01, 3.2),
        ] {
            within(field, value, low, high)?;
        }
        Ok(())
    }
}

impl Feedback {
    /// Checks every value.
    ///
    /// # Errors
    /// Names the first field whose value cannot be.
    pub fn validate(&self) -> Result<(), KickError> {
        let f = self;
        for (field, value, low, high) in [
            ("feedback.filter", f.filter, 0.0, 1.0),
            ("feedback.tilt", f.tilt, 0.0, 10.0),
            ("feedback.rate", f.rate, 0.0, 10.0),
            ("feedback.moment", f.moment, 0.0, 1.0),
            ("feedback.catch", f.catch, 0.05, 0.3),
        ] {
            within(field, value, low, high)?;
        }
        f.x.validate("feedback.x")?;
        f.y.validate("feedback.y")
    }
}
