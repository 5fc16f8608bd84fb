//! Why an engine could not be made ready.

/// An engine that does not fit its robot.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum KickError {
    /// A reference made for another robot.
    #[error("the reference is for the robot \"{reference}\", not for \"{robot}\": retarget the clip to \"{robot}\"")]
    OtherRobot {
        /// The robot that the reference names.
        reference: String,
        /// The robot at hand.
        robot: String,
    },
    /// The joints of the reference are not the robot's.
    #[error("the reference has no joint \"{joint}\"; it was made for an older model of \"{robot}\": retarget the clip")]
    MissingJoint {
        /// The robot's joint.
        joint: String,
        /// The robot.
        robot: String,
    },
    /// A start outside the reference.
    #[error("cannot start at {start} s: the reference lasts from 0 to {duration:.3} s")]
    Start {
        /// The asked start, s.
        start: f64,
        /// The reference's length, s.
        duration: f64,
    },
    /// A robot without a part that a standing kick needs.
    #[error(
        "{robot}/robot.toml: leg.{side}.{part}: the robot has none, and a kick from the stand needs it: use --engine in-gait"
    )]
    MissingPart {
        /// The robot.
        robot: String,
        /// The leg.
        side: instep_motion::phase::Side,
        /// The part, as `robot.toml` names it.
        part: &'static str,
    },
    /// A settings file that is missing or cannot be read.
    #[error("{file}: cannot be read: {detail}")]
    Read {
        /// The file.
        file: String,
        /// What the system said.
        detail: String,
    },
    /// A settings file that is not what it should be.
    #[error("{file}: {detail}")]
    Parse {
        /// The file.
        file: String,
        /// Line, column and cause.
        detail: String,
    },
    /// A setting with a value that cannot be.
    #[error("{field}: {found}; expected {expected}")]
    Setting {
        /// The field's path, like `balance.x.p`.
        field: String,
        /// Its value.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A reachability grid of another robot, or of an older model or stance of this one.
    #[error(
        "the reachability grid was measured with another robot, or an older model or stance of \"{robot}\" (hash {found:016x}, \
         not {expected:016x}): measure it again with `instep robot reach {robot}`"
    )]
    OtherGrid {
        /// The robot at hand.
        robot: String,
        /// Hash that the grid was measured with.
        found: u64,
        /// Hash of the robot at hand.
        expected: u64,
    },
}

impl From<instep_robot::ik::IkError> for KickError {
    fn from(error: instep_robot::ik::IkError) -> Self {
        Self::Setting { field: error.field, found: error.found, expected: error.expected }
    }
}
