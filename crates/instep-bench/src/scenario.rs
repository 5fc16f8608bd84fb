//! A scenario: a data file that says where balls lie, which kicks are asked, and what the world does to the robot.
//!
//! Lengths that depend on the robot's size are shares of its leg length or of half the distance of its soles, so that
//! one file serves all robots. Every pair of numbers is a range that is drawn from evenly. The draws come from one
//! seeded generator, in a fixed order: same file, robot and seed, same cases.
//!
//! An engine that cannot start from the stand is asked for its own kick from its own start, with the ball a little off its
//! place: by the scenarios with a `run_up`, and by these alone.

use std::path::Path;

use instep_kick::{KickRequest, Strength};
use instep_sim::settings::{ModelError, SensorNoise};
use instep_sim::start::StartErrors;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::BenchError;

/// A range, both ends possible; `[a, a]` is the number a.
pub type Range = [f64; 2];

/// A whole scenario file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Short name, used in tables; the file's stem.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// Where the ball lies, of a robot that stands.
    #[serde(default)]
    pub ball: BallPlace,
    /// Which kick is asked of it.
    #[serde(default)]
    pub kick: Kick,
    /// In place of both: the kick of an engine that has its own start.
    #[serde(default)]
    pub run_up: Option<RunUp>,
    /// How the start differs from the stand, or from the engine's own start: what walking leaves behind.
    #[serde(default)]
    pub start: StartErrors,
    /// Noise and delay of sensors; the ball's noise is also in the request.
    #[serde(default)]
    pub sensors: SensorNoise,
    /// The ground, where it is not the default.
    #[serde(default)]
    pub pitch: PitchRange,
    /// How the robot differs from its model.
    #[serde(default)]
    pub model: ModelRange,
    /// What happens during the kick.
    #[serde(default)]
    pub disturbance: DisturbanceRange,
}

/// Where the ball lies. Either side of the robot, with equal chance. Either by shares of the robot's size, `gap` and `lateral`,
/// or by what a match asks of any robot, `ahead` and `aside`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BallPlace {
    /// Gap between the toes' line and the ball's surface, share of the leg length.
    #[serde(default)]
    pub gap: Range,
    /// Distance of the ball's centre from the middle line, share of half the distance of the soles; below zero is on
    /// the other side.
    #[serde(default)]
    pub lateral: Range,
    /// Distance of the ball's centre ahead of the middle between the soles, m; more where the toes leave it no room.
    pub ahead: Option<Range>,
    /// Distance of the ball's centre from the middle line, m.
    pub aside: Option<Range>,
}

/// Which kick is asked.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kick {
    /// Direction, degrees; positive is toward the middle line and beyond, as seen from the ball's side.
    pub direction_deg: Range,
    /// Speed of the ball as it leaves, m/s.
    pub speed: Range,
    /// Directions are not drawn but taken in turn: this many, evenly from the least to the greatest.
    #[serde(default)]
    pub sweep: Option<usize>,
}

/// The kick of an engine that has its own start: its direction, its speed, nearly its ball; or other balls, taken in turn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunUp {
    /// How far the ball lies from its place, in any direction, share of the leg length.
    pub shift: Range,
    /// In place of the engine's own ball: balls that it is to walk up to.
    #[serde(default)]
    pub places: Vec<RunUpPlace>,
    /// In place of the engine's own: speed of the ball as it leaves, m/s.
    pub speed: Option<Range>,
}

impl RunUp {
    /// Whether it asks for the engine's own kick, nearly.
    #[must_use]
    pub fn is_near(&self) -> bool {
        self.places.is_empty() && self.speed.is_none()
    }
}

/// A ball to be walked up to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunUpPlace {
    /// Footprint frame of the start, m.
    pub ball: [f64; 2],
    /// Where it is to go, degrees from straight ahead to the left.
    pub direction_deg: f64,
}

/// The ground; ranges of the fields of `instep_sim::settings::Pitch`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PitchRange {
    /// Friction between sole and ground.
    pub friction: Option<Range>,
    /// Time constant of the ground, s.
    pub softness: Option<Range>,
}

/// How the robot differs from its model; ranges of the fields of `instep_sim::settings::ModelError`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ModelRange {
    /// Factor on all masses.
    pub mass: Option<Range>,
    /// Shift of the base link's centre of mass forward, share of the leg length.
    pub base_forward: Option<Range>,
    /// The same to the left.
    pub base_left: Option<Range>,
    /// Dry friction of joints, share of the torque limit.
    pub joint_friction: Option<Range>,
}

/// What happens during the kick.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DisturbanceRange {
    /// A push on the base from any side, in m/s that it would give the whole robot.
    pub push: Option<Range>,
    /// When the push starts, s before the contact.
    pub push_before: Option<Range>,
    /// How long it lasts, s; 0.05 when absent.
    pub push_duration: Option<f64>,
    /// How far the ball is moved in any direction, share of the leg length.
    pub ball_moved: Option<Range>,
    /// When the ball is moved, s before the contact.
    pub ball_moved_before: Option<Range>,
    /// Speed of a ball that rolls toward the place where it is to be kicked, m/s.
    pub rolling: Option<Range>,
    /// Which share of the balls rolls; the others lie still. 1 when absent.
    pub rolling_share: Option<f64>,
    /// Where it comes from, degrees from the kick's direction reversed; 0 comes straight at the foot.
    pub rolling_from_deg: Option<Range>,
    /// Seconds from the start after which a rolling ball is at its place with that speed; 1.5 when absent, about a kick's
    /// preparation.
    pub rolling_time: Option<f64>,
}

/// What a scenario needs to know of a robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// Hip to sole with a straight leg, m.
    pub leg: f64,
    /// Half the distance between the soles, m.
    pub half_width: f64,
    /// From the footprint to the toes' line, m.
    pub toes: f64,
    /// Ball's radius, m.
    pub ball: f64,
    /// Deceleration of the rolling ball, m/s^2.
    pub deceleration: f64,
}

/// One case, drawn from a scenario.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// What the engine is told.
    pub request: KickRequest,
    /// Where the ball is at the start, footprint frame, m.
    pub ball: [f64; 2],
    /// How it moves then, m/s.
    pub ball_velocity: [f64; 2],
    /// Ground friction and softness.
    pub pitch: [Option<f64>; 2],
    /// How the robot differs.
    pub model: ModelError,
    /// Push: seconds before contact, duration, velocity change (m/s, footprint frame).
    pub push: Option<(f64, f64, [f64; 2])>,
    /// The ball is moved: seconds before contact, by how much, m.
    pub ball_moved: Option<(f64, [f64; 2])>,
    /// The direction as the scenario says it, rad: positive toward the middle line, as seen from the ball's side.
    pub turn: f64,
    /// +1 for a ball on the left, -1 for one on the right.
    pub side: f64,
    /// How the start differs from the stand.
    pub start: StartErrors,
    /// Seed of the trial's noise.
    pub seed: u64,
}

/// Room between toes and ball where a scenario would have put the ball into the feet, m.
const ROOM: f64 = 0.005;
/// Seconds of rolling that a moving ball's place is drawn for where the scenario says nothing.
const ROLL_TIME: f64 = 1.5;

impl Case {
    /// `request` as it stands: the ball lies where it says, nothing disturbs, all noise is of `seed`.
    #[must_use]
    pub fn of(request: &KickRequest, seed: u64) -> Self {
        Self {
            request: *request,
            ball: request.ball.map(|v| if v.is_finite() { v } else { 1.0 }),
            ball_velocity: request.ball_velocity.map(|v| if v.is_finite() { v } else { 0.0 }),
            pitch: [None; 2],
            model: ModelError::default(),
            push: None,
            ball_moved: None,
            turn: request.direction,
            side: 1.0,
            start: StartErrors { joint: 0.0, joint_speed: 0.0, base_speed: 0.0 },
            seed,
        }
    }
}

impl Scenario {
    /// Reads and checks a scenario file.
    ///
    /// # Errors
    /// When the file is missing, is not TOML of this layout, or has a range that cannot be.
    pub fn load(file: &Path) -> Result<Self, BenchError> {
        let name = file.display().to_string();
        let text = std::fs::read_to_string(file)
            .map_err(|e| BenchError::File { file: name.clone(), detail: e.to_string() })?;
        let scenario: Self = toml::from_str(&text)
            .map_err(|e| BenchError::File { file: name.clone(), detail: e.to_string().trim_end().to_owned() })?;
        scenario.validate(&name)?;
        Ok(scenario)
    }

    /// All scenarios of a folder, by file name.
    ///
    /// # Errors
    /// As [`Scenario::load`], or when the folder cannot be read.
    pub fn load_all(folder: &Path) -> Result<Vec<Self>, BenchError> {
        let wrong = |e: std::io::Error| BenchError::File { file: folder.display().to_string(), detail: e.to_string() };
        let mut files: Vec<_> = std::fs::read_dir(folder)
            .map_err(wrong)?
            .filter_map(|entry| entry.ok().map(|e| e.path()))
            .filter(|path| path.extension().is_some_and(|e| e == "toml"))
            .collect();
        files.sort();
        files.iter().map(|file| Self::load(file)).collect()
    }

    fn validate(&self, file: &str) -> Result<(), BenchError> {
        let d = &self.disturbance;
        let ranges = [
            ("ball.gap", Some(self.ball.gap)),
            ("ball.lateral", Some(self.ball.lateral)),
            ("kick.direction_deg", Some(self.kick.direction_deg)),
            ("kick.speed", Some(self.kick.speed)),
            ("pitch.friction", self.pitch.friction),
            ("pitch.softness", self.pitch.softness),
            ("model.mass", self.model.mass),
            ("model.base_forward", self.model.base_forward),
            ("model.base_left", self.model.base_left),
            ("model.joint_friction", self.model.joint_friction),
            ("disturbance.push", d.push),
            ("disturbance.push_before", d.push_before),
            ("disturbance.ball_moved", d.ball_moved),
            ("disturbance.ball_moved_before", d.ball_moved_before),
            ("disturbance.rolling", d.rolling),
            ("disturbance.rolling_from_deg", d.rolling_from_deg),
            ("ball.ahead", self.ball.ahead),
            ("ball.aside", self.ball.aside),
            ("run_up.shift", self.run_up.as_ref().map(|run_up| run_up.shift)),
            ("run_up.speed", self.run_up.as_ref().and_then(|run_up| run_up.speed)),
        ];
        let (ball, kick) = (self.ball != BallPlace::default(), self.kick != Kick::default());
        let found = match (ball, kick, self.run_up.is_some()) {
            (true, true, false) | (false, false, true) => None,
            (true, _, true) => Some("[ball] beside [run_up]"),
            (false, true, true) => Some("[kick] beside [run_up]"),
            (false, _, false) => Some("no [ball]"),
            (true, false, false) => Some("no [kick]"),
        };
        if let Some(found) = found {
            return Err(BenchError::Field {
                file: file.to_owned(),
                field: "what is asked".into(),
                found: found.into(),
                expected: "[ball] and [kick] of a robot that stands, or [run_up] alone".into(),
            });
        }
        let whole = self.kick.sweep.is_none_or(|count| (2..=1000).contains(&count));
        let time = d.rolling_time.unwrap_or(ROLL_TIME);
        let share = d.rolling_share.unwrap_or(1.0);
        for (field, found, good, expected) in [
            ("kick.sweep", self.kick.sweep.unwrap_or(0) as f64, whole, "a number of directions from 2 to 1000"),
            ("disturbance.rolling_time", time, (0.0..=20.0).contains(&time), "a number in [0, 20] s"),
            ("disturbance.rolling_share", share, (0.0..=1.0).contains(&share), "a share in [0, 1]"),
        ] {
            if !good {
                return Err(BenchError::Field {
                    file: file.to_owned(),
                    field: field.to_owned(),
                    found: found.to_string(),
                    expected: expected.into(),
                });
            }
        }
        for (field, range) in ranges {
            if let Some([low, high]) = range
                && !(low.is_finite() && high.is_finite() && low <= high)
            {
                return Err(BenchError::Field {
                    file: file.to_owned(),
                    field: field.to_owned(),
                    found: format!("[{low}, {high}]"),
                    expected: "two finite numbers, the lower first".into(),
                });
            }
        }
        Ok(())
    }

    /// Whether each case has its own world.
    #[must_use]
    pub fn varies_world(&self) -> bool {
        self.pitch != PitchRange::default() || self.model != ModelRange::default()
    }

    /// The first `count` cases for a robot of `size` and a `seed`.
    #[must_use]
    pub fn cases(&self, size: &Size, seed: u64, count: usize) -> Vec<Case> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..count).map(|i| self.case(size, i, &mut rng)).collect()
    }

    /// The same for an engine whose `own` kick is to be asked, nearly.
    #[must_use]
    pub fn cases_about(&self, own: &KickRequest, size: &Size, seed: u64, count: usize) -> Vec<Case> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let run_up = self.run_up.as_ref();
        let [low, high] = run_up.map_or([0.0; 2], |run_up| run_up.shift);
        (0..count)
            .map(|i| {
                let mut case = self.case(size, i, &mut rng);
                let distance = (low + (high - low) * rng.random::<f64>()) * size.leg;
                let angle = std::f64::consts::TAU * rng.random::<f64>();
                let mut asked = *own;
                if let Some(speed) = run_up.and_then(|run_up| run_up.speed) {
                    let share: f64 = rng.random();
                    asked.strength = Strength::BallSpeed(speed[0] + (speed[1] - speed[0]) * share);
                }
                if let Some(places) = run_up.map(|run_up| &run_up.places).filter(|places| !places.is_empty()) {
                    let place = places[i % places.len()];
                    (asked.ball, asked.direction) = (place.ball, place.direction_deg.to_radians());
                }
                // What noise does to the sight of the ball is in the request already.
                let seen = [0, 1].map(|k| case.request.ball[k] - case.ball[k]);
                case.ball = [asked.ball[0] + distance * angle.cos(), asked.ball[1] + distance * angle.sin()];
                let ball = [0, 1].map(|k| case.ball[k] + seen[k]);
                case.request = KickRequest { ball, ..asked };
                (case.turn, case.side) = (0.0, 1.0);
                case
            })
            .collect()
    }

    fn case(&self, size: &Size, index: usize, rng: &mut ChaCha8Rng) -> Case {
        let mut draw = |[low, high]: Range| {
            let share: f64 = rng.random();
            low + (high - low) * share
        };
        let side = if draw([0.0, 1.0]) < 0.5 { 1.0 } else { -1.0 };
        let gap = draw(self.ball.gap) * size.leg;
        let lateral = draw(self.ball.lateral) * size.half_width;
        let nearest = size.toes + ROOM + size.ball;
        let target = match (self.ball.ahead, self.ball.aside) {
            (None, None) => [size.toes + gap + size.ball, side * lateral],
            (ahead, aside) => {
                [draw(ahead.unwrap_or([nearest; 2])).max(nearest), side * draw(aside.unwrap_or([0.0; 2]))]
            }
        };
        let drawn = draw(self.kick.direction_deg);
        let asked = self.kick.sweep.map_or(drawn, |count| {
            let [low, high] = self.kick.direction_deg;
            low + (high - low) * (index % count) as f64 / count.saturating_sub(1).max(1) as f64
        });
        let direction = -side * asked.to_radians();
        let speed = draw(self.kick.speed);
        let d = &self.disturbance;
        let turn = std::f64::consts::TAU;
        // Every draw happens in every scenario, so that adding one field changes no other case.
        let any = [0.0, 0.0];
        let (push, push_before, push_angle) =
            (draw(d.push.unwrap_or(any)), draw(d.push_before.unwrap_or(any)), draw([0.0, turn]));
        let (moved, moved_before, moved_angle) =
            (draw(d.ball_moved.unwrap_or(any)), draw(d.ball_moved_before.unwrap_or(any)), draw([0.0, turn]));
        let (mut rolling, from) =
            (draw(d.rolling.unwrap_or(any)), draw(d.rolling_from_deg.unwrap_or(any)).to_radians());
        if d.rolling_share.is_some_and(|share| draw([0.0, 1.0]) >= share) {
            rolling = 0.0;
        }
        let mut one = |range: Option<Range>| {
            let value = draw(range.unwrap_or(any));
            range.map(|_| value)
        };
        let pitch = [one(self.pitch.friction), one(self.pitch.softness)];
        let model = ModelError {
            mass: one(self.model.mass).unwrap_or(1.0),
            base_shift: [
                one(self.model.base_forward).unwrap_or(0.0) * size.leg,
                one(self.model.base_left).unwrap_or(0.0) * size.leg,
                0.0,
            ],
            joint_friction: one(self.model.joint_friction).unwrap_or(0.0),
        };
        // Two normal numbers by Box and Muller.
        let (u1, u2) = (draw([f64::EPSILON, 1.0]), draw([0.0, turn]));
        let radius = (-2.0 * u1.ln()).sqrt() * self.sensors.ball;

        // A rolling ball starts where it will pass the drawn place when the foot is ready.
        let heading = direction + std::f64::consts::PI + from;
        let time = if rolling > 0.0 { d.rolling_time.unwrap_or(ROLL_TIME) } else { 0.0 };
        let start_speed = rolling + size.deceleration * time;
        let way = (start_speed - 0.5 * size.deceleration * time) * time;
        let mut ball = [target[0] - way * heading.cos(), target[1] - way * heading.sin()];
        let mut ball_velocity = [start_speed * heading.cos(), start_speed * heading.sin()];
        // A ball cannot come through the robot: it lies still.
        if rolling > 0.0 && ball[0] < nearest && ball[1].abs() < 3.0 * size.half_width + size.ball {
            (ball, ball_velocity) = (target, [0.0; 2]);
        }
        let request = KickRequest {
            ball: [ball[0] + radius * u2.cos(), ball[1] + radius * u2.sin()],
            ball_velocity,
            direction,
            strength: Strength::BallSpeed(speed),
            precision: None,
            deadline: None,
            hold: false,
            foot: None,
        };
        let polar = |length: f64, angle: f64| [length * angle.cos(), length * angle.sin()];
        Case {
            request,
            ball,
            ball_velocity,
            pitch,
            model,
            push: d.push.map(|_| (push_before, d.push_duration.unwrap_or(0.05), polar(push, push_angle))),
            ball_moved: d.ball_moved.map(|_| (moved_before, polar(moved * size.leg, moved_angle))),
            turn: asked.to_radians(),
            side,
            start: self.start,
            seed: rng.random(),
        }
    }
}
