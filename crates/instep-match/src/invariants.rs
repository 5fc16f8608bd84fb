//! What holds in every step of every game, whoever plays and by whatever book; a game that breaks it is a fault of ours.
//!
//! One ball that is where a ball can be; players on the field or sent off; scores that change only by goals, one at a
//! time; clocks that never go back. [`crate::Match`] looks after each step (a few comparisons a robot) and keeps the first
//! breach; [`crate::series`] answers it with an error. A game that the official GameController leads is not watched: its
//! clocks and scores are that program's.

use instep_behaviour::{GamePhase, PlayState};
use instep_field::Field;

use crate::ball::Ball;
use crate::referee::{Event, EventKind, Referee, Team};
use crate::robot::{Robot, Status};

/// No ball of the simulator is faster, m/s.
const FASTEST_BALL: f64 = 40.0;
/// Beyond the field's border: a robot that was pushed there in this step, m.
const PUSHED: f64 = 0.5;
/// Rounding of sums of steps, s.
const ROUNDING: f64 = 1e-6;

/// An invariant that does not hold.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Breach {
    /// The ball.
    #[error("the ball is at ({x}, {y}) m with {speed} m/s")]
    Ball {
        /// m.
        x: f64,
        /// m.
        y: f64,
        /// m/s.
        speed: f64,
    },
    /// A player that neither is on the field nor sent off.
    #[error("player {number} of team {team} plays at ({x}, {y}) m")]
    Player {
        /// Team.
        team: Team,
        /// Number.
        number: u8,
        /// m.
        x: f64,
        /// m.
        y: f64,
    },
    /// Somebody is missing, or there twice.
    #[error("there are {found} players, {expected} began")]
    Players {
        /// How many different ones.
        found: usize,
        /// How many there must be.
        expected: usize,
    },
    /// Goals from nowhere.
    #[error("the score went from {from:?} to {to:?} by {goals:?} goals")]
    Score {
        /// Before.
        from: [u32; 2],
        /// Now.
        to: [u32; 2],
        /// Goals that the referee told of.
        goals: [u32; 2],
    },
    /// The game's own time.
    #[error("the time went from {from} to {to} s")]
    Time {
        /// s.
        from: f64,
        /// s.
        to: f64,
    },
    /// The clock of a half, or the order of halves and parts.
    #[error("the clock went from {from} s left of half {half_from} to {to} s left of half {half_to}")]
    Clock {
        /// s.
        from: f64,
        /// s.
        to: f64,
        /// Half before.
        half_from: u32,
        /// Half now.
        half_to: u32,
    },
}

/// What was so after the step before.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Watch {
    time: f64,
    left: f64,
    half: u32,
    part: u8,
    ended: bool,
    goals: [u32; 2],
    shots: [u32; 2],
    players: usize,
}

impl Watch {
    pub(crate) fn new(referee: &Referee, players: usize) -> Self {
        Self {
            time: 0.0,
            left: referee.time_left,
            half: referee.half,
            part: part(referee.phase),
            ended: false,
            goals: referee.score,
            shots: referee.shootout,
            players,
        }
    }

    /// Compares with the step before; `events` are this step's.
    pub(crate) fn look(
        &mut self,
        time: f64,
        field: &Field,
        ball: &Ball,
        robots: &[Robot],
        referee: &Referee,
        events: &[Event],
    ) -> Result<(), Breach> {
        let before = *self;
        *self = Self {
            time,
            left: referee.time_left,
            half: referee.half,
            part: part(referee.phase),
            ended: referee.ended,
            goals: referee.score,
            shots: referee.shootout,
            players: before.players,
        };
        self.look_at_ball(field, ball)?;
        self.look_at_players(field, robots)?;
        self.look_at_scores(&before, events)?;
        self.look_at_clocks(&before, referee)
    }

    fn look_at_ball(&self, field: &Field, ball: &Ball) -> Result<(), Breach> {
        let ([x, y], speed) = (ball.position, ball.speed());
        // Written so that no number at all breaks it too.
        if field.contains(ball.position, field.border) && speed <= FASTEST_BALL {
            return Ok(());
        }
        Err(Breach::Ball { x, y, speed })
    }

    fn look_at_players(&self, field: &Field, robots: &[Robot]) -> Result<(), Breach> {
        let mut seen = [0u32; 2];
        for robot in robots {
            if let Some(numbers) = seen.get_mut(robot.team) {
                *numbers |= 1 << robot.number;
            }
            let place = robot.pose.position();
            let finite = place.iter().chain(&robot.velocity).all(|x| x.is_finite()) && robot.pose.heading.is_finite();
            let off = matches!(robot.status, Status::Removed { .. });
            if !(finite && (off || field.contains(place, field.border + PUSHED))) {
                let [x, y] = place;
                return Err(Breach::Player { team: robot.team, number: robot.number, x, y });
            }
        }
        let found = seen.iter().map(|numbers| numbers.count_ones() as usize).sum();
        if found != self.players || robots.len() != self.players {
            return Err(Breach::Players { found, expected: self.players });
        }
        Ok(())
    }

    fn look_at_scores(&self, before: &Self, events: &[Event]) -> Result<(), Breach> {
        let (mut goals, mut shots) = ([0; 2], [0; 2]);
        for event in events {
            match event.kind {
                EventKind::Goal { team } => goals[team] += 1,
                EventKind::Shot { team, scored: true } => shots[team] += 1,
                _ => {}
            }
        }
        for (from, to, told) in [(before.goals, self.goals, goals), (before.shots, self.shots, shots)] {
            let so = |team: usize| from[team].checked_add(told[team]) == Some(to[team]);
            if !(so(0) && so(1) && told[0] + told[1] <= 1) {
                return Err(Breach::Score { from, to, goals: told });
            }
        }
        Ok(())
    }

    fn look_at_clocks(&self, before: &Self, referee: &Referee) -> Result<(), Breach> {
        let step = self.time - before.time;
        // A step of nothing is no step; a game that is over stays over.
        if !(step > 0.0 && (self.ended || !before.ended)) {
            return Err(Breach::Time { from: before.time, to: self.time });
        }
        let onward = match self.half - before.half.min(self.half) {
            0 => {
                let ran = before.left - self.left;
                let shootout = self.part == part(GamePhase::Shootout);
                self.half == before.half && ((-ROUNDING..=step + ROUNDING).contains(&ran) || shootout)
            }
            // The next half begins with a whole clock that stands.
            1 => self.left > 0.0 && referee.state == PlayState::Initial,
            _ => false,
        };
        if onward && self.part >= before.part {
            return Ok(());
        }
        Err(Breach::Clock { from: before.left, to: self.left, half_from: before.half, half_to: self.half })
    }
}

/// Parts of a game in their order; a time-out is no part.
fn part(phase: GamePhase) -> u8 {
    match phase {
        GamePhase::Normal | GamePhase::Timeout => 0,
        GamePhase::Extra => 1,
        GamePhase::Shootout => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RuleBook;

    /// A step of 20 ms in which `change` happens.
    fn step(change: impl FnOnce(&mut Ball, &mut Referee, &mut Vec<Event>, &mut f64)) -> Result<(), Breach> {
        let field = Field::named("hsl-m").unwrap();
        let mut referee = Referee::new(RuleBook::for_field("hsl-m"), true, 0);
        referee.state = PlayState::Playing;
        let mut watch = Watch::new(&referee, 0);
        watch.look(1.0, &field, &Ball::default(), &[], &referee, &[]).unwrap();
        let (mut ball, mut events, mut time) = (Ball::default(), Vec::new(), 1.02);
        referee.time_left -= 0.02;
        change(&mut ball, &mut referee, &mut events, &mut time);
        watch.look(time, &field, &ball, &[], &referee, &events)
    }

    fn goal(team: Team) -> Event {
        Event { time: 1.02, kind: EventKind::Goal { team } }
    }

    #[test]
    fn what_may_be_breaks_nothing() {
        step(|_, _, _, _| ()).unwrap();
        step(|_, referee, events, _| {
            referee.score[1] += 1;
            events.push(goal(1));
        })
        .unwrap();
        step(|_, referee, _, _| {
            (referee.half, referee.time_left, referee.state) = (2, 600.0, PlayState::Initial);
        })
        .unwrap();
    }

    #[test]
    fn each_breach_is_seen() {
        let ball = |x, v| step(|ball, _, _, _| *ball = Ball { position: [x, 0.0], velocity: [v, 0.0] });
        for broken in [ball(f64::NAN, 0.0), ball(9.0, 0.0), ball(0.0, f64::INFINITY), ball(0.0, 50.0)] {
            assert!(matches!(broken, Err(Breach::Ball { .. })), "{broken:?}");
        }
        for broken in [
            step(|_, referee, _, _| referee.score[0] += 1),
            step(|_, _, events, _| events.push(goal(0))),
            step(|_, referee, events, _| {
                referee.score[0] += 1;
                events.push(goal(1));
            }),
            step(|_, referee, events, _| {
                referee.score[0] += 2;
                events.extend([goal(0), goal(0)]);
            }),
            step(|_, referee, _, _| referee.shootout[0] += 1),
        ] {
            assert!(matches!(broken, Err(Breach::Score { .. })), "{broken:?}");
        }
        for broken in [
            step(|_, referee, _, _| referee.time_left += 1.0),
            step(|_, referee, _, _| referee.time_left -= 1.0),
            step(|_, referee, _, _| (referee.half, referee.time_left) = (2, 600.0)),
            step(|_, referee, _, _| (referee.half, referee.time_left) = (3, 300.0)),
            step(|_, referee, _, _| referee.half = 0),
        ] {
            assert!(matches!(broken, Err(Breach::Clock { .. })), "{broken:?}");
        }
        for broken in [step(|_, _, _, time| *time = 1.0), step(|_, _, _, time| *time = f64::NAN)] {
            assert!(matches!(broken, Err(Breach::Time { .. })), "{broken:?}");
        }
    }

    #[test]
    fn a_missing_player_and_one_outside_are_seen() {
        let field = Field::named("hsl-m").unwrap();
        let strategy = std::sync::Arc::new(instep_behaviour::Strategy::default());
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../kicks/kicks.toml");
        let kicks = std::sync::Arc::new(instep_behaviour::KickTable::load(&file).unwrap());
        let shared = std::sync::Arc::new(field.clone());
        let head = instep_behaviour::Player::new(shared, strategy, kicks).unwrap();
        let robot = |team, x| Robot::new(team, 1, instep_field::Pose::new(x, 0.0, 0.0), head.clone());
        let referee = Referee::new(RuleBook::for_field("hsl-m"), true, 0);
        let look =
            |robots: &[Robot]| Watch::new(&referee, 2).look(0.02, &field, &Ball::default(), robots, &referee, &[]);
        look(&[robot(0, 0.0), robot(1, 0.0)]).unwrap();
        assert!(matches!(look(&[robot(0, 0.0)]), Err(Breach::Players { found: 1, expected: 2 })));
        assert!(matches!(look(&[robot(0, 0.0), robot(0, 1.0)]), Err(Breach::Players { .. })));
        assert!(matches!(look(&[robot(0, 9.0), robot(1, 0.0)]), Err(Breach::Player { .. })));
        let mut off = robot(0, 9.0);
        off.status = Status::Removed { penalty: crate::Penalty::Pushing, since: 0.0, until: 9.0 };
        look(&[off, robot(1, 0.0)]).unwrap();
    }
}
