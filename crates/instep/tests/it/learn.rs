//! `instep train`, `eval`, `kick --policy`, `learn-table`.

use std::path::Path;

use crate::support::{assert_refused, instep, listing, object};

/// A training small enough for a test.
const SMALL: &str = "
[clip]
from = 0.9
to = 1.6
[start]
stand = 0.1
[ppo]
environments = 32
horizon = 8
minibatch = 128
epochs = 1
[network]
actor = [16]
critic = [16]
";
const REFERENCE: &str = "references/prestoe/10_03_kinodynamic.json";

fn small(folder: &Path) {
    std::fs::write(folder.join("small.toml"), SMALL).unwrap();
}

#[test]
fn a_policy_is_trained_resumed_measured_and_kicks() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    small(at);
    let train = |budget: &str| {
        let arguments = ["train", "--reference", REFERENCE, "--settings", "small.toml", "--budget", budget, "--json"];
        object(&instep(at, &arguments))
    };
    let first = train("512");
    assert_eq!((first["steps"].as_u64(), first["finished"].as_bool()), (Some(512), Some(true)));
    for file in ["checkpoint.safetensors", "policy.safetensors", "policy.onnx", "README.md", "report.html"] {
        assert!(at.join("out/train").join(file).exists(), "{file}");
    }
    // Two in one folder would each undo what the other does.
    let other = std::fs::File::open(at.join("out/train/.checkpoint.safetensors.lock")).unwrap();
    other.lock().unwrap();
    let refused = instep(at, &["train", "--reference", REFERENCE, "--settings", "small.toml", "--budget", "1024"]);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(refused.status.code() == Some(2) && said.contains("another training works on it"), "{said}");
    drop(other);
    let policy = std::fs::read(at.join("out/train/policy.safetensors")).unwrap();
    assert!(policy.len() < 5 << 20, "a policy of {} bytes", policy.len());

    let second = train("1024");
    assert_eq!(second["steps"].as_u64(), Some(1024), "it goes on from the checkpoint");
    assert_ne!(std::fs::read(at.join("out/train/policy.safetensors")).unwrap(), policy);

    let eval = || instep(at, &["eval", "out/train/policy.safetensors", "--trials", "2", "--json"]);
    let (once, twice) = (eval(), eval());
    assert_eq!(once.stdout, twice.stdout);
    let measures = object(&once);
    for key in [
        "trials",
        "completed_rate",
        "link_error_mean",
        "ball_speed_median",
        "direction_error_median_deg",
        "upright_rate",
        "audit_invalid",
        "limit_violations",
        "torque_reversal_share",
    ] {
        assert!(measures.get(key).is_some(), "{key}");
    }
    assert_eq!(measures["trials"].as_u64(), Some(2));

    let kick = object(&instep(at, &["kick", "--policy", "out/train/policy.safetensors", "--json"]));
    assert_eq!(kick["policy"].as_str(), Some("out/train/policy.safetensors"));
    assert_eq!(kick["reference_start"].as_f64(), Some(0.9));
    assert!(at.join("out/kick/report.html").exists());

    // Settings that say nothing of clip and network leave them as the policy has them.
    std::fs::write(at.join("more.toml"), &SMALL[SMALL.find("[start]").unwrap()..SMALL.find("[network]").unwrap()])
        .unwrap();
    let from =
        ["--from", "out/train/policy.safetensors", "--settings", "more.toml", "--budget", "256", "--out", "out/more"];
    object(&instep(at, &[&["train", "--json"], &from[..]].concat()));
    let kick = object(&instep(at, &["kick", "--policy", "out/more/policy.safetensors", "--json"]));
    assert_eq!(kick["reference_start"].as_f64(), Some(0.9));
}

#[test]
fn what_cannot_be_trained_or_run_is_said_in_one_message() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    small(at);
    std::fs::write(at.join("wrong.toml"), "[ppo]\nclip = 3.0\n").unwrap();
    std::fs::write(at.join("noise.safetensors"), [7u8; 300]).unwrap();
    let cases: [(&[&str], &str); 7] = [
        (&["train"], "--reference"),
        (&["train", "--reference", "none.json"], "none.json"),
        (&["train", "--reference", REFERENCE, "--budget", "soon"], "500k"),
        (&["train", "--reference", REFERENCE, "--settings", "wrong.toml"], "ppo.clip"),
        (&["train", "--reference", REFERENCE, "--from", "noise.safetensors"], "noise.safetensors"),
        (&["eval", "noise.safetensors"], "noise.safetensors"),
        (&["eval", "none.safetensors"], "none.safetensors"),
    ];
    let before = listing(at);
    for (arguments, expected) in cases {
        assert_refused(&instep(at, arguments), &[expected], at, &before);
    }
}

#[test]
fn a_checkpoint_of_other_settings_is_not_gone_on_from() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    small(at);
    let train = |settings: &str| {
        instep(at, &["train", "--reference", REFERENCE, "--settings", settings, "--budget", "256", "--json"])
    };
    object(&train("small.toml"));
    std::fs::write(at.join("other.toml"), SMALL.replace("[16]", "[8]")).unwrap();
    let before = listing(at);
    assert_refused(&train("other.toml"), &["other settings", "--out"], at, &before);
}

#[test]
fn the_table_compares_three_references_with_and_without_early_termination() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    small(at);
    let table = |budget: &str| {
        let arguments =
            ["learn-table", "--settings", "small.toml", "--seeds", "2", "--trials", "2", "--budget", budget, "--json"];
        instep(at, &arguments)
    };
    let rows = object(&table("512"))["rows"].as_array().unwrap().clone();
    let cells: Vec<_> = rows
        .iter()
        .map(|row| (row["reference"].as_str().unwrap(), row["early_termination"].as_bool().unwrap()))
        .collect();
    let kinds = ["kinematic, foot slip kept", "kinematic, no foot slip", "kinodynamic"];
    assert_eq!(cells, kinds.map(|kind| [(kind, false), (kind, true)]).concat());
    for row in &rows {
        let seeds: Vec<f64> =
            row["link_error_seeds"].as_array().unwrap().iter().map(|error| error.as_f64().unwrap()).collect();
        let mean = row["link_error_mean"].as_f64().unwrap();
        assert!(seeds.len() == 2 && (0.5 * (seeds[0] + seeds[1]) - mean).abs() < 1e-12, "{row}");
    }
    let page = std::fs::read_to_string(at.join("out/learn-table/report.html")).unwrap();
    assert!(page.contains("Return of an episode, without early termination"));
    // The trainings are kept and are longer than what is asked for now.
    let before = listing(at);
    assert_refused(&table("256"), &["512 control steps", "--budget 256", "--out"], at, &before);
}

/// The figures of its card, with room for what a few trials differ.
#[test]
fn the_shipped_policy_is_what_its_card_says() {
    let folder = tempfile::tempdir().unwrap();
    let asked = ["eval", "policies/prestoe/10_03.safetensors", "--trials", "6", "--seed", "3001", "--json"];
    let measures = object(&instep(folder.path(), &asked));
    let of = |key: &str| measures[key].as_f64().unwrap();
    assert!((11.2..12.1).contains(&of("ball_speed_median")), "{}", of("ball_speed_median"));
    assert!(of("direction_error_median_deg") < 6.0, "{}", of("direction_error_median_deg"));
    assert_eq!((of("upright_rate"), of("limit_violations")), (1.0, 0.0));
    assert!((0.008..0.03).contains(&of("torque_reversal_share")), "{}", of("torque_reversal_share"));
}
