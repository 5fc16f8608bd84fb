//! `instep retarget`: a human kick becomes a reference for a robot, in the four stages of paper 1: rescaling, kinematic
//! stage, kinodynamic stage, verification.

mod effort;
mod measures;
mod page;
mod progress;
mod summary;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use instep_motion::asf;
use instep_motion::clip::{self, Clip, LoadOptions};
use instep_motion::jump::{self, Continuous, Mended};
use instep_motion::reference::{Reference, Source};
use instep_retarget::RetargetError;
use instep_retarget::kinematic::{self, ContactForm, KinematicSettings, Retargeted};
use instep_retarget::kinodynamic::{self, Kinodynamic, KinodynamicSettings, Status};
use instep_robot::Robot;
use serde::Deserialize;

use crate::failure::Failure;
use crate::interrupt::{INTERRUPTED, stopped_by_the_user};
use crate::kick::{degrees, point};
use crate::output::Output;
use crate::{files, places};
use measures::Measures;
use progress::Line;

/// The arguments of `instep retarget`.
#[derive(Debug, Args)]
pub(crate) struct Retarget {
    /// The skeleton of an AMC clip [default: the clip's name up to its last underscore, with .asf]
    #[arg(long, value_name = "FILE.asf")]
    skeleton: Option<PathBuf>,
    /// The human kick, .amc or .bvh
    #[arg(long, value_name = "FILE")]
    clip: PathBuf,
    /// The robot: a name, or the path of its folder or robot.toml
    #[arg(long, value_name = "ROBOT", default_value = "prestoe")]
    robot: String,
    /// How far to go
    #[arg(long, value_enum, default_value_t = Stage::Kinodynamic)]
    stage: Stage,
    /// Whether standing feet stand still; slip goes with --stage kinematic
    #[arg(long, value_enum, default_value_t = Form::Enforced)]
    form: Form,
    /// Knots a second of the reference [default: 30 after the kinematic stage, 360 after the kinodynamic one, which has
    /// a node of the optimisation at every other knot]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Factor on all times of the clip: 1.2 is a kick slowed down by a fifth [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    time_scale: Option<f64>,
    /// Where the ball lies, in metres from where the clip's own kick meets it: x along that kick, y to its left
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = point)]
    ball: Option<[f64; 2]>,
    /// Direction of the kick, in degrees to the left of the clip's own
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, value_parser = degrees)]
    aim: Option<f64>,
    /// Speed along the kick that the foot should have at the impact, in m/s [default: as fast as it can be]
    #[arg(long, value_name = "SPEED", allow_negative_numbers = true)]
    foot_speed: Option<f64>,
    /// Settings of both stages, as TOML with the tables [kinematic] and [kinodynamic]; what is absent keeps its default
    #[arg(long, value_name = "FILE.toml")]
    settings: Option<PathBuf>,
    /// Frames a second of an AMC clip, which does not say
    #[arg(long, value_name = "HZ", default_value_t = asf::CMU_RATE, allow_negative_numbers = true)]
    clip_rate: f64,
    /// Metres in one unit of a BVH clip, which does not say: 0.01 for centimetres
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    unit: Option<f64>,
    /// How the clip's owner asks to be named; goes into the reference
    #[arg(long, value_name = "TEXT", default_value = "")]
    acknowledgement: String,
    /// The reference to write [default: out/retarget/<clip>_<kind>.json]
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// The report to write [default: beside the reference, .html]
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
}

/// How far retargeting goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Stage {
    /// Inverse kinematics over the whole clip; no forces
    Kinematic,
    /// And the nearest motion that the robot's dynamics, motors and contacts allow, verified
    Kinodynamic,
}

/// What becomes of standing feet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// The clip's own foot slip is kept
    Slip,
    /// Standing feet stand still on the ground
    Enforced,
}

/// The settings' file.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Settings {
    kinematic: KinematicSettings,
    kinodynamic: KinodynamicSettings,
}

/// A clip, retargeted.
struct Done {
    robot: Robot,
    clip: Clip,
    /// What was done about its jumps.
    mended: Vec<Mended>,
    clip_file: PathBuf,
    form: Form,
    retargeted: Retargeted,
    /// Where the command went that far.
    kinodynamic: Option<Kinodynamic>,
    /// Of the kinodynamic stage.
    limits: KinodynamicSettings,
    /// Time that each stage took, s.
    seconds: BTreeMap<&'static str, f64>,
    reference: PathBuf,
    report: PathBuf,
}

impl Retarget {
    /// Runs the command.
    ///
    /// # Errors
    /// When something handed in cannot be used, or the solver breaks down. A bar that is missed is no error.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        let mut line = Line::new();
        let Continuous { clip, mended, .. } = jump::without_jumps(&self.load()?);
        let robot = places::robot(&self.robot)?;
        let (reference, report) = self.outputs();
        for file in [&reference, &report] {
            files::check_file(file)?;
        }
        let Settings { kinematic: settings, kinodynamic: limits } = self.settings()?;
        if self.stage == Stage::Kinodynamic {
            limits.validate().map_err(|error| self.explain(error, &mut line))?;
        }
        line.at("rescaling");
        let retargeted = kinematic::retarget(&robot, &clip, self.source(), &settings, &mut |at| line.kinematic(&at));
        let retargeted = retargeted.map_err(|error| self.explain(error, &mut line))?;
        let kinodynamic = match self.stage {
            Stage::Kinematic => None,
            Stage::Kinodynamic => {
                let stop = stopped_by_the_user();
                line.at("kinodynamic");
                let weights = &settings.weights;
                let tell = &mut |at| line.kinodynamic(&at);
                let done = kinodynamic::optimize(&robot, &retargeted, weights, &limits, &stop, tell);
                Some(done.map_err(|error| self.explain(error, &mut line))?)
            }
        };
        let seconds = line.finish();
        let (clip_file, form) = (self.clip, self.form);
        let done =
            Done { robot, clip, mended, clip_file, form, retargeted, kinodynamic, limits, seconds, reference, report };
        done.write()?;
        output.show(&Measures::new(&done), |paint| done.text(paint))?;
        Ok(done.code())
    }

    fn load(&self) -> Result<Clip, Failure> {
        places::existing_file("--clip", &self.clip, "a motion clip, .amc or .bvh")?;
        if let Some(skeleton) = &self.skeleton {
            places::existing_file("--skeleton", skeleton, "the clip's skeleton, .asf")?;
        }
        let is_bvh = self.clip.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bvh"));
        if let (true, Some(skeleton)) = (is_bvh, &self.skeleton) {
            let (clip, skeleton) = (self.clip.display(), skeleton.display());
            return Err(Failure::input(format!(
                "--skeleton {skeleton}: {clip} is a BVH, which holds its skeleton; expected none"
            )));
        }
        let options =
            LoadOptions { skeleton: self.skeleton.clone(), amc_rate: self.clip_rate, bvh_metres_per_unit: self.unit };
        Ok(clip::load(&self.clip, &options)?)
    }

    /// The settings' file, and over it what the command line says.
    fn settings(&self) -> Result<Settings, Failure> {
        let mut settings: Settings = match &self.settings {
            None => Settings::default(),
            Some(path) => places::settings("--settings", path, "settings of retargeting")?,
        };
        let goes_on = self.stage == Stage::Kinodynamic;
        if goes_on && self.form == Form::Slip {
            return Err(Failure::input(
                "--form slip: the kinodynamic stage needs feet that stand still; expected --stage kinematic beside it",
            ));
        }
        if !goes_on {
            let given = [
                ("--time-scale", self.time_scale.is_some()),
                ("--ball", self.ball.is_some()),
                ("--aim", self.aim.is_some()),
                ("--foot-speed", self.foot_speed.is_some()),
            ];
            if let Some((option, _)) = given.into_iter().find(|(_, given)| *given) {
                return Err(Failure::input(format!(
                    "{option}: the kinematic stage has no such setting; expected --stage kinodynamic"
                )));
            }
        }
        settings.kinematic.form = match self.form {
            Form::Slip => ContactForm::Slip,
            Form::Enforced => ContactForm::Enforced,
        };
        match self.rate {
            Some(rate) if goes_on => {
                if !(60.0..=480.0).contains(&rate) {
                    return Err(Failure::input(format!(
                        "--rate: {rate}; expected 60 to 480 knots a second of a kinodynamic reference"
                    )));
                }
                settings.kinodynamic.rate = rate / 2.0;
            }
            Some(rate) => settings.kinematic.rate = rate,
            None => {}
        }
        let kinodynamic = &mut settings.kinodynamic;
        kinodynamic.time_scale = self.time_scale.unwrap_or(kinodynamic.time_scale);
        kinodynamic.ball = self.ball.unwrap_or(kinodynamic.ball);
        kinodynamic.aim = self.aim.unwrap_or(kinodynamic.aim);
        kinodynamic.foot_speed = self.foot_speed.or(kinodynamic.foot_speed);
        Ok(settings)
    }

    fn source(&self) -> Source {
        let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Source {
            clip: name(&self.clip),
            skeleton: self.skeleton.as_deref().map(name),
            clip_start: 0.0,
            acknowledgement: self.acknowledgement.clone(),
        }
    }

    /// Paths of the reference and of its report.
    fn outputs(&self) -> (PathBuf, PathBuf) {
        let reference = self.out.as_deref().map(|out| files::with_ending(out, "json")).unwrap_or_else(|| {
            let stem = self.clip.file_stem().unwrap_or_default().to_string_lossy();
            let kind = match (self.stage, self.form) {
                (_, Form::Slip) => "kinematic_slip",
                (Stage::Kinematic, Form::Enforced) => "kinematic",
                (Stage::Kinodynamic, Form::Enforced) => "kinodynamic",
            };
            Path::new("out/retarget").join(format!("{stem}_{kind}.json"))
        });
        let report = self.report.as_deref().map(|report| files::with_ending(report, "html"));
        let report = report.unwrap_or_else(|| reference.with_extension("html"));
        (reference, report)
    }

    /// The stages' errors name no file and no stage; here both are known.
    fn explain(&self, error: RetargetError, line: &mut Line) -> Failure {
        let stage = line.stage();
        line.clear();
        let about = match &error {
            RetargetError::Motion(_) => Some(self.clip.display().to_string()),
            RetargetError::Landmark { .. } => Some(self.robot.clone()),
            RetargetError::Setting { .. } => self.settings.as_ref().map(|path| path.display().to_string()),
            RetargetError::Breakdown { .. } => None,
        };
        let failure = Failure::from(error);
        let failure = match about {
            Some(about) => failure.about(about),
            None => failure,
        };
        failure.in_stage(stage)
    }
}

impl Done {
    /// Writes reference and report, both or neither.
    fn write(&self) -> Result<(), Failure> {
        let mut batch = files::Batch::default();
        self.result().save(&batch.stage(&self.reference)?)?;
        page::page(self).save(batch.stage(&self.report)?)?;
        batch.commit()
    }

    /// The reference of the last stage.
    fn result(&self) -> &Reference {
        self.kinodynamic.as_ref().map_or(&self.retargeted.reference, |done| &done.reference)
    }

    /// 0: the robot can do the motion, or nobody asked; 130: stopped by Ctrl-C; 1: the best that was found is not
    /// feasible.
    fn code(&self) -> ExitCode {
        match self.kinodynamic.as_ref().map(|done| &done.status) {
            None => ExitCode::SUCCESS,
            Some(status) if status.feasible() => ExitCode::SUCCESS,
            Some(Status::Stopped) => ExitCode::from(INTERRUPTED),
            Some(_) => ExitCode::FAILURE,
        }
    }

    fn stage(&self) -> &'static str {
        match (&self.kinodynamic, self.form) {
            (Some(_), _) => "all stages, checked by full inverse dynamics",
            (None, Form::Slip) => "kinematic stage, the clip's foot slip kept",
            (None, Form::Enforced) => "kinematic stage, standing feet stand still",
        }
    }

    /// Frames of the clip a second of the kinematic stage.
    fn frames_per_second(&self) -> f64 {
        self.clip.frames.len() as f64 / self.kinematic_seconds()
    }

    /// Rescaling and kinematic stage, s.
    fn kinematic_seconds(&self) -> f64 {
        ["rescaling", "kinematic"].iter().filter_map(|stage| self.seconds.get(stage)).sum()
    }
}
