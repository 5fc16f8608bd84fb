//! `instep tune STRATEGY --against STRATEGY`: a strategy's numbers, fitted by CMA-ES to win against another in the game
//! simulator.
//!
//! A sample is worth its mean goal difference over the games of its generation, which are the same for all samples of it
//! and new in the next. The best samples and the distribution's mean are compared once more, with the start, on games of
//! their own; before and after are then told with confidence on games that nothing was chosen by.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use instep_behaviour::Strategy;
use instep_match::series::{self, NORMAL_95, Summary};
use instep_match::{MatchSettings, TeamSetup};
use instep_tune::Tuning;
use instep_tune::cmaes::Cma;
use instep_tune::space::Space;
use serde::Serialize;

use super::Tune;
use crate::failure::Failure;
use crate::interrupt::{self, INTERRUPTED};
use crate::matches::{CLOCKS, of_robot};
use crate::output::{self, Output, Paint};
use crate::{files, places};

/// Seeds of generation g of a fit with seed s: s * SEEDS + g; of the final choice and the comparison, the last two.
const SEEDS: u64 = 1_000_000;
/// Games of the final choice for each game of a sample.
const FINAL: usize = 4;
/// Samples in the final choice, beside the start and the mean.
const FINALISTS: usize = 4;
/// What a tuning file for strategies names as its scenario.
const SCENARIO: &str = "match";

/// What the strategies play.
struct Ground {
    settings: Arc<MatchSettings>,
    blue: TeamSetup,
}

impl Ground {
    fn play(&self, strategy: Strategy, games: usize, seed: u64, each: impl Fn() + Sync) -> Result<Summary, Failure> {
        let red = TeamSetup { strategy: Arc::new(strategy), kicks: self.blue.kicks.clone() };
        Ok(Summary::of(&series::play(&self.settings, &red, &self.blue, games, seed, CLOCKS, each)?))
    }
}

/// One generation.
#[derive(Debug, Serialize)]
struct Generation {
    /// Goal difference of the best sample, and the median.
    best: f64,
    median: f64,
    /// The numbers at the distribution's mean.
    values: Vec<f64>,
}

fn strategy(text: &str, file: &str) -> Result<Strategy, Failure> {
    let strategy: Strategy = toml::from_str(text).map_err(|e| Failure::input(format!("{file}: {e}")))?;
    strategy.validate(file)?;
    Ok(strategy)
}

fn load(flag: &str, name: &str) -> Result<Strategy, Failure> {
    if name == "default" {
        return Ok(Strategy::default());
    }
    Ok(Strategy::load(&places::strategy(flag, Path::new(name))?)?)
}

/// Runs the command.
pub(super) fn run(args: &Tune, against: &str, output: &Output) -> Result<ExitCode, Failure> {
    let start = load("STRATEGY", &args.engine)?;
    let text = toml::to_string(&start).map_err(Failure::other)?;
    let blue = Arc::new(load("--against", against)?);
    let settings = MatchSettings::new(&args.rules, None)?;
    let (settings, kicks) = of_robot(settings, None, None, Path::new("kicks/kicks.toml"))?;
    let ground = Ground { settings, blue: TeamSetup { strategy: blue.clone(), kicks } };
    let file = places::tuning(args.tuning.as_deref().unwrap_or(Path::new("tuning/strategy.toml")))?;
    let name = file.display().to_string();
    let tuning = Tuning::load(&file)?;
    if tuning.scenario != SCENARIO {
        let found = &tuning.scenario;
        return Err(Failure::input(format!("{name}: scenario: \"{found}\"; expected \"{SCENARIO}\" for a strategy")));
    }
    let space = Space::new(&tuning, &name, &text)?;
    for (i, parameter) in tuning.parameter.iter().enumerate() {
        for end in [0.0, 1.0] {
            let mut point = space.start().to_vec();
            point[i] = end;
            strategy(&space.settings(&space.values(&point)), &format!("{name}: bounds of {}", parameter.name))?;
        }
    }
    let files: [PathBuf; 2] = ["strategy.toml", "tune.json"].map(|file| args.out.join(file));
    for file in &files {
        files::check_file(file)?;
    }
    let seed = |number: u64| args.seed.wrapping_mul(SEEDS).wrapping_add(number);
    let stop = interrupt::stopped_by_the_user();
    let trials = args.trials as usize;
    let last = (FINALISTS + 2) * FINAL * tuning.cases + 2 * trials;
    let length = tuning.generations * tuning.population * tuning.cases + last;
    let bar = output::bar(length as u64, "{wide_bar} {pos}/{len} games {msg} {eta}");
    let each = || bar.inc(1);
    let mut cma = Cma::new(space.start().to_vec(), tuning.step, tuning.population, args.seed);
    let (mut history, mut best): (Vec<Generation>, Vec<(Vec<f64>, f64)>) = (Vec::new(), Vec::new());
    let settled = |cma: &Cma| cma.spread().iter().all(|spread| *spread < tuning.settled);
    while history.len() < tuning.generations && !settled(&cma) {
        let samples = cma.ask();
        let mut costs = Vec::with_capacity(samples.len());
        for sample in &samples {
            if stop.load(Ordering::Relaxed) {
                bar.finish_and_clear();
                return Ok(ExitCode::from(INTERRUPTED));
            }
            let values = space.values(sample);
            let sample = strategy(&space.settings(&values), &name)?;
            let summary = ground.play(sample, tuning.cases, seed(history.len() as u64), each)?;
            costs.push(-summary.difference_mean);
            best.push((values, -summary.difference_mean));
        }
        cma.tell(&samples, &costs);
        best.sort_by(|a, b| a.1.total_cmp(&b.1));
        best.truncate(FINALISTS);
        costs.sort_by(f64::total_cmp);
        bar.set_message(format!("best {:+.2},", -costs[0]));
        let values = space.values(cma.mean.iter());
        history.push(Generation { best: -costs[0], median: -costs[costs.len() / 2], values });
    }
    let before = space.values(space.start());
    let mut finalists = vec![before.clone(), space.values(cma.mean.iter())];
    finalists.extend(best.into_iter().map(|(values, _)| values));
    let mut chosen = (f64::NEG_INFINITY, before.clone());
    for values in finalists {
        let sample = strategy(&space.settings(&values), &name)?;
        let summary = ground.play(sample, FINAL * tuning.cases, seed(SEEDS - 2), each)?;
        if summary.difference_mean > chosen.0 {
            chosen = (summary.difference_mean, values);
        }
    }
    let after = chosen.1;
    let mut found = strategy(&space.settings(&after), &name)?;
    let measured = [start.clone(), found.clone()].map(|s| ground.play(s, trials, seed(SEEDS - 1), each));
    bar.finish_and_clear();
    let [was, is] = measured;
    let measured = [was?, is?];
    found.name = format!("{}-tuned", start.name);
    found.description = format!("{} fitted against {} by `instep tune`", start.name, blue.name);
    let told = measured.each_ref().map(|s| {
        let [low, high] = s.interval(NORMAL_95);
        serde_json::json!({
            "games": s.games, "difference_mean": s.difference_mean, "difference_low": low, "difference_high": high,
        })
    });
    let object = serde_json::json!({
        "strategy": start.name, "against": blue.name, "rules": args.rules, "seed": args.seed, "names": space.names(),
        "before": before, "after": after, "measured": { "before": told[0], "after": told[1] }, "history": history,
    });
    let mut batch = files::Batch::default();
    let texts = [toml::to_string(&found).map_err(Failure::other)?, object.to_string()];
    for (file, text) in files.iter().zip(texts) {
        std::fs::write(batch.stage(file)?, text)
            .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", file.display())))?;
    }
    batch.commit()?;
    output.show(&object, |paint| {
        let mut text = lines(&blue.name, &measured, paint);
        for ((name, before), after) in space.names().iter().zip(&before).zip(&after) {
            let _ = writeln!(text, "{name:<26} {before} -> {}", paint.strong(&after.to_string()));
        }
        text + &paint.faint(&files[0].display().to_string())
    })?;
    Ok(ExitCode::SUCCESS)
}

fn lines(against: &str, measured: &[Summary; 2], paint: Paint) -> String {
    let mut text = String::new();
    for (when, summary) in ["before", "after "].iter().zip(measured) {
        let [low, high] = summary.interval(NORMAL_95);
        let mean = paint.strong(&format!("{:+.2}", summary.difference_mean));
        let games = summary.games;
        let _ = writeln!(
            text,
            "{when}  {mean} goals a game against {against}, 95 % {low:+.2} to {high:+.2}, {games} games"
        );
    }
    text
}
