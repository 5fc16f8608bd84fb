//! One game: the loop in which robots see, decide and walk, the ball rolls, and the referee watches.
//!
//! Steps of 20 ms; every robot sees and decides ten times a second, each in another step. What mates say arrives with
//! their last decision. All random numbers come from one generator seeded for this game.

use std::f64::consts::PI;
use std::sync::Arc;

use arrayvec::ArrayVec;
use instep_behaviour::{Circle, KickTable, MAX_TEAM, Mate, PlayState, Player, Role, SetPlay, Strategy, time_to_ball};
use instep_field::{Pose, Side, wrap};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::MatchError;
use crate::ball::{Ball, Obstacle};
use crate::invariants::{Breach, Watch};
use crate::record::{Frame, RATE, Recording};
use crate::referee::{Court, Event, EventKind, MOST_ROBOTS, Referee, Team, Touches};
use crate::robot::{Robot, Status, Swing, collide};
use crate::settings::MatchSettings;
use crate::sight::{Seen, chance, normal, take};
use crate::steer::steer;
use crate::tally::{Result, Tally};

/// s.
const STEP: f64 = 0.02;
/// Steps between two decisions of a robot.
const DECIDE_EVERY: u64 = 5;
/// A role that comes back within this is a flicker, s.
const FLICKER: f64 = 3.0;
/// A ball this far from its place before the foot is not hit, m.
const MISS_AHEAD: f64 = 0.2;
const MISS_BESIDE: f64 = 0.25;

/// How one team plays.
#[derive(Debug, Clone)]
pub struct TeamSetup {
    /// Its strategy.
    pub strategy: Arc<Strategy>,
    /// Its kicks.
    pub kicks: Arc<KickTable>,
}

/// What a mate last said.
#[derive(Debug, Clone, Copy)]
struct Message {
    mate: Mate,
    ball: Option<([f64; 2], [f64; 2], f64)>,
    /// Role before the present one, and since when the present one lasts.
    previous: Role,
    changed: f64,
}

/// One game.
#[derive(Debug, Clone)]
pub struct Match {
    settings: Arc<MatchSettings>,
    teams: [TeamSetup; 2],
    rng: ChaCha8Rng,
    tick: u64,
    ball: Ball,
    robots: Vec<Robot>,
    referee: Referee,
    /// By robot.
    messages: ArrayVec<Message, MOST_ROBOTS>,
    tally: Tally,
    recording: Option<Recording>,
    /// Reads a clock, s; measures decisions where it is given.
    clock: Option<fn() -> f64>,
    play_began: (PlayState, SetPlay),
    watch: Watch,
    /// The first breach, and when, s.
    breach: Option<(f64, Breach)>,
}

impl Match {
    /// A game before its first READY; the same settings, teams, first kick-off and seed give the same game.
    ///
    /// # Errors
    /// [`MatchError::Behaviour`] where a strategy or a table of kicks cannot be.
    pub fn new(
        settings: Arc<MatchSettings>,
        teams: [TeamSetup; 2],
        first: Team,
        seed: u64,
    ) -> std::result::Result<Self, MatchError> {
        let mut robots = Vec::new();
        let mut messages = ArrayVec::new();
        let field = &settings.field;
        for (team, setup) in teams.iter().enumerate() {
            for number in 1..=settings.players as u8 {
                let head = Player::new(field.clone(), setup.strategy.clone(), setup.kicks.clone())?;
                // Beside the own half, as teams enter; in the team's own frame.
                let side = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
                let x = -0.12 * field.length - 0.35 * field.length * f64::from(number - 1) / settings.players as f64;
                let own = Pose::new(x, side * field.width / 2.0, -side * PI / 2.0);
                let pose = if team == 0 { own } else { own.mirrored() };
                robots.push(Robot::new(team, number, pose, head));
                let mate =
                    Mate { number, pose: own, role: Role::default(), time_to_ball: 1e3, able: true, penalised: false };
                messages.push(Message { mate, ball: None, previous: Role::default(), changed: -1e3 });
            }
        }
        let referee = Referee::new(settings.book, settings.knockout, first);
        let watch = Watch::new(&referee, robots.len());
        Ok(Self {
            settings,
            teams,
            rng: ChaCha8Rng::seed_from_u64(seed),
            tick: 0,
            ball: Ball::default(),
            robots,
            referee,
            messages,
            tally: Tally::default(),
            recording: None,
            clock: None,
            play_began: (PlayState::Initial, SetPlay::None),
            watch,
            breach: None,
        })
    }

    /// Records frames from now on.
    pub fn record(&mut self) {
        self.recording = Some(Recording::default());
    }

    /// Measures the time of decisions with this clock (s).
    pub fn measure(&mut self, clock: fn() -> f64) {
        self.clock = Some(clock);
    }

    /// s.
    pub fn time(&self) -> f64 {
        self.tick as f64 * STEP
    }

    /// The ball.
    pub fn ball(&self) -> &Ball {
        &self.ball
    }

    /// All robots, Home first.
    pub fn robots(&self) -> &[Robot] {
        &self.robots
    }

    /// The referee.
    pub fn referee(&self) -> &Referee {
        &self.referee
    }

    /// The first invariant that did not hold, and when, s.
    pub fn breach(&self) -> Option<(f64, Breach)> {
        self.breach
    }

    pub(crate) fn robots_mut(&mut self) -> &mut [Robot] {
        &mut self.robots
    }

    /// A situation has been set up: what holds is told from here on.
    pub(crate) fn begin_watch(&mut self) {
        self.watch = Watch::new(&self.referee, self.robots.len());
    }

    /// What it is played with.
    pub fn settings(&self) -> &MatchSettings {
        &self.settings
    }

    /// What was counted.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// What came of it so far.
    pub fn result(&self) -> Result {
        Result { score: self.referee.score, shootout: self.referee.shootout }
    }

    /// The recording, where there is one; recording ends.
    pub fn take_recording(&mut self) -> Option<Recording> {
        self.recording.take()
    }

    /// Plays to the end.
    pub fn play(&mut self) -> Result {
        while !self.referee.ended {
            self.step();
        }
        self.tally.simulated = self.time();
        self.result()
    }

    /// Plays to the end, telling `each` about every event as it comes.
    pub fn step_and_tell(&mut self, mut each: impl FnMut(&Match, &Event)) {
        self.step_inner();
        for i in 0..self.referee.events.len() {
            let event = self.referee.events[i];
            each(self, &event);
        }
        self.keep_events();
    }

    /// One step of 20 ms.
    pub fn step(&mut self) {
        self.step_inner();
        self.keep_events();
    }

    /// The referee acts with the present world: for the official program and for scenarios.
    pub(crate) fn with_court<T>(&mut self, act: impl FnOnce(&mut Referee, &mut Court) -> T) -> T {
        let time = self.time();
        let field = self.settings.field.clone();
        let mut court = Court {
            time,
            dt: 0.0,
            field: &field,
            ball: &mut self.ball,
            robots: &mut self.robots,
            touches: &[],
            contacts: &[],
            whereabouts: crate::ball::Whereabouts::Inside,
        };
        act(&mut self.referee, &mut court)
    }

    fn keep_events(&mut self) {
        for event in &self.referee.events {
            match event.kind {
                EventKind::SentOff { .. } => self.tally.removals += 1,
                EventKind::Restart { .. } | EventKind::KickOff { .. } => self.tally.restarts += 1,
                EventKind::Fall { .. } => self.tally.falls += 1,
                EventKind::Kick { .. } => self.tally.kicks += 1,
                _ => {}
            }
        }
        if let Some(recording) = &mut self.recording {
            recording.events.extend_from_slice(&self.referee.events);
        }
        self.referee.events.clear();
        let every = (1.0 / (RATE * STEP)) as u64;
        if self.recording.is_some() && (self.tick.is_multiple_of(every) || self.referee.ended) {
            let frame = Frame::of(self);
            if let Some(recording) = &mut self.recording {
                recording.frames.push(frame);
            }
        }
    }

    fn step_inner(&mut self) {
        self.tick += 1;
        let time = self.time();
        self.tell_of_restart(time);
        for i in 0..self.robots.len() {
            if (self.tick + i as u64).is_multiple_of(DECIDE_EVERY) {
                self.see_and_decide(i, time);
            }
        }
        self.get_up(time);
        for robot in &mut self.robots {
            robot.walk(STEP, &self.settings.body);
        }
        let contacts = self.collide(time);
        let mut touches = Touches::new();
        self.swing(time, &mut touches);
        let whereabouts = self.roll(time, &mut touches);
        let field = self.settings.field.clone();
        let mut court = Court {
            time,
            dt: STEP,
            field: &field,
            ball: &mut self.ball,
            robots: &mut self.robots,
            touches: &touches,
            contacts: &contacts,
            whereabouts,
        };
        self.referee.update(&mut court);
        if !self.referee.led {
            let events = &self.referee.events;
            let held = self.watch.look(time, &field, &self.ball, &self.robots, &self.referee, events);
            if let (Err(breach), None) = (held, self.breach) {
                self.breach = Some((time, breach));
            }
        }
    }

    /// When the referee has put the ball somewhere, everybody knows where.
    fn tell_of_restart(&mut self, time: f64) {
        let now = (self.referee.state, self.referee.set_play);
        if now != self.play_began {
            self.play_began = now;
            let placed = now.1 != SetPlay::None || matches!(now.0, PlayState::Ready | PlayState::Set);
            if placed {
                let spot = self.referee.spot();
                for robot in &mut self.robots {
                    robot.beliefs.ball.place(time, side(robot.team).point(spot));
                }
            }
        }
    }

    /// Eyes, memory, decision and steering of one robot.
    fn see_and_decide(&mut self, i: usize, time: f64) {
        let dt = STEP * DECIDE_EVERY as f64;
        let settings = &*self.settings;
        let robot = &self.robots[i];
        let (team, number) = (robot.team, robot.number);
        let side = side(team);
        let penalised = matches!(robot.status, Status::Removed { .. });
        // What it would see now, to be used at the next decision.
        let mut others: ArrayVec<Seen, 22> = ArrayVec::new();
        for (j, other) in self.robots.iter().enumerate() {
            if j != i && other.is_on_field(time) {
                let circle = Circle { center: side.point(other.pose.position()), radius: settings.body.radius };
                others.push(Seen { circle, opponent: other.team != team });
            }
        }
        let ball = side.point(self.ball.position);
        let robot = &mut self.robots[i];
        let truth = side.pose(&robot.pose);
        // Errors that wander: a first-order process with the standard deviation and time constant of the settings.
        let sight = &settings.sight;
        let keep = (-dt / sight.noise_time).exp();
        let fresh = (1.0 - keep * keep).sqrt();
        for (error, std) in
            robot.pose_error.iter_mut().zip([sight.position_noise, sight.position_noise, sight.heading_noise])
        {
            *error = keep * *error + fresh * std * normal(&mut self.rng);
        }
        let [ex, ey, eh] = robot.pose_error;
        let own = Pose::new(truth.x + ex, truth.y + ey, truth.heading + eh);
        let beliefs = &mut robot.beliefs;
        beliefs.time = time;
        beliefs.own.pose = own;
        let variance = sight.position_noise * sight.position_noise;
        beliefs.own.covariance =
            [[variance, 0.0, 0.0], [0.0, variance, 0.0], [0.0, 0.0, sight.heading_noise * sight.heading_noise]];
        beliefs.own.velocity = robot.velocity;
        beliefs.own.fallen = matches!(robot.status, Status::Down { .. });
        beliefs.own.kicking = robot.swing.is_some();
        beliefs.own.gaze_yaw = robot.gaze_yaw;
        beliefs.view = sight.view;
        beliefs.game = self.referee.game_state(team, penalised);
        // What mates said.
        beliefs.mates.clear();
        let mut heard: Option<([f64; 2], [f64; 2], f64)> = None;
        let base = team * settings.players;
        for message in &self.messages[base..base + settings.players] {
            if message.mate.number != number {
                beliefs.mates.push(message.mate);
                if let Some(ball) = message.ball
                    && heard.is_none_or(|h| ball.2 < h.2)
                {
                    heard = Some(ball);
                }
            }
        }
        let frame = &robot.frame;
        let mut shadows: ArrayVec<Circle, 22> = ArrayVec::new();
        shadows.extend(beliefs.mates.iter().map(|m| Circle { center: m.pose.position(), radius: 0.15 }));
        shadows.extend(beliefs.opponents.iter().map(|o| Circle { radius: 0.15, ..o.circle }));
        // The frame was taken from where the robot believed to be then.
        beliefs.ball.update(time, &frame.own, frame.yaw, &sight.view, &shadows, &frame.sight);
        robot.opponents.update(time, &frame.own, frame.yaw, &sight.view, &frame.sight, settings.players.min(MAX_TEAM));
        robot.opponents.list(&mut beliefs.opponents);
        if let Some((position, velocity, age)) = heard {
            beliefs.ball.hear(time, position, velocity, age);
        }
        let began = self.clock.map(|clock| clock());
        let decision = robot.head.decide(beliefs);
        if let (Some(clock), Some(began)) = (self.clock, began) {
            self.tally.decided(clock() - began);
        }
        self.tally.decisions += 1;
        // Steering round what it believes is there.
        let mut obstacles: ArrayVec<Circle, 22> = ArrayVec::new();
        let radius = settings.body.radius;
        obstacles.extend(beliefs.mates.iter().map(|m| Circle { center: m.pose.position(), radius }));
        obstacles.extend(beliefs.opponents.iter().map(|o| Circle { radius, ..o.circle }));
        let known = beliefs.ball.is_known().then_some(beliefs.ball.position);
        let able = robot.status == Status::Active;
        robot.command = if able { steer(&own, &decision.motion, known, &obstacles, &settings.body) } else { [0.0; 3] };
        if let (Some(request), true, None) = (decision.kick, able, robot.swing.as_ref())
            && let Some(kick) = self.teams[team].kicks.kick.get(request.kick)
        {
            let relative = wrap(request.direction - own.heading);
            let contact = time + kick.contact_median_s;
            robot.swing = Some(Swing { request, relative, contact, end: contact + kick.recovery, struck: false });
        }
        if let Some(swing) = &robot.swing {
            // A kick from the stand stands; one in the gait walks on as it did.
            let in_gait = self.teams[team].kicks.kick.get(swing.request.kick).is_some_and(|k| k.in_gait);
            robot.command = if in_gait && !swing.struck { robot.velocity } else { [0.0; 3] };
        }
        if let Some(walk) = robot.scripted {
            robot.command = walk;
            robot.swing = None;
        }
        let yaw = decision.gaze.yaw.clamp(-sight.view.neck_limit, sight.view.neck_limit);
        robot.gaze_yaw += (yaw - robot.gaze_yaw).clamp(-sight.neck_speed * dt, sight.neck_speed * dt);
        (robot.frame.own, robot.frame.yaw) = (own, robot.gaze_yaw);
        if penalised {
            robot.frame.sight = Default::default();
        } else {
            take(&truth, robot.gaze_yaw, ball, &others, sight, &mut self.rng, &mut robot.frame.sight);
        }
        let known = beliefs.ball;
        let open = self.referee.state == PlayState::Playing && self.referee.kicking.is_none() && able;
        let message = &mut self.messages[i];
        if open {
            self.tally.open_play += dt;
            if decision.role != message.mate.role {
                self.tally.role_changes += 1;
                if decision.role == message.previous && time - message.changed < FLICKER {
                    self.tally.role_flickers += 1;
                }
            }
        }
        if decision.role != message.mate.role {
            (message.previous, message.changed) = (message.mate.role, time);
        }
        message.mate = Mate {
            number,
            pose: own,
            role: decision.role,
            time_to_ball: if known.is_known() { time_to_ball(&own, known.position) } else { 1e3 },
            able,
            penalised,
        };
        message.ball = (able && known.is_known()).then(|| (known.position, known.velocity, known.age(time)));
        robot.decision = Some(decision);
    }

    fn get_up(&mut self, time: f64) {
        let body = &self.settings.body;
        for robot in &mut self.robots {
            if let Status::Down { since, tries, up_at } = robot.status
                && time >= up_at
            {
                robot.status = if chance(&mut self.rng) < body.get_up_chance {
                    Status::Active
                } else {
                    Status::Down { since, tries: tries + 1, up_at: time + body.get_up }
                };
            }
        }
    }

    fn collide(&mut self, time: f64) -> ArrayVec<(usize, usize), 64> {
        let mut contacts = ArrayVec::new();
        let body = self.settings.body;
        let on_field: ArrayVec<bool, MOST_ROBOTS> = self.robots.iter().map(|r| r.is_on_field(time)).collect();
        for i in 0..self.robots.len() {
            let (before, after) = self.robots.split_at_mut(i + 1);
            let a = &mut before[i];
            if !on_field[i] {
                continue;
            }
            for (k, b) in after.iter_mut().enumerate() {
                if !on_field[i + 1 + k] {
                    continue;
                }
                let Some(speed) = collide(a, b, body.radius) else { continue };
                // As many as fit: more than 64 contacts at once cannot be.
                let _ = contacts.try_push((i, i + 1 + k));
                let risk = body.fall_chance * (speed - body.fall_speed);
                for robot in [&mut *a, b] {
                    if risk > 0.0 && robot.is_active() && chance(&mut self.rng) < risk {
                        robot.fall(time, &body);
                        let kind = EventKind::Fall { team: robot.team, number: robot.number };
                        self.referee.events.push(Event { time, kind });
                    }
                }
            }
        }
        contacts
    }

    /// Kicks whose foot meets the ball now.
    fn swing(&mut self, time: f64, touches: &mut Touches) {
        for (i, robot) in self.robots.iter_mut().enumerate() {
            let Some(swing) = &mut robot.swing else { continue };
            if time >= swing.end {
                robot.swing = None;
                continue;
            }
            if swing.struck || time < swing.contact {
                continue;
            }
            swing.struck = true;
            let Some(kick) = self.teams[robot.team].kicks.kick.get(swing.request.kick) else { continue };
            let [x, y] = robot.pose.local_from_outer(self.ball.position);
            let there = (x - kick.ball_ahead).abs() < MISS_AHEAD && y.abs() < MISS_BESIDE;
            if there && chance(&mut self.rng) < kick.hit_rate {
                let direction = robot.pose.heading + swing.relative + kick.direction_spread() * normal(&mut self.rng);
                let speed = swing.request.speed
                    * kick.speed_ratio_median
                    * (1.0 + kick.speed_spread * normal(&mut self.rng)).max(0.0);
                self.ball.velocity = [speed * direction.cos(), speed * direction.sin()];
                // As many as fit: more cannot be.
                let _ = touches.try_push(i);
                let kind = EventKind::Kick { team: robot.team, number: robot.number };
                self.referee.events.push(Event { time, kind });
            }
            if chance(&mut self.rng) >= kick.upright_rate {
                robot.fall(time, &self.settings.body);
                let kind = EventKind::Fall { team: robot.team, number: robot.number };
                self.referee.events.push(Event { time, kind });
            }
        }
    }

    fn roll(&mut self, time: f64, touches: &mut Touches) -> crate::ball::Whereabouts {
        let body = &self.settings.body;
        let mut obstacles: ArrayVec<Obstacle, MOST_ROBOTS> = ArrayVec::new();
        let mut who: ArrayVec<usize, MOST_ROBOTS> = ArrayVec::new();
        let ball = self.ball;
        let near = 1.0 + ball.speed() * STEP;
        for (i, robot) in self.robots.iter().enumerate() {
            let [dx, dy] = [robot.pose.x - ball.position[0], robot.pose.y - ball.position[1]];
            if dx * dx + dy * dy > near * near || !robot.is_on_field(time) {
                continue;
            }
            // A robot on the ground is as wide as it is long.
            let radius = if matches!(robot.status, Status::Down { .. }) { body.radius } else { body.feet };
            obstacles.push(Obstacle { center: robot.pose.position(), velocity: robot.world_velocity(), radius });
            who.push(i);
        }
        let whereabouts = self.ball.step(STEP, &self.settings.field, &obstacles, |k| {
            if let Some(i) = who.get(k)
                && !touches.contains(i)
            {
                // As many as fit: more cannot be.
                let _ = touches.try_push(*i);
            }
        });
        // The ball lies still until the whistle, whoever walks into it.
        if self.referee.state != PlayState::Playing && !self.referee.led {
            self.ball = Ball { position: self.referee.spot(), velocity: [0.0; 2] };
            touches.clear();
            return crate::ball::Whereabouts::Inside;
        }
        whereabouts
    }
}

pub(crate) fn side(team: Team) -> Side {
    if team == 0 { Side::Home } else { Side::Away }
}
