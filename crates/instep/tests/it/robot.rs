//! `instep robot check`.

use crate::support::{instep, object, prestoe, project};

#[test]
fn a_shipped_robot_can_be_used() {
    let folder = tempfile::tempdir().unwrap();
    for robot in ["prestoe", prestoe().to_str().unwrap()] {
        let report = object(&instep(folder.path(), &["robot", "check", robot, "--json"]));
        assert_eq!(report["kind"], "robot");
        assert_eq!(report["name"], "prestoe");
        assert_eq!(report["usable"], true);
        assert!(!report["found"].as_array().unwrap().is_empty());
    }
}

#[test]
fn a_bare_model_ends_with_one_and_gets_a_robot_toml() {
    let model = project().join("robots/nao/nao.xml");
    let run = instep(&project(), &["robot", "check", model.to_str().unwrap(), "--json"]);
    assert_eq!(run.status.code(), Some(1));
    let report: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!((&report["kind"], &report["usable"]), (&"mjcf".into(), &false.into()));
    assert!(report["suggested_toml"].as_str().unwrap().contains("model = \"nao.xml\""));
    assert!(!report["missing"].as_array().unwrap().is_empty());
    let run = instep(&project(), &["robot", "check", model.to_str().unwrap()]);
    assert!(String::from_utf8_lossy(&run.stdout).contains("cannot be used yet"));
}
