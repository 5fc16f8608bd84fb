//! An independent DDS implementation calls the node: Eclipse Cyclone DDS from its Python package, in a virtual
//! environment that the test makes under `target/` (needs python3 with venv, and the package registry once). A machine
//! that cannot make it fails the test: a check that is silently left out checks nothing.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use instep_ros::Mapping;
use instep_ros::form::Dynamic;

use crate::support;

/// The release whose wire format was tried by hand.
const PACKAGE: &str = "cyclonedds==11.0.1";

fn succeed(what: &str, command: &mut Command) -> Output {
    let output = command.output().unwrap_or_else(|e| panic!("{what}: {e}; this test needs python3 with venv"));
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{what}: {}\n{out}{err}", output.status);
    output
}

/// The Python that has Cyclone DDS.
fn python() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cyclonedds");
    let python = folder.join("bin/python");
    // Tests may run side by side, and in several processes: one makes it, the others wait.
    let lock = File::create(Path::new(env!("CARGO_TARGET_TMPDIR")).join("cyclonedds.lock")).unwrap();
    lock.lock().unwrap();
    let made = folder.join(PACKAGE);
    if !made.exists() {
        succeed("python3 -m venv", Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder));
        let mut pip = Command::new(&python);
        succeed("pip install", pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", PACKAGE]));
        File::create(made).unwrap();
    }
    python
}

fn run(domain: u16, mapping: Mapping, arguments: &[&str]) {
    let python = python();
    let robot = support::robot();
    let (node, lines) = support::node::<Dynamic>(&robot, domain, mapping, Some(support::simulation(&robot, true)));
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cyclone_client.py");
    let output = Command::new(python).arg(script).args(["--domain", &domain.to_string()]).args(arguments).output();
    let output = output.unwrap();
    let lines = lines.lock().unwrap().join("\n");
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{err}\nThe node said:\n{lines}");
    let report = node.stop().unwrap();
    println!("{out}{report:#?}");
    // What was refused has its cause in the log.
    for why in [
        "ball_position.x is NaN; expected a finite number",
        "kick_speed is inf; expected a finite number",
        "a strength of 0 cannot move a ball",
        "\"the moon\" is not known to TF",
        "header.frame_id is empty",
        "kick_direction.z is NaN",
        "unreachable: the ball is 3.00 m away",
    ] {
        assert!(lines.contains(why), "{why}\nThe node said:\n{lines}");
    }
}

#[test]
fn cyclone_dds_kicks_cancels_and_is_refused() {
    run(61, Mapping::Cyclone, &["--mapping", "cyclone"]);
}

#[test]
fn services_without_header_work_too() {
    run(62, Mapping::Enhanced, &["--mapping", "enhanced", "--brief"]);
}
