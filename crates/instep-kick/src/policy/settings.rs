//! Settings of the engine `policy` for one robot: `policy.toml` in its folder.

use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::file::Policy;
use crate::KickError;
use crate::settings::{Settings, within};

/// All settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolicySettings {
    /// The policy's file, from the robot's folder.
    pub file: PathBuf,
    /// Speed at which the ball leaves, m/s, 0.1 to 50; as measured.
    pub ball_speed: f64,
    /// Standard deviation of its direction, rad, 0 to 1; as measured. A request for a direction nearer than this is for the
    /// policy's own.
    pub precision: f64,
    /// How far from the policy's own place the ball may lie, m, 0 to 0.3.
    pub reach: f64,
    /// How far a joint may be from the pose in which the kick starts, rad, 0.01 to 1.
    pub pose: f64,
}

impl Settings for PolicySettings {
    const FILE: &'static str = "policy.toml";
    const HOLDS: &'static str = "the settings of the engine `policy`";

    fn validate(&self) -> Result<(), KickError> {
        within("ball_speed", self.ball_speed, 0.1, 50.0)?;
        within("precision", self.precision, 0.0, 1.0)?;
        within("reach", self.reach, 0.0, 0.3)?;
        within("pose", self.pose, 0.01, 1.0)
    }
}

impl PolicySettings {
    /// Where the policy is, for the robot in `folder`.
    #[must_use]
    pub fn path(&self, folder: &Path) -> PathBuf {
        let mut path = folder.to_owned();
        for part in self.file.components() {
            // People read the path: `robots/nao/../..` is left out where that is possible.
            if part == Component::ParentDir && path.file_name().is_some() {
                path.pop();
            } else {
                path.push(part);
            }
        }
        path
    }

    /// Loads the policy of the robot in `folder`.
    ///
    /// # Errors
    /// As [`Policy::load`].
    pub fn load_policy(&self, folder: &Path) -> Result<Policy, KickError> {
        Policy::load(&self.path(folder))
    }
}
