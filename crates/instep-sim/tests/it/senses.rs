//! Senses as robots have them: each of their faults is there, as large as told, and gone in the ideal world.

use std::sync::Arc;

use instep_robot::Robot;
use instep_robot::control::{BallObservation, JointCommand, Sensors};
use instep_robot::senses::SenseSettings;
use instep_sim::sensors::SensorSuite;
use instep_sim::settings::{Fidelity, WorldSettings};
use instep_sim::{BallState, World};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::robot;

const TICK: f64 = 0.002;

/// PresToe with other senses, read at every tick.
fn with(senses: SenseSettings) -> Arc<Robot> {
    let mut robot = (*robot("prestoe")).clone();
    robot.drives.period = TICK;
    robot.camera = robot.camera.filter(|_| senses.camera.is_some());
    robot.senses = senses;
    Arc::new(robot)
}

fn world(robot: &Arc<Robot>, senses: Fidelity) -> World {
    let mut settings = WorldSettings { senses, ..WorldSettings::default() };
    settings.step.tick = TICK;
    World::new(Arc::clone(robot), &settings).unwrap()
}

/// The first reading of a robot that stands, in a world and with a seed.
fn reading(world: &mut World, seed: u64) -> Sensors {
    let mut suite = SensorSuite::new(world, seed);
    suite.sense(world);
    let mut sensors = Sensors::default();
    suite.read_into(0.0, &mut sensors);
    sensors
}

/// The same after a fifth of a second on its feet.
fn settled(robot: &Arc<Robot>, senses: Fidelity) -> World {
    let mut world = world(robot, senses);
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&robot.stand[7..]);
    for _ in 0..100 {
        world.advance(&command, None).unwrap();
    }
    world
}

/// Root mean square over 300 seeds of what `error` finds in a reading against one of perfect senses.
fn deviation<const N: usize>(senses: SenseSettings, error: impl Fn(&Sensors, &Sensors) -> [f64; N]) -> f64 {
    let robot = with(senses);
    let truth = reading(&mut settled(&robot, Fidelity::Ideal), 1);
    let mut world = settled(&robot, Fidelity::AsBuilt);
    let errors = (0..300).flat_map(|seed| error(&reading(&mut world, seed), &truth));
    (errors.map(|e| e * e).sum::<f64>() / (300 * N) as f64).sqrt()
}

fn assert_deviation(found: f64, stated: f64) {
    assert!((found / stated - 1.0).abs() < 0.1, "{found} instead of {stated}");
}

fn three(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn orientation([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

#[test]
fn offsets_biases_and_noise_have_the_stated_deviation() {
    let none = SenseSettings::default;
    let joints = |a: &Sensors, b: &Sensors| [3, 7, 11].map(|j| a.joint_positions[j] - b.joint_positions[j]);
    assert_deviation(deviation(SenseSettings { encoder_offset: 0.02, ..none() }, joints), 0.02);
    let gyro = |a: &Sensors, b: &Sensors| three(a.gyro, b.gyro);
    assert_deviation(deviation(SenseSettings { gyro_bias: 0.03, ..none() }, gyro), 0.03);
    assert_deviation(deviation(SenseSettings { gyro_noise: 0.03, ..none() }, gyro), 0.03);
    let force = |a: &Sensors, b: &Sensors| three(a.accelerometer, b.accelerometer);
    assert_deviation(deviation(SenseSettings { accelerometer_bias: 0.3, ..none() }, force), 0.3);
    assert_deviation(deviation(SenseSettings { accelerometer_noise: 0.3, ..none() }, force), 0.3);
    let tilt = |a: &Sensors, b: &Sensors| {
        let error = (orientation(b.orientation).inverse() * orientation(a.orientation)).scaled_axis();
        [error.x, error.y]
    };
    assert_deviation(deviation(SenseSettings { tilt_bias: 0.02, ..none() }, tilt), 0.02);
    assert_deviation(deviation(SenseSettings { orientation_noise: 0.02, ..none() }, tilt), 0.02);
}

#[test]
fn faults_stay_and_noise_changes() {
    for (senses, stays) in [
        (SenseSettings { gyro_bias: 0.03, ..SenseSettings::default() }, true),
        (SenseSettings { gyro_noise: 0.03, ..SenseSettings::default() }, false),
    ] {
        let mut world = world(&with(senses), Fidelity::AsBuilt);
        let mut suite = SensorSuite::new(&mut world, 3);
        let mut read = || {
            let mut sensors = Sensors::default();
            suite.sense(&world);
            suite.read_into(0.0, &mut sensors);
            sensors.gyro
        };
        assert_eq!(read() == read(), stays);
    }
}

#[test]
fn the_estimated_yaw_runs_away_with_time() {
    let senses = SenseSettings { yaw_drift: 0.05, ..SenseSettings::default() };
    let robot = with(senses);
    let mut world = world(&robot, Fidelity::AsBuilt);
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&robot.stand[7..]);
    let mut suites: Vec<_> = (0..200).map(|seed| SensorSuite::new(&mut world, seed)).collect();
    let mut rates = [0.0; 2];
    for (rate, ticks) in rates.iter_mut().zip([100, 200]) {
        for _ in 0..ticks {
            world.advance(&command, None).unwrap();
        }
        let time = world.time();
        for suite in &mut suites {
            suite.sense(&world);
            let mut sensors = Sensors::default();
            suite.read_into(time, &mut sensors);
            let yaw = orientation(sensors.orientation).euler_angles().2 / time;
            *rate += yaw * yaw / 200.0;
        }
    }
    let [early, late] = rates.map(f64::sqrt);
    assert_deviation(early, 0.05);
    assert_deviation(late, early);
}

#[test]
fn foot_sensors_have_gain_zero_dead_zone_and_noise() {
    let none = SenseSettings::default;
    // Those two that carry most.
    let loaded = |b: &Sensors| {
        let mut points: Vec<usize> = (0..b.contact_forces.len()).collect();
        points.sort_by(|&i, &j| b.contact_forces[j].total_cmp(&b.contact_forces[i]));
        [points[0], points[1]]
    };
    let relative = |a: &Sensors, b: &Sensors| loaded(b).map(|c| a.contact_forces[c] / b.contact_forces[c] - 1.0);
    assert_deviation(deviation(SenseSettings { foot_gain: 0.1, ..none() }, relative), 0.1);
    assert_deviation(deviation(SenseSettings { foot_noise: 0.1, ..none() }, relative), 0.1);
    let absolute = |a: &Sensors, b: &Sensors| loaded(b).map(|c| a.contact_forces[c] - b.contact_forces[c]);
    assert_deviation(deviation(SenseSettings { foot_offset: 1.0, ..none() }, absolute), 1.0);

    let robot = with(SenseSettings { foot_dead_zone: 1000.0, ..none() });
    let dead = reading(&mut settled(&robot, Fidelity::AsBuilt), 1);
    let alive = reading(&mut settled(&robot, Fidelity::Ideal), 1);
    assert!(alive.contact_forces.iter().sum::<f64>() > 100.0, "{:?}", alive.contact_forces);
    assert!(dead.contact_forces.iter().all(|&force| force == 0.0));
    assert_eq!(dead.centre_of_pressure, [None; 2]);
}

#[test]
fn encoders_are_coarse_and_know_speed_by_differences() {
    let step = 0.002;
    let robot = with(SenseSettings { encoder_resolution: step, ..SenseSettings::default() });
    let mut world = world(&robot, Fidelity::AsBuilt);
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&robot.stand[7..]);
    command.positions.iter_mut().for_each(|q| *q += 0.1);
    let mut suite = SensorSuite::new(&mut world, 1);
    suite.sense(&world);
    let (mut last, mut now) = (Sensors::default(), Sensors::default());
    suite.read_into(0.0, &mut last);
    for _ in 0..20 {
        world.advance(&command, None).unwrap();
        suite.sense(&world);
        suite.read_into(0.0, &mut now);
        for j in 0..robot.joints.len() {
            let steps = now.joint_positions[j] / step;
            assert!((steps - steps.round()).abs() < 1e-6);
            assert!((now.joint_positions[j] - world.q()[7 + j]).abs() <= 0.5 * step + 1e-12);
            let speed = (now.joint_positions[j] - last.joint_positions[j]) / TICK;
            assert!((now.joint_velocities[j] - speed).abs() < 1e-9);
        }
        last.copy_from(&now);
    }
}

#[test]
fn readings_come_once_a_period_and_late() {
    let mut robot = (*robot("nao")).clone();
    robot.senses = SenseSettings { delay: 0.004, ..SenseSettings::default() };
    robot.drives.period = 0.012;
    let robot = Arc::new(robot);
    let mut world = world(&robot, Fidelity::AsBuilt);
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&robot.stand[7..]);
    let mut suite = SensorSuite::new(&mut world, 1);
    suite.sense(&world);
    let mut truth = vec![world.q()[7..].to_vec()];
    let mut sensors = Sensors::default();
    for tick in 1..40usize {
        world.advance(&command, None).unwrap();
        suite.sense(&world);
        truth.push(world.q()[7..].to_vec());
        suite.read_into(world.time(), &mut sensors);
        assert_eq!(sensors.joint_positions, truth[tick.saturating_sub(2) / 6 * 6], "tick {tick}");
    }
}

#[test]
fn a_drive_goes_where_its_own_encoder_says() {
    let robot = with(SenseSettings { encoder_offset: 0.05, ..SenseSettings::default() });
    let as_built = Fidelity::AsBuilt;
    let settings = WorldSettings { senses: as_built, drives: as_built, ..WorldSettings::default() };
    let elbow = robot.joint_index("left_elbow").unwrap();
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&robot.stand[7..]);
    let run = |seed: u64| {
        let mut world = World::new(Arc::clone(&robot), &settings).unwrap();
        let offset = reading(&mut world, seed).joint_positions[elbow] - world.q()[7 + elbow];
        for _ in 0..150 {
            world.advance(&command, None).unwrap();
        }
        (offset, world.q()[7 + elbow] - robot.stand[7 + elbow])
    };
    let mut largest: f64 = 0.0;
    for seed in 0..8 {
        let (offset, moved) = run(seed);
        largest = largest.max(offset.abs());
        assert!((moved + offset).abs() < 0.015, "zero off by {offset}, moved by {moved}");
    }
    assert!(largest > 0.03, "{largest}");
}

/// PresToe and its camera, nothing else wrong.
fn seeing() -> Arc<Robot> {
    with(SenseSettings { camera: robot("prestoe").senses.camera.clone(), ..SenseSettings::default() })
}

/// All sights that come in `time` (s) of a ball at `place` (m), with the ticks at which they are first read.
fn sights(robot: &Arc<Robot>, q: &[f64], place: [f64; 3], time: f64, seed: u64) -> Vec<(f64, BallObservation)> {
    let mut world = world(robot, Fidelity::AsBuilt);
    world.reset(q, &vec![0.0; robot.nv()], &BallState::at_rest(place)).unwrap();
    let mut suite = SensorSuite::new(&mut world, seed);
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&q[7..]);
    let (mut sensors, mut seen): (Sensors, Vec<(f64, BallObservation)>) = (Sensors::default(), Vec::new());
    suite.sense(&world);
    while world.time() < time {
        suite.read_into(world.time(), &mut sensors);
        if let Some(ball) = sensors.ball
            && seen.last().is_none_or(|(_, last)| last.time < ball.time)
        {
            seen.push((world.time(), ball));
        }
        world.advance(&command, None).unwrap();
        suite.sense(&world);
    }
    seen
}

#[test]
fn sights_come_at_the_cameras_rate_and_late() {
    let robot = seeing();
    let seen = sights(&robot, &robot.stand, [1.0, 0.0, 0.11], 1.0, 1);
    assert!((28..=32).contains(&seen.len()), "{} sights in a second", seen.len());
    for pair in seen.windows(2) {
        let apart = pair[1].1.time - pair[0].1.time;
        assert!((apart - 1.0 / 30.0).abs() < 0.0025, "{apart}");
    }
    let late: Vec<f64> = seen.iter().skip(1).map(|(at, ball)| at - ball.time).collect();
    assert!(late.iter().all(|late| (0.029..0.063).contains(late)), "{late:?}");
    assert!(late.iter().any(|&late| late < 0.04) && late.iter().any(|&late| late > 0.05), "{late:?}");
    // At the start there is one already, from before.
    assert!(seen[0].0 == 0.0 && seen[0].1.time < -0.02, "{:?}", seen[0]);
}

#[test]
fn sights_err_with_the_distance_and_alike() {
    let robot = seeing();
    let error = robot.camera.unwrap().angle_error;
    let eye = 1.15;
    for distance in [0.6, 3.0] {
        let (mut ahead, mut aside, mut alike) = (0.0, 0.0, 0.0);
        let count = 150;
        for seed in 0..count {
            let seen = sights(&robot, &robot.stand, [distance, 0.0, 0.11], 0.06, seed);
            let [first, second] = [0, 1].map(|k| seen[k.min(seen.len() - 1)].1.position);
            ahead += (first[0] - distance).powi(2) / count as f64;
            aside += first[1].powi(2) / count as f64;
            alike += first[1] * second[1] / count as f64;
        }
        assert_deviation_within(aside.sqrt(), error * distance, 0.25);
        let height: f64 = eye - 0.11;
        assert_deviation_within(ahead.sqrt(), error * (distance * distance + height * height) / height, 0.3);
        assert!(alike > 0.7 * aside, "{alike} of {aside}");
    }
}

fn assert_deviation_within(found: f64, stated: f64, share: f64) {
    assert!((found / stated - 1.0).abs() < share, "{found} instead of {stated}");
}

#[test]
fn no_sight_out_of_the_field_of_view_or_behind_the_own_leg() {
    let robot = seeing();
    let counted = |q: &[f64], place: [f64; 3]| sights(&robot, q, place, 0.05, 1).len();
    assert!(counted(&robot.stand, [1.0, 0.0, 0.11]) > 0);
    assert_eq!(counted(&robot.stand, [-1.0, 0.0, 0.11]), 0, "behind");
    assert_eq!(counted(&robot.stand, [0.5, 1.5, 0.11]), 0, "aside");
    assert_eq!(counted(&robot.stand, [0.0, 0.0, 0.11]), 0, "below");

    // A leg lifted ahead, and the ball behind it as the camera has it.
    let leg = &robot.legs[1];
    let mut lifted = robot.stand.clone();
    lifted[7 + leg.hip_pitch] = -1.5;
    let mut data = robot.data();
    data.set_position(&lifted);
    let camera = robot.camera.unwrap();
    let (eye, foot) = (data.point(&camera.at), data.link_position(leg.foot));
    let ball: Vector3<f64> = eye + (foot - eye) * 1.6;
    assert!(counted(&robot.stand, ball.into()) > 0, "{ball}");
    assert_eq!(counted(&lifted, ball.into()), 0, "{ball}");
}

#[test]
fn the_ideal_world_has_perfect_senses() {
    for name in ["prestoe", "nao", "wolfgang"] {
        let robot = robot(name);
        let mut world = World::new(Arc::clone(&robot), &WorldSettings::default()).unwrap();
        let sensors = reading(&mut world, 5);
        assert_eq!(sensors.joint_positions, robot.stand[7..]);
        assert_eq!((sensors.gyro, sensors.orientation), ([0.0; 3], [1.0, 0.0, 0.0, 0.0]));
        assert!((sensors.ball.unwrap().position[0] - 1.0).abs() < 1e-9);
    }
}
