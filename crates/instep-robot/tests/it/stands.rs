//! Each shipped robot stands on its own drives: its gains, limits and standing pose fit together.
//!
//! A small world of the test's own (floor, contact spheres, drives at 2 ms); the real one is instep-sim.

use instep_robot::Robot;
use instep_robot::control::drive_torque;
use mujoco_rs::prelude::*;
use nalgebra::{UnitQuaternion, Vector3};

use crate::support::{ROBOTS, load};

fn world(robot: &Robot) -> MjModel {
    let mut spec = robot.spec().unwrap();
    for geom in spec.geom_iter_mut() {
        let sphere = robot.contacts.iter().any(|contact| contact.name == geom.name());
        geom.set_contype(0);
        geom.set_conaffinity(i32::from(sphere));
    }
    spec.world_body_mut()
        .add_geom()
        .with_type(MjtGeomBase::mjGEOM_PLANE)
        .with_size([0.0, 0.0, 1.0])
        .with_contype(1)
        .with_conaffinity(0);
    spec.option_mut().timestep = 0.002;
    spec.compile().unwrap()
}

#[test]
fn robots_stand_for_five_seconds() {
    for name in ROBOTS {
        let robot = load(name);
        let mut world = MjData::new(Box::new(world(&robot)));
        world.qpos_mut().copy_from_slice(&robot.stand);
        let mut peak = 0.0f64;
        for _ in 0..2500 {
            let torques: Vec<f64> = robot
                .joints
                .iter()
                .enumerate()
                .map(|(j, joint)| {
                    let target = robot.stand[7 + j];
                    drive_torque(joint, target, 0.0, 0.0, world.qpos()[7 + j], world.qvel()[6 + j])
                })
                .collect();
            for (torque, joint) in torques.iter().zip(&robot.joints) {
                peak = peak.max(torque.abs() / joint.torque);
            }
            world.qfrc_applied_mut()[6..].copy_from_slice(&torques);
            world.step();
        }
        let q = world.qpos();
        let turn = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(q[3], q[4], q[5], q[6]));
        let tilt = (turn * Vector3::z()).angle(&Vector3::z());
        let speed = world.qvel().iter().fold(0.0f64, |m, v| m.max(v.abs()));
        println!(
            "{name}: sank {:.1} mm, tilt {:.2} deg, speed {speed:.1e}, peak share of the torque limit {peak:.2}",
            1e3 * (robot.stand[2] - q[2]),
            tilt.to_degrees()
        );
        assert!((robot.stand[2] - q[2]).abs() < 0.03 * robot.stand[2], "{name} sank or rose: {} m", q[2]);
        assert!(tilt < 0.08, "{name} leans {tilt} rad");
        assert!(speed < 1e-2, "{name} still moves at {speed}");
        assert!(peak < 1.0, "{name} saturates a drive while standing");
    }
}
