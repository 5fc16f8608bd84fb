//! Drives as robots have them: each of their faults is there, as large as told.

use instep_robot::Joint;
use instep_robot::control::JointCommand;
use instep_robot::drive::{Drive, DriveKind, DriveSettings, Drives, Measured, Pid, Target};
use proptest::prelude::*;

use crate::support::load;

const STEP: f64 = 0.001;

fn joint() -> Joint {
    Joint {
        name: "joint".into(),
        group: 0,
        range: [-1.0, 1.0],
        torque: 10.0,
        speed: 5.0,
        corner: 0.5,
        kp: 100.0,
        kd: 2.0,
        pid: Pid { p: 100.0, i: 0.0, d: 0.0 },
        dead_zone: 0.0,
        play: 0.0,
        static_friction: 0.0,
        viscous_friction: 0.0,
    }
}

fn at(position: f64, velocity: f64) -> Measured {
    Measured { position, velocity, voltage: 1.0, step: STEP, inverse_inertia: 0.0 }
}

fn asked(position: f64, velocity: f64, torque: f64) -> Target {
    Target { position, velocity, torque }
}

#[test]
fn a_torque_drive_takes_all_and_a_position_servo_takes_angles_alone() {
    let target = asked(0.01, 1.0, 3.0);
    let torque = Drive::default().torque(&joint(), DriveKind::Torque, &target, &at(0.0, 0.0));
    assert!((torque - (1.0 + 2.0 + 3.0)).abs() < 1e-12, "{torque}");

    // What a position servo does not take does not reach it, whoever asks.
    for (name, kept) in [("nao", false), ("wolfgang", false), ("prestoe", true)] {
        let robot = load(name);
        let n = robot.joints.len();
        let mut drives = Drives::new(&robot);
        let command = JointCommand { positions: vec![0.1; n], velocities: vec![1.0; n], torques: vec![2.0; n] };
        drives.offer(0.0, &command);
        assert_eq!(drives.active().positions, command.positions, "{name}");
        assert_eq!(drives.active().velocities == command.velocities, kept, "{name}");
        assert_eq!(drives.active().torques == command.torques, kept, "{name}");
    }
}

#[test]
fn back_emf_damps_a_position_servo() {
    // Stall torque 20 N m on the line, no-load speed 5 rad/s: 4 N m s/rad, whatever the duty.
    let still = Drive::default().torque(&joint(), DriveKind::PositionServo, &asked(0.05, 0.0, 0.0), &at(0.0, 0.0));
    let moving = Drive::default().torque(&joint(), DriveKind::PositionServo, &asked(0.05, 0.0, 0.0), &at(0.0, 1.0));
    assert!((still - 5.0).abs() < 1e-12 && (still - moving - 4.0).abs() < 1e-12, "{still} {moving}");
    // At the no-load speed even the full voltage gives nothing.
    let fast = Drive::default().torque(&joint(), DriveKind::PositionServo, &asked(9.0, 0.0, 0.0), &at(0.0, 5.0));
    assert!(fast.abs() < 1e-12, "{fast}");
}

#[test]
fn d_and_i_act_on_speed_and_time() {
    let with = |pid: Pid| Joint { pid, ..joint() };
    let d = with(Pid { p: 100.0, i: 0.0, d: 3.0 });
    let torque = Drive::default().torque(&d, DriveKind::PositionServo, &asked(0.1, 0.0, 0.0), &at(0.0, 1.0));
    assert!((torque - (10.0 - 3.0 - 4.0)).abs() < 1e-12, "{torque}");
    let i = with(Pid { p: 100.0, i: 1000.0, d: 0.0 });
    let mut drive = Drive::default();
    let first = drive.torque(&i, DriveKind::PositionServo, &asked(0.01, 0.0, 0.0), &at(0.0, 0.0));
    let second = drive.torque(&i, DriveKind::PositionServo, &asked(0.01, 0.0, 0.0), &at(0.0, 0.0));
    assert!((second - first - 1000.0 * 0.01 * STEP).abs() < 1e-12, "{first} {second}");
}

#[test]
fn inside_the_dead_zone_nothing_happens() {
    let joint = Joint { dead_zone: 0.02, ..joint() };
    for kind in [DriveKind::Torque, DriveKind::PositionServo] {
        let torque = |error| Drive::default().torque(&joint, kind, &asked(error, 0.0, 0.0), &at(0.0, 0.0));
        assert_eq!(torque(0.019), 0.0);
        assert!((torque(0.03) - 1.0).abs() < 1e-9 && (torque(-0.03) + 1.0).abs() < 1e-9);
    }
}

#[test]
fn play_lets_the_motor_run_free_between_the_flanks() {
    // 0.5 of the voltage: unloaded the gear runs at 2.5 rad/s, so that 5 mrad of half play take 2 ms, all of it 4.
    let joint = Joint { play: 0.010, ..joint() };
    let mut drive = Drive::default();
    let mut until = |sign: f64| {
        (1..100).find(|_| {
            let torque = drive.torque(&joint, DriveKind::PositionServo, &asked(0.1 * sign, 0.0, 0.0), &at(0.0, 0.0));
            torque.abs() > 0.0
        })
    };
    assert_eq!([until(1.0), until(-1.0), until(1.0), until(1.0)], [Some(2), Some(4), Some(4), Some(1)]);
}

#[test]
fn a_sagging_supply_takes_speed_and_torque() {
    let low = |velocity: f64| Measured { voltage: 0.8, ..at(0.0, velocity) };
    for kind in [DriveKind::Torque, DriveKind::PositionServo] {
        let torque = |now: &Measured| Drive::default().torque(&joint(), kind, &asked(9.0, 0.0, 0.0), now);
        // The line 20 N m (1 - v / 5 rad/s) becomes 20 N m (0.8 - v / 5 rad/s).
        assert!((torque(&at(0.0, 3.5)) - 6.0).abs() < 1e-9);
        assert!((torque(&low(3.5)) - 2.0).abs() < 1e-9);
        assert_eq!(torque(&low(0.0)), 10.0);
    }
    let robot = load("nao");
    let mut drives = Drives::new(&robot);
    let n = robot.joints.len();
    drives.offer(0.0, &JointCommand { positions: vec![9.0; n], ..JointCommand::zeros(n) });
    let knee = robot.legs[0].knee;
    let joint = Joint { play: 0.0, ..robot.joints[knee].clone() };
    let now = at(0.0, 0.9 * joint.speed);
    let before = drives.torque(knee, &joint, now);
    drives.loaded(robot.joints.iter().map(|joint| joint.torque).sum());
    let after = drives.torque(knee, &joint, now);
    let stall = joint.torque / (1.0 - joint.corner);
    assert!((before - after - robot.drives.sag * stall).abs() < 1e-9, "{before} {after}");
}

proptest! {
    /// The bus takes a command once a period, and it acts the delay later: never sooner, never lost.
    #[test]
    fn commands_are_held_and_late(period in 1..15usize, delay in 0..20usize) {
        let mut robot = load("nao");
        robot.drives = DriveSettings {
            period: period as f64 * STEP, delay: delay as f64 * STEP, ..robot.drives
        };
        let mut drives = Drives::new(&robot);
        let mut command = JointCommand::zeros(robot.joints.len());
        let mut time = 0.0;
        for tick in 0..100usize {
            command.positions.fill(tick as f64);
            drives.offer(time, &command);
            let sent = tick.saturating_sub(delay) / period * period;
            prop_assert_eq!(drives.active().positions[0], sent as f64, "tick {}", tick);
            time += STEP;
        }
    }
}

/// A copy of a robot's folder with one change in its `robot.toml`.
fn changed(name: &str, from: &str, to: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(crate::support::robot_folder(name)).unwrap() {
        let entry = entry.unwrap();
        if entry.file_type().unwrap().is_file() {
            std::fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
        }
    }
    let file = folder.path().join("robot.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains(from), "{from}");
    std::fs::write(&file, text.replacen(from, to, 1)).unwrap();
    instep_robot::Robot::load(folder.path()).unwrap_err().to_string()
}

#[test]
fn drives_and_senses_that_cannot_be_are_refused_with_their_key() {
    for (from, to, key, expected) in [
        ("delay = 0.010", "delay = -0.001", "drives.delay", "0 to 0.2 s"),
        ("period = 0.012", "period = 0", "drives.period", "0.0001 to 0.1 s"),
        ("sag = 0.1", "sag = 1.0", "drives.sag", "[0, 0.9]"),
        ("play = 0.0087", "play = 4.0", "group[0].play", "within the joint's range"),
        ("dead_zone = 0.0015", "dead_zone = -1", "group[0].dead_zone", "within the joint's range"),
        ("static_friction = 0.084", "static_friction = 9", "group[0].static_friction", "at most the torque"),
        ("pid = { p = 10.55 }", "pid = { p = 0.0 }", "group[0].pid.p", "above 0"),
        ("pid = { p = 10.55 }", "pid = { p = 0.5 }", "group[0].pid.p", "for its torque limit of 1.674 N m"),
        ("delay = 0.012", "delay = -0.012", "senses.delay", "0 to 0.2 s"),
        ("gyro_bias = 0.01", "gyro_bias = -1.0", "senses.gyro_bias", "at least 0"),
        ("link = \"Head\"", "link = \"Haed\"", "senses.camera.link", "nearest is \"Head\""),
        ("field_of_view = [0.983, 0.763]", "field_of_view = [0.0, 0.7]", "senses.camera.field_of_view", "above 0"),
        ("pitch = 0.693", "pitch = 0.693\nlatency = [0.06, 0.03]", "senses.camera.latency", "the lesser first"),
        ("pitch = 0.693", "pitch = 0.693\nperiod = 0.0", "senses.camera.period", "0.001 to 1 s"),
        ("kind = \"position_servo\"", "kind = \"magic\"", "line", "position_servo"),
    ] {
        let message = changed("nao", from, to);
        assert!(message.contains("robot.toml") && message.contains(key) && message.contains(expected), "{message}");
    }
}
