//! Every scenario of the rules does what its file says.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use instep_behaviour::{KickTable, Strategy, Which};
use instep_match::scenario::Scenario;
use instep_match::{RuleBook, TeamSetup};

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

/// Each number that the referee judges by is held by a scenario: with another one, that scenario fails.
#[test]
fn another_book_is_found_out() {
    type Change = fn(&mut RuleBook);
    let changes: [(&str, Change); 18] = [
        ("kick-off", |book| book.ready += 1.0),
        ("kick-off", |book| book.set += 1.0),
        ("kick-off-not-taken", |book| book.rules.ball_free_after += 1.0),
        ("kick-off-no-direct-goal", |book| book.rules.direct_goal_from_kick_off = true),
        ("throw-in-not-taken", |book| book.set_play -= 1.0),
        ("goal-kick-opponent-in-area", |book| book.clear -= 1.0),
        ("free-kick-opponent-too-near", |book| book.clear += 1.0),
        ("penalty-kick-not-taken", |book| book.rules.penalty_kick = Some(59.0)),
        ("pushing", |book| book.pushing += 3.0),
        ("ball-holding", |book| book.holding[0] -= 1.0),
        ("ball-holding-keeper", |book| book.holding[1] += 1.0),
        ("does-not-get-up", |book| book.incapable += 1.0),
        ("three-tries-to-get-up", |book| book.rules.get_up_tries = Some(4)),
        ("stuck-local", |book| book.stuck_local += 1.0),
        ("stuck-global", |book| book.stuck_global -= 1.0),
        ("removal-repeated", |book| book.repeat -= 1.0),
        ("extra-time", |book| book.extra_half = None),
        ("mercy", |book| book.mercy = Some(11)),
    ];
    let (team, scenarios) = (team(), scenarios());
    for (i, (name, change)) in changes.into_iter().enumerate() {
        let (_, scenario) = scenarios.iter().find(|(n, _)| n == name).unwrap();
        let (checks, _) = scenario.play_by(&team, change).unwrap();
        assert!(checks.iter().any(|c| c.fault.is_some()), "{name} does not see change {i}");
    }
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
