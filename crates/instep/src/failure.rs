//! Why a command did not do what was asked: the message for the user and the exit code.
//!
//! Which errors are the user's to mend is decided here, in one place.

use std::fmt::Display;
use std::process::ExitCode;

use instep_behaviour::BehaviourError;
use instep_field::FieldError;
use instep_kick::KickError;
use instep_localisation::LocalisationError;
use instep_match::MatchError;
use instep_motion::MotionError;
use instep_navigation::NavigationError;
use instep_report::ReportError;
use instep_retarget::RetargetError;
use instep_robot::RobotError;
use instep_ros::RosError;
use instep_sim::SimError;

/// One message, and whether the user can mend its cause.
#[derive(Debug)]
pub(crate) struct Failure {
    message: String,
    bad_input: bool,
}

impl Failure {
    /// Something handed in cannot be used. The message says what, where, and what would be right.
    pub(crate) fn input(message: impl Display) -> Self {
        Self { message: message.to_string(), bad_input: true }
    }

    /// The input was good, and yet it went wrong.
    pub(crate) fn other(message: impl Display) -> Self {
        Self { message: message.to_string(), bad_input: false }
    }

    /// The same with the file or flag that it is about in front.
    pub(crate) fn about(self, what: impl Display) -> Self {
        Self { message: format!("{what}: {}", self.message), ..self }
    }

    /// The same with the stage of a long work at the end.
    pub(crate) fn in_stage(self, stage: &str) -> Self {
        Self { message: format!("{} (stage: {stage})", self.message), ..self }
    }

    /// What the user reads.
    pub(crate) fn message(&self) -> &str {
        &self.message
    }

    /// 2 for bad input, else 1.
    pub(crate) fn code(&self) -> ExitCode {
        ExitCode::from(if self.bad_input { 2 } else { 1 })
    }
}

impl From<MotionError> for Failure {
    fn from(error: MotionError) -> Self {
        Self::input(error)
    }
}

impl From<RobotError> for Failure {
    fn from(error: RobotError) -> Self {
        Self::input(error)
    }
}

impl From<instep_walk::WalkError> for Failure {
    fn from(error: instep_walk::WalkError) -> Self {
        Self::input(error)
    }
}

impl From<KickError> for Failure {
    fn from(error: KickError) -> Self {
        Self::input(error)
    }
}

impl From<FieldError> for Failure {
    fn from(error: FieldError) -> Self {
        Self::input(error)
    }
}

impl From<LocalisationError> for Failure {
    fn from(error: LocalisationError) -> Self {
        Self::input(error)
    }
}

impl From<NavigationError> for Failure {
    fn from(error: NavigationError) -> Self {
        Self::input(error)
    }
}

impl From<SimError> for Failure {
    fn from(error: SimError) -> Self {
        match error {
            SimError::Diverged { .. } => Self::other(error),
            _ => Self::input(error),
        }
    }
}

impl From<RosError> for Failure {
    fn from(error: RosError) -> Self {
        match error {
            RosError::Domain { .. } => Self::input(error),
            RosError::World(error) => error.into(),
            _ => Self::other(error),
        }
    }
}

impl From<BehaviourError> for Failure {
    fn from(error: BehaviourError) -> Self {
        Self::input(error)
    }
}

impl From<MatchError> for Failure {
    fn from(error: MatchError) -> Self {
        match error {
            MatchError::Breach { .. } => Self::other(error),
            _ => Self::input(error),
        }
    }
}

impl From<ReportError> for Failure {
    fn from(error: ReportError) -> Self {
        match error {
            ReportError::Write { .. } => Self::input(error),
            _ => Self::other(error),
        }
    }
}

impl From<RetargetError> for Failure {
    fn from(error: RetargetError) -> Self {
        match error {
            RetargetError::Breakdown { .. } => Self::other(error),
            _ => Self::input(error),
        }
    }
}
