//! Inverse kinematics of a whole clip as one least-squares problem, solved by Levenberg and Marquardt's method.
//!
//! Source: paper 1, equation (3) with the constraints (11)-(14) and (16) as in its kinematics-only stage (after
//! HumanMimic, reference 24 there). Unknowns are the robot's positions q_k at every frame k. The cost sums, weighted,
//!
//! - the distance of each keypoint from its target (3), and the turn of pelvis, chest, soles and toes away from theirs;
//! - the acceleration q_{k+1} - 2 q_k + q_{k-1} of base and joints: smoothness in time;
//! - for a contact point that stands: its distance from its anchor, the mean place over its whole stance, on the
//!   ground (11), (12). An anchor instead of differences between neighbours keeps errors from adding up;
//! - depth below the ground (13), or below the clearance of a swinging foot, and overlap of capsules (14), one-sided;
//! - a slight pull to the standing pose, for joints that nothing else sees.
//!
//! Joint limits (16) are exact: a joint at its limit that would go on is taken out of the step (projected
//! Gauss-Newton, Bertsekas 1982). The Hessian is banded, two frames wide; see [`crate::banded`]. The first guess
//! solves frame after frame from the one before; after that, stretches that no longer move are left alone.

use std::ops::Range;

use instep_robot::{LinkPoint, Robot, RobotData};
use nalgebra::{UnitQuaternion, Vector3};

use crate::RetargetError;
use crate::banded::Banded;
use crate::kinematic::Weights;
use crate::rescale::{Target, Targets};
use crate::stance::Stance;

/// Gauss-Newton steps for a frame of the first guess; the first frame gets more.
const GUESS_STEPS: usize = 3;
const FIRST_FRAME_STEPS: usize = 40;
/// A frame that went less far than this (rad, m) in an iteration is left alone in the next.
const STILL: f64 = 2e-3;
/// Frames beside one that still moves which are solved with it.
const WINDOW_MARGIN: usize = 4;
/// Damping values that are tried for a step before the cost counts as lowest.
const DAMPING_TRIES: usize = 6;
/// Damping that every direction has, for those that nothing sees.
const LEAST_DAMPING: f64 = 1e-6;
/// Gap that capsules should keep, m.
const CLEARANCE: f64 = 0.005;

/// A position task with what it needs at every evaluation.
struct PointTask {
    at: LinkPoint,
    weight: f64,
    dofs: Vec<usize>,
}

/// A rotation task: which target it reads and which link follows it.
struct TurnTask {
    link: usize,
    weight: f64,
    dofs: Vec<usize>,
    target: Turn,
}

/// Reads a rotation out of a frame's target.
type Turn = fn(&Target) -> UnitQuaternion<f64>;

/// Least-squares terms of one frame or of all.
pub(crate) struct ClipIk<'a> {
    robot: &'a Robot,
    data: RobotData,
    targets: &'a Targets,
    weights: &'a Weights,
    points: Vec<PointTask>,
    turns: Vec<TurnTask>,
    contacts: Vec<PointTask>,
    pub anchors: Vec<Stance>,
    /// For each frame, the anchors that hold then.
    held: Vec<Vec<usize>>,
    /// For each frame, the height that points of the left and the right foot keep while they do not stand, m.
    clearance: Vec<[f64; 2]>,
    jacobian: Vec<f64>,
    second: Vec<f64>,
    difference: [Vec<f64>; 2],
}

/// The normal equations of a Gauss-Newton step.
struct System {
    matrix: Banded,
    gradient: Vec<f64>,
    nv: usize,
}

impl System {
    /// Empty equations for frames of `nv` unknowns, each coupled to the next two.
    fn new(nv: usize) -> Self {
        Self { matrix: Banded::zeros(0, 3 * nv - 1), gradient: Vec::new(), nv }
    }

    /// Zero equations for `frames` frames.
    fn clear(&mut self, frames: usize) {
        self.matrix.resize(frames * self.nv);
        self.gradient.clear();
        self.gradient.resize(frames * self.nv, 0.0);
    }

    /// Adds `weight` J^T J and `weight` J^T r of a residual with `rows` rows for the frame that starts at `offset`.
    fn add(&mut self, offset: usize, jacobian: &[f64], residual: &[f64], weight: f64, dofs: &[usize]) {
        for (row, r) in residual.iter().enumerate() {
            let j = &jacobian[row * self.nv..(row + 1) * self.nv];
            for (a, &column) in dofs.iter().enumerate() {
                let scaled = weight * j[column];
                if scaled == 0.0 {
                    continue;
                }
                self.gradient[offset + column] += scaled * r;
                let target = self.matrix.column_mut(offset + column);
                for &below in &dofs[a..] {
                    target[below - column] += scaled * j[below];
                }
            }
        }
    }
}

/// What is kept between iterations, one entry a frame.
pub(crate) struct State {
    systems: [System; 2],
    damping: Vec<f64>,
    /// How far each frame went in the last iteration, rad or m.
    pub moved: Vec<f64>,
}

impl State {
    pub(crate) fn new(frames: usize, nv: usize) -> Self {
        let systems = [System::new(nv), System::new(nv)];
        Self { systems, damping: vec![1e-4; frames], moved: vec![f64::INFINITY; frames] }
    }
}

impl<'a> ClipIk<'a> {
    pub(crate) fn new(
        robot: &'a Robot,
        targets: &'a Targets,
        weights: &'a Weights,
        anchors: Vec<Stance>,
        clearance: Vec<[f64; 2]>,
    ) -> Self {
        let mut data = robot.data();
        // A pose without symmetry, in which every joint that can move a point does.
        let mut generic = robot.stand.clone();
        for (i, joint) in robot.joints.iter().enumerate() {
            generic[7 + i] =
                joint.range[0] + (joint.range[1] - joint.range[0]) * (0.3 + 0.4 * ((i * 7 % 11) as f64 / 11.0));
        }
        data.set_position(&generic);
        let nv = robot.nv();
        let mut jacobian = vec![0.0; 3 * nv];
        let mut dofs_of = |link: usize, point: Option<Vector3<f64>>| -> Vec<usize> {
            match point {
                Some(point) => {
                    let world = data.point(&LinkPoint { link, point });
                    data.point_jacobian_into(link, &world, &mut jacobian);
                }
                None => data.rotation_jacobian_into(link, &mut jacobian),
            }
            (0..nv).filter(|&j| (0..3).any(|row| jacobian[row * nv + j].abs() > 1e-12)).collect()
        };
        let task = |at: LinkPoint, weight: f64, dofs: Vec<usize>| PointTask { at, weight, dofs };
        let points = targets
            .keypoints
            .iter()
            .map(|k| task(k.at, weights.of(k.landmark), dofs_of(k.at.link, Some(k.at.point))))
            .collect();
        let contacts =
            robot.contacts.iter().map(|c| task(c.at, weights.contact, dofs_of(c.at.link, Some(c.at.point)))).collect();
        let chest = targets
            .keypoints
            .iter()
            .find(|k| k.landmark == instep_motion::landmark::Landmark::Chest)
            .map_or(robot.base, |k| k.at.link);
        let mut turns: Vec<(usize, f64, Turn)> = vec![
            (robot.base, weights.pelvis_turn, |t| t.pelvis),
            (chest, weights.chest_turn, |t| t.chest),
            (robot.legs[0].foot, weights.sole_turn, |t| t.soles[0]),
            (robot.legs[1].foot, weights.sole_turn, |t| t.soles[1]),
        ];
        turns.extend(robot.legs[0].toe_link.map(|link| (link, weights.toe_turn, (|t| t.toes[0]) as Turn)));
        turns.extend(robot.legs[1].toe_link.map(|link| (link, weights.toe_turn, (|t| t.toes[1]) as Turn)));
        let turns = turns
            .into_iter()
            .map(|(link, weight, target)| TurnTask { link, weight, dofs: dofs_of(link, None), target })
            .collect();
        let mut held = vec![Vec::new(); targets.frames.len()];
        for (i, anchor) in anchors.iter().enumerate() {
            held[anchor.start..anchor.end].iter_mut().for_each(|list| list.push(i));
        }
        let data = robot.data();
        let jacobian = vec![0.0; 3 * nv];
        let second = jacobian.clone();
        let difference = [vec![0.0; nv], vec![0.0; nv]];
        Self {
            robot,
            data,
            targets,
            weights,
            points,
            turns,
            contacts,
            anchors,
            held,
            clearance,
            jacobian,
            second,
            difference,
        }
    }

    /// The terms of one frame at the position `q`: their cost, and, into `system` at `offset`, their derivatives.
    fn frame(&mut self, frame: usize, q: &[f64], anchored: bool, mut system: Option<(&mut System, usize)>) -> f64 {
        let target = &self.targets.frames[frame];
        self.data.set_position(q);
        let mut cost = 0.0;
        for (task, wanted) in self.points.iter().zip(&target.positions) {
            if task.weight == 0.0 {
                continue;
            }
            let at = self.data.point(&task.at);
            let residual = at - wanted;
            cost += task.weight * residual.norm_squared();
            if let Some((system, offset)) = system.as_mut() {
                self.data.point_jacobian_into(task.at.link, &at, &mut self.jacobian);
                system.add(*offset, &self.jacobian, residual.as_slice(), task.weight, &task.dofs);
            }
        }
        for task in &self.turns {
            let wanted = (task.target)(target);
            let residual = (self.data.link_rotation(task.link) * wanted.inverse()).scaled_axis();
            cost += task.weight * residual.norm_squared();
            if let Some((system, offset)) = system.as_mut() {
                self.data.rotation_jacobian_into(task.link, &mut self.jacobian);
                system.add(*offset, &self.jacobian, residual.as_slice(), task.weight, &task.dofs);
            }
        }
        // Contact points: on their anchor while they stand, above the ground always.
        for (i, (task, contact)) in self.contacts.iter().zip(&self.robot.contacts).enumerate() {
            let at = self.data.point(&task.at);
            let anchor = if anchored {
                self.held[frame].iter().map(|&a| &self.anchors[a]).find(|anchor| anchor.point == i)
            } else {
                None
            };
            let depth = at.z - contact.radius - self.clearance[frame][contact.leg as usize];
            let residual = match anchor {
                Some(anchor) => at - anchor.place,
                None if depth < 0.0 => Vector3::z() * depth,
                None => continue,
            };
            let weight = if anchor.is_some() { task.weight } else { self.weights.penetration };
            cost += weight * residual.norm_squared();
            if let Some((system, offset)) = system.as_mut() {
                self.data.point_jacobian_into(task.at.link, &at, &mut self.jacobian);
                if anchor.is_some() {
                    system.add(*offset, &self.jacobian, residual.as_slice(), weight, &task.dofs);
                } else {
                    let nv = system.nv;
                    system.add(*offset, &self.jacobian[2 * nv..], &[depth], weight, &task.dofs);
                }
            }
        }
        for &pair in &self.robot.self_collision {
            let (points, gap) = self.data.capsule_gap(pair);
            if gap >= CLEARANCE {
                continue;
            }
            let overlap = gap - CLEARANCE;
            cost += self.weights.collision * overlap * overlap;
            if let Some((system, offset)) = system.as_mut() {
                let normal = (points.second - points.first).try_normalize(1e-9).unwrap_or_else(Vector3::y);
                let nv = system.nv;
                self.data.point_jacobian_into(self.data.geom_link(pair[0]), &points.first, &mut self.jacobian);
                self.data.point_jacobian_into(self.data.geom_link(pair[1]), &points.second, &mut self.second);
                let mut row = vec![0.0; nv];
                for (j, entry) in row.iter_mut().enumerate() {
                    for k in 0..3 {
                        *entry += normal[k] * (self.second[k * nv + j] - self.jacobian[k * nv + j]);
                    }
                }
                let dofs: Vec<usize> = (0..nv).filter(|&j| row[j] != 0.0).collect();
                system.add(*offset, &row, &[overlap], self.weights.collision, &dofs);
            }
        }
        for (i, rest) in self.robot.stand[7..].iter().enumerate() {
            let residual = q[7 + i] - rest;
            cost += self.weights.posture * residual * residual;
            if let Some((system, offset)) = system.as_mut() {
                let index = *offset + 6 + i;
                system.gradient[index] += self.weights.posture * residual;
                system.matrix.add(index, index, self.weights.posture);
            }
        }
        cost
    }

    /// The acceleration terms that the frames of `window` have a part in; derivatives for those frames only.
    fn smoothness(
        &mut self,
        positions: &[Vec<f64>],
        window: &Range<usize>,
        rate: f64,
        mut system: Option<&mut System>,
    ) -> f64 {
        let nv = self.robot.nv();
        let scale = rate.powi(4);
        let weight = |j: usize| scale * if j < 3 { self.weights.base_acceleration } else { self.weights.acceleration };
        let mut cost = 0.0;
        let middles = window.start.saturating_sub(1).max(1)..(window.end + 1).min(positions.len().saturating_sub(1));
        for k in middles {
            let [before, after] = &mut self.difference;
            self.data.difference_into(&positions[k - 1], &positions[k], 1.0, before);
            self.data.difference_into(&positions[k], &positions[k + 1], 1.0, after);
            let parts = [(k - 1, 1.0), (k, -2.0), (k + 1, 1.0)];
            for j in 0..nv {
                let residual = after[j] - before[j];
                let w = weight(j);
                cost += w * residual * residual;
                let Some(system) = system.as_deref_mut() else { continue };
                let index = |frame: usize| (frame - window.start) * nv + j;
                for (a, s) in parts.iter().filter(|(a, _)| window.contains(a)) {
                    system.gradient[index(*a)] += w * s * residual;
                    for (b, t) in parts.iter().filter(|(b, _)| window.contains(b) && b <= a) {
                        system.matrix.add(index(*a), index(*b), w * s * t);
                    }
                }
            }
        }
        cost
    }

    /// The first guess: every frame solved alone, from the one before.
    pub(crate) fn guess(&mut self) -> Result<Vec<Vec<f64>>, RetargetError> {
        let nv = self.robot.nv();
        let mut system = System { matrix: Banded::zeros(nv, nv - 1), gradient: vec![0.0; nv], nv };
        let mut q = self.robot.stand.clone();
        let pelvis = self.targets.keypoints.iter().position(|k| k.at.link == self.robot.base);
        if let Some(first) = self.targets.frames.first() {
            if let Some(i) = pelvis {
                q[..3].copy_from_slice(first.positions[i].as_slice());
            }
            let turn = first.pelvis;
            q[3..7].copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
        }
        let mut guesses = Vec::with_capacity(self.targets.frames.len());
        for frame in 0..self.targets.frames.len() {
            let steps = if frame == 0 { FIRST_FRAME_STEPS } else { GUESS_STEPS };
            for iteration in 0..steps {
                system.clear(1);
                self.frame(frame, &q, false, Some((&mut system, 0)));
                let step = self.step(&mut system, std::slice::from_ref(&q), &[1e-3], iteration)?;
                // A long step would leave the region where the derivatives hold.
                let longest = step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
                self.advance(&mut q, &step, (0.5 / longest).min(1.0));
            }
            guesses.push(q.clone());
        }
        Ok(guesses)
    }

    /// One iteration over the frames of `window`, the others held. `damping` is Levenberg and Marquardt's, kept between
    /// iterations; each frame has its own, so that a few difficult frames do not hold up all others. `moved` says how
    /// far each frame went, infinity where no damping lowered the cost. Returns by how much the cost fell, and what of
    /// it is left.
    pub(crate) fn iterate(
        &mut self,
        positions: &mut [Vec<f64>],
        window: &Range<usize>,
        rate: f64,
        iteration: usize,
        state: &mut State,
    ) -> Result<(f64, f64), RetargetError> {
        let nv = self.robot.nv();
        let State { systems: [system, attempt], damping, moved } = state;
        system.clear(window.len());
        let mut before = self.smoothness(positions, window, rate, Some(system));
        let mut frames_before = Vec::with_capacity(window.len());
        for frame in window.clone() {
            let offset = (frame - window.start) * nv;
            frames_before.push(self.frame(frame, &positions[frame], true, Some((system, offset))));
        }
        before += frames_before.iter().sum::<f64>();
        let held: Vec<Vec<f64>> = positions[window.clone()].to_vec();
        for _ in 0..DAMPING_TRIES {
            attempt.matrix.copy_from(&system.matrix);
            attempt.gradient.clone_from(&system.gradient);
            let step = self.step(attempt, &held, &damping[window.clone()], iteration)?;
            for ((frame, step), held) in window.clone().zip(step.chunks(nv)).zip(&held) {
                positions[frame].clone_from(held);
                self.advance(&mut positions[frame], step, 1.0);
                moved[frame] = step.iter().fold(0.0, |most, s| s.abs().max(most));
            }
            let mut after = self.smoothness(positions, window, rate, None);
            for (frame, was) in window.clone().zip(&frames_before) {
                let now = self.frame(frame, &positions[frame], true, None);
                after += now;
                damping[frame] = if now > *was { damping[frame] * 20.0 } else { (damping[frame] / 10.0).max(1e-5) };
            }
            if after < before {
                return Ok((before - after, after));
            }
        }
        for (frame, held) in window.clone().zip(held) {
            positions[frame] = held;
            moved[frame] = f64::INFINITY;
        }
        Ok((0.0, before))
    }

    /// The stretches of frames that still move, with some frames on either side.
    pub(crate) fn windows(moved: &[f64]) -> Vec<Range<usize>> {
        let mut windows: Vec<Range<usize>> = Vec::new();
        for frame in (0..moved.len()).filter(|&frame| moved[frame] > STILL) {
            let (start, end) = (frame.saturating_sub(WINDOW_MARGIN), (frame + WINDOW_MARGIN + 1).min(moved.len()));
            match windows.last_mut() {
                Some(last) if last.end >= start => last.end = end,
                _ => windows.push(start..end),
            }
        }
        windows
    }

    /// Solves for the step, with joints that push against their limits taken out.
    fn step(
        &self,
        system: &mut System,
        positions: &[Vec<f64>],
        damping: &[f64],
        iteration: usize,
    ) -> Result<Vec<f64>, RetargetError> {
        let nv = system.nv;
        for ((frame, q), damping) in positions.iter().enumerate().zip(damping) {
            for j in 0..nv {
                // Marquardt's scaling: stiff directions are damped as much as soft ones.
                let diagonal = &mut system.matrix.column_mut(frame * nv + j)[0];
                *diagonal += damping * *diagonal + LEAST_DAMPING;
            }
            for (i, joint) in self.robot.joints.iter().enumerate() {
                let index = frame * nv + 6 + i;
                let downhill = -system.gradient[index];
                let [least, greatest] = joint.range;
                if (q[7 + i] <= least && downhill < 0.0) || (q[7 + i] >= greatest && downhill > 0.0) {
                    system.matrix.fix(index);
                    system.gradient[index] = 0.0;
                }
            }
        }
        let mut step: Vec<f64> = system.gradient.iter().map(|g| -g).collect();
        if step.iter().any(|s| !s.is_finite()) {
            return Err(RetargetError::Breakdown { iteration: iteration + 1, what: "a gradient that is no number" });
        }
        if !system.matrix.factor_and_solve(&mut step) {
            return Err(RetargetError::Breakdown { iteration: iteration + 1, what: "a matrix that is not positive" });
        }
        Ok(step)
    }

    /// Moves `q` by `length` times `step`, joints clamped to their range.
    fn advance(&self, q: &mut [f64], step: &[f64], length: f64) {
        self.data.integrate(q, step, length);
        for (angle, joint) in q[7..].iter_mut().zip(&self.robot.joints) {
            *angle = angle.clamp(joint.range[0], joint.range[1]);
        }
    }

    /// Puts every anchor where its point is on average, on the ground.
    pub(crate) fn settle_anchors(&mut self, positions: &[Vec<f64>]) {
        let mut anchors = std::mem::take(&mut self.anchors);
        for anchor in &mut anchors {
            anchor.place = Vector3::zeros();
        }
        for (frame, q) in positions.iter().enumerate() {
            if self.held[frame].is_empty() {
                continue;
            }
            self.data.set_position(q);
            for &i in &self.held[frame] {
                let anchor = &mut anchors[i];
                let at = self.data.point(&self.robot.contacts[anchor.point].at);
                anchor.place += at / (anchor.end - anchor.start) as f64;
            }
        }
        for anchor in &mut anchors {
            anchor.place.z = self.robot.contacts[anchor.point].radius;
        }
        self.anchors = anchors;
    }

    /// Where each keypoint is at the position `q`, m.
    pub(crate) fn keypoints_at(&mut self, q: &[f64]) -> Vec<Vector3<f64>> {
        self.data.set_position(q);
        self.points.iter().map(|task| self.data.point(&task.at)).collect()
    }
}
