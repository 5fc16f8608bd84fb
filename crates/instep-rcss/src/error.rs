//! What can go wrong between a player and its server.

use instep_player::PlayerError;
use instep_robot::RobotError;

/// What can go wrong between a player and its server.
#[derive(Debug, thiserror::Error)]
pub enum RcssError {
    /// The server has no model of this robot, or we know none of it.
    #[error("the robot \"{found}\" is not one of the server's; expected one of {known}")]
    Model {
        /// What was asked.
        found: String,
        /// What there is.
        known: String,
    },
    /// Our robot has not the joints or links that the server's has.
    #[error("{robot}: no {part}; the server's {model} has one")]
    Part {
        /// Our robot.
        robot: String,
        /// The missing part.
        part: String,
        /// The server's model.
        model: &'static str,
    },
    /// A name that the server's messages cannot carry.
    #[error("the team's name \"{found}\" cannot be; expected 1 to 32 letters, digits, '_' or '-'")]
    Team {
        /// What was asked.
        found: String,
    },
    /// A shirt number that the server does not take.
    #[error("a player's number {found} cannot be; expected 1 to 99")]
    Number {
        /// What was asked.
        found: u32,
    },
    /// Nobody listens there, or the line is dead.
    #[error("{address}: {detail}")]
    Connection {
        /// Host and port.
        address: String,
        /// What the system said.
        detail: String,
    },
    /// The server closed the connection before it ever told anything.
    #[error(
        "{address}: the server refused player {number} of {team} (model {model}): is the number taken, the team full, or the model unknown to it?"
    )]
    Refused {
        /// Host and port.
        address: String,
        /// Shirt number.
        number: u8,
        /// Team.
        team: String,
        /// Model.
        model: &'static str,
    },
    /// What came is not what this server sends.
    #[error("{address}: {detail}; expected the messages of RCSSServerMJ 0.2")]
    Protocol {
        /// Host and port.
        address: String,
        /// What was wrong.
        detail: String,
    },
    /// A player cannot be made.
    #[error(transparent)]
    Player(#[from] PlayerError),
    /// A robot cannot be loaded.
    #[error(transparent)]
    Robot(#[from] RobotError),
}
