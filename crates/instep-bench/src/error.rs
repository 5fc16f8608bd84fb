//! What can prevent a benchmark from running. How a kick went is never an error.

/// A benchmark that cannot run.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A file cannot be read or written.
    #[error("{file}: {detail}")]
    File {
        /// The file.
        file: String,
        /// What the system or the reader said.
        detail: String,
    },
    /// A scenario's field has a value that cannot be.
    #[error("{file}: {field}: {found}; expected {expected}")]
    Field {
        /// The scenario's file or name.
        file: String,
        /// The field's path.
        field: String,
        /// Its value.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A name that no engine, robot or scenario has.
    #[error("there is no {kind} \"{found}\"; known: {known}")]
    Unknown {
        /// Engine, robot or scenario.
        kind: &'static str,
        /// As asked.
        found: String,
        /// What there is.
        known: String,
    },
    /// An engine that has no settings for a robot.
    #[error("engine {engine} does not know {robot}; expected its settings in {file}")]
    NotForRobot {
        /// The engine.
        engine: String,
        /// The robot.
        robot: String,
        /// Where they would be.
        file: String,
    },
    /// The world refused.
    #[error(transparent)]
    Sim(#[from] instep_sim::SimError),
    /// The engine refused.
    #[error(transparent)]
    Kick(#[from] instep_kick::KickError),
    /// The robot cannot walk.
    #[error(transparent)]
    Walk(#[from] instep_walk::WalkError),
    /// The robot refused.
    #[error(transparent)]
    Robot(#[from] instep_robot::RobotError),
}
