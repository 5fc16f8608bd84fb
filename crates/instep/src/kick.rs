//! `instep kick`: a robot runs a policy, or plays a reference, against a ball; what happens is measured, audited, shown and recorded.

mod engine;
mod page;
mod recording;
mod steps;
mod summary;

pub(crate) use page::page;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use instep_bench::Subject;
use instep_kick::policy::{PERIOD, PolicyKick, PolicySettings};
use instep_kick::{KickPlan, KickRequest, Playback, Settings, Strength};
use instep_motion::phase::Side;
use instep_motion::reference::{Reference, ReferenceKind};
use instep_robot::Robot;
use instep_robot::control::Controller;
use instep_sim::audit::Rerun;
use instep_sim::impact::Impact;
use instep_sim::settings::Change;
use instep_sim::trial::{self, Trial, TrialSettings};
use instep_sim::{BallState, World};
use serde::Serialize;

use crate::failure::Failure;
use crate::output::Output;
use crate::{files, places, worlds};

/// How long the trial goes on after the reference's impact, at least, s: time for the ball to fly and the robot to fall.
const AFTERMATH: f64 = 1.2;
/// The longest trial, s.
const LONGEST: f64 = 120.0;
/// The engine that follows from any robot.
const FOLLOWS: &str = "dynamic";
/// The robot that kicks when nothing says which.
const ROBOT: &str = "prestoe";

/// The arguments of `instep kick`.
#[derive(Debug, Args)]
pub(crate) struct Kick {
    /// The motion to play open loop, in place of running a policy: a file that `instep retarget` wrote
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// The policy to run: a file that `instep train` wrote [default: that of the robot's policy.toml]
    #[arg(long, value_name = "FILE", conflicts_with_all = ["reference", "engine"])]
    policy: Option<PathBuf>,
    /// The robot: a name, or the path of its folder or robot.toml [default: the reference's or policy's, else prestoe]
    #[arg(long, value_name = "ROBOT")]
    robot: Option<String>,
    /// Where the ball lies, in metres: x along the kick, y to its left [default: the reference's ball; on request, before a foot]
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = point)]
    ball: Option<[f64; 2]>,
    /// Where in the reference to start, in seconds [default: where the support foot is planted; for a policy, its start]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    start: Option<f64>,
    /// How long to simulate, in seconds [default: to the reference's end, and 1.2 s past its impact]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    duration: Option<f64>,
    /// Seed of all sensor noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for report.html and kick.mcap
    #[arg(long, value_name = "FOLDER", default_value = "out/kick")]
    out: PathBuf,
    /// Kick on request with this engine, as `instep bench` names them [default: the robot's own, where robot.toml names one]
    #[arg(long, value_name = "ENGINE", conflicts_with_all = ["reference", "start", "duration"])]
    engine: Option<String>,
    /// Of a kick on request: direction of the ball, in degrees from straight ahead to the left [default: 0, or the engine's only one]
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, value_parser = degrees)]
    direction: Option<f64>,
    /// Of a kick on request: speed of the ball, in m/s [default: 1, or the engine's only one]
    #[arg(long, value_name = "SPEED", allow_negative_numbers = true)]
    speed: Option<f64>,
    /// A file of requests (a JSON array, or one JSON object a line) in place of --ball; writes no report
    #[arg(long, value_name = "FILE", conflicts_with_all = ["ball", "direction", "speed"])]
    requests: Option<PathBuf>,
    /// Also writes model.mjb, steps.json and steps.f64 into this folder: every physics step of one kick, which tools/replay.py
    /// does again in MuJoCo's own Python
    #[arg(long, value_name = "FOLDER", conflicts_with = "requests")]
    steps: Option<PathBuf>,
    /// Also write the kick as a small picture that moves (SVG)
    #[arg(long, value_name = "FILE.svg", conflicts_with = "requests")]
    picture: Option<PathBuf>,
    /// The world: "ideal" for perfect drives and senses, or a TOML file; what is absent in it keeps its default
    #[arg(long, value_name = "FILE")]
    world: Option<PathBuf>,
}

/// `x,y` in metres.
pub(crate) fn point(text: &str) -> Result<[f64; 2], String> {
    let number = |part: &str| part.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    text.split_once(',')
        .and_then(|(x, y)| Some([number(x)?, number(y)?]))
        .ok_or_else(|| "expected two numbers in metres, such as 0.0,-0.02".into())
}

/// `10deg`, `10` (both degrees) or `0.17rad`; gives radians.
pub(crate) fn degrees(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let (number, factor) = match text.strip_suffix("rad") {
        Some(number) => (number, 1.0),
        None => (text.strip_suffix("deg").unwrap_or(text), std::f64::consts::PI / 180.0),
    };
    let value =
        number.trim().parse::<f64>().map_err(|_| "expected an angle, such as 10deg, -40 or 0.2rad".to_owned())?;
    Ok(value * factor)
}

/// Everything about one kick that was tried.
pub(crate) struct Tried {
    pub(crate) robot: Arc<Robot>,
    pub(crate) source: Source,
    pub(crate) settings: TrialSettings,
    /// What is not as in the robot's default world.
    pub(crate) world_changes: Vec<Change>,
    pub(crate) trial: Trial,
    pub(crate) report: PathBuf,
    pub(crate) recording: PathBuf,
    /// The small picture, where one was asked for.
    pub(crate) picture: Option<PathBuf>,
}

/// What a kick came from.
pub(crate) enum Source {
    /// A reference.
    Followed(Arc<Followed>),
    /// A request to an engine.
    Asked { engine: String, request: KickRequest, plan: KickPlan },
}

/// A reference that was followed.
pub(crate) struct Followed {
    reference: Arc<Reference>,
    file: PathBuf,
    /// The policy's file, where one ran.
    policy: Option<PathBuf>,
    /// Where in the reference it started, s.
    start: f64,
}

impl Kick {
    /// Runs the command.
    ///
    /// # Errors
    /// When something handed in cannot be used or the simulation diverges. How the kick went is no error.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        if let Some((subject, engine)) = self.asks()? {
            return self.on_request(&subject, &engine, output);
        }
        let alone = [
            ("--direction", self.direction.is_some()),
            ("--speed", self.speed.is_some()),
            ("--requests", self.requests.is_some()),
        ];
        if let Some((flag, _)) = alone.into_iter().find(|(_, given)| *given) {
            let message = format!(
                "{flag}: says what an engine is asked for, and none kicks here; expected --engine ENGINE beside it"
            );
            return Err(Failure::input(message));
        }
        let (ready, policy) = match &self.reference {
            Some(file) => (self.with_playback(file)?, None),
            None => {
                let shipped = || places::shipped_policy(self.robot.as_deref().unwrap_or(ROBOT));
                let file = self.policy.clone().map_or_else(shipped, Ok)?;
                (self.with_policy(&file)?, Some(file))
            }
        };
        let Ready { robot, reference, reference_file, start, period, mut controller, mut twin, q, v } = ready;
        let default = worlds::default(&robot)?;
        let world = worlds::asked(self.world.as_deref(), &default)?;
        let phases = &reference.phases;
        let until = reference.duration().max(phases.t_impact + AFTERMATH);
        let duration = self.duration.unwrap_or(until - start);
        if !(duration > 0.0 && duration <= LONGEST) {
            let message = format!("--duration: {duration}; expected seconds above 0, at most {LONGEST}");
            return Err(Failure::input(message));
        }
        let (report, recording) = (self.out.join("report.html"), self.out.join("kick.mcap"));
        for file in [&report, &recording].into_iter().chain(&self.picture) {
            files::check_file(file)?;
        }

        let [x, y] = self.ball.unwrap_or([reference.ball[0], reference.ball[1]]);
        let settings = TrialSettings {
            world,
            seed: self.seed,
            duration,
            control_period: period.max(world.step.tick),
            q,
            v,
            ball: BallState::at_rest([x, y, world.ball.radius]),
            direction: 0.0,
        };
        let mut room = World::new(Arc::clone(&robot), &settings.world)?;
        if let Some(folder) = &self.steps {
            steps::prepare(folder, &mut room)?;
        }
        let trial = trial::run_in(&mut room, &settings, controller.as_mut(), twin.as_mut())?;
        if let Some(folder) = &self.steps {
            steps::write(folder, &mut room, &trial)?;
        }
        let followed = Arc::new(Followed { reference, file: reference_file, policy, start });
        let source = Source::Followed(Arc::clone(&followed));
        let world_changes = world.changes(&default);
        let picture = self.picture.clone();
        let tried = Tried { robot, source, settings, world_changes, trial, report, recording, picture };
        tried.write()?;
        output.show(&Measures::new(&tried, &followed), |paint| summary::text(&tried, paint))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// A controller with all that its trial needs.
struct Ready {
    robot: Arc<Robot>,
    reference: Arc<Reference>,
    reference_file: PathBuf,
    /// Where in the reference it starts, s.
    start: f64,
    /// Period at which the controller is to be called, s; a tick where that is longer.
    period: f64,
    controller: Box<dyn Controller>,
    /// The same again, for the audit's re-run.
    twin: Box<dyn Controller>,
    q: Vec<f64>,
    v: Vec<f64>,
}

impl Kick {
    /// Plays a reference open loop.
    fn with_playback(&self, file: &Path) -> Result<Ready, Failure> {
        let reference_file = places::reference(file)?;
        let reference = Arc::new(Reference::load(&reference_file)?);
        let robot = Arc::new(places::robot(self.robot.as_deref().unwrap_or(&reference.robot))?);
        let start = self.start.unwrap_or(reference.phases.t_plant);
        let engine = || {
            Playback::new(&robot, Arc::clone(&reference), start)
                .map_err(|error| Failure::from(error).about(reference_file.display()))
        };
        let (engine, twin) = (engine()?, Box::new(engine()?));
        let (q, v) = engine.initial_state();
        Ok(Ready { robot, reference, reference_file, start, period: 0.0, controller: Box::new(engine), twin, q, v })
    }

    /// Runs a policy.
    fn with_policy(&self, file: &Path) -> Result<Ready, Failure> {
        let policy = crate::train::policy(file)?;
        let robot = Arc::new(places::robot(self.robot.as_deref().unwrap_or(&policy.header.robot))?);
        let reference = Arc::clone(&policy.reference);
        let reference_file = PathBuf::from(&policy.header.reference);
        let from = policy.header.window[0];
        let start = self.start.unwrap_or(from);
        let engine = || {
            PolicyKick::new(&robot, &policy, start - from).map_err(|error| Failure::from(error).about(file.display()))
        };
        let (engine, twin) = (engine()?, Box::new(engine()?));
        let (q, v) = engine.initial_state();
        Ok(Ready { robot, reference, reference_file, start, period: PERIOD, controller: Box::new(engine), twin, q, v })
    }

    /// The robot and the engine that is to kick on request: the one named, else the robot's own, else `dynamic`, which follows from any
    /// robot; `None` where a reference or a policy is to be played.
    fn asks(&self) -> Result<Option<(Subject, String)>, Failure> {
        let played =
            self.reference.is_some() || self.policy.is_some() || self.start.is_some() || self.duration.is_some();
        let Some(robot) = self.robot.as_deref() else {
            return match &self.engine {
                Some(_) => Err(Failure::input("--robot: which robot is to kick? such as --robot wolfgang")),
                None => Ok(None),
            };
        };
        if self.engine.is_none() && played {
            return Ok(None);
        }
        let robot = places::robot(robot)?;
        let has_policy = robot.folder().join(PolicySettings::FILE).exists();
        let own = robot.engine.clone().or_else(|| (!has_policy).then(|| FOLLOWS.to_owned()));
        let Some(engine) = self.engine.clone().or(own) else { return Ok(None) };
        Ok(Some((Subject::of(robot)?, engine)))
    }

    /// Kicks on request.
    fn on_request(&self, subject: &Subject, engine: &str, output: &Output) -> Result<ExitCode, Failure> {
        let requests = match (&self.requests, self.ball) {
            (Some(file), _) => engine::load(file)?,
            (None, ball) => {
                let own = subject.engine(engine)?.own_start().map(|start| start.request);
                vec![self.request(ball.unwrap_or_else(|| before_a_foot(subject)), ball.is_some(), own)]
            }
        };
        let world = worlds::asked(self.world.as_deref(), &subject.default_world())?;
        let folders =
            engine::Folders { out: &self.out, steps: self.steps.as_deref(), picture: self.picture.as_deref() };
        let subject = subject.clone().in_world(world);
        engine::run(&subject, engine, &requests, world, self.seed, folders, output)
    }
}

/// Where a ball lies that nobody placed: straight before the right foot, a tenth of a leg off its toes, m.
fn before_a_foot(subject: &Subject) -> [f64; 2] {
    let size = &subject.size;
    [size.toes + 0.1 * size.leg + size.ball, -size.half_width]
}

impl Kick {
    /// The request of the command line; what it does not say is the engine's `own`, where that has only one.
    fn request(&self, ball: [f64; 2], placed: bool, own: Option<KickRequest>) -> KickRequest {
        let mut request = own.unwrap_or_else(|| KickRequest::new(ball, 0.0, 1.0));
        if placed {
            request.ball = ball;
        }
        request.direction = self.direction.unwrap_or(request.direction);
        request.strength = self.speed.map_or(request.strength, Strength::BallSpeed);
        request
    }
}

impl Tried {
    /// Writes report and recording, both or neither.
    fn write(&self) -> Result<(), Failure> {
        let mut batch = files::Batch::default();
        page(self).save(batch.stage(&self.report)?)?;
        if let Some(file) = &self.picture {
            let staged = batch.stage(file)?;
            std::fs::write(&staged, page::picture(self))
                .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", file.display())))?;
        }
        recording::recording(self)?.save(batch.stage(&self.recording)?)?;
        batch.commit()
    }

    /// The reference that was followed, if one was.
    fn followed(&self) -> Option<&Followed> {
        match &self.source {
            Source::Followed(followed) => Some(followed),
            Source::Asked { .. } => None,
        }
    }

    /// The foot that was to kick.
    fn foot(&self) -> Side {
        match &self.source {
            Source::Followed(followed) => followed.reference.phases.kick_foot,
            Source::Asked { plan, .. } => plan.foot,
        }
    }

    /// What steered the robot, in words.
    fn steered(&self) -> String {
        match &self.source {
            Source::Followed(followed) => followed.steered(),
            Source::Asked { engine, request, plan } => {
                let (foot, face) = (plan.foot, format!("{:?}", plan.face).to_lowercase());
                let angle = request.direction.to_degrees();
                format!("engine {engine}, {foot} foot ({face}), asked for {angle:.1} degrees to the left")
            }
        }
    }
}

impl Followed {
    fn steered(&self) -> String {
        let by = self.policy.as_ref().map_or_else(
            || "open loop".into(),
            |file| format!("followed by the policy {}", file.file_name().unwrap_or_default().to_string_lossy()),
        );
        let kind = match self.reference.kind {
            ReferenceKind::KinematicSlip => "kinematic, the clip's foot slip kept",
            ReferenceKind::Kinematic => "kinematic, stance feet still",
            ReferenceKind::Kinodynamic => "kinodynamic",
            ReferenceKind::Infeasible => "kinodynamic, but not feasible",
        };
        let name = self.file.file_name().unwrap_or_default().to_string_lossy();
        format!("{name} ({kind}), {by} from {:.3} s", self.start)
    }
}

/// What `--json` prints. Keys are stable: they may be added to, never renamed. SI units; degrees where the key says so.
#[derive(Debug, Serialize)]
struct Measures<'a> {
    /// m/s, as the ball leaves the robot for good; null when it was not touched. To be believed only if `audit` is "valid".
    ball_speed: Option<f64>,
    /// From the wanted to the real direction, positive to the left.
    direction_error_deg: Option<f64>,
    launch_angle_deg: Option<f64>,
    foot_speed: Option<f64>,
    effective_mass: Option<f64>,
    restitution: Option<f64>,
    audit: &'static str,
    audit_reason: String,
    upright: bool,
    fell_at: Option<f64>,
    limit_violations: &'a [trial::LimitViolation],
    impact_time: Option<f64>,
    contact_time: Option<f64>,
    contact_link: Option<&'a str>,
    /// How many.
    touches: usize,
    /// Each of them.
    touch_list: &'a [Impact],
    /// Whether the whole kick, run again at a quarter of the step, led to the same.
    converged: bool,
    rerun: Option<Rerun>,
    rerun_ball_speed: Option<f64>,
    energy_gain: Option<f64>,
    world_changes: &'a [Change],
    support_slip: Option<f64>,
    ball_start: [f64; 3],
    ball_end: [f64; 3],
    groups: &'a [trial::GroupPeak],
    segments: &'a [trial::SegmentPeak],
    robot: &'a str,
    reference: &'a Path,
    /// Null for a reference that was played open loop.
    policy: Option<&'a Path>,
    reference_kind: ReferenceKind,
    reference_start: f64,
    reference_duration: f64,
    duration: f64,
    seed: u64,
    report: &'a Path,
    recording: &'a Path,
}

impl<'a> Measures<'a> {
    fn new(tried: &'a Tried, followed: &'a Followed) -> Self {
        let (trial, settings) = (&tried.trial, &tried.settings);
        let impact = trial.impact.as_ref();
        Self {
            ball_speed: trial.ball_speed,
            direction_error_deg: trial.direction_error.map(f64::to_degrees),
            launch_angle_deg: trial.launch_angle.map(f64::to_degrees),
            foot_speed: impact.map(|i| i.foot_speed),
            effective_mass: impact.map(|i| i.effective_mass),
            restitution: impact.map(|i| i.restitution),
            audit: trial.audit.verdict(),
            audit_reason: trial.audit.reason(),
            upright: trial.upright(),
            fell_at: trial.fell_at,
            limit_violations: &trial.limit_violations,
            impact_time: impact.map(|i| i.time),
            contact_time: impact.map(|i| i.duration),
            contact_link: impact.map(|i| i.link.as_str()),
            touches: trial.touches.len(),
            touch_list: &trial.touches,
            converged: trial.audit.converged,
            rerun: trial.audit.rerun,
            rerun_ball_speed: trial.audit.rerun.and_then(|rerun| rerun.ball_speed),
            world_changes: &tried.world_changes,
            energy_gain: trial.audit.energy_gain,
            support_slip: trial.support_slip,
            ball_start: settings.ball.position,
            ball_end: trial.ball_end,
            groups: &trial.groups,
            segments: &trial.segments,
            robot: &tried.robot.name,
            reference: &followed.file,
            policy: followed.policy.as_deref(),
            reference_kind: followed.reference.kind,
            reference_start: followed.start,
            reference_duration: followed.reference.duration(),
            duration: settings.duration,
            seed: settings.seed,
            report: &tried.report,
            recording: &tried.recording,
        }
    }
}
