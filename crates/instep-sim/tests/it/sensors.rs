//! What a controller sees: true without noise, late by the stated delay, scattered by the stated deviation.

use instep_robot::control::{JointCommand, Sensors};
use instep_sim::sensors::SensorSuite;
use instep_sim::settings::{SensorNoise, WorldSettings};
use instep_sim::{BallState, World};

use crate::robot;

/// A standing world, its command and its sensors.
fn standing(noise: SensorNoise, seed: u64) -> (World, JointCommand, SensorSuite) {
    let settings = WorldSettings { sensors: noise, ..WorldSettings::default() };
    let mut world = World::new(robot("prestoe"), &settings).unwrap();
    let mut command = JointCommand::zeros(world.robot().joints.len());
    command.positions.copy_from_slice(&world.robot().stand[7..]);
    let suite = SensorSuite::new(&mut world, seed);
    (world, command, suite)
}

#[test]
fn at_rest_the_sensors_tell_the_weight_and_the_pose() {
    let (mut world, command, mut suite) = standing(SensorNoise::default(), 1);
    suite.sense(&world);
    for _ in 0..1000 {
        world.advance(&command, None).unwrap();
        suite.sense(&world);
    }
    let mut sensors = Sensors::default();
    suite.read_into(world.time(), &mut sensors);
    let weight: f64 = sensors.contact_forces.iter().sum();
    assert!((weight / (9.81 * world.robot().mass()) - 1.0).abs() < 0.02, "{weight} N");
    let pull = nalgebra::Vector3::from(sensors.accelerometer).norm();
    assert!((pull - 9.81).abs() < 0.1, "{pull} m/s^2");
    assert!(nalgebra::Vector3::from(sensors.gyro).norm() < 0.02);
    for foot in sensors.centre_of_pressure {
        let [x, y] = foot.expect("both feet carry weight");
        assert!(x.abs() < 0.1 && y.abs() < 0.04, "{x} {y}");
    }
    // The ball was put 1 m ahead.
    let ball = sensors.ball.unwrap();
    assert!((ball.position[0] - 1.0).abs() < 0.02 && ball.position[1].abs() < 0.01, "{ball:?}");
}

#[test]
fn readings_are_late_by_the_stated_delay() {
    let noise = SensorNoise { delay: 0.010, ball_delay: 0.020, ..SensorNoise::default() };
    let (mut world, command, mut suite) = standing(noise, 1);
    let (q, v) = (world.robot().stand.clone(), vec![0.0; world.robot().nv()]);
    let ball = BallState { velocity: [1.0, 0.0, 0.0], ..BallState::at_rest([2.0, 0.0, 1.0]) };
    world.reset(&q, &v, &ball).unwrap();
    suite.sense(&world);
    let (mut joints, mut balls) = (vec![world.q()[7..].to_vec()], vec![world.ball().position[0]]);
    let mut sensors = Sensors::default();
    for step in 1..=60 {
        world.advance(&command, None).unwrap();
        suite.sense(&world);
        joints.push(world.q()[7..].to_vec());
        balls.push(world.ball().position[0]);
        suite.read_into(world.time(), &mut sensors);
        if step >= 15 {
            assert_eq!(sensors.joint_positions, joints[step - 5]);
            let seen = sensors.ball.unwrap();
            // The base hardly moves, so the seen x is the ball's of 15 steps ago, 30 mm from where it is now.
            assert!((seen.position[0] - balls[step - 15]).abs() < 6e-3, "step {step}: {seen:?}");
        }
    }
}

#[test]
fn noise_has_the_stated_deviation_and_follows_its_seed() {
    let noise = SensorNoise { gyro: 0.05, joint_position: 0.01, ..SensorNoise::default() };
    let draw = |seed: u64| {
        let (world, _, mut suite) = standing(noise, seed);
        let mut sensors = Sensors::default();
        let mut drawn = Vec::new();
        for _ in 0..2000 {
            suite.sense(&world);
            suite.read_into(0.0, &mut sensors);
            drawn.push((sensors.gyro[0], sensors.joint_positions[3] - world.q()[10]));
        }
        drawn
    };
    let drawn = draw(7);
    let deviation = |values: Vec<f64>| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    let gyro = deviation(drawn.iter().map(|(gyro, _)| *gyro).collect());
    let joint = deviation(drawn.iter().map(|(_, joint)| *joint).collect());
    assert!((gyro / 0.05 - 1.0).abs() < 0.1, "{gyro}");
    assert!((joint / 0.01 - 1.0).abs() < 0.1, "{joint}");
    assert_eq!(drawn, draw(7));
    assert_ne!(drawn, draw(8));
}

/// Root mean square of `error` over 3000 readings of a standing robot.
fn scatter(noise: SensorNoise, error: impl Fn(&World, &Sensors) -> f64) -> f64 {
    let (world, _, mut suite) = standing(noise, 5);
    let mut sensors = Sensors::default();
    let mut squares = 0.0;
    for _ in 0..3000 {
        suite.sense(&world);
        suite.read_into(0.0, &mut sensors);
        squares += error(&world, &sensors).powi(2) / 3000.0;
    }
    squares.sqrt()
}

#[test]
fn sights_of_the_ball_scatter_as_stated_on_both_axes() {
    for axis in [0, 1] {
        let true_place = [1.0, 0.0][axis];
        let off =
            |world: &World, sensors: &Sensors| sensors.ball.unwrap().position[axis] - true_place + world.q()[axis];
        let measured = scatter(SensorNoise { ball: 0.02, ..SensorNoise::default() }, off);
        assert!((measured / 0.02 - 1.0).abs() < 0.1, "axis {axis}: {measured} m");
        assert!(scatter(SensorNoise::default(), off) < 1e-3);
    }
}

#[test]
fn the_orientation_estimate_scatters_as_stated_about_each_axis() {
    for axis in [1, 2, 3] {
        // Twice the vector part of a small rotation's quaternion is its angle about that axis.
        let off = |world: &World, sensors: &Sensors| 2.0 * (sensors.orientation[axis] - world.q()[3 + axis]);
        let measured = scatter(SensorNoise { orientation: 0.02, ..SensorNoise::default() }, off);
        assert!((measured / 0.02 - 1.0).abs() < 0.1, "axis {axis}: {measured} rad");
        assert!(scatter(SensorNoise::default(), off) < 1e-12);
    }
}
