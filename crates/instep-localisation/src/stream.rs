//! Streams: what a robot's localiser was told, in the order in which it was told, with the truth beside it where it is
//! known. Simulated from a [`Scenario`] and a seed, or read from JSON lines.
//!
//! Each line of a file is one object with one key: `{"field": "adult-2024"}`, `{"start": {"x": 3.5, "y": 0, "heading":
//! 0}}`, `{"odometry": {"time": 0.05, "motion": {"x": 0.02, "y": 0, "heading": 0}}}`, `{"frame": {"time": 0.05,
//! "landmarks": [{"class": "L", "position": [2.1, -0.3]}]}}` or `{"truth": {"time": 0.05, "pose": {...}}}`.

use std::io::{BufRead, Write};
use std::path::Path;

use instep_field::{Field, LandmarkClass, Line, Pose};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::localiser::Start;
use crate::map::Map;
use crate::scenario::{Event, Scenario};
use crate::{Frame, LineSight, LocalisationError, Noise, Sight, Step};

/// One thing that a robot was told, or the truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Told {
    /// The field, by name or as the path of its file.
    Field(String),
    /// Where the robot was placed.
    Start(Pose),
    /// A step of odometry.
    Odometry(Step),
    /// A frame of sights, at its arrival.
    Frame(Frame),
    /// The truth, by motion capture or simulator.
    Truth(Truth),
}

/// A true pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// s
    pub time: f64,
    /// `field_from_robot`
    pub pose: Pose,
}

/// A whole run.
#[derive(Debug, Clone, PartialEq)]
pub struct Stream {
    /// The field.
    pub field: Field,
    /// What the localiser may know at the start.
    pub start: Start,
    /// Odometry, frames and truth, in the order of arrival.
    pub told: Vec<Told>,
    /// When the robot is carried away, s.
    pub carried_at: Option<f64>,
}

/// Field of view, rad.
const VIEW: f64 = 110.0 / 180.0 * std::f64::consts::PI;
/// The head swings by so much to each side, rad, in so many seconds.
const PAN: f64 = 50.0 / 180.0 * std::f64::consts::PI;
const PAN_PERIOD: f64 = 4.0;
/// Nearest and farthest sight, m.
const RANGE: [f64; 2] = [0.85, 12.0];
/// Steps of odometry a second.
const ODOMETRY_RATE: f64 = 20.0;
/// Bearing error, rad.
const BEARING: f64 = 1.0 / 180.0 * std::f64::consts::PI;
/// How long errors last, s.
const LASTING_TIME: f64 = 1.0;
const SCALE_TIME: f64 = 20.0;
const GHOST_TIME: f64 = 2.0;
/// Longest piece of a line that is seen as one, m.
const PIECE: f64 = 3.0;
/// When the robot is carried away, s.
const CARRIED_AT: f64 = 5.0;

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Where a camera looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gaze {
    /// From straight ahead to the left, rad.
    pub yaw: f64,
    /// Width of its field of view, rad.
    pub width: f64,
}

/// A camera as a scenario says, with its errors and how they go on from frame to frame: for streams, and for whoever
/// walks a robot and wants to know what it would see.
#[derive(Debug, Clone)]
pub struct Camera<'a> {
    scenario: &'a Scenario,
    noise: Noise,
    rng: ChaCha8Rng,
    /// Lasting part of range and bearing, unit variance, for each landmark and then for each end of each line.
    lasting: Vec<[f64; 2]>,
    scale: f64,
    ghosts: Vec<(f64, LandmarkClass, [f64; 2])>,
    /// Of the last frame, s.
    time: f64,
}

impl<'a> Camera<'a> {
    /// Sees what is on `map`, with errors of their own for each seed.
    pub fn new(scenario: &'a Scenario, map: &Map, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(3);
        let count = map.landmarks().len() + 2 * map.lines().len();
        let lasting = (0..count).map(|_| [normal(&mut rng), normal(&mut rng)]).collect();
        let scale = scenario.range_scale * normal(&mut rng);
        Self { scenario, noise: Noise::default(), rng, lasting, scale, ghosts: Vec::new(), time: 0.0 }
    }

    /// What a robot at `pose` sees at `time`, which never runs backwards, with a head that swings to and fro.
    pub fn look(&mut self, map: &Map, time: f64, pose: &Pose) -> Frame {
        let yaw = PAN * (std::f64::consts::TAU * time / PAN_PERIOD).sin();
        self.look_to(map, time, pose, Gaze { yaw, width: VIEW })
    }

    /// As [`Camera::look`], with the head where `gaze` says.
    pub fn look_to(&mut self, map: &Map, time: f64, pose: &Pose, gaze: Gaze) -> Frame {
        self.advance(time - self.time);
        self.time = time;
        self.frame(map, time, pose, gaze)
    }

    fn advance(&mut self, dt: f64) {
        let kept = (-dt / LASTING_TIME).exp();
        let fresh = (1.0 - kept * kept).sqrt();
        for v in self.lasting.iter_mut().flatten() {
            *v = kept * *v + fresh * normal(&mut self.rng);
        }
        let kept = (-dt / SCALE_TIME).exp();
        self.scale = kept * self.scale + self.scenario.range_scale * (1.0 - kept * kept).sqrt() * normal(&mut self.rng);
    }

    /// Where a point of the robot's frame seems to be; `lasting` names its part of the errors.
    fn seen(&mut self, point: [f64; 2], lasting: Option<usize>) -> [f64; 2] {
        let (range, bearing) = (point[0].hypot(point[1]), point[1].atan2(point[0]));
        let share = if lasting.is_some() { self.scenario.lasting } else { 0.0 };
        let old = lasting.map_or([0.0; 2], |k| self.lasting[k]);
        let mut error = |k: usize| share.sqrt() * old[k] + (1.0 - share).sqrt() * normal(&mut self.rng);
        let [mut along, across] = [error(0), error(1)];
        if self.scenario.bounded {
            // The same order of errors, spread evenly between the bounds: through the normal distribution function.
            along = 2.0 * distribution(along) - 1.0;
        }
        let range = range * (1.0 + self.scale) * (1.0 + self.noise.range_share(range) * along);
        let (s, c) = (bearing + BEARING * across).sin_cos();
        [range * c, range * s]
    }

    /// Whether a point of the robot's frame is in view.
    fn in_view(point: [f64; 2], gaze: Gaze) -> bool {
        let range = point[0].hypot(point[1]);
        let off = instep_field::wrap(point[1].atan2(point[0]) - gaze.yaw);
        (RANGE[0]..=RANGE[1]).contains(&range) && off.abs() <= gaze.width / 2.0
    }

    fn any_class(&mut self) -> LandmarkClass {
        // As paper 4's detector: L, goal post, T, X.
        let classes = [LandmarkClass::L, LandmarkClass::GoalPost, LandmarkClass::T, LandmarkClass::X];
        classes[self.rng.random_range(0..classes.len())]
    }

    fn frame(&mut self, map: &Map, time: f64, pose: &Pose, gaze: Gaze) -> Frame {
        let mut landmarks: Vec<(f64, Sight)> = Vec::new();
        let add = |list: &mut Vec<(f64, Sight)>, class, position: [f64; 2]| {
            let sight = Sight { class, position, confidence: 1.0, covariance: None };
            list.push((position[0].hypot(position[1]), sight));
        };
        for (k, &(class, at)) in map.landmarks().iter().enumerate() {
            let point = pose.local_from_outer(at);
            if !Self::in_view(point, gaze) || self.rng.random::<f64>() < self.scenario.missed {
                continue;
            }
            let class = if self.rng.random::<f64>() < self.scenario.confused { self.any_class() } else { class };
            let position = self.seen(point, Some(k));
            add(&mut landmarks, class, position);
        }
        landmarks.sort_by(|a, b| a.0.total_cmp(&b.0));
        landmarks.truncate(self.scenario.most);
        for (distance, sight) in &mut landmarks {
            if self.rng.random::<f64>() >= self.scenario.false_share {
                continue;
            }
            // Even over the area in view.
            let [near, far] = RANGE.map(|r| r * r);
            *distance = (near + (far - near) * self.rng.random::<f64>()).sqrt();
            let bearing = gaze.yaw + gaze.width * (self.rng.random::<f64>() - 0.5);
            sight.position = [*distance * bearing.cos(), *distance * bearing.sin()];
            sight.class = self.any_class();
            if self.rng.random::<f64>() < self.scenario.ghost_share {
                self.ghosts.push((time + GHOST_TIME, sight.class, pose.outer_from_local(sight.position)));
            }
        }
        self.ghosts.retain(|g| g.0 > time);
        for k in 0..self.ghosts.len() {
            let (_, class, at) = self.ghosts[k];
            let point = pose.local_from_outer(at);
            if Self::in_view(point, gaze) {
                let position = self.seen(point, None);
                add(&mut landmarks, class, position);
            }
        }
        landmarks.sort_by(|a, b| a.0.total_cmp(&b.0));
        landmarks.truncate(self.scenario.most);
        let lines = if self.scenario.lines { self.lines(map, pose, gaze) } else { Vec::new() };
        Frame { time, landmarks: landmarks.into_iter().map(|l| l.1).collect(), lines }
    }

    /// The longest piece in view of each line, no longer than [`PIECE`]; a fifth is missed.
    fn lines(&mut self, map: &Map, pose: &Pose, gaze: Gaze) -> Vec<LineSight> {
        let mut sights = Vec::new();
        let landmarks = map.landmarks().len();
        for (k, line) in map.lines().iter().enumerate() {
            let steps = (line.length() / 0.1).ceil().max(1.0);
            let (mut run, mut best) = (0_usize, (0_usize, 0_usize));
            for i in 0..=steps as usize {
                let point = pose.local_from_outer(line.point(i as f64 / steps));
                run = if Self::in_view(point, gaze) && point[0].hypot(point[1]) < 6.0 { run + 1 } else { 0 };
                if run > best.1 {
                    best = (i + 1 - run, run);
                }
            }
            let longest = (PIECE / (line.length() / steps)) as usize;
            let (begin, count) = (best.0, best.1.min(longest));
            // Less than half a metre is hardly told from a mark; a long arc is no straight piece.
            let count = if matches!(line, Line::Circle { .. }) { count.min(10) } else { count };
            if count < 6 || self.rng.random::<f64>() < 0.2 {
                continue;
            }
            let end = |i: usize| pose.local_from_outer(line.point(i as f64 / steps));
            let from = self.seen(end(begin), Some(landmarks + 2 * k));
            let to = self.seen(end(begin + count - 1), Some(landmarks + 2 * k + 1));
            sights.push(LineSight { from, to });
        }
        sights
    }
}

/// The normal distribution function, to 1e-7 (Abramowitz and Stegun 7.1.26).
fn distribution(x: f64) -> f64 {
    let z = x.abs() / std::f64::consts::SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * z);
    let poly =
        t * (0.254_829_592 + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let erf = 1.0 - poly * (-z * z).exp();
    if x < 0.0 { 0.5 - 0.5 * erf } else { 0.5 + 0.5 * erf }
}

impl Stream {
    /// Simulates a scenario. Same scenario and seed, same stream.
    ///
    /// # Errors
    /// [`LocalisationError`] when the scenario's field cannot be used.
    pub fn simulate(scenario: &Scenario, seed: u64) -> Result<Stream, LocalisationError> {
        let field = Field::named(scenario.field)
            .map_err(|e| LocalisationError::File { file: scenario.name.to_owned(), detail: e.to_string() })?;
        let map = Map::new(&field, true)?;
        let stream = |k: u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(k);
            rng
        };
        let (mut odometry, mut chance) = (stream(1), stream(2));
        let mut camera = Camera::new(scenario, &map, seed);

        let carried = (scenario.event == Event::Carried).then(|| place_to_be_carried_to(scenario, &map, &mut chance));
        let truth = |time: f64| match &carried {
            // It goes on with the same motions from the new place.
            Some(place) if time >= CARRIED_AT - 1e-9 => {
                place.then(&scenario.star(CARRIED_AT).relative(&scenario.star(time)))
            }
            _ => scenario.star(time),
        };
        let factor = scenario.odometry;
        let scales = [1.0 + factor * 0.05 * normal(&mut odometry), 1.0 + factor * 0.10 * normal(&mut odometry)];
        let bias = factor * 0.1_f64.to_radians() * if odometry.random::<bool>() { 1.0 } else { -1.0 };

        let dt = 1.0 / ODOMETRY_RATE;
        let steps = (scenario.duration * ODOMETRY_RATE).round() as usize;
        let mut told = Vec::new();
        let mut waiting: std::collections::VecDeque<Frame> = std::collections::VecDeque::new();
        let mut next_frame = 0.0;
        let mut before = truth(0.0);
        for k in 0..=steps {
            let time = k as f64 * dt;
            let now = truth(time);
            let mut motion = before.relative(&now);
            if carried.is_some() && (time - CARRIED_AT).abs() < dt / 2.0 {
                // In the hands of a person the legs tell nothing; the gyro does.
                motion = Pose::new(0.0, 0.0, motion.heading);
            }
            let step = motion.x.hypot(motion.y);
            if k > 0 {
                let error = |rng: &mut ChaCha8Rng| factor * (0.03 * dt.sqrt() * normal(rng) + 0.1 * step * normal(rng));
                motion = Pose::new(
                    scales[0] * motion.x + error(&mut odometry),
                    scales[1] * motion.y + error(&mut odometry),
                    motion.heading + bias * dt,
                );
            }
            told.push(Told::Truth(Truth { time, pose: now }));
            told.push(Told::Odometry(Step { time, motion }));
            if time >= next_frame - 1e-9 {
                waiting.push_back(camera.look(&map, time, &now));
                next_frame += 1.0 / scenario.rate;
            }
            while waiting.front().is_some_and(|f| f.time + scenario.delay <= time + 1e-9) {
                told.extend(waiting.pop_front().map(Told::Frame));
            }
            before = now;
        }
        let begin = truth(0.0);
        let start = match scenario.event {
            Event::OwnHalf => Start::OwnHalf,
            Event::StartError([low, high]) => {
                let far = low + (high - low) * chance.random::<f64>();
                let angle = std::f64::consts::TAU * chance.random::<f64>();
                let turn = 0.4 * (chance.random::<f64>() - 0.5);
                let pose = Pose::new(begin.x + far * angle.cos(), begin.y + far * angle.sin(), begin.heading + turn);
                Start::Near { pose, position_sigma: 0.1, heading_sigma: 0.05 }
            }
            Event::None | Event::Carried => {
                let mut near = |sigma: f64| sigma * normal(&mut chance);
                let pose = Pose::new(begin.x + near(0.1), begin.y + near(0.1), begin.heading + near(0.05));
                Start::Near { pose, position_sigma: 0.1, heading_sigma: 0.05 }
            }
        };
        Ok(Stream { field, start, told, carried_at: carried.map(|_| CARRIED_AT) })
    }

    /// Reads JSON lines. Without a `start` nothing is known of the start.
    ///
    /// # Errors
    /// [`LocalisationError`] with file and line.
    pub fn load(path: &Path) -> Result<Stream, LocalisationError> {
        let file = std::fs::File::open(path).map_err(|e| LocalisationError::file(path, e))?;
        let mut told = Vec::new();
        for (number, line) in std::io::BufReader::new(file).lines().enumerate() {
            let line = line.map_err(|e| LocalisationError::file(path, e))?;
            if line.trim().is_empty() {
                continue;
            }
            let one = serde_json::from_str(&line)
                .map_err(|e| LocalisationError::file(path, format!("line {}: {e}", number + 1)))?;
            told.push(one);
        }
        Stream::of(told, &path.display().to_string())
    }

    /// A run of what was told; `source` is what errors name. Field and start are taken out of the list.
    ///
    /// # Errors
    /// [`LocalisationError`] for a field that cannot be, and for a run without a single frame.
    pub fn of(told: Vec<Told>, source: &str) -> Result<Stream, LocalisationError> {
        let refuse = |detail: String| LocalisationError::File { file: source.to_owned(), detail };
        let (mut name, mut start) = ("adult-2024".to_owned(), Start::Anywhere);
        let mut rest = Vec::with_capacity(told.len());
        for one in told {
            match one {
                Told::Field(field) => name = field,
                Told::Start(pose) if pose.is_finite() => {
                    start = Start::Near { pose, position_sigma: 0.3, heading_sigma: 0.2 };
                }
                Told::Start(pose) => return Err(refuse(format!("start {pose:?}; expected finite numbers"))),
                Told::Truth(truth) if !(truth.time.is_finite() && truth.pose.is_finite()) => {
                    return Err(refuse(format!("truth {truth:?}; expected finite numbers")));
                }
                other => rest.push(other),
            }
        }
        if !rest.iter().any(|t| matches!(t, Told::Frame(_))) {
            return Err(refuse("no frame of sights; expected at least one".to_owned()));
        }
        let field = Field::named_or_load(&name).map_err(|e| refuse(e.to_string()))?;
        Ok(Stream { field, start, told: rest, carried_at: None })
    }

    /// Writes JSON lines that [`Stream::load`] reads.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&self, to: &mut impl Write) -> std::io::Result<()> {
        let mut line = |told: &Told| -> std::io::Result<()> {
            serde_json::to_writer(&mut *to, told)?;
            to.write_all(b"\n")
        };
        line(&Told::Field(self.field.name.clone()))?;
        if let Start::Near { pose, .. } = self.start {
            line(&Told::Start(pose))?;
        }
        self.told.iter().try_for_each(line)
    }
}

/// Anywhere from where the motions that follow stay on the field.
fn place_to_be_carried_to(scenario: &Scenario, map: &Map, rng: &mut ChaCha8Rng) -> Pose {
    let [length, width] = map.half();
    let begin = scenario.star(CARRIED_AT);
    let mut place = begin;
    // A star fits on every field; a thousand tries find a place long before.
    for _ in 0..1000 {
        let mut even = |half: f64| half * (2.0 * rng.random::<f64>() - 1.0);
        place = Pose::new(even(length), even(width), even(std::f64::consts::PI));
        let stays = |k: usize| {
            let time = CARRIED_AT + k as f64 * 0.25;
            let then = place.then(&begin.relative(&scenario.star(time)));
            time > scenario.duration || map.contains(then.position(), 0.0)
        };
        if (0..100).all(stays) && place.distance(&begin) > 1.0 {
            break;
        }
    }
    place
}
