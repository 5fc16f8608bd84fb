//! What the tests share: running the program, a workspace of their own, and a small kick made by formulas.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use instep_motion::phase::{KickPhases, Side};
use instep_motion::reference::{Knot, Reference, ReferenceKind, Source};
use instep_robot::Robot;
use serde_json::Value;

/// The root of the project.
pub(crate) fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap().to_owned()
}

/// A small clip of the project's own.
pub(crate) fn clip(name: &str) -> PathBuf {
    project().join("crates/instep-motion/tests/data").join(name)
}

/// PresToe's folder.
pub(crate) fn prestoe() -> PathBuf {
    project().join("robots/prestoe")
}

/// Runs the program in `folder` with `arguments`.
pub(crate) fn instep(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_instep")).args(arguments).current_dir(folder).output().unwrap()
}

/// The JSON object that a run that succeeded printed, which is all that it printed.
pub(crate) fn object(output: &Output) -> Value {
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let object: Value = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}"));
    assert!(object.is_object(), "{text}");
    object
}

/// Everything in `folder`, however deep, as sorted paths.
pub(crate) fn listing(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(listing(&path));
        }
        found.push(path);
    }
    found.sort();
    found
}

/// The run was refused as bad input: code 2, nothing on standard output, one message on standard error that holds all
/// of `words`, and `folder` as it was `before`.
pub(crate) fn assert_refused(output: &Output, words: &[&str], folder: &Path, before: &[PathBuf]) {
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(output.stdout.is_empty(), "{}", String::from_utf8_lossy(&output.stdout));
    assert!(error.starts_with("error: "), "{error}");
    assert_eq!(error.matches("error:").count(), 1, "{error}");
    assert!(!error.contains("panicked"), "{error}");
    for word in words {
        assert!(error.contains(word), "no {word:?} in: {error}");
    }
    assert_eq!(listing(folder), before, "something was written; {error}");
}

/// From 0 before `from` to 1 after `to`.
fn ramp(t: f64, from: f64, to: f64) -> f64 {
    let s = ((t - from) / (to - from)).clamp(0.0, 1.0);
    s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
}

/// PresToe stands on its left foot, the right leg wound up and already moving, and swings it through a ball at the
/// origin; 100 Hz. It balances nothing.
pub(crate) fn leg_swing() -> Reference {
    const RATE: f64 = 100.0;
    let robot = Robot::load(&prestoe()).unwrap();
    let index = |name: &str| 7 + robot.joint_index(name).unwrap();
    let (hip, knee, ankle) = (index("right_hip_pitch"), index("right_knee"), index("right_ankle_pitch"));
    let position = |t: f64| {
        let mut q = robot.stand.clone();
        (q[0], q[1]) = (-0.25, 0.085);
        // About y, a positive angle swings the leg back.
        let forward = ramp(t, -0.1, 0.25);
        q[hip] += 0.4 - 1.0 * forward;
        q[knee] += 0.9 - 1.1 * forward;
        q[ankle] -= 0.5 * (1.0 - forward);
        q
    };
    let mut data = robot.data();
    let knots = (0..=50).map(|i| {
        let t = f64::from(i) / RATE;
        let (q, mut v) = (position(t), vec![0.0; robot.nv()]);
        data.difference_into(&position(t - 1e-4), &position(t + 1e-4), 2e-4, &mut v);
        data.set_state(&q, &v);
        Knot {
            base_position: [q[0], q[1], q[2]],
            base_orientation: [q[3], q[4], q[5], q[6]],
            base_velocity: [v[0], v[1], v[2]],
            base_angular_velocity: [v[3], v[4], v[5]],
            joints: q[7..].to_vec(),
            joint_velocities: v[6..].to_vec(),
            contacts: robot.contacts.iter().map(|contact| contact.leg == Side::Left).collect(),
            com: data.com().into(),
            momentum: data.momentum(),
            ..Knot::default()
        }
    });
    Reference {
        format: Reference::FORMAT,
        robot: robot.name.clone(),
        kind: ReferenceKind::Kinematic,
        source: Source {
            clip: "made by formulas".into(),
            skeleton: None,
            clip_start: 0.0,
            acknowledgement: "Instep's own.".into(),
        },
        rate: RATE,
        ball: [0.0, 0.0, 0.11],
        phases: KickPhases { kick_foot: Side::Right, t_plant: 0.0, t_swing: 0.0, t_lock: 0.05, t_impact: 0.1 },
        joint_names: robot.joints.iter().map(|joint| joint.name.clone()).collect(),
        contact_names: robot.contacts.iter().map(|contact| contact.name.clone()).collect(),
        knots: knots.collect(),
    }
}
