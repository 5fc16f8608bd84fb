//! `instep retarget`.

use std::path::Path;

use instep_motion::reference::Reference;

use crate::support::{clip, instep, listing, object, project};

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
    let arguments = ["retarget", "--skeleton", asf, "--clip", amc, "--robot", "prestoe", "--clip-rate", "60", "--json"];
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
    let kick = ["kick", "--reference", path.to_str().unwrap(), "--duration", "0.2", "--json"];
    object(&instep(folder.path(), &kick));
}

#[test]
fn a_bvh_says_the_same_as_the_amc() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| object(&instep(folder.path(), &[&["retarget", "--json"], arguments].concat()));
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
    let arguments = ["retarget", "--skeleton", "10.asf", "--clip", "10_03.amc", "--robot", "prestoe", "--json"];
    let done = object(&instep(folder.path(), &arguments));
    assert_eq!(done["frames"], 362);
    assert_eq!(done["kick_foot"], "right");
    assert!((done["t_impact"].as_f64().unwrap() - 1.13).abs() < 0.02, "{}", done["t_impact"]);
}
