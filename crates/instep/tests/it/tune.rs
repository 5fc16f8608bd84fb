//! `instep tune`: what it refuses, and a small tuning from start to end.

use std::path::Path;

use crate::support::{assert_refused, instep, listing, object};

const GOOD: &str = r#"title = "small"
scenario = "straight"
cases = 1
population = 4
generations = 1
step = 0.2
settled = 0.0

[[parameter]]
name = "kick.time"
bounds = [0.25, 0.4]
"#;

fn write(folder: &Path, text: &str) {
    std::fs::write(folder.join("t.toml"), text).unwrap();
}

fn arguments<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["tune", "preview", "--robot", "nao", "--tuning", "t.toml", "--trials", "1", "--world", "ideal"], more].concat()
}

#[test]
fn what_cannot_be_tuned_is_refused_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    for (from, to, words) in [
        ("[0.25, 0.4]", "[0.4, 0.25]", &["t.toml", "bounds of kick.time", "[0.4, 0.25]", "the first below"][..]),
        ("[0.25, 0.4]", "[0.3, 0.3]", &["bounds of kick.time", "[0.3, 0.3]"]),
        ("[0.25, 0.4]", "[]", &["t.toml", "bounds"]),
        ("[0.25, 0.4]", "[nan, 0.4]", &["bounds of kick.time", "NaN"]),
        ("[0.25, 0.4]", "[-1.0, 0.4]", &["bounds of kick.time", "-1", "[0.05, 3]"]),
        ("kick.time", "kick.tiem", &["parameter[0].name", "kick.tiem", "did you mean \"kick.time\""]),
        ("kick.time", "com", &["parameter[0].name", "\"com\"", "the path of a number"]),
        ("population = 4", "population = 2", &["population", "2", "from 4"]),
        ("\"straight\"", "\"crooked\"", &["scenario", "crooked", "straight"]),
        ("step = 0.2", "stride = 0.2", &["t.toml", "stride"]),
    ] {
        write(folder.path(), &GOOD.replace(from, to));
        let before = listing(folder.path());
        assert_refused(&instep(folder.path(), &arguments(&[])), words, folder.path(), &before);
    }
    write(folder.path(), GOOD);
    let before = listing(folder.path());
    for (arguments, words) in [
        (vec!["tune", "previw", "--robot", "nao", "--tuning", "t.toml"], &["previw", "preview"][..]),
        (vec!["tune", "preview-tuned", "--robot", "prestoe", "--tuning", "t.toml"], &["prestoe", "preview-tuned.toml"]),
        (vec!["tune", "preview", "--robot", "nao", "--tuning", "no.toml"], &["no.toml", "--tuning"]),
        (arguments(&["--out", "t.toml"]), &["t.toml"]),
        (arguments(&["--resume"]), &["checkpoint.json", "cannot be read"]),
    ] {
        assert_refused(&instep(folder.path(), &arguments), words, folder.path(), &before);
    }
}

#[test]
fn an_objective_that_no_sample_has_is_told() {
    let folder = tempfile::tempdir().unwrap();
    // A miss of a tenth of a millimetre is too much for any kick.
    write(folder.path(), &GOOD.replace("kick.time", "limits.clearance").replace("[0.25, 0.4]", "[0.09, 0.1]"));
    let output = instep(folder.path(), &arguments(&[]));
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.contains("not a number for any of the 4 samples") && error.contains("4 refused"), "{error}");
}

#[test]
fn a_small_tuning_leaves_settings_a_report_and_a_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), GOOD);
    let result = object(&instep(folder.path(), &arguments(&["--json", "--out", "o"])));
    assert_eq!(result["tuned"]["names"][0], "kick.time");
    assert_eq!(result["world_changes"][0]["value"], "ideal");
    assert_eq!(result["tuned"]["measured"][1]["cases"], 1);
    let read = |name: &str| std::fs::read_to_string(folder.path().join("o").join(name)).unwrap();
    assert!(read("settings.toml").contains("[kick]") && read("report.html").contains("<html"));
    assert!(read("checkpoint.json").contains("\"generation\":1"));
}

#[test]
fn a_strategy_is_fitted_against_another() {
    let folder = tempfile::tempdir().unwrap();
    let tuning = GOOD
        .replace("\"straight\"", "\"match\"")
        .replace("kick.time", "shot.most_turn")
        .replace("[0.25, 0.4]", "[0.5, 3.0]");
    write(folder.path(), &tuning);
    let fit = ["tune", "default", "--tuning", "t.toml", "--trials", "2", "--out", "o", "--json", "--against"];
    let tuned = object(&instep(folder.path(), &[&fit[..], &["default"]].concat()));
    assert_eq!((&tuned["names"][0], &tuned["against"]), (&"shot.most_turn".into(), &"default".into()));
    assert_eq!(tuned["measured"]["after"]["games"], 2);
    let found = std::fs::read_to_string(folder.path().join("o/strategy.toml")).unwrap();
    assert!(found.contains("name = \"default-tuned\""), "{found}");
    // What was found plays.
    let played = ["match", "--red", "o/strategy.toml", "--games", "1", "--json"];
    assert_eq!(object(&instep(folder.path(), &played))["red"]["strategy"], "default-tuned");

    let before = listing(folder.path());
    assert_refused(
        &instep(folder.path(), &[&fit[..], &["none.toml"]].concat()),
        &["none.toml", "--against"],
        folder.path(),
        &before,
    );
    write(folder.path(), &tuning.replace("[0.5, 3.0]", "[0.5, 9.0]"));
    assert_refused(
        &instep(folder.path(), &[&fit[..], &["default"]].concat()),
        &["t.toml", "shot.most_turn", "9"],
        folder.path(),
        &listing(folder.path()),
    );
    write(folder.path(), GOOD);
    assert_refused(
        &instep(folder.path(), &[&fit[..], &["default"]].concat()),
        &["t.toml", "straight", "\"match\""],
        folder.path(),
        &listing(folder.path()),
    );
}
