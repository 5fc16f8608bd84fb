//! From the solver's unknowns to a reference, and to what is said about it.

use std::collections::BTreeMap;

use instep_motion::reference::{Knot, Reference, ReferenceKind, Source};
use nalgebra::{Matrix6, Vector3, Vector6};

use super::approach;
use super::inverse_dynamics::Dynamics;
use super::plan::Plan;
use super::settings::KinodynamicSettings;
use super::solver::Solver;
use super::terms::{Family, Worst};
use crate::kinematic::Retargeted;

/// What positions, speeds and momenta are rounded to: enough for accelerations, and half the file's size.
const DIGITS: f64 = 1e8;
/// Keeps the changes of [`balance`] small where the standing points cannot give a wrench.
const BALANCE_RIDGE: f64 = 1e-6;
/// What forces (N) and torques (N m) are rounded to.
const FORCE_DIGITS: f64 = 1e4;

fn rounded<const N: usize>(values: [f64; N], digits: f64) -> [f64; N] {
    values.map(|value| (value * digits).round() / digits)
}

/// The reference: a knot at every node and one half-way to the next.
///
/// At the half-way knots the motion is the spline's. The forces are the mean of the nodes', which leaves a wrench on
/// the base of one or two percent of the weight in the fastest part of a kick, as true forces are curved in time; the
/// least change of the standing points' forces that takes the wrench away is added, as far as the friction cone lets
/// it. In flight there is nothing to add.
pub(crate) fn reference(solver: &Solver, start: &Retargeted) -> Reference {
    let plan = &*solver.plan;
    let robot = plan.robot;
    let mut data = robot.data();
    let mut dynamics = Dynamics::new(&plan.tree);
    let count = plan.nodes.len();
    let knots = (0..2 * count - 1)
        .map(|i| {
            let [x, xv, xa] = if i % 2 == 0 { solver.state(i / 2) } else { half_way(solver, i / 2) };
            let (q, v) = plan.tree.state(&x, &xv);
            data.set_state(&q, &v);
            dynamics.compute(&plan.tree, &x, &xv, &xa, false);
            let around = [i / 2, i.div_ceil(2)];
            let mut forces = vec![Vector3::zeros(); robot.contacts.len()];
            for k in around {
                for (&p, f) in plan.nodes[k].pushing.iter().zip(solver.x.f[k].chunks(3)) {
                    forces[p] += Vector3::new(f[0], f[1], f[2]) * (0.5 * plan.weight);
                }
            }
            if i % 2 == 1 {
                balance(plan, i / 2, &dynamics, &mut forces);
            }
            let forces: Vec<[f64; 3]> = forces.into_iter().map(|f| rounded(f.into(), FORCE_DIGITS)).collect();
            let torques = generalised(plan, &dynamics, &forces.iter().map(|f| Vector3::from(*f)).collect::<Vec<_>>());
            let cut = |values: &[f64], digits| values.iter().map(|v| rounded([*v], digits)[0]).collect::<Vec<f64>>();
            Knot {
                base_position: rounded([q[0], q[1], q[2]], DIGITS),
                base_orientation: rounded([q[3], q[4], q[5], q[6]], 1e2 * DIGITS),
                base_velocity: rounded([v[0], v[1], v[2]], DIGITS),
                base_angular_velocity: rounded([v[3], v[4], v[5]], DIGITS),
                joints: cut(&q[7..], DIGITS),
                joint_velocities: cut(&v[6..], DIGITS),
                contacts: (0..robot.contacts.len())
                    .map(|p| around.iter().all(|&k| plan.nodes[k].standing[p]))
                    .collect(),
                forces,
                torques: cut(&torques[6..], FORCE_DIGITS),
                com: rounded(data.com().into(), DIGITS),
                momentum: rounded(data.momentum(), DIGITS),
            }
        })
        .collect();
    Reference {
        format: Reference::FORMAT,
        robot: robot.name.clone(),
        kind: ReferenceKind::Kinodynamic,
        source: Source { clip_start: plan.clip_start, ..start.reference.source.clone() },
        rate: 2.0 * plan.settings.rate,
        ball: plan.ball.into(),
        phases: plan.phases,
        joint_names: robot.joints.iter().map(|joint| joint.name.clone()).collect(),
        contact_names: robot.contacts.iter().map(|contact| contact.name.clone()).collect(),
        knots,
    }
}

/// Position, speed and acceleration of the spline half-way between a node and the next.
fn half_way(solver: &Solver, k: usize) -> [Vec<f64>; 3] {
    let ([q0, v0, a0], [q1, v1, a1]) = (solver.state(k), solver.state(k + 1));
    let h = solver.plan.step;
    let each = |value: &dyn Fn(usize) -> f64| (0..q0.len()).map(value).collect::<Vec<f64>>();
    [
        each(&|i| 0.5 * (q0[i] + q1[i]) + 0.125 * h * (v0[i] - v1[i])),
        each(&|i| 1.5 * (q1[i] - q0[i]) / h - 0.25 * (v0[i] + v1[i])),
        each(&|i| 0.5 * (a0[i] + a1[i])),
    ]
}

/// Generalised forces (33) with contact forces (N) at all contact points taken off.
fn generalised(plan: &Plan, dynamics: &Dynamics, forces: &[Vector3<f64>]) -> Vec<f64> {
    let mut sums = dynamics.force.clone();
    for (contact, force) in plan.robot.contacts.iter().zip(forces).filter(|(_, force)| force.norm() > 0.0) {
        let at = dynamics.pose.point(&contact.at);
        for &i in plan.tree.chain(contact.at.link) {
            sums[i] -= plan.tree.column(&dynamics.pose, i, &at).dot(force);
        }
    }
    sums
}

/// Adds the least change of the forces that push which takes the wrench off the base, or as much of it as can be; after
/// node `k`.
fn balance(plan: &Plan, k: usize, dynamics: &Dynamics, forces: &mut [Vector3<f64>]) {
    let wrench = generalised(plan, dynamics, forces);
    let pushing: Vec<usize> = (0..forces.len()).filter(|&p| forces[p].norm() > 0.0).collect();
    if pushing.is_empty() {
        return;
    }
    // Points change their force in proportion to what they carry.
    let columns: Vec<(f64, [Vector3<f64>; 6])> = pushing
        .iter()
        .map(|&p| {
            let at = dynamics.pose.point(&plan.robot.contacts[p].at);
            let carried = (forces[p].z / plan.weight).max(0.0);
            (carried, std::array::from_fn(|i| plan.tree.column(&dynamics.pose, i, &at)))
        })
        .collect();
    let mut square = Matrix6::from_fn(|i, j| columns.iter().map(|(w, c)| w * c[i].dot(&c[j])).sum::<f64>());
    (0..6).for_each(|i| square[(i, i)] += BALANCE_RIDGE);
    let Some(factor) = square.cholesky() else { return };
    let share = factor.solve(&Vector6::from_fn(|i, _| wrench[i]));
    let change: Vec<Vector3<f64>> = columns
        .iter()
        .map(|(w, column)| column.iter().zip(share.iter()).map(|(c, s)| c * *s).sum::<Vector3<f64>>() * *w)
        .collect();
    // As much of it as leaves every force inside the cone.
    let inside = |p: usize, f: Vector3<f64>| {
        let [x, y, up] = plan.footing(k, p).map(|axis| axis.dot(&f));
        x.hypot(y) <= plan.settings.friction * up
    };
    for part in [1.0, 0.5, 0.25] {
        if pushing.iter().zip(&change).all(|(&p, change)| inside(p, forces[p] + change * part)) {
            pushing.iter().zip(&change).for_each(|(&p, change)| forces[p] += change * part);
            return;
        }
    }
}

/// Speed of the striking point at the impact, m/s.
pub(crate) fn foot_speed(solver: &Solver) -> f64 {
    let plan = &*solver.plan;
    let [x, v, _] = solver.state(plan.lock[1].min(plan.nodes.len() - 1));
    let mut pose = plan.tree.pose();
    plan.tree.place(&x, &mut pose);
    let at = pose.point(&plan.strike);
    let chain = plan.tree.chain(plan.strike.link);
    chain.iter().map(|&i| plan.tree.column(&pose, i, &at) * v[i]).sum::<Vector3<f64>>().norm()
}

/// Distance of the striking point, at the impact, from where it belongs, m.
pub(crate) fn ball_miss(solver: &Solver) -> f64 {
    let plan = &*solver.plan;
    let [x, ..] = solver.state(plan.lock[1].min(plan.nodes.len() - 1));
    let mut pose = plan.tree.pose();
    plan.tree.place(&x, &mut pose);
    (pose.point(&plan.strike) - plan.strike_place).norm()
}

/// Approach angle (20), rad.
pub(crate) fn approach_angle(solver: &Solver) -> f64 {
    let [x, ..] = solver.state(0);
    approach::angle([solver.plan.ball.x, solver.plan.ball.y], [x[0], x[1]]).0
}

/// Violations against the real limits: what the solver saw, less the margins it worked with.
pub(crate) fn violations(solver: &Solver, worst: &Worst) -> BTreeMap<&'static str, f64> {
    let settings = solver.plan.settings;
    Family::ALL.into_iter().map(|f| (f.name(), real(settings, f, worst.values[f as usize]))).collect()
}

/// A violation against the real limit.
fn real(settings: &KinodynamicSettings, family: Family, value: f64) -> f64 {
    let real = match family {
        Family::Torque => (1.0 + value) * (1.0 - settings.torque_margin) - 1.0,
        Family::JointSpeed => value - settings.speed_margin,
        Family::JointLimit => value - settings.joint_margin,
        Family::SelfCollision => value - settings.clearance,
        Family::Ground => value - settings.ground_clearance,
        Family::Friction => value - super::friction::SPARE,
        Family::ApproachAngle => value - approach::SPARE,
        _ => value,
    };
    if real.is_nan() { f64::INFINITY } else { real.max(0.0) }
}

/// The first knots of the reference at which `family` is violated, at most ten.
pub(crate) fn violated(solver: &mut Solver, family: &str) -> Vec<usize> {
    let Some(family) = Family::ALL.into_iter().find(|f| f.name() == family) else { return Vec::new() };
    let settings = solver.plan.settings;
    let values = solver.by_node(family);
    let nodes = values.iter().enumerate().filter(|(_, value)| real(settings, family, **value) > settings.tolerance);
    nodes.map(|(k, _)| 2 * k).take(10).collect()
}
