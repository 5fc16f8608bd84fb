//! A reference: one motion of one robot, by joint name, with all that is known about it.
//!
//! World frame: z up, ground at z = 0, x along the aimed direction of the kick, origin on the ground under the
//! ball's centre. Saved as JSON, one knot a line, so that two references can be compared line by line.
//!
//! - [`Reference::load`], [`Reference::save`] and [`Reference::validate`]: the file and what it must hold.
//! - [`Reference::sample_into`]: the state between the knots.

mod file;
mod sample;
mod validate;

use serde::{Deserialize, Serialize};

use crate::phase::KickPhases;

/// How a reference was made; paper 1 compares the first three kinds (section III-C).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReferenceKind {
    /// Inverse kinematics only; the clip's foot slip is kept.
    KinematicSlip,
    /// Inverse kinematics with the contact schedule enforced: stance feet stand still.
    Kinematic,
    /// Consistent with the robot's centroidal dynamics and its limits.
    Kinodynamic,
    /// The best that the kinodynamic stage found where it did not get that far: some law or limit is broken, and no
    /// robot can do it as it stands.
    Infeasible,
}

/// What a reference was computed from, for its card and for the error that names it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// File name of the clip (no folder).
    pub clip: String,
    /// File name of the skeleton, where the format keeps it apart.
    pub skeleton: Option<String>,
    /// The clip's own time at the reference's time zero, s.
    pub clip_start: f64,
    /// The clip's owner, as its licence asks to be named.
    pub acknowledgement: String,
}

/// The state at one instant. Vectors run in the order of [`Reference::joint_names`] or
/// [`Reference::contact_names`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Knot {
    /// Base link's origin in the world, m.
    pub base_position: [f64; 3],
    /// `world_from_base`, unit quaternion w, x, y, z.
    pub base_orientation: [f64; 4],
    /// Base link's linear velocity in the world, m/s.
    pub base_velocity: [f64; 3],
    /// Base link's angular velocity **in the base frame** (MuJoCo's free joint), rad/s.
    pub base_angular_velocity: [f64; 3],
    /// Joint positions, rad.
    pub joints: Vec<f64>,
    /// Joint speeds, rad/s.
    pub joint_velocities: Vec<f64>,
    /// Which contact points are meant to stand on the ground.
    pub contacts: Vec<bool>,
    /// Ground reaction force at each contact point in the world, N; empty for a kinematic reference.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub forces: Vec<[f64; 3]>,
    /// Joint torques that the motion needs, N m; empty where not computed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub torques: Vec<f64>,
    /// Centre of mass in the world, m.
    pub com: [f64; 3],
    /// Centroidal linear momentum, then angular momentum about the centre of mass, world axes; kg m/s, kg m^2/s.
    pub momentum: [f64; 6],
}

/// A robot's motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Version of this file's layout; [`Reference::FORMAT`].
    pub format: u32,
    /// The robot's name, as in its `robot.toml`.
    pub robot: String,
    /// How it was made.
    pub kind: ReferenceKind,
    /// From what it was made.
    pub source: Source,
    /// Knots a second.
    pub rate: f64,
    /// Ball's centre at rest before the kick, m.
    pub ball: [f64; 3],
    /// Phase times, in the reference's own time (zero at the first knot), s.
    pub phases: KickPhases,
    /// Joint names; their order is that of all joint vectors here.
    pub joint_names: Vec<String>,
    /// Contact-point names; their order is that of [`Knot::contacts`] and [`Knot::forces`].
    pub contact_names: Vec<String>,
    /// The motion, at least two knots.
    pub knots: Vec<Knot>,
}

impl Reference {
    /// The layout that this version writes and reads.
    pub const FORMAT: u32 = 1;
}

impl Reference {
    /// From the first knot to the last, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.knots.len().saturating_sub(1) as f64 / self.rate
    }

    /// Position of `name` in [`Self::joint_names`].
    #[must_use]
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joint_names.iter().position(|joint| joint == name)
    }
}
