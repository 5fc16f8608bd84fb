//! The layout of `robot.toml`: which joint, link, sole and sensor of a model plays which part, with the limits
//! and gains that a model file cannot say. Read by [`crate::Robot::load`], which checks every name against the model.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::drive::{DriveSettings, Pid};
use crate::senses::SenseSettings;

/// A whole `robot.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotFile {
    /// Short name, used in references, policies and tables.
    pub name: String,
    /// One line for people: size, weight, whose model.
    pub title: String,
    /// Model file (MJCF or URDF), relative to this file.
    pub model: String,
    /// The engine that kicks where none is named; see `instep bench` for their names.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub engine: Option<String>,
    /// The floating base.
    pub base: BaseFile,
    /// What its drives take, how often and how late; absent, torque drives at 1 kHz without delay.
    #[serde(default)]
    pub drives: DriveSettings,
    /// How its senses err; absent, they are perfect.
    #[serde(default)]
    pub senses: SenseSettings,
    /// Joints that share limits and gains; every joint of the model is in exactly one.
    pub group: Vec<GroupFile>,
    /// Joint angles of the pose that it stands in, rad; joints not named are at zero.
    #[serde(default)]
    pub stand: BTreeMap<String, f64>,
    /// Both legs.
    pub leg: LegsFile,
    /// Contact points of the feet.
    pub contact: Vec<ContactFile>,
    /// Pairs of capsules that must not touch.
    #[serde(default)]
    pub self_collision: SelfCollisionFile,
    /// Human landmark (as [`instep_motion::landmark`] names it) to the point that follows it, for retargeting.
    #[serde(default)]
    pub landmark: BTreeMap<String, PointFile>,
}

/// The floating base and the inertial sensor in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaseFile {
    /// The link with the free joint; a URDF's root link gets one.
    pub link: String,
    /// Where the inertial sensor sits in that link, m; its axes are the link's.
    #[serde(default)]
    pub imu: [f64; 3],
}

/// Joints of one kind, with their drives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroupFile {
    /// The group's name in reports.
    pub name: String,
    /// Its joints.
    pub joints: Vec<String>,
    /// Largest torque, N m; where absent, the model's own limit is used (`actuatorfrcrange`, URDF `effort`).
    pub torque: Option<f64>,
    /// Largest speed, rad/s.
    pub speed: f64,
    /// Share of the speed limit up to which the full torque is available, in [0, 1). From there it falls linearly
    /// to zero at the limit. 0 is a motor without current limit, 0.9 one whose current limit binds first.
    pub corner: f64,
    /// Stiffness of a torque drive or an ideal one, N m/rad. Larger follows closer and shakes sooner.
    pub kp: f64,
    /// Damping of a torque drive or an ideal one, N m s/rad.
    pub kd: f64,
    /// A position servo's own PID; absent, P is `kp` and the motor's back-EMF alone damps.
    pub pid: Option<Pid>,
    /// Position error up to which the drive does nothing, rad.
    #[serde(default)]
    pub dead_zone: f64,
    /// Play of the gears, from flank to flank, rad.
    #[serde(default)]
    pub play: f64,
    /// Dry friction of joint and gears, N m.
    #[serde(default)]
    pub static_friction: f64,
    /// Viscous friction, N m s/rad; without the motor's back-EMF, which is in the torque-speed line.
    #[serde(default)]
    pub viscous_friction: f64,
}

/// Both legs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LegsFile {
    /// Left leg.
    pub left: LegFile,
    /// Right leg.
    pub right: LegFile,
}

/// The parts of one leg.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LegFile {
    /// Joint that turns the leg about its own axis (on NAO the coupled hip yaw-pitch).
    pub hip_yaw: String,
    /// Joint that lifts the leg sideways.
    pub hip_roll: String,
    /// Joint that lifts the leg forward.
    pub hip_pitch: String,
    /// Knee.
    pub knee: String,
    /// Ankle pitch.
    pub ankle_pitch: String,
    /// Ankle roll, where there is one.
    pub ankle_roll: Option<String>,
    /// Toe, where there is one.
    pub toe: Option<String>,
    /// Link between hip and knee.
    pub thigh: String,
    /// Link between knee and ankle.
    pub shank: String,
    /// Link that carries the sole.
    pub foot: String,
    /// Link in front of the toe joint, where there is one.
    pub toe_link: Option<String>,
    /// Centre of the sole on the ground, in the foot's frame, m.
    pub sole: [f64; 3],
    /// Geoms of the model that may strike the ball, the usual striking part first.
    pub strike: Vec<String>,
}

/// One contact point: a small sphere fixed to a link.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactFile {
    /// Its name in references and reports.
    pub name: String,
    /// `left` or `right`.
    pub leg: instep_motion::phase::Side,
    /// The link it is fixed to.
    pub link: String,
    /// Sphere's centre in the link's frame, m.
    pub point: [f64; 3],
    /// Sphere's radius, m.
    pub radius: f64,
}

/// Self-collision.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SelfCollisionFile {
    /// Pairs of geom names; capsules or spheres.
    pub pairs: Vec<[String; 2]>,
}

/// A point fixed to a link.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointFile {
    /// The link.
    pub link: String,
    /// The point in the link's frame, m.
    pub point: [f64; 3],
}

/// The text of a `robot.toml`, laid over the file that its key `derived` names, if it has one.
///
/// Tables are laid over tables, named elements of a list (`group`, `contact`) over those of the same name; all else takes the place of what
/// was derived.
///
/// # Errors
/// In words: when either file is no TOML, or the derived one cannot be read.
pub(crate) fn read(file: &Path, text: &str) -> Result<RobotFile, String> {
    let plain = |e: toml::de::Error| e.to_string().trim_end().to_owned();
    let mut own: Table = toml::from_str(text).map_err(plain)?;
    let Some(derived) = own.remove("derived") else { return toml::from_str(text).map_err(plain) };
    let Some(name) = derived.as_str() else {
        return Err(format!("derived: {derived}; expected the name of a file beside this one"));
    };
    let beside = file.parent().unwrap_or(Path::new(".")).join(name);
    let base =
        std::fs::read_to_string(&beside).map_err(|e| format!("derived: {}: cannot be read: {e}", beside.display()))?;
    let mut table: Table = toml::from_str(&base).map_err(|e| format!("derived: {}: {}", beside.display(), plain(e)))?;
    lay_over(&mut table, own);
    RobotFile::deserialize(Value::Table(table)).map_err(|e| format!("with {name}: {}", plain(e)))
}

fn lay_over(table: &mut Table, over: Table) {
    for (key, value) in over {
        match (table.get_mut(&key), value) {
            (Some(Value::Table(inner)), Value::Table(value)) => lay_over(inner, value),
            (Some(Value::Array(items)), Value::Array(values)) if values.iter().all(|v| v.get("name").is_some()) => {
                for value in values {
                    let same = items.iter_mut().find(|item| item.get("name") == value.get("name"));
                    match (same, value) {
                        (Some(Value::Table(inner)), Value::Table(value)) => lay_over(inner, value),
                        (_, value) => items.push(value),
                    }
                }
            }
            (_, value) => {
                table.insert(key, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_in_the_file_goes_before_what_was_derived() {
        let mut derived: Table =
            toml::from_str("stand = {a = 1.0}\n[[group]]\nname = 'x'\nkp = 1.0\n[[group]]\nname = 'y'\nkp = 2.0\n")
                .unwrap();
        let own = toml::from_str(
            "stand = {b = 2.0}\ngroup = [{name = 'y', speed = 3.0}, {name = 'z'}]\npairs = [['a', 'b']]",
        )
        .unwrap();
        lay_over(&mut derived, own);
        let expected: Table = toml::from_str(
            "stand = {a = 1.0, b = 2.0}\ngroup = [{name = 'x', kp = 1.0}, {name = 'y', kp = 2.0, speed = 3.0}, {name = 'z'}]\npairs = [['a', 'b']]",
        )
        .unwrap();
        assert_eq!(derived, expected);
    }
}
