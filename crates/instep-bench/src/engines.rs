//! The engines that KickBench knows, by name, and what it needs to know of a robot.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use instep_kick::adaptive::{AdaptiveKick, AdaptiveSettings, GRID_FILE, Stabiliser, load_grid};
use instep_kick::bound::Bounds;
use instep_kick::dynamic::{DynamicKick, DynamicSettings, Feedback, Pid};
use instep_kick::gaze::{Gaze, Gazing};
use instep_kick::policy::{LearnedKick, PolicySettings};
use instep_kick::preview::{Com, PreviewKick, PreviewSettings, Stabiliser as PreviewStabiliser};
use instep_kick::{BallModel, Build, Derive, KickEngine, Settings};
use instep_robot::Robot;
use instep_sim::settings::{Ball, Fidelity, WorldSettings};
use instep_walk::in_gait::InGaitSettings;

use crate::BenchError;
use crate::in_gait::InGaitKick;
use crate::scenario::Size;
use crate::walk_up::{WalkUp, WalkUpSettings};

/// An engine that was made for a robot, or why not.
type Made = Result<Box<dyn KickEngine + Send>, BenchError>;

/// An engine, or one that differs from another in a setting.
struct Entry {
    name: &'static str,
    /// Its settings' file in a robot's folder.
    file: &'static str,
    /// Makes it from that file's path and text.
    make: fn(&Subject, &str, &str) -> Made,
}

impl Entry {
    /// The engine that it is a form of.
    fn family(&self) -> &str {
        self.name.split('-').next().unwrap_or(self.name)
    }

    /// Whether it can do without a file: settings that were found by tuning, and policies, cannot.
    fn follows_from_robot(&self) -> bool {
        self.file.strip_suffix(".toml") == Some(self.family()) && self.family() != "policy"
    }

    /// Whether it looks its strokes up in a measured grid.
    fn needs_grid(&self) -> bool {
        self.family() == "adaptive"
    }
}

/// Every engine: one line each.
const ENTRIES: &[Entry] = &[
    Entry { name: "dynamic", file: "dynamic.toml", make: |subject, file, text| subject.dynamic(file, text, |_| ()) },
    Entry {
        name: "dynamic-open",
        file: "dynamic.toml",
        make: |subject, file, text| subject.dynamic(file, text, |settings| settings.feedback.on = false),
    },
    Entry {
        name: "dynamic-paper",
        file: "dynamic.toml",
        make: |subject, file, text| subject.dynamic(file, text, |settings| by_pressure(&mut settings.feedback)),
    },
    Entry {
        name: "dynamic-tuned",
        file: "dynamic-tuned.toml",
        make: |subject, file, text| subject.dynamic(file, text, |_| ()),
    },
    Entry { name: "preview", file: "preview.toml", make: |subject, file, text| subject.preview(file, text, |_| ()) },
    Entry {
        name: "preview-paper",
        file: "preview.toml",
        make: |subject, file, text| {
            subject.preview(file, text, |settings| {
                settings.com = Com::TwoLink;
                settings.stabilisers = vec![PreviewStabiliser::Preview];
            })
        },
    },
    Entry {
        name: "preview-filter",
        file: "preview.toml",
        make: |subject, file, text| {
            subject.preview(file, text, |settings| settings.stabilisers = vec![PreviewStabiliser::Preview])
        },
    },
    Entry {
        name: "preview-two-link",
        file: "preview.toml",
        make: |subject, file, text| subject.preview(file, text, |settings| settings.com = Com::TwoLink),
    },
    Entry {
        name: "preview-tuned",
        file: "preview-tuned.toml",
        make: |subject, file, text| subject.preview(file, text, |_| ()),
    },
    Entry { name: "adaptive", file: "adaptive.toml", make: |subject, file, text| subject.adaptive(file, text, |_| ()) },
    Entry {
        name: "adaptive-tuned",
        file: "adaptive-tuned.toml",
        make: |subject, file, text| subject.adaptive(file, text, |_| ()),
    },
    Entry {
        name: "adaptive-once",
        file: "adaptive.toml",
        make: |subject, file, text| subject.adaptive(file, text, |settings| settings.feedback.follow_ball = false),
    },
    Entry {
        name: "adaptive-sphere",
        file: "adaptive.toml",
        make: |subject, file, text| subject.adaptive(file, text, |settings| settings.kick.true_shape = false),
    },
    Entry {
        name: "adaptive-inclination",
        file: "adaptive.toml",
        make: |subject, file, text| {
            subject.adaptive(file, text, |settings| settings.stabiliser = Stabiliser::Inclination)
        },
    },
    Entry {
        name: "adaptive-paper",
        file: "adaptive.toml",
        make: |subject, file, text| {
            subject.adaptive(file, text, |settings| {
                settings.stabiliser = Stabiliser::Inclination;
                settings.kick.true_shape = false;
            })
        },
    },
    Entry { name: "in-gait", file: "in-gait.toml", make: |subject, file, text| subject.in_gait(file, text) },
    Entry { name: "walk-up", file: "walk-up.toml", make: |subject, file, text| subject.walk_up(file, text) },
    Entry { name: "policy", file: "policy.toml", make: |subject, file, text| subject.policy(file, text) },
];

/// Names of the engines. `dynamic-open` is `dynamic` with its closed loop off, `…-tuned` an engine with the settings that
/// `instep tune` found. `adaptive-once` plans the retraction once, `adaptive-sphere` takes the foot for a sphere,
/// `adaptive-inclination` has the paper's stabiliser. `…-paper` is an engine with its paper's own stabiliser and placement alone:
/// `dynamic-paper` the PID on foot pressure, `adaptive-paper` body inclination and the foot as a sphere, `preview-paper` the filter
/// with the preview loop (alone: `preview-filter`) and the two-link arm (alone: `preview-two-link`). `policy` starts in a
/// run-up, `in-gait` from the stand a run-up away from the ball; `walk-up` walks to where a standing engine kicks from.
pub fn engines() -> impl Iterator<Item = &'static str> {
    ENTRIES.iter().map(|entry| entry.name)
}

/// The engines that are compared unless others are asked for: one of each kind, as it is meant to be used.
pub const LEADING: [&str; 4] = ["dynamic", "adaptive", "preview-tuned", "policy"];

/// Paper 2's loop (section 3.5): PID on the centre of pressure and nothing else.
fn by_pressure(feedback: &mut Feedback) {
    let pid = Pid { p: 0.1, i: 0.2, d: 0.02, limit: feedback.x.limit };
    *feedback = Feedback { x: pid, y: pid, tilt: 0.0, rate: 0.0, ..*feedback };
}

/// A robot with what its trials share.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The robot.
    pub robot: Arc<Robot>,
    /// The ball that it plays.
    pub ball: BallModel,
    /// Its size and its ball's.
    pub size: Size,
    /// The footprint's origin in the world when the robot stands, m.
    pub footprint: [f64; 2],
    folder: PathBuf,
    /// The world in which it is tried, where that is not its default one.
    world: Option<WorldSettings>,
    /// Settings of the engines by their file's name, where they are not those of the folder.
    settings: BTreeMap<&'static str, String>,
}

impl Subject {
    /// Loads `name` from the folder of robots.
    ///
    /// # Errors
    /// As [`Subject::of`], or when the robot cannot be read.
    pub fn load(robots: &Path, name: &str) -> Result<Self, BenchError> {
        Self::of(Robot::load(&robots.join(name))?)
    }

    /// For a loaded robot, with the ball of its folder.
    ///
    /// # Errors
    /// When the ball cannot be read.
    pub fn of(robot: Robot) -> Result<Self, BenchError> {
        let folder = robot.folder().to_owned();
        let ball = BallModel::load(&folder)?;
        let data = robot.data();
        let [left, right] = [0, 1].map(|side| data.point(&robot.legs[side].sole));
        let middle = 0.5 * (left + right);
        let strikers = robot.legs.iter().flat_map(|leg| &leg.strike);
        let toes = strikers
            .map(|&geom| {
                let (ends, radius) = data.capsule(geom);
                ends[0].x.max(ends[1].x) + radius - middle.x
            })
            .fold(0.0, f64::max);
        let size = Size {
            leg: robot.leg_length(),
            half_width: 0.5 * (left.y - right.y).abs(),
            toes,
            ball: ball.radius,
            deceleration: ball.deceleration,
        };
        let footprint = [middle.x, middle.y];
        Ok(Self { robot: Arc::new(robot), ball, size, footprint, folder, world: None, settings: BTreeMap::new() })
    }

    /// The file that holds the settings of the engine called `name` for this robot.
    ///
    /// # Errors
    /// When there is no such engine.
    pub fn settings_file(&self, name: &str) -> Result<PathBuf, BenchError> {
        Ok(self.folder.join(entry(name)?.file))
    }

    /// Whether the engine called `name` has settings for this robot.
    #[must_use]
    pub fn knows(&self, name: &str) -> bool {
        self.settings(name).is_ok()
    }

    /// The settings of the engine called `name`, whole, as TOML: what its file says and for the rest what follows from the robot.
    ///
    /// # Errors
    /// When there is no such engine, or none for this robot.
    pub fn settings(&self, name: &str) -> Result<String, BenchError> {
        let entry = entry(name)?;
        if let Some(text) = self.settings.get(entry.file) {
            return Ok(text.clone());
        }
        let lacks = |file: &Path| {
            let robot = self.robot.name.clone();
            BenchError::NotForRobot { engine: name.into(), robot, file: file.display().to_string() }
        };
        let (file, grid) = (self.folder.join(entry.file), self.folder.join(GRID_FILE));
        if entry.needs_grid() && !grid.exists() {
            return Err(lacks(&grid));
        }
        let text = match std::fs::read_to_string(&file) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound && entry.follows_from_robot() => String::new(),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Err(lacks(&file)),
            Err(error) => return Err(BenchError::File { file: file.display().to_string(), detail: error.to_string() }),
        };
        let (build, file) = (Build::of(&self.robot, &self.ball), file.display().to_string());
        let whole = |settings: Result<String, toml::ser::Error>| {
            settings.map_err(|e| BenchError::File { file: file.clone(), detail: e.to_string() })
        };
        match entry.family() {
            "dynamic" => whole(toml::to_string(&DynamicSettings::of(&build, &file, &text)?)),
            "adaptive" => whole(toml::to_string(&AdaptiveSettings::of(&build, &file, &text)?)),
            "preview" => whole(toml::to_string(&PreviewSettings::of(&build, &file, &text)?)),
            _ => Ok(text),
        }
    }

    /// The same robot with other settings, the text of a TOML file, for the engine called `name` and those that share its file.
    ///
    /// # Errors
    /// When there is no such engine.
    pub fn with_settings(mut self, name: &str, text: String) -> Result<Self, BenchError> {
        self.settings.insert(entry(name)?.file, text);
        Ok(self)
    }

    /// The robot's default world: its ball, its drives and senses as they were built.
    #[must_use]
    pub fn default_world(&self) -> WorldSettings {
        world(&self.ball).as_built(&self.robot)
    }

    /// The world in which it is tried: the default one unless [`Subject::in_world`] says another.
    #[must_use]
    pub fn world(&self) -> WorldSettings {
        self.world.unwrap_or_else(|| self.default_world())
    }

    /// The same robot, to be tried in another world; where that has ideal drives, its engines know it.
    #[must_use]
    pub fn in_world(self, world: WorldSettings) -> Self {
        let robot = match world.drives {
            Fidelity::Ideal => Arc::new(Robot::clone(&self.robot).with_ideal_drives()),
            Fidelity::AsBuilt => Arc::clone(&self.robot),
        };
        Self { world: Some(world), robot, ..self }
    }

    /// What the robot's geometry and joint speeds allow of a kick from the stand; `None` for a robot that cannot stand on one foot.
    #[must_use]
    pub fn bounds(&self) -> Option<Bounds> {
        let file = "dynamic.toml";
        let settings = DynamicSettings::parse(file, &self.settings("dynamic").ok()?).ok()?;
        Bounds::new(Arc::clone(&self.robot), self.ball, settings).ok()
    }

    /// The engine called `name`, whose robot looks at the ball where it has a neck.
    ///
    /// # Errors
    /// When there is none, or its settings do not fit the robot.
    pub fn engine(&self, name: &str) -> Made {
        let file = self.settings_file(name)?.display().to_string();
        let engine = (entry(name)?.make)(self, &file, &self.settings(name)?)?;
        Ok(match self.gaze() {
            Some(gaze) => Box::new(Gazing::new(engine, gaze)),
            None => engine,
        })
    }

    /// The robot's neck, where it has one.
    #[must_use]
    pub fn gaze(&self) -> Option<Gaze> {
        Gaze::of(&self.robot, self.footprint)
    }

    fn dynamic(&self, file: &str, text: &str, change: fn(&mut DynamicSettings)) -> Made {
        let mut settings = DynamicSettings::parse(file, text)?;
        change(&mut settings);
        Ok(Box::new(DynamicKick::new(Arc::clone(&self.robot), self.ball, settings)?))
    }

    fn preview(&self, file: &str, text: &str, change: fn(&mut PreviewSettings)) -> Made {
        let mut settings = PreviewSettings::parse(file, text)?;
        change(&mut settings);
        Ok(Box::new(PreviewKick::new(Arc::clone(&self.robot), self.ball, settings)?))
    }

    fn policy(&self, file: &str, text: &str) -> Made {
        let settings = PolicySettings::parse(file, text)?;
        let policy = settings.load_policy(&self.folder)?;
        Ok(Box::new(LearnedKick::new(&self.robot, self.ball, &policy, settings)?))
    }

    fn in_gait(&self, file: &str, text: &str) -> Made {
        let settings = InGaitSettings::parse(file, text)?;
        Ok(Box::new(InGaitKick::new(&self.robot, self.ball, settings, self.footprint)?))
    }

    fn walk_up(&self, file: &str, text: &str) -> Made {
        let settings: WalkUpSettings = toml::from_str(text)
            .map_err(|e| BenchError::File { file: file.into(), detail: e.to_string().trim_end().to_owned() })?;
        let wrong = |field: &str, found: String, expected: &str| {
            Err(BenchError::Field { file: file.into(), field: field.into(), found, expected: expected.into() })
        };
        let inner = entry(&settings.engine)?;
        // One that walks itself would walk for ever.
        if !matches!(inner.family(), "dynamic" | "preview" | "adaptive") {
            return wrong(
                "engine",
                settings.engine,
                "an engine that kicks from the stand: dynamic, preview or adaptive",
            );
        }
        if !settings.ball.iter().all(|x| x.is_finite()) {
            return wrong("ball", format!("{:?}", settings.ball), "two numbers, m");
        }
        if !(settings.speed > 0.0 && settings.speed.is_finite()) {
            return wrong("speed", settings.speed.to_string(), "a speed above 0 m/s");
        }
        let engine = (inner.make)(self, inner.file, &self.settings(inner.name)?)?;
        Ok(Box::new(WalkUp::new(&self.robot, engine, &settings, self.footprint)?))
    }

    fn adaptive(&self, file: &str, text: &str, change: fn(&mut AdaptiveSettings)) -> Made {
        let mut settings = AdaptiveSettings::parse(file, text)?;
        change(&mut settings);
        let grid = Arc::new(load_grid(&self.folder)?);
        Ok(Box::new(AdaptiveKick::new(Arc::clone(&self.robot), self.ball, settings, grid)?))
    }
}

/// The world's constants for a ball, with ideal drives and senses.
#[must_use]
pub fn world(ball: &BallModel) -> WorldSettings {
    let BallModel { mass, radius, deceleration, .. } = *ball;
    let ball = Ball { mass, radius, rolling_deceleration: deceleration, ..Ball::default() };
    let mut world = WorldSettings { ball, ..WorldSettings::default() };
    // A light ball needs a finer near step than the default for the audit's 2 %.
    world.step.near = 0.0001;
    world
}

fn entry(name: &str) -> Result<&'static Entry, BenchError> {
    ENTRIES.iter().find(|entry| entry.name == name).ok_or_else(|| BenchError::Unknown {
        kind: "engine",
        found: name.into(),
        known: engines().collect::<Vec<_>>().join(", "),
    })
}
