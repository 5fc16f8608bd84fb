//! What can go wrong with a match.

use instep_behaviour::BehaviourError;
use instep_field::FieldError;
use instep_localisation::LocalisationError;
use instep_player::PlayerError;
use instep_sim::SimError;

use crate::invariants::Breach;

/// A match that cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum MatchError {
    /// The field.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// A strategy or a table of kicks.
    #[error(transparent)]
    Behaviour(#[from] BehaviourError),
    /// A player that cannot be made.
    #[error(transparent)]
    Player(#[from] PlayerError),
    /// A field that nobody can localise on.
    #[error(transparent)]
    Localisation(#[from] LocalisationError),
    /// The physics.
    #[error(transparent)]
    World(#[from] SimError),
    /// A number that cannot be.
    #[error("{what}: {found}; expected {expected}")]
    Value {
        /// Which.
        what: &'static str,
        /// What is there.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A scenario of the rules.
    #[error("{file}: {detail}")]
    Scenario {
        /// Its file.
        file: String,
        /// Line, or value and what would be right.
        detail: String,
    },
    /// A game broke an invariant: a fault of the simulator.
    #[error("game {game} of seed {seed} after {time:.2} s: {breach}; this is a fault of ours, please report it")]
    Breach {
        /// Which of the series, from 0.
        game: usize,
        /// The series' seed.
        seed: u64,
        /// s.
        time: f64,
        /// What.
        breach: Breach,
    },
    /// The network.
    #[error("{what}: {source}; expected a UDP address of this machine that is free")]
    Network {
        /// What was tried.
        what: String,
        /// What the system said.
        source: std::io::Error,
    },
}
