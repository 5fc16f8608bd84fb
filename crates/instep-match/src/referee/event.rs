//! What the referee saw and did, as values.

use instep_behaviour::SetPlay;
use serde::{Deserialize, Serialize};

use super::Team;

/// What somebody is sent off for; the numbers are the GameController's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Penalty {
    /// Stood where a restart or SET forbids it.
    IllegalPositioning = 1,
    /// Moved in SET.
    MotionInSet = 2,
    /// Nearest to a ball that does not move on.
    LocalGameStuck = 3,
    /// Did not get up.
    IncapableRobot = 4,
    /// Taken out for another reason, by the official GameController.
    PickUp = 5,
    /// Held the ball.
    BallHolding = 6,
    /// Left the field.
    LeavingTheField = 7,
    /// Walked into an opponent.
    Pushing = 9,
    /// Does not take part: shoot-out.
    Substitute = 11,
}

/// Something that the referee saw or did.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Event {
    /// s.
    pub time: f64,
    /// What.
    #[serde(flatten)]
    pub kind: EventKind,
}

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case", deny_unknown_fields)]
pub enum EventKind {
    /// READY for a kick-off.
    KickOff {
        /// Who kicks off.
        team: Team,
    },
    /// SET to PLAYING.
    Whistle,
    /// A goal for.
    Goal {
        /// Whom.
        team: Team,
    },
    /// The ball was in the goal and did not count: no second player had touched it.
    GoalRefused {
        /// Who had kicked.
        team: Team,
    },
    /// A restart in play.
    Restart {
        /// Which.
        set_play: SetPlay,
        /// For whom.
        team: Team,
    },
    /// A restart is over: the ball moved.
    InPlay,
    /// A restart is over: its time was up.
    BallFree,
    /// Dropped at the centre: nobody had touched the ball.
    DroppedBall,
    /// Sent off.
    SentOff {
        /// Team.
        team: Team,
        /// Number.
        number: u8,
        /// Why.
        penalty: Penalty,
    },
    /// Back on the field.
    Returned {
        /// Team.
        team: Team,
        /// Number.
        number: u8,
    },
    /// Fell.
    Fall {
        /// Team.
        team: Team,
        /// Number.
        number: u8,
    },
    /// Kicked.
    Kick {
        /// Team.
        team: Team,
        /// Number.
        number: u8,
    },
    /// A half ended.
    HalfEnd {
        /// Which, from 1; 3 and 4 are extra time.
        half: u32,
    },
    /// A shot of the shoot-out is over.
    Shot {
        /// Who shot.
        team: Team,
        /// Whether it counts.
        scored: bool,
    },
    /// The game is over.
    End,
}
