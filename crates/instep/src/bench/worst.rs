//! The worst kick of each engine and robot, run again and shown as a replay beside the benchmark's page.

use std::path::Path;
use std::sync::Arc;

use instep_bench::cell::{CellKey, CellResult, Kicked, Ran, cases, run_case, world};
use instep_bench::page::Shown;
use instep_bench::{Bench, BenchError, Subject};

use crate::failure::Failure;
use crate::files;
use crate::kick::{Source, Tried, page};

/// How bad a kick was; more is worse. A fall, then a kick that cannot be believed, then a miss, then how far it went off.
fn badness(kick: &Kicked) -> f64 {
    let grave = |bad: bool, weight: f64| if bad { weight } else { 0.0 };
    let off = kick.direction_error.map_or(0.0, f64::abs);
    grave(!kick.upright, 400.0) + grave(kick.audit_invalid, 200.0) + grave(!kick.hit, 100.0) + off
}

/// Stages a page for the worst kick of each engine and robot of which one was not delivered, into the folder `out`.
pub(super) fn pages(
    bench: &Bench,
    cells: &[CellResult],
    out: &Path,
    batch: &mut files::Batch,
) -> Result<Vec<Shown>, Failure> {
    let mut worst: Vec<(&CellKey, usize, &Kicked)> = Vec::new();
    for cell in cells {
        for (index, outcome) in cell.outcomes.iter().enumerate() {
            let Ok(kick) = outcome else { continue };
            if kick.delivered {
                continue;
            }
            let same = |(key, _, _): &&mut (&CellKey, usize, &Kicked)| {
                key.engine == cell.key.engine && key.robot == cell.key.robot
            };
            match worst.iter_mut().find(same) {
                Some(found) if badness(kick) > badness(found.2) => *found = (&cell.key, index, kick),
                Some(_) => {}
                None => worst.push((&cell.key, index, kick)),
            }
        }
    }
    let mut shown = Vec::new();
    for (key, index, kick) in worst {
        let Some(ran) = again(bench, key, index)? else { continue };
        let file = format!("worst-{}-{}.html", key.engine, key.robot);
        let what = match kick {
            kick if !kick.upright => "fell",
            kick if kick.audit_invalid => "failed the audit",
            kick if !kick.hit => "missed",
            _ => "was off what was asked",
        };
        shown.push(Shown {
            cell: [&key.engine, &key.robot, &key.scenario].map(Clone::clone),
            label: format!("Replay of its worst kick: {what} (seed {}, request {})", key.seed, index + 1),
            file: file.clone(),
        });
        let path = out.join(file);
        page(&tried(key, ran, &path, subject(bench, key)?)).save(batch.stage(&path)?)?;
    }
    Ok(shown)
}

fn subject<'a>(bench: &'a Bench, key: &CellKey) -> Result<&'a Subject, Failure> {
    let found = bench.subjects.iter().find(|subject| subject.robot.name == key.robot);
    found.ok_or_else(|| Failure::other(format!("{} is no robot of this run", key.robot)))
}

/// Runs one case of a cell again, which gives the same kick.
fn again(bench: &Bench, key: &CellKey, index: usize) -> Result<Option<Ran>, Failure> {
    let subject = subject(bench, key)?;
    let Some(scenario) = bench.scenarios.iter().find(|scenario| scenario.name == key.scenario) else {
        return Ok(None);
    };
    let run = || -> Result<Option<Ran>, BenchError> {
        let all = cases(subject, scenario, key)?;
        let Some(case) = all.get(index) else { return Ok(None) };
        let mut world = world(subject, scenario, case)?;
        Ok(run_case(subject, &key.engine, case, &mut world, &mut Vec::new())?.2)
    };
    Ok(run()?)
}

fn tried(key: &CellKey, ran: Ran, page: &Path, subject: &Subject) -> Tried {
    let Ran { plan, settings, trial, request } = ran;
    Tried {
        robot: Arc::clone(&subject.robot),
        source: Source::Asked { engine: key.engine.clone(), request, plan },
        world_changes: settings.world.changes(&subject.default_world()),
        settings,
        trial,
        report: page.to_owned(),
        recording: page.to_owned(),
        picture: None,
    }
}
