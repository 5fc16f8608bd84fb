//! `instep kick`.

use crate::support::{instep, leg_swing, listing, object};

/// The keys that the issue promises.
const KEYS: [&str; 11] = [
    "ball_speed",
    "direction_error_deg",
    "launch_angle_deg",
    "foot_speed",
    "effective_mass",
    "restitution",
    "audit",
    "audit_reason",
    "upright",
    "fell_at",
    "limit_violations",
];

#[test]
fn a_kick_is_measured_shown_and_recorded() {
    let folder = tempfile::tempdir().unwrap();
    leg_swing().save(&folder.path().join("swing.json")).unwrap();
    let run = instep(folder.path(), &["kick", "--reference", "swing.json", "--json"]);
    let kick = object(&run);
    assert!(run.stderr.is_empty(), "{}", String::from_utf8_lossy(&run.stderr));
    for key in KEYS {
        assert!(kick.get(key).is_some(), "{key}");
    }
    for (key, least, most) in [
        ("ball_speed", 1.0, 12.0),
        ("direction_error_deg", -60.0, 60.0),
        ("launch_angle_deg", -20.0, 80.0),
        ("foot_speed", 1.0, 10.0),
        ("effective_mass", 0.2, 5.0),
        ("restitution", 0.0, 1.0),
    ] {
        let value = kick[key].as_f64().unwrap();
        assert!((least..=most).contains(&value), "{key}: {value}");
    }
    assert!(kick["audit"] == "valid" || kick["audit_reason"] != "", "{}", kick["audit"]);
    for violation in kick["limit_violations"].as_array().unwrap() {
        let number = |key: &str| violation[key].as_f64().unwrap();
        assert!(
            violation["joint"].is_string() && number("peak") > number("limit") && number("time") >= 0.0,
            "{violation}"
        );
    }
    let html = std::fs::read_to_string(folder.path().join("out/kick/report.html")).unwrap();
    assert!(html.starts_with("<!doctype html>") || html.starts_with("<!DOCTYPE html>"));
    let recording = std::fs::read(folder.path().join("out/kick/kick.mcap")).unwrap();
    assert_eq!(&recording[..8], b"\x89MCAP0\r\n");
    assert_eq!(listing(&folder.path().join("out/kick")).len(), 2);
}

#[test]
fn the_same_kick_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    leg_swing().save(&folder.path().join("swing.json")).unwrap();
    let mut runs = Vec::new();
    for _ in 0..2 {
        let run = instep(folder.path(), &["kick", "--reference", "swing.json", "--json", "--duration", "0.6"]);
        object(&run);
        let file = |name: &str| std::fs::read(folder.path().join("out/kick").join(name)).unwrap();
        runs.push((run.stdout, file("report.html"), file("kick.mcap")));
    }
    assert!(runs[0] == runs[1]);
}

#[test]
fn a_missed_ball_is_told_and_no_number_made_up() {
    let folder = tempfile::tempdir().unwrap();
    leg_swing().save(&folder.path().join("swing.json")).unwrap();
    let arguments = ["kick", "--reference", "swing.json", "--ball", "-3,-1.5", "--duration", "0.5"];
    let kick = object(&instep(folder.path(), &[&arguments[..], &["--json"]].concat()));
    for key in ["ball_speed", "direction_error_deg", "launch_angle_deg", "foot_speed", "effective_mass", "restitution"]
    {
        assert!(kick[key].is_null(), "{key}: {}", kick[key]);
    }
    assert_eq!(kick["audit"], "invalid");
    assert!(kick["audit_reason"].as_str().unwrap().contains("did not touch"), "{}", kick["audit_reason"]);
    let text = instep(folder.path(), &arguments).stdout;
    assert!(String::from_utf8_lossy(&text).contains("did not touch the ball"));
}

#[test]
fn the_world_is_as_built_unless_the_ideal_one_is_asked_for_and_named() {
    let folder = tempfile::tempdir().unwrap();
    leg_swing().save(&folder.path().join("swing.json")).unwrap();
    let arguments = ["kick", "--reference", "swing.json", "--duration", "0.4"];
    let run = |more: &[&str]| instep(folder.path(), &[&arguments[..], more].concat());
    assert_eq!(object(&run(&["--json"]))["world_changes"].as_array().unwrap().len(), 0);
    let ideal = object(&run(&["--json", "--world", "ideal"]));
    let change = |key: &str| serde_json::json!({ "key": key, "default": "as_built", "value": "ideal" });
    assert_eq!(ideal["world_changes"], serde_json::json!([change("drives"), change("senses")]));
    let text = run(&["--world", "ideal"]).stdout;
    assert!(String::from_utf8_lossy(&text).contains("drives \"ideal\" (default \"as_built\")"));
    let page = std::fs::read_to_string(folder.path().join("out/kick/report.html")).unwrap();
    assert!(page.contains("as_built"), "the report does not say that the world was changed");
}
