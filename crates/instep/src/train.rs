//! `instep train`: from a reference to a policy, on all cores; stopped at will, resumed by the same command.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use instep_kick::policy::Policy;
use instep_learn::termination::EndRow;
use instep_learn::train::{Progress, Training};
use instep_learn::{LearnError, LearnSettings, checkpoint, onnx};
use instep_motion::reference::Reference;
use instep_report::{Axis, Column, Plot, Report, Series, SummaryItem, Table, Verdict};
use serde::Serialize;

use crate::failure::Failure;
use crate::interrupt::stopped_by_the_user;
use crate::output::{self, Output, Paint};
use crate::{files, places};

/// Time between two checkpoints, s.
const CHECKPOINT: Duration = Duration::from_secs(60);

/// The arguments of `instep train`.
#[derive(Debug, Args)]
pub(crate) struct Train {
    /// The motion to follow: a file that `instep retarget` wrote [default: that of --from]
    #[arg(long, value_name = "FILE", required_unless_present = "from")]
    reference: Option<PathBuf>,
    /// Control steps to take, such as 500k or 50M
    #[arg(long, value_name = "STEPS", default_value = "50M", value_parser = steps)]
    budget: u64,
    /// What is to be learned
    #[arg(long, value_enum, default_value_t = Task::Track)]
    task: Task,
    /// A policy to go on from
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    /// Settings of the training, as TOML [default: those of the task]
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of threads [default: one a core]; the policy does not depend on it
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Folder for checkpoint, policy (safetensors and ONNX), card and report
    #[arg(long, value_name = "FOLDER", default_value = "out/train")]
    out: PathBuf,
}

/// What is to be learned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Task {
    /// To follow the reference
    Track,
    /// To hit the ball hard and straight, staying close to the reference
    Ball,
}

/// `50M`, `500k`, `2e6` or a plain number.
pub(crate) fn steps(text: &str) -> Result<u64, String> {
    let (number, factor) = match text.char_indices().last() {
        Some((at, 'k' | 'K')) => (&text[..at], 1e3),
        Some((at, 'm' | 'M')) => (&text[..at], 1e6),
        _ => (text, 1.0),
    };
    let value = number.parse::<f64>().map(|x| x * factor).unwrap_or(f64::NAN);
    if (1.0..=1e12).contains(&value) { Ok(value as u64) } else { Err("expected a number such as 500k or 50M".into()) }
}

impl From<LearnError> for Failure {
    fn from(error: LearnError) -> Self {
        match error {
            LearnError::Kick(error) => error.into(),
            LearnError::Sim(error) => error.into(),
            LearnError::NotFinite { .. } => Self::other(error),
            other => Self::input(other),
        }
    }
}

/// The files of a training.
struct Files {
    checkpoint: PathBuf,
    policy: PathBuf,
    onnx: PathBuf,
    card: PathBuf,
    report: PathBuf,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Trained<'a> {
    steps: u64,
    budget: u64,
    finished: bool,
    /// Of this run, not of those before it.
    seconds: f64,
    steps_per_second: f64,
    last: Option<Progress>,
    ends: Vec<EndRow>,
    policy: &'a Path,
    onnx: &'a Path,
    checkpoint: &'a Path,
    card: &'a Path,
    report: &'a Path,
}

impl Train {
    /// Runs the command.
    ///
    /// # Errors
    /// When something handed in cannot be used, a file cannot be written, or a number is no longer finite.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        let place = |name: &str| self.out.join(name);
        let files = Files {
            checkpoint: place("checkpoint.safetensors"),
            policy: place("policy.safetensors"),
            onnx: place("policy.onnx"),
            card: place("README.md"),
            report: place("report.html"),
        };
        files::check_file(&files.checkpoint)?;
        threads(self.threads)?;
        let mut training = self.training(&files.checkpoint)?;
        std::fs::create_dir_all(&self.out)
            .map_err(|e| Failure::input(format!("{}: cannot be made: {e} (--out)", self.out.display())))?;
        let _alone = files::alone(&files.checkpoint)?;

        let stop = stopped_by_the_user();
        let bar = output::bar(training.state.budget, "{wide_bar} {human_pos}/{human_len} steps, {msg} {eta}");
        let (start, before) = (Instant::now(), training.state.steps);
        let mut saved: Option<Instant> = None;
        let mut failed = None;
        while !training.is_over() && !stop.load(Ordering::Relaxed) {
            match training.iterate() {
                Ok(progress) => {
                    bar.set_position(progress.steps);
                    bar.set_message(line(&progress, (progress.steps - before) as f64 / start.elapsed().as_secs_f64()));
                }
                Err(error) => {
                    failed = Some(error);
                    break;
                }
            }
            // The first one at once: a training killed early shall leave something behind.
            if saved.is_none_or(|at| at.elapsed() > CHECKPOINT) {
                checkpoint::save(&training, &files.checkpoint)?;
                saved = Some(Instant::now());
            }
        }
        bar.finish_and_clear();
        checkpoint::save(&training, &files.checkpoint)?;
        if let Some(error) = failed {
            return Err(error.into());
        }
        let seconds = start.elapsed().as_secs_f64();
        self.write(&training, &files)?;
        let trained = Trained {
            steps: training.state.steps,
            budget: training.state.budget,
            finished: training.is_over(),
            seconds,
            steps_per_second: (training.state.steps - before) as f64 / seconds,
            last: training.state.curve.last().copied(),
            ends: training.ends.rows(&training.scene.robot),
            policy: &files.policy,
            onnx: &files.onnx,
            checkpoint: &files.checkpoint,
            card: &files.card,
            report: &files.report,
        };
        output.show(&trained, |paint| text(&trained, paint))?;
        Ok(ExitCode::SUCCESS)
    }

    /// A new training, or the one in the folder.
    fn training(&self, saved: &Path) -> Result<Training, Failure> {
        let asked = self.settings.as_deref().map(settings).transpose()?;
        let policy = self.from.as_deref().map(policy).transpose()?;
        let (reference, name) = match (&self.reference, &policy) {
            (Some(file), _) => {
                let file = places::reference(file)?;
                let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
                (Arc::new(Reference::load(&file)?), name)
            }
            (None, Some(policy)) => (Arc::clone(&policy.reference), policy.header.reference.clone()),
            (None, None) => return Err(Failure::input("--reference: which motion is to be followed?")),
        };
        let robot = Arc::new(places::robot(&reference.robot)?);
        if !saved.exists() {
            let mut settings = asked.unwrap_or_else(|| match self.task {
                Task::Track => LearnSettings::default(),
                Task::Ball => LearnSettings::ball(),
            });
            if let Some(policy) = &policy {
                fit(&mut settings, policy);
            }
            let training = Training::new(robot, reference, &name, settings, self.seed, self.budget, policy.as_ref())?;
            return Ok(training);
        }
        let (settings, state) = checkpoint::peek(saved)?;
        let other = |what: &str| {
            Failure::input(format!(
                "{}: of a training with {what}; give another --out, or remove the file to start anew",
                saved.display()
            ))
        };
        if asked.is_some_and(|asked| asked != settings) {
            return Err(other("other settings"));
        }
        if state.reference != name {
            return Err(other(&format!("the reference {}, not {name}", state.reference)));
        }
        if state.seed != self.seed {
            return Err(other(&format!("seed {}", state.seed)));
        }
        let mut training = Training::new(robot, reference, &name, settings, state.seed, self.budget, None)?;
        checkpoint::restore(&mut training, saved)?;
        training.state.budget = self.budget;
        Ok(training)
    }

    fn write(&self, training: &Training, files: &Files) -> Result<(), Failure> {
        let policy = training.policy();
        let bytes = policy.to_bytes().map_err(Failure::other)?;
        let mut batch = files::Batch::default();
        let mut put = |path: &Path, bytes: &[u8]| -> Result<(), Failure> {
            let staged = batch.stage(path)?;
            std::fs::write(&staged, bytes)
                .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))
        };
        put(&files.policy, &bytes)?;
        put(&files.onnx, &onnx::model(&policy.network))?;
        put(&files.card, card(training).as_bytes())?;
        page(training).save(batch.stage(&files.report)?)?;
        batch.commit()
    }
}

/// The part of the clip, what is seen and done, and the shape of the network are the policy's, unless the settings say otherwise.
fn fit(settings: &mut LearnSettings, policy: &Policy) {
    let default = LearnSettings::default();
    if settings.clip == default.clip {
        let [from, to] = policy.header.window;
        (settings.clip.from, settings.clip.to) = (Some(from), Some(to));
    }
    if settings.follower == default.follower {
        settings.follower = policy.header.follower.clone();
    }
    if settings.network == default.network {
        settings.network.activation = policy.network.activation;
        let hidden = policy.network.layers.len().saturating_sub(1);
        settings.network.actor = policy.network.layers[..hidden].iter().map(|layer| layer.bias.len()).collect();
    }
}

/// Sets the number of threads of everything that runs in parallel.
pub(crate) fn threads(count: Option<usize>) -> Result<(), Failure> {
    let Some(count) = count else { return Ok(()) };
    if !(1..=1024).contains(&count) {
        return Err(Failure::input(format!("--threads: {count}; expected 1 to 1024")));
    }
    rayon::ThreadPoolBuilder::new().num_threads(count).build_global().map_err(Failure::other)
}

/// Reads the settings of a training.
pub(crate) fn settings(path: &Path) -> Result<LearnSettings, Failure> {
    let settings: LearnSettings = places::settings("--settings", path, "settings of a training")?;
    settings.validate().map_err(|e| Failure::from(e).about(path.display()))?;
    Ok(settings)
}

/// Reads a policy.
pub(crate) fn policy(path: &Path) -> Result<Policy, Failure> {
    let path = places::policy(path)?;
    Ok(Policy::load(&path)?)
}

/// The progress line.
fn line(progress: &Progress, rate: f64) -> String {
    let number = |value: Option<f64>, unit: &str| value.map_or("-".into(), |v| format!("{v:.1}{unit}"));
    format!(
        "{rate:.0}/s, return {}, episode {}, link error {:.3} m, threshold {:.2} m, survival {:.0} %,",
        number(progress.episode_return, ""),
        number(progress.episode_length, " s"),
        progress.link_error,
        progress.threshold,
        100.0 * progress.survival,
    )
}

fn text(trained: &Trained<'_>, paint: Paint) -> String {
    let state = if trained.finished { paint.good("finished") } else { paint.warn("stopped; the same command goes on") };
    let mut lines = vec![format!(
        "{} of {} steps, {state} ({:.0} steps/s)",
        trained.steps, trained.budget, trained.steps_per_second
    )];
    if let Some(last) = &trained.last {
        lines.push(format!(
            "reward {:.3} a step, link error {:.3} m, survival {:.0} %, threshold {:.2} m",
            last.reward,
            last.link_error,
            100.0 * last.survival,
            last.threshold
        ));
    }
    let total: u64 = trained.ends.iter().map(|row| row.count).sum();
    if total > 0 {
        lines.push(format!("\nwhy the {total} episodes of this run ended:"));
        lines.extend(trained.ends.iter().take(12).map(|row| {
            let link = row.link.as_deref().unwrap_or("");
            format!("  {:5.1} %  {} {link} ({})", 100.0 * row.count as f64 / total as f64, row.cause, row.phase)
        }));
    }
    lines.push(format!("\n{}\n{}", trained.policy.display(), trained.report.display()));
    lines.join("\n")
}

fn card(training: &Training) -> String {
    let state = &training.state;
    let settings = toml::to_string_pretty(&training.scene.settings).unwrap_or_default();
    let mut lines = vec![
        format!("# A policy for {}", training.scene.robot.title),
        String::new(),
        format!("Follows `{}`; {} control steps, seed {}.", state.reference, state.steps, state.seed),
        String::new(),
        format!(
            "Trained with ideal drives and senses, in steps of {} ms; `instep eval` measures in the robot's own world.",
            1e3 * training.scene.settings.world.step
        ),
        String::new(),
        "| steps | reward | link error / m | survival | threshold / m |".into(),
        "|---|---|---|---|---|".into(),
    ];
    let every = (state.curve.len() / 20).max(1);
    lines.extend(state.curve.iter().skip(every - 1).step_by(every).map(|p| {
        format!(
            "| {} | {:.3} | {:.3} | {:.0} % | {:.2} |",
            p.steps,
            p.reward,
            p.link_error,
            100.0 * p.survival,
            p.threshold
        )
    }));
    lines.push(format!("\n```toml\n{settings}```\n"));
    lines.join("\n")
}

/// What a line of a plot shows of the curve.
type Value<'a> = &'a dyn Fn(&Progress) -> f64;

/// The report: curves, and why episodes end.
fn page(training: &Training) -> Report {
    let curve = &training.state.curve;
    let plot = |title: &str, unit: &str, lines: &[(&str, Value<'_>)]| Plot {
        title: title.into(),
        x_label: "control steps / million".into(),
        y_label: unit.into(),
        axis: Axis::Other,
        x: curve.iter().map(|p| p.steps as f64 / 1e6).collect(),
        series: lines.iter().map(|(name, value)| Series::shared(*name, curve.iter().map(value).collect())).collect(),
        ..Plot::default()
    };
    let or_gap = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let ends = training.ends.rows(&training.scene.robot);
    let total: u64 = ends.iter().map(|row| row.count).sum();
    let rows = ends.iter().map(|row| {
        vec![
            row.cause.into(),
            row.link.as_deref().unwrap_or("").into(),
            row.phase.into(),
            row.count.to_string().into(),
            format!("{:.1} %", 100.0 * row.count as f64 / total.max(1) as f64).into(),
        ]
    });
    let last = curve.last();
    let shown = |value: Option<String>| value.unwrap_or_else(|| "-".into());
    Report {
        title: format!("A policy for {}", training.scene.robot.title),
        subtitle: format!("{} \u{b7} seed {}", training.state.reference, training.state.seed),
        summary: vec![
            SummaryItem::new("Steps", training.state.steps.to_string(), Verdict::Neutral, "control steps"),
            SummaryItem::new(
                "Reward",
                shown(last.map(|p| format!("{:.3}", p.reward))),
                Verdict::Neutral,
                "mean of a step; 1 is perfect tracking",
            ),
            SummaryItem::new(
                "Link error",
                shown(last.map(|p| format!("{:.3} m", p.link_error))),
                Verdict::Neutral,
                "mean, with exploration",
            ),
            SummaryItem::new(
                "Survival",
                shown(last.map(|p| format!("{:.0} %", 100.0 * p.survival))),
                Verdict::Neutral,
                "of episodes that start anywhere",
            ),
        ],
        tables: vec![Table {
            title: "Why episodes ended (this run)".into(),
            columns: vec![
                Column::text("Cause"),
                Column::text("Link"),
                Column::text("Phase"),
                Column::number("Episodes"),
                Column::number("Share"),
            ],
            rows: rows.collect(),
        }],
        plots: vec![
            plot("Reward of a step", "1 is perfect", &[("reward", &|p| p.reward)]),
            plot(
                "Link error and threshold",
                "m",
                &[("link error", &|p| p.link_error), ("threshold d", &|p| p.threshold)],
            ),
            plot("Survival", "share of episodes", &[("survival", &|p| p.survival)]),
            plot("Episode length", "s", &[("length", &|p| or_gap(p.episode_length))]),
            plot("Deviation of the actions", "1", &[("sigma", &|p| p.sigma)]),
            plot("KL divergence of an update", "nat", &[("KL", &|p| p.kl)]),
        ],
        ..Report::default()
    }
}
