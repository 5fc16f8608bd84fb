//! The whole player: each part at its own rate, on the caller's thread.

use std::sync::Arc;

use arrayvec::ArrayVec;
use instep_behaviour::{
    Action, BallMemory, Beliefs, Circle, Decision, GameState, KickRequest, MAX_TEAM, Mate, Motion, OpponentMemory,
    OwnState, PlayState, Point, Sight, View, time_to_ball,
};
use instep_field::{Field, Pose};
use instep_localisation::Start;
use instep_navigation::{Facing, Goal, Navigator, Obstacle, RobotLimits, Settings as NavigationSettings, Target};
use instep_robot::Robot;
use instep_robot::control::{BallObservation, JointCommand, Sensors};

use crate::guard::{Guard, Verdict};
use crate::lane;
use crate::legs::{Legs, Stage};
use crate::message::{HeardBall, Message};
use crate::neck::Neck;
use crate::place::Place;
use crate::push::{Push, Way};
use crate::senses::{Senses, Sights};
use crate::settings::{PlayerSettings, Tuning};
use crate::{PlayerError, Record};

/// Frames that come no more for this long are a camera that is blind, s.
const BLIND: f64 = 0.6;
/// Errors across the line of a run-up (m) and of the heading (rad) with which it is asked of the legs.
const LINE: [f64; 2] = [0.25, 0.35];
/// A ball that moved this far from where the kick was aimed is another kick, m.
const MOVED: f64 = 0.5;
/// Longest run-up, s: something is wrong with it.
const RUN_UP: f64 = 8.0;
/// A kick that is turned by more than this goes where nobody aimed, rad: it shall be soft, m/s.
const ASIDE: f64 = 0.1;
const SOFT: f64 = 2.0;
/// Radius that other robots are walked round with, m.
const OTHERS: f64 = 0.25;
/// Longest period of a tick that the neck is moved for, s.
const LONGEST: f64 = 0.05;
/// Above this height a ball flies, m: where its picture meets the ground it is not.
const FLIES: f64 = 0.6;
/// From farther than this it walks where it looks, m; from nearer it looks as it shall stand.
const FAR: f64 = 1.0;
/// Distance within which a seen mate is the one that said to be there, m.
const SAME: f64 = 0.7;

/// Who the player is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Identity {
    /// Its number, from 1; 1 keeps the goal where the strategy has a keeper.
    pub number: u8,
    /// Where it is when it is switched on.
    pub start: Start,
}

/// What a player gives at a tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// For the drives.
    pub command: JointCommand,
    /// For the team, when it is time to say something.
    pub say: Option<Message>,
}

/// What a mate said last, and when it was heard.
#[derive(Debug, Clone, Copy)]
struct Heard {
    message: Message,
    time: f64,
}

/// Times of the last decision, command and message, s.
#[derive(Debug, Clone, Copy)]
struct Last {
    tick: f64,
    decided: f64,
    navigated: f64,
    said: f64,
    frame: f64,
    asked: f64,
}

/// A whole player.
#[derive(Debug)]
pub struct Player {
    field: Arc<Field>,
    tuning: Tuning,
    guard: Guard,
    place: Place,
    legs: Legs,
    neck: Neck,
    head: instep_behaviour::Player,
    navigator: Navigator,
    push: Push,
    beliefs: Beliefs,
    opponents: OpponentMemory,
    heard: ArrayVec<Heard, MAX_TEAM>,
    /// Mates that were seen in the last frame, robot frame of then put into the field.
    seen_mates: ArrayVec<Point, MAX_TEAM>,
    decision: Option<Decision>,
    velocity: [f64; 3],
    /// Where the ball lay when the legs were asked for a kick, field frame, m.
    asked: Option<Point>,
    /// By how much the next kick is turned past opponents, rad.
    turned: f64,
    last: Last,
    sensors: Sensors,
    obstacles: Vec<Obstacle>,
    output: Output,
}

impl Player {
    /// A player that has just been switched on and stands.
    ///
    /// # Errors
    /// When robot, field or settings cannot be played with.
    pub fn new(
        robot: Arc<Robot>,
        field: Arc<Field>,
        identity: Identity,
        settings: PlayerSettings,
    ) -> Result<Self, PlayerError> {
        let PlayerSettings { strategy, kicks, walk, in_gait, tuning } = settings;
        tuning.validate("player")?;
        if !(1..=99).contains(&identity.number) {
            return Err(PlayerError::Value {
                place: "player: number".into(),
                found: identity.number.to_string(),
                expected: "a number from 1 to 99".into(),
            });
        }
        let share = tuning.walk_share;
        let limits = RobotLimits {
            forward: share * walk.limits.forward,
            backward: share * walk.limits.backward,
            sideways: tuning.side_share * walk.limits.sideways,
            turn: share * walk.limits.turn,
            acceleration: walk.limits.acceleration,
            turn_acceleration: walk.limits.turn_acceleration,
            lag: tuning.walk_lag,
            delay: tuning.walk_delay,
            radius: tuning.radius,
        };
        let neck = Neck::of(&robot);
        let view = View {
            half_angle: robot.camera.map_or(0.0, |camera| 0.5 * camera.field_of_view[0]),
            range: tuning.sight_range,
            neck_limit: neck.yaw_limit(),
        };
        let head = instep_behaviour::Player::new(Arc::clone(&field), Arc::new(strategy), Arc::new(kicks))?;
        let place = Place::new(&field, identity.start)?;
        let beliefs = Beliefs {
            time: 0.0,
            number: identity.number,
            own: OwnState::at(place.pose()),
            ball: BallMemory::default(),
            mates: ArrayVec::new(),
            opponents: ArrayVec::new(),
            game: GameState::default(),
            view,
        };
        let mut command = JointCommand::zeros(robot.joints.len());
        command.positions.copy_from_slice(&robot.stand[7..]);
        let begin = f64::NEG_INFINITY;
        Ok(Self {
            guard: Guard::new(&robot),
            neck,
            head,
            navigator: Navigator::new(&field, limits, NavigationSettings::default())?,
            legs: Legs::new(robot, walk, in_gait, field.ball.radius, tuning.fallen_tilt)?,
            place,
            push: Push::default(),
            beliefs,
            opponents: OpponentMemory::default(),
            heard: ArrayVec::new(),
            seen_mates: ArrayVec::new(),
            decision: None,
            velocity: [0.0; 3],
            asked: None,
            turned: 0.0,
            last: Last { tick: begin, decided: begin, navigated: begin, said: begin, frame: begin, asked: begin },
            sensors: Sensors::default(),
            obstacles: Vec::with_capacity(3 * MAX_TEAM),
            output: Output { command, say: None },
            field,
            tuning,
        })
    }

    /// The robot was put somewhere: it stands, and its walk begins anew.
    pub fn restart(&mut self, start: Start) {
        self.legs.restart();
        self.place.interrupt();
        let _ = self.legs.take_interruption();
        self.place.restart(start);
        self.push.stop();
        self.asked = None;
    }

    /// One tick. Call it once a period of the robot's drives, with rising times.
    pub fn tick(&mut self, senses: &Senses) -> &Output {
        self.output.say = None;
        match self.guard.judge(&senses.body) {
            Verdict::Repeat(_) => return &self.output,
            Verdict::StandDown(_) => {
                self.legs.stand_down(&mut self.output.command);
                return &self.output;
            }
            Verdict::Gap => self.legs.restart(),
            Verdict::Good => {
                if self.legs.stage() == Stage::Safe {
                    self.legs.restart();
                }
            }
        }
        let time = senses.body.time;
        let period = (time - self.last.tick).clamp(0.0, LONGEST);
        self.last.tick = time;
        self.hear(senses, time);
        self.move_body(senses);
        self.know(senses, time);
        self.decide(senses, time);
        self.navigate(time);
        self.turn_neck(period);
        self.speak(time);
        &self.output
    }

    /// Legs and odometry.
    fn move_body(&mut self, senses: &Senses) {
        self.sensors.copy_from(&senses.body);
        self.sensors.ball = senses.sights.as_ref().and_then(|sights| {
            let ball = sights.ball.filter(|_| sights.time.is_finite())?;
            let [x, y] = ball.position;
            Some(BallObservation { time: sights.time, position: [x, y, ball.height] })
        });
        self.legs.tick(&self.sensors, senses.state.as_ref(), &mut self.output.command);
        if self.legs.take_interruption() {
            self.place.interrupt();
        }
        if !matches!(self.legs.stage(), Stage::Down | Stage::Safe) {
            self.place.walked(senses.body.time, self.legs.odometry());
        }
    }

    /// What the eyes and the league tell.
    fn know(&mut self, senses: &Senses, time: f64) {
        if let Some(fix) = &senses.fix {
            self.place.fixed(fix);
        }
        let Some(sights) = &senses.sights else { return };
        if !(sights.time.is_finite() && sights.time <= time + 1e-9 && self.place.see(sights)) {
            return;
        }
        let own = self.place.pose_at(sights.time);
        let sight = self.sort(sights, &own);
        let mut shadows: ArrayVec<Circle, 32> = ArrayVec::new();
        let narrow = |center: Point| Circle { center, radius: 0.15 };
        shadows.extend(self.seen_mates.iter().map(|&at| narrow(at)));
        shadows.extend(self.beliefs.opponents.iter().map(|o| narrow(o.circle.center)));
        let view = self.beliefs.view;
        let yaw = if sights.gaze_yaw.is_finite() { sights.gaze_yaw } else { 0.0 };
        self.beliefs.ball.update(sights.time, &own, yaw, &view, &shadows, &sight);
        self.opponents.update(sights.time, &own, yaw, &view, &sight, MAX_TEAM);
        self.last.frame = sights.time;
    }

    /// Ball and opponents of a frame as the memory takes them; mates are kept apart.
    fn sort(&mut self, sights: &Sights, own: &Pose) -> Sight {
        let finite = |at: &[f64; 2]| at.iter().all(|x| x.is_finite()) && at[0].hypot(at[1]) < 200.0;
        let ball = sights.ball.filter(|ball| finite(&ball.position) && !(ball.height > FLIES));
        let ball = ball.map(|ball| {
            let std = if ball.std.is_finite() { ball.std.clamp(0.005, 10.0) } else { 0.3 };
            instep_behaviour::BallSight { position: ball.position, std }
        });
        let mut sight = Sight { ball, opponents: ArrayVec::new() };
        self.seen_mates.clear();
        for robot in sights.robots.iter().filter(|robot| finite(&robot.position)) {
            // As many as a team has fit; the rest is left out.
            let _ = match robot.mate {
                Some(true) => self.seen_mates.try_push(own.outer_from_local(robot.position)),
                _ => sight.opponents.try_push(robot.position),
            };
        }
        sight
    }

    fn hear(&mut self, senses: &Senses, time: f64) {
        for message in senses.heard.iter().filter(|m| m.is_finite() && m.mate.number != self.beliefs.number) {
            let heard = Heard { message: *message, time };
            match self.heard.iter_mut().find(|h| h.message.mate.number == message.mate.number) {
                Some(known) => *known = heard,
                None => {
                    let _ = self.heard.try_push(heard);
                }
            }
        }
        self.heard.retain(|heard| time - heard.time < self.tuning.mate_forgotten);
    }

    fn decide(&mut self, senses: &Senses, time: f64) {
        if time - self.last.decided < self.tuning.decide - 1e-9 {
            return;
        }
        self.last.decided = time;
        if time - self.last.frame > BLIND {
            // Nothing is seen, and nothing could be.
            let blind = View { range: 0.0, ..self.beliefs.view };
            let (own, nothing) = (self.place.pose(), Sight::default());
            self.beliefs.ball.update(time, &own, 0.0, &blind, &[], &nothing);
            self.opponents.update(time, &own, 0.0, &blind, &nothing, MAX_TEAM);
        }
        let beliefs = &mut self.beliefs;
        beliefs.time = time;
        beliefs.game = senses.game;
        beliefs.own = OwnState {
            pose: self.place.pose(),
            covariance: self.place.covariance(),
            velocity: self.legs.velocity(),
            fallen: self.legs.stage() == Stage::Down,
            kicking: self.legs.stage() == Stage::Kick,
            gaze_yaw: self.neck.gaze_yaw(&senses.body.joint_positions),
        };
        beliefs.mates.clear();
        beliefs.mates.extend(self.heard.iter().map(|heard| heard.message.mate));
        self.opponents.list(&mut beliefs.opponents);
        // The newest of what mates see, where one sees nothing oneself.
        let newest = self
            .heard
            .iter()
            .filter_map(|heard| heard.message.ball.map(|ball| HeardBall { age: ball.age + time - heard.time, ..ball }))
            .min_by(|a, b| a.age.total_cmp(&b.age));
        if let Some(ball) = newest {
            beliefs.ball.hear(time, ball.position, ball.velocity, ball.age);
        }
        if senses.game.state == PlayState::Set && !beliefs.ball.is_known() {
            beliefs.ball.place(time, [0.0; 2]);
        }
        self.decision = Some(self.head.decide(beliefs));
    }

    /// From the decision to a velocity, or to a kick.
    fn navigate(&mut self, time: f64) {
        if time - self.last.navigated < self.tuning.navigate - 1e-9 {
            return;
        }
        self.last.navigated = time;
        let Some(decision) = &self.decision else { return };
        let (motion, action, prepared) = (decision.motion, decision.action, decision.prepared);
        let pose = self.place.pose();
        if self.legs.is_kicking() {
            self.watch_kick(time, action, &motion);
            return;
        }
        self.asked = None;
        let plays = matches!(action, Action::Approach | Action::SetPieceOurs | Action::Dribble | Action::Kick);
        let velocity = match (prepared.filter(|_| plays && self.beliefs.ball.is_known()), motion) {
            (Some(request), _) => self.play_ball(time, &pose, &request),
            (None, Motion::Stand | Motion::GetUp) => [0.0; 3],
            (None, Motion::Velocity(velocity)) => velocity,
            (None, Motion::Walk { pose: to, avoid_ball }) => self.go(time, &pose, to, avoid_ball),
        };
        if prepared.is_none() || !plays {
            self.push.stop();
        }
        self.velocity = if self.place.is_located() { velocity } else { [0.0; 3] };
        self.legs.walk(self.velocity);
    }

    /// To the ball and through it, or to the beginning of a run-up.
    fn play_ball(&mut self, time: f64, pose: &Pose, request: &KickRequest) -> [f64; 3] {
        let ball = self.beliefs.ball.position;
        let Some(run_up) = self.legs.in_gait().map(|settings| settings.run_up) else {
            return match self.push.way(&self.tuning.push, pose, ball, request.direction) {
                Way::Through(velocity) => velocity,
                Way::Behind(to) => self.go(time, pose, to, true),
            };
        };
        self.turned = lane::turn(ball, request.direction, run_up, self.others(), self.turned);
        let direction = instep_field::wrap(request.direction + self.turned);
        let speed = if self.turned.abs() > ASIDE { request.speed.min(SOFT) } else { request.speed };
        let line = Pose::new(ball[0], ball[1], direction);
        let [along, beside] = line.local_from_outer(pose.position());
        let turned = instep_field::wrap(direction - pose.heading);
        let fresh = self.beliefs.ball.age(time) < BLIND;
        if fresh && (-1.6 * run_up..=-0.5 * run_up).contains(&along) && beside.abs() < LINE[0] && turned.abs() < LINE[1]
        {
            let odometry_from_field = self.legs.odometry().then(&pose.inverse());
            let aim = odometry_from_field.outer_from_local(ball);
            self.legs.kick(aim, direction + odometry_from_field.heading, speed);
            (self.asked, self.last.asked) = (Some(ball), time);
            return self.velocity;
        }
        let [x, y] = line.outer_from_local([-run_up, 0.0]);
        self.go(time, pose, Pose::new(x, y, direction), true)
    }

    /// Where other robots are believed to be, field frame, m.
    fn others(&self) -> impl Iterator<Item = Point> + Clone {
        self.beliefs.opponents.iter().map(|o| o.circle.center).chain(self.seen_mates.iter().copied())
    }

    /// A run-up goes on while the ball lies where it lay and the decision stays.
    fn watch_kick(&mut self, time: f64, action: Action, motion: &Motion) {
        if self.legs.stage() != Stage::RunUp {
            return;
        }
        let ball = self.beliefs.ball;
        let moved = self
            .asked
            .is_none_or(|was| (ball.position[0] - was[0]).hypot(ball.position[1] - was[1]) > MOVED || !ball.is_known());
        let other = matches!(motion, Motion::Stand | Motion::GetUp)
            || !matches!(action, Action::Approach | Action::SetPieceOurs | Action::Dribble | Action::Kick);
        if moved || other || time - self.last.asked > RUN_UP {
            self.legs.give_up();
        }
    }

    /// Navigation's velocity to a pose.
    fn go(&mut self, time: f64, pose: &Pose, to: Pose, avoid_ball: bool) -> [f64; 3] {
        self.obstacles.clear();
        let still = |position: Point, radius| Obstacle { position, velocity: [0.0; 2], radius };
        for opponent in &self.beliefs.opponents {
            let (position, velocity) = (opponent.circle.center, opponent.velocity);
            self.obstacles.push(Obstacle { position, velocity, radius: OTHERS });
        }
        for mate in &self.beliefs.mates {
            self.obstacles.push(still(mate.pose.position(), OTHERS));
        }
        for &seen in &self.seen_mates {
            let said = self.beliefs.mates.iter().any(|m| m.pose.distance(&Pose::new(seen[0], seen[1], 0.0)) < SAME);
            if !said {
                self.obstacles.push(still(seen, OTHERS));
            }
        }
        if avoid_ball && self.beliefs.ball.is_known() {
            let radius = (self.tuning.round_ball - self.tuning.radius).max(0.0);
            self.obstacles.push(still(self.beliefs.ball.position, radius));
        }
        let far = pose.distance(&to) > FAR;
        let facing = if far || !self.beliefs.ball.is_known() { Facing::Path } else { Facing::Hold(to.heading) };
        let view = instep_navigation::View { time, pose: *pose, velocity: None, obstacles: &self.obstacles };
        let goal = Goal { target: Target::Pose(to), facing, speed: f64::INFINITY };
        self.navigator.tick(&view, &goal).velocity
    }

    fn turn_neck(&mut self, period: f64) {
        let Some(decision) = &self.decision else { return };
        let JointCommand { positions, velocities, .. } = &mut self.output.command;
        if !matches!(self.legs.stage(), Stage::Down | Stage::Safe) {
            self.neck.look(decision.gaze.yaw, decision.gaze.pitch, period, positions, velocities);
        }
    }

    fn speak(&mut self, time: f64) {
        if time - self.last.said < self.tuning.say - 1e-9 {
            return;
        }
        self.last.said = time;
        let beliefs = &self.beliefs;
        let known = beliefs.ball.is_known();
        let pose = self.place.pose();
        let mate = Mate {
            number: beliefs.number,
            pose,
            role: self.decision.as_ref().map_or_else(Default::default, |decision| decision.role),
            time_to_ball: if known { time_to_ball(&pose, beliefs.ball.position) } else { 1e3 },
            able: self.place.is_located() && !matches!(self.legs.stage(), Stage::Down | Stage::Safe),
            penalised: beliefs.game.penalised,
        };
        let ball = known.then(|| HeardBall {
            position: beliefs.ball.position,
            velocity: beliefs.ball.velocity,
            age: beliefs.ball.age(time),
        });
        self.output.say = Some(Message { mate, ball });
    }

    /// What it does now; `None` before the first decision.
    #[must_use]
    pub fn decision(&self) -> Option<&Decision> {
        self.decision.as_ref()
    }

    /// Where it believes to be.
    #[must_use]
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// Its legs.
    #[must_use]
    pub fn legs(&self) -> &Legs {
        &self.legs
    }

    /// What it believes.
    #[must_use]
    pub fn beliefs(&self) -> &Beliefs {
        &self.beliefs
    }

    /// The field that it plays on.
    #[must_use]
    pub fn field(&self) -> &Field {
        &self.field
    }

    /// How many ticks' senses could not be believed.
    #[must_use]
    pub fn faults(&self) -> u64 {
        self.guard.faults()
    }

    /// What it believes and does, for a report.
    #[must_use]
    pub fn record(&self) -> Record {
        let beliefs = &self.beliefs;
        let decision = self.decision.as_ref();
        Record {
            time: self.last.tick,
            pose: self.place.pose(),
            pose_std: beliefs.own.position_std(),
            located: self.place.is_located(),
            ball: beliefs.ball.state,
            ball_position: beliefs.ball.position,
            ball_velocity: beliefs.ball.velocity,
            opponents: beliefs.opponents.iter().map(|o| o.circle.center).collect(),
            role: decision.map_or_else(Default::default, |d| d.role),
            action: decision.map_or(Action::Stand, |d| d.action),
            stage: self.legs.stage(),
            velocity: self.velocity,
            gaze: decision.map_or_else(Default::default, |d| d.gaze.mode),
            target: decision.and_then(|d| d.target).map(|t| t.point),
            reasons: decision.map_or_else(Vec::new, |d| d.reasons.to_vec()),
        }
    }
}
