//! The GameController's messages, version 20 (HSL 2026), and a game that is led by the official program or tells its own
//! state as that program does.
//!
//! Layout: `RGme`, 158 bytes, and `RGrt`, 32 bytes, little endian without padding. What comes from the network is read
//! by bounds and by value: a packet that is short, long, of another version, out of range, not finite or late is counted
//! and ignored, and the game goes on.

mod link;
mod message;

use instep_behaviour::{GamePhase, PlayState, SetPlay};

use crate::EventKind;
use crate::ball::Ball;
use crate::game::{Match, side};
use crate::referee::{Penalty, Team};
use crate::robot::Status as Body;

pub use link::{Counters, Link};
pub use message::{
    CONTROL_SIZE, CONTROL_VERSION, Control, MOST_PLAYERS, PlayerInfo, Refusal, STATUS_SIZE, STATUS_VERSION, Status,
    TeamInfo,
};

/// The official program broadcasts here.
pub const CONTROL_PORT: u16 = 3838;
/// And listens for status here.
pub const STATUS_PORT: u16 = 3939;

fn penalty(number: u8) -> Penalty {
    match number {
        1 => Penalty::IllegalPositioning,
        2 => Penalty::MotionInSet,
        3 => Penalty::LocalGameStuck,
        4 => Penalty::IncapableRobot,
        6 => Penalty::BallHolding,
        7 => Penalty::LeavingTheField,
        9 => Penalty::Pushing,
        11 => Penalty::Substitute,
        _ => Penalty::PickUp,
    }
}

impl Match {
    /// What the official program would say of this game. `numbers` are those of Home and Away. PLAYING is hidden for as
    /// long as the rules say: players hear the whistle.
    pub fn control(&self, packet: u8, numbers: [u8; 2]) -> Control {
        let referee = self.referee();
        let time = self.time();
        let hidden = referee.book().rules.playing_hidden.unwrap_or(0.0);
        let kick_off = referee.set_play == SetPlay::None && referee.kicking.is_some();
        let hide = referee.state == PlayState::Playing && kick_off && time - referee.since() < hidden;
        let seconds = |s: f64| s.ceil().clamp(f64::from(i16::MIN), f64::from(i16::MAX)) as i16;
        let team = |t: Team| {
            let mut info = TeamInfo {
                number: numbers[t],
                field_colour: if t == 0 { 1 } else { 0 },
                keeper_colour: if t == 0 { 2 } else { 3 },
                keeper: 1,
                score: referee.score[t].min(255) as u8,
                ..TeamInfo::default()
            };
            for robot in self.robots().iter().filter(|r| r.team == t) {
                if let (Body::Removed { penalty, until, .. }, Some(player)) =
                    (robot.status, info.players.get_mut(usize::from(robot.number) - 1))
                {
                    *player = PlayerInfo {
                        penalty: penalty as u8,
                        seconds: (until - time).ceil().clamp(0.0, 255.0) as u8,
                        cautions: 0,
                    };
                }
            }
            info
        };
        Control {
            packet,
            players: (self.robots().len() / 2) as u8,
            competition: match self.field_name() {
                "hsl-s" | "kid" => 0,
                "hsl-l" => 2,
                _ => 1,
            },
            stopped: false,
            phase: referee.phase,
            state: if hide { PlayState::Set } else { referee.state },
            set_play: referee.set_play,
            first_half: referee.half % 2 == 1,
            kicking: referee.kicking.map(|t| numbers[t]),
            remaining: seconds(referee.time_left),
            secondary: seconds(referee.secondary_time(time)),
            teams: [team(0), team(1)],
        }
    }

    /// What each player that is not sent off tells of itself.
    pub fn statuses(&self, numbers: [u8; 2]) -> Vec<Status> {
        let millimetres = |x: f64| (1000.0 * x) as f32;
        self.robots()
            .iter()
            .map(|robot| {
                let own = robot.beliefs.own.pose;
                let ball = robot.beliefs.ball;
                let local = own.local_from_outer(ball.position);
                Status {
                    player: robot.number,
                    team: numbers[robot.team],
                    fallen: matches!(robot.status, Body::Down { .. }),
                    pose: [millimetres(own.x), millimetres(own.y), own.heading as f32],
                    ball_age: if ball.is_known() { ball.age(self.time()) as f32 } else { -1.0 },
                    ball: local.map(millimetres),
                }
            })
            .collect()
    }

    /// Takes the official program's state of the game; from now on it judges and our referee does not.
    pub fn obey(&mut self, control: &Control, numbers: [u8; 2]) {
        let team_of = |number: u8| numbers.iter().position(|n| *n == number);
        let kicking = control.kicking.and_then(team_of);
        let time = self.time();
        self.with_court(|referee, court| {
            referee.led = true;
            let was = (referee.state, referee.set_play, referee.kicking);
            let now = (control.state, control.set_play, kicking);
            (referee.state, referee.set_play, referee.kicking) = now;
            referee.phase = control.phase;
            referee.time_left = f64::from(control.remaining);
            referee.half = match (control.phase, control.first_half) {
                (GamePhase::Extra, true) => 3,
                (GamePhase::Extra, false) => 4,
                (_, true) => 1,
                (_, false) => 2,
            };
            for info in &control.teams {
                let Some(team) = team_of(info.number) else { continue };
                referee.score[team] = u32::from(info.score);
                for i in 0..court.robots.len() {
                    let robot = &mut court.robots[i];
                    let player = info.players.get(usize::from(robot.number) - 1).filter(|_| robot.team == team);
                    let Some(player) = player else { continue };
                    match (player.penalty, robot.status) {
                        // Let back at once.
                        (0, Body::Removed { penalty, since, .. }) => {
                            robot.status = Body::Removed { penalty, since, until: time };
                        }
                        (n, Body::Active | Body::Down { .. }) if n != 0 => {
                            referee.send_off(court, i, penalty(n));
                            let forever = f64::INFINITY;
                            if let Body::Removed { until, .. } = &mut court.robots[i].status {
                                *until = forever;
                            }
                        }
                        _ => {}
                    }
                }
            }
            if was != now {
                referee.mark(time);
                let restart = control.set_play != SetPlay::None || matches!(control.state, PlayState::Ready);
                if restart {
                    referee.place_for(court, control.set_play, kicking);
                }
                if control.state == PlayState::Playing && was.0 == PlayState::Set {
                    referee.events.push(crate::Event { time, kind: EventKind::Whistle });
                }
            }
            if control.state == PlayState::Initial || control.state == PlayState::Finished {
                *court.ball = Ball { velocity: [0.0; 2], ..*court.ball };
            }
        });
    }

    fn field_name(&self) -> &str {
        &self.settings().field.name
    }
}

/// A pose of a status in the world, m and rad: for whoever draws what players say.
pub fn world_pose(status: &Status, team: Team) -> instep_field::Pose {
    let [x, y, heading] = status.pose.map(f64::from);
    side(team).pose(&instep_field::Pose::new(x / 1000.0, y / 1000.0, heading))
}
