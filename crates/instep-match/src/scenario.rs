//! A scenario of the rules: a situation as a file, what the referee must do about it and when, played as any game is.
//!
//! `scenarios/rules/` holds one for each restart, penalty and clock rule; `instep match --scenario FILE` shows one. Robots
//! that a scenario does not name take no part; those that it names stand, walk as it says, or play.

use std::path::Path;
use std::sync::Arc;

use instep_behaviour::SetPlay;
use instep_field::Pose;
use serde::Deserialize;

use crate::ball::Ball;
use crate::game::{Match, TeamSetup};
use crate::record::Recording;
use crate::referee::{EventKind, Penalty, Team};
use crate::robot::Status;
use crate::{MatchError, MatchSettings, RuleBook};

/// How exactly a place must be met, m: a ball that was placed may have rolled for one step.
const PLACE: f64 = 0.05;
/// Longest scenario, s.
const LONGEST: f64 = 3600.0;

/// A scenario as its file says it. Lengths in m, times in s; 0 is the team that attacks +x.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// The rule.
    pub title: String,
    /// A field's name: its league's rules.
    pub rules: String,
    /// How it begins.
    pub start: Start,
    /// Who takes the restart, or kicks off first.
    #[serde(default)]
    pub team: Team,
    /// A draw is followed by extra time and a shoot-out.
    #[serde(default)]
    pub knockout: bool,
    /// From 1.
    #[serde(default = "first_half")]
    pub half: u32,
    /// Of the half; absent: all of it.
    pub time_left: Option<f64>,
    /// Goals so far.
    #[serde(default)]
    pub score: [u32; 2],
    /// Shots of the shoot-out so far, and goals in it.
    #[serde(default)]
    pub shots: u32,
    /// See `shots`.
    #[serde(default)]
    pub shootout: [u32; 2],
    /// Chance that an attempt to get up succeeds; absent: the game's.
    pub get_up_chance: Option<f64>,
    /// How long it is played.
    pub seconds: f64,
    /// The ball; absent: where the restart puts it.
    pub ball: Option<BallStart>,
    /// Who takes part.
    #[serde(default)]
    pub robot: Vec<RobotStart>,
    /// What must happen, in this order.
    pub expect: Vec<Expected>,
    /// What must not happen.
    #[serde(default)]
    pub never: Vec<EventKind>,
}

/// How a scenario begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    /// Before the first READY.
    Initial,
    /// READY for a kick-off.
    Ready,
    /// SET for a kick-off.
    Set,
    /// The whistle of a kick-off.
    KickOff,
    /// Open play.
    Open,
    /// A restart at the ball.
    ThrowIn,
    /// A restart at the ball.
    CornerKick,
    /// A restart at the ball.
    GoalKick,
    /// A restart at the ball.
    DirectFreeKick,
    /// A restart at the ball.
    IndirectFreeKick,
    /// READY for a penalty kick.
    PenaltyKick,
    /// The whistle of a penalty kick.
    PenaltyWhistle,
    /// The first shot of the shoot-out.
    Shootout,
}

/// The ball at the start.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BallStart {
    /// m.
    pub position: [f64; 2],
    /// m/s.
    #[serde(default)]
    pub velocity: [f64; 2],
    /// Who touched it last: team and number.
    pub touched: Option<(Team, u8)>,
}

/// A robot at the start.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotStart {
    /// Team.
    pub team: Team,
    /// From 1; 1 keeps the goal.
    pub number: u8,
    /// x, y, heading, in m and degrees, in the world.
    pub pose: [f64; 3],
    /// Walks so all the time, in its own frame, m/s, m/s, rad/s.
    #[serde(default)]
    pub walk: [f64; 3],
    /// Decides itself instead.
    #[serde(default)]
    pub plays: bool,
    /// Lies on the ground, and tries to get up.
    #[serde(default)]
    pub fallen: bool,
    /// Lies on the ground, and does not try.
    #[serde(default)]
    pub lies: bool,
    /// Sendings-off so far.
    #[serde(default)]
    pub removals: u32,
}

/// What must happen.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expected {
    /// The event, with all that it tells.
    pub what: EventKind,
    /// Not before and not after, s from the start; absent: at any time.
    pub within: Option<[f64; 2]>,
    /// Where the ball is then.
    pub ball: Option<[f64; 2]>,
    /// Where the player is then that the event is about.
    pub place: Option<[f64; 2]>,
    /// The score then.
    pub score: Option<[u32; 2]>,
    /// Whose restart it is then.
    pub kicking: Option<Team>,
}

/// What came of one expectation.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// The expectation in words.
    pub what: String,
    /// When it came true, s.
    pub at: Option<f64>,
    /// What is wrong; `None`: it holds.
    pub fault: Option<String>,
}

fn first_half() -> u32 {
    1
}

impl Scenario {
    /// Reads a scenario's TOML file.
    ///
    /// # Errors
    /// [`MatchError::Scenario`] with file and line, or with file and the value that cannot be.
    pub fn load(path: &Path) -> Result<Self, MatchError> {
        let wrong = |detail: String| MatchError::Scenario { file: path.display().to_string(), detail };
        let text = std::fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
        let scenario: Self = toml::from_str(&text).map_err(|e| wrong(e.to_string()))?;
        scenario.validate().map_err(wrong)?;
        Ok(scenario)
    }

    fn validate(&self) -> Result<(), String> {
        let teams = self.robot.iter().map(|r| r.team).chain([self.team]);
        let touched = self.ball.iter().filter_map(|b| b.touched).map(|(team, _)| team);
        if let Some(team) = teams.chain(touched).find(|team| *team > 1) {
            return Err(format!("team: {team}; expected 0 or 1"));
        }
        if let Some(robot) = self.robot.iter().find(|r| !(1..=11).contains(&r.number)) {
            return Err(format!("robot.number: {}; expected 1 to 11", robot.number));
        }
        if !(0.0..=LONGEST).contains(&self.seconds) {
            return Err(format!("seconds: {}; expected 0 to {LONGEST}", self.seconds));
        }
        let numbers = self.robot.iter().flat_map(|r| r.pose.into_iter().chain(r.walk));
        let ball = self.ball.iter().flat_map(|b| b.position.into_iter().chain(b.velocity));
        let rest = self.time_left.into_iter().chain(self.get_up_chance);
        if let Some(value) = numbers.chain(ball).chain(rest).find(|x| !(x.abs() < 1e4)) {
            return Err(format!("{value}; expected a number"));
        }
        Ok(())
    }

    /// Plays it with both teams set up as `team`; the recording is the whole scenario.
    ///
    /// # Errors
    /// As [`MatchSettings::new`] and [`Match::new`].
    pub fn play(&self, team: &TeamSetup) -> Result<(Vec<Check>, Recording), MatchError> {
        self.play_by(team, |_| ())
    }

    /// The same by another book: tests change a number and see that the scenario tells.
    ///
    /// # Errors
    /// As [`Scenario::play`].
    pub fn play_by(
        &self,
        team: &TeamSetup,
        change: impl FnOnce(&mut RuleBook),
    ) -> Result<(Vec<Check>, Recording), MatchError> {
        let most = self.robot.iter().map(|r| usize::from(r.number)).max().unwrap_or(1);
        let mut settings = MatchSettings::new(&self.rules, Some(most))?;
        settings.knockout = self.knockout;
        change(&mut settings.book);
        if let Some(chance) = self.get_up_chance {
            settings.body.get_up_chance = chance;
        }
        let mut game = Match::new(Arc::new(settings), [team.clone(), team.clone()], self.team, 1)?;
        game.record();
        self.set_up(&mut game);
        let mut checks: Vec<Check> = Vec::new();
        let mut broken: Vec<Check> = Vec::new();
        let mut next = self.expect.iter().peekable();
        while game.time() < self.seconds && !game.referee().ended {
            game.step_and_tell(|game, event| {
                if let Some(expected) = next.next_if(|e| e.what == event.kind) {
                    checks.push(expected.check(game, event.time));
                }
                if self.never.contains(&event.kind) {
                    let fault = Some(format!("happened after {:.2} s", event.time));
                    broken.push(Check { what: format!("no {}", words(&event.kind)), at: Some(event.time), fault });
                }
            });
        }
        checks.extend(next.map(|expected| Check {
            what: words(&expected.what),
            at: None,
            fault: Some(format!("did not happen within {:.2} s", game.time())),
        }));
        checks.append(&mut broken);
        if let Some((time, breach)) = game.breach() {
            checks.push(Check { what: "invariants".to_owned(), at: Some(time), fault: Some(breach.to_string()) });
        }
        Ok((checks, game.take_recording().unwrap_or_default()))
    }

    /// The situation.
    fn set_up(&self, game: &mut Match) {
        let part = |robot: &crate::Robot| self.robot.iter().find(|r| r.team == robot.team && r.number == robot.number);
        let mut touched = None;
        for (i, robot) in game.robots_mut().iter_mut().enumerate() {
            let Some(start) = part(robot) else {
                robot.status = Status::Removed { penalty: Penalty::Substitute, since: -1e3, until: f64::INFINITY };
                continue;
            };
            let [x, y, heading] = start.pose;
            robot.place(Pose::new(x, y, heading.to_radians()));
            robot.removals = start.removals;
            robot.scripted = (!start.plays).then_some(start.walk);
            if start.fallen || start.lies {
                let up_at = if start.lies { f64::INFINITY } else { 5.0 };
                robot.status = Status::Down { since: 0.0, tries: 0, up_at };
            }
            if self.ball.and_then(|b| b.touched) == Some((robot.team, robot.number)) {
                touched = Some(i);
            }
        }
        let (team, spot) = (self.team, self.ball.map_or([0.0; 2], |b| b.position));
        game.with_court(|referee, court| {
            (referee.half, referee.score) = (self.half, self.score);
            (referee.shots, referee.shootout) = (self.shots, self.shootout);
            referee.time_left = self.time_left.unwrap_or(referee.time_left);
            let restart = match self.start {
                Start::Initial => return,
                Start::Ready => return referee.kick_off(court, team),
                Start::Set => {
                    referee.kick_off(court, team);
                    return referee.set(court);
                }
                Start::KickOff | Start::Open => {
                    referee.kick_off(court, team);
                    referee.whistle(court);
                    if self.start == Start::Open {
                        referee.kicking = None;
                    }
                    // These came before the scenario began.
                    referee.events.clear();
                    SetPlay::None
                }
                Start::PenaltyKick => return referee.penalty_kick(court, team),
                Start::PenaltyWhistle => {
                    referee.penalty_kick(court, team);
                    referee.whistle(court);
                    SetPlay::PenaltyKick
                }
                Start::Shootout => return referee.start_shootout(court),
                Start::ThrowIn => SetPlay::ThrowIn,
                Start::CornerKick => SetPlay::CornerKick,
                Start::GoalKick => SetPlay::GoalKick,
                Start::DirectFreeKick => SetPlay::DirectFreeKick,
                Start::IndirectFreeKick => SetPlay::IndirectFreeKick,
            };
            if !matches!(restart, SetPlay::None | SetPlay::PenaltyKick) {
                referee.set_play(court, restart, team, spot);
            }
            if let Some(ball) = &self.ball {
                *court.ball = Ball { position: ball.position, velocity: ball.velocity };
                if self.start == Start::Open {
                    referee.anchor_at(court.time, ball.position);
                }
            }
            referee.touched_by(touched);
        });
        game.begin_watch();
    }
}

impl Expected {
    /// What of it does not hold at its event.
    fn check(&self, game: &Match, time: f64) -> Check {
        let far = |wanted: [f64; 2], is: [f64; 2]| (wanted[0] - is[0]).hypot(wanted[1] - is[1]) > PLACE;
        let mut faults = Vec::new();
        if let Some([from, to]) = self.within
            && !(from..=to).contains(&time)
        {
            faults.push(format!("after {time:.2} s, expected {from} to {to} s"));
        }
        let ball = game.ball().position;
        if self.ball.is_some_and(|wanted| far(wanted, ball)) {
            faults.push(format!("ball at ({:.2}, {:.2})", ball[0], ball[1]));
        }
        let referee = game.referee();
        if self.score.is_some_and(|score| score != referee.score) {
            faults.push(format!("score {:?}", referee.score));
        }
        if self.kicking.is_some() && self.kicking != referee.kicking {
            faults.push(format!("restart of {:?}", referee.kicking));
        }
        let about = match self.what {
            EventKind::SentOff { team, number, .. }
            | EventKind::Returned { team, number }
            | EventKind::Fall { team, number }
            | EventKind::Kick { team, number } => Some((team, number)),
            _ => None,
        };
        if let (Some(wanted), Some((team, number))) = (self.place, about)
            && let Some(robot) = game.robots().iter().find(|r| r.team == team && r.number == number)
            && far(wanted, robot.pose.position())
        {
            faults.push(format!("player at ({:.2}, {:.2})", robot.pose.x, robot.pose.y));
        }
        let fault = (!faults.is_empty()).then(|| faults.join(", "));
        Check { what: words(&self.what), at: Some(time), fault }
    }
}

/// An event as `name key value, …`.
fn words(kind: &EventKind) -> String {
    let Ok(serde_json::Value::Object(map)) = serde_json::to_value(kind) else { return format!("{kind:?}") };
    let text = |v: &serde_json::Value| v.as_str().map_or_else(|| v.to_string(), str::to_owned);
    let name = map.get("event").map(text).unwrap_or_default();
    let rest = map.iter().filter(|(key, _)| *key != "event").map(|(key, value)| format!(" {key} {}", text(value)));
    let line: String = std::iter::once(name).chain(rest).collect();
    line.replace('_', " ")
}
