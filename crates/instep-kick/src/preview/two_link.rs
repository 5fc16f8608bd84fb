//! The centre of mass by a two-link arm in the frontal and the sagittal plane: paper 5, section 4, equations (8) to (11).
//!
//! In each plane the first link goes from the support ankle to the hip, the second from the hip to the centre of mass;
//! roll (pitch) of ankle and hip are the arm's joints. With the wanted point at distance r and bearing phi from the ankle
//! and the links' lengths l1, l2, the law of cosines gives the angles. The rest of the robot counts as fixed to the second
//! link, which is the approximation: the swing leg moves with it, and what a turn in one plane does to the other is left
//! out. How far the knee is bent follows from the base's height, which the paper leaves open.
//!
//! Its error, measured on NAO (tests/it/preview.rs): one solution for the way from the stand to the support foot, 5 cm,
//! misses by 4.7 mm; solved anew in each tick of a kick, it is 0.1 mm (RMS) and 1.4 mm at most. The inverse kinematics of
//! the whole body, [`instep_robot::ik`], which the engine uses unless told otherwise, misses by less than 0.01 mm.
//!
//! The paper's slips: (8) prints r without squares. In (9) and (11) alpha - pi and alpha + pi are the same angle, and
//! theta_2 = alpha - pi does not go with theta_1 = phi - beta. The two solutions of the arm are
//! (phi - beta, pi - alpha) and (phi + beta, alpha - pi); the hip is outside of the support foot in the first for a right
//! kick and in the second for a left one.

use instep_motion::phase::Side;
use instep_robot::{LinkPoint, Robot};
use nalgebra::{Matrix3, Vector2, Vector3};

use crate::KickError;
use crate::whole_body::body::{Body, ankle_roll};
use instep_robot::ik::{Goals, Ik, Residual};
use instep_robot::tree::{Tree, TreePose};

/// Largest turn of a joint in one step, rad.
const STEP: f64 = 0.3;

/// Steps of the swing leg's inverse kinematics for one of the arm: a step that was too long is tried again, shorter.
const LEG_STEPS: usize = 3;

/// Angles (theta_1, theta_2) of an arm of lengths `l1` and `l2` (m) whose end is at `at` (m) from its foot, the second
/// link bent from the first by theta_2, positive from the plane's first axis toward its second where `bend` is positive.
/// A point out of reach is replaced by the nearest on its bearing.
#[must_use]
pub fn arm(l1: f64, l2: f64, at: Vector2<f64>, bend: f64) -> [f64; 2] {
    // (8), with the squares that are missing in print.
    let r = at.norm().clamp((l1 - l2).abs() + 1e-9, l1 + l2 - 1e-9);
    // (9) and (10).
    let alpha = ((l1 * l1 + l2 * l2 - r * r) / (2.0 * l1 * l2)).clamp(-1.0, 1.0).acos();
    let beta = ((r * r + l1 * l1 - l2 * l2) / (2.0 * l1 * r)).clamp(-1.0, 1.0).acos();
    // (11).
    let phi = at.y.atan2(at.x);
    let sign = 1.0_f64.copysign(bend);
    [phi - sign * beta, sign * (std::f64::consts::PI - alpha)]
}

/// The support leg's part in it.
#[derive(Debug, Clone, Copy)]
struct Support {
    sole: LinkPoint,
    /// Ankle and hip.
    roll: [usize; 2],
    pitch: [usize; 2],
    knee: usize,
}

/// The two-link placement of the centre of mass, with inverse kinematics of the swing leg alone.
#[derive(Debug, Clone)]
pub(crate) struct TwoLink {
    /// For a left and a right swing leg.
    legs: [Ik; 2],
    supports: [Support; 2],
    ranges: Vec<[f64; 2]>,
}

fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

impl TwoLink {
    /// As [`Ik::new`].
    ///
    /// # Errors
    /// As [`Ik::new`].
    pub(crate) fn new(body: &Body, coupled: &[[String; 2]], margin: f64, bend: f64) -> Result<Self, KickError> {
        let robot: &Robot = &body.robot;
        let leg = |side| Ik::of_leg(robot, coupled, margin, bend, side);
        let support = |side| -> Result<Support, KickError> {
            let leg = robot.leg(side);
            let (roll, pitch) = ([ankle_roll(robot, side)?, leg.hip_roll], [leg.ankle_pitch, leg.hip_pitch]);
            Ok(Support { sole: leg.sole, roll, pitch, knee: leg.knee })
        };
        let ranges = robot.joints.iter().map(|joint| [joint.range[0] + margin, joint.range[1] - margin]).collect();
        Ok(Self {
            legs: [leg(Side::Left)?, leg(Side::Right)?],
            supports: [support(Side::Left)?, support(Side::Right)?],
            ranges,
        })
    }

    /// Turns the support leg's two joints of one plane; `axes` are the plane's axes in the support sole's frame.
    fn plane(
        &self,
        turn: &Matrix3<f64>,
        pose: &TreePose,
        angles: &mut [f64],
        ([ankle, hip], com): ([usize; 2], Vector3<f64>),
        (axes, target, bend): ([Vector3<f64>; 2], Vector2<f64>, Option<f64>),
    ) {
        let flat = |p: &Vector3<f64>| {
            let level = turn * p;
            Vector2::new(level.dot(&axes[0]), level.dot(&axes[1]))
        };
        let (a, h, c) = (flat(&pose.anchor[ankle]), flat(&pose.anchor[hip]), flat(&com));
        let (first, second) = (h - a, c - h);
        let theta_1 = first.y.atan2(first.x);
        let theta_2 = wrap(second.y.atan2(second.x) - theta_1);
        let wanted = arm(first.norm(), second.norm(), target - a, bend.unwrap_or(theta_2));
        let normal = axes[0].cross(&axes[1]);
        for (joint, by) in [(ankle, wrap(wanted[0] - theta_1)), (hip, wrap(wanted[1] - theta_2))] {
            // The foot stands still: what is above a joint turns against it.
            let along = (turn * pose.axis[joint]).dot(&normal);
            if along.abs() > 0.1 && by.is_finite() {
                let [low, high] = self.ranges[joint];
                angles[joint] = (angles[joint] - (by / along).clamp(-STEP, STEP)).clamp(low, high);
            }
        }
    }

    /// Bends the support knee toward the base's wanted height, hip and ankle pitch half against it: the arm's first link
    /// gets its length so, and the arm need not lean the body to lower it.
    fn crouch(&self, turn: &Matrix3<f64>, pose: &TreePose, angles: &mut [f64], support: &Support, height: f64) {
        let ([ankle, hip], knee) = (support.pitch, support.knee);
        let (a, k, h) = (pose.anchor[ankle], pose.anchor[knee], pose.anchor[hip]);
        let up = |p: Vector3<f64>| (turn * p).z;
        let rise = height + up(pose.point(&support.sole));
        let (shank, thigh, length) = ((k - a).norm(), (h - k).norm(), (h - a).norm());
        // How the length changes with the knee's angle, by the law of cosines.
        let slope = -shank * thigh * angles[knee].sin() / length;
        if slope.abs() > 1e-3 && rise.is_finite() {
            let [low, high] = self.ranges[knee];
            let bent = (angles[knee] + (rise / slope).clamp(-STEP, STEP)).clamp(low, high);
            let by = bent - angles[knee];
            angles[knee] = bent;
            for joint in [ankle, hip] {
                let along = (turn * pose.axis[joint]).dot(&(turn * pose.axis[knee]));
                angles[joint] -= 0.5 * by * along.signum();
            }
        }
    }

    /// As [`Ik::solve`], `steps` times knee, frontal plane, sagittal plane and swing leg.
    pub(crate) fn solve(
        &mut self,
        tree: &Tree,
        pose: &mut TreePose,
        angles: &mut [f64],
        swing: Side,
        goals: &Goals,
        steps: usize,
    ) -> Residual {
        let support = self.supports[swing.other() as usize];
        let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
        // The hip is outside of the support foot: bent toward the swing side.
        let outside = -Body::sign(swing);
        let mut residual = Residual::default();
        tree.update(angles, pose);
        for _ in 0..steps.max(1) {
            let turn = pose.rotation[support.sole.link].transpose();
            self.crouch(&turn, pose, angles, &support, goals.height);
            tree.update(angles, pose);
            for (joints, side, forward, bend) in
                [(support.roll, y, goals.balance[1], Some(outside)), (support.pitch, x, goals.balance[0], None)]
            {
                let turn = pose.rotation[support.sole.link].transpose();
                let (com, sole) = (turn * tree.com(pose), turn * pose.point(&support.sole));
                // The centre of mass is kept on its plane, wherever the knees have put that.
                let target = Vector2::new(forward + sole.dot(&side), com.z);
                self.plane(&turn, pose, angles, (joints, tree.com(pose)), ([side, z], target, bend));
                tree.update(angles, pose);
            }
            residual = self.legs[swing as usize].solve(tree, pose, angles, swing, goals, LEG_STEPS);
        }
        residual
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_solutions_of_the_arm_reach_their_point() {
        for (l1, l2) in [(0.2_f64, 0.06_f64), (0.1, 0.3), (0.2, 0.2)] {
            for angle in [-0.6, 0.4, 1.2, 2.5] {
                for share in [0.1, 0.5, 0.9] {
                    let r = (l1 - l2).abs() + share * (l1 + l2 - (l1 - l2).abs());
                    let at = Vector2::new(r * f64::cos(angle), r * f64::sin(angle));
                    for bend in [1.0, -1.0] {
                        let [t1, t2] = arm(l1, l2, at, bend);
                        let hip = Vector2::new(l1 * t1.cos(), l1 * t1.sin());
                        let end = hip + Vector2::new(l2 * (t1 + t2).cos(), l2 * (t1 + t2).sin());
                        assert!((end - at).norm() < 1e-9 && t2 * bend >= 0.0);
                    }
                }
            }
        }
    }

    #[test]
    fn a_point_out_of_reach_gives_a_straight_arm_on_its_bearing() {
        let [t1, t2] = arm(0.2, 0.1, Vector2::new(1.0, 1.0), 1.0);
        assert!((t1 - std::f64::consts::FRAC_PI_4).abs() < 1e-3 && t2.abs() < 1e-3);
    }
}
