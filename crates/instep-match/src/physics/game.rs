//! A whole game in physics. The referee is the game simulator's and looks at shadows: flat robots and a flat ball that are made
//! from the world's truth before each of its steps; where it moves a shadow (a ball put down, a robot carried off or back), the
//! body is moved after it, as handlers and an assistant would.
//!
//! A robot that lies for [`PICK_UP`] seconds is picked up at its team's request, since no robot of ours gets up by itself yet:
//! sent off as incapable, it comes back at the touch line when its time is over.

use std::f64::consts::PI;
use std::sync::Arc;

use arrayvec::ArrayVec;
use instep_behaviour::{PlayState, Player as Head};
use instep_field::Pose;
use instep_localisation::Start;
use instep_player::PlayerSettings;
use instep_player::legs::Stage;
use instep_robot::Robot as Model;
use instep_sim::Entrant;

use super::Sight;
use super::arena::Arena;
use super::record::{Motion, frame, robot_frame};
use super::seat::{Guest, Seat, pose};
use crate::MatchError;
use crate::ball::{Ball, Whereabouts};
use crate::record::Recording;
use crate::referee::{Court, Event, EventKind, MOST_ROBOTS, Penalty, Referee, Team, Touches};
use crate::robot::{Robot, Status};
use crate::settings::MatchSettings;
use crate::tally::{Result as Score, Tally};

/// Ticks between two steps of the referee.
const JUDGE_EVERY: u64 = 20;
const DT: f64 = 0.02;
/// Ticks between two frames of the flat record, and of the one in space.
const RECORD_EVERY: [u64; 2] = [200, 50];
/// Time on the ground after which a robot is picked up, s.
const PICK_UP: f64 = 3.0;
/// A shadow that was moved farther than this was carried, m.
const CARRIED: f64 = 0.3;
/// Time constant with which a robot's velocity is judged, s: a step's sway is no motion.
const SWAY: f64 = 0.4;
/// What handlers know of where they put a robot: m, rad.
const PLACED: [f64; 2] = [0.2, 0.1];
/// A ball that lies this far from its place before the whistle is put back, m.
const PUT_BACK: f64 = 0.05;

/// What a team plays with.
#[derive(Debug, Clone)]
pub struct Outfit {
    /// Its robots.
    pub robot: Arc<Model>,
    /// Their players.
    pub settings: PlayerSettings,
    /// How many.
    pub players: usize,
    /// How they see.
    pub sight: Sight,
}

/// A game in physics.
#[derive(Debug)]
pub struct PhysicsMatch {
    settings: Arc<MatchSettings>,
    arena: Arena,
    referee: Referee,
    shadows: Vec<Robot>,
    ball: Ball,
    tick: u64,
    tally: Tally,
    stages: Vec<Stage>,
    flat: Recording,
    motion: Option<Motion>,
}

impl PhysicsMatch {
    /// A game before its first READY; red attacks toward +x. The same inputs and seed give the same game.
    ///
    /// # Errors
    /// When a player, a place or the world cannot be.
    pub fn new(settings: Arc<MatchSettings>, teams: &[Outfit; 2], first: Team, seed: u64) -> Result<Self, MatchError> {
        let field = &settings.field;
        let mut entrants = Vec::new();
        let mut shadows = Vec::new();
        for (team, outfit) in teams.iter().enumerate() {
            if !(1..=MOST_ROBOTS / 2).contains(&outfit.players) {
                return Err(MatchError::Value {
                    what: "players of a team",
                    found: outfit.players.to_string(),
                    expected: format!("1 to {}", MOST_ROBOTS / 2),
                });
            }
            let side = crate::game::side(team);
            for number in 1..=outfit.players as u8 {
                // At the touch line of the own half, looking in.
                let edge = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
                let x = -0.12 * field.length - 0.35 * field.length * f64::from(number - 1) / outfit.players as f64;
                let own = Pose::new(x, edge * field.width / 2.0, -edge * PI / 2.0);
                let start = Start::Near { pose: own, position_sigma: PLACED[0], heading_sigma: PLACED[1] };
                let seed = seed.wrapping_mul(1000).wrapping_add(10 * u64::from(number) + team as u64);
                let (settings, sight) = (outfit.settings.clone(), outfit.sight);
                let guest = Guest { team: side, number, start, settings, sight, seed };
                let pose = side.pose(&own);
                entrants.push((Entrant { robot: Arc::clone(&outfit.robot), team: side, pose }, Some(guest)));
                let (strategy, kicks) = (outfit.settings.strategy.clone(), outfit.settings.kicks.clone());
                let head = Head::new(Arc::clone(field), Arc::new(strategy), Arc::new(kicks))?;
                shadows.push(Robot::new(team, number, pose, head));
            }
        }
        let mut arena = Arena::new(field, entrants, &settings.sight)?;
        arena.place_ball([0.0; 2]);
        let referee = Referee::new(settings.book, false, first);
        let stages = vec![Stage::Stand; shadows.len()];
        let mut game = Self {
            settings,
            arena,
            referee,
            shadows,
            ball: Ball::default(),
            tick: 0,
            tally: Tally::default(),
            stages,
            flat: Recording::default(),
            motion: None,
        };
        game.tell();
        Ok(game)
    }

    /// Keeps every robot's joints too from now on, for a replay in space.
    pub fn keep_motion(&mut self) {
        self.motion = Some(Motion::default());
    }

    /// s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.arena.time()
    }

    /// The players.
    #[must_use]
    pub fn seats(&self) -> &[Seat] {
        &self.arena.seats
    }

    /// What was counted.
    #[must_use]
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// The referee.
    #[must_use]
    pub fn referee(&self) -> &Referee {
        &self.referee
    }

    /// What came of it so far.
    #[must_use]
    pub fn result(&self) -> Score {
        Score { score: self.referee.score, shootout: self.referee.shootout }
    }

    /// The records; they end.
    pub fn take_records(&mut self) -> (Recording, Option<Motion>) {
        (std::mem::take(&mut self.flat), self.motion.take())
    }

    /// Plays for `seconds` or to the end, telling `tell` the time now and then.
    ///
    /// # Errors
    /// When the physics diverge.
    pub fn play(&mut self, seconds: f64, mut tell: impl FnMut(f64)) -> Result<(), MatchError> {
        while !self.referee.ended && self.time() < seconds - 1e-9 {
            self.step()?;
            if self.tick.is_multiple_of(500) {
                tell(self.time());
            }
        }
        self.tally.simulated = self.time();
        Ok(())
    }

    /// One tick of the world; the referee looks every 20 ms.
    ///
    /// # Errors
    /// When the physics diverge.
    pub fn step(&mut self) -> Result<(), MatchError> {
        if self.tick.is_multiple_of(RECORD_EVERY[0]) {
            self.record();
        }
        if let Some(motion) = self.motion.as_mut().filter(|_| self.tick.is_multiple_of(RECORD_EVERY[1])) {
            motion.push(&self.arena.world);
        }
        self.arena.advance()?;
        self.tick += 1;
        if self.tick.is_multiple_of(JUDGE_EVERY) {
            self.judge()?;
        }
        Ok(())
    }

    /// The referee's step.
    fn judge(&mut self) -> Result<(), MatchError> {
        let time = self.time();
        self.follow(time);
        let before: ArrayVec<(Pose, bool), MOST_ROBOTS> =
            self.shadows.iter().map(|robot| (robot.pose, matches!(robot.status, Status::Removed { .. }))).collect();
        let ball_before = self.ball;
        let mut touches: Touches = self.arena.on_ball.iter().copied().collect();
        let contacts: ArrayVec<(usize, usize), 64> = self.arena.met.clone();
        self.arena.on_ball.clear();
        self.arena.met.clear();
        let field = Arc::clone(&self.settings.field);
        let playing = self.referee.state == PlayState::Playing;
        let mut whereabouts = self.ball.whereabouts(&field);
        if matches!(whereabouts, Whereabouts::Goal(_)) && self.arena.world.ball().position[2] > field.goal.height {
            let end = if self.ball.position[0] > 0.0 { 1 } else { -1 };
            whereabouts = Whereabouts::GoalLine(end);
        }
        if !playing {
            // The ball lies still until the whistle, whoever walks into it.
            let spot = self.referee.spot();
            let off = (self.ball.position[0] - spot[0]).hypot(self.ball.position[1] - spot[1]);
            if off > PUT_BACK {
                self.ball = Ball { position: spot, velocity: [0.0; 2] };
            }
            touches.clear();
            whereabouts = Whereabouts::Inside;
        }
        let mut court = Court {
            time,
            dt: DT,
            field: &field,
            ball: &mut self.ball,
            robots: &mut self.shadows,
            touches: &touches,
            contacts: &contacts,
            whereabouts,
        };
        self.referee.update(&mut court);
        for i in 0..before.len() {
            if let Status::Down { since, .. } = court.robots[i].status
                && time - since > PICK_UP
            {
                self.referee.send_off(&mut court, i, Penalty::IncapableRobot);
            }
        }
        if self.ball != ball_before {
            self.arena.place_ball(self.ball.position);
        }
        for (i, (pose, removed)) in before.into_iter().enumerate() {
            let robot = &self.shadows[i];
            let back = removed && robot.status == Status::Active;
            if robot.pose.distance(&pose) > CARRIED || back {
                let (to, side) = (robot.pose, crate::game::side(robot.team));
                let [position_sigma, heading_sigma] = PLACED;
                let start = Start::Near { pose: side.pose(&to), position_sigma, heading_sigma };
                self.arena.carry(i, to)?;
                self.arena.seats[i].restart(&self.arena.world, start);
            }
        }
        self.keep_events();
        self.tell();
        Ok(())
    }

    /// Shadows as the world is.
    fn follow(&mut self, time: f64) {
        let keep = (-DT / SWAY).exp();
        let open = self.referee.state == PlayState::Playing && self.referee.kicking.is_none();
        for (i, robot) in self.shadows.iter_mut().enumerate() {
            let view = self.arena.world.on(i);
            let seat = &self.arena.seats[i];
            robot.pose = pose(&view);
            let v = view.v();
            let (s, c) = robot.pose.heading.sin_cos();
            let now = [c * v[0] + s * v[1], c * v[1] - s * v[0], v[5]];
            for (kept, new) in robot.velocity.iter_mut().zip(now) {
                *kept = keep * *kept + (1.0 - keep) * new;
            }
            robot.command = seat.player.legs().velocity();
            let down = view.has_fallen();
            match robot.status {
                Status::Active if down => {
                    robot.status = Status::Down { since: time, tries: 0, up_at: f64::INFINITY };
                    let kind = EventKind::Fall { team: robot.team, number: robot.number };
                    self.referee.events.push(Event { time, kind });
                }
                Status::Down { .. } if !down => robot.status = Status::Active,
                _ => {}
            }
            let stage = seat.player.legs().stage();
            if stage == Stage::Kick && self.stages[i] != Stage::Kick {
                let kind = EventKind::Kick { team: robot.team, number: robot.number };
                self.referee.events.push(Event { time, kind });
            }
            self.stages[i] = stage;
            if open && robot.is_active() {
                self.tally.open_play += DT;
            }
        }
        let ball = self.arena.world.ball();
        let ([x, y, _], [vx, vy, _]) = (ball.position, ball.velocity);
        self.ball = Ball { position: [x, y], velocity: [vx, vy] };
    }

    /// Every player hears the referee.
    fn tell(&mut self) {
        for (seat, robot) in self.arena.seats.iter_mut().zip(&self.shadows) {
            let penalised = matches!(robot.status, Status::Removed { .. });
            seat.tell(self.referee.game_state(robot.team, penalised));
        }
    }

    fn keep_events(&mut self) {
        for event in self.referee.events.drain(..) {
            match event.kind {
                EventKind::SentOff { .. } => self.tally.removals += 1,
                EventKind::Restart { .. } | EventKind::KickOff { .. } => self.tally.restarts += 1,
                EventKind::Fall { .. } => self.tally.falls += 1,
                EventKind::Kick { .. } => self.tally.kicks += 1,
                _ => {}
            }
            self.flat.events.push(event);
        }
    }

    fn record(&mut self) {
        let robots = (0..self.shadows.len())
            .map(|i| robot_frame(&self.arena.world, i, self.arena.seats.get(i), self.shadows.get(i)))
            .collect();
        let state = format!("{:?} {:?}", self.referee.state, self.referee.set_play);
        let left = self.referee.time_left;
        self.flat.frames.push(frame(&self.arena.world, robots, left, state, self.referee.score));
    }
}
