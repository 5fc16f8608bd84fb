//! Time of one call of each kinematic and dynamic quantity, for every shipped robot: `cargo bench -p instep-robot`.
//!
//! Each figure is the fastest of several rounds: wall time of one thread, ns a call, in the standing pose. The cost of
//! moving to a state stands in `set_position` and `set_state` only.

#![allow(clippy::print_stdout, reason = "a benchmark prints its figures")]
#![allow(clippy::unwrap_used, reason = "the shipped robots load; the tests see to it")]

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use instep_robot::Robot;
use nalgebra::Vector3;

/// Fastest of `ROUNDS` rounds of `CALLS` calls.
const ROUNDS: usize = 7;
const CALLS: usize = 3000;

fn time(what: &str, mut call: impl FnMut()) {
    let fastest = (0..ROUNDS)
        .map(|_| {
            let start = Instant::now();
            (0..CALLS).for_each(|_| call());
            start.elapsed().as_secs_f64() / CALLS as f64
        })
        .fold(f64::INFINITY, f64::min);
    println!("  {what:<28}{:>9.0} ns", 1e9 * fastest);
}

fn main() {
    for name in ["prestoe", "nao", "wolfgang"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots").join(name);
        let robot = Robot::load(&folder).unwrap();
        let nv = robot.nv();
        println!("{name}: {} joints, {} self-collision pairs", robot.joints.len(), robot.self_collision.len());
        let mut data = robot.data();
        let (q, v, a) = (robot.stand.clone(), vec![0.1; nv], vec![1.0; nv]);
        let mut jacobian = vec![0.0; 3 * nv];
        let mut momentum = vec![0.0; 6 * nv];
        let mut torques = vec![0.0; nv];
        let sole = robot.legs[0].sole;
        let forces: Vec<_> = robot.contacts.iter().map(|c| (c.at, Vector3::new(1.0, 0.0, 20.0))).collect();

        time("set_position", || data.set_position(black_box(&q)));
        time("set_state", || data.set_state(black_box(&q), black_box(&v)));
        let world = data.point(&sole);
        time("point_jacobian", || data.point_jacobian_into(sole.link, black_box(&world), &mut jacobian));
        time("com_jacobian", || data.com_jacobian_into(black_box(&mut jacobian)));
        time("momentum_matrix", || data.momentum_matrix_into(black_box(&mut momentum)));
        time("mass_matrix (allocates)", || drop(black_box(data.mass_matrix())));
        time("inverse_dynamics, no force", || data.inverse_dynamics_into(black_box(&a), &[], &mut torques));
        let label = format!("inverse_dynamics, {} forces", forces.len());
        time(&label, || data.inverse_dynamics_into(black_box(&a), &forces, &mut torques));
        time("capsule gaps, all pairs", || {
            for &pair in &robot.self_collision {
                black_box(data.capsule_gap(black_box(pair)));
            }
        });
    }
}
