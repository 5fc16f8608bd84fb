//! A standing pose: knees bent by a given angle, soles level and as far apart as with straight legs, the centre of mass over their
//! middle, arms hanging without touching anything.
//!
//! Gauss-Newton with damping and differences (Nocedal and Wright, Numerical Optimization, 10.3) over the ten joints of both legs but the
//! knees. Not done: whether the world stays up in it, which is a question for the world.

use std::sync::Arc;

use mujoco_rs::prelude::*;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::collide::Pairs;
use crate::{Leg, Robot};

/// Kept from every joint limit, rad.
const MARGIN: f64 = 0.02;
/// Largest slope of a sole that a stand has, rad, and largest distance of the centre of mass from over the soles' middle, m.
const LEVEL: [f64; 2] = [0.005, 0.003];

/// A robot's pose in the making.
pub(super) struct Poser {
    data: MjData<Arc<MjModel>>,
    model: Arc<MjModel>,
}

impl Poser {
    pub(super) fn new(model: &Arc<MjModel>) -> Self {
        Self { data: MjData::new(Arc::clone(model)), model: Arc::clone(model) }
    }

    /// Takes up joint angles `q` (rad), the base at the origin.
    pub(super) fn pose(&mut self, q: &[f64]) {
        let qpos = self.data.qpos_mut();
        qpos[..7].copy_from_slice(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        qpos[7..].copy_from_slice(q);
        self.data.kinematics();
        self.data.com_pos();
    }

    fn com(&self) -> Vector3<f64> {
        Vector3::from(self.data.subtree_com()[1])
    }

    fn turn(&self, link: usize) -> Matrix3<f64> {
        Matrix3::from_row_slice(&self.data.xmat()[link])
    }

    fn sole(&self, leg: &Leg) -> Vector3<f64> {
        Vector3::from(self.data.xpos()[leg.foot]) + self.turn(leg.foot) * leg.sole.point
    }

    pub(super) fn capsule(&self, geom: usize) -> ([Vector3<f64>; 2], f64) {
        let centre = Vector3::from(self.data.geom_xpos()[geom]);
        let [radius, half, _] = self.model.geom_size()[geom];
        let half = if self.model.geom_type()[geom] == MjtGeomBase::mjGEOM_CAPSULE { half } else { 0.0 };
        let axis = Matrix3::from_row_slice(&self.data.geom_xmat()[geom]).column(2) * half;
        ([centre - axis, centre + axis], radius)
    }
}

/// Joint angles with which `robot`'s knees are bent by `bend` (rad); `None` where there is no such pose. `from` are angles of all joints
/// that the arms and the rest of the body keep.
pub(super) fn stand(robot: &Robot, from: &[f64], bend: f64) -> Option<Vec<f64>> {
    let mut poser = Poser::new(robot.model());
    poser.pose(&vec![0.0; from.len()]);
    let apart: Vec<f64> = robot.legs.iter().map(|leg| poser.sole(leg).y).collect();
    let mut q = from.to_vec();
    let mut free = Vec::new();
    for leg in &robot.legs {
        // A knee that turns about +y bends by positive angles.
        let axis = robot.model().jnt_axis()[leg.knee + 1];
        let knee = &robot.joints[leg.knee];
        let angle = bend.copysign(axis[1]);
        if !(knee.range[0] + MARGIN..=knee.range[1] - MARGIN).contains(&angle) {
            return None;
        }
        q[leg.knee] = angle;
        let half = |joint: usize| 0.5 * bend.copysign(robot.model().jnt_axis()[joint + 1][1]);
        (q[leg.hip_pitch], q[leg.ankle_pitch]) = (-half(leg.hip_pitch), -half(leg.ankle_pitch));
        free.extend([leg.hip_yaw, leg.hip_roll, leg.hip_pitch, leg.ankle_pitch]);
        free.extend(leg.ankle_roll);
    }
    let clamp = |joint: usize, angle: f64| {
        let [low, high] = robot.joints[joint].range;
        angle.clamp(low + MARGIN.min(0.25 * (high - low)), high - MARGIN.min(0.25 * (high - low)))
    };
    for &joint in &free {
        q[joint] = clamp(joint, q[joint]);
    }
    let residual = |poser: &mut Poser, q: &[f64]| {
        poser.pose(q);
        let com = poser.com();
        let mut r = Vec::with_capacity(11);
        let soles: Vec<Vector3<f64>> = robot.legs.iter().map(|leg| poser.sole(leg)).collect();
        for (side, leg) in robot.legs.iter().enumerate() {
            let turn = poser.turn(leg.foot);
            let rolls = if leg.ankle_roll.is_some() { 1.0 } else { 0.3 };
            r.extend([turn[(1, 0)], -turn[(2, 0)], rolls * turn[(2, 1)]]);
            r.push(0.3 * (soles[side].y - apart[side]));
            r.push(soles[side].x - com.x);
        }
        r.push(soles[0].z - soles[1].z);
        DVector::from_vec(r)
    };
    let mut r = residual(&mut poser, &q);
    for _ in 0..60 {
        let mut jacobian = DMatrix::zeros(r.len(), free.len());
        for (column, &joint) in free.iter().enumerate() {
            let mut moved = q.clone();
            moved[joint] += 1e-6;
            jacobian.set_column(column, &((residual(&mut poser, &moved) - &r) / 1e-6));
        }
        let normal = jacobian.transpose() * &jacobian + DMatrix::identity(free.len(), free.len()) * 1e-6;
        let Some(step) = normal.cholesky().map(|factor| factor.solve(&(-(jacobian.transpose() * &r)))) else { break };
        for (&joint, step) in free.iter().zip(step.iter()) {
            q[joint] = clamp(joint, q[joint] + step.clamp(-0.2, 0.2));
        }
        let before = r.norm();
        r = residual(&mut poser, &q);
        if (before - r.norm()).abs() < 1e-12 {
            break;
        }
    }
    let [slope, shift] = LEVEL;
    let good = (0..2).all(|side| {
        let r = &r.as_slice()[5 * side..];
        let rolls = robot.legs[side].ankle_roll.is_none() || r[2].abs() < slope;
        r[1].abs() < slope && rolls && r[4].abs() < shift
    });
    (good && r[10].abs() < 0.002).then_some(q)
}

/// Sets the arms' joints (by side, from the shoulder) so that the hands hang as low as they can without coming nearer than `gap` (m) to
/// anything.
pub(super) fn hang_arms(robot: &Robot, arms: &[Vec<usize>; 2], pairs: &Pairs, gap: f64, q: &mut [f64]) {
    const STEPS: usize = 7;
    let mut poser = Poser::new(robot.model());
    for arm in arms {
        // The first three joints place the elbow; the others keep their angle.
        let joints: Vec<usize> = arm.iter().copied().take(3).collect();
        let Some(&last) = arm.last() else { continue };
        let hand = usize::try_from(robot.model().jnt_bodyid()[last + 1]).unwrap_or(0);
        let grid: Vec<Vec<f64>> = joints
            .iter()
            .map(|&joint| {
                let [low, high] = robot.joints[joint].range.map(|angle| angle.clamp(-1.7, 1.7));
                let mut angles: Vec<f64> =
                    (0..STEPS).map(|i| low + (high - low) * (i as f64 + 0.5) / STEPS as f64).collect();
                angles.push(q[joint]);
                angles
            })
            .collect();
        let mut best = (f64::INFINITY, q.to_vec());
        let count: usize = grid.iter().map(Vec::len).product();
        for mut at in 0..count {
            let mut tried = q.to_vec();
            let mut effort = 0.0;
            for (&joint, angles) in joints.iter().zip(&grid) {
                tried[joint] = angles[at % angles.len()];
                effort += tried[joint] * tried[joint];
                at /= angles.len();
            }
            poser.pose(&tried);
            // The whole arm's weight, low; of two that hang alike the one with the smaller angles.
            let weight = poser.data.subtree_com()[hand];
            let height = weight[2] + 0.3 * weight[0].abs() * f64::from(u8::from(weight[0] < 0.0)) + 0.002 * effort;
            if height < best.0 && pairs.least_gap(&poser) > gap {
                best = (height, tried);
            }
        }
        if best.0.is_finite() {
            q.copy_from_slice(&best.1);
        }
    }
}
