//! `instep see`: sets written and read again, the page and the recording, and bad input.

use crate::support::{assert_refused, instep, listing, object, prestoe};

fn edit(path: &std::path::Path, from: &str, to: &str) {
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.contains(from), "{}", path.display());
    std::fs::write(path, text.replacen(from, to, 1)).unwrap();
}

#[test]
fn a_set_is_written_measured_and_refused_when_it_is_broken() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let run = |arguments: &[&str]| instep(folder.path(), arguments);
    let made = object(&run(&["see", "data", "--frames", "3", "--seed", "8", "--out", "set", "--json"]));
    assert_eq!(made["frames"], 3);
    let measured = object(&run(&["see", "eval", "--data", "set", "--json"]));
    assert_eq!(measured["frames"], 3);
    for class in ["ball", "goal_post", "robot", "L", "T", "X"] {
        for key in ["precision", "recall", "map50", "map50_95"] {
            assert!(measured["classes"][class].get(key).is_some() && measured["overall"].get(key).is_some());
        }
    }
    std::fs::write(at("set/images/000001.png"), b"no image").unwrap();
    let measured = object(&run(&["see", "eval", "--data", "set", "--json"]));
    assert_eq!((&measured["frames"], &measured["skipped"]), (&2.into(), &1.into()));

    let refused = |arguments: &[&str], words: &[&str]| {
        let before = listing(folder.path());
        assert_refused(&instep(folder.path(), arguments), words, folder.path(), &before);
    };
    std::fs::write(at("set/labels/000002.txt"), "0 0.5 0.5 1.5 0.1\n").unwrap();
    refused(&["see", "eval", "--data", "set"], &["000002.txt", "line 1", "outside the image"]);
    refused(&["see", "train", "--data", "set", "--out", "own.safetensors"], &["000002.txt"]);
    refused(&["see", "eval", "--data", "set/annotations.json", "--model", "none"], &["none"]);
    edit(&at("set/data.yaml"), "ball", "unicorn");
    refused(&["see", "eval", "--data", "set"], &["data.yaml", "unicorn", "goal_post"]);
    std::fs::write(at("own.safetensors"), b"no detector").unwrap();
    refused(&["see", "eval", "--model", "own.safetensors"], &["own.safetensors", "expected a detector"]);
}

#[test]
fn a_robot_looks_and_a_camera_that_cannot_be_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let seen = object(&instep(
        folder.path(),
        &["see", "--robot", "artemis", "--seed", "3", "--frames", "2", "--record", "see.mcap", "--json"],
    ));
    assert_eq!(seen["frames"], 2);
    let recording = std::fs::read(folder.path().join("see.mcap")).unwrap();
    assert!(recording.starts_with(b"\x89MCAP0\r\n"));
    assert!(std::fs::read_to_string(folder.path().join("see.html")).unwrap().contains("data:image/png"));

    std::fs::create_dir(folder.path().join("own")).unwrap();
    for name in ["robot.toml", "prestoe.xml"] {
        std::fs::copy(prestoe().join(name), folder.path().join("own").join(name)).unwrap();
    }
    let settings = folder.path().join("own/robot.toml");
    let good = std::fs::read_to_string(&settings).unwrap();
    let line = good.lines().find(|line| line.starts_with("field_of_view")).unwrap();
    edit(&settings, line, "field_of_view = [0.0, 0.0]");
    let before = listing(folder.path());
    let output = instep(folder.path(), &["see", "--robot", "own", "--out", "own.html"]);
    assert_refused(&output, &["robot.toml", "field_of_view"], folder.path(), &before);
}
