//! `instep learn-table`: paper 1's Table II and Fig 7 again: three kinds of reference, with and without reference-guided early
//! termination, at equal budgets; stopped at will, resumed by the same command.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use indicatif::ProgressBar;
use instep_learn::evaluate::{Evaluation, evaluate};
use instep_learn::settings::{ClipSettings, PpoSettings, StartSettings, TerminationSettings};
use instep_learn::train::{Progress, Training};
use instep_learn::{LearnError, LearnSettings, checkpoint};
use instep_motion::reference::Reference;
use instep_report::{Axis, Column, Plot, Report, Series, Table};
use serde::Serialize;

use crate::failure::Failure;
use crate::output::{self, Output};
use crate::{files, places, train};

/// The kinds of reference: name in the table, shipped file, paper 1's link error without and with early termination, m.
const KINDS: [(&str, &str, &str, &str); 3] = [
    (
        "kinematic, foot slip kept",
        "references/prestoe/10_03_kinematic_slip.json",
        "0.66 \u{b1} 0.47",
        "0.14 \u{b1} 0.03",
    ),
    ("kinematic, no foot slip", "references/prestoe/10_03_kinematic.json", "0.61 \u{b1} 0.51", "0.114 \u{b1} 0.06"),
    ("kinodynamic", "references/prestoe/10_03_kinodynamic.json", "0.60 \u{b1} 0.50", "0.09 \u{b1} 0.02"),
];

/// The arguments of `instep learn-table`.
#[derive(Debug, Args)]
pub(crate) struct LearnTable {
    /// Control steps of each training
    #[arg(long, value_name = "STEPS", default_value = "1M", value_parser = train::steps)]
    budget: u64,
    /// Number of seeds, counted from 1
    #[arg(long, value_name = "N", default_value_t = 3)]
    seeds: u64,
    /// Trials by which each policy is measured, started all over the clip
    #[arg(long, value_name = "N", default_value_t = 60)]
    trials: usize,
    /// Settings of every training but for the early termination, as TOML [default: as near to the paper as the budget allows]
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Number of threads [default: one a core]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Folder for checkpoints, table and report
    #[arg(long, value_name = "FOLDER", default_value = "out/learn-table")]
    out: PathBuf,
}

/// One cell of the table.
#[derive(Debug, Serialize)]
struct Row {
    reference: &'static str,
    early_termination: bool,
    seeds: u64,
    steps: u64,
    /// Mean over trials and seeds, m.
    link_error_mean: f64,
    /// Standard deviation over trials and seeds, m.
    link_error_deviation: f64,
    /// Mean over the trials of each seed, m.
    link_error_seeds: Vec<f64>,
    /// Share of trials to the clip's end.
    completed_rate: f64,
    /// Paper 1's figure, m.
    paper: &'static str,
    /// The curves, one a seed.
    #[serde(skip)]
    curves: Vec<Vec<Progress>>,
}

impl LearnTable {
    /// Runs the command.
    ///
    /// # Errors
    /// When something handed in cannot be used, or a training fails.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        train::threads(self.threads)?;
        let settings = self.settings.as_deref().map(train::settings).transpose()?.unwrap_or_else(settings);
        let names = ["table.md", "table.json", "report.html"].map(|name| self.out.join(name));
        for file in &names {
            files::check_file(file)?;
        }
        if self.seeds == 0 || self.trials == 0 {
            return Err(Failure::input("--seeds, --trials: 0; expected at least 1"));
        }
        std::fs::create_dir_all(&self.out)
            .map_err(|e| Failure::input(format!("{}: cannot be made: {e} (--out)", self.out.display())))?;
        let bar = output::bar(
            KINDS.len() as u64 * 2 * self.seeds * self.budget,
            "{wide_bar} {human_pos}/{human_len} steps, {msg} {eta}",
        );
        let mut rows = Vec::new();
        for (kind, file, without, with) in KINDS {
            for ret in [false, true] {
                let mut cell = settings.clone();
                cell.termination.ret = ret;
                bar.set_message(format!("{kind}, {} early termination,", if ret { "with" } else { "without" }));
                rows.push(self.row(kind, Path::new(file), cell, if ret { with } else { without }, &bar)?);
            }
        }
        bar.finish_and_clear();
        let text = markdown(&rows, self.budget, self.seeds);
        let mut batch = files::Batch::default();
        let [md, json, html] = &names;
        let object = serde_json::json!({ "budget": self.budget, "rows": rows });
        for (path, text) in [(md, text.clone()), (json, object.to_string())] {
            std::fs::write(batch.stage(path)?, text)
                .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))?;
        }
        page(&rows, &text).save(batch.stage(html)?)?;
        batch.commit()?;
        output.show(&object, |_| text)?;
        Ok(ExitCode::SUCCESS)
    }

    fn row(
        &self,
        kind: &'static str,
        file: &Path,
        settings: LearnSettings,
        paper: &'static str,
        bar: &ProgressBar,
    ) -> Result<Row, Failure> {
        let file = places::reference(file)?;
        let reference = Arc::new(Reference::load(&file)?);
        let robot = Arc::new(places::robot(&reference.robot)?);
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let ret = settings.termination.ret;
        let (mut errors, mut seeds, mut completed, mut curves) = (Vec::new(), Vec::new(), 0, Vec::new());
        for seed in 1..=self.seeds {
            let stem = name.trim_end_matches(".json");
            let saved = self.out.join(format!("{stem}-{}-{seed}.safetensors", if ret { "ret" } else { "free" }));
            let mut training = Training::new(
                Arc::clone(&robot),
                Arc::clone(&reference),
                &name,
                settings.clone(),
                seed,
                self.budget,
                None,
            )?;
            if saved.exists() {
                let (found, _) = checkpoint::peek(&saved)?;
                if found != settings {
                    let message = "of a training with other settings; give another --out, or remove the file";
                    return Err(Failure::input(format!("{}: {message}", saved.display())));
                }
                checkpoint::restore(&mut training, &saved)?;
                let iteration = (settings.ppo.environments * settings.ppo.horizon) as u64;
                if training.state.steps >= self.budget + iteration {
                    let message = format!(
                        "of {} control steps, more than --budget {}; give another --out, or a larger budget",
                        training.state.steps, self.budget
                    );
                    return Err(Failure::input(format!("{}: {message}", saved.display())));
                }
                training.state.budget = self.budget;
            }
            bar.inc(training.state.steps.min(self.budget));
            finish(&mut training, &saved, bar)?;
            let evaluation = Evaluation { trials: self.trials, spread: true, ..Evaluation::default() };
            let summary = evaluate(&robot, &training.policy(), &evaluation, &|| ())?;
            seeds.push(summary.link_error_mean);
            errors.extend(summary.each.iter().map(|tried| tried.link_error));
            completed += summary.each.iter().filter(|tried| tried.completed).count();
            curves.push(training.state.curve.clone());
        }
        let count = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / count;
        let variance = errors.iter().map(|e| (e - mean) * (e - mean)).sum::<f64>() / count;
        Ok(Row {
            reference: kind,
            early_termination: ret,
            seeds: self.seeds,
            steps: self.budget,
            link_error_mean: mean,
            link_error_deviation: variance.sqrt(),
            link_error_seeds: seeds,
            completed_rate: completed as f64 / count,
            paper,
            curves,
        })
    }
}

/// The settings of every training but for the early termination. As in the paper, episodes start evenly all over the
/// reference and (39) has a threshold that stays. The clip is the part of 10_03 that the shipped policy follows; few
/// environments and small batches make more of a small budget.
fn settings() -> LearnSettings {
    let d = 0.3;
    LearnSettings {
        clip: ClipSettings { from: Some(0.15), to: Some(2.4) },
        termination: TerminationSettings { d_max: d, d_min: d, ..TerminationSettings::default() },
        start: StartSettings { uniform: 1.0, first: 0.0, ..StartSettings::default() },
        ppo: PpoSettings { environments: 128, minibatch: 1024, sigma: 0.25, ..PpoSettings::default() },
        ..LearnSettings::default()
    }
}

/// Trains to the budget's end, with a checkpoint every hundred iterations.
fn finish(training: &mut Training, saved: &Path, bar: &ProgressBar) -> Result<(), LearnError> {
    while !training.is_over() {
        let before = training.state.steps;
        let progress = training.iterate()?;
        bar.inc(progress.steps - before);
        if progress.iteration.is_multiple_of(100) {
            checkpoint::save(training, saved)?;
        }
    }
    checkpoint::save(training, saved)
}

fn markdown(rows: &[Row], budget: u64, seeds: u64) -> String {
    let mut lines = vec![
        format!("Link error after {budget} control steps, {seeds} seeds (paper 1: 1,000 million steps)."),
        String::new(),
        "| reference | early termination | link error / m | of each seed / m | to the clip's end | paper 1 / m |"
            .into(),
        "|---|---|---|---|---|---|".into(),
    ];
    lines.extend(rows.iter().map(|row| {
        let seeds: Vec<String> = row.link_error_seeds.iter().map(|mean| format!("{mean:.3}")).collect();
        format!(
            "| {} | {} | {:.3} \u{b1} {:.3} | {} | {:.0} % | {} |",
            row.reference,
            if row.early_termination { "with" } else { "without" },
            row.link_error_mean,
            row.link_error_deviation,
            seeds.join(", "),
            100.0 * row.completed_rate,
            row.paper
        )
    }));
    lines.join("\n") + "\n"
}

/// Iterations whose returns are shown as one point.
const POINT: usize = 8;

/// Fig 7's curve of a row: control steps in millions, and the mean return of an episode over all seeds.
fn curve(row: &Row) -> Vec<[f64; 2]> {
    let length = row.curves.iter().map(Vec::len).min().unwrap_or(0);
    (0..length)
        .step_by(POINT)
        .filter_map(|first| {
            let point = || row.curves.iter().flat_map(|curve| &curve[first..(first + POINT).min(length)]);
            let returns: Vec<f64> = point().filter_map(|p| p.episode_return).collect();
            let mean = returns.iter().sum::<f64>() / returns.len() as f64;
            let steps = point().last()?.steps as f64 / 1e6;
            (!returns.is_empty()).then_some([steps, mean])
        })
        .collect()
}

/// The page: the table, and Fig 7's curves.
fn page(rows: &[Row], text: &str) -> Report {
    let curves = |ret: bool| Plot {
        title: format!("Return of an episode, {} early termination", if ret { "with" } else { "without" }),
        x_label: "control steps / million".into(),
        y_label: "mean of the seeds".into(),
        axis: Axis::Other,
        series: rows
            .iter()
            .filter(|row| row.early_termination == ret)
            .map(|row| Series::points(row.reference, curve(row)))
            .collect(),
        ..Plot::default()
    };
    let cells =
        text.lines().filter(|line| line.starts_with("| ")).skip(1).map(|line| {
            line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned().into()).collect::<Vec<_>>()
        });
    Report {
        title: "Three references, with and without early termination".into(),
        subtitle: "paper 1, Table II and Fig 7".into(),
        tables: vec![Table {
            title: "Link error".into(),
            columns: vec![
                Column::text("Reference"),
                Column::text("Early termination"),
                Column::number("Link error / m"),
                Column::number("Of each seed / m"),
                Column::number("To the clip's end"),
                Column::number("Paper 1 / m"),
            ],
            rows: cells.collect(),
        }],
        plots: vec![curves(false), curves(true)],
        ..Report::default()
    }
}
