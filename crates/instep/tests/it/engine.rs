//! `instep kick --engine` and `instep bench`. Where a test wants a kick that works, drives and senses are ideal.

use crate::support::{assert_refused, instep, listing, object};

const IDEAL: [&str; 2] = ["--world", "ideal"];
const ASKED: [&str; 6] = ["kick", "--engine", "dynamic", "--robot", "wolfgang", "--json"];

#[test]
fn a_kick_on_request_is_shown_and_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let run = instep(folder.path(), &[&ASKED[..], &IDEAL, &["--ball", "0.2,-0.05", "--speed", "1.2"]].concat());
    let answer = &object(&run)["requests"][0];
    assert!(answer["refused"].is_null(), "{answer}");
    let kicked = &answer["kicked"];
    assert!(kicked["hit"].as_bool().unwrap() && kicked["upright"].as_bool().unwrap(), "{answer}");
    let speed = kicked["ball_speed"].as_f64().unwrap();
    assert!((0.9..1.4).contains(&speed), "{speed}");
    let page = std::fs::read_to_string(folder.path().join(answer["report"].as_str().unwrap())).unwrap();
    assert!(page.contains("engine dynamic, right foot"), "the page does not say what was asked");
    assert!(folder.path().join(answer["recording"].as_str().unwrap()).exists());
}

#[test]
fn a_kick_as_built_is_judged_by_the_same_keys() {
    let folder = tempfile::tempdir().unwrap();
    let asked = object(&instep(folder.path(), &[&ASKED[..], &["--ball", "0.2,-0.05", "--speed", "0.8"]].concat()));
    assert_eq!(asked["world_changes"].as_array().unwrap().len(), 0);
    let answer = &asked["requests"][0];
    assert!(answer["refused"].is_null(), "{answer}");
    for key in ["converged", "audit", "touches"] {
        assert!(!answer[key].is_null(), "{key}");
    }
    assert!(answer["kicked"]["upright"].is_boolean() && answer["kicked"]["delivered"].is_boolean(), "{answer}");
}

#[test]
fn a_refused_request_is_an_answer_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let run = instep(folder.path(), &[&ASKED[..], &["--ball", "3,0"]].concat());
    let answer = &object(&run)["requests"][0];
    assert_eq!(answer["refused"]["cause"], "too_far");
    assert!(answer["kicked"].is_null() && answer["report"].is_null());
    assert!(listing(folder.path()).is_empty());
}

#[test]
fn the_policy_on_request_kicks_as_the_policy_that_is_played() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("world.toml"), "").unwrap();
    let world = ["--world", "world.toml", "--json"];
    let played = object(&instep(folder.path(), &[&["kick"], &world[..]].concat()));
    let ask = ["kick", "--engine", "policy", "--robot", "prestoe"];
    let asked = object(&instep(folder.path(), &[&ask[..], &world].concat()));
    let answer = &asked["requests"][0];
    assert!(answer["refused"].is_null(), "{answer}");
    assert_eq!(answer["kicked"]["ball_speed"], played["ball_speed"]);
    assert_eq!(answer["direction_error_deg"], played["direction_error_deg"]);
    assert!(played["ball_speed"].as_f64().unwrap() > 10.0);
    let refused = object(&instep(folder.path(), &[&ask[..], &["--speed", "3", "--json"]].concat()));
    assert_eq!(refused["requests"][0]["refused"]["cause"], "other_kick");
}

#[test]
fn many_requests_come_from_a_file_each_with_its_answer() {
    let folder = tempfile::tempdir().unwrap();
    let lines = "{\"ball\": [0.2, -0.05], \"direction\": 0.1, \"strength\": {\"ball_speed\": 1.0}}\n\
                 {\"ball\": [-0.2, 0.0], \"direction\": 0.0, \"strength\": {\"ball_speed\": 1.0}}\n";
    std::fs::write(folder.path().join("asked.jsonl"), lines).unwrap();
    let answers = object(&instep(folder.path(), &[&ASKED[..], &IDEAL, &["--requests", "asked.jsonl"]].concat()));
    assert!(answers["requests"][0]["kicked"]["hit"].as_bool().unwrap());
    assert_eq!(answers["requests"][1]["refused"]["cause"], "ball_behind");
}

#[test]
fn a_benchmark_gives_the_promised_rows_and_goes_on_where_it_was_stopped() {
    let folder = tempfile::tempdir().unwrap();
    let ask = |more: &[&str]| {
        let fixed =
            ["bench", "--engine", "dynamic", "--robot", "wolfgang", "--requests", "2", "--seeds", "1", "--json"];
        instep(folder.path(), &[&fixed[..], &IDEAL, more].concat())
    };
    let first = object(&ask(&["--scenario", "straight"]));
    for key in [
        "engine",
        "robot",
        "scenario",
        "seed",
        "seed_first",
        "accepted_rate",
        "hit_rate_low",
        "upright_rate_high",
        "delivered_rate",
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
        assert!(!first["rows"][0][key].is_null(), "{key}");
    }
    assert_eq!(first["rows"][0]["hit_rate"], 1.0);
    assert_eq!(first["world_changes"]["wolfgang"][0]["key"], "drives");
    let page = std::fs::read_to_string(folder.path().join("out/bench/bench.md")).unwrap();
    assert!(page.contains("--world ideal") && page.contains("The world is not the default one"), "{page}");
    for file in ["bench.md", "bench.csv", "bench.json", "bench.html"] {
        assert!(folder.path().join("out/bench").join(file).exists(), "{file}");
    }
    // The row that is known is not run again: its times are the same.
    let second = object(&ask(&["--scenario", "straight,noise", "--resume"]));
    assert_eq!(second["rows"].as_array().unwrap().len(), 2);
    assert!(second["rows"].as_array().unwrap().contains(&first["rows"][0]));
}

#[test]
fn what_no_engine_robot_or_scenario_has_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let ask = |arguments: &[&str]| instep(folder.path(), arguments);
    let wrong = |words: &[&str], arguments: &[&str]| assert_refused(&ask(arguments), words, folder.path(), &[]);
    wrong(&["engine", "dynamc", "dynamic"], &["bench", "--engine", "dynamc"]);
    wrong(&["scenario", "strait", "straight"], &["bench", "--scenario", "strait"]);
    wrong(&["--requests", "0"], &["bench", "--requests", "0"]);
    wrong(&["run-up"], &["bench", "--engine", "policy", "--robot", "prestoe", "--scenario", "straight"]);
    wrong(&["policy", "nao", "policy.toml"], &["bench", "--engine", "policy", "--robot", "nao"]);
    wrong(&["policy.toml", "nao"], &["kick", "--engine", "policy", "--robot", "nao"]);
    wrong(&["--robot"], &["kick", "--engine", "dynamic", "--ball", "0.2,0"]);
    std::fs::write(folder.path().join("bad.jsonl"), "{\"ball\": 3}").unwrap();
    let before = listing(folder.path());
    let arguments = ["kick", "--engine", "dynamic", "--robot", "nao", "--requests", "bad.jsonl"];
    assert_refused(&ask(&arguments), &["bad.jsonl", "line 1"], folder.path(), &before);
}
