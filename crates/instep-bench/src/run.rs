//! Runs all cells on all cores, keeps finished ones in a file so that a run can be stopped and resumed, and tells how
//! far it is. Results stand in the order of the cells, whatever thread was first.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;

use rayon::prelude::*;

use crate::BenchError;
use crate::cell::{CellKey, CellResult, run_cell};
use crate::engines::Subject;
use crate::scenario::Scenario;

/// What to run.
#[derive(Debug, Clone)]
pub struct Bench {
    /// Engines by name.
    pub engines: Vec<String>,
    /// Robots.
    pub subjects: Vec<Subject>,
    /// Scenarios.
    pub scenarios: Vec<Scenario>,
    /// Seeds.
    pub seeds: Vec<u64>,
    /// Requests of each cell.
    pub requests: usize,
}

impl Bench {
    /// Every cell, in the table's order: each robot with those of the engines that know it, in the scenarios that ask from
    /// where the engine starts.
    ///
    /// # Errors
    /// When an engine's settings cannot be read, or do not fit the robot.
    pub fn cells(&self) -> Result<Vec<CellKey>, BenchError> {
        let mut cells = Vec::new();
        for subject in &self.subjects {
            let mut engines = Vec::new();
            for engine in self.engines.iter().filter(|engine| subject.knows(engine)) {
                let own = subject.engine(engine)?.own_start();
                // Only who stands at the start can walk up to another ball.
                let walks_up = own.as_ref().is_some_and(|start| start.v.iter().all(|&v| v == 0.0));
                engines.push((engine, own.is_some(), walks_up));
            }
            for scenario in &self.scenarios {
                let asks = |starts: bool, walks_up: bool| match &scenario.run_up {
                    None => !starts,
                    Some(run_up) => starts && (walks_up || run_up.is_near()),
                };
                for &(engine, ..) in engines.iter().filter(|(_, starts, walks_up)| asks(*starts, *walks_up)) {
                    for &seed in &self.seeds {
                        cells.push(CellKey {
                            engine: engine.clone(),
                            robot: subject.robot.name.clone(),
                            scenario: scenario.name.clone(),
                            seed,
                            requests: self.requests,
                            fingerprint: fingerprint(subject, scenario, engine)?,
                        });
                    }
                }
            }
        }
        Ok(cells)
    }

    /// Runs every cell that `resume` does not hold yet; finished cells are added to that file, one JSON object a line.
    /// `progress` is told the number of finished cells, that of all cells, and the one that has just ended.
    ///
    /// # Errors
    /// The first error of a cell, or of the file.
    pub fn run(
        &self,
        resume: Option<&Path>,
        progress: &(dyn Fn(usize, usize, &CellKey) + Sync),
    ) -> Result<Vec<CellResult>, BenchError> {
        let cells = self.cells()?;
        let mut known: BTreeMap<CellKey, CellResult> = BTreeMap::new();
        let mut file = None;
        if let Some(path) = resume {
            let wrong =
                |e: std::io::Error| BenchError::File { file: path.display().to_string(), detail: e.to_string() };
            if let Ok(text) = std::fs::read_to_string(path) {
                // The last line may have been cut off when the run was stopped; such a cell is run again.
                let results = text.lines().filter_map(|line| serde_json::from_str::<CellResult>(line).ok());
                known.extend(results.map(|result| (result.key.clone(), result)));
            }
            let mut opened = std::fs::OpenOptions::new().create(true).append(true).open(path).map_err(wrong)?;
            // A line of its own after one that was cut off.
            opened.write_all(b"\n").map_err(wrong)?;
            file = Some(Mutex::new(opened));
        }
        let done = Mutex::new(cells.iter().filter(|key| known.contains_key(key)).count());
        cells
            .par_iter()
            .map(|key| {
                if let Some(result) = known.get(key) {
                    return Ok(result.clone());
                }
                let subject = self.subjects.iter().find(|subject| subject.robot.name == key.robot);
                let scenario = self.scenarios.iter().find(|scenario| scenario.name == key.scenario);
                let (Some(subject), Some(scenario)) = (subject, scenario) else {
                    return Err(BenchError::Unknown {
                        kind: "cell",
                        found: format!("{key:?}"),
                        known: "those of the benchmark".into(),
                    });
                };
                let result = run_cell(subject, scenario, key)?;
                if let (Some(file), Ok(mut line)) = (&file, serde_json::to_string(&result)) {
                    line.push('\n');
                    if let Ok(mut file) = file.lock() {
                        file.write_all(line.as_bytes())
                            .map_err(|e| BenchError::File { file: "resume file".into(), detail: e.to_string() })?;
                    }
                }
                if let Ok(mut done) = done.lock() {
                    *done += 1;
                    progress(*done, cells.len(), key);
                }
                Ok(result)
            })
            .collect()
    }
}

/// FNV-1a over what a cell's result depends on, besides the program. Comments in settings do not count.
fn fingerprint(subject: &Subject, scenario: &Scenario, engine: &str) -> Result<u64, BenchError> {
    let robot = &subject.robot;
    let settings = subject.settings(engine)?;
    let settings = settings.parse::<toml::Table>().map_or(settings, |table| table.to_string());
    let (joints, stand, mass) = (&robot.joints, &robot.stand, robot.mass());
    let text = format!(
        "{joints:?} {stand:?} {mass:?} {:?} {settings} {scenario:?} {:?} {:?} {:?}",
        subject.ball,
        subject.world(),
        robot.drives,
        robot.senses
    );
    let mix = |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    Ok(text.bytes().fold(0xcbf2_9ce4_8422_2325, mix))
}
