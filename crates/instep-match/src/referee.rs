//! The referee: clocks, restarts, goals and penalties by the rule book.
//!
//! What is simplified: teams do not change ends (the field is symmetric), the clock runs on in READY after a goal,
//! HL's and HSL's free kicks need no READY, holding is touching the ball without a break, and who pushes is judged by
//! who walks into an opponent that does not come. HSL drops nothing: a global stuck is a dropped ball here.

use arrayvec::ArrayVec;
use instep_behaviour::{GamePhase, GameState, Kicking, PlayState, SetPlay};
use instep_field::{Field, Pose};
use serde::Serialize;

use crate::ball::{Ball, Whereabouts};
use crate::book::RuleBook;
use crate::robot::{CARRY_OFF, Robot, Status};

/// 0: Home, attacks +x; 1: Away.
pub type Team = usize;

/// Most robots of a game.
pub(crate) const MOST_ROBOTS: usize = 22;
/// A ball is in play once it has moved this far, m.
const IN_PLAY: f64 = 0.1;
/// Slack for who stands just at the line, m.
const SLACK: f64 = 0.1;
/// The ball has not moved while within this of where it was, m.
const PROGRESS: f64 = 0.5;
/// Near the ball, for a local stuck, m.
const NEAR_BALL: f64 = 1.0;
/// Both nearer to the ball than this: a fight for the ball, no pushing, m.
const FIGHT: f64 = 0.7;
/// Slower is no motion in SET, m/s; and a moment to stop, s.
const QUIET: f64 = 0.15;
const QUIET_AFTER: f64 = 1.0;
/// A touch is held on over gaps up to this, s.
const HOLD_GAP: f64 = 0.2;
/// Before a half, s.
const INITIAL: f64 = 1.0;

/// What somebody is sent off for; the numbers are the GameController's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
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
    shots: u32,
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

    fn set(&mut self, court: &mut Court) {
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

    fn judge_motion_in_set(&mut self, court: &mut Court) {
        if court.time - self.since < QUIET_AFTER || self.book.rules.removal.is_none() {
            return;
        }
        for i in 0..court.robots.len() {
            let robot = &court.robots[i];
            if robot.is_active() && robot.velocity[0].hypot(robot.velocity[1]) > QUIET {
                self.send_off(court, i, Penalty::MotionInSet);
            }
        }
    }

    fn whistle(&mut self, court: &mut Court) {
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

    /// Opponents too near to a restart.
    fn judge_positions(&mut self, court: &mut Court) {
        let Some(taker) = self.kicking else { return };
        let field = court.field;
        let kick_off = self.set_play == SetPlay::None;
        let grace = if kick_off { 2.0 } else { self.book.clear };
        for i in 0..court.robots.len() {
            let robot = &court.robots[i];
            if robot.team == taker || !robot.is_active() {
                continue;
            }
            let place = robot.pose.position();
            let keeper_at_penalty = self.set_play == SetPlay::PenaltyKick
                && (place[0] - self.spot[0].signum() * field.length / 2.0).abs() < 1.0;
            let near = distance(place, self.spot) < field.circle_radius - SLACK && !keeper_at_penalty;
            let inside = self.set_play == SetPlay::GoalKick && in_penalty_area(field, place, self.spot[0] > 0.0);
            self.encroaching[i] = if near || inside { self.encroaching[i] + court.dt } else { 0.0 };
            if self.encroaching[i] > grace {
                self.encroaching[i] = 0.0;
                self.send_off(court, i, Penalty::IllegalPositioning);
            }
        }
    }

    fn judge_holding(&mut self, court: &mut Court) {
        let time = court.time;
        self.holding = match (self.holding, court.touches.first()) {
            (Some((holder, since, _)), Some(_)) if court.touches.contains(&holder) => Some((holder, since, time)),
            (Some((holder, since, last)), _) if time - last < HOLD_GAP => Some((holder, since, last)),
            (_, Some(&i)) => Some((i, time, time)),
            (_, None) => None,
        };
        let Some((holder, since, _)) = self.holding else { return };
        let robot = &court.robots[holder];
        let keeper = robot.number == 1 && in_penalty_area(court.field, robot.pose.position(), robot.team == 1);
        if robot.is_active() && time - since > self.book.holding[usize::from(keeper)] {
            self.holding = None;
            self.send_off(court, holder, Penalty::BallHolding);
        }
    }

    fn judge_pushing(&mut self, court: &mut Court) {
        for push in &mut self.pushing {
            *push = (*push - 0.5 * court.dt).max(0.0);
        }
        for &(i, j) in court.contacts {
            let (a, b) = (&court.robots[i], &court.robots[j]);
            let fight = distance(a.pose.position(), court.ball.position) < FIGHT
                && distance(b.pose.position(), court.ball.position) < FIGHT;
            if a.team == b.team || !a.is_active() || !b.is_active() || fight {
                continue;
            }
            let (into_b, into_a) = (wants_into(a, b), wants_into(b, a));
            let (pusher, victim) = match (into_b > 0.2, into_a > 0.2) {
                (true, false) if into_a < 0.05 => (i, j),
                (false, true) if into_b < 0.05 => (j, i),
                _ => continue,
            };
            self.pushing[pusher] += 1.5 * court.dt;
            if self.pushing[pusher] > self.book.pushing {
                self.pushing[pusher] = 0.0;
                return self.punish_push(court, pusher, victim);
            }
        }
    }

    fn punish_push(&mut self, court: &mut Court, pusher: usize, victim: usize) {
        let team = court.robots[victim].team;
        let place = court.robots[victim].pose.position();
        self.send_off(court, pusher, Penalty::Pushing);
        if self.kicking.is_some() {
            // The restart goes on.
            return;
        }
        let own_area = in_penalty_area(court.field, place, team == 0);
        if own_area {
            return self.penalty_kick(court, team);
        }
        let (x, y) = (court.field.length / 2.0 - 0.5, court.field.width / 2.0 - 0.5);
        let spot = [place[0].clamp(-x, x), place[1].clamp(-y, y)];
        self.set_play(court, SetPlay::DirectFreeKick, team, spot);
    }

    fn judge_stuck(&mut self, court: &mut Court) {
        let time = court.time;
        if distance(court.ball.position, self.anchor) > PROGRESS || self.kicking.is_some() {
            (self.anchor, self.anchor_since) = (court.ball.position, time);
        }
        let near = |team: Team| {
            court
                .robots
                .iter()
                .enumerate()
                .filter(|(_, r)| r.is_active() && r.team == team)
                .map(|(i, r)| (distance(r.pose.position(), court.ball.position), i))
                .filter(|(d, _)| *d < NEAR_BALL)
                .min_by(|a, b| a.0.total_cmp(&b.0))
        };
        if time - self.anchor_since > self.book.stuck_local
            && let (Some(a), Some(b)) = (near(0), near(1))
        {
            self.anchor_since = time;
            let nearer = if a.0 <= b.0 { a.1 } else { b.1 };
            self.send_off(court, nearer, Penalty::LocalGameStuck);
        }
        if time - self.quiet_since > self.book.stuck_global && self.kicking.is_none() {
            *court.ball = Ball::default();
            (self.quiet_since, self.last_touch, self.indirect) = (time, None, None);
            (self.anchor, self.anchor_since) = ([0.0; 2], time);
            self.tell(time, EventKind::DroppedBall);
        }
    }

    /// Who left the field or does not get up.
    fn judge_absent(&mut self, court: &mut Court) {
        for i in 0..court.robots.len() {
            let robot = &court.robots[i];
            match robot.status {
                Status::Active => {
                    if !court.field.contains(robot.pose.position(), court.field.border) {
                        self.send_off(court, i, Penalty::LeavingTheField);
                    }
                }
                Status::Down { since, tries, .. } => {
                    let most = self.book.rules.get_up_tries.unwrap_or(usize::MAX);
                    if court.time - since > self.book.incapable || tries as usize >= most {
                        self.send_off(court, i, Penalty::IncapableRobot);
                    }
                }
                Status::Removed { .. } => {}
            }
        }
    }

    pub(crate) fn send_off(&mut self, court: &mut Court, i: usize, penalty: Penalty) {
        let robot = &mut court.robots[i];
        if matches!(robot.status, Status::Removed { .. }) {
            return;
        }
        let until = court.time + self.book.sent_off + self.book.repeat * f64::from(robot.removals);
        robot.removals += 1;
        robot.status = Status::Removed { penalty, since: court.time, until };
        (robot.velocity, robot.command, robot.swing) = ([0.0; 3], [0.0; 3], None);
        let (team, number) = (robot.team, robot.number);
        self.tell(court.time, EventKind::SentOff { team, number, penalty });
    }

    /// Those whose time is over come back at their half's touch line, away from the ball; carried-off ones wait outside.
    fn let_return(&mut self, court: &mut Court) {
        for i in 0..court.robots.len() {
            let Status::Removed { since, until, .. } = court.robots[i].status else { continue };
            let field = court.field;
            let side = if court.ball.position[1] > 0.0 { -1.0 } else { 1.0 };
            let robot = &mut court.robots[i];
            let x = -0.25 * field.length * if robot.team == 0 { 1.0 } else { -1.0 };
            if court.time >= until && self.state != PlayState::Set {
                let y = side * (field.width / 2.0 + 0.2);
                // Nobody appears in another robot.
                let place = (0..8)
                    .map(|k| [x + 0.7 * f64::from(k % 4) * x.signum(), y + 0.5 * side * f64::from(k / 4)])
                    .find(|p| {
                        !court.robots.iter().enumerate().any(|(j, r)| j != i && distance(r.pose.position(), *p) < 0.6)
                    });
                let Some([x, y]) = place else { continue };
                let robot = &mut court.robots[i];
                robot.place(Pose::new(x, y, -side * std::f64::consts::FRAC_PI_2));
                robot.status = Status::Active;
                let (team, number) = (robot.team, robot.number);
                self.tell(court.time, EventKind::Returned { team, number });
            } else if court.time - since >= CARRY_OFF {
                // Benches: beside the field, one place each.
                let y = -(field.width / 2.0 + field.border + 1.0);
                let place = x.signum() * (1.0 + 0.6 * f64::from(robot.number));
                robot.place(Pose::new(place, y, std::f64::consts::FRAC_PI_2));
            }
        }
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

    fn start_shootout(&mut self, court: &mut Court) {
        self.phase = GamePhase::Shootout;
        (self.shots, self.time_left) = (0, 0.0);
        self.next_shot(court);
    }

    fn next_shot(&mut self, court: &mut Court) {
        let team = (self.first_kick_off + self.shots as usize) % 2;
        self.penalty_kick(court, team);
        let sign = if team == 0 { 1.0 } else { -1.0 };
        let players = court.robots.len() / 2;
        // Who shoots: number 2, or 1 where there is no other.
        for robot in court.robots.iter_mut() {
            let shooter = robot.team == team && robot.number == 2;
            let alone = robot.team == team && robot.number == 1 && players == 1;
            let keeper = robot.team != team && robot.number == 1;
            if shooter || alone {
                robot.status = Status::Active;
                let heading = if sign > 0.0 { 0.0 } else { std::f64::consts::PI };
                robot.place(Pose::new(self.spot[0] - 0.8 * sign, 0.0, heading));
            } else if keeper {
                robot.status = Status::Active;
                let heading = if sign > 0.0 { std::f64::consts::PI } else { 0.0 };
                robot.place(Pose::new(sign * (court.field.length / 2.0 - 0.1), 0.0, heading));
            } else {
                let penalty = Penalty::Substitute;
                robot.status = Status::Removed { penalty, since: court.time - CARRY_OFF, until: f64::INFINITY };
            }
        }
        self.set(court);
    }

    fn judge_shot(&mut self, court: &mut Court) {
        let shooter = (self.first_kick_off + self.shots as usize) % 2;
        let toward = if shooter == 0 { 1 } else { -1 };
        let over = match court.whereabouts {
            Whereabouts::Goal(end) => Some(end == toward),
            Whereabouts::GoalLine(_) | Whereabouts::TouchLine => Some(false),
            Whereabouts::Inside => {
                let stopped =
                    self.kicking.is_none() && court.ball.speed() < 0.02 && court.time - self.quiet_since > 1.0;
                (stopped || court.time > self.deadline).then_some(false)
            }
        };
        let Some(scored) = over else { return };
        self.shootout[shooter] += u32::from(scored);
        self.tell(court.time, EventKind::Shot { team: shooter, scored });
        self.shots += 1;
        let [a, b] = self.shootout;
        let (round_over, regular) = (self.shots.is_multiple_of(2), 2 * self.book.shots);
        let left = (regular.saturating_sub(self.shots)).div_ceil(2);
        let decided = self.shots < regular && a.abs_diff(b) > left;
        let sudden = self.shots >= regular && round_over && a != b;
        // A shoot-out that nobody wins is drawn by lot elsewhere; here it stays a draw.
        if decided || sudden || self.shots >= 2 * regular {
            return self.end(court);
        }
        self.next_shot(court);
    }

    /// Led by the official program: a ball that is out stays where it went out.
    fn stop_outside(&mut self, court: &mut Court) {
        for &i in court.touches {
            self.last_touch = Some(i);
        }
        if court.whereabouts != Whereabouts::Inside {
            court.ball.velocity = [0.0; 2];
            let (x, y) = (court.field.length / 2.0, court.field.width / 2.0);
            let p = court.ball.position;
            self.spot = [p[0].clamp(-x, x), p[1].clamp(-y, y)];
        }
    }

    /// The official program has changed the state.
    pub(crate) fn mark(&mut self, time: f64) {
        self.since = time;
    }

    /// The official program begins a restart: the ball to its spot.
    pub(crate) fn place_for(&mut self, court: &mut Court, set_play: SetPlay, team: Option<Team>) {
        let field = court.field;
        let sign = |team: Team| if team == 0 { 1.0 } else { -1.0 };
        let side = if self.spot[1] >= 0.0 { 1.0 } else { -1.0 };
        let spot = match (set_play, team) {
            (SetPlay::None, _) => [0.0; 2],
            (SetPlay::PenaltyKick, Some(t)) => [sign(t) * (field.length / 2.0 - field.penalty_mark), 0.0],
            (SetPlay::CornerKick, Some(t)) => [sign(t) * field.length / 2.0, side * field.width / 2.0],
            (SetPlay::GoalKick, Some(t)) => {
                [-sign(t) * (field.length / 2.0 - field.goal_area.length), side * field.goal_area.width / 2.0]
            }
            (SetPlay::ThrowIn, _) => [self.spot[0], side * field.width / 2.0],
            _ => court.ball.position,
        };
        self.spot = spot;
        *court.ball = Ball { position: spot, velocity: [0.0; 2] };
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

/// How fast `a` wants to walk into `b`, m/s.
fn wants_into(a: &Robot, b: &Robot) -> f64 {
    let [x, y] = a.pose.local_from_outer(b.pose.position());
    let d = x.hypot(y).max(1e-9);
    (a.command[0] * x + a.command[1] * y) / d
}

/// Indices of the robots that touch the ball: at most all.
pub(crate) type Touches = ArrayVec<usize, 64>;
