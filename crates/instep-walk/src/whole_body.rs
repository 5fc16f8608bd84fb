//! The whole-body controller: joint accelerations and contact forces that do all tasks as well as their weights say, within
//! what body, ground and drives allow; a quadratic program in each tick (paper 4, section IV-F-1: a weighted controller).
//!
//! Unknowns: x = [a (nv), f (3 a contact point on the ground)]. Minimised: sum of weight (J a + dJ/dt v - wanted)^2 over
//! motion tasks and weight (row f - wanted)^2 over force tasks. Kept: M a + h = S^T tau + J^T f for the free base exactly,
//! torque limits at the present speed, friction pyramids, joint ranges some time ahead. The torques are tau = M_j a + h_j -
//! J_j^T f. Height and horizontal motion of the centre of mass and yaw momentum are written on f, which saves their Jacobians.
//!
//! When no x keeps all rows, joint ranges are left out; when that does not help either, the answer is the caller's to find
//! ([`Outcome::Unsolved`]). Nothing here plans.

use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::control::torque_range;
use instep_robot::{LinkPoint, Robot, RobotData};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::settings::{Control, GRAVITY, Task};
use crate::swing::Waypoint;
use instep_qp::{Qp, QpSolver, QpStatus};

/// Cost of an acceleration and of a force by themselves: what makes the problem strictly convex.
const REGULAR: [f64; 2] = [1e-5, 1e-6];
/// An acceleration that joint ranges never ask for more than, rad/s^2.
const BRAKE: f64 = 200.0;

/// A foot as walking sees it.
#[derive(Debug, Clone)]
pub struct FootModel {
    /// Which.
    pub side: Side,
    /// Indices into [`Robot::contacts`].
    pub contacts: Vec<usize>,
    /// The middle of the contact points on the ground, in the foot's frame.
    pub reference: LinkPoint,
    /// Half the distance between its foremost and its hindmost contact point, m.
    pub half_length: f64,
    /// Whether it has an ankle roll: else it rolls freely about its line.
    pub rolls: bool,
}

impl FootModel {
    /// The foot on `side`.
    #[must_use]
    pub fn new(robot: &Robot, side: Side) -> Self {
        let data = robot.data();
        let leg = robot.leg(side);
        let contacts: Vec<usize> = (0..robot.contacts.len()).filter(|&c| robot.contacts[c].leg == side).collect();
        let sum: Vector3<f64> = contacts.iter().map(|&c| ground_point(robot, &data, c)).sum();
        let middle = sum / contacts.len().max(1) as f64;
        let local = data.link_matrix(leg.foot).transpose() * (middle - data.link_position(leg.foot));
        let ahead = data.link_matrix(leg.foot).column(0).into_owned();
        let half_length =
            contacts.iter().map(|&c| (ground_point(robot, &data, c) - middle).dot(&ahead).abs()).fold(0.0, f64::max);
        let reference = LinkPoint { link: leg.foot, point: local };
        Self { side, contacts, reference, half_length, rolls: leg.ankle_roll.is_some() }
    }
}

/// The lowest point of contact sphere `contact`, world, m.
#[must_use]
pub fn ground_point(robot: &Robot, data: &RobotData, contact: usize) -> Vector3<f64> {
    let contact = &robot.contacts[contact];
    data.point(&contact.at) - Vector3::new(0.0, 0.0, contact.radius)
}

/// What is wanted in a tick; world frame.
#[derive(Debug, Clone, Copy)]
pub struct Targets {
    /// Which feet are on the ground.
    pub support: [bool; 2],
    /// `world_from_base`.
    pub base: UnitQuaternion<f64>,
    /// Rate of the base about the vertical, rad/s.
    pub turn: f64,
    /// Height of the centre of mass (m) and its rate (m/s).
    pub height: [f64; 2],
    /// Centre of mass over the ground: position, velocity, acceleration; `None` on one foot.
    pub shift: Option<Waypoint>,
    /// The swing foot's reference point, its heading (rad) and the heading's rate (rad/s).
    pub swing: Option<(Side, Waypoint, [f64; 2])>,
    /// Pitch of the swing foot, rad: that of the ground.
    pub swing_pitch: f64,
}

/// How a tick was solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// With all rows.
    Solved,
    /// Without joint ranges.
    Relaxed,
    /// Not at all; the solution is the last one.
    Unsolved,
}

/// The controller and its scratch space.
#[derive(Debug)]
pub struct WholeBody {
    robot: Arc<Robot>,
    settings: Control,
    /// Left, right.
    pub feet: [FootModel; 2],
    qp: Qp,
    solver: QpSolver,
    mass: Vec<f64>,
    bias: Vec<f64>,
    jacobian: Vec<f64>,
    rotation: Vec<f64>,
    /// For each contact point, 3 x nv.
    contact_jacobians: Vec<f64>,
    row: Vec<f64>,
    active: Vec<usize>,
    is_leg: Vec<bool>,
    /// Posture, rad.
    pub posture: Vec<f64>,
    /// Accelerations, nv.
    pub acceleration: Vec<f64>,
    /// Force on each contact point, N, world; zero where it is not on the ground.
    pub forces: Vec<Vector3<f64>>,
    /// Joint torques, N m.
    pub torques: Vec<f64>,
    /// Unknowns, rows and changes of the active rows in the last problem.
    pub size: [usize; 3],
}

impl WholeBody {
    /// For `robot`.
    #[must_use]
    pub fn new(robot: Arc<Robot>, settings: Control) -> Self {
        let (nv, joints, points) = (robot.nv(), robot.joints.len(), robot.contacts.len());
        let mut is_leg = vec![false; joints];
        robot.legs.iter().flat_map(|leg| leg.joints()).for_each(|joint| is_leg[joint] = true);
        let (n, m) = (nv + 3 * points, 6 + 2 * joints + 5 * points);
        Self {
            feet: [FootModel::new(&robot, Side::Left), FootModel::new(&robot, Side::Right)],
            settings,
            qp: Qp::with_capacity(n, m),
            solver: QpSolver::with_capacity(n, m),
            mass: vec![0.0; nv * nv],
            bias: vec![0.0; nv],
            jacobian: vec![0.0; 3 * nv],
            rotation: vec![0.0; 3 * nv],
            contact_jacobians: vec![0.0; 3 * nv * points],
            row: vec![0.0; nv.max(3 * points)],
            active: Vec::with_capacity(points),
            is_leg,
            posture: robot.stand[7..].to_vec(),
            acceleration: vec![0.0; nv],
            forces: vec![Vector3::zeros(); points],
            torques: vec![0.0; joints],
            size: [0; 3],
            robot,
        }
    }

    /// Solves for `targets` in the state that was set in `data`.
    pub fn solve(&mut self, data: &mut RobotData, targets: &Targets) -> Outcome {
        let (nv, joints) = (self.robot.nv(), self.robot.joints.len());
        data.mass_matrix_into(&mut self.mass);
        data.bias_into(&mut self.bias);
        self.active.clear();
        for foot in self.feet.iter().filter(|foot| targets.support[foot.side as usize]) {
            self.active.extend_from_slice(&foot.contacts);
        }
        let points = self.active.len();
        self.qp.reset(nv + 3 * points);
        for i in 0..nv {
            self.qp.add_cost_at(REGULAR[0], i, 0.0);
        }
        for i in nv..nv + 3 * points {
            self.qp.add_cost_at(REGULAR[1], i, 0.0);
        }
        self.stance(data);
        self.base(data, targets);
        self.forces(data, targets);
        self.swing(data, targets);
        self.posture(data);
        self.dynamics(data);
        self.friction();
        let ranges = self.qp.rows();
        self.ranges(data);

        let mut status = self.solver.solve(&self.qp);
        let mut outcome = Outcome::Solved;
        if status == QpStatus::Infeasible {
            self.qp.truncate(ranges);
            status = self.solver.solve(&self.qp);
            outcome = Outcome::Relaxed;
        }
        self.size = [self.qp.len(), self.qp.rows(), self.solver.iterations];
        if status != QpStatus::Optimal {
            return Outcome::Unsolved;
        }
        self.acceleration.copy_from_slice(&self.solver.x[..nv]);
        self.forces.fill(Vector3::zeros());
        for (k, &contact) in self.active.iter().enumerate() {
            self.forces[contact] = Vector3::from_column_slice(&self.solver.x[nv + 3 * k..nv + 3 * k + 3]);
        }
        for j in 0..joints {
            let row = 6 + j;
            let inertial: f64 =
                self.mass[row * nv..(row + 1) * nv].iter().zip(&self.acceleration).map(|(m, a)| m * a).sum();
            let mut ground = 0.0;
            for (k, &contact) in self.active.iter().enumerate() {
                let force = self.forces[contact];
                let at = |axis: usize| self.contact_jacobians[(3 * k + axis) * nv + row];
                ground += at(0) * force.x + at(1) * force.y + at(2) * force.z;
            }
            self.torques[j] = inertial + self.bias[row] - ground;
        }
        outcome
    }

    /// Contact points on the ground keep their place: damped, a cost and not a constraint.
    fn stance(&mut self, data: &mut RobotData) {
        let nv = self.robot.nv();
        let Task { weight, kd, .. } = self.settings.stance;
        for k in 0..self.active.len() {
            let contact = self.active[k];
            let link = self.robot.contacts[contact].at.link;
            let at = ground_point(&self.robot, data, contact);
            let jacobian = &mut self.contact_jacobians[3 * k * nv..3 * (k + 1) * nv];
            data.point_jacobian_into(link, &at, jacobian);
            let [drift, _] = data.drift(link, &at);
            for axis in 0..3 {
                let row = &jacobian[axis * nv..(axis + 1) * nv];
                let speed: f64 = row.iter().zip(data.v()).map(|(j, v)| j * v).sum();
                self.qp.add_cost(weight, 0, row, -kd * speed - drift[axis]);
            }
        }
    }

    fn base(&mut self, data: &mut RobotData, targets: &Targets) {
        let nv = self.robot.nv();
        let link = self.robot.base;
        data.rotation_jacobian_into(link, &mut self.rotation);
        let [_, drift] = data.drift(link, &data.link_position(link));
        let error = (targets.base * data.link_rotation(link).inverse()).scaled_axis();
        let rate = rate(&self.rotation, data.v());
        let wanted = Vector3::new(0.0, 0.0, targets.turn);
        for axis in 0..3 {
            let task = if axis == 2 { self.settings.base_yaw } else { self.settings.base };
            let target = task.kp * error[axis] + task.kd * (wanted[axis] - rate[axis]) - drift[axis];
            self.qp.add_cost(task.weight, 0, &self.rotation[axis * nv..(axis + 1) * nv], target);
        }
    }

    /// Tasks on the contact forces: height, shift of the weight, moment about the contact, yaw momentum.
    fn forces(&mut self, data: &mut RobotData, targets: &Targets) {
        let nv = self.robot.nv();
        let points = self.active.len();
        let mass = self.robot.mass();
        let momentum = data.momentum();
        let com = data.com();
        let velocity = Vector3::new(momentum[0], momentum[1], momentum[2]) / mass;
        let along = |qp: &mut Qp, row: &mut [f64], weight: f64, axis: usize, target: f64| {
            let row = &mut row[..3 * points];
            row.fill(0.0);
            row.iter_mut().skip(axis).step_by(3).for_each(|entry| *entry = 1.0 / mass);
            qp.add_cost(weight, nv, row, target);
        };
        let task = self.settings.height;
        let target = GRAVITY + task.kp * (targets.height[0] - com.z) + task.kd * (targets.height[1] - velocity.z);
        along(&mut self.qp, &mut self.row, task.weight, 2, target);
        if let Some(shift) = &targets.shift {
            let task = self.settings.shift;
            for axis in 0..2 {
                let target = shift.acceleration[axis]
                    + task.kp * (shift.position[axis] - com[axis])
                    + task.kd * (shift.velocity[axis] - velocity[axis]);
                along(&mut self.qp, &mut self.row, task.weight, axis, target);
            }
        } else if let Some(foot) = self.feet.iter().find(|foot| targets.support[foot.side as usize]) {
            // (r x f) . e = f . (e x r): about the lateral axis; with an ankle roll about the forward axis, too.
            let about = data.point(&foot.reference);
            let ahead = data.link_matrix(foot.reference.link).column(0).into_owned();
            let forward = Vector3::new(ahead.x, ahead.y, 0.0).normalize();
            let lateral = Vector3::z().cross(&forward);
            for axis in [Some(lateral), foot.rolls.then_some(forward)].into_iter().flatten() {
                for (entries, &contact) in self.row[..3 * points].chunks_exact_mut(3).zip(&self.active) {
                    let arm = ground_point(&self.robot, data, contact) - about;
                    entries.copy_from_slice(axis.cross(&arm).as_slice());
                }
                self.qp.add_cost(self.settings.moment, nv, &self.row[..3 * points], 0.0);
            }
        }
        let task = self.settings.yaw_momentum;
        for (entries, &contact) in self.row[..3 * points].chunks_exact_mut(3).zip(&self.active) {
            let arm = ground_point(&self.robot, data, contact) - com;
            entries.copy_from_slice(Vector3::z().cross(&arm).as_slice());
        }
        self.qp.add_cost(task.weight, nv, &self.row[..3 * points], -task.kd * momentum[5]);
    }

    fn swing(&mut self, data: &mut RobotData, targets: &Targets) {
        let Some((side, way, [heading, turn])) = &targets.swing else { return };
        let nv = self.robot.nv();
        let foot = &self.feet[*side as usize];
        let link = foot.reference.link;
        let at = data.point(&foot.reference);
        let [drift, turn_drift] = data.drift(link, &at);
        data.point_jacobian_into(link, &at, &mut self.jacobian);
        data.rotation_jacobian_into(link, &mut self.rotation);
        let Task { weight, kp, kd } = self.settings.swing;
        let velocity = rate(&self.jacobian, data.v());
        let wanted = way.acceleration + (way.position - at) * kp + (way.velocity - velocity) * kd - drift;
        for axis in 0..3 {
            self.qp.add_cost(weight, 0, &self.jacobian[axis * nv..(axis + 1) * nv], wanted[axis]);
        }
        // Pitch and heading; with an ankle roll all three axes. Roll is free for a foot that rolls about its line.
        let level = UnitQuaternion::from_euler_angles(0.0, targets.swing_pitch, *heading);
        let error = (level * data.link_rotation(link).inverse()).scaled_axis();
        let rate = rate(&self.rotation, data.v());
        let Task { weight, kp, kd } = self.settings.swing_turn;
        let wanted = error * kp + (Vector3::z() * *turn - rate) * kd - turn_drift;
        let axes: Matrix3<f64> = level.to_rotation_matrix().into_inner();
        for axis in [axes.column(1), axes.column(2), axes.column(0)].iter().take(if foot.rolls { 3 } else { 2 }) {
            let row = &mut self.row[..nv];
            for (j, entry) in row.iter_mut().enumerate() {
                let at = |k: usize| self.rotation[k * nv + j];
                *entry = axis[0] * at(0) + axis[1] * at(1) + axis[2] * at(2);
            }
            self.qp.add_cost(weight, 0, row, axis.dot(&wanted));
        }
    }

    fn posture(&mut self, data: &RobotData) {
        for (j, &wanted) in self.posture.iter().enumerate() {
            let task = if self.is_leg[j] { self.settings.legs } else { self.settings.arms };
            let target = task.kp * (wanted - data.q()[7 + j]) - task.kd * data.v()[6 + j];
            self.qp.add_cost_at(task.weight, 6 + j, target);
        }
    }

    /// The free base's six equations, and the torques within their limits.
    fn dynamics(&mut self, data: &RobotData) {
        let nv = self.robot.nv();
        for i in 0..nv {
            let [lower, upper] = match i.checked_sub(6) {
                None => [-self.bias[i]; 2],
                Some(j) => {
                    let range = torque_range(&self.robot.joints[j], data.v()[i]);
                    range.map(|torque| torque * self.settings.torque_share - self.bias[i])
                }
            };
            let row = self.qp.add_row(lower, upper);
            row[..nv].copy_from_slice(&self.mass[i * nv..(i + 1) * nv]);
            for (k, entry) in row[nv..].iter_mut().enumerate() {
                *entry = -self.contact_jacobians[k * nv + i];
            }
        }
    }

    /// A pyramid inside the friction cone, and no more than a foot is to bear.
    fn friction(&mut self) {
        let nv = self.robot.nv();
        let slide = self.settings.friction * std::f64::consts::FRAC_1_SQRT_2;
        let most = self.settings.largest_force * self.robot.mass() * GRAVITY;
        for k in 0..self.active.len() {
            let at = nv + 3 * k;
            self.qp.add_row(0.0, most)[at + 2] = 1.0;
            for axis in 0..2 {
                for sign in [1.0, -1.0] {
                    let row = self.qp.add_row(0.0, f64::INFINITY);
                    (row[at + axis], row[at + 2]) = (sign, slide);
                }
            }
        }
    }

    /// Joints that would leave their range soon are braked.
    fn ranges(&mut self, data: &RobotData) {
        let ahead = self.settings.look_ahead;
        let scale = 2.0 / (ahead * ahead);
        for (j, joint) in self.robot.joints.iter().enumerate() {
            let after = data.q()[7 + j] + data.v()[6 + j] * ahead;
            let lower = ((joint.range[0] - after) * scale).min(BRAKE);
            let upper = ((joint.range[1] - after) * scale).max(-BRAKE);
            if lower > -BRAKE || upper < BRAKE {
                self.qp.add_row(lower, upper.max(lower))[6 + j] = 1.0;
            }
        }
    }
}

/// J v.
fn rate(jacobian: &[f64], v: &[f64]) -> Vector3<f64> {
    let nv = v.len();
    let row = |i: usize| jacobian[i * nv..(i + 1) * nv].iter().zip(v).map(|(j, v)| j * v).sum();
    Vector3::new(row(0), row(1), row(2))
}
