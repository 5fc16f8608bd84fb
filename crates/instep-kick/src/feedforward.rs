//! The torques that a reference's motion needs, for references that do not carry them.
//!
//! Inverse dynamics, equation (33) of paper 1: torque = M a + h - J^T f, with accelerations from the speeds of the
//! neighbouring knots and ground forces f on the contact points that stand. The forces are the smallest that give the
//! base what it needs, in the sense of least squares with a little regularisation; they are not kept inside their
//! friction cones, and what the feet cannot give the base is left out. So this is a guess that helps the drives carry
//! the robot's weight, not a feasible plan: that is the kinodynamic stage's work.

use instep_motion::reference::{Knot, Reference};
use instep_robot::Robot;
use nalgebra::{DMatrix, DVector, Vector3};

/// Regularisation of the ground forces, relative to the unit matrix of the base's six equations.
const REGULARISATION: f64 = 1e-3;

/// Torques of `reference`'s knots in the robot's joint order, whose joints are at `places` in the reference: its own where it
/// carries them, else those of [`torques`].
#[must_use]
pub fn of_reference(robot: &Robot, reference: &Reference, places: &[usize]) -> Vec<Vec<f64>> {
    if reference.knots.iter().all(|knot| knot.torques.len() == reference.joint_names.len()) {
        return reference.knots.iter().map(|knot| places.iter().map(|&place| knot.torques[place]).collect()).collect();
    }
    let states: Vec<_> = reference.knots.iter().map(|knot| state(knot, places)).collect();
    torques(robot, &reference.knots, &states, reference.rate)
}

/// q (7 + n) and v (6 + n) of a knot, with the robot's joints at `places` in it.
pub(crate) fn state(knot: &Knot, places: &[usize]) -> (Vec<f64>, Vec<f64>) {
    let mut q = [&knot.base_position[..], &knot.base_orientation].concat();
    let mut v = [&knot.base_velocity[..], &knot.base_angular_velocity].concat();
    q.extend(places.iter().map(|&place| knot.joints[place]));
    v.extend(places.iter().map(|&place| knot.joint_velocities[place]));
    (q, v)
}

/// Joint torques (N m, the robot's joint order) for every knot of a motion with `rate` knots a second; `states` holds
/// each knot's q (7 + n) and v (6 + n) in the robot's order.
#[must_use]
pub fn torques(robot: &Robot, knots: &[Knot], states: &[(Vec<f64>, Vec<f64>)], rate: f64) -> Vec<Vec<f64>> {
    let nv = robot.nv();
    let mut data = robot.data();
    let mut jacobian = vec![0.0; 3 * nv];
    let mut torques = Vec::with_capacity(knots.len());
    for (k, (knot, (q, v))) in knots.iter().zip(states).enumerate() {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(states.len() - 1));
        let time = (after - before).max(1) as f64 / rate;
        let a: Vec<f64> = states[after].1.iter().zip(&states[before].1).map(|(b, a)| (b - a) / time).collect();
        data.set_state(q, v);
        let mut needed = vec![0.0; nv];
        data.inverse_dynamics_into(&a, &[], &mut needed);

        let standing: Vec<_> =
            robot.contacts.iter().zip(&knot.contacts).filter(|(_, stands)| **stands).map(|(c, _)| c.at).collect();
        if !standing.is_empty() {
            let mut map = DMatrix::zeros(6, 3 * standing.len());
            for (c, at) in standing.iter().enumerate() {
                data.point_jacobian_into(at.link, &data.point(at), &mut jacobian);
                for row in 0..6 {
                    for axis in 0..3 {
                        map[(row, 3 * c + axis)] = jacobian[axis * nv + row];
                    }
                }
            }
            let square = &map * map.transpose() + DMatrix::identity(6, 6) * REGULARISATION;
            if let Some(solution) = square.lu().solve(&DVector::from_column_slice(&needed[..6])) {
                let forces = map.transpose() * solution;
                let forces: Vec<_> = standing
                    .iter()
                    .enumerate()
                    .map(|(c, at)| (*at, Vector3::new(forces[3 * c], forces[3 * c + 1], forces[3 * c + 2])))
                    .collect();
                data.inverse_dynamics_into(&a, &forces, &mut needed);
            }
        }
        torques.push(needed[6..].to_vec());
    }
    torques
}
