//! Every scenario of the rules does what its file says.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use instep_behaviour::{KickTable, Strategy, Which};
use instep_match::TeamSetup;
use instep_match::scenario::Scenario;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

pub(crate) fn team() -> TeamSetup {
    let kicks = KickTable::load(&root().join("kicks/kicks.toml")).unwrap();
    let kicks = kicks.only(Which { engine: None, robot: "artemis" }, "kicks").unwrap();
    TeamSetup { strategy: Arc::new(Strategy::default()), kicks: Arc::new(kicks) }
}

fn scenarios() -> Vec<(String, Scenario)> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(root().join("scenarios/rules")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.iter().map(|f| (f.file_stem().unwrap().to_string_lossy().into_owned(), Scenario::load(f).unwrap())).collect()
}

#[test]
fn every_rule_is_judged_as_its_scenario_says() {
    let team = team();
    let mut faults = Vec::new();
    for (name, scenario) in scenarios() {
        let (checks, _) = scenario.play(&team).unwrap();
        faults.extend(checks.iter().filter_map(|c| Some(format!("{name}: {}: {}", c.what, c.fault.as_ref()?))));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_scenario_that_cannot_be_is_refused_with_its_place() {
    let folder = std::env::temp_dir().join(format!("instep-rules-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("bad.toml");
    let good = "title = \"t\"\nrules = \"hsl-m\"\nstart = \"open\"\nseconds = 1\nexpect = []\n";
    for (text, words) in [
        (good.replace("seconds = 1", "seconds = -1"), "seconds: -1; expected 0 to 3600"),
        (good.replace("seconds = 1", "second = 1"), "second"),
        (good.replace("open", "opened"), "opened"),
        (format!("{good}team = 2\n"), "team: 2; expected 0 or 1"),
        (format!("{good}ball = {{ position = [nan, 0] }}\n"), "NaN; expected a number"),
        (good.replace("[]", "[{ what = { event = \"goal\" } }]"), "team"),
        (good.replace("[]", "[{ what = { event = \"goal\", team = 0, by = 3 } }]"), "by"),
    ] {
        std::fs::write(&file, &text).unwrap();
        let error = Scenario::load(&file).unwrap_err().to_string();
        assert!(error.contains("bad.toml") && error.contains(words), "{text}\n{error}");
    }
    std::fs::write(&file, good.replace("hsl-m", "moon")).unwrap();
    assert!(Scenario::load(&file).unwrap().play(&team()).is_err());
    std::fs::remove_dir_all(&folder).unwrap();
}
