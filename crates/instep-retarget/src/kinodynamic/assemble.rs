//! From the solver's unknowns to a reference, and to what is said about it.

use std::collections::BTreeMap;

use instep_motion::reference::{Knot, Reference, ReferenceKind, Source};
use instep_robot::LinkPoint;
use nalgebra::Vector3;

use super::approach;
use super::inverse_dynamics::Dynamics;
use super::solver::Solver;
use super::terms::{Family, Worst};
use crate::kinematic::Retargeted;

/// Numbers are kept to this many digits behind the point: enough for accelerations, and half the file's size.
const DIGITS: f64 = 1e9;

fn rounded(value: f64) -> f64 {
    (value * DIGITS).round() / DIGITS
}

/// The reference, every node a knot.
pub(crate) fn reference(solver: &Solver, start: &Retargeted) -> Reference {
    let plan = &*solver.plan;
    let robot = plan.robot;
    let mut data = robot.data();
    let nv = robot.nv();
    let mut torques = vec![0.0; nv];
    let mut dynamics = Dynamics::new(&plan.tree);
    let knots = (0..plan.nodes.len())
        .map(|k| {
            let [x, xv, xa] = solver.state(k);
            let (q, v) = plan.tree.state(&x, &xv);
            let mut forces = vec![[0.0; 3]; robot.contacts.len()];
            for (&p, f) in plan.nodes[k].pushing.iter().zip(solver.x.f[k].chunks(3)) {
                forces[p] = [f[0], f[1], f[2]].map(|f| rounded(f * plan.weight));
            }
            let acting: Vec<(LinkPoint, Vector3<f64>)> =
                robot.contacts.iter().zip(&forces).map(|(c, f)| (c.at, Vector3::from(*f))).collect();
            data.set_state(&q, &v);
            // Joint accelerations are the same in both conventions; torques of joints need the base's as well.
            dynamics.compute(&plan.tree, &x, &xv, &xa, false);
            torques.copy_from_slice(&dynamics.force);
            let mut jacobian = vec![0.0; 3 * nv];
            for (at, force) in &acting {
                let world = data.point(at);
                data.point_jacobian_into(at.link, &world, &mut jacobian);
                for i in 6..nv {
                    torques[i] -= (0..3).map(|axis| jacobian[axis * nv + i] * force[axis]).sum::<f64>();
                }
            }
            let cut = |values: &[f64]| values.iter().map(|v| rounded(*v)).collect::<Vec<f64>>();
            Knot {
                base_position: [q[0], q[1], q[2]].map(rounded),
                base_orientation: [q[3], q[4], q[5], q[6]],
                base_velocity: [v[0], v[1], v[2]].map(rounded),
                base_angular_velocity: [v[3], v[4], v[5]].map(rounded),
                joints: cut(&q[7..]),
                joint_velocities: cut(&v[6..]),
                contacts: plan.nodes[k].standing.clone(),
                forces,
                torques: torques[6..].iter().map(|t| (t * 1e6).round() / 1e6).collect(),
                com: <[f64; 3]>::from(data.com()).map(rounded),
                momentum: data.momentum().map(rounded),
            }
        })
        .collect();
    Reference {
        format: Reference::FORMAT,
        robot: robot.name.clone(),
        kind: ReferenceKind::Kinodynamic,
        source: Source { clip_start: plan.clip_start, ..start.reference.source.clone() },
        rate: plan.settings.rate,
        ball: plan.ball.into(),
        phases: plan.phases,
        joint_names: robot.joints.iter().map(|joint| joint.name.clone()).collect(),
        contact_names: robot.contacts.iter().map(|contact| contact.name.clone()).collect(),
        knots,
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

/// Approach angle (20), rad.
pub(crate) fn approach_angle(solver: &Solver) -> f64 {
    let [x, ..] = solver.state(0);
    approach::angle([solver.plan.ball.x, solver.plan.ball.y], [x[0], x[1]]).0
}

/// Violations against the real limits: what the solver saw, less the margins it worked with.
pub(crate) fn violations(solver: &Solver, worst: &Worst) -> BTreeMap<&'static str, f64> {
    let settings = solver.plan.settings;
    Family::ALL
        .into_iter()
        .map(|family| {
            let value = worst.values[family as usize];
            let real = match family {
                Family::Torque => (1.0 + value) * (1.0 - settings.torque_margin) - 1.0,
                Family::JointSpeed => value - settings.speed_margin,
                Family::JointLimit => value - settings.joint_margin,
                Family::SelfCollision => value - settings.clearance,
                Family::Friction => value - super::friction::SPARE,
                Family::ApproachAngle => value - approach::SPARE,
                _ => value,
            };
            (family.name(), if real.is_nan() { f64::INFINITY } else { real.max(0.0) })
        })
        .collect()
}

/// The first knots at which `family` is violated by more than `tolerance`, at most ten.
pub(crate) fn violated(solver: &Solver, family: &str, tolerance: f64) -> Vec<usize> {
    let _ = (family, tolerance);
    let worst = solver.last_worst;
    Family::ALL.into_iter().filter(|f| f.name() == family).map(|f| worst.nodes[f as usize]).collect()
}
