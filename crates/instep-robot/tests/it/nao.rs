//! NAO as loaded: lengths and weight of the published tables, and the one motor that turns two hip joints.

use mujoco_rs::prelude::*;
use nalgebra::Vector3;

use crate::support::load;

#[test]
fn lengths_and_weight_are_the_published_ones() {
    let robot = load("nao");
    assert_eq!(robot.joints.len(), 24);
    assert!((robot.mass() - 5.3594).abs() < 1e-3, "{} kg", robot.mass());
    let mut data = robot.data();
    let mut zero = robot.stand.clone();
    zero[..7].copy_from_slice(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    zero[7..].fill(0.0);
    data.set_position(&zero);
    // Legs straight: hip at y 50, z -85; thigh 100, tibia 102.9, foot 45.11 mm.
    for (leg, side) in robot.legs.iter().zip([1.0, -1.0]) {
        assert!((data.link_position(leg.thigh) - Vector3::new(0.0, side * 0.05, -0.085)).norm() < 1e-12);
        assert!((data.link_position(leg.shank) - Vector3::new(0.0, side * 0.05, -0.185)).norm() < 1e-12);
        assert!((data.link_position(leg.foot) - Vector3::new(0.0, side * 0.05, -0.2879)).norm() < 1e-12);
        assert!((data.point(&leg.sole).z + 0.2879 + 0.04511).abs() < 1e-12);
    }
    // Arms forward: shoulder at y 98, z 100; upper arm 105 with the elbow 15 mm out; forearm 55.95 mm.
    let wrist = data.link_position(robot.link_index("l_wrist").unwrap());
    assert!((wrist - Vector3::new(0.105 + 0.05595, 0.098 + 0.015, 0.1)).norm() < 1e-12);
}

#[test]
fn hip_yaw_pitch_moves_both_legs_as_mirror_images() {
    let robot = load("nao");
    let mut data = robot.data();
    let mut q = robot.stand.clone();
    for name in ["LHipYawPitch", "RHipYawPitch"] {
        q[7 + robot.joint_index(name).unwrap()] = -0.5;
    }
    q[4..7].fill(0.0);
    q[3] = 1.0;
    data.set_position(&q);
    let [left, right] = [0, 1].map(|side| data.point(&robot.legs[side].sole));
    assert!((left - Vector3::new(right.x, -right.y, right.z)).norm() < 1e-12);
    // Negative angles turn the feet outward, as on the real robot.
    let forward = data.link_matrix(robot.legs[0].foot).column(0).into_owned();
    assert!(forward.y > 0.1, "left foot points to {forward:?}");
}

#[test]
fn two_hip_joints_share_one_motor() {
    let robot = load("nao");
    let [left, right] = ["LHipYawPitch", "RHipYawPitch"].map(|name| robot.joint_index(name).unwrap());
    // Together never more than the motor's 3.348 N m.
    assert!((robot.joints[left].torque + robot.joints[right].torque - 3.348).abs() < 1e-9);
    // A torque on one of them turns both.
    let mut data = MjData::new(robot.model().clone());
    data.qpos_mut().copy_from_slice(&robot.stand);
    for _ in 0..100 {
        data.qfrc_applied_mut()[6 + left] = 1.0;
        data.step();
    }
    let (a, b) = (data.qpos()[7 + left], data.qpos()[7 + right]);
    assert!(a > 0.05 && (a - b).abs() < 0.01 * a, "{a} and {b}");
}
