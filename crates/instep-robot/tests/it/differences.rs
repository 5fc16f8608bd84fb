//! Jacobians, momentum and inverse dynamics against finite differences, and moving along the configuration space.

use instep_robot::{LinkPoint, Robot};
use nalgebra::Vector3;
use proptest::prelude::*;

use crate::support::{Numbers, ROBOTS, difference, load, quaternion};

/// Central difference of `f` along each of the nv directions, row-major `rows` x nv.
fn by_differences<const ROWS: usize>(robot: &Robot, q: &[f64], f: impl Fn(&[f64]) -> [f64; ROWS]) -> Vec<f64> {
    let step = 1e-6;
    let nv = robot.nv();
    let data = robot.data();
    let mut matrix = vec![0.0; ROWS * nv];
    for j in 0..nv {
        let moved = |by: f64| {
            let mut q = q.to_vec();
            let mut v = vec![0.0; nv];
            v[j] = 1.0;
            data.integrate(&mut q, &v, by);
            f(&q)
        };
        let (after, before) = (moved(step), moved(-step));
        for i in 0..ROWS {
            matrix[i * nv + j] = (after[i] - before[i]) / (2.0 * step);
        }
    }
    matrix
}

#[test]
fn drift_is_the_acceleration_at_constant_speed() {
    for name in ROBOTS {
        let robot = load(name);
        let mut numbers = Numbers(11);
        let mut data = robot.data();
        let q = numbers.position(&robot);
        let v: Vec<f64> = (0..robot.nv()).map(|_| 2.0 * numbers.next()).collect();
        for leg in &robot.legs {
            let velocities = |by: f64| {
                let mut data = robot.data();
                let mut q = q.clone();
                data.integrate(&mut q, &v, by);
                data.set_state(&q, &v);
                let mut jacobian = vec![0.0; 3 * robot.nv()];
                data.rotation_jacobian_into(leg.foot, &mut jacobian);
                let turn = jacobian.chunks(robot.nv()).map(|row| row.iter().zip(&v).map(|(j, v)| j * v).sum::<f64>());
                (data.point_velocity(&leg.sole), Vector3::from_iterator(turn))
            };
            let step = 1e-6;
            let ((after, turn_after), (before, turn_before)) = (velocities(step), velocities(-step));
            data.set_state(&q, &v);
            let [linear, angular] = data.drift(leg.foot, &data.point(&leg.sole));
            assert!((linear - (after - before) / (2.0 * step)).norm() < 1e-6 * (1.0 + linear.norm()), "{name}");
            assert!(
                (angular - (turn_after - turn_before) / (2.0 * step)).norm() < 1e-6 * (1.0 + angular.norm()),
                "{name}"
            );
        }
    }
}

#[test]
fn jacobians_are_derivatives() {
    for name in ROBOTS {
        let robot = load(name);
        let mut numbers = Numbers(7);
        let mut data = robot.data();
        for _ in 0..4 {
            let q = numbers.position(&robot);
            data.set_position(&q);
            let mut jacobian = vec![0.0; 3 * robot.nv()];
            let moved = |q: &[f64], read: &dyn Fn(&instep_robot::RobotData) -> Vector3<f64>| {
                let mut data = robot.data();
                data.set_position(q);
                read(&data).into()
            };
            for leg in &robot.legs {
                let world = data.point(&leg.sole);
                data.point_jacobian_into(leg.sole.link, &world, &mut jacobian);
                let expected = by_differences::<3>(&robot, &q, |q| moved(q, &|d| d.point(&leg.sole)));
                assert!(difference(&jacobian, &expected) < 1e-7, "{name}: sole");

                // d(R x)/dq = w x (R x) for each axis x of the foot.
                data.rotation_jacobian_into(leg.foot, &mut jacobian);
                for axis in 0..3 {
                    let along = |d: &instep_robot::RobotData| d.link_matrix(leg.foot).column(axis).into_owned();
                    let now = along(&data);
                    let expected = by_differences::<3>(&robot, &q, |q| moved(q, &along));
                    let nv = robot.nv();
                    let ours: Vec<f64> = {
                        let mut m = vec![0.0; 3 * nv];
                        for j in 0..nv {
                            let w = Vector3::new(jacobian[j], jacobian[nv + j], jacobian[2 * nv + j]);
                            let turned = w.cross(&now);
                            for i in 0..3 {
                                m[i * nv + j] = turned[i];
                            }
                        }
                        m
                    };
                    assert!(difference(&ours, &expected) < 1e-7, "{name}: foot's rotation");
                }
            }
            data.com_jacobian_into(&mut jacobian);
            let expected = by_differences::<3>(&robot, &q, |q| moved(q, &|d| d.com()));
            assert!(difference(&jacobian, &expected) < 1e-7, "{name}: centre of mass");
        }
    }
}

#[test]
fn momentum_is_matrix_times_speed_and_its_rate_is_the_outer_wrench() {
    for name in ROBOTS {
        let robot = load(name);
        let nv = robot.nv();
        let mut numbers = Numbers(11);
        let mut data = robot.data();
        for _ in 0..4 {
            let (q, v, a) = (numbers.position(&robot), numbers.vector(nv, 2.0), numbers.vector(nv, 5.0));
            data.set_state(&q, &v);
            let mut matrix = vec![0.0; 6 * nv];
            data.momentum_matrix_into(&mut matrix);
            let product: Vec<f64> =
                (0..6).map(|i| matrix[i * nv..(i + 1) * nv].iter().zip(&v).map(|(m, v)| m * v).sum()).collect();
            assert!(difference(&data.momentum(), &product) < 1e-12, "{name}: momentum");
            let com = data.com();
            let base: Vector3<f64> = data.link_position(robot.base);
            let turn = data.link_matrix(robot.base);
            let mass = robot.mass();

            // With no contact force, the base wrench of inverse dynamics is the rate of momentum less gravity:
            // linear part F = dp/dt - m g; moment about the base origin, in the base frame.
            let mut torques = vec![0.0; nv];
            data.inverse_dynamics_into(&a, &[], &mut torques);
            let force = Vector3::new(torques[0], torques[1], torques[2]);
            let moment = turn * Vector3::new(torques[3], torques[4], torques[5]);
            let about_com = moment + (base - com).cross(&force);
            let step = 1e-6;
            let momentum_at = |by: f64| {
                let mut moved = robot.data();
                let mut q_moved = q.clone();
                // Half-step rule: q at +-h/2 with the speed in the middle, second order.
                let middle: Vec<f64> = v.iter().zip(&a).map(|(v, a)| v + 0.5 * by * a).collect();
                moved.integrate(&mut q_moved, &middle, by);
                let v_moved: Vec<f64> = v.iter().zip(&a).map(|(v, a)| v + by * a).collect();
                moved.set_state(&q_moved, &v_moved);
                moved.momentum()
            };
            let (after, before) = (momentum_at(step), momentum_at(-step));
            let rate: Vec<f64> = after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * step)).collect();
            let ours = [force.x, force.y, force.z - mass * 9.81, about_com.x, about_com.y, about_com.z];
            assert!(difference(&ours, &rate) < 1e-6, "{name}: rate of momentum {ours:?} against {rate:?}");
        }
    }
}

#[test]
fn effective_mass_of_a_free_body_point_is_less_than_the_robots() {
    for name in ROBOTS {
        let robot = load(name);
        let mut data = robot.data();
        for leg in &robot.legs {
            let mass = data.effective_mass(&leg.sole, &Vector3::x());
            assert!(mass > 0.05 * robot.mass() / 29.5 && mass < robot.mass(), "{name}: {mass} kg");
        }
    }
}

#[test]
fn weight_borne_under_the_centre_of_mass_needs_no_wrench_at_the_base() {
    for name in ROBOTS {
        let robot = load(name);
        let mut data = robot.data();
        // The weight under the centre of mass, wherever that is: a point of the base link.
        let com = data.com();
        let point = data.link_matrix(robot.base).transpose() * (com - data.link_position(robot.base));
        let weight = Vector3::new(0.0, 0.0, robot.mass() * 9.81);
        let mut torques = vec![0.0; robot.nv()];
        let still = vec![0.0; robot.nv()];
        data.inverse_dynamics_into(&still, &[(LinkPoint { link: robot.base, point }, weight)], &mut torques);
        assert!(difference(&torques[..6], &[0.0; 6]) < 1e-9, "{name}: {:?}", &torques[..6]);
    }
}

proptest! {
    /// `integrate` undoes `difference_into`, and keeps the quaternion a unit one.
    #[test]
    fn integrate_and_difference_are_inverse(
        from in quaternion(),
        to in quaternion(),
        joints in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 28),
        dt in 0.001..2.0f64,
    ) {
        // 25 joints and the base's position.
        thread_local! { static ROBOT: Robot = load("prestoe"); }
        ROBOT.with(|robot| {
            let state = |quaternion: [f64; 4], pick: &dyn Fn(&(f64, f64)) -> f64| {
                let values: Vec<f64> = joints.iter().map(pick).collect();
                [&values[..3], &quaternion, &values[3..]].concat()
            };
            let (a, b) = (state(from, &|p| p.0), state(to, &|p| p.1));
            let data = robot.data();
            let mut v = vec![0.0; robot.nv()];
            data.difference_into(&a, &b, dt, &mut v);
            let mut reached = a.clone();
            data.integrate(&mut reached, &v, dt);
            let norm = reached[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
            prop_assert!((norm - 1.0).abs() < 1e-12);
            // A quaternion and its negative are the same rotation.
            let sign = reached[3..7].iter().zip(&b[3..7]).map(|(x, y)| x * y).sum::<f64>().signum();
            for (i, (x, y)) in reached.iter().zip(&b).enumerate() {
                let x = if (3..7).contains(&i) { sign * x } else { *x };
                prop_assert!((x - y).abs() < 1e-9, "entry {}: {} against {}", i, x, y);
            }
            Ok(())
        })?;
    }
}
