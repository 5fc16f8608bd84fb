//! Inverse kinematics of both legs with weighted goals, under joint limits: the part that BioIK plays in paper 2
//! (section 4.3, goals relative to any link).
//!
//! Problem: find leg joint angles so that, in the support sole's frame, the swing sole has a wanted pose, the base a
//! wanted height and orientation, and the centre of mass a wanted place. Each step solves the damped least-squares
//! problem (Levenberg, A method for the solution of certain non-linear problems, 1944)
//!
//! min | W (J dx - e) |^2 + lambda |dx|^2   subject to   lo <= x + dx <= hi,  |dx| <= step
//!
//! by an active set: the free unknowns are solved by Cholesky, those that leave their bounds are fixed there, and the
//! rest is solved again. With twelve unknowns a step takes a few microseconds. Joints that one motor turns are one
//! unknown. Finds the nearest local solution from where it starts; allocates nothing after `new`.

use instep_motion::phase::Side;
use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::tree::{Tree, TreePose};
use crate::{LinkPoint, Robot};

/// Most unknowns: two legs of seven joints.
const UNKNOWNS: usize = 14;
/// Rows: swing pose 6, base height 1, base orientation 3, centre of mass 2.
const ROWS: usize = 12;
/// Largest change of a joint in one step, rad.
const STEP: f64 = 0.4;

/// Why a robot's legs cannot be solved.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {found}; expected {expected}")]
pub struct IkError {
    /// What is wrong: `coupled` or `leg`.
    pub field: String,
    /// What is there.
    pub found: String,
    /// What would be right.
    pub expected: String,
}

/// Importance of each goal; the residual times this is what is minimised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Swing sole's position, 1/m.
    pub position: f64,
    /// Swing sole's pitch and yaw, 1/rad.
    pub orientation: f64,
    /// Swing sole's roll, 1/rad: in the air it may lean.
    pub roll: f64,
    /// Base height, 1/m.
    pub height: f64,
    /// Base roll and pitch, 1/rad.
    pub tilt: f64,
    /// Base yaw, 1/rad.
    pub yaw: f64,
    /// Centre of mass, 1/m.
    pub balance: f64,
    /// Damping.
    pub damping: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            position: 100.0,
            orientation: 30.0,
            roll: 3.0,
            height: 4.0,
            tilt: 2.0,
            yaw: 0.8,
            balance: 60.0,
            damping: 0.03,
        }
    }
}

/// What is wanted, in the support sole's frame (origin at the sole's centre, the foot's axes).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goals {
    /// Swing sole's centre, m.
    pub position: Vector3<f64>,
    /// Swing sole's yaw, then pitch, rad.
    pub yaw_pitch: [f64; 2],
    /// Centre of mass over the ground, m.
    pub balance: [f64; 2],
    /// Base link's height, m.
    pub height: f64,
    /// Base roll, pitch, yaw, rad.
    pub base: [f64; 3],
}

/// How far a solution is from its goals.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Residual {
    /// Swing sole's position, m.
    pub position: f64,
    /// Swing sole's pitch and yaw, rad.
    pub orientation: f64,
    /// Swing sole's roll, rad.
    pub roll: f64,
    /// Centre of mass, m.
    pub balance: f64,
    /// Base tilt, rad.
    pub tilt: f64,
    /// Base height, m.
    pub height: f64,
}

/// A pose held against goals, in the base frame.
#[derive(Debug, Clone, Copy)]
struct Compared {
    residual: Residual,
    /// Centres of the support sole and of the swing sole, m.
    soles: [Vector3<f64>; 2],
    com: Vector3<f64>,
    /// `support_from_base`.
    turn: Matrix3<f64>,
    /// `swing_from_support`.
    foot: Matrix3<f64>,
}

/// The solver for one robot; scratch space of one thread.
#[derive(Debug, Clone)]
pub struct Ik {
    /// Joints of each unknown: one, or two that one motor turns.
    unknowns: Vec<[Option<usize>; 2]>,
    ranges: Vec<[f64; 2]>,
    /// Links that the unknowns move.
    links: Vec<usize>,
    soles: [LinkPoint; 2],
    weights: Weights,
    jacobian: [[f64; UNKNOWNS]; ROWS],
    error: [f64; ROWS],
    normal: [[f64; UNKNOWNS]; UNKNOWNS],
    factor: [[f64; UNKNOWNS]; UNKNOWNS],
    gradient: [f64; UNKNOWNS],
    step: [f64; UNKNOWNS],
}

impl Ik {
    /// For `robot`, whose pairs of joints in `coupled` are turned by one motor each; `margin` (rad) is kept from every
    /// joint limit, and knees are kept bent by `bend` (rad) at least: a straight leg cannot follow.
    ///
    /// # Errors
    /// When a coupled joint is not there, or the legs have more than fourteen joints.
    pub fn new(robot: &Robot, coupled: &[[String; 2]], margin: f64, bend: f64) -> Result<Self, IkError> {
        let mut unknowns: Vec<[Option<usize>; 2]> = Vec::new();
        for leg in &robot.legs {
            // The toe keeps its standing angle.
            for joint in leg.joints().filter(|joint| Some(*joint) != leg.toe) {
                let name = &robot.joints[joint].name;
                let partner = coupled.iter().find_map(|[a, b]| match name {
                    n if n == a => Some(b),
                    n if n == b => Some(a),
                    _ => None,
                });
                let partner = partner
                    .map(|p| {
                        robot.joint_index(p).ok_or_else(|| IkError {
                            field: "coupled".into(),
                            found: format!("\"{p}\""),
                            expected: format!("a joint of {}", robot.name),
                        })
                    })
                    .transpose()?;
                if !unknowns.iter().any(|known| known[1] == Some(joint)) {
                    unknowns.push([Some(joint), partner]);
                }
            }
        }
        if unknowns.len() > UNKNOWNS {
            return Err(IkError {
                field: "leg".into(),
                found: format!("{} joints in both legs", unknowns.len()),
                expected: format!("at most {UNKNOWNS}"),
            });
        }
        let ranges = unknowns
            .iter()
            .map(|joints| {
                let mut range = [f64::NEG_INFINITY, f64::INFINITY];
                for joint in joints.iter().flatten() {
                    let [low, high] = robot.joints[*joint].range;
                    range = [range[0].max(low + margin), range[1].min(high - margin)];
                    // A knee bends toward the far end of its range.
                    if robot.legs.iter().any(|leg| leg.knee == *joint) {
                        if high > -low {
                            range[0] = range[0].max(bend);
                        } else {
                            range[1] = range[1].min(-bend);
                        }
                    }
                }
                range
            })
            .collect();
        let moving: Vec<usize> = unknowns.iter().flatten().flatten().copied().collect();
        Ok(Self {
            unknowns,
            ranges,
            links: Tree::new(robot).links_moved_by(&moving),
            soles: [robot.legs[0].sole, robot.legs[1].sole],
            weights: Weights::default(),
            jacobian: [[0.0; UNKNOWNS]; ROWS],
            error: [0.0; ROWS],
            normal: [[0.0; UNKNOWNS]; UNKNOWNS],
            factor: [[0.0; UNKNOWNS]; UNKNOWNS],
            gradient: [0.0; UNKNOWNS],
            step: [0.0; UNKNOWNS],
        })
    }

    /// As [`Ik::new`] for the leg on `side` alone, which follows the swing sole's goals; the base, the other leg and joints
    /// that share a motor with it stay where they are.
    ///
    /// # Errors
    /// As [`Ik::new`].
    pub fn of_leg(robot: &Robot, coupled: &[[String; 2]], margin: f64, bend: f64, side: Side) -> Result<Self, IkError> {
        let mut ik = Self::new(robot, coupled, margin, bend)?;
        let of_leg = |joints: &[Option<usize>; 2]| {
            joints[1].is_none() && joints[0].is_some_and(|joint| robot.leg(side).joints().any(|j| j == joint))
        };
        ik.ranges = ik.unknowns.iter().zip(&ik.ranges).filter(|(joints, _)| of_leg(joints)).map(|(_, r)| *r).collect();
        ik.unknowns.retain(of_leg);
        ik.weights = Weights { height: 0.0, tilt: 0.0, yaw: 0.0, balance: 0.0, ..ik.weights };
        Ok(ik)
    }

    /// The same solver with other weights.
    #[must_use]
    pub fn with_weights(self, weights: Weights) -> Self {
        Self { weights, ..self }
    }

    /// The joints that it moves.
    pub fn joints(&self) -> impl Iterator<Item = usize> {
        self.unknowns.iter().flatten().flatten().copied()
    }

    /// Takes at most `steps` steps from `angles` toward `goals` with `swing` as the swing foot; stops when a step is
    /// under a tenth of a milliradian (the next would be its square). `angles` and `pose` agree afterwards.
    pub fn solve(
        &mut self,
        tree: &Tree,
        pose: &mut TreePose,
        angles: &mut [f64],
        swing: Side,
        goals: &Goals,
        steps: usize,
    ) -> Residual {
        tree.update(angles, pose);
        let mut at = self.compare(tree, pose, swing, goals);
        let mut cost = self.cost();
        let mut damping = self.weights.damping;
        let mut fresh = false;
        for _ in 0..steps {
            if !fresh {
                self.linearise(tree, pose, swing, &at);
                fresh = true;
            }
            self.least_squares(angles, damping);
            let step = self.step;
            let largest = step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
            self.apply(&step, 1.0, angles);
            tree.update_links(&self.links, angles, pose);
            let before = self.error;
            let next = self.compare(tree, pose, swing, goals);
            let next_cost = self.cost();
            // Levenberg and Marquardt: a step that makes things worse is taken back and damped.
            if next_cost > cost * 1.000_001 && largest > 1e-3 {
                self.apply(&step, -1.0, angles);
                tree.update_links(&self.links, angles, pose);
                self.error = before;
                damping = (damping * 10.0).max(1.0);
                continue;
            }
            damping = (damping * 0.2).max(self.weights.damping);
            (at, cost, fresh) = (next, next_cost, false);
            if largest < 1e-4 {
                break;
            }
        }
        at.residual
    }

    /// Adds `share` of a step to the angles.
    fn apply(&self, step: &[f64; UNKNOWNS], share: f64, angles: &mut [f64]) {
        for (joints, step) in self.unknowns.iter().zip(step) {
            for joint in joints.iter().flatten() {
                angles[*joint] += share * step;
            }
        }
    }

    /// What is minimised.
    fn cost(&self) -> f64 {
        self.error.iter().map(|e| e * e).sum()
    }

    /// Where things are in the present pose; the error goes into `self.error`.
    fn compare(&mut self, tree: &Tree, pose: &TreePose, swing: Side, goals: &Goals) -> Compared {
        let (support, flying) = (&self.soles[swing.other() as usize], &self.soles[swing as usize]);
        let (s, f) = (pose.point(support), pose.point(flying));
        let turn = pose.rotation[support.link].transpose();
        let w = self.weights;

        // Where things are in the support sole's frame.
        let position = turn * (f - s);
        let base = turn * (-s);
        let com_base = tree.com(pose);
        let com = turn * (com_base - s);
        let wanted = Rotation3::from_axis_angle(&Vector3::z_axis(), goals.yaw_pitch[0])
            * Rotation3::from_axis_angle(&Vector3::y_axis(), goals.yaw_pitch[1]);
        // In the swing sole's own axes, so that its roll can weigh less.
        let foot = (turn * pose.rotation[flying.link]).transpose();
        let orientation_error = foot * log(&(wanted.into_inner() * (turn * pose.rotation[flying.link]).transpose()));
        let [roll, pitch, yaw] = goals.base;
        let base_error = log(&(Rotation3::from_euler_angles(roll, pitch, yaw).into_inner() * turn.transpose()));
        let position_error = goals.position - position;
        let balance_error = [goals.balance[0] - com.x, goals.balance[1] - com.y];
        let height_error = goals.height - base.z;

        for k in 0..3 {
            self.error[k] = w.position * position_error[k];
        }
        let orientation = [w.roll, w.orientation, w.orientation];
        for k in 0..3 {
            self.error[3 + k] = orientation[k] * orientation_error[k];
        }
        self.error[6] = w.height * height_error;
        self.error[7] = w.tilt * base_error.x;
        self.error[8] = w.tilt * base_error.y;
        self.error[9] = w.yaw * base_error.z;
        self.error[10] = w.balance * balance_error[0];
        self.error[11] = w.balance * balance_error[1];

        let residual = Residual {
            position: position_error.norm(),
            orientation: orientation_error.yz().norm(),
            roll: orientation_error.x.abs(),
            balance: balance_error[0].hypot(balance_error[1]),
            tilt: base_error.xy().norm(),
            height: height_error.abs(),
        };
        Compared { residual, soles: [s, f], com: com_base, turn, foot }
    }

    /// Jacobian in the pose that was compared.
    fn linearise(&mut self, tree: &Tree, pose: &TreePose, swing: Side, at: &Compared) {
        let (support, flying) = (&self.soles[swing.other() as usize], &self.soles[swing as usize]);
        let Compared { soles: [s, f], com: com_base, turn, foot, .. } = *at;
        let w = self.weights;
        let orientation = [w.roll, w.orientation, w.orientation];
        for (n, joints) in self.unknowns.iter().enumerate() {
            let mut column = [0.0; ROWS];
            for &joint in joints.iter().flatten() {
                let omega_s = tree.turn_column(pose, joint, support.link);
                let v_s = tree.point_column(pose, joint, support.link, &s);
                let v_f = tree.point_column(pose, joint, flying.link, &f);
                let omega_f = tree.turn_column(pose, joint, flying.link);
                let v_c = tree.com_column(pose, joint);
                // d/dt R^T (p - s) = R^T (v - v_s - omega_s x (p - s)).
                let d_position = turn * (v_f - v_s - omega_s.cross(&(f - s)));
                let d_orientation = foot * (turn * (omega_f - omega_s));
                let d_base = turn * (-v_s + omega_s.cross(&s));
                let d_tilt = -(turn * omega_s);
                let d_com = turn * (v_c - v_s - omega_s.cross(&(com_base - s)));
                for k in 0..3 {
                    column[k] += w.position * d_position[k];
                    column[3 + k] += orientation[k] * d_orientation[k];
                }
                column[6] += w.height * d_base.z;
                column[7] += w.tilt * d_tilt.x;
                column[8] += w.tilt * d_tilt.y;
                column[9] += w.yaw * d_tilt.z;
                column[10] += w.balance * d_com.x;
                column[11] += w.balance * d_com.y;
            }
            for (row, value) in self.jacobian.iter_mut().zip(column) {
                row[n] = value;
            }
        }
    }

    /// The box-constrained damped least-squares step, into `self.step`.
    fn least_squares(&mut self, angles: &[f64], damping: f64) {
        let n = self.unknowns.len();
        // Row by row and over all columns, so that the compiler can use wide registers; unused columns stay zero.
        self.normal = [[0.0; UNKNOWNS]; UNKNOWNS];
        self.gradient = [0.0; UNKNOWNS];
        for (row, error) in self.jacobian.iter().zip(self.error) {
            for (i, left) in row.iter().enumerate().take(n) {
                for (entry, right) in self.normal[i].iter_mut().zip(row) {
                    *entry += left * right;
                }
                self.gradient[i] += left * error;
            }
        }
        for i in 0..n {
            self.normal[i][i] += damping;
        }
        let mut fixed = [false; UNKNOWNS];
        self.step = [0.0; UNKNOWNS];
        // Each round fixes at least one unknown, so there are at most n rounds.
        for _ in 0..=n {
            self.solve_free(n, &fixed);
            let mut clean = true;
            for (i, fixed) in fixed.iter_mut().enumerate().take(n).filter(|(_, fixed)| !**fixed) {
                let x = self.unknowns[i][0].map_or(0.0, |joint| angles[joint]);
                let [low, high] = self.ranges[i];
                let (low, high) = ((low - x).clamp(-STEP, 0.0), (high - x).clamp(0.0, STEP));
                if self.step[i] < low || self.step[i] > high {
                    self.step[i] = self.step[i].clamp(low, high);
                    *fixed = true;
                    clean = false;
                }
            }
            if clean {
                break;
            }
        }
    }

    /// Solves for the unknowns that are not fixed, given the steps of those that are.
    fn solve_free(&mut self, n: usize, fixed: &[bool; UNKNOWNS]) {
        let mut free = [0; UNKNOWNS];
        let mut count = 0;
        for i in (0..n).filter(|&i| !fixed[i]) {
            free[count] = i;
            count += 1;
        }
        let mut right = [0.0; UNKNOWNS];
        for a in 0..count {
            let i = free[a];
            right[a] =
                self.gradient[i] - (0..n).filter(|&j| fixed[j]).map(|j| self.normal[i][j] * self.step[j]).sum::<f64>();
        }
        // Cholesky; the damping keeps the matrix positive definite.
        for a in 0..count {
            for b in 0..=a {
                let mut sum = self.normal[free[a]][free[b]];
                for c in 0..b {
                    sum -= self.factor[a][c] * self.factor[b][c];
                }
                self.factor[a][b] = if a == b { sum.max(1e-12).sqrt() } else { sum / self.factor[b][b] };
            }
        }
        for a in 0..count {
            for c in 0..a {
                right[a] -= self.factor[a][c] * right[c];
            }
            right[a] /= self.factor[a][a];
        }
        for a in (0..count).rev() {
            for c in a + 1..count {
                right[a] -= self.factor[c][a] * right[c];
            }
            right[a] /= self.factor[a][a];
            self.step[free[a]] = right[a];
        }
    }
}

/// Rotation vector of a rotation matrix that may be off by rounding; by the arc tangent, which needs no clamping.
fn log(m: &Matrix3<f64>) -> Vector3<f64> {
    let sine = Vector3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)]) * 0.5;
    let length = sine.norm();
    let angle = length.atan2(0.5 * (m.trace() - 1.0));
    if length < 1e-12 { sine } else { sine * (angle / length) }
}
