//! The GameController's messages, version 20 (HSL 2026): bytes to values and back.
//!
//! `RGme`, 158 bytes, and `RGrt`, 32 bytes, little endian without padding. What comes from the network is read by bounds
//! and by value; what is no message is refused with its cause.

use instep_behaviour::{GamePhase, PlayState, SetPlay};
use serde::Serialize;

/// Bytes of a control message and of a status.
pub const CONTROL_SIZE: usize = 158;
/// See [`CONTROL_SIZE`].
pub const STATUS_SIZE: usize = 32;
/// Version of the control message and of the status.
pub const CONTROL_VERSION: u8 = 20;
/// See [`CONTROL_VERSION`].
pub const STATUS_VERSION: u8 = 4;
/// Players of a team in a message.
pub const MOST_PLAYERS: usize = 20;

const TEAM_SIZE: usize = 70;
const PLAYERS_AT: usize = 10;
const NO_TEAM: u8 = 255;

/// Why a packet is ignored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Refusal {
    /// Not as many bytes as there must be.
    Size,
    /// Not what it should begin with.
    Header,
    /// Another version.
    Version,
    /// A number that cannot be.
    Value,
    /// Older than the last one.
    Late,
    /// About teams that do not play.
    Teams,
}

/// One player in a control message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PlayerInfo {
    /// 0: none; else the number of a penalty.
    pub penalty: u8,
    /// s.
    pub seconds: u8,
    /// Cautions.
    pub cautions: u8,
}

/// One team in a control message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TeamInfo {
    /// Its number.
    pub number: u8,
    /// Colour of the field players.
    pub field_colour: u8,
    /// Colour of the keeper.
    pub keeper_colour: u8,
    /// Number of the keeper.
    pub keeper: u8,
    /// Goals.
    pub score: u8,
    /// Shots of the shoot-out.
    pub shot: u8,
    /// A bit for each that scored.
    pub shots: u16,
    /// Messages left.
    pub budget: u16,
    /// Players.
    pub players: [PlayerInfo; MOST_PLAYERS],
}

/// A control message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Control {
    /// Rises with each, wraps.
    pub packet: u8,
    /// Players of a team.
    pub players: u8,
    /// 0 S, 1 M, 2 L.
    pub competition: u8,
    /// The clock stands.
    pub stopped: bool,
    /// Part of the game.
    pub phase: GamePhase,
    /// State of play.
    pub state: PlayState,
    /// Restart.
    pub set_play: SetPlay,
    /// First half.
    pub first_half: bool,
    /// Number of the team that takes a restart.
    pub kicking: Option<u8>,
    /// Left of the half, s.
    pub remaining: i16,
    /// READY, restart, s.
    pub secondary: i16,
    /// Both teams.
    pub teams: [TeamInfo; 2],
}

const PHASES: [GamePhase; 4] = [GamePhase::Normal, GamePhase::Shootout, GamePhase::Extra, GamePhase::Timeout];
const STATES: [PlayState; 5] =
    [PlayState::Initial, PlayState::Ready, PlayState::Set, PlayState::Playing, PlayState::Finished];
const SET_PLAYS: [SetPlay; 7] = [
    SetPlay::None,
    SetPlay::DirectFreeKick,
    SetPlay::IndirectFreeKick,
    SetPlay::PenaltyKick,
    SetPlay::ThrowIn,
    SetPlay::GoalKick,
    SetPlay::CornerKick,
];

fn number<T: PartialEq>(of: T, all: &[T]) -> u8 {
    all.iter().position(|x| *x == of).unwrap_or(0) as u8
}

fn flag(byte: u8) -> Result<bool, Refusal> {
    match byte {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Refusal::Value),
    }
}

/// Checks size, header and version and hands on the bytes.
fn open<'a, const N: usize>(bytes: &'a [u8], header: &[u8; 4], version: u8) -> Result<&'a [u8; N], Refusal> {
    let bytes: &[u8; N] = bytes.try_into().map_err(|_| Refusal::Size)?;
    if &bytes[..4] != header {
        return Err(Refusal::Header);
    }
    if bytes[4] != version {
        return Err(Refusal::Version);
    }
    Ok(bytes)
}

impl Control {
    /// Reads a message.
    ///
    /// # Errors
    /// [`Refusal`] for whatever is not a message of this version.
    pub fn parse(bytes: &[u8]) -> Result<Self, Refusal> {
        let b: &[u8; CONTROL_SIZE] = open(bytes, b"RGme", CONTROL_VERSION)?;
        let i16_at = |at: usize| i16::from_le_bytes([b[at], b[at + 1]]);
        let u16_at = |at: usize| u16::from_le_bytes([b[at], b[at + 1]]);
        if usize::from(b[6]) > MOST_PLAYERS || b[7] > 2 {
            return Err(Refusal::Value);
        }
        let team = |at: usize| {
            let mut players = [PlayerInfo::default(); MOST_PLAYERS];
            for (i, player) in players.iter_mut().enumerate() {
                let p = at + PLAYERS_AT + 3 * i;
                *player = PlayerInfo { penalty: b[p], seconds: b[p + 1], cautions: b[p + 2] };
            }
            TeamInfo {
                number: b[at],
                field_colour: b[at + 1],
                keeper_colour: b[at + 2],
                keeper: b[at + 3],
                score: b[at + 4],
                shot: b[at + 5],
                shots: u16_at(at + 6),
                budget: u16_at(at + 8),
                players,
            }
        };
        let control = Self {
            packet: b[5],
            players: b[6],
            competition: b[7],
            stopped: flag(b[8])?,
            phase: *PHASES.get(usize::from(b[9])).ok_or(Refusal::Value)?,
            state: *STATES.get(usize::from(b[10])).ok_or(Refusal::Value)?,
            set_play: *SET_PLAYS.get(usize::from(b[11])).ok_or(Refusal::Value)?,
            first_half: flag(b[12])?,
            kicking: (b[13] != NO_TEAM).then_some(b[13]),
            remaining: i16_at(14),
            secondary: i16_at(16),
            teams: [team(18), team(18 + TEAM_SIZE)],
        };
        if control.teams[0].number == control.teams[1].number {
            return Err(Refusal::Value);
        }
        Ok(control)
    }

    /// The message's bytes.
    pub fn bytes(&self) -> [u8; CONTROL_SIZE] {
        let mut b = [0; CONTROL_SIZE];
        b[..4].copy_from_slice(b"RGme");
        b[4] = CONTROL_VERSION;
        b[5..14].copy_from_slice(&[
            self.packet,
            self.players,
            self.competition,
            u8::from(self.stopped),
            number(self.phase, &PHASES),
            number(self.state, &STATES),
            number(self.set_play, &SET_PLAYS),
            u8::from(self.first_half),
            self.kicking.unwrap_or(NO_TEAM),
        ]);
        b[14..16].copy_from_slice(&self.remaining.to_le_bytes());
        b[16..18].copy_from_slice(&self.secondary.to_le_bytes());
        for (team, at) in self.teams.iter().zip([18, 18 + TEAM_SIZE]) {
            let head = [team.number, team.field_colour, team.keeper_colour, team.keeper, team.score, team.shot];
            b[at..at + 6].copy_from_slice(&head);
            b[at + 6..at + 8].copy_from_slice(&team.shots.to_le_bytes());
            b[at + 8..at + 10].copy_from_slice(&team.budget.to_le_bytes());
            for (i, player) in team.players.iter().enumerate() {
                let p = at + PLAYERS_AT + 3 * i;
                b[p..p + 3].copy_from_slice(&[player.penalty, player.seconds, player.cautions]);
            }
        }
        b
    }
}

/// What a player tells of itself. Its own frame's lengths are mm, as the message has them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Status {
    /// From 1.
    pub player: u8,
    /// The team's number.
    pub team: u8,
    /// On the ground.
    pub fallen: bool,
    /// In the team's field frame: mm, mm, rad.
    pub pose: [f32; 3],
    /// Since the ball was last seen, s; -1: never.
    pub ball_age: f32,
    /// In the robot frame, mm.
    pub ball: [f32; 2],
}

impl Status {
    /// Reads a status.
    ///
    /// # Errors
    /// [`Refusal`] for whatever is not a status of this version.
    pub fn parse(bytes: &[u8]) -> Result<Self, Refusal> {
        let b: &[u8; STATUS_SIZE] = open(bytes, b"RGrt", STATUS_VERSION)?;
        let at = |i: usize| f32::from_le_bytes([b[i], b[i + 1], b[i + 2], b[i + 3]]);
        let status = Self {
            player: b[5],
            team: b[6],
            fallen: flag(b[7])?,
            pose: [at(8), at(12), at(16)],
            ball_age: at(20),
            ball: [at(24), at(28)],
        };
        let finite = status.pose.iter().chain(&status.ball).chain([&status.ball_age]).all(|x| x.is_finite());
        let known = (1..=MOST_PLAYERS).contains(&usize::from(status.player));
        if finite && known { Ok(status) } else { Err(Refusal::Value) }
    }

    /// The status's bytes.
    pub fn bytes(&self) -> [u8; STATUS_SIZE] {
        let mut b = [0; STATUS_SIZE];
        b[..4].copy_from_slice(b"RGrt");
        b[4..8].copy_from_slice(&[STATUS_VERSION, self.player, self.team, u8::from(self.fallen)]);
        let numbers = self.pose.into_iter().chain([self.ball_age]).chain(self.ball);
        for (value, at) in numbers.zip((8..).step_by(4)) {
            b[at..at + 4].copy_from_slice(&value.to_le_bytes());
        }
        b
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn control() -> Control {
        let mut teams = [TeamInfo { number: 7, ..TeamInfo::default() }, TeamInfo { number: 9, ..TeamInfo::default() }];
        teams[0].score = 3;
        teams[1].shots = 0x0201;
        teams[1].players[19] = PlayerInfo { penalty: 9, seconds: 45, cautions: 2 };
        Control {
            packet: 200,
            players: 5,
            competition: 2,
            stopped: true,
            phase: GamePhase::Extra,
            state: PlayState::Playing,
            set_play: SetPlay::CornerKick,
            first_half: true,
            kicking: Some(9),
            remaining: -17,
            secondary: 300,
            teams,
        }
    }

    /// Against the layout as it is written in the rules, byte by byte.
    #[test]
    fn bytes_stand_where_the_layout_says() {
        let b = control().bytes();
        assert_eq!(&b[..18], b"RGme\x14\xc8\x05\x02\x01\x02\x03\x06\x01\x09\xef\xff\x2c\x01");
        assert_eq!((b[18], b[22], b[88], b[94], b[95]), (7, 3, 9, 1, 2));
        assert_eq!(&b[155..], &[9, 45, 2]);
        let status =
            Status { player: 2, team: 7, fallen: true, pose: [1.0, -2.0, 0.5], ball_age: -1.0, ball: [3.0, 4.0] };
        let b = status.bytes();
        assert_eq!(&b[..12], b"RGrt\x04\x02\x07\x01\x00\x00\x80\x3f");
        assert_eq!(Status::parse(&b), Ok(status));
    }

    #[test]
    fn what_is_no_message_is_refused_by_its_cause() {
        let good = control().bytes();
        assert_eq!(Control::parse(&good), Ok(control()));
        assert_eq!(Control::parse(&good[..157]), Err(Refusal::Size));
        assert_eq!(Control::parse(&[]), Err(Refusal::Size));
        let with = |at: usize, value: u8| {
            let mut b = good;
            b[at] = value;
            Control::parse(&b)
        };
        assert_eq!(with(0, b'X'), Err(Refusal::Header));
        assert_eq!(with(4, 19), Err(Refusal::Version));
        for (at, value) in [(6, 21), (7, 3), (8, 2), (9, 4), (10, 5), (11, 7), (12, 9), (88, 7)] {
            assert_eq!(with(at, value), Err(Refusal::Value), "byte {at}");
        }
        let status =
            Status { player: 2, team: 7, fallen: false, pose: [f32::NAN, 0.0, 0.0], ball_age: 0.0, ball: [0.0; 2] };
        assert_eq!(Status::parse(&status.bytes()), Err(Refusal::Value));
    }

    proptest! {
        #[test]
        fn no_bytes_panic_and_what_is_read_is_written_back(mut bytes in prop::collection::vec(any::<u8>(), 0..200), real in any::<bool>()) {
            if real {
                bytes.resize(CONTROL_SIZE, 0);
                bytes[..5].copy_from_slice(b"RGme\x14");
                for (at, most) in [(6, 21), (7, 3), (8, 2), (9, 4), (10, 5), (11, 7), (12, 2)] {
                    bytes[at] %= most;
                }
            }
            if let Ok(control) = Control::parse(&bytes) {
                prop_assert_eq!(&control.bytes()[..], &bytes[..]);
            }
            let _ = Status::parse(&bytes);
        }
    }
}
