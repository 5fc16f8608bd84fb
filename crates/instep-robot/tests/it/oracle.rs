//! Kinematics and dynamics against Pinocchio: the files are written by `tools/check_dynamics.py`, which says what is
//! in them. Pinocchio's conventions are turned into ours here.
//!
//! With R = `world_from_base`, our speed is v = G v_p, where G = diag(R, 1, 1): Pinocchio's base velocity stands in
//! the base frame. Hence J = J_p G^T, M = G M_p G^T, torque = G torque_p, and the base's linear acceleration
//! is R (a_p + w x v_p), since ours is the derivative of a vector in the world.

use instep_robot::{LinkPoint, Robot};
use nalgebra::{DMatrix, DVector, Matrix3, Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;

use crate::support::{data_file, difference, load};

#[derive(Deserialize)]
struct Oracle {
    joints: Vec<String>,
    mass: f64,
    states: Vec<State>,
}

#[derive(Deserialize)]
struct State {
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    links: Vec<LinkState>,
    forces: Vec<Force>,
    com: [f64; 3],
    com_jacobian: Vec<f64>,
    momentum_matrix: Vec<f64>,
    momentum: Vec<f64>,
    kinetic_energy: f64,
    mass_matrix_upper: Vec<f64>,
    inverse_dynamics: Vec<f64>,
}

#[derive(Deserialize)]
struct LinkState {
    link: String,
    position: [f64; 3],
    rotation: Vec<f64>,
    point: [f64; 3],
    jacobian: Vec<f64>,
}

#[derive(Deserialize)]
struct Force {
    link: String,
    point: [f64; 3],
    force: [f64; 3],
}

/// A state in our conventions, and what turns Pinocchio's results into ours.
struct Converted {
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    g: DMatrix<f64>,
}

/// `order[i]`: place in our joint vector of Pinocchio's joint i.
fn convert(state: &State, order: &[usize]) -> Converted {
    let nv = 6 + order.len();
    let [x, y, z, w] = [state.q[3], state.q[4], state.q[5], state.q[6]];
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    let base: Matrix3<f64> = rotation.to_rotation_matrix().into_inner();
    let mut g = DMatrix::zeros(nv, nv);
    g.view_mut((0, 0), (3, 3)).copy_from(&base);
    g.view_mut((3, 3), (3, 3)).fill_with_identity();
    for (theirs, ours) in order.iter().enumerate() {
        g[(6 + ours, 6 + theirs)] = 1.0;
    }

    let mut q = vec![0.0; 7 + order.len()];
    q[..7].copy_from_slice(&[state.q[0], state.q[1], state.q[2], w, x, y, z]);
    for (theirs, ours) in order.iter().enumerate() {
        q[7 + ours] = state.q[7 + theirs];
    }
    let v = &g * DVector::from_column_slice(&state.v);
    let linear = Vector3::from_column_slice(&state.v[..3]);
    let angular = Vector3::from_column_slice(&state.v[3..6]);
    let mut a_p = DVector::from_column_slice(&state.a);
    let turning = angular.cross(&linear);
    for i in 0..3 {
        a_p[i] += turning[i];
    }
    let a = &g * a_p;
    Converted { q, v: v.as_slice().to_vec(), a: a.as_slice().to_vec(), g }
}

/// A row-major matrix of Pinocchio's times G^T, row-major.
fn columns(rows: usize, matrix: &[f64], g: &DMatrix<f64>) -> Vec<f64> {
    let ours = DMatrix::from_row_slice(rows, g.nrows(), matrix) * g.transpose();
    ours.transpose().as_slice().to_vec()
}

/// Compares everything; prints and returns the largest relative difference of each quantity.
fn compare(name: &str) -> Vec<(&'static str, f64)> {
    let robot: Robot = load(name);
    let file = data_file(&format!("{name}_pinocchio.json"));
    let oracle: Oracle = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let order: Vec<usize> = oracle.joints.iter().map(|joint| robot.joint_index(joint).unwrap()).collect();
    assert_eq!(order.len(), robot.joints.len(), "{name}: joints that Pinocchio and we know");
    assert!((robot.mass() - oracle.mass).abs() < 1e-9, "{name}: mass");
    assert_eq!(oracle.states.len(), 8);

    let nv = robot.nv();
    let mut worst: Vec<(&'static str, f64)> = Vec::new();
    let mut note = |what: &'static str, value: f64| match worst.iter_mut().find(|(known, _)| *known == what) {
        Some((_, most)) => *most = most.max(value),
        None => worst.push((what, value)),
    };
    let mut data = robot.data();
    let mut jacobian = vec![0.0; 3 * nv];
    for state in &oracle.states {
        let Converted { q, v, a, g } = convert(state, &order);
        data.set_state(&q, &v);

        for expected in &state.links {
            let link = robot.link_index(&expected.link).unwrap();
            let at = LinkPoint { link, point: expected.point.into() };
            note("link position", difference(data.link_position(link).as_slice(), &expected.position));
            let rotation = data.link_matrix(link).transpose();
            note("link rotation", difference(rotation.as_slice(), &expected.rotation));
            let turned = data.link_rotation(link).to_rotation_matrix().into_inner().transpose();
            note("link rotation", difference(turned.as_slice(), &expected.rotation));
            let world = data.point(&at);
            data.point_jacobian_into(link, &world, &mut jacobian);
            note("point Jacobian", difference(&jacobian, &columns(3, &expected.jacobian, &g)));
            let velocity = DMatrix::from_row_slice(3, nv, &expected.jacobian) * DVector::from_column_slice(&state.v);
            note("point velocity", difference(data.point_velocity(&at).as_slice(), velocity.as_slice()));
        }

        note("centre of mass", difference(data.com().as_slice(), &state.com));
        data.com_jacobian_into(&mut jacobian);
        note("CoM Jacobian", difference(&jacobian, &columns(3, &state.com_jacobian, &g)));
        let mut momentum_matrix = vec![0.0; 6 * nv];
        data.momentum_matrix_into(&mut momentum_matrix);
        note("momentum matrix", difference(&momentum_matrix, &columns(6, &state.momentum_matrix, &g)));
        note("momentum", difference(&data.momentum(), &state.momentum));
        note("kinetic energy", difference(&[data.kinetic_energy()], &[state.kinetic_energy]));

        let mut theirs = DMatrix::zeros(nv, nv);
        let mut upper = state.mass_matrix_upper.iter();
        for i in 0..nv {
            for j in i..nv {
                theirs[(i, j)] = *upper.next().unwrap();
                theirs[(j, i)] = theirs[(i, j)];
            }
        }
        let mass_matrix = &g * theirs * g.transpose();
        note("mass matrix", difference(data.mass_matrix().as_slice(), mass_matrix.as_slice()));

        let forces: Vec<_> = state
            .forces
            .iter()
            .map(|f| {
                let link = robot.link_index(&f.link).unwrap();
                (LinkPoint { link, point: f.point.into() }, Vector3::from(f.force))
            })
            .collect();
        let mut torques = vec![0.0; nv];
        data.inverse_dynamics_into(&a, &forces, &mut torques);
        let expected = &g * DVector::from_column_slice(&state.inverse_dynamics);
        note("inverse dynamics", difference(&torques, expected.as_slice()));
    }
    worst
}

fn agrees(name: &str) {
    for (what, difference) in compare(name) {
        println!("{name}: {what}: {difference:.1e}");
        assert!(
            difference < 1e-8,
            "{name}: {what} differs from Pinocchio's by {difference:e} (model changed? run tools/check_dynamics.py)"
        );
    }
}

#[test]
fn prestoe_agrees_with_pinocchio() {
    agrees("prestoe");
}

#[test]
fn nao_agrees_with_pinocchio() {
    agrees("nao");
}

#[test]
fn wolfgang_agrees_with_pinocchio() {
    agrees("wolfgang");
}
