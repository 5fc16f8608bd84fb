//! PresToe as loaded: size, weight, Table I of paper 1, and the symmetry of its sides.

use instep_robot::{LinkPoint, Robot, RobotData};
use mujoco_rs::prelude::*;
use nalgebra::Vector3;

use crate::support::{Numbers, load};

#[test]
fn size_weight_and_counts_are_the_papers() {
    let robot = load("prestoe");
    assert_eq!(robot.joints.len(), 25);
    assert!((robot.mass() - 29.5).abs() < 1e-9, "{} kg", robot.mass());
    assert_eq!(robot.contacts.len(), 10, "five contact points a foot");

    // Straight, as the paper gives the height: the head's capsule tops out about 1.3 m above the lowest contact point.
    let mut data = robot.data();
    let mut straight = robot.stand.clone();
    straight[7..].fill(0.0);
    data.set_position(&straight);
    let ground = robot.contacts.iter().map(|c| data.point(&c.at).z - c.radius).fold(f64::INFINITY, f64::min);
    let head = robot.model().name_to_id(MjtObjBase::mjOBJ_GEOM, "head").unwrap();
    let ([a, b], radius) = data.capsule(head);
    let height = a.z.max(b.z) + radius - ground;
    assert!((height - 1.3).abs() < 0.02, "{height} m");
}

#[test]
fn limits_are_table_one() {
    let robot = load("prestoe");
    // Paper 1, Table I: largest torque (N m) and speed (rad/s).
    let table = |name: &str| {
        let part = name.trim_start_matches("left_").trim_start_matches("right_");
        match part.split('_').next() {
            Some("hip") => [48.0, 20.0],
            Some("knee") => [200.0, 10.0],
            Some("ankle") => [100.0, 10.0],
            Some("toe") => [10.0, 20.0],
            Some("shoulder" | "elbow" | "wrist" | "torso") => [18.0, 40.0],
            other => panic!("{other:?} is not in Table I"),
        }
    };
    for joint in &robot.joints {
        assert_eq!([joint.torque, joint.speed], table(&joint.name), "{}", joint.name);
    }
}

/// Sets the robot to `q` mirrored in its sagittal plane: sides exchanged, roll and yaw reversed.
fn mirrored(robot: &Robot, q: &[f64]) -> Vec<f64> {
    let mut m = q.to_vec();
    // Reflection y -> -y of the base: position, and a rotation (w, x, y, z) -> (w, -x, y, -z).
    m[1] = -m[1];
    m[4] = -m[4];
    m[6] = -m[6];
    for (i, joint) in robot.joints.iter().enumerate() {
        let other = match joint.name.split_once('_') {
            Some(("left", rest)) => format!("right_{rest}"),
            Some(("right", rest)) => format!("left_{rest}"),
            _ => joint.name.clone(),
        };
        // Rotation about y is its own mirror image; about x and z it is reversed.
        let sagittal = ["pitch", "knee", "elbow", "toe"].iter().any(|part| joint.name.ends_with(part));
        let sign = if sagittal { 1.0 } else { -1.0 };
        m[7 + robot.joint_index(&other).unwrap()] = sign * q[7 + i];
    }
    m
}

#[test]
fn sides_are_mirror_images() {
    let robot = load("prestoe");
    let reflect = |p: Vector3<f64>| Vector3::new(p.x, -p.y, p.z);
    let mut numbers = Numbers(5);
    let (mut data, mut mirror) = (robot.data(), robot.data());
    for _ in 0..10 {
        let q = numbers.position(&robot);
        let m = mirrored(&robot, &q);
        data.set_state(&q, &vec![0.0; robot.nv()]);
        mirror.set_state(&m, &vec![0.0; robot.nv()]);
        assert!((reflect(data.com()) - mirror.com()).norm() < 1e-12, "mass is symmetric");
        assert!((data.mass_matrix().trace() - mirror.mass_matrix().trace()).abs() < 1e-9, "inertia is symmetric");
        let at = |data: &RobotData, point: &LinkPoint| data.point(point);
        for (i, contact) in robot.contacts.iter().enumerate() {
            let other =
                contact.name.replacen("left", "RIGHT", 1).replacen("right", "left", 1).replacen("RIGHT", "right", 1);
            let j = robot.contacts.iter().position(|c| c.name == other).unwrap();
            let gap = reflect(at(&data, &contact.at)) - at(&mirror, &robot.contacts[j].at);
            assert!(gap.norm() < 1e-12, "{} and {}", robot.contacts[i].name, other);
        }
        for (name, point) in &robot.landmarks {
            let other = match name.split_once('_') {
                Some(("left", rest)) => format!("right_{rest}"),
                Some(("right", rest)) => format!("left_{rest}"),
                _ => name.clone(),
            };
            let gap = reflect(at(&data, point)) - at(&mirror, robot.landmark(&other).unwrap());
            assert!(gap.norm() < 1e-12, "{name}");
        }
        let gaps = |data: &RobotData| {
            let mut gaps: Vec<f64> = robot.self_collision.iter().map(|&pair| data.capsule_gap(pair).1).collect();
            gaps.sort_by(f64::total_cmp);
            gaps
        };
        for (a, b) in gaps(&data).iter().zip(gaps(&mirror)) {
            assert!((a - b).abs() < 1e-9, "capsules are symmetric: {a} and {b}");
        }
    }
    for joint in robot.joints.iter().filter(|joint| joint.name.starts_with("left_")) {
        let other = &robot.joints[robot.joint_index(&joint.name.replacen("left", "right", 1)).unwrap()];
        let [least, greatest] = other.range;
        assert!(joint.range == [least, greatest] || joint.range == [-greatest, -least], "{}", joint.name);
        assert_eq!((joint.torque, joint.speed, joint.kp, joint.kd), (other.torque, other.speed, other.kp, other.kd));
    }
}
