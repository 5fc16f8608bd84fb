//! Cancels kicks at random instants and counts how often the robot stands on both feet afterwards; with the number that
//! the acceptance asks for, 1,000 a robot, this takes minutes: `cancels [count] [robot,..]`.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::path::Path;
use std::sync::Arc;

use instep_bench::{Scenario, Subject};
use instep_kick::KickStatus;
use instep_robot::control::{JointCommand, Sensors};
use instep_sim::sensors::SensorSuite;
use instep_sim::{BallState, World};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let count: u64 = args.get(1).and_then(|a| a.parse().ok()).unwrap_or(1000);
    let robots = args.get(2).map_or("nao,wolfgang", String::as_str);
    let scenario = Scenario::load(Path::new("scenarios/random-place.toml")).unwrap();
    for name in robots.split(',') {
        let subject = Subject::load(Path::new("robots"), name).unwrap();
        let results: Vec<Option<(f64, bool)>> = (0..count)
            .into_par_iter()
            .map_init(
                || World::new(Arc::clone(&subject.robot), &subject.world()).unwrap(),
                |world, i| one(&subject, &scenario, world, i),
            )
            .collect();
        let tried: Vec<_> = results.into_iter().flatten().collect();
        let stood = tried.iter().filter(|(_, stands)| *stands).count();
        println!("{name}: {} cancels, {stood} stand on both feet afterwards", tried.len());
        for (share, _) in tried.iter().filter(|(_, stands)| !stands) {
            println!("  not after a cancel at {share:.3} of the kick");
        }
    }
}

/// One kick that can be planned, cancelled at a random instant.
fn one(subject: &Subject, scenario: &Scenario, world: &mut World, seed: u64) -> Option<(f64, bool)> {
    let robot = &subject.robot;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let share: f64 = rng.random();
    let mut engine = subject.engine("dynamic").unwrap();
    // The first of the seed's requests that can be planned.
    let mut sensors = Sensors::default();
    for case in scenario.cases(&subject.size, seed, 20) {
        let ball = [case.ball[0] + subject.footprint[0], case.ball[1] + subject.footprint[1], subject.size.ball];
        world.reset(&robot.stand, &vec![0.0; robot.nv()], &BallState::at_rest(ball)).unwrap();
        let mut suite = SensorSuite::new(world, seed);
        suite.sense(world);
        suite.read_into(0.0, &mut sensors);
        let Ok(plan) = engine.plan(&case.request, &sensors) else { continue };
        let mut command = JointCommand::zeros(robot.joints.len());
        let far = (engine.control_period() / world.settings().step.tick).round() as usize;
        let mut cancelled = false;
        let mut end = 2.0 * plan.duration + 1.0;
        while world.time() < end {
            if !cancelled && world.time() >= share * plan.duration {
                engine.cancel();
                cancelled = true;
            }
            suite.read_into(world.time(), &mut sensors);
            engine.tick(&sensors, &mut command);
            if engine.progress().status == KickStatus::Cancelled && end > world.time() + 0.8 {
                end = world.time() + 0.8;
            }
            for _ in 0..far {
                world.advance(&command, None).unwrap();
                suite.sense(world);
            }
        }
        // A cancel that comes when the motion is over finds it finished.
        let over = matches!(engine.progress().status, KickStatus::Cancelled | KickStatus::Finished);
        return Some((share, over && stands(world)));
    }
    None
}

/// Both feet carry weight and the robot is near its standing pose.
fn stands(world: &World) -> bool {
    let robot = world.robot();
    let mut forces = vec![nalgebra::Vector3::zeros(); robot.contacts.len()];
    world.contact_forces_into(&mut forces);
    let mut loads = [0.0; 2];
    for (contact, force) in robot.contacts.iter().zip(&forces) {
        loads[contact.leg as usize] += force.z;
    }
    let near = world.q()[7..].iter().zip(&robot.stand[7..]).all(|(a, b)| (a - b).abs() < 0.15);
    near && world.q()[2] > 0.95 * robot.stand[2] && loads.iter().all(|load| *load > 0.2 * 9.81 * robot.mass())
}
