//! The benchmark itself: scenarios load, cells are the same on any number of threads, a stopped run goes on.
#![allow(clippy::unwrap_used, clippy::panic)]

mod adaptive;
mod follow;
mod gaze;
mod servo;
mod walk_up;
mod walking;

use std::path::{Path, PathBuf};

use instep_bench::cell::CellResult;
use instep_bench::table::{csv, json, markdown, quantile, rows, rows_over_seeds};
use instep_bench::{Bench, BenchError, Scenario, Subject};

pub(crate) fn root(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder)
}

fn bench(scenarios: &[&str], requests: usize) -> Bench {
    let mut all = Scenario::load_all(&root("scenarios")).unwrap();
    all.retain(|scenario| scenarios.contains(&scenario.name.as_str()));
    Bench {
        engines: vec!["dynamic".into()],
        subjects: vec![Subject::load(&root("robots"), "wolfgang").unwrap()],
        scenarios: all,
        seeds: vec![1, 2],
        requests,
    }
}

/// A result without the times that plans and ticks took.
fn untimed(cells: &[CellResult]) -> Vec<String> {
    let strip = |cell: &CellResult| CellResult { plan_times: vec![], tick_times: [0.0; 2], ..cell.clone() };
    cells.iter().map(|cell| serde_json::to_string(&strip(cell)).unwrap()).collect()
}

#[test]
fn every_scenario_loads_and_bears_its_files_name() {
    let all = Scenario::load_all(&root("scenarios")).unwrap();
    assert!(all.len() >= 9);
    for scenario in &all {
        assert!(root("scenarios").join(format!("{}.toml", scenario.name)).is_file(), "{}", scenario.name);
    }
}

#[test]
fn a_wrong_scenario_is_refused_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(root("scenarios").join("straight.toml")).unwrap();
    let file = folder.path().join("bad.toml");
    std::fs::write(&file, text.replace("gap = [0.05, 0.15]", "gap = [0.15, 0.05]")).unwrap();
    assert!(matches!(Scenario::load(&file), Err(BenchError::Field { field, .. }) if field == "ball.gap"));
    std::fs::write(&file, text.clone() + "\n[run_up]\nshift = [0.0, 0.1]\n").unwrap();
    assert!(matches!(Scenario::load(&file), Err(BenchError::Field { found, .. }) if found.contains("run_up")));
    std::fs::write(&file, text.replace("[kick]", "[kicc]")).unwrap();
    assert!(matches!(Scenario::load(&file), Err(BenchError::File { .. })));
}

#[test]
fn cells_are_the_same_on_one_thread_and_on_two_and_after_a_stop() {
    let bench = bench(&["noise", "push"], 2);
    let run = |threads: usize, resume: Option<&Path>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bench.run(resume, &|_, _, _| {}).unwrap())
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("cells.jsonl");
    let first = run(1, Some(&file));
    assert_eq!(untimed(&first), untimed(&run(2, None)));
    // Stopped in the middle of the last line: what was finished is kept, the rest is run again.
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, &text[..text.len() - 40]).unwrap();
    assert_eq!(untimed(&first), untimed(&run(2, Some(&file))));
    let kept = std::fs::read_to_string(&file).unwrap();
    assert_eq!(kept.lines().filter(|line| serde_json::from_str::<CellResult>(line).is_ok()).count(), first.len());

    let each = rows(&first);
    assert_eq!(each.len(), 4);
    assert_eq!(rows_over_seeds(&first).len(), 2);
    let object = json(&first);
    for key in [
        "engine",
        "robot",
        "scenario",
        "seed",
        "seed_first",
        "accepted_rate",
        "accepted_rate_low",
        "accepted_rate_high",
        "delivered_rate",
        "delivered_rate_low",
        "delivered_rate_high",
        "converged_rate",
        "requests",
        "refused",
        "hit_rate",
        "upright_rate",
        "ball_speed_median",
        "direction_error_median_deg",
        "direction_error_p90_deg",
        "plan_p99_s",
        "tick_p99_s",
        "audit_invalid",
        "limit_violations",
    ] {
        assert!(object["rows"][0].get(key).is_some(), "{key}");
    }
    assert_eq!(markdown(&each).lines().count(), 6);
    assert_eq!(csv(&each).lines().count(), 5);
    instep_bench::page::page(&first, &[], &[], vec![]).check().unwrap();
}

#[test]
fn an_engine_with_its_own_start_is_asked_by_the_run_ups_alone() {
    let mut bench = bench(&["run-up", "run-up-push", "straight"], 2);
    bench.engines = vec!["policy".into(), "dynamic".into()];
    bench.subjects.push(Subject::load(&root("robots"), "prestoe").unwrap());
    bench.seeds.truncate(1);
    let cells = bench.cells().unwrap();
    let asked: Vec<_> =
        cells.iter().map(|key| (key.robot.as_str(), key.engine.as_str(), key.scenario.as_str())).collect();
    let expected = [
        ("wolfgang", "dynamic", "straight"),
        ("prestoe", "policy", "run-up-push"),
        ("prestoe", "policy", "run-up"),
        ("prestoe", "dynamic", "straight"),
    ];
    assert_eq!(asked, expected);

    bench.engines.truncate(1);
    bench.scenarios.retain(|scenario| scenario.name == "run-up");
    let row = rows(&bench.run(None, &|_, _, _| {}).unwrap()).remove(0);
    assert_eq!((row.requests, row.refused), (2, 0));
    assert_eq!(row.hit.share(), Some(1.0), "{row:?}");
    assert!(row.ball_speed_median.unwrap() > 10.0, "{row:?}");
}

#[test]
fn quantiles_are_by_nearest_rank() {
    let values: Vec<f64> = (1..=10).map(f64::from).collect();
    assert_eq!(quantile(values.clone(), 0.5), Some(5.0));
    assert_eq!(quantile(values.clone(), 0.9), Some(9.0));
    assert_eq!(quantile(values, 0.99), Some(10.0));
    assert_eq!(quantile(vec![f64::NAN], 0.5), None);
}
