//! Speed of the world beside a bare `mj_step` loop on the same model: `cargo bench -p instep-sim --bench stepping`.
//!
//! Both hold PresToe in its standing pose with the ball far away, with the same torques: the world by its drives, the
//! bare loop by replaying those torques as they were. The rounds alternate, so that a busy machine slows both alike.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark prints, and stops at the first surprise")]

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use instep_robot::Robot;
use instep_robot::control::JointCommand;
use instep_sim::settings::WorldSettings;
use instep_sim::{BallState, World};

const TICKS: usize = 1000;
const ROUNDS: usize = 9;

fn main() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/prestoe");
    let robot = Arc::new(Robot::load(&folder).unwrap());
    let mut world = World::new(Arc::clone(&robot), &WorldSettings::default()).unwrap();
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&robot.stand[7..]);
    let still = vec![0.0; robot.nv()];
    let far_ball = BallState::at_rest([5.0, 0.0, 0.11]);

    let mut torques = Vec::with_capacity(TICKS);
    world.reset(&robot.stand, &still, &far_ball).unwrap();
    for _ in 0..TICKS {
        world.advance(&command, None).unwrap();
        torques.push(world.torques().to_vec());
    }
    let step = world.settings().step;
    let per_tick = step.far_per_tick();
    let steps = (TICKS * per_tick) as f64;
    let (mut ours, mut bare) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        world.reset(&robot.stand, &still, &far_ball).unwrap();
        let start = Instant::now();
        for _ in 0..TICKS {
            world.advance(&command, None).unwrap();
        }
        ours.push(start.elapsed().as_secs_f64() / steps);

        world.reset(&robot.stand, &still, &far_ball).unwrap();
        let data = world.mujoco();
        data.model_opt_mut().timestep = step.far;
        let start = Instant::now();
        for torques in &torques {
            data.qfrc_applied_mut()[6..6 + torques.len()].copy_from_slice(torques);
            for _ in 0..per_tick {
                data.step();
            }
        }
        bare.push(start.elapsed().as_secs_f64() / steps);
    }
    let median = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let (ours, bare) = (median(&mut ours), median(&mut bare));
    println!("PresToe standing, ball far, {} ms steps, median of {ROUNDS} rounds of {steps}", 1e3 * step.far);
    println!("  bare mj_step     {:7.2} us/step  {:8.0} steps/s", 1e6 * bare, 1.0 / bare);
    println!("  world.advance    {:7.2} us/step  {:8.0} steps/s", 1e6 * ours, 1.0 / ours);
    println!("  ratio            {:7.3}           limit 1.15", ours / bare);
}
