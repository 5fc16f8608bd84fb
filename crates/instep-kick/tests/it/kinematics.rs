//! The tree against MuJoCo's own kinematics, and inverse kinematics against random reachable poses.

use instep_motion::phase::Side;
use instep_robot::ik::{Goals, Ik};
use instep_robot::tree::Tree;
use nalgebra::{Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::rig::robot;

#[test]
fn the_tree_agrees_with_mujoco() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for name in ["nao", "wolfgang", "prestoe", "t1", "k1"] {
        let robot = robot(name);
        let tree = Tree::new(&robot);
        let (mut pose, mut data) = (tree.pose(), robot.data());
        for _ in 0..20 {
            let mut q = robot.stand.clone();
            q[..7].copy_from_slice(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
            for (angle, joint) in q[7..].iter_mut().zip(&robot.joints) {
                *angle = joint.range[0] + rng.random::<f64>() * (joint.range[1] - joint.range[0]);
            }
            data.set_position(&q);
            tree.update(&q[7..], &mut pose);
            assert!((tree.com(&pose) - data.com()).norm() < 1e-12, "{name} centre of mass");
            let nv = robot.nv();
            let mut com = vec![0.0; 3 * nv];
            data.com_jacobian_into(&mut com);
            for leg in &robot.legs {
                let point = data.point(&leg.sole);
                assert!((pose.point(&leg.sole) - point).norm() < 1e-12, "{name} sole");
                let mut jacobian = vec![0.0; 3 * nv];
                data.point_jacobian_into(leg.foot, &point, &mut jacobian);
                for joint in leg.joints() {
                    let column = |m: &[f64]| Vector3::new(m[6 + joint], m[nv + 6 + joint], m[2 * nv + 6 + joint]);
                    let ours = tree.point_column(&pose, joint, leg.foot, &point);
                    assert!((ours - column(&jacobian)).norm() < 1e-12, "{name} Jacobian");
                    assert!((tree.com_column(&pose, joint) - column(&com)).norm() < 1e-12, "{name} balance");
                }
            }
            for (i, pair) in robot.self_collision.iter().enumerate() {
                let (gap, which) = tree.least_gap(&pose);
                assert!(gap <= data.capsule_gap(*pair).1 + 1e-12);
                assert!(which != i || (gap - data.capsule_gap(*pair).1).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn it_finds_poses_that_exist_and_keeps_limits_for_those_that_do_not() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for name in ["wolfgang", "prestoe", "t1", "k1"] {
        let robot = robot(name);
        let tree = Tree::new(&robot);
        let mut ik = Ik::new(&robot, &[], 0.0, 0.0).unwrap();
        let mut pose = tree.pose();
        for round in 0..100 {
            let mut wanted = robot.stand[7..].to_vec();
            for joint in ik.joints().collect::<Vec<_>>() {
                let [low, high] = robot.joints[joint].range;
                wanted[joint] = (wanted[joint] + rng.random_range(-0.2..0.2)).clamp(low, high);
            }
            tree.update(&wanted, &mut pose);
            let (s, f) = (robot.leg(Side::Left).sole, robot.leg(Side::Right).sole);
            let turn = pose.rotation[s.link].transpose();
            let foot = Rotation3::from_matrix_unchecked(turn * pose.rotation[f.link]);
            let (_, pitch, yaw) = foot.euler_angles();
            let base = Rotation3::from_matrix_unchecked(turn).euler_angles();
            let com = turn * (tree.com(&pose) - pose.point(&s));
            let mut goals = Goals {
                position: turn * (pose.point(&f) - pose.point(&s)),
                yaw_pitch: [yaw, pitch],
                balance: [com.x, com.y],
                height: (turn * -pose.point(&s)).z,
                base: [base.0, base.1, base.2],
            };
            // Every other pose is out of reach: limits must hold all the same.
            if round % 2 == 1 {
                goals.position.z += 1.0;
            }
            let mut angles = robot.stand[7..].to_vec();
            let residual = ik.solve(&tree, &mut pose, &mut angles, Side::Right, &goals, 60);
            for (angle, joint) in angles.iter().zip(&robot.joints) {
                assert!((joint.range[0] - 1e-9..=joint.range[1] + 1e-9).contains(angle), "{name} {}", joint.name);
            }
            if round % 2 == 0 {
                // Roll is not a goal, so only what is one is compared.
                assert!(residual.position < 5e-3 && residual.balance < 5e-3, "{name} {round}: {residual:?}");
            }
        }
    }
}
