//! Wolfgang-OP's leg and arm against the chain of its URDF: our model turns the URDF's rotated link frames, which must
//! move no point of the robot. The table below is the URDF's left side (origin, roll-pitch-yaw, axis).

use instep_robot::LinkPoint;
use nalgebra::{Isometry3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::support::{Numbers, load};

type Row = (&'static str, [f64; 3], [f64; 3], [f64; 3]);

const Q: f64 = std::f64::consts::FRAC_PI_2;
const H: f64 = std::f64::consts::PI;

const LEG: [Row; 6] = [
    ("LHipYaw", [0.0, 0.055, 0.0], [-Q, 0.0, 0.0], [0.0, 1.0, 0.0]),
    ("LHipRoll", [-0.046, 0.0414, 0.0], [H, Q, 0.0], [0.0, 0.0, -1.0]),
    ("LHipPitch", [0.026, 0.0, -0.0691], [0.0, -Q, 0.0], [0.0, 0.0, -1.0]),
    ("LKnee", [0.00435596, -0.168793, 0.049], [Q, 0.0, H * 165.0 / 180.0], [0.0, 1.0, 0.0]),
    ("LAnklePitch", [0.0, -0.0505, -0.17], [-Q, 0.0, H], [0.0, 0.0, -1.0]),
    ("LAnkleRoll", [0.0691, 0.0, -0.026], [Q, -Q, 0.0], [0.0, -1.0, 0.0]),
];
/// The sole in the URDF's left foot.
const SOLE: [f64; 3] = [-0.0152219, 0.0907683, -0.0529];

const ARM: [Row; 3] = [
    ("LShoulderPitch", [-0.0015, 0.0765, 0.2035], [-H, 0.0, H], [0.0, 1.0, 0.0]),
    ("LShoulderRoll", [-0.01695, 0.042, 0.0], [-Q, 0.0, Q], [0.0, 0.0, -1.0]),
    ("LElbow", [-0.024, -0.144, -0.0235], [-Q, 0.0, Q], [0.0, 0.0, 1.0]),
];
/// The wrist in the URDF's left lower arm.
const WRIST: [f64; 3] = [0.0, -0.225182, -0.0235];

/// `torso_from_link` for every row of the chain.
fn chain(rows: &[Row], angle: impl Fn(&str) -> f64) -> Vec<Isometry3<f64>> {
    let mut pose = Isometry3::identity();
    rows.iter()
        .map(|(joint, origin, [roll, pitch, yaw], axis)| {
            let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_euler_angles(*roll, *pitch, *yaw));
            let axis = Unit::new_normalize(Vector3::from(*axis));
            pose *= Isometry3::from_parts(Translation3::from(*origin), turn);
            pose *= UnitQuaternion::from_axis_angle(&axis, angle(joint));
            pose
        })
        .collect()
}

#[test]
fn the_left_side_is_the_urdfs_chain_and_the_right_its_mirror_image() {
    let robot = load("wolfgang");
    let mut numbers = Numbers(17);
    let mut data = robot.data();
    for _ in 0..20 {
        let mut q = numbers.position(&robot);
        q[..7].copy_from_slice(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        // The right side turns the other way to stand as the left one's mirror image.
        for (j, joint) in robot.joints.iter().enumerate() {
            if let Some(part) = joint.name.strip_prefix('R') {
                q[7 + j] = -q[7 + robot.joint_index(&format!("L{part}")).unwrap()];
            }
        }
        data.set_position(&q);
        let angle = |name: &str| q[7 + robot.joint_index(name).unwrap()];
        let leg = chain(&LEG, angle);
        let arm = chain(&ARM, angle);
        let sole = leg[5] * nalgebra::Point3::from(SOLE);
        let wrist = arm[2] * nalgebra::Point3::from(WRIST);
        let landmark = |name: &str| data.point(robot.landmark(name).unwrap());
        let links = ["l_hip_1", "l_hip_2", "l_upper_leg", "l_lower_leg", "l_ankle", "l_foot"];
        for (link, pose) in links.iter().zip(&leg) {
            let ours = data.link_position(robot.link_index(link).unwrap());
            // The model's numbers have six digits.
            assert!((ours - pose.translation.vector).norm() < 1e-6, "{link}: {ours:?} against {pose:?}");
        }
        assert!((data.point(&robot.legs[0].sole) - sole.coords).norm() < 1e-6, "sole");
        assert!((landmark("left_wrist") - wrist.coords).norm() < 1e-6, "wrist");
        // The foot's x axis is the sole's, which the URDF turns by a quarter.
        let forward = leg[5] * Vector3::y();
        assert!((data.link_matrix(robot.legs[0].foot).column(0) - forward).norm() < 1e-5, "foot's axes");

        let mirror = |p: Vector3<f64>| Vector3::new(p.x, -p.y, p.z);
        for part in ["hip", "knee", "ankle", "toe_tip", "shoulder", "elbow", "wrist"] {
            let gap = mirror(landmark(&format!("left_{part}"))) - landmark(&format!("right_{part}"));
            assert!(gap.norm() < 1e-9, "{part}");
        }
    }
}

#[test]
fn zero_pose_and_weight_are_the_urdfs() {
    let robot = load("wolfgang");
    assert_eq!(robot.joints.len(), 20);
    assert!((robot.mass() - 6.117).abs() < 1e-3, "{} kg", robot.mass());
    let mut data = robot.data();
    let mut zero = vec![0.0; robot.nq()];
    zero[3] = 1.0;
    data.set_position(&zero);
    let sole = data.point(&robot.legs[0].sole);
    assert!((sole - Vector3::new(0.0974, 0.0687, -0.4199)).norm() < 1e-4, "{sole:?}");
}

#[test]
fn hip_knee_and_ankle_landmarks_lie_in_one_plane_in_the_stand() {
    let robot = load("wolfgang");
    let data = robot.data();
    for (leg, side) in robot.legs.iter().zip([1.0, -1.0]) {
        let at = |link: usize, y: f64| data.point(&LinkPoint { link, point: Vector3::new(0.0, side * y, 0.0) });
        for (name, y) in [("hip", at(leg.thigh, 0.026).y), ("knee", at(leg.shank, -0.023).y)] {
            assert!((y - side * 0.055).abs() < 1e-9, "{name} {y}");
        }
    }
}
