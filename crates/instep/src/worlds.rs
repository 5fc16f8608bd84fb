//! The world that a command's `--world` asks for: a robot's default one, the ideal one, or what a file changes.

use std::path::Path;

use instep_kick::{BallModel, Settings};
use instep_robot::Robot;
use instep_sim::settings::WorldSettings;

use crate::failure::Failure;
use crate::places;

/// What `--world` takes beside a file: perfect drives and senses.
const IDEAL: &str = "ideal";

/// What the file holds, for an error.
const WHAT: &str = "\"ideal\", or a file with constants of the world";

/// The world in which a robot is measured unless another is asked for: its drives and senses as they were built, and the ball
/// that it plays, where its folder has one.
///
/// # Errors
/// When the ball cannot be read.
pub(crate) fn default(robot: &Robot) -> Result<WorldSettings, Failure> {
    let plain = if robot.folder().join(BallModel::FILE).exists() {
        instep_bench::engines::world(&BallModel::load(robot.folder())?)
    } else {
        WorldSettings::default()
    };
    Ok(plain.as_built(robot))
}

/// The world that `asked` names: the ideal one, or the constants of a file in place of the `default` ones.
///
/// # Errors
/// When the file cannot be read, or holds what cannot be.
pub(crate) fn asked(asked: Option<&Path>, default: &WorldSettings) -> Result<WorldSettings, Failure> {
    let Some(path) = asked else { return Ok(*default) };
    if path == Path::new(IDEAL) {
        return Ok(default.ideal());
    }
    // Read as it stands first, so that an error has its line.
    let _: WorldSettings = places::settings("--world", path, WHAT)?;
    let changes: toml::Table = places::settings("--world", path, WHAT)?;
    let mut table = toml::Table::try_from(default).map_err(Failure::other)?;
    overlay(&mut table, changes);
    let settings: WorldSettings = table.try_into().map_err(|e| Failure::input(e).about(path.display()))?;
    settings.validate().map_err(|e| Failure::from(e).about(path.display()))?;
    Ok(settings)
}

/// Puts every value of `changes` in its place in `table`.
fn overlay(table: &mut toml::Table, changes: toml::Table) {
    for (key, value) in changes {
        match (table.get_mut(&key), value) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(changes)) => overlay(inner, changes),
            (_, value) => {
                table.insert(key, value);
            }
        }
    }
}
