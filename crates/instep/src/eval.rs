//! `instep eval`: the paper's measures of a policy over seeded trials.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use instep_learn::evaluate::{Evaluation, Summary, evaluate};
use instep_sim::NamedRate;
use instep_sim::settings::Change;
use serde::Serialize;

use crate::failure::Failure;
use crate::output::{self, Output, Paint};
use crate::{places, train, worlds};

/// The arguments of `instep eval`.
#[derive(Debug, Args)]
pub(crate) struct Eval {
    /// The policy: a file that `instep train` wrote
    policy: PathBuf,
    /// Number of trials
    #[arg(long, value_name = "N", default_value_t = 100)]
    trials: usize,
    /// Seed of the first trial; each has the next
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Where in the policy's clip the trials start, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true)]
    start: f64,
    /// The world: "ideal" for perfect drives and senses, or a TOML file; what is absent in it keeps its default
    #[arg(long, value_name = "FILE")]
    world: Option<PathBuf>,
    /// Number of threads [default: one a core]; the result does not depend on it
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Shown<'a> {
    #[serde(flatten)]
    summary: &'a Summary,
    world_changes: &'a [Change],
}

impl Eval {
    /// Runs the command.
    ///
    /// # Errors
    /// When something handed in cannot be used or a simulation diverges.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        if !(1..=1_000_000).contains(&self.trials) {
            return Err(Failure::input(format!("--trials: {}; expected 1 to 1000000", self.trials)));
        }
        train::threads(self.threads)?;
        let policy = train::policy(&self.policy)?;
        let robot = Arc::new(places::robot(&policy.header.robot)?);
        let default = worlds::default(&robot)?;
        let world = worlds::asked(self.world.as_deref(), &default)?;
        let world_changes = world.changes(&default);
        let evaluation =
            Evaluation { trials: self.trials, seed: self.seed, start: self.start, world, ..Evaluation::default() };
        let bar = output::bar(self.trials as u64, "{wide_bar} {pos}/{len} trials {eta}");
        let summary = evaluate(&robot, &policy, &evaluation, &|| bar.inc(1))?;
        bar.finish_and_clear();
        output.show(&Shown { summary: &summary, world_changes: &world_changes }, |paint| {
            let changes = world_changes.iter().map(|change| paint.bad(&format!("\nnot the default world: {change}")));
            text(&summary, paint) + &changes.collect::<String>()
        })?;
        Ok(ExitCode::SUCCESS)
    }
}

fn text(summary: &Summary, paint: Paint) -> String {
    let row = |label: &str, value: String| format!("  {} {value}", paint.faint(&format!("{label:<18}")));
    let or_none = |value: Option<f64>, unit: &str| value.map_or("none".into(), |v| format!("{v:.2} {unit}"));
    let share = |rate: &NamedRate| {
        rate.rate.map_or("none".into(), |r| {
            format!("{:.0} % ({:.0} to {:.0})", 100.0 * r.share, 100.0 * r.low, 100.0 * r.high)
        })
    };
    [
        format!("{} trials; in brackets the 95 % interval of each share", summary.trials),
        row("to the clip's end", share(&summary.completed)),
        row("link error", format!("{:.3} \u{b1} {:.3} m", summary.link_error_mean, summary.link_error_deviation)),
        row("ball hit", share(&summary.hit)),
        row("ball speed", format!("{} (median of the valid)", or_none(summary.ball_speed_median, "m/s"))),
        row("direction error", format!("{} (median)", or_none(summary.direction_error_median_deg, "deg"))),
        row("upright", share(&summary.upright)),
        row("converged", format!("{}, run again at a quarter of the step", share(&summary.converged))),
        row("audit refused", summary.audit_invalid.to_string()),
        row("limits passed", summary.limit_violations.to_string()),
        row("torques from limit to limit", format!("{:.2} % of ticks", 100.0 * summary.torque_reversal_share)),
    ]
    .join("\n")
}
