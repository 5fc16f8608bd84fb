//! The whole of navigation for one robot: pose, obstacles and a goal in, a walking velocity and why out.
//!
//! Each tick predicts the robot to when a command takes effect, plans a way there round the keep-outs ([`crate::davg`], every
//! `plan_period`; on the side of before unless the other is clearly shorter), puts it in time ([`crate::reference`]) and
//! follows it ([`crate::nonlinear`] or [`crate::linearised`]). A goal inside a keep-out or off the field is replaced by the nearest free
//! place, and said. What cannot be walked is answered with a cause: the robot stops, and turns where that may help. It never
//! guesses. A tick allocates nothing.

use std::collections::VecDeque;

use instep_field::{Field, Pose, wrap};
use instep_qp::QpStatus;

use crate::davg::{Bend, MOST_POLYGONS, Planner, Query};
use crate::linearised::Linearised;
use crate::model::{DT, Response, STAGES, State};
use crate::polygon::Polygon;
use crate::problem::{Commands, KeepOut, MOST_KEEP_OUTS, Problem, Reference};
use crate::reference::{Facing, along_path, in_time};
use crate::settings::{Model, RobotLimits, Settings, Tracker};
use crate::{NavigationError, Obstacle, nonlinear};

/// Longest time between two ticks over which commands are remembered, s.
const GAP: f64 = 0.5;
/// Commands that are kept.
const KEPT: usize = 512;
/// How far ahead the planner believes that an obstacle goes on as now, s: an opponent that steps in the way turns back before.
const BELIEVED: f64 = 0.6;
/// A keep-out is the same as before within this distance, m.
const SAME: f64 = 1.0;

/// A robot that is less deep inside a polygon plans along its edge, m.
const SHALLOW: f64 = 0.1;

/// Where to.
#[derive(Clone, Copy)]
pub enum Target<'a> {
    /// A place; the way is found.
    Pose(Pose),
    /// x, y, heading for each time: followed as it is, but not into keep-outs.
    InTime(&'a dyn Fn(f64) -> [f64; 3]),
}

/// What the robot is to do.
#[derive(Clone, Copy)]
pub struct Goal<'a> {
    /// Where to.
    pub target: Target<'a>,
    /// Where to look on the way.
    pub facing: Facing,
    /// No faster than this, m/s.
    pub speed: f64,
}

impl Goal<'_> {
    /// To a pose, as fast as the robot can, looking ahead.
    #[must_use]
    pub fn to(pose: Pose) -> Self {
        Self { target: Target::Pose(pose), facing: Facing::Path, speed: f64::INFINITY }
    }
}

/// What is known now.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// s; never earlier than at the tick before.
    pub time: f64,
    /// Where the robot believes to be.
    pub pose: Pose,
    /// Its velocity in its heading, where it is known better than from what was commanded (m/s, m/s, rad/s).
    pub velocity: Option<[f64; 3]>,
    /// Who is in the way.
    pub obstacles: &'a [Obstacle],
}

/// Why the robot does not walk to where it was sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// A number of the view or the goal is not finite.
    NotFinite(&'static str),
    /// Time ran backwards.
    Backwards,
    /// Obstacles leave no way; it stands and turns to the goal.
    Enclosed,
    /// No free place near the goal.
    NoFreeGoal,
    /// The quadratic program was not solved.
    Unsolved,
}

impl std::fmt::Display for Cause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotFinite(what) => write!(f, "{what} is not finite"),
            Self::Backwards => f.write_str("time runs backwards"),
            Self::Enclosed => f.write_str("obstacles leave no way to the goal"),
            Self::NoFreeGoal => f.write_str("no free place near the goal"),
            Self::Unsolved => f.write_str("the tracking problem was not solved"),
        }
    }
}

/// How it goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Status {
    /// On its way.
    Walking,
    /// There.
    Arrived,
    /// It stands, or turns on the spot, and this is why.
    Stopped(Cause),
}

/// Why a goal was replaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Replaced {
    /// It lies off the field.
    OffField,
    /// It lies inside a keep-out.
    InKeepOut,
}

impl std::fmt::Display for Replaced {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::OffField => "the goal lies off the field; the nearest place on it is walked to",
            Self::InKeepOut => "the goal lies inside a keep-out; the nearest free place is walked to",
        })
    }
}

/// What to ask of walking.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Ahead, to the left (m/s), counter-clockwise (rad/s).
    pub velocity: [f64; 3],
    /// How it goes.
    pub status: Status,
    /// Where it walks instead of to the goal, and why.
    pub replaced: Option<([f64; 2], Replaced)>,
}

/// Navigation of one robot.
#[derive(Debug, Clone)]
pub struct Navigator {
    limits: RobotLimits,
    settings: Settings,
    half: [f64; 2],
    planner: Planner,
    linearised: Linearised,
    problem: Problem,
    commands: Commands,
    /// Commands with the times when they were given.
    given: VecDeque<(f64, [f64; 3])>,
    velocity: [f64; 3],
    time: Option<f64>,
    planned: f64,
    planned_to: [f64; 2],
    enclosed: bool,
    kept: Option<([f64; 2], Bend)>,
    flips: usize,
    arrived: bool,
    polygons: Vec<Polygon>,
    prediction: [State; STAGES],
    clock: Option<fn() -> f64>,
    times: [f64; 2],
}

impl Navigator {
    /// For a robot on a field.
    ///
    /// # Errors
    /// A limit or a setting that cannot be.
    pub fn new(field: &Field, limits: RobotLimits, settings: Settings) -> Result<Self, NavigationError> {
        limits.validate()?;
        settings.validate()?;
        let edge = |size: f64| 0.5 * size + field.border - settings.border_margin;
        let problem = Problem {
            start: State::default(),
            last: [0.0; 3],
            response: Response::new(&limits, settings.model, DT),
            bounds: limits.bounds(),
            change: limits.rates().map(|rate| rate * DT),
            reference: Reference::default(),
            effort_from_rest: settings.model == Model::Printed,
            keep_outs: [KeepOut::default(); MOST_KEEP_OUTS],
            count: 0,
            half: [edge(field.length), edge(field.width)],
        };
        Ok(Self {
            limits,
            settings,
            half: problem.half,
            planner: Planner::default(),
            linearised: Linearised::default(),
            problem,
            commands: [[0.0; 3]; STAGES],
            given: VecDeque::with_capacity(KEPT),
            velocity: [0.0; 3],
            time: None,
            planned: f64::NEG_INFINITY,
            planned_to: [f64::NAN; 2],
            enclosed: false,
            kept: None,
            flips: 0,
            arrived: false,
            polygons: Vec::with_capacity(MOST_POLYGONS),
            prediction: [State::default(); STAGES],
            clock: None,
            times: [0.0; 2],
        })
    }

    /// The way that is followed, m.
    #[must_use]
    pub fn path(&self) -> &[[f64; 2]] {
        self.planner.path()
    }

    /// Poses that the robot is predicted to take, [`DT`] apart; without meaning with [`Tracker::Direct`].
    #[must_use]
    pub fn prediction(&self) -> &[State; STAGES] {
        &self.prediction
    }

    /// How often the side on which an obstacle is passed has changed.
    #[must_use]
    pub fn flips(&self) -> usize {
        self.flips
    }

    /// Radius round an obstacle's middle that the robot's middle keeps out of, m.
    #[must_use]
    pub fn keep_out(&self, obstacle: &Obstacle) -> f64 {
        obstacle.radius + self.limits.radius
    }

    /// Measures ticks with `clock`, s.
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.clock = Some(clock);
    }

    /// What planning and tracking took in the last tick, s; zero where there was none, or no clock.
    #[must_use]
    pub fn times(&self) -> [f64; 2] {
        self.times
    }

    fn now(&self) -> f64 {
        self.clock.map_or(0.0, |clock| clock())
    }

    /// The problem of the last tick, for benches and reports.
    #[must_use]
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// One tick: which velocity to walk with now.
    pub fn tick(&mut self, view: &View, goal: &Goal) -> Command {
        self.times = [0.0; 2];
        if let Some(cause) = self.refuse(view, goal) {
            return self.stop(view.time, 0.0, cause);
        }
        let dt = self.time.map_or(0.0, |before| view.time - before);
        let start = self.predict_start(view, dt);
        self.time = Some(view.time);
        let delay = self.delay();
        self.place_keep_outs(view, &start, delay);
        let (reference, replaced) = match goal.target {
            Target::InTime(pose_at) => (in_time(pose_at, view.time + delay), None),
            Target::Pose(pose) => match self.toward(view, &start, pose, goal) {
                Ok(found) => found,
                Err(Cause::Enclosed) => {
                    let off = wrap(view.pose.bearing_to(pose.position()) - view.pose.heading);
                    return self.stop(view.time, off, Cause::Enclosed);
                }
                Err(cause) => return self.stop(view.time, 0.0, cause),
            },
        };
        let there = match goal.target {
            Target::Pose(pose) => {
                let place = replaced.map_or(pose.position(), |(place, _)| place);
                let heading = if let Facing::Hold(angle) = goal.facing { angle } else { pose.heading };
                let scale = if self.arrived { 2.0 } else { 1.0 };
                let looks = matches!(goal.facing, Facing::Point(_))
                    || wrap(view.pose.heading - heading).abs() < scale * self.settings.there[1];
                view.pose.distance(&Pose::new(place[0], place[1], 0.0)) < scale * self.settings.there[0] && looks
            }
            Target::InTime(_) => false,
        };
        self.arrived = there && !self.inside(view);
        if self.arrived {
            return Command { replaced, ..self.give(view.time, [0.0; 3], Status::Arrived) };
        }
        self.problem.start = start;
        self.problem.reference = reference;
        self.problem.last = self.given.back().map_or([0.0; 3], |given| given.1);
        let begin = self.now();
        let status = self.track(dt, matches!(goal.target, Target::InTime(_)));
        self.times[1] = self.now() - begin;
        let rates = self.limits.rates();
        let last = self.problem.last;
        let wanted = self.commands[0];
        // What a tick of unknown length may change: as if the time since the last were one of 50 ms at most.
        let step = if dt > 0.0 { dt.min(0.1) } else { 0.05 };
        let velocity =
            std::array::from_fn(|k| last[k] + (wanted[k] - last[k]).clamp(-rates[k] * step, rates[k] * step));
        Command { replaced, ..self.give(view.time, velocity, status) }
    }

    fn refuse(&self, view: &View, goal: &Goal) -> Option<Cause> {
        let wanted = match goal.target {
            Target::Pose(pose) => pose.is_finite(),
            Target::InTime(pose_at) => pose_at(view.time).iter().all(|x| x.is_finite()),
        };
        let facing = match goal.facing {
            Facing::Path => true,
            Facing::Hold(angle) => angle.is_finite(),
            Facing::Point(point) => point[0].is_finite() && point[1].is_finite(),
        };
        if !view.time.is_finite() {
            return Some(Cause::NotFinite("the time"));
        }
        if self.time.is_some_and(|before| view.time < before) {
            return Some(Cause::Backwards);
        }
        if !view.pose.is_finite() || view.velocity.is_some_and(|v| v.iter().any(|x| !x.is_finite())) {
            return Some(Cause::NotFinite("the robot's pose or velocity"));
        }
        if !wanted || !facing || goal.speed.is_nan() {
            return Some(Cause::NotFinite("the goal"));
        }
        if view.obstacles.iter().any(|obstacle| !obstacle.is_valid()) {
            return Some(Cause::NotFinite("an obstacle"));
        }
        None
    }

    fn stop(&mut self, time: f64, turn: f64, cause: Cause) -> Command {
        self.commands = [[0.0; 3]; STAGES];
        let turn = turn.clamp(-0.5 * self.limits.turn, 0.5 * self.limits.turn);
        let at = if time.is_finite() { self.time.map_or(time, |before| before.max(time)) } else { 0.0 };
        self.give(at, [0.0, 0.0, if turn.abs() > 0.1 { turn } else { 0.0 }], Status::Stopped(cause))
    }

    fn give(&mut self, time: f64, velocity: [f64; 3], status: Status) -> Command {
        while self.given.len() >= KEPT
            || self.given.front().is_some_and(|given| given.0 < time - self.limits.delay - GAP)
        {
            self.given.pop_front();
        }
        self.given.push_back((time, velocity));
        Command { velocity, status, replaced: None }
    }

    fn delay(&self) -> f64 {
        if self.settings.model == Model::Printed { 0.0 } else { self.limits.delay }
    }

    /// The command that works at `time`.
    fn working(&self, time: f64) -> [f64; 3] {
        self.given.iter().rev().find(|given| given.0 + self.delay() <= time + 1e-9).map_or([0.0; 3], |given| given.1)
    }

    /// The state when a command of now takes effect.
    fn predict_start(&mut self, view: &View, dt: f64) -> State {
        // The velocity of now from what was commanded, where no one knows better.
        let mut velocity = self.velocity;
        if dt > 0.0 && self.settings.model == Model::Lagged {
            let answer = Response::new(&self.limits, Model::Lagged, dt.min(GAP));
            let before = State { pose: [0.0; 3], velocity };
            velocity = answer.advance(&before, &self.working(view.time - dt)).velocity;
        }
        let velocity = view.velocity.unwrap_or(velocity);
        self.velocity = velocity;
        let mut state = State { pose: [view.pose.x, view.pose.y, view.pose.heading], velocity };
        let delay = self.delay();
        let steps = (delay / 0.02).ceil().max(1.0);
        let answer = Response::new(&self.limits, self.settings.model, delay / steps);
        for k in 0..if delay > 0.0 { steps as usize } else { 0 } {
            state = answer.advance(&state, &self.working(view.time + k as f64 * delay / steps));
        }
        state
    }

    fn inside(&self, view: &View) -> bool {
        view.obstacles.iter().any(|o| {
            let off = [view.pose.x - o.position[0], view.pose.y - o.position[1]];
            off[0].hypot(off[1]) < self.keep_out(o) - self.settings.keep_out_margin
        })
    }

    /// The nearest keep-outs for the tracker, and all (where the robot will meet them) for the planner.
    fn place_keep_outs(&mut self, view: &View, start: &State, delay: f64) {
        let here = [start.pose[0], start.pose[1]];
        self.problem.count = 0;
        self.polygons.clear();
        let reach = self.limits.forward * DT * STAGES as f64;
        for obstacle in view.obstacles {
            let (position, radius) = (obstacle.at(delay), self.keep_out(obstacle));
            let away = [position[0] - here[0], position[1] - here[1]];
            let distance = away[0].hypot(away[1]);
            let closing = obstacle.velocity[0].hypot(obstacle.velocity[1]) * DT * STAGES as f64;
            if distance < radius + reach + closing + 0.5 {
                let keep_out =
                    KeepOut { position, velocity: obstacle.velocity, radius: radius + self.settings.keep_out_margin };
                if self.problem.count < MOST_KEEP_OUTS {
                    self.problem.keep_outs[self.problem.count] = keep_out;
                    self.problem.count += 1;
                } else if let Some(farthest) = self.problem.keep_outs.iter_mut().max_by(|a, b| {
                    let gap = |k: &KeepOut| (k.position[0] - here[0]).hypot(k.position[1] - here[1]) - k.radius;
                    gap(a).total_cmp(&gap(b))
                }) && (farthest.position[0] - here[0]).hypot(farthest.position[1] - here[1]) - farthest.radius
                    > distance - radius
                {
                    *farthest = keep_out;
                }
            }
            let apothem = radius + self.settings.path_margin;
            let center = obstacle.at(delay + meeting(obstacle, here, 0.8 * self.limits.forward));
            let mut polygon = Polygon { center, apothem };
            // A little inside, by noise or by a push: the polygon shrinks to touch the robot, and the tracker leads out.
            let depth = polygon.depth(here);
            if depth > 0.0 && depth < SHALLOW {
                polygon.apothem -= depth;
            }
            if self.polygons.len() < MOST_POLYGONS {
                self.polygons.push(polygon);
            }
        }
    }

    /// The reference to a pose, and where it goes instead.
    #[allow(clippy::type_complexity, reason = "used once")]
    fn toward(
        &mut self,
        view: &View,
        start: &State,
        pose: Pose,
        goal: &Goal,
    ) -> Result<(Reference, Option<([f64; 2], Replaced)>), Cause> {
        let (place, why) = self.free_place(pose.position()).ok_or(Cause::NoFreeGoal)?;
        let moved = (place[0] - self.planned_to[0]).hypot(place[1] - self.planned_to[1]);
        if !(view.time - self.planned < self.settings.plan_period - 1e-9 && moved < 0.02) {
            let begin = self.now();
            self.enclosed = !self.plan(start, place);
            self.times[0] = self.now() - begin;
            self.planned = view.time;
            self.planned_to = place;
        }
        if self.enclosed {
            return Err(Cause::Enclosed);
        }
        let aim = (pose.heading, goal.facing, self.settings.turn_in);
        let reference = along_path(self.planner.path(), start, aim, goal.speed, &self.limits);
        Ok((reference, why.map(|why| (place, why))))
    }

    fn plan(&mut self, start: &State, goal: [f64; 2]) -> bool {
        let keep = self.kept.and_then(|(center, bend)| {
            let gap = |p: &Polygon| (p.center[0] - center[0]).hypot(p.center[1] - center[1]);
            let nearest = self.polygons.iter().enumerate().min_by(|a, b| gap(a.1).total_cmp(&gap(b.1)));
            nearest.filter(|(_, p)| gap(p) < SAME).map(|(i, _)| (i, bend))
        });
        let query = Query {
            start: [start.pose[0], start.pose[1]],
            start_heading: Some(start.pose[2]),
            goal,
            goal_heading: None,
            polygons: &self.polygons,
            half: self.half,
            turn_cost: self.settings.turn_cost,
            inside_price: self.settings.inside_price,
            keep: None,
        };
        let Some(mut route) = self.planner.plan(&query) else { return false };
        if let Some((kept, bend)) = keep
            && route.first.is_some_and(|(polygon, now)| polygon == kept && now != bend)
        {
            match self.planner.plan(&Query { keep, ..query }) {
                Some(same_side) if same_side.cost < route.cost + self.settings.side_bonus => route = same_side,
                _ => {
                    self.flips += 1;
                    if let Some(again) = self.planner.plan(&query) {
                        route = again;
                    }
                }
            }
        }
        self.kept = route.first.map(|(polygon, bend)| (self.polygons[polygon].center, bend));
        true
    }

    /// The nearest place to a goal that is on the field and in no polygon.
    fn free_place(&self, goal: [f64; 2]) -> Option<([f64; 2], Option<Replaced>)> {
        let clamp = |p: [f64; 2]| [p[0].clamp(-self.half[0], self.half[0]), p[1].clamp(-self.half[1], self.half[1])];
        let inside = clamp(goal);
        let free = |p: [f64; 2]| {
            let slack = |k: usize| p[k].abs() <= self.half[k] + 1e-9;
            slack(0) && slack(1) && !self.polygons.iter().any(|polygon| polygon.contains(p))
        };
        if free(inside) {
            return Some((inside, (inside != goal).then_some(Replaced::OffField)));
        }
        let mut best: Option<([f64; 2], f64)> = None;
        let mut consider = |p: [f64; 2]| {
            let distance = (p[0] - goal[0]).hypot(p[1] - goal[1]);
            if best.is_none_or(|(_, least)| distance < least) && free(p) {
                best = Some((p, distance));
            }
        };
        for (i, polygon) in self.polygons.iter().enumerate() {
            let out = polygon.circumradius() + 1e-3;
            let c = polygon.center;
            let off = [inside[0] - c[0], inside[1] - c[1]];
            let size = off[0].hypot(off[1]);
            let first = if size > 1e-9 { off[1].atan2(off[0]) } else { 0.0 };
            // Straight out, then more and more to the sides.
            for k in 0..24 {
                let angle = first + f64::from(k) * std::f64::consts::PI / 12.0;
                consider(clamp([c[0] + out * angle.cos(), c[1] + out * angle.sin()]));
            }
            for other in &self.polygons[i + 1..] {
                let between = [other.center[0] - c[0], other.center[1] - c[1]];
                let (d, r) = (between[0].hypot(between[1]), other.circumradius() + 1e-3);
                if d < out + r && d > (out - r).abs() {
                    let a = (d * d + out * out - r * r) / (2.0 * d);
                    let h = (out * out - a * a).max(0.0).sqrt();
                    let unit = [between[0] / d, between[1] / d];
                    for h in [h, -h] {
                        consider([c[0] + a * unit[0] - h * unit[1], c[1] + a * unit[1] + h * unit[0]]);
                    }
                }
            }
        }
        best.map(|(p, _)| (p, Some(if inside == goal { Replaced::InKeepOut } else { Replaced::OffField })))
    }

    /// Finds the commands that follow the problem's reference.
    fn track(&mut self, dt: f64, timed: bool) -> Status {
        if self.settings.tracker == Tracker::Direct {
            let mut u = self.problem.reference.velocities[0];
            if timed {
                let wanted = self.problem.reference.poses[0];
                let pose = self.problem.start.pose;
                let at = Pose::new(pose[0], pose[1], pose[2]);
                let error = at.relative(&Pose::new(wanted[0], wanted[1], wanted[2]));
                let off = [error.x - DT * u[0], error.y - DT * u[1], error.heading - DT * u[2]];
                u = std::array::from_fn(|k| u[k] + 1.5 * off[k]);
            }
            self.commands = [self.problem.clip(u); STAGES];
            return Status::Walking;
        }
        // The last solution, shifted to now.
        let shift = (dt / DT).min(STAGES as f64);
        let before = self.commands;
        for (i, u) in self.commands.iter_mut().enumerate() {
            let at = (i as f64 + shift).min((STAGES - 1) as f64);
            let (k, share) = (at as usize, at.fract());
            let next = before[(k + 1).min(STAGES - 1)];
            *u = std::array::from_fn(|j| before[k][j] + share * (next[j] - before[k][j]));
        }
        let status = match self.settings.tracker {
            Tracker::Linearised => self.linearised.solve(&self.problem, &mut self.commands),
            _ => {
                nonlinear::solve(&self.problem, &mut self.commands);
                QpStatus::Optimal
            }
        };
        if status != QpStatus::Optimal || self.commands[0].iter().any(|u| !u.is_finite()) {
            self.commands = [[0.0; 3]; STAGES];
            return Status::Stopped(Cause::Unsolved);
        }
        self.prediction = self.problem.predict(&self.commands);
        Status::Walking
    }
}

/// When the robot, walking at `speed` straight toward it, meets an obstacle that goes on as now, s.
fn meeting(obstacle: &Obstacle, here: [f64; 2], speed: f64) -> f64 {
    let [x, y] = [obstacle.position[0] - here[0], obstacle.position[1] - here[1]];
    let [u, v] = obstacle.velocity;
    if u == 0.0 && v == 0.0 {
        return 0.0;
    }
    // |p + v t| = speed t
    let (a, b, c) = (speed * speed - u * u - v * v, x * u + y * v, x * x + y * y);
    let time = if a.abs() < 1e-9 {
        if b < 0.0 { -0.5 * c / b } else { BELIEVED }
    } else {
        let root = b * b + a * c;
        if root < 0.0 { BELIEVED } else { (b + root.sqrt()) / a }
    };
    if time >= 0.0 { time.min(BELIEVED) } else { BELIEVED }
}
