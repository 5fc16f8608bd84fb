//! Speed of the world beside a bare `mj_step` loop on the same model: `cargo bench -p instep-sim --bench stepping`.
//!
//! Both hold a robot in its standing pose with the ball far away, with the same torques: the world by its drives, as built and
//! ideal, the bare loop by replaying those torques as they were. The rounds alternate, so that a busy machine slows both alike.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark prints, and stops at the first surprise")]

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use instep_robot::Robot;
use instep_robot::control::JointCommand;
use instep_sim::settings::WorldSettings;
use instep_sim::{BallState, World};

/// Simulated time of a round, s.
const ROUND: f64 = 1.0;
const ROUNDS: usize = 9;

fn main() {
    println!(
        "standing, ball far, median of {ROUNDS} rounds of {ROUND} s; the world's share of bare mj_step is to be 80 % at least"
    );
    for name in ["prestoe", "nao"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots").join(name);
        let robot = Arc::new(Robot::load(&folder).unwrap());
        let as_built = WorldSettings::default().as_built(&robot);
        measure(&robot, &as_built, "as built");
        measure(&robot, &as_built.ideal(), "ideal");
    }
}

fn measure(robot: &Arc<Robot>, settings: &WorldSettings, drives: &str) {
    let mut world = World::new(Arc::clone(robot), settings).unwrap();
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&robot.stand[7..]);
    let still = vec![0.0; robot.nv()];
    let far_ball = BallState::at_rest([5.0, 0.0, 0.11]);
    let step = settings.step;
    let ticks = (ROUND / step.tick).round() as usize;

    let mut torques = Vec::with_capacity(ticks);
    world.reset(&robot.stand, &still, &far_ball).unwrap();
    for _ in 0..ticks {
        world.advance(&command, None).unwrap();
        torques.push(world.torques().to_vec());
    }
    let per_tick = step.far_per_tick();
    let steps = (ticks * per_tick) as f64;
    let (mut ours, mut bare) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        world.reset(&robot.stand, &still, &far_ball).unwrap();
        let start = Instant::now();
        for _ in 0..ticks {
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
    let (name, far) = (&robot.name, 1e3 * step.far);
    println!(
        "  {name:<10} drives {drives:<9} {far} ms steps: bare {:6.2} us/step, world {:6.2} us/step, share {:.1} %",
        1e6 * bare,
        1e6 * ours,
        100.0 * bare / ours
    );
}
