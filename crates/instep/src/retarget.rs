//! `instep retarget`: a human kick becomes a reference for a robot.

mod page;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use instep_motion::asf;
use instep_motion::clip::{self, Clip, LoadOptions};
use instep_motion::phase::Side;
use instep_motion::reference::{ReferenceKind, Source};
use instep_retarget::RetargetError;
use instep_retarget::kinematic::{self, ContactForm, KinematicSettings, Retargeted, Status};
use instep_robot::Robot;
use serde::Serialize;

use crate::failure::Failure;
use crate::output::{Output, Paint};
use crate::{files, places};

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
    #[arg(long, value_enum, default_value_t = Stage::Kinematic)]
    stage: Stage,
    /// Whether standing feet stand still
    #[arg(long, value_enum, default_value_t = Form::Enforced)]
    form: Form,
    /// Knots a second of the reference
    #[arg(long, value_name = "HZ", default_value_t = 30.0, allow_negative_numbers = true)]
    rate: f64,
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
}

/// What becomes of standing feet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// The clip's own foot slip is kept
    Slip,
    /// Standing feet stand still on the ground
    Enforced,
}

/// A clip, retargeted.
struct Done {
    robot: Robot,
    clip: Clip,
    clip_file: PathBuf,
    form: Form,
    retargeted: Retargeted,
    /// Time that the stage took, s.
    seconds: f64,
    reference: PathBuf,
    report: PathBuf,
}

impl Retarget {
    /// Runs the command.
    ///
    /// # Errors
    /// When something handed in cannot be used, or the solver breaks down. A bar that is missed is no error.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        let Stage::Kinematic = self.stage;
        let clip = self.load()?;
        let robot = places::robot(&self.robot)?;
        let (reference, report) = self.outputs();
        for file in [&reference, &report] {
            files::check_file(file)?;
        }
        let form = match self.form {
            Form::Slip => ContactForm::Slip,
            Form::Enforced => ContactForm::Enforced,
        };
        let settings = KinematicSettings { form, rate: self.rate, ..KinematicSettings::default() };
        let bar = progress(settings.iterations);
        let begin = Instant::now();
        let retargeted = kinematic::retarget(&robot, &clip, self.source(), &settings, &mut |at| {
            bar.set_position(at.iteration as u64);
            bar.set_message(format!("cost {:.4e}", at.cost));
        });
        let seconds = begin.elapsed().as_secs_f64();
        bar.finish_and_clear();
        let retargeted = retargeted.map_err(|error| self.explain(error))?;
        let done = Done { robot, clip, clip_file: self.clip, form: self.form, retargeted, seconds, reference, report };
        done.write()?;
        output.show(&Measures::new(&done), |paint| done.text(paint))?;
        Ok(ExitCode::SUCCESS)
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
        let reference = self.out.clone().unwrap_or_else(|| {
            let stem = self.clip.file_stem().unwrap_or_default().to_string_lossy();
            let kind = match self.form {
                Form::Slip => "kinematic_slip",
                Form::Enforced => "kinematic",
            };
            Path::new("out/retarget").join(format!("{stem}_{kind}.json"))
        });
        let report = self.report.clone().unwrap_or_else(|| reference.with_extension("html"));
        (reference, report)
    }

    /// The stage's errors name no file; here it is known which one they are about.
    fn explain(&self, error: RetargetError) -> Failure {
        let about = match &error {
            RetargetError::Motion(_) => Some(self.clip.display().to_string()),
            RetargetError::Landmark { .. } => Some(self.robot.clone()),
            _ => None,
        };
        let failure = Failure::from(error);
        match about {
            Some(about) => failure.about(about),
            None => failure,
        }
    }
}

/// A line on standard error, where it is a terminal.
fn progress(iterations: usize) -> ProgressBar {
    let bar = ProgressBar::new(iterations as u64);
    if let Ok(style) = ProgressStyle::with_template("retargeting {bar:24} iteration {pos} of at most {len}, {msg}") {
        bar.set_style(style);
    }
    bar
}

impl Done {
    /// Writes reference and report, both or neither.
    fn write(&self) -> Result<(), Failure> {
        let mut batch = files::Batch::default();
        self.retargeted.reference.save(&batch.stage(&self.reference)?)?;
        page::page(self).save(batch.stage(&self.report)?)?;
        batch.commit()
    }

    /// The text on the terminal.
    fn text(&self, paint: Paint) -> String {
        let mut out = String::new();
        // Writing into a string cannot fail.
        let _ = self.write_text(&mut out, paint);
        out
    }

    fn write_text(&self, out: &mut String, paint: Paint) -> std::fmt::Result {
        let r = &self.retargeted;
        let row = |label: &str, value: String| format!("  {} {value}\n", paint.faint(&format!("{label:<15}")));
        let clip = self.clip_file.file_name().unwrap_or_default().to_string_lossy();
        writeln!(out, "{}", paint.strong(&format!("{clip} on {}", self.robot.title)))?;
        writeln!(out, "{}\n", paint.faint(self.form()))?;
        out.push_str(&row(
            "clip",
            format!("{} frames at {:.0} Hz, {:.2} s", self.clip.frames.len(), self.clip.rate, self.clip.duration()),
        ));
        let p = &r.phases;
        let phases = format!(
            "planted {:.3} s, swing {:.3} s, lock {:.3} s, impact {:.3} s",
            p.t_plant, p.t_swing, p.t_lock, p.t_impact
        );
        out.push_str(&row("kick", format!("{} foot; {phases} (clip's time)", p.kick_foot)));
        let knots =
            format!("{} knots at {} Hz, {:.2} s", r.reference.knots.len(), r.reference.rate, r.reference.duration());
        out.push_str(&row("reference", knots));
        let (status, solved) = match r.status {
            Status::Solved => ("solved", true),
            Status::OutOfIterations => ("out of iterations: the best found is written", false),
        };
        let status = if solved { paint.good(status) } else { paint.warn(status) };
        out.push_str(&row(
            "status",
            format!(
                "{status}, {} iterations, {:.2} s, {:.0} frames/s",
                r.iterations,
                self.seconds,
                self.frames_per_second()
            ),
        ));
        out.push_str(&row("stance slip", format!("{:.1} mm at most", r.max_stance_slip * 1e3)));
        out.push_str(&row("keypoint error", format!("{:.1} mm on average", r.keypoint_error_mean() * 1e3)));
        writeln!(out, "\n  {}", paint.faint("mean distance from the scaled human, mm"))?;
        for line in r.keypoint_errors.chunks(4) {
            let cells = line.iter().map(|(name, error)| format!("{:<15}{:>6.1}", name.replace('_', " "), error * 1e3));
            writeln!(out, "  {}", cells.collect::<Vec<_>>().join("    "))?;
        }
        writeln!(out, "\n  {}", paint.faint("worst violation by family"))?;
        for (family, worst) in &r.violations {
            let text = format!("{:<18}{}", family.replace('_', " "), violation(family, *worst));
            writeln!(out, "  {}", if *worst > 0.0 { paint.warn(&text) } else { paint.good(&text) })?;
        }
        writeln!(out, "\nwrote {} and {}", self.reference.display(), self.report.display())
    }

    fn form(&self) -> &'static str {
        match self.form {
            Form::Slip => "kinematic stage, the clip's foot slip kept",
            Form::Enforced => "kinematic stage, standing feet stand still",
        }
    }

    fn frames_per_second(&self) -> f64 {
        self.clip.frames.len() as f64 / self.seconds
    }
}

/// A family's worst violation with its unit.
fn violation(family: &str, worst: f64) -> String {
    match family {
        _ if worst <= 0.0 => "none".to_owned(),
        "joint_limit" => format!("{worst:.4} rad beyond the range"),
        "joint_speed" => format!("{:.0} % beyond the limit", worst * 100.0),
        _ => format!("{:.2} mm", worst * 1e3),
    }
}

/// What `--json` prints. Keys are stable: they may be added to, never renamed. SI units.
#[derive(Debug, Serialize)]
struct Measures<'a> {
    /// Frames of the clip.
    frames: usize,
    kick_foot: Side,
    t_plant: f64,
    t_swing: f64,
    t_lock: f64,
    /// These times are the clip's own.
    t_impact: f64,
    /// Time that the stage took.
    seconds: f64,
    frames_per_second: f64,
    max_stance_slip: f64,
    keypoint_error_mean: f64,
    status: Status,
    /// Worst by family: joint_limit (rad), joint_speed (share of the limit beyond it), the others metres.
    violations: &'a BTreeMap<&'static str, f64>,
    keypoint_errors: BTreeMap<&'a str, f64>,
    iterations: usize,
    robot: &'a str,
    kind: ReferenceKind,
    knots: usize,
    rate: f64,
    reference: &'a Path,
    report: &'a Path,
}

impl<'a> Measures<'a> {
    fn new(done: &'a Done) -> Self {
        let r = &done.retargeted;
        Self {
            frames: done.clip.frames.len(),
            kick_foot: r.phases.kick_foot,
            t_plant: r.phases.t_plant,
            t_swing: r.phases.t_swing,
            t_lock: r.phases.t_lock,
            t_impact: r.phases.t_impact,
            seconds: done.seconds,
            frames_per_second: done.frames_per_second(),
            max_stance_slip: r.max_stance_slip,
            keypoint_error_mean: r.keypoint_error_mean(),
            status: r.status,
            violations: &r.violations,
            keypoint_errors: r.keypoint_errors.iter().map(|(name, error)| (name.as_str(), *error)).collect(),
            iterations: r.iterations,
            robot: &done.robot.name,
            kind: r.reference.kind,
            knots: r.reference.knots.len(),
            rate: r.reference.rate,
            reference: &done.reference,
            report: &done.report,
        }
    }
}
