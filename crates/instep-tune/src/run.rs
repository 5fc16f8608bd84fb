//! The generations of a tuning, with a checkpoint after each, and what comes of it.
//!
//! Noise is met in three places: a sample is tried on several cases, the cases are new in each generation, and at the end
//! the best samples and the distribution's mean are measured again, together with the settings of the start, on cases of
//! their own; the best of these is the result. Before and after are then compared on cases that nothing was chosen by.

use std::path::Path;
use std::time::Instant;

use instep_bench::{BenchError, Scenario, Subject};
use serde::{Deserialize, Serialize};

use crate::TuneError;
use crate::cmaes::Cma;
use crate::evaluate::{Judge, Objective, Summary};
use crate::space::Space;
use crate::tuning::Tuning;

/// The cases of generation g of a tuning with seed s are drawn from the seed s * SEEDS + g; those of the final choice and
/// of the comparison from the two numbers below the next one's. KickBench's own seeds are small numbers.
const SEEDS: u64 = 1_000_000;
/// Cases of the final choice for each case of a sample.
const FINAL: usize = 3;
/// Samples in the final choice.
const FINALISTS: usize = 4;

/// One generation, as it was.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Generation {
    /// Trials so far.
    pub trials: usize,
    /// Least cost of a sample.
    pub best: f64,
    /// Median cost of the samples.
    pub median: f64,
    /// Share of the kicks that counted.
    pub good: f64,
    /// The parameters' values at the distribution's mean, after this generation.
    pub values: Vec<f64>,
    /// Standard deviation of each parameter, as a share of its bounds' distance.
    pub spread: Vec<f64>,
}

/// Which tuning it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Key {
    engine: String,
    robot: String,
    objective: Objective,
    tuning: Tuning,
    settings: String,
    /// The world's constants, as JSON.
    world: String,
    seed: u64,
}

/// All that a tuning needs to go on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct State {
    key: Key,
    cma: Cma,
    history: Vec<Generation>,
    /// The best samples of all generations, best first: values and cost.
    best: Vec<(Vec<f64>, f64)>,
    /// Time of the generations, s.
    seconds: f64,
}

/// A tuning under way.
#[derive(Debug, Clone)]
pub struct Run<'a> {
    subject: &'a Subject,
    scenario: &'a Scenario,
    space: Space,
    state: State,
}

/// What came of a tuning.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tuned {
    /// Engine.
    pub engine: String,
    /// Robot.
    pub robot: String,
    /// What was wanted.
    pub objective: Objective,
    /// The tuning's title.
    pub title: String,
    /// The scenario of its cases.
    pub scenario: String,
    /// Seed.
    pub seed: u64,
    /// The parameters' names.
    pub names: Vec<String>,
    /// Their bounds.
    pub bounds: Vec<[f64; 2]>,
    /// Their values before and after.
    pub values: [Vec<f64>; 2],
    /// The settings before and after.
    #[serde(skip)]
    pub settings: [String; 2],
    /// Before and after on cases of which the tuning has seen none.
    pub measured: [Summary; 2],
    /// The generations.
    pub history: Vec<Generation>,
    /// Time of the generations, s.
    pub seconds: f64,
}

impl<'a> Run<'a> {
    /// A tuning of `engine` on `subject`, with `tuning` (read from `file`), from its first generation.
    ///
    /// # Errors
    /// When the engine does not know the robot, a parameter is not in its settings, or a bound is a value that the engine
    /// refuses.
    pub fn new(
        subject: &'a Subject,
        engine: &str,
        scenario: &'a Scenario,
        objective: Objective,
        (tuning, file): (Tuning, &str),
        seed: u64,
    ) -> Result<Self, TuneError> {
        let settings = subject.settings(engine)?;
        let space = Space::new(&tuning, file, &settings)?;
        let start = space.start().to_vec();
        // The settings as they are, and each bound alone.
        subject.engine(engine)?;
        for (i, parameter) in tuning.parameter.iter().enumerate() {
            for (end, bound) in [0.0, 1.0].into_iter().zip(parameter.bounds) {
                let mut point = start.clone();
                point[i] = end;
                let text = space.settings(&space.values(&point));
                match subject.clone().with_settings(engine, text)?.engine(engine) {
                    Err(BenchError::Kick(error)) => {
                        return Err(TuneError::Field {
                            file: file.to_owned(),
                            field: format!("parameter[{i}].bounds of {}", parameter.name),
                            found: bound.to_string(),
                            expected: format!("a value that the engine takes ({error})"),
                        });
                    }
                    other => drop(other?),
                }
            }
        }
        let cma = Cma::new(start, tuning.step, tuning.population, seed);
        let (engine, robot) = (engine.to_owned(), subject.robot.name.clone());
        let world = serde_json::to_string(&subject.world()).unwrap_or_default();
        let key = Key { engine, robot, objective, tuning, settings, world, seed };
        let state = State { key, cma, history: Vec::new(), best: Vec::new(), seconds: 0.0 };
        Ok(Self { subject, scenario, space, state })
    }

    /// Goes on from the checkpoint in `file`. The number of generations may be another one.
    ///
    /// # Errors
    /// When it cannot be read, or is of another tuning.
    pub fn resume(&mut self, file: &Path) -> Result<(), TuneError> {
        let text = std::fs::read_to_string(file).map_err(|e| TuneError::file(file, format!("cannot be read: {e}")))?;
        let mut found: State = serde_json::from_str(&text)
            .map_err(|e| TuneError::file(file, format!("{e}; expected a checkpoint of `instep tune`")))?;
        found.key.tuning.generations = self.state.key.tuning.generations;
        if found.key != self.state.key {
            let detail =
                "is of another tuning: engine, robot, objective, tuning file, settings, world or seed are not the same";
            return Err(TuneError::file(file, detail));
        }
        self.state = found;
        Ok(())
    }

    /// Writes a checkpoint, whole or not at all.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save(&self, file: &Path) -> Result<(), TuneError> {
        let text = serde_json::to_string(&self.state).map_err(|e| TuneError::file(file, e))?;
        let temporary = file.with_extension("part");
        std::fs::write(&temporary, text)
            .and_then(|()| std::fs::rename(&temporary, file))
            .map_err(|e| TuneError::file(file, format!("cannot be written: {e}")))
    }

    /// Generations so far.
    #[must_use]
    pub fn history(&self) -> &[Generation] {
        &self.state.history
    }

    /// Whether the search has ended: all generations done, or every parameter settled.
    #[must_use]
    pub fn is_over(&self) -> bool {
        let tuning = &self.state.key.tuning;
        let settled = |generation: &Generation| generation.spread.iter().all(|spread| *spread < tuning.settled);
        self.state.history.len() >= tuning.generations || self.state.history.last().is_some_and(settled)
    }

    fn judge(&self) -> Judge<'_> {
        let key = &self.state.key;
        Judge { subject: self.subject, engine: &key.engine, scenario: self.scenario, objective: key.objective }
    }

    /// Seed of the cases of generation `number`.
    fn seed(&self, number: u64) -> u64 {
        self.state.key.seed.wrapping_mul(SEEDS).wrapping_add(number)
    }

    /// One generation; `each` is called after every trial.
    ///
    /// # Errors
    /// When no sample has an objective that is a number, or a simulation diverges.
    pub fn iterate(&mut self, each: &(dyn Fn() + Sync)) -> Result<&Generation, TuneError> {
        let clock = Instant::now();
        let (objective, cases) = (self.state.key.objective, self.state.key.tuning.cases);
        let samples = self.state.cma.ask();
        let values: Vec<Vec<f64>> = samples.iter().map(|sample| self.space.values(sample)).collect();
        let settings: Vec<String> = values.iter().map(|values| self.space.settings(values)).collect();
        let number = self.state.history.len();
        let tried = self.judge().measure(&settings, self.seed(number as u64), cases, each)?;
        let summaries: Vec<Summary> = tried.iter().map(|tried| Summary::new(objective, tried)).collect();
        // A sample without one kick that counts has penalties only, which say nothing of the objective.
        if summaries.iter().all(|s| s.cost.is_nan() || (number == 0 && s.good == 0)) {
            let all = Summary::new(objective, &tried.concat());
            let samples = samples.len();
            return Err(TuneError::NoObjective { samples, generation: number + 1, causes: all.causes() });
        }
        let costs: Vec<f64> = summaries.iter().map(|summary| summary.cost).collect();
        self.state.cma.tell(&samples, &costs);
        self.state.best.extend(values.into_iter().zip(costs.iter().copied()).filter(|(_, cost)| cost.is_finite()));
        self.state.best.sort_by(|a, b| a.1.total_cmp(&b.1));
        self.state.best.truncate(FINALISTS);
        let mut sorted = costs;
        sorted.sort_by(f64::total_cmp);
        let good: usize = summaries.iter().map(|summary| summary.good).sum();
        let trials = samples.len() * cases;
        self.state.history.push(Generation {
            trials: self.state.history.last().map_or(0, |last| last.trials) + trials,
            best: sorted[0],
            median: sorted[sorted.len() / 2],
            good: good as f64 / trials as f64,
            values: self.space.values(self.state.cma.mean.iter()),
            spread: self.state.cma.spread(),
        });
        self.state.seconds += clock.elapsed().as_secs_f64();
        Ok(&self.state.history[number])
    }

    /// Trials of [`Run::finish`] with `trials` of the comparison.
    #[must_use]
    pub fn last_trials(&self, trials: usize) -> usize {
        (self.state.best.len() + 2) * FINAL * self.state.key.tuning.cases + 2 * trials
    }

    /// Chooses the result and compares it with the start on `trials` cases that nothing was chosen by.
    ///
    /// # Errors
    /// When a simulation diverges.
    pub fn finish(&self, trials: usize, each: &(dyn Fn() + Sync)) -> Result<Tuned, TuneError> {
        let key = &self.state.key;
        let start = self.space.values(self.space.start());
        let mut finalists = vec![key.settings.clone()];
        let mut values = vec![start.clone()];
        let mean = (self.space.values(self.state.cma.mean.iter()), 0.0);
        for (found, _) in self.state.best.iter().chain([&mean]) {
            finalists.push(self.space.settings(found));
            values.push(found.clone());
        }
        let judge = self.judge();
        let tried = judge.measure(&finalists, self.seed(SEEDS - 2), FINAL * key.tuning.cases, each)?;
        let cost = |i: &usize| Summary::new(key.objective, &tried[*i]).cost;
        let chosen = (0..finalists.len()).min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(0);
        let settings = [key.settings.clone(), finalists.swap_remove(chosen)];
        let tried = judge.measure(&settings, self.seed(SEEDS - 1), trials, each)?;
        let measured = [0, 1].map(|i| Summary::new(key.objective, &tried[i]));
        Ok(Tuned {
            engine: key.engine.clone(),
            robot: key.robot.clone(),
            objective: key.objective,
            title: key.tuning.title.clone(),
            scenario: key.tuning.scenario.clone(),
            seed: key.seed,
            names: self.space.names().to_vec(),
            bounds: key.tuning.parameter.iter().map(|parameter| parameter.bounds).collect(),
            values: [start, values.swap_remove(chosen)],
            settings,
            measured,
            history: self.state.history.clone(),
            seconds: self.state.seconds,
        })
    }
}
