//! The referee: clocks, restarts, goals and penalties by the rule book.
//!
//! What is simplified: teams do not change ends (the field is symmetric), the clock runs on in READY after a goal,
//! HL's and HSL's free kicks need no READY, holding is touching the ball without a break, and who pushes is judged by
//! who walks into an opponent that does not come. HSL drops nothing: a global stuck is a dropped ball here.

use arrayvec::ArrayVec;
use instep_behaviour::{GamePhase, GameState, Kicking, PlayState, SetPlay};
use instep_field::Field;

use crate::ball::{Ball, Whereabouts};
use crate::book::RuleBook;
use crate::robot::Robot;

mod event;
mod led;
mod offences;
mod shootout;

pub use event::{Event, EventKind, Penalty};

/// 0: Home, attacks +x; 1: Away.
pub type Team = usize;

/// Most robots of a game.
pub(crate) const MOST_ROBOTS: usize = 22;
/// A ball is in play once it has moved this far, m.
const IN_PLAY: f64 = 0.1;
/// Slack for who stands just at the line, m.
const SLACK: f64 = 0.1;
/// Before a half, s.
const INITIAL: f64 = 1.0;

/// What the referee looks at and may change.
pub(crate) struct Court<'a> {
    pub time: f64,
    pub dt: f64,
    pub field: &'a Field,
    pub ball: &'a mut Ball,
    pub robots: &'a mut Vec<Robot>,
    /// Robots that touched the ball in this step.
    pub touches: &'a [usize],
    /// Robots that met in this step.
    pub contacts: &'a [(usize, usize)],
    pub whereabouts: Whereabouts,
}

/// The referee of one game.
#[derive(Debug, Clone)]
pub struct Referee {
    book: RuleBook,
    knockout: bool,
    /// Part of the game.
    pub phase: GamePhase,
    /// State of play.
    pub state: PlayState,
    /// Restart that goes on.
    pub set_play: SetPlay,
    /// Who takes it.
    pub kicking: Option<Team>,
    /// From 1; 3 and 4 are extra time.
    pub half: u32,
    /// Of the half, s.
    pub time_left: f64,
    /// Goals.
    pub score: [u32; 2],
    /// Goals of the shoot-out.
    pub shootout: [u32; 2],
    /// The game is over.
    pub ended: bool,
    /// Everything that happened since it was last taken.
    pub events: Vec<Event>,
    /// The official GameController judges in our place.
    pub led: bool,
    first_kick_off: Team,
    since: f64,
    /// The clock has not started in this half.
    fresh: bool,
    spot: [f64; 2],
    deadline: f64,
    last_touch: Option<usize>,
    /// Took an indirect restart; nobody else has touched the ball since.
    indirect: Option<usize>,
    quiet_since: f64,
    anchor: [f64; 2],
    anchor_since: f64,
    holding: Option<(usize, f64, f64)>,
    encroaching: [f64; MOST_ROBOTS],
    pushing: [f64; MOST_ROBOTS],
    /// Shots of the shoot-out so far.
    pub(crate) shots: u32,
}

impl Referee {
    /// Before a game; `first` kicks off.
    pub fn new(book: RuleBook, knockout: bool, first: Team) -> Self {
        Self {
            book,
            knockout,
            phase: GamePhase::Normal,
            state: PlayState::Initial,
            set_play: SetPlay::None,
            kicking: Some(first),
            half: 1,
            time_left: book.rules.half_time,
            score: [0; 2],
            shootout: [0; 2],
            ended: false,
            events: Vec::new(),
            led: false,
            first_kick_off: first,
            since: 0.0,
            fresh: true,
            spot: [0.0; 2],
            deadline: 0.0,
            last_touch: None,
            indirect: None,
            quiet_since: 0.0,
            anchor: [0.0; 2],
            anchor_since: 0.0,
            holding: None,
            encroaching: [0.0; MOST_ROBOTS],
            pushing: [0.0; MOST_ROBOTS],
            shots: 0,
        }
    }

    /// The game as a team's player sees it.
    pub fn game_state(&self, team: Team, penalised: bool) -> GameState {
        GameState {
            phase: self.phase,
            state: self.state,
            set_play: self.set_play,
            kicking: match self.kicking {
                None => Kicking::Nobody,
                Some(t) if t == team => Kicking::Us,
                Some(_) => Kicking::Them,
            },
            time_left: self.time_left,
            score: if team == 0 { self.score } else { [self.score[1], self.score[0]] },
            penalised,
        }
    }

    /// Seconds that the present state, restart or READY still lasts.
    pub fn secondary_time(&self, time: f64) -> f64 {
        match self.state {
            PlayState::Ready => self.since + self.book.ready - time,
            PlayState::Playing if self.kicking.is_some() => self.deadline - time,
            _ => 0.0,
        }
        .max(0.0)
    }

    /// When the present state began, s.
    pub fn since(&self) -> f64 {
        self.since
    }

    /// The book that is judged by.
    pub fn book(&self) -> &RuleBook {
        &self.book
    }

    /// Where the last restart is taken, m.
    pub fn spot(&self) -> [f64; 2] {
        self.spot
    }

    fn tell(&mut self, time: f64, kind: EventKind) {
        self.events.push(Event { time, kind });
    }

    fn enter(&mut self, state: PlayState, time: f64) {
        (self.state, self.since) = (state, time);
    }

    pub(crate) fn update(&mut self, court: &mut Court) {
        if self.ended {
            return;
        }
        self.let_return(court);
        if self.led {
            return self.stop_outside(court);
        }
        let time = court.time;
        let running = match self.state {
            PlayState::Playing => true,
            PlayState::Ready | PlayState::Set => !self.fresh,
            _ => false,
        };
        if running && self.phase != GamePhase::Shootout {
            self.time_left -= court.dt;
        }
        match self.state {
            PlayState::Initial => {
                if time - self.since >= INITIAL {
                    self.kick_off(court, self.kicking.unwrap_or(self.first_kick_off));
                }
            }
            PlayState::Ready => {
                if time - self.since >= self.book.ready {
                    self.set(court);
                }
            }
            PlayState::Set => {
                self.judge_motion_in_set(court);
                if time - self.since >= self.book.set {
                    self.whistle(court);
                }
            }
            PlayState::Playing => self.play(court),
            PlayState::Finished => {}
        }
        let shot_runs = self.set_play == SetPlay::PenaltyKick;
        if self.time_left <= 0.0 && self.state != PlayState::Initial && !shot_runs && self.phase != GamePhase::Shootout
        {
            self.end_half(court);
        }
    }

    /// READY for a kick-off.
    pub(crate) fn kick_off(&mut self, court: &mut Court, team: Team) {
        self.restart(court, SetPlay::None, team, [0.0; 2]);
        self.enter(PlayState::Ready, court.time);
        self.tell(court.time, EventKind::KickOff { team });
    }

    /// The ball to its spot, for `team`.
    fn restart(&mut self, court: &mut Court, set_play: SetPlay, team: Team, spot: [f64; 2]) {
        (self.set_play, self.kicking, self.spot) = (set_play, Some(team), spot);
        *court.ball = Ball { position: spot, velocity: [0.0; 2] };
        (self.indirect, self.last_touch, self.holding) = (None, None, None);
        (self.anchor, self.anchor_since, self.quiet_since) = (spot, court.time, court.time);
        (self.encroaching, self.pushing) = ([0.0; MOST_ROBOTS], [0.0; MOST_ROBOTS]);
    }

    pub(crate) fn set(&mut self, court: &mut Court) {
        self.enter(PlayState::Set, court.time);
        *court.ball = Ball { position: self.spot, velocity: [0.0; 2] };
        if self.phase == GamePhase::Shootout {
            return;
        }
        for i in 0..court.robots.len() {
            if court.robots[i].is_active() && !self.may_stand(court.field, &court.robots[i]) {
                self.send_off(court, i, Penalty::IllegalPositioning);
            }
        }
    }

    /// Whether a robot stands where the restart lets it stand, before the whistle.
    fn may_stand(&self, field: &Field, robot: &Robot) -> bool {
        let sign = if robot.team == 0 { 1.0 } else { -1.0 };
        let (x, y) = (sign * robot.pose.x, sign * robot.pose.y);
        let attacks = self.kicking == Some(robot.team);
        if self.set_play == SetPlay::PenaltyKick {
            let taker = attacks && (self.spot[0] - robot.pose.x).hypot(self.spot[1] - robot.pose.y) < 1.5;
            let keeper = !attacks && x < -field.length / 2.0 + 0.6;
            return taker || keeper || !in_penalty_area(field, robot.pose.position(), self.spot[0] > 0.0);
        }
        let own_half =
            x < SLACK && x > -field.length / 2.0 - field.border && y.abs() < field.width / 2.0 + field.border;
        own_half && (attacks || x.hypot(y) > field.circle_radius - SLACK)
    }

    pub(crate) fn whistle(&mut self, court: &mut Court) {
        self.fresh = false;
        self.enter(PlayState::Playing, court.time);
        self.deadline = court.time
            + match (self.phase, self.set_play) {
                (GamePhase::Shootout, _) => self.book.shot_time,
                (_, SetPlay::PenaltyKick) => self.book.rules.penalty_kick.unwrap_or(60.0),
                _ => self.book.rules.ball_free_after,
            };
        (self.quiet_since, self.anchor_since) = (court.time, court.time);
        self.tell(court.time, EventKind::Whistle);
    }

    fn play(&mut self, court: &mut Court) {
        self.judge_touches(court);
        if self.phase == GamePhase::Shootout {
            return self.judge_shot(court);
        }
        if self.kicking.is_some() && court.time > self.deadline {
            (self.kicking, self.set_play) = (None, SetPlay::None);
            self.tell(court.time, EventKind::BallFree);
        }
        match court.whereabouts {
            Whereabouts::Inside => {}
            Whereabouts::Goal(end) => return self.goal(court, end),
            Whereabouts::GoalLine(end) => return self.over_goal_line(court, end),
            Whereabouts::TouchLine => return self.over_touch_line(court),
        }
        self.judge_positions(court);
        self.judge_holding(court);
        self.judge_pushing(court);
        self.judge_stuck(court);
        self.judge_absent(court);
    }

    fn judge_touches(&mut self, court: &mut Court) {
        for &i in court.touches {
            let team = court.robots[i].team;
            match self.kicking {
                Some(taker) if taker != team && self.phase != GamePhase::Shootout => {
                    // Not theirs yet.
                    self.send_off(court, i, Penalty::IllegalPositioning);
                    *court.ball = Ball { position: self.spot, velocity: [0.0; 2] };
                    continue;
                }
                _ => {}
            }
            (self.last_touch, self.quiet_since) = (Some(i), court.time);
            if self.indirect.is_some_and(|first| first != i) {
                self.indirect = None;
            }
        }
        let moved = distance(court.ball.position, self.spot);
        if let (Some(taker), Some(first)) = (self.kicking, self.last_touch)
            && moved > IN_PLAY
            && court.robots[first].team == taker
        {
            let direct = self.book.rules.direct_goal_from_kick_off;
            let indirect = match self.set_play {
                SetPlay::None => !direct,
                SetPlay::ThrowIn | SetPlay::IndirectFreeKick => true,
                _ => false,
            };
            self.indirect = indirect.then_some(first);
            (self.kicking, self.set_play) = (None, SetPlay::None);
            self.tell(court.time, EventKind::InPlay);
        }
    }

    fn goal(&mut self, court: &mut Court, end: i8) {
        let scorer = usize::from(end < 0);
        let by = self.indirect.map(|first| court.robots[first].team);
        if by.is_some() {
            self.tell(court.time, EventKind::GoalRefused { team: by.unwrap_or(scorer) });
            return self.over_goal_line(court, end);
        }
        self.score[scorer] += 1;
        self.tell(court.time, EventKind::Goal { team: scorer });
        let lead = self.score[0].abs_diff(self.score[1]);
        if self.book.mercy.is_some_and(|mercy| lead >= mercy) {
            return self.end(court);
        }
        self.kick_off(court, 1 - scorer);
    }

    fn over_goal_line(&mut self, court: &mut Court, end: i8) {
        let defender = usize::from(end > 0);
        let by_defender = self.last_touch.is_some_and(|i| court.robots[i].team == defender);
        let field = court.field;
        let sign = f64::from(end);
        let side = if court.ball.position[1] >= 0.0 { 1.0 } else { -1.0 };
        if by_defender {
            let spot = [sign * field.length / 2.0, side * field.width / 2.0];
            self.set_play(court, SetPlay::CornerKick, 1 - defender, spot);
        } else {
            let spot = [sign * (field.length / 2.0 - field.goal_area.length), side * field.goal_area.width / 2.0];
            self.set_play(court, SetPlay::GoalKick, defender, spot);
        }
    }

    fn over_touch_line(&mut self, court: &mut Court) {
        let field = court.field;
        // A ball that nobody has touched goes to the defenders of that half.
        let by = self.last_touch.map_or(usize::from(court.ball.position[0] < 0.0), |i| court.robots[i].team);
        let x = court.ball.position[0].clamp(-field.length / 2.0, field.length / 2.0);
        let spot = [x, field.width / 2.0 * court.ball.position[1].signum()];
        self.set_play(court, SetPlay::ThrowIn, 1 - by, spot);
    }

    /// Of a scenario: who touched the ball last.
    pub(crate) fn touched_by(&mut self, robot: Option<usize>) {
        self.last_touch = robot;
    }

    /// Of a scenario: the ball has been here since now.
    pub(crate) fn anchor_at(&mut self, time: f64, place: [f64; 2]) {
        (self.anchor, self.anchor_since) = (place, time);
    }

    /// A restart in play: no READY.
    pub(crate) fn set_play(&mut self, court: &mut Court, set_play: SetPlay, team: Team, spot: [f64; 2]) {
        self.restart(court, set_play, team, spot);
        self.enter(PlayState::Playing, court.time);
        self.deadline = court.time + self.book.set_play;
        self.tell(court.time, EventKind::Restart { set_play, team });
    }

    /// A penalty kick: READY first.
    pub(crate) fn penalty_kick(&mut self, court: &mut Court, team: Team) {
        let sign = if team == 0 { 1.0 } else { -1.0 };
        let spot = [sign * (court.field.length / 2.0 - court.field.penalty_mark), 0.0];
        self.restart(court, SetPlay::PenaltyKick, team, spot);
        self.enter(PlayState::Ready, court.time);
        self.tell(court.time, EventKind::Restart { set_play: SetPlay::PenaltyKick, team });
    }

    fn end_half(&mut self, court: &mut Court) {
        self.tell(court.time, EventKind::HalfEnd { half: self.half });
        let tie = self.score[0] == self.score[1];
        let second = 1 - self.first_kick_off;
        match (self.half, self.knockout && tie, self.book.extra_half) {
            (1, ..) => self.next_half(court, self.book.rules.half_time, second),
            (2, true, Some(length)) => {
                self.phase = GamePhase::Extra;
                self.next_half(court, length, self.first_kick_off);
            }
            (3, _, Some(length)) => self.next_half(court, length, second),
            (_, true, _) => self.start_shootout(court),
            _ => self.end(court),
        }
    }

    fn next_half(&mut self, court: &mut Court, length: f64, kicks: Team) {
        self.half += 1;
        (self.time_left, self.fresh, self.kicking) = (length, true, Some(kicks));
        (self.set_play, self.indirect) = (SetPlay::None, None);
        *court.ball = Ball::default();
        self.enter(PlayState::Initial, court.time);
    }

    fn end(&mut self, court: &mut Court) {
        self.ended = true;
        court.ball.velocity = [0.0; 2];
        self.enter(PlayState::Finished, court.time);
        self.tell(court.time, EventKind::End);
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// In the penalty area (goal area where there is none) at +x or -x.
fn in_penalty_area(field: &Field, place: [f64; 2], positive: bool) -> bool {
    let area = field.penalty_area.unwrap_or(field.goal_area);
    let x = if positive { place[0] } else { -place[0] };
    x > field.length / 2.0 - area.length && x < field.length / 2.0 + 0.5 && place[1].abs() < area.width / 2.0
}

/// Indices of the robots that touch the ball: at most all.
pub(crate) type Touches = ArrayVec<usize, 64>;
