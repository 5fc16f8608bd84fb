//! A kick within a step, on the robot's senses: the gait goes on, the ball leaves as asked.

use std::sync::Arc;

use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_sim::BallState;
use instep_sim::sensors::SensorSuite;
use instep_sim::trial::has_fallen;
use instep_walk::WalkSettings;
use instep_walk::in_gait::{Aim, InGait, InGaitSettings, Stage};

use crate::rig::{robot, world};

/// Ball's speed (m/s) and direction (rad) 30 ms after it began to move, and whether the robot stands at the end.
fn kick(ball: [f64; 2], direction: f64, speed: f64) -> ([f64; 2], bool) {
    let robot = robot("artemis");
    let text = std::fs::read_to_string(robot.folder().join("in-gait.toml")).unwrap();
    let settings = InGaitSettings::parse("in-gait.toml", &text).unwrap();
    let mut world = world(&robot);
    world.reset(&robot.stand, &vec![0.0; robot.nv()], &BallState::at_rest([ball[0], ball[1], 0.11])).unwrap();
    let mut kick = InGait::new(Arc::clone(&robot), WalkSettings::load(&robot).unwrap(), settings, 0.11).unwrap();
    let mut suite = SensorSuite::new(&mut world, 5);
    suite.sense(&world);
    let (mut sensors, mut command) = (Sensors::default(), JointCommand::zeros(robot.joints.len()));
    kick.ask(Aim { ball, direction, speed, foot: None });
    let (mut moving, mut left) = (None, [0.0; 2]);
    for _ in 0..8000 {
        suite.read_into(world.time(), &mut sensors);
        kick.tick(&sensors, &mut command);
        world.advance(&command, None).unwrap();
        suite.sense(&world);
        let [x, y, _] = world.ball().velocity;
        if x.hypot(y) > 0.1 && *moving.get_or_insert(world.time()) + 0.03 > world.time() {
            left = [x.hypot(y), y.atan2(x)];
        }
        if kick.stage() == Stage::Done || has_fallen(&world) {
            break;
        }
    }
    (left, kick.stage() == Stage::Done && !has_fallen(&world))
}

#[test]
fn artemis_kicks_as_asked_and_walks_on() {
    for (ball, direction, asked) in [([1.5, 0.1], 5.0_f64, 5.0), ([1.45, -0.12], -3.0, 3.0)] {
        let ([speed, toward], stands) = kick(ball, direction.to_radians(), asked);
        println!("{asked} m/s asked: {speed:.2} m/s, {:.2} degrees", toward.to_degrees());
        assert!(stands, "{asked} m/s");
        assert!((speed - asked).abs() < 0.15 * asked, "{speed} m/s, {asked} asked");
        assert!((toward.to_degrees() - direction).abs() < 4.0, "{} degrees", toward.to_degrees());
    }
}
