//! The check by full inverse dynamics (33), between the knots too, with other code than the optimisation's.
//!
//! The reference is read as everybody else reads it ([`Reference::sample_into`]), at 200 Hz or more; accelerations are
//! differences of its speeds over [`DIFFERENCE`]; torques are MuJoCo's for them and the forces read. What is counted:
//! torques beyond what the drive gives at that speed, speeds and angles beyond their limits, the wrench that the
//! unactuated base would need, how far standing points move, how deep points sink, capsules that overlap.

use std::collections::BTreeMap;

use instep_motion::reference::{Knot, Reference};
use instep_robot::control::torque_range;
use instep_robot::{LinkPoint, Robot};
use nalgebra::Vector3;
use serde::Serialize;

use super::height_map::HeightMap;

/// Half the time over which speeds are differenced, s.
pub const DIFFERENCE: f64 = 1e-5;
/// Instants a second at which [`super::optimize`] checks, at least.
pub const VERIFY_RATE: f64 = 200.0;
/// Largest wrench on the base that a motion may leave over, as a share of m g.
pub const MAX_ROOT_WRENCH: f64 = 0.01;
/// Longest way of a standing point along the ground, and off it, m.
pub const MAX_SLIP: f64 = 1e-3;
/// Deepest point below the ground and deepest overlap of capsules, m; largest force outside its cone, share of m g.
pub const MAX_DEPTH: f64 = 1e-4;
/// Torque that shares are taken of where the drive gives less, as a share of its limit.
const LEAST_TORQUE: f64 = 0.01;
/// What rounding in the reference may add to a limit, as a share of it.
const ROUNDING: f64 = 1e-6;

/// What the check found.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Verification {
    /// Instants looked at.
    pub samples: usize,
    /// Joints and instants with a torque that the drive does not have at that speed.
    pub torque_violations: usize,
    /// With a speed beyond the limit.
    pub speed_violations: usize,
    /// With an angle beyond the range.
    pub joint_violations: usize,
    /// Largest force of the wrench on the base, as a share of m g; its moment over 1 m counts too.
    pub root_wrench_residual: f64,
    /// Time of that, s.
    pub root_wrench_time: f64,
    /// Longest way along the ground of a point during one stance, m.
    pub stance_slip: f64,
    /// Greatest height of a standing point above the ground, m.
    pub stance_lift: f64,
    /// Deepest point below the ground, m.
    pub penetration: f64,
    /// Deepest overlap of capsules, m.
    pub self_collision: f64,
    /// Largest force that pulls or leaves the friction cone, as a share of m g. 0 if none.
    pub friction: f64,
    /// Largest torque of each joint as a share of what the drive gives at that speed.
    pub torque_use: BTreeMap<String, f64>,
    /// Largest speed of each joint as a share of its limit.
    pub speed_use: BTreeMap<String, f64>,
    /// The same two from the start of the swing to the impact only.
    pub swing_torque_use: BTreeMap<String, f64>,
    /// See `swing_torque_use`.
    pub swing_speed_use: BTreeMap<String, f64>,
}

impl Verification {
    /// What is beyond its bound, if anything: its field and by how much (violations of limits: the largest share).
    #[must_use]
    pub fn fault(&self) -> Option<(&'static str, f64)> {
        let most = |uses: &BTreeMap<String, f64>| uses.values().fold(0.0_f64, |most, share| most.max(*share)) - 1.0;
        let counted = [
            ("torque_violations", self.torque_violations, most(&self.torque_use)),
            ("speed_violations", self.speed_violations, most(&self.speed_use)),
            ("joint_violations", self.joint_violations, self.joint_violations as f64),
        ];
        let measured = [
            ("root_wrench_residual", self.root_wrench_residual, MAX_ROOT_WRENCH),
            ("stance_slip", self.stance_slip, MAX_SLIP),
            ("stance_lift", self.stance_lift, MAX_SLIP),
            ("penetration", self.penetration, MAX_DEPTH),
            ("self_collision", self.self_collision, MAX_DEPTH),
            ("friction", self.friction, MAX_DEPTH),
        ];
        let counted = counted.into_iter().filter(|(_, count, _)| *count > 0).map(|(name, _, by)| (name, by));
        // Written so that a NaN is a fault.
        let measured =
            measured.into_iter().filter(|(_, value, most)| !(value <= most)).map(|(name, value, _)| (name, value));
        counted.chain(measured).next()
    }
}

/// Checks `reference` at `rate` instants a second, at least; `friction` is the coefficient of the cone. The cone's axis
/// is the normal of the `ground`.
#[must_use]
pub fn verify(robot: &Robot, reference: &Reference, rate: f64, friction: f64, ground: &HeightMap) -> Verification {
    let mut data = robot.data();
    let nv = robot.nv();
    let weight = robot.mass() * 9.81;
    let mut found = Verification::default();
    let (mut q, mut v, mut a, mut torques) = (Vec::new(), Vec::new(), vec![0.0; nv], vec![0.0; nv]);
    let mut knot = Knot::default();
    let mut other = Knot::default();
    let count = (reference.duration() * rate).floor() as usize;
    let mut anchors: Vec<Option<Vector3<f64>>> = vec![None; robot.contacts.len()];
    for i in 0..=count {
        // Not at the very ends: differences need both sides.
        let t = (i as f64 / rate).clamp(2.0 * DIFFERENCE, reference.duration() - 2.0 * DIFFERENCE);
        reference.sample_into(t + DIFFERENCE, &mut other);
        speed(&other, &mut a);
        reference.sample_into(t - DIFFERENCE, &mut other);
        speed(&other, &mut v);
        a.iter_mut().zip(&v).for_each(|(a, v)| *a = (*a - v) / (2.0 * DIFFERENCE));
        reference.sample_into(t, &mut knot);
        speed(&knot, &mut v);
        position(&knot, &mut q);
        data.set_state(&q, &v);
        let forces: Vec<(LinkPoint, Vector3<f64>)> =
            robot.contacts.iter().zip(&knot.forces).map(|(c, f)| (c.at, Vector3::from(*f))).collect();
        data.inverse_dynamics_into(&a, &forces, &mut torques);
        found.samples += 1;
        let wrench = torques[..6].iter().fold(0.0_f64, |most, w| most.max(w.abs())) / weight;
        if !(wrench <= found.root_wrench_residual) {
            (found.root_wrench_residual, found.root_wrench_time) = (wrench, t);
        }
        for (j, joint) in robot.joints.iter().enumerate() {
            let (angle, speed, torque) = (q[7 + j], v[6 + j], torques[6 + j]);
            let [least, greatest] = torque_range(joint, speed);
            let slack = ROUNDING * joint.torque;
            found.torque_violations += usize::from(!(least - slack..=greatest + slack).contains(&torque));
            found.speed_violations += usize::from(!(speed.abs() <= joint.speed * (1.0 + ROUNDING)));
            let range = joint.range[0] - ROUNDING..=joint.range[1] + ROUNDING;
            found.joint_violations += usize::from(!range.contains(&angle));
            // At its greatest speed a drive gives nothing; a share of nothing would say nothing.
            let bound = if torque < 0.0 { -least } else { greatest }.max(LEAST_TORQUE * joint.torque);
            note(&mut found.torque_use, &joint.name, torque.abs() / bound);
            note(&mut found.speed_use, &joint.name, speed.abs() / joint.speed);
            if (reference.phases.t_swing..=reference.phases.t_impact).contains(&t) {
                note(&mut found.swing_torque_use, &joint.name, torque.abs() / bound);
                note(&mut found.swing_speed_use, &joint.name, speed.abs() / joint.speed);
            }
        }
        // A point stands between two knots when it does at both.
        let next = (t * reference.rate).ceil() as usize;
        for (p, contact) in robot.contacts.iter().enumerate() {
            let at = data.point(&contact.at);
            let depth = ground.rest(at.x, at.y, contact.radius).0 - at.z;
            let normal = ground.normal(at.x, at.y);
            found.penetration = found.penetration.max(depth);
            let stands = knot.contacts[p] && reference.knots.get(next).is_some_and(|k| k.contacts[p]);
            if stands {
                let anchor = anchors[p].get_or_insert(at);
                let moved = at - *anchor;
                found.stance_slip = found.stance_slip.max((moved - normal * moved.dot(&normal)).norm());
                found.stance_lift = found.stance_lift.max(-depth);
            } else {
                anchors[p] = None;
            }
            if let Some(force) = knot.forces.get(p).copied().map(Vector3::from) {
                let up = force.dot(&normal);
                let across = (force - normal * up).norm();
                let outside = (across - friction * up).max(-up);
                let loose = if stands { 0.0 } else { across.max(up.abs()) };
                found.friction = found.friction.max(outside.max(loose) / weight);
            }
        }
        for &pair in &robot.self_collision {
            found.self_collision = found.self_collision.max(-data.capsule_gap(pair).1);
        }
    }
    found
}

/// Worst of a name.
fn note(map: &mut BTreeMap<String, f64>, name: &str, value: f64) {
    match map.get_mut(name) {
        Some(most) => *most = most.max(value),
        None => {
            map.insert(name.to_owned(), value);
        }
    }
}

/// A knot's speed in the robot's convention (6 + n).
fn speed(knot: &Knot, v: &mut Vec<f64>) {
    v.clear();
    v.extend_from_slice(&knot.base_velocity);
    v.extend_from_slice(&knot.base_angular_velocity);
    v.extend_from_slice(&knot.joint_velocities);
}

/// A knot's position in the robot's convention (7 + n).
fn position(knot: &Knot, q: &mut Vec<f64>) {
    q.clear();
    q.extend_from_slice(&knot.base_position);
    q.extend_from_slice(&knot.base_orientation);
    q.extend_from_slice(&knot.joints);
}
