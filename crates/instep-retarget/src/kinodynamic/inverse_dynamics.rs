//! Inverse dynamics of the [`super::tree::Tree`] and its first derivatives.
//!
//! Source: S. Singh, R. Russo, P. Wensing, Efficient analytical derivatives of rigid-body dynamics using spatial vector
//! algebra, IEEE RA-L 7(2), 2022, equations 22-25 and algorithm 1 (for single-axis joints). Generalised forces
//! M(x) x'' + h(x, x') of (33), without contact forces; rotor inertia and viscous friction included.
//!
//! The first six are the wrench on the unactuated base: with the contact forces taken off they are the centroidal
//! dynamics (1), (2), joined to the joints' motion by the consistency (7), (8); see [`super`].

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::tree::{Pose, Tree};

/// Scratch space and results for one state. Matrices are nv x nv, row by row.
#[derive(Debug, Clone)]
pub(crate) struct Dynamics {
    pub pose: Pose,
    /// Generalised forces: N for the first three, N m for the rest.
    pub force: Vec<f64>,
    pub by_position: Vec<f64>,
    pub by_speed: Vec<f64>,
    /// The mass matrix.
    pub by_acceleration: Vec<f64>,
    /// Centre of mass, m.
    pub com: Vector3<f64>,
    /// Spatial momentum about the world's origin: angular, linear.
    momentum: Vector6<f64>,
    axes: Vec<Vector6<f64>>,
    psi: Vec<Vector6<f64>>,
    psi_rate: Vec<Vector6<f64>>,
    velocity: Vec<Vector6<f64>>,
    acceleration: Vec<Vector6<f64>>,
    inertia: Vec<Matrix6<f64>>,
    bias: Vec<Matrix6<f64>>,
    wrench: Vec<Vector6<f64>>,
    carried: Vec<Vector6<f64>>,
}

impl Dynamics {
    pub(crate) fn new(tree: &Tree) -> Self {
        let nv = tree.nv;
        let zero = vec![Vector6::zeros(); nv];
        Self {
            pose: tree.pose(),
            force: vec![0.0; nv],
            by_position: vec![0.0; nv * nv],
            by_speed: vec![0.0; nv * nv],
            by_acceleration: vec![0.0; nv * nv],
            com: Vector3::zeros(),
            momentum: Vector6::zeros(),
            axes: zero.clone(),
            psi: zero.clone(),
            psi_rate: zero.clone(),
            velocity: zero.clone(),
            acceleration: zero.clone(),
            inertia: vec![Matrix6::zeros(); nv],
            bias: vec![Matrix6::zeros(); nv],
            wrench: zero.clone(),
            carried: zero,
        }
    }

    /// Computes everything for a state; derivatives only where asked for.
    pub(crate) fn compute(&mut self, tree: &Tree, x: &[f64], v: &[f64], a: &[f64], derivatives: bool) {
        tree.place(x, &mut self.pose);
        tree.inertias_into(&self.pose, &mut self.inertia);
        let lift = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, tree.gravity);
        for i in 0..tree.nv {
            let axis = tree.axis(&self.pose, i);
            let (before, before_rate) =
                tree.parents[i].map_or((Vector6::zeros(), lift), |p| (self.velocity[p], self.acceleration[p]));
            let psi = motion_cross(&before, &axis);
            self.axes[i] = axis;
            self.psi[i] = psi;
            self.psi_rate[i] = motion_cross(&before_rate, &axis) + motion_cross(&before, &psi);
            // v_i x S_i is v_parent x S_i for a single axis.
            self.velocity[i] = before + axis * v[i];
            self.acceleration[i] = before_rate + axis * a[i] + psi * v[i];
            let momentum = self.inertia[i] * self.velocity[i];
            self.carried[i] = momentum;
            self.wrench[i] = self.inertia[i] * self.acceleration[i] + force_cross(&self.velocity[i], &momentum);
            if derivatives {
                let (inertia, velocity) = (&self.inertia[i], &self.velocity[i]);
                self.bias[i] =
                    force_matrix(velocity) * inertia - inertia * motion_matrix(velocity) + carried_matrix(&momentum);
            }
        }
        if derivatives {
            self.by_position.fill(0.0);
            self.by_speed.fill(0.0);
            self.by_acceleration.fill(0.0);
        }
        for i in (0..tree.nv).rev() {
            self.force[i] = self.axes[i].dot(&self.wrench[i]) + tree.armature[i] * a[i] + tree.damping[i] * v[i];
            if derivatives {
                self.derivatives_of(tree, i);
            }
            if let Some(p) = tree.parents[i] {
                let (inertia, bias) = (self.inertia[i], self.bias[i]);
                self.inertia[p] += inertia;
                if derivatives {
                    self.bias[p] += bias;
                }
                let (wrench, carried) = (self.wrench[i], self.carried[i]);
                self.wrench[p] += wrench;
                self.carried[p] += carried;
            }
        }
        let whole = &self.inertia[0];
        // m [c x] is the upper right block.
        self.com = Vector3::new(whole[(2, 4)], whole[(0, 5)], whole[(1, 3)]) / tree.mass;
        self.momentum = self.carried[0];
    }

    /// Row `i` and column `i` of the derivatives, as far as its chain goes.
    fn derivatives_of(&mut self, tree: &Tree, i: usize) {
        let nv = tree.nv;
        let (axis, psi) = (self.axes[i], self.psi[i]);
        let (inertia, bias) = (&self.inertia[i], &self.bias[i]);
        let row_bias = bias.tr_mul(&axis);
        let row_inertia = inertia * axis;
        let column_position = bias * psi + inertia * self.psi_rate[i] + force_cross(&axis, &self.wrench[i]);
        let column_speed = bias * axis + inertia * psi * 2.0;
        for &j in &tree.support[i] {
            let to = i * nv + j;
            self.by_position[to] = row_bias.dot(&self.psi[j]) + row_inertia.dot(&self.psi_rate[j]);
            self.by_speed[to] = row_bias.dot(&self.axes[j]) + 2.0 * row_inertia.dot(&self.psi[j]);
            self.by_acceleration[to] = row_inertia.dot(&self.axes[j]);
            if j != i {
                let to = j * nv + i;
                self.by_position[to] = self.axes[j].dot(&column_position);
                self.by_speed[to] = self.axes[j].dot(&column_speed);
                self.by_acceleration[to] = self.axes[j].dot(&row_inertia);
            }
        }
        self.by_acceleration[i * nv + i] += tree.armature[i];
        self.by_speed[i * nv + i] += tree.damping[i];
    }

    /// Linear momentum (kg m/s) and angular momentum about the centre of mass (kg m^2/s), world axes; (7).
    pub(crate) fn momentum(&self) -> (Vector3<f64>, Vector3<f64>) {
        let linear = self.momentum.fixed_rows::<3>(3).into_owned();
        (linear, self.momentum.fixed_rows::<3>(0) - self.com.cross(&linear))
    }

    /// How the angular momentum about the centre of mass changes with coordinate `i` and with its speed (a column of
    /// A_CAM). After [`Self::compute`].
    pub(crate) fn angular_momentum_by(&self, tree: &Tree, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        let inertia = &self.inertia[i];
        let by_position = force_cross(&self.axes[i], &self.carried[i]) + inertia * self.psi[i];
        let by_speed = inertia * self.axes[i];
        let linear = self.momentum.fixed_rows::<3>(3).into_owned();
        // The momentum that a unit speed of the coordinate gives is the mass times the centre of mass's derivative.
        let com = by_speed.fixed_rows::<3>(3) / tree.mass;
        let shifted = |w: &Vector6<f64>| w.fixed_rows::<3>(0) - self.com.cross(&w.fixed_rows::<3>(3).into_owned());
        (shifted(&by_position) - com.cross(&linear), shifted(&by_speed))
    }
}

fn parts(v: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::new(v[0], v[1], v[2]), Vector3::new(v[3], v[4], v[5]))
}

fn join(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

/// v x m for motions.
fn motion_cross(v: &Vector6<f64>, m: &Vector6<f64>) -> Vector6<f64> {
    let ((w, u), (mw, mu)) = (parts(v), parts(m));
    join(&w.cross(&mw), &(w.cross(&mu) + u.cross(&mw)))
}

/// v x* f for a force.
fn force_cross(v: &Vector6<f64>, f: &Vector6<f64>) -> Vector6<f64> {
    let ((w, u), (n, l)) = (parts(v), parts(f));
    join(&(w.cross(&n) + u.cross(&l)), &w.cross(&l))
}

fn blocks(a: &Matrix3<f64>, b: &Matrix3<f64>, c: &Matrix3<f64>, d: &Matrix3<f64>) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(a);
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(b);
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(c);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(d);
    matrix
}

/// v x as a matrix on motions.
fn motion_matrix(v: &Vector6<f64>) -> Matrix6<f64> {
    let (w, u) = parts(v);
    let (w, u) = (w.cross_matrix(), u.cross_matrix());
    blocks(&w, &Matrix3::zeros(), &u, &w)
}

/// v x* as a matrix on forces.
fn force_matrix(v: &Vector6<f64>) -> Matrix6<f64> {
    let (w, u) = parts(v);
    let (w, u) = (w.cross_matrix(), u.cross_matrix());
    blocks(&w, &u, &Matrix3::zeros(), &w)
}

/// The matrix that takes a motion v to v x* f.
fn carried_matrix(f: &Vector6<f64>) -> Matrix6<f64> {
    let (n, l) = parts(f);
    let (n, l) = (n.cross_matrix(), l.cross_matrix());
    blocks(&-n, &-l, &-l, &Matrix3::zeros())
}
