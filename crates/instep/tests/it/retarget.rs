//! `instep retarget`.

use std::path::Path;

use instep_motion::reference::{Reference, ReferenceKind};
use serde_json::Value;

use crate::support::{clip, instep, listing, object, prestoe, project};

/// The keys that the issue promises.
const KEYS: [&str; 11] = [
    "frames",
    "kick_foot",
    "t_swing",
    "t_lock",
    "t_impact",
    "seconds",
    "frames_per_second",
    "max_stance_slip",
    "keypoint_error_mean",
    "status",
    "violations",
];

#[test]
fn a_clip_becomes_a_reference_that_can_be_kicked_with() {
    let folder = tempfile::tempdir().unwrap();
    let (asf, amc) = (clip("kick.asf"), clip("kick_01.amc"));
    let (asf, amc) = (asf.to_str().unwrap(), amc.to_str().unwrap());
    let arguments =
        ["retarget", "--skeleton", asf, "--clip", amc, "--clip-rate", "60", "--stage", "kinematic", "--json"];
    let done = object(&instep(folder.path(), &arguments));
    for key in KEYS {
        assert!(!done[key].is_null(), "{key}");
    }
    assert_eq!(done["frames"], 48);
    assert_eq!(done["kick_foot"], "right");
    assert!((done["t_impact"].as_f64().unwrap() - 0.5).abs() < 0.05, "{}", done["t_impact"]);
    assert!(done["violations"].as_object().unwrap().values().all(|worst| worst.as_f64().is_some_and(f64::is_finite)));
    let written = listing(&folder.path().join("out/retarget"));
    assert_eq!(written.len(), 2, "{written:?}");

    let path = folder.path().join(done["reference"].as_str().unwrap());
    let reference = Reference::load(&path).unwrap();
    assert_eq!((reference.robot.as_str(), reference.rate), ("prestoe", 30.0));
    assert_eq!(reference.source.clip, "kick_01.amc");
    // The ball lies ahead: at the clip's own place it would start inside a foot.
    let kick = ["kick", "--reference", path.to_str().unwrap(), "--duration", "0.2", "--ball", "1.0,0.0", "--json"];
    object(&instep(folder.path(), &kick));
}

#[test]
fn a_bvh_says_the_same_as_the_amc() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        object(&instep(folder.path(), &[&["retarget", "--stage", "kinematic", "--json"], arguments].concat()))
    };
    let (amc, bvh) = (clip("kick_01.amc"), clip("kick.bvh"));
    let amc =
        run(&["--clip", amc.to_str().unwrap(), "--clip-rate", "60", "--skeleton", clip("kick.asf").to_str().unwrap()]);
    let bvh = run(&["--clip", bvh.to_str().unwrap(), "--unit", "0.01", "--form", "slip"]);
    for key in ["frames", "kick_foot", "t_impact"] {
        assert_eq!(amc[key], bvh[key], "{key}");
    }
    assert_eq!(bvh["kind"], "kinematic-slip");
}

/// The clips of CMU are not part of the project: without them this test says so and stops.
#[test]
fn the_command_of_the_issue() {
    let clips = project().join("../shared/data/cmu_mocap");
    if !clips.is_dir() {
        println!("skipped: {} is not there", Path::new("../shared/data/cmu_mocap").display());
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for name in ["10.asf", "10_03.amc"] {
        std::fs::copy(clips.join(name), folder.path().join(name)).unwrap();
    }
    let arguments = ["retarget", "--skeleton", "10.asf", "--clip", "10_03.amc", "--stage", "kinematic", "--json"];
    let done = object(&instep(folder.path(), &arguments));
    assert_eq!(done["frames"], 362);
    assert_eq!(done["kick_foot"], "right");
    assert!((done["t_impact"].as_f64().unwrap() - 1.13).abs() < 0.02, "{}", done["t_impact"]);
}

/// The keys that the kinodynamic stage adds.
const WHOLE_KEYS: [&str; 9] = [
    "stage_seconds",
    "iterations",
    "violations",
    "torque_violations",
    "root_wrench_residual",
    "foot_speed_at_impact",
    "foot_speed_limits",
    "time_scale",
    "approach_angle",
];

/// The arguments of all stages on the project's own clip, on few nodes.
fn whole<'a>(asf: &'a str, amc: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let coarse = ["retarget", "--skeleton", asf, "--clip", amc, "--clip-rate", "60", "--rate", "120", "--json"];
    [&coarse[..], more].concat()
}

fn own_clip() -> [String; 2] {
    ["kick.asf", "kick_01.amc"].map(|name| clip(name).to_str().unwrap().to_owned())
}

/// The object that a run printed which found no motion that the robot can do.
fn not_feasible(folder: &Path, output: &std::process::Output, code: i32) -> Value {
    assert_eq!(output.status.code(), Some(code), "{}", String::from_utf8_lossy(&output.stderr));
    let done: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(done["kind"], "infeasible");
    let reference = Reference::load(&folder.join(done["reference"].as_str().unwrap())).unwrap();
    assert_eq!(reference.kind, ReferenceKind::Infeasible);
    let html = std::fs::read_to_string(folder.join(done["report"].as_str().unwrap())).unwrap();
    assert!(html.contains("NOT FEASIBLE"));
    done
}

#[test]
fn a_clip_becomes_a_motion_that_the_robot_can_do() {
    let folder = tempfile::tempdir().unwrap();
    let [asf, amc] = own_clip();
    // A kick that is not pushed to the limits needs fewer nodes.
    let calm = "[kinodynamic]\nrate = 120.0\n[kinodynamic.weights]\nq_i = [0.0, 0.0, 0.0]\nq_a = 2e-7\n";
    std::fs::write(folder.path().join("calm.toml"), calm).unwrap();
    let calm = ["--clip-rate", "60", "--settings", "calm.toml", "--time-scale", "1.1", "--json"];
    let arguments = [&["retarget", "--skeleton", &asf, "--clip", &amc][..], &calm].concat();
    let done = object(&instep(folder.path(), &arguments));
    for key in KEYS.iter().chain(&WHOLE_KEYS) {
        assert!(!done[key].is_null(), "{key}");
    }
    assert_eq!((&done["status"], &done["kind"]), (&"solved".into(), &"kinodynamic".into()));
    assert_eq!(done["time_scale"], 1.1);
    assert_eq!(done["torque_violations"], 0);
    assert!(done["root_wrench_residual"].as_f64().unwrap() < 0.01, "{}", done["root_wrench_residual"]);
    for (family, worst) in done["violations"].as_object().unwrap() {
        assert!(worst.as_f64().unwrap() <= 1e-4, "{family}: {worst}");
    }
    for stage in ["rescaling", "kinematic", "kinodynamic", "verification"] {
        assert!(done["stage_seconds"][stage].as_f64().unwrap() >= 0.0, "{stage}");
    }
    let reference = Reference::load(&folder.path().join(done["reference"].as_str().unwrap())).unwrap();
    assert!(reference.rate >= 240.0, "{}", reference.rate);
    assert!(reference.knots.iter().all(|knot| knot.torques.len() == 25 && knot.forces.len() == 10));
}

#[test]
fn a_motion_that_breaks_the_law_between_its_nodes_is_marked() {
    let folder = tempfile::tempdir().unwrap();
    let [asf, amc] = own_clip();
    // Sixty nodes a second do not show a kick.
    let output = instep(folder.path(), &whole(&asf, &amc, &[]));
    let done = not_feasible(folder.path(), &output, 1);
    assert_eq!(done["status"], "unverified");
    assert_eq!(done["failure"]["stage"], "verification");
}

#[test]
fn a_robot_that_is_too_weak_is_told_so() {
    let folder = tempfile::tempdir().unwrap();
    let [asf, amc] = own_clip();
    let weak = folder.path().join("weak");
    std::fs::create_dir(&weak).unwrap();
    std::fs::copy(prestoe().join("prestoe.xml"), weak.join("prestoe.xml")).unwrap();
    let text = std::fs::read_to_string(prestoe().join("robot.toml")).unwrap();
    let lines = text.lines().map(|line| match line.strip_prefix("torque = ") {
        Some(number) => format!("torque = {}", 0.1 * number.trim().parse::<f64>().unwrap()),
        None => line.to_owned(),
    });
    std::fs::write(weak.join("robot.toml"), lines.collect::<Vec<_>>().join("\n")).unwrap();
    let output = instep(folder.path(), &whole(&asf, &amc, &["--robot", "./weak"]));
    let done = not_feasible(folder.path(), &output, 1);
    assert!(["infeasible", "out_of_iterations"].contains(&done["status"].as_str().unwrap()), "{}", done["status"]);
    assert_eq!(done["failure"]["stage"], "kinodynamic");
    let family = done["failure"]["family"].as_str().unwrap();
    assert!(done["violations"][family].as_f64().unwrap() > 1e-3, "{family}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_the_best_motion() {
    let folder = tempfile::tempdir().unwrap();
    let [asf, amc] = own_clip();
    let mut arguments = whole(&asf, &amc, &[]);
    // Nodes enough that it would take longer.
    arguments.iter_mut().filter(|a| **a == "120").for_each(|a| *a = "480");
    let child = std::process::Command::new(env!("CARGO_BIN_EXE_instep"))
        .args(&arguments)
        .current_dir(folder.path())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(1500));
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let done = not_feasible(folder.path(), &child.wait_with_output().unwrap(), 130);
    assert_eq!(done["status"], "stopped");
}

/// Issue 22: a conversion that begins with the rest pose, saved by an editor that writes a byte-order mark, was refused; and a
/// reference called `some/name` had no ending.
#[test]
fn issue_22_a_rest_pose_a_mark_and_a_name_without_ending() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(clip("kick.bvh")).unwrap();
    let values = text.lines().last().unwrap().split_whitespace().count();
    let (head, frames) = text.split_once("Frame Time: 0.0166667\n").unwrap();
    let rest = vec!["0"; values].join(" ");
    let head = head.replace("Frames: 48", "Frames: 49");
    std::fs::write(folder.path().join("rest.bvh"), format!("\u{feff}{head}Frame Time: 0.0166667\n{rest}\n{frames}"))
        .unwrap();
    let bvh = clip("kick.bvh");
    let run = |clip: &str, out: &str| {
        let arguments = ["retarget", "--stage", "kinematic", "--json", "--unit", "0.01", "--clip", clip, "--out", out];
        object(&instep(folder.path(), &arguments))
    };
    let (mended, plain) = (run("rest.bvh", "some/rest"), run(bvh.to_str().unwrap(), "some/plain.json"));
    assert_eq!(mended["jumps"], serde_json::json!(["frame 1 left out: the figure jumps there"]));
    assert_eq!(plain["jumps"], serde_json::json!([]));
    for key in ["frames", "kick_foot", "t_impact", "violations"] {
        assert_eq!(mended[key], plain[key], "{key}");
    }
    let written =
        ["plain.html", "plain.json", "rest.html", "rest.json"].map(|name| folder.path().join("some").join(name));
    assert_eq!(listing(&folder.path().join("some")), written);
}
