//! Why a player cannot be made.

use instep_behaviour::BehaviourError;
use instep_localisation::LocalisationError;
use instep_navigation::NavigationError;
use instep_walk::WalkError;

/// Why a player cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum PlayerError {
    /// The robot cannot walk as it is described.
    #[error(transparent)]
    Walk(#[from] WalkError),
    /// A strategy or a table of kicks cannot be.
    #[error(transparent)]
    Behaviour(#[from] BehaviourError),
    /// A field that cannot be localised on.
    #[error(transparent)]
    Localisation(#[from] LocalisationError),
    /// Limits that navigation cannot use.
    #[error(transparent)]
    Navigation(#[from] NavigationError),
    /// A file cannot be read.
    #[error("{file}: {detail}")]
    File {
        /// The file.
        file: String,
        /// What the system or the reader said.
        detail: String,
    },
    /// A number that cannot be.
    #[error("{place}: {found}; expected {expected}")]
    Value {
        /// The path of the value.
        place: String,
        /// What is there.
        found: String,
        /// What would be right.
        expected: String,
    },
}
