//! `instep tune`: an engine's settings for a robot, found by CMA-ES; stopped and resumed at will. With `--against` a
//! strategy's numbers.

mod strategy;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};

use clap::{Args, ValueEnum};
use instep_bench::table::{Row, rows_over_seeds};
use instep_bench::{Bench, Scenario, Subject};
use instep_tune::{Objective, Run, TuneError, Tuned, Tuning, page};

use crate::failure::Failure;
use crate::interrupt::{self, INTERRUPTED};
use crate::output::{self, Output, Paint};
use crate::{files, places, worlds};

/// The arguments of `instep tune`.
#[derive(Debug, Args)]
pub(crate) struct Tune {
    /// The engine: any that `instep bench` knows; with --against a strategy's file, or "default"
    engine: String,
    /// A robot's name, or the path of its folder or robot.toml
    #[arg(long, value_name = "ROBOT", default_value = "nao")]
    robot: String,
    /// Fit a strategy instead: the one that it shall win against, a file or "default"
    #[arg(long, value_name = "STRATEGY", conflicts_with_all = ["robot", "objective", "world", "resume"])]
    against: Option<String>,
    /// With --against: the league's rules and field
    #[arg(long, value_name = "RULES", default_value = "adult-2024", requires = "against")]
    rules: String,
    /// What is wanted
    #[arg(long, value_enum, default_value_t = Wanted::Distance)]
    objective: Wanted,
    /// Which numbers may change, between which bounds, measured on what [default: tuning/ENGINE.toml, tuning/strategy.toml]
    #[arg(long, value_name = "FILE")]
    tuning: Option<PathBuf>,
    /// Seed of the search and its cases
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Cases on which before and after are compared; the tuning sees none of them
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    trials: u64,
    /// The world: "ideal" for perfect drives and senses, or a TOML file; what is absent in it keeps its default
    #[arg(long, value_name = "FILE")]
    world: Option<PathBuf>,
    /// Folder for settings.toml, report.html, tune.json and the checkpoint
    #[arg(long, value_name = "FOLDER", default_value = "out/tune")]
    out: PathBuf,
    /// Go on from the checkpoint in the --out folder
    #[arg(long)]
    resume: bool,
}

/// The objectives, as the command line names them.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Wanted {
    /// How far the ball rolls, at the greatest speed that the engine accepts
    Distance,
    /// The ball's speed, at the greatest that the engine accepts
    Speed,
    /// The ball's direction error
    Accuracy,
    /// The time from the request to the contact
    Time,
}

impl From<Wanted> for Objective {
    fn from(wanted: Wanted) -> Self {
        match wanted {
            Wanted::Distance => Self::Distance,
            Wanted::Speed => Self::Speed,
            Wanted::Accuracy => Self::Accuracy,
            Wanted::Time => Self::Time,
        }
    }
}

impl From<TuneError> for Failure {
    fn from(error: TuneError) -> Self {
        match error {
            TuneError::Bench(error) => error.into(),
            TuneError::NoObjective { .. } => Self::other(error),
            other => Self::input(other),
        }
    }
}

impl Tune {
    /// Runs the command.
    ///
    /// # Errors
    /// When a name is not known, a file cannot be used, nothing can be measured, or a simulation diverges.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        if let Some(against) = &self.against {
            return strategy::run(&self, against, output);
        }
        let subject = Subject::of(places::robot(&self.robot)?)?;
        let default = subject.default_world();
        let world = worlds::asked(self.world.as_deref(), &default)?;
        let world_changes = world.changes(&default);
        let subject = subject.in_world(world);
        subject.settings(&self.engine)?;
        let file = match &self.tuning {
            Some(file) => places::tuning(file)?,
            None => places::tuning(&Path::new("tuning").join(format!("{}.toml", self.engine)))?,
        };
        let tuning = Tuning::load(&file)?;
        let name = file.display().to_string();
        let scenario = scenario(&tuning, &name)?;
        let names = ["settings.toml", "report.html", "tune.json", "checkpoint.json"].map(|name| self.out.join(name));
        for file in &names {
            files::check_file(file)?;
        }
        let [settings, html, json, checkpoint] = &names;
        let (generations, per_generation) = (tuning.generations, tuning.population * tuning.cases);
        let mut run =
            Run::new(&subject, &self.engine, &scenario, self.objective.into(), (tuning, name.as_str()), self.seed)?;
        if self.resume {
            run.resume(checkpoint)?;
        }
        std::fs::create_dir_all(&self.out)
            .map_err(|e| Failure::input(format!("{}: cannot be made: {e}", self.out.display())))?;
        let stop = interrupt::stopped_by_the_user();
        let bar = output::bar((generations * per_generation) as u64, "{wide_bar} {pos}/{len} trials {msg} {eta}");
        let done = AtomicU64::new((run.history().len() * per_generation) as u64);
        let each = || bar.set_position(done.fetch_add(1, Ordering::Relaxed) + 1);
        while !run.is_over() {
            if stop.load(Ordering::Relaxed) {
                bar.finish_and_clear();
                let generations = run.history().len();
                output.remark(|_| {
                    let kept = checkpoint.display();
                    format!("stopped after {generations} generations, kept in {kept}; --resume goes on")
                });
                return Ok(ExitCode::from(INTERRUPTED));
            }
            let generation = run.iterate(&each)?;
            bar.set_message(format!("best {:.3}, {:.0} % count,", generation.best, 100.0 * generation.good));
            run.save(checkpoint)?;
        }
        let trials = self.trials as usize;
        bar.set_length(done.load(Ordering::Relaxed) + run.last_trials(trials) as u64);
        bar.set_message("measuring the result,");
        let tuned = run.finish(trials, &each)?;
        bar.set_message("KickBench,");
        let bench = tuned.settings.each_ref().map(|text| kick_bench(&subject, &tuned, &scenario, text, trials));
        let [before, after] = bench;
        let bench = [before?, after?];
        bar.finish_and_clear();

        let object = serde_json::json!({
            "tuned": &tuned,
            "world_changes": world_changes,
            "bench": { "before": &bench[0], "after": &bench[1] },
        });
        let mut batch = files::Batch::default();
        let write = |path: PathBuf, text: &str| {
            std::fs::write(&path, text)
                .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))
        };
        write(batch.stage(settings)?, &settings_text(&tuned))?;
        write(batch.stage(json)?, &object.to_string())?;
        page::page(&tuned, [&bench[0], &bench[1]]).save(batch.stage(html)?)?;
        batch.commit()?;
        output.show(&object, |paint| {
            let changes = world_changes.iter().map(|change| paint.bad(&format!("\nnot the default world: {change}")));
            text(&tuned, paint, &self.out) + &changes.collect::<String>()
        })?;
        Ok(ExitCode::SUCCESS)
    }
}

/// The scenario that the tuning names.
fn scenario(tuning: &Tuning, file: &str) -> Result<Scenario, Failure> {
    let all = Scenario::load_all(&places::scenarios()?)?;
    let known: Vec<String> = all.iter().map(|scenario| scenario.name.clone()).collect();
    all.into_iter().find(|scenario| scenario.name == tuning.scenario).ok_or_else(|| {
        Failure::input(format!("{file}: scenario: \"{}\"; expected one of {}", tuning.scenario, known.join(", ")))
    })
}

/// KickBench's row for some settings; the seed is none that `instep bench` or the tuning uses.
fn kick_bench(
    subject: &Subject,
    tuned: &Tuned,
    scenario: &Scenario,
    settings: &str,
    requests: usize,
) -> Result<Vec<Row>, Failure> {
    let subject = subject.clone().with_settings(&tuned.engine, settings.to_owned())?;
    // Several seeds, so that all cores have work.
    let seeds: Vec<u64> = (0..4).map(|i| 900_000 + 10 * tuned.seed + i).collect();
    let bench = Bench {
        engines: vec![tuned.engine.clone()],
        subjects: vec![subject],
        scenarios: vec![scenario.clone()],
        requests: requests.div_ceil(seeds.len()),
        seeds,
    };
    Ok(rows_over_seeds(&bench.run(None, &|_, _, _| ())?))
}

/// The settings file: what it is, then the settings.
fn settings_text(tuned: &Tuned) -> String {
    let [before, after] = tuned.measured.each_ref().map(|s| s.objective.unwrap_or(f64::NAN));
    format!(
        "# Settings of the engine {} for {}, found by `instep tune` ({}; seed {}).\n# Mean {} on {} unseen cases: {after:.3}, \
         {before:.3} before.\n{}",
        tuned.engine,
        tuned.robot,
        tuned.title,
        tuned.seed,
        tuned.objective.label(),
        tuned.measured[0].cases,
        tuned.settings[1]
    )
}

fn text(tuned: &Tuned, paint: Paint, out: &Path) -> String {
    let mut lines = Vec::new();
    for (name, s) in ["before", "after "].iter().zip(&tuned.measured) {
        let objective = s.objective.map_or_else(|| "none".into(), |value| format!("{value:.3}"));
        let upright = s.upright().map_or_else(|| "-".into(), |share| format!("{:.1} %", 100.0 * share));
        lines.push(format!(
            "{name}  mean {} {}, upright {upright}, of {} cases {}",
            tuned.objective.label(),
            paint.strong(&objective),
            s.cases,
            s.causes()
        ));
    }
    for (i, name) in tuned.names.iter().enumerate() {
        lines.push(format!("{name:<24} {} -> {}", tuned.values[0][i], paint.strong(&tuned.values[1][i].to_string())));
    }
    let trials = tuned.history.last().map_or(0, |last| last.trials);
    lines.push(paint.faint(&format!(
        "{} generations, {trials} trials, {:.1} min; {}",
        tuned.history.len(),
        tuned.seconds / 60.0,
        out.join("settings.toml").display()
    )));
    lines.join("\n")
}
