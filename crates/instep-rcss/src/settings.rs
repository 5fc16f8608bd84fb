//! How one of our robots plays on the server: as anywhere, but for what the server's cycle and eyes change.

use instep_behaviour::{KickTable, Strategy};
use instep_player::{PlayerError, PlayerSettings};
use instep_robot::Robot;
use instep_walk::WalkSettings;

use crate::RcssError;

/// What a robot's folder says of its walk on the server: only what differs from its walk elsewhere.
const FILE: &str = "rcss.toml";
/// The server's eyes see all of its fields, m.
const SIGHT: f64 = 150.0;
/// From a change of the asked velocity to its effect: two steps and two cycles, s.
const WALK_DELAY: f64 = 0.3;

/// [`PlayerSettings::load`] with `rcss.toml` of the robot's folder for the walk, where there is one.
///
/// # Errors
/// When a file is not what it should be.
pub fn settings(robot: &Robot, strategy: Strategy, kicks: &KickTable) -> Result<PlayerSettings, RcssError> {
    let mut settings = PlayerSettings::load(robot, strategy, kicks)?;
    settings.tuning.sight_range = SIGHT;
    settings.tuning.walk_delay = WALK_DELAY;
    let file = robot.folder().join(FILE);
    if file.exists() {
        let text = std::fs::read_to_string(&file)
            .map_err(|e| PlayerError::File { file: file.display().to_string(), detail: e.to_string() })?;
        settings.walk = WalkSettings::parse(robot, &file, &text).map_err(PlayerError::from)?;
    }
    Ok(settings)
}
