//! Capsule gaps against MuJoCo's own geom distance.

use mujoco_rs::prelude::*;

use crate::support::{Numbers, ROBOTS, load};

#[test]
fn capsule_gaps_are_mujocos() {
    for name in ROBOTS {
        let robot = load(name);
        assert!(!robot.self_collision.is_empty(), "{name} names pairs");
        let mut numbers = Numbers(3);
        let mut ours = robot.data();
        let mut theirs = MjData::new(robot.model().clone());
        for _ in 0..20 {
            let q = numbers.position(&robot);
            ours.set_position(&q);
            theirs.qpos_mut().copy_from_slice(&q);
            theirs.kinematics();
            for &[a, b] in &robot.self_collision {
                let (points, gap) = ours.capsule_gap([a, b]);
                let expected = theirs.geom_distance(a, b, 10.0, None);
                // MuJoCo's narrow phase treats near-parallel axes with a tolerance of its own.
                assert!((gap - expected).abs() < 1e-6, "{name}: pair {a}, {b}: {gap} against {expected}");
                let [radius_a, radius_b] = [a, b].map(|geom| ours.capsule(geom).1);
                assert!((points.distance() - radius_a - radius_b - gap).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn contact_spheres_are_where_the_file_says() {
    for name in ROBOTS {
        let robot = load(name);
        let data = robot.data();
        for contact in &robot.contacts {
            let ([centre, other], radius) = data.capsule(contact.geom);
            assert_eq!(centre, other, "a sphere");
            assert!((centre - data.point(&contact.at)).norm() < 1e-12, "{name}: {}", contact.name);
            assert!((radius - contact.radius).abs() < 1e-15);
            assert_eq!(data.geom_link(contact.geom), contact.at.link);
        }
    }
}
