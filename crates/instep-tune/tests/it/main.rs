//! Tuning a real engine in the real world, at a size that a test can afford.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};

use instep_bench::{Scenario, Subject};
use instep_tune::{Generation, Objective, Run, TuneError, Tuning, page};

fn root(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder)
}

fn scenario() -> Scenario {
    Scenario::load(&root("scenarios/straight.toml")).unwrap()
}

/// With ideal drives and senses: what is tested is the search, on kicks that work.
fn nao() -> Subject {
    let subject = Subject::load(&root("robots"), "nao").unwrap();
    let ideal = subject.default_world().ideal();
    subject.in_world(ideal)
}

fn tuning(parameter: &str, bounds: [f64; 2]) -> Tuning {
    let text = format!(
        "title = \"small\"\nscenario = \"straight\"\ncases = 1\npopulation = 4\ngenerations = 2\nstep = 0.2\nsettled = \
         0.0\n[[parameter]]\nname = \"{parameter}\"\nbounds = [{}, {}]\n",
        bounds[0], bounds[1]
    );
    Tuning::parse("small.toml", &text).unwrap()
}

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

#[test]
fn a_tuning_is_the_same_on_one_thread_and_on_two_and_after_a_stop() {
    let (subject, scenario) = (nao(), scenario());
    let folder = tempfile::tempdir().unwrap();
    let checkpoint = folder.path().join("checkpoint.json");
    let start = |seed| {
        let file = (tuning("kick.time", [0.25, 0.4]), "small.toml");
        Run::new(&subject, "preview", &scenario, Objective::Distance, file, seed).unwrap()
    };
    let whole: Vec<Generation> = on_threads(1, || {
        let mut run = start(3);
        while !run.is_over() {
            run.iterate(&|| ()).unwrap();
        }
        run.history().to_vec()
    });
    on_threads(2, || {
        let mut run = start(3);
        run.iterate(&|| ()).unwrap();
        run.save(&checkpoint).unwrap();
        let mut again = start(3);
        again.resume(&checkpoint).unwrap();
        again.iterate(&|| ()).unwrap();
        assert_eq!(again.history(), whole);

        let tuned = again.finish(2, &|| ()).unwrap();
        assert!(tuned.measured.iter().all(|s| s.cases == 2 && s.fell == 0));
        assert!(tuned.settings[1].parse::<toml::Table>().is_ok());
        page::page(&tuned, [&[], &[]]).check().unwrap();
    });
    // A checkpoint of another seed is not this tuning's.
    let error = start(4).resume(&checkpoint).unwrap_err().to_string();
    assert!(error.contains("another tuning"), "{error}");
}

#[test]
fn where_nothing_can_be_measured_it_says_so() {
    let (subject, mut scenario) = (nao(), scenario());
    // Balls that no leg reaches.
    scenario.ball.gap = [3.0, 3.5];
    for objective in [Objective::Distance, Objective::Accuracy] {
        let file = (tuning("kick.time", [0.25, 0.4]), "small.toml");
        let mut run = Run::new(&subject, "preview", &scenario, objective, file, 1).unwrap();
        let error = run.iterate(&|| ()).unwrap_err();
        assert!(matches!(error, TuneError::NoObjective { samples: 4, generation: 1, .. }), "{error}");
        assert!(error.to_string().contains("4 refused"), "{error}");
    }
}

#[test]
fn a_bound_that_the_engine_refuses_is_named() {
    let (subject, scenario) = (nao(), scenario());
    for (engine, parameter, bounds) in [("preview", "kick.share", [0.5, 2.0]), ("dynamic", "swing.windup", [-1.0, 0.1])]
    {
        let file = (tuning(parameter, bounds), "small.toml");
        let error = Run::new(&subject, engine, &scenario, Objective::Time, file, 1).unwrap_err().to_string();
        assert!(error.contains(&format!("bounds of {parameter}")) && error.contains("small.toml"), "{error}");
    }
}

#[test]
fn every_shipped_tuning_fits_its_engine() {
    let (subject, scenario) = (nao(), scenario());
    for entry in std::fs::read_dir(root("tuning")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let engine = name.split('-').next().unwrap().to_owned();
        let tuning = Tuning::load(&path).unwrap();
        if engine == "strategy" {
            // No engine's: `instep tune STRATEGY` has a test of its own.
            continue;
        }
        assert!(root("scenarios").join(format!("{}.toml", tuning.scenario)).is_file(), "{name}");
        let file = (tuning, name.as_str());
        Run::new(&subject, &engine, &scenario, Objective::Distance, file, 1).unwrap();
    }
}
