//! `instep bench`: KickBench. Engines x robots x scenarios x seeds to one table, on all cores, stopped and resumed at will.

mod walk;
mod worst;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use instep_bench::directions::directions;
use instep_bench::table::{csv, json, markdown, overview_markdown, rows, rows_over_seeds};
use instep_bench::{Bench as KickBench, BenchError, LEADING, Scenario, Subject, page};
use instep_sim::settings::Change;

use crate::failure::Failure;
use crate::output::{self, Output};
use crate::{files, places, worlds};

/// The scenarios of a first look.
const QUICK: [&str; 3] = ["straight", "match", "run-up"];

/// The robots of KickBench unless some are named.
const ROBOTS: &str = "nao,wolfgang,prestoe";

/// The arguments of `instep bench`.
#[derive(Debug, Args)]
pub(crate) struct Bench {
    /// Engines, separated by commas [default: dynamic,adaptive,preview-tuned,policy, where a robot has settings for them]
    #[arg(long, value_name = "ENGINE", value_delimiter = ',')]
    engine: Vec<String>,
    /// Robots, separated by commas
    #[arg(long, value_name = "ROBOT", value_delimiter = ',', default_value = ROBOTS)]
    robot: Vec<String>,
    /// Measure walking instead of kicks; --robot is then all robots by default, --seeds 20
    #[arg(long, conflicts_with_all = ["engine", "requests", "resume"])]
    walk: bool,
    /// Scenarios by name, separated by commas [default: all that are in scenarios/]
    #[arg(long, value_name = "SCENARIO", value_delimiter = ',')]
    scenario: Vec<String>,
    /// Requests of each scenario and seed [default: 40]
    #[arg(long, value_name = "N")]
    requests: Option<usize>,
    /// Number of seeds [default: 3]
    #[arg(long, value_name = "N")]
    seeds: Option<u64>,
    /// The first seed; the others follow it
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// One seed, 30 requests and the scenarios straight, match and run-up, in place of everything
    #[arg(long)]
    quick: bool,
    /// The world: "ideal" for perfect drives and senses, or a TOML file; what is absent in it keeps its default
    #[arg(long, value_name = "FILE")]
    world: Option<PathBuf>,
    /// Folder for bench.md, bench.csv, bench.json, bench.html and the worst kicks
    #[arg(long, value_name = "FOLDER", default_value = "out/bench")]
    out: PathBuf,
    /// Goes on with a run that was stopped, from the cells kept in FILE [default: cells.jsonl in the --out folder, where
    /// every run keeps its own]
    #[arg(long, value_name = "FILE", num_args = 0..=1)]
    resume: Option<Option<PathBuf>>,
}

impl From<BenchError> for Failure {
    fn from(error: BenchError) -> Self {
        match error {
            BenchError::Sim(error) => error.into(),
            other => Self::input(other),
        }
    }
}

impl Bench {
    /// Runs the command.
    ///
    /// # Errors
    /// When a name is not known, a file cannot be used, or a simulation diverges.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        if self.walk {
            return self.run_walk(output);
        }
        let bench = self.bench()?;
        let cells = bench.cells()?;
        if cells.is_empty() {
            let message = "nothing to compare: engines that start in a run-up (policy) are asked by the scenarios run-up… \
                           alone, the others by the other scenarios";
            return Err(Failure::input(message));
        }
        let names = ["bench.md", "bench.csv", "bench.json", "bench.html"].map(|name| self.out.join(name));
        for file in &names {
            files::check_file(file)?;
        }
        let kept = match &self.resume {
            Some(Some(file)) => file.clone(),
            _ => self.out.join("cells.jsonl"),
        };
        files::check_file(&kept)?;
        let unusable = |e: std::io::Error| Failure::input(format!("{}: cannot be written: {e}", kept.display()));
        if let Some(folder) = kept.parent() {
            std::fs::create_dir_all(folder).map_err(unusable)?;
        }
        if self.resume.is_none() {
            std::fs::write(&kept, "").map_err(unusable)?;
        }
        let bar = output::bar(cells.len() as u64, "{wide_bar} {pos}/{len} {msg} {eta}");
        let cells = bench.run(Some(&kept), &|done, _, key| {
            bar.set_position(done as u64);
            bar.set_message(format!("{} {} {}", key.engine, key.robot, key.scenario));
        })?;
        bar.finish_and_clear();

        let (each, all) = (rows(&cells), rows_over_seeds(&cells));
        let world = match &self.world {
            None => "The world is the default one: drives and senses as the robots have them.".to_owned(),
            Some(world) => format!("**The world is not the default one: {}.**", changed(&bench, world)),
        };
        let note = format!(
            "{world} {} requests a scenario, in {} seeds from {} on. In brackets, and small, the 95 % interval of a rate (Wilson). Hit, \
             upright and all that follows are of the accepted requests, delivered of all: accepted, hit, upright, valid, within \
             15 degrees, 0.8 of the asked speed or more. A hit is a ball that leaves with 0.3 of the asked speed or more in a \
             kick that passed the audit; kicks that did not have no speed, direction or distance. Every start is as after \
             walking: joints 0.01 rad and 0.1 rad/s, the base 0.03 m/s off (standard deviations). Times are those of one thread \
             on its core. Trials of the scenarios run-up… start in the engine's own run-up, all others from the stand.",
            bench.requests * bench.seeds.len(),
            bench.seeds.len(),
            self.seed,
        );
        let changed = self.world.as_ref().map_or_else(String::new, |_| format!("{world}\n\n"));
        let text = format!("{changed}{}\n{}", overview_markdown(&cells), markdown(&all));
        let page_text = format!(
            "# KickBench\n\nMade by `{}`.\n\n{note}\n\n## One line an engine and robot, over all scenarios\n\n{}\n## Everything\n\n{}",
            self.command(),
            overview_markdown(&cells),
            markdown(&all)
        );
        let sweeps = directions(&cells);
        let mut object = json(&cells);
        object["world_changes"] = serde_json::to_value(changes(&bench)).map_err(Failure::other)?;
        object["directions"] = serde_json::to_value(&sweeps).map_err(Failure::other)?;
        let mut batch = files::Batch::default();
        let shown = worst::pages(&bench, &cells, &self.out, &mut batch)?;
        let [md, comma, js, html] = &names;
        let write = |path: PathBuf, text: &str| {
            std::fs::write(&path, text)
                .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))
        };
        write(batch.stage(md)?.to_owned(), &page_text)?;
        write(batch.stage(comma)?.to_owned(), &csv(&each))?;
        write(batch.stage(js)?.to_owned(), &object.to_string())?;
        page::page(&cells, &sweeps, &shown, vec![note]).save(batch.stage(html)?)?;
        batch.commit()?;
        output.show(&object, |_| text)?;
        Ok(ExitCode::SUCCESS)
    }

    /// The command line that makes this table anew.
    fn command(&self) -> String {
        let mut command = String::from("instep bench");
        let list = |names: &[String]| names.join(",");
        if !self.engine.is_empty() {
            command += &format!(" --engine {}", list(&self.engine));
        }
        if list(&self.robot) != ROBOTS {
            command += &format!(" --robot {}", list(&self.robot));
        }
        if !self.scenario.is_empty() {
            command += &format!(" --scenario {}", list(&self.scenario));
        }
        command += if self.quick { " --quick" } else { "" };
        if let Some(world) = &self.world {
            command += &format!(" --world {}", world.display());
        }
        for (option, number) in [("requests", self.requests.map(|n| n as u64)), ("seeds", self.seeds)] {
            command += &number.map_or_else(String::new, |number| format!(" --{option} {number}"));
        }
        command + &format!(" --seed {}", self.seed)
    }

    fn bench(&self) -> Result<KickBench, Failure> {
        let folder = places::scenarios()?;
        let mut scenarios = Scenario::load_all(&folder)?;
        let known: Vec<String> = scenarios.iter().map(|scenario| scenario.name.clone()).collect();
        if let Some(wrong) = self.scenario.iter().find(|name| !known.contains(name)) {
            let known = known.join(", ");
            return Err(BenchError::Unknown { kind: "scenario", found: wrong.clone(), known }.into());
        }
        scenarios.retain(|scenario| match self.scenario.is_empty() {
            true => !self.quick || QUICK.contains(&scenario.name.as_str()),
            false => self.scenario.contains(&scenario.name),
        });
        let subjects = self
            .robot
            .iter()
            .map(|name| {
                let subject = Subject::of(places::robot(name)?)?;
                let world = worlds::asked(self.world.as_deref(), &subject.default_world())?;
                Ok(subject.in_world(world))
            })
            .collect::<Result<Vec<_>, Failure>>()?;
        let asked = if self.engine.is_empty() { LEADING.map(str::to_owned).to_vec() } else { self.engine.clone() };
        for engine in &asked {
            let (mut known, mut unknown) = (false, None);
            for subject in &subjects {
                match subject.engine(engine) {
                    Err(error @ BenchError::NotForRobot { .. }) => unknown = Some(error),
                    Err(error) => return Err(error.into()),
                    Ok(_) => known = true,
                }
            }
            if let Some(error) = unknown.filter(|_| !known && !self.engine.is_empty()) {
                return Err(error.into());
            }
        }
        let (requests, seeds) = if self.quick { (30, 1) } else { (40, 3) };
        let (requests, seeds) = (self.requests.unwrap_or(requests), self.seeds.unwrap_or(seeds));
        for (option, number) in [("--requests", requests as u64), ("--seeds", seeds)] {
            if !(1..=1_000_000).contains(&number) {
                return Err(Failure::input(format!("{option}: {number}; expected a number from 1 to 1000000")));
            }
        }
        Ok(KickBench {
            engines: asked,
            subjects,
            scenarios,
            seeds: (self.seed..self.seed.saturating_add(seeds)).collect(),
            requests,
        })
    }
}

/// In which constants each robot's world is not its default one.
fn changes(bench: &KickBench) -> BTreeMap<&str, Vec<Change>> {
    let of = |subject: &Subject| subject.world().changes(&subject.default_world());
    bench.subjects.iter().map(|subject| (subject.robot.name.as_str(), of(subject))).collect()
}

/// The same in words.
fn changed(bench: &KickBench, world: &Path) -> String {
    let words: BTreeSet<String> = changes(bench).into_values().flatten().map(|change| change.to_string()).collect();
    format!("{}: {}", world.display(), words.into_iter().collect::<Vec<_>>().join("; "))
}
