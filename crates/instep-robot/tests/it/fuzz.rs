//! Damaged files: whatever is cut off or overwritten, loading and checking give a result or an error, never a panic,
//! and MuJoCo never ends the process.

use std::path::Path;

use instep_robot::Robot;
use instep_robot::check::check;

use crate::support::{Numbers, data_file, robot_folder};

/// Loads and checks a folder in which `name` holds `bytes`.
fn survives(folder: &Path, name: &str, bytes: &[u8]) {
    let file = folder.join(name);
    std::fs::write(&file, bytes).unwrap();
    if let Err(error) = Robot::load(folder) {
        assert!(!error.to_string().is_empty());
    }
    match check(&file) {
        Ok(report) => assert!(!report.found.is_empty() || !report.missing.is_empty()),
        Err(error) => assert!(error.to_string().contains(&folder.display().to_string()), "{error}"),
    }
}

/// Damages one file of a copy of a robot: `cuts` truncations, `changes` overwritten or deleted stretches.
fn damage(robot: &Path, name: &str, cuts: usize, changes: usize, seed: u64) {
    let folder = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(robot).unwrap() {
        let entry = entry.unwrap();
        if entry.file_type().unwrap().is_file() {
            std::fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
        }
    }
    let whole = std::fs::read(robot.join(name)).unwrap();
    for i in 0..cuts {
        survives(folder.path(), name, &whole[..whole.len() * i / cuts]);
    }
    let mut numbers = Numbers(seed);
    let mut pick = |below: usize| ((numbers.next() + 1.0) * 0.5 * below as f64) as usize % below;
    // Bytes that mean something in XML, TOML or a number, and some that never should be there.
    let spite = b"\"'<>/=[]{}#.,-+eE019 \n\0\xff\xc3naif&;";
    for _ in 0..changes {
        let mut bytes = whole.clone();
        for _ in 0..=pick(3) {
            let at = pick(bytes.len());
            match pick(4) {
                0 => bytes[at] = spite[pick(spite.len())],
                1 => bytes.insert(at, spite[pick(spite.len())]),
                2 => drop(bytes.drain(at..(at + 1 + pick(40)).min(bytes.len()))),
                _ => bytes[at] ^= 1 << pick(8),
            }
        }
        survives(folder.path(), name, &bytes);
    }
}

#[test]
fn damaged_robot_files_are_errors() {
    damage(&robot_folder("prestoe"), "robot.toml", 120, 250, 1);
    damage(&robot_folder("nao"), "robot.toml", 60, 120, 2);
}

#[test]
fn damaged_models_are_errors() {
    damage(&robot_folder("prestoe"), "prestoe.xml", 120, 300, 3);
    damage(&robot_folder("nao"), "nao.xml", 60, 150, 4);
}

#[test]
fn damaged_urdfs_are_errors() {
    damage(&data_file("biped"), "biped.urdf", 80, 300, 5);
}
