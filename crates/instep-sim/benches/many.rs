//! What each further robot costs: `cargo bench -p instep-sim --bench many`, or with a robot's name after `--`.
//!
//! Robots stand on the field a metre apart with the ball far away, as built, each holding its stand; one tick of the world is
//! compared with the same steps of a bare `mj_step` loop under the same torques. The least of several rounds counts, since
//! whatever else the machine does can only add; the rounds alternate.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark prints, and stops at the first surprise")]

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use instep_field::{Field, Pose, Side};
use instep_robot::Robot;
use instep_robot::control::JointCommand;
use instep_sim::settings::{Fidelity, WorldSettings};
use instep_sim::{BallState, Entrant, World};

const TICKS: usize = 300;
const ROUNDS: usize = 15;
const COUNTS: [usize; 5] = [1, 2, 4, 8, 14];

fn world(robot: &Arc<Robot>, count: usize) -> World {
    let entrants: Vec<Entrant> = (0..count)
        .map(|i| Entrant {
            robot: Arc::clone(robot),
            team: if i % 2 == 0 { Side::Home } else { Side::Away },
            pose: Pose::new(-6.0 + (i % 7) as f64, if i < 7 { 1.0 } else { -1.0 }, 0.3 * i as f64),
        })
        .collect();
    let settings = WorldSettings { drives: Fidelity::AsBuilt, senses: Fidelity::AsBuilt, ..WorldSettings::default() };
    World::on_field(Arc::new(Field::named("adult-2024").unwrap()), &entrants, &settings).unwrap()
}

fn main() {
    let name = std::env::args().skip(1).find(|arg| !arg.starts_with('-')).unwrap_or("artemis".into());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots").join(&name);
    let robot = Arc::new(Robot::load(&folder).unwrap());
    let far_ball = BallState::at_rest([6.0, 4.0, 0.11]);
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&robot.stand[7..]);
    let mut worlds: Vec<World> = COUNTS.iter().map(|&count| world(&robot, count)).collect();
    let (mut ours, mut bare) = ([f64::INFINITY; COUNTS.len()], [f64::INFINITY; COUNTS.len()]);
    let step = worlds[0].settings().step;
    let steps = (TICKS * step.far_per_tick()) as f64;
    for _ in 0..ROUNDS {
        for (k, world) in worlds.iter_mut().enumerate() {
            let commands = vec![command.clone(); COUNTS[k]];
            world.start_again(&far_ball).unwrap();
            let start = Instant::now();
            for _ in 0..TICKS {
                world.advance_all(&commands, None).unwrap();
            }
            ours[k] = f64::min(ours[k], start.elapsed().as_secs_f64() / steps);
            // Once more without us: the last torques hold the same stand.
            let torques: Vec<f64> = world.robots().flat_map(|view| [&[0.0; 6], view.torques()].concat()).collect();
            world.start_again(&far_ball).unwrap();
            let data = world.mujoco();
            data.model_opt_mut().timestep = step.far;
            data.qfrc_applied_mut()[..torques.len()].copy_from_slice(&torques);
            let start = Instant::now();
            for _ in 0..TICKS * step.far_per_tick() {
                data.step();
            }
            bare[k] = f64::min(bare[k], start.elapsed().as_secs_f64() / steps);
        }
    }
    println!("{name} standing, ball far, {} ms steps, least of {ROUNDS} rounds of {steps}", 1e3 * step.far);
    println!("  robots   us/step   of one   us/robot   bare mj_step   share of bare");
    for (k, count) in COUNTS.iter().enumerate() {
        println!(
            "  {count:6}  {:8.1}  {:7.2}  {:9.1}  {:13.1}  {:14.2}",
            1e6 * ours[k],
            ours[k] / ours[0],
            1e6 * ours[k] / *count as f64,
            1e6 * bare[k],
            bare[k] / ours[k]
        );
    }
    println!("  limits: four robots at most 4.4 times one; share of bare at least 0.80 with one");
}
