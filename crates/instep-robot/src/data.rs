//! Kinematics and dynamics of a robot in one state, on MuJoCo's algorithms; reusable scratch space of one thread.
//!
//! Conventions of vectors and Jacobians: the crate's own documentation. After [`RobotData::set_position`], positions,
//! Jacobians and the mass matrix are those of `q`; velocities, momentum and bias forces also want
//! [`RobotData::set_state`]. Nothing here allocates except where a function returns a matrix.

use std::sync::Arc;

use mujoco_rs::mujoco_c;
use mujoco_rs::prelude::*;
use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector3};

use crate::capsule::{SegmentPair, closest_points};
use crate::robot::{LinkPoint, Robot};

/// Scratch space in which one robot's kinematics and dynamics are computed.
pub struct RobotData {
    data: MjData<Arc<MjModel>>,
    base: usize,
    mass: f64,
    jacobian: Vec<f64>,
    drift_jacobian: Vec<f64>,
    acceleration: Vec<f64>,
}

impl std::fmt::Debug for RobotData {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RobotData").field("q", &self.q()).field("v", &self.v()).finish_non_exhaustive()
    }
}

impl RobotData {
    /// Scratch space for `robot`, in its standing pose.
    pub(crate) fn new(robot: &Robot) -> Self {
        let model = Arc::clone(robot.model());
        let nv = robot.nv();
        let mut data = Self {
            data: MjData::new(model),
            base: robot.base,
            mass: robot.mass(),
            jacobian: vec![0.0; 3 * nv],
            drift_jacobian: vec![0.0; 6 * nv],
            acceleration: vec![0.0; nv],
        };
        data.set_state(&robot.stand, &vec![0.0; nv]);
        data
    }

    /// Moves the robot to `q` (7 + n): positions, Jacobians and the mass matrix are up to date afterwards.
    ///
    /// # Panics
    /// When `q` has another length.
    pub fn set_position(&mut self, q: &[f64]) {
        self.data.qpos_mut().copy_from_slice(q);
        self.data.kinematics();
        self.data.com_pos();
    }

    /// Moves the robot to `q` (7 + n) at the speed `v` (6 + n): everything is up to date afterwards.
    ///
    /// # Panics
    /// When a vector has another length.
    pub fn set_state(&mut self, q: &[f64], v: &[f64]) {
        self.set_position(q);
        self.data.qvel_mut().copy_from_slice(v);
        self.data.make_m();
        self.data.com_vel();
        self.data.passive();
    }

    /// The position that was set.
    #[must_use]
    pub fn q(&self) -> &[f64] {
        self.data.qpos()
    }

    /// The speed that was set.
    #[must_use]
    pub fn v(&self) -> &[f64] {
        self.data.qvel()
    }

    /// The difference `v` (6 + n) that leads from `from` to `to` in the time `dt` (s): `to = from (+) v dt`.
    pub fn difference_into(&self, from: &[f64], to: &[f64], dt: f64, v: &mut [f64]) {
        self.data.model().differentiate_pos_into(dt, from, to, v);
    }

    /// Moves `q` by the speed `v` for the time `dt` (s): `q = q (+) v dt`; the quaternion stays a unit one.
    pub fn integrate(&self, q: &mut [f64], v: &[f64], dt: f64) {
        self.data.model().integrate_pos(q, v, dt);
    }

    /// Origin of a link in the world, m.
    #[must_use]
    pub fn link_position(&self, link: usize) -> Vector3<f64> {
        self.data.xpos()[link].into()
    }

    /// `world_from_link`.
    #[must_use]
    pub fn link_rotation(&self, link: usize) -> UnitQuaternion<f64> {
        let [w, x, y, z] = self.data.xquat()[link];
        UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z))
    }

    /// `world_from_link` as a matrix.
    #[must_use]
    pub fn link_matrix(&self, link: usize) -> Matrix3<f64> {
        Matrix3::from_row_slice(&self.data.xmat()[link])
    }

    /// A point of a link in the world, m.
    #[must_use]
    pub fn point(&self, at: &LinkPoint) -> Vector3<f64> {
        self.link_position(at.link) + self.link_matrix(at.link) * at.point
    }

    /// Jacobian (3 x nv) of the velocity of the point of `link` that is now at `world` (m).
    ///
    /// # Panics
    /// When `jacobian` has another length.
    pub fn point_jacobian_into(&self, link: usize, world: &Vector3<f64>, jacobian: &mut [f64]) {
        assert_eq!(jacobian.len(), 3 * self.data.qvel().len(), "a 3 x nv Jacobian");
        let point = [world.x, world.y, world.z];
        // SAFETY: the model and data belong together, `jacobian` has 3 nv numbers and the link exists (body indices
        // come from this robot); a null pointer leaves the rotational part out.
        unsafe {
            mujoco_c::mj_jac(
                self.data.model().ffi(),
                self.data.ffi(),
                jacobian.as_mut_ptr(),
                std::ptr::null_mut(),
                &raw const point,
                i32::try_from(link).unwrap_or(0),
            );
        }
    }

    /// Jacobian (3 x nv) of the angular velocity of `link`, world axes.
    ///
    /// # Panics
    /// When `jacobian` has another length.
    pub fn rotation_jacobian_into(&self, link: usize, jacobian: &mut [f64]) {
        assert_eq!(jacobian.len(), 3 * self.data.qvel().len(), "a 3 x nv Jacobian");
        let point = [0.0; 3];
        // SAFETY: as in `point_jacobian_into`.
        unsafe {
            mujoco_c::mj_jac(
                self.data.model().ffi(),
                self.data.ffi(),
                std::ptr::null_mut(),
                jacobian.as_mut_ptr(),
                &raw const point,
                i32::try_from(link).unwrap_or(0),
            );
        }
    }

    /// dJ/dt v of the point of `link` that is now at `world` (m) and of the link's rotation, world axes: the accelerations
    /// (m/s^2, rad/s^2) that the point and the link would have with `v` constant.
    pub fn drift(&mut self, link: usize, world: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let point = [world.x, world.y, world.z];
        let nv = self.data.qvel().len();
        let (linear, angular) = self.drift_jacobian.split_at_mut(3 * nv);
        // SAFETY: as in `point_jacobian_into`; both halves have 3 nv numbers.
        unsafe {
            mujoco_c::mj_jacDot(
                self.data.model().ffi(),
                self.data.ffi(),
                linear.as_mut_ptr(),
                angular.as_mut_ptr(),
                &raw const point,
                i32::try_from(link).unwrap_or(0),
            );
        }
        let (linear, angular) = self.drift_jacobian.split_at(3 * nv);
        [times_v(linear, self.data.qvel()), times_v(angular, self.data.qvel())]
    }

    /// Velocity of a point of a link in the world, m/s, for the speed that was set.
    pub fn point_velocity(&mut self, at: &LinkPoint) -> Vector3<f64> {
        let world = self.point(at);
        let mut jacobian = std::mem::take(&mut self.jacobian);
        self.point_jacobian_into(at.link, &world, &mut jacobian);
        let velocity = times_v(&jacobian, self.v());
        self.jacobian = jacobian;
        velocity
    }

    /// Angular velocity of a link in the world, rad/s, for the speed that was set.
    pub fn link_rate(&mut self, link: usize) -> Vector3<f64> {
        let mut jacobian = std::mem::take(&mut self.jacobian);
        self.rotation_jacobian_into(link, &mut jacobian);
        let rate = times_v(&jacobian, self.v());
        self.jacobian = jacobian;
        rate
    }

    /// Centre of mass in the world, m.
    #[must_use]
    pub fn com(&self) -> Vector3<f64> {
        self.data.subtree_com()[self.base].into()
    }

    /// Jacobian (3 x nv) of the centre of mass.
    ///
    /// # Panics
    /// When `jacobian` has another length.
    pub fn com_jacobian_into(&mut self, jacobian: &mut [f64]) {
        self.data.jac_subtree_com_into(self.base, jacobian);
    }

    /// Centroidal momentum matrix (6 x nv, row-major): momentum = A(q) v.
    ///
    /// Source: Orin, Goswami, Lee, Centroidal dynamics of a humanoid robot (2013), equation 1.
    ///
    /// # Panics
    /// When `matrix` has another length.
    pub fn momentum_matrix_into(&mut self, matrix: &mut [f64]) {
        let (linear, angular) = matrix.split_at_mut(3 * self.data.qvel().len());
        self.data.jac_subtree_com_into(self.base, linear);
        linear.iter_mut().for_each(|entry| *entry *= self.mass);
        self.data.angmom_mat_into(self.base, angular);
    }

    /// Centroidal momentum for the speed that was set: linear (kg m/s), then angular about the centre of mass
    /// (kg m^2/s), world axes.
    pub fn momentum(&mut self) -> [f64; 6] {
        self.data.subtree_vel();
        let linear = self.data.subtree_linvel()[self.base].map(|v| v * self.mass);
        let angular = self.data.subtree_angmom()[self.base];
        [linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]]
    }

    /// Kinetic energy for the state that was set, J.
    pub fn kinetic_energy(&mut self) -> f64 {
        self.data.energy_vel();
        self.data.energy()[1]
    }

    /// Joint-space mass matrix (nv x nv), rotor inertias included.
    #[must_use]
    pub fn mass_matrix(&self) -> DMatrix<f64> {
        let nv = self.data.qvel().len();
        let mut matrix = DMatrix::zeros(nv, nv);
        // The matrix is symmetric, so row- and column-major are the same; its size is right by construction.
        let _ = self.data.full_m(matrix.as_mut_slice());
        matrix
    }

    /// As [`Self::mass_matrix`], row-major into `matrix` (nv x nv), without allocating.
    ///
    /// # Panics
    /// When `matrix` has another length.
    pub fn mass_matrix_into(&self, matrix: &mut [f64]) {
        assert_eq!(matrix.len(), self.data.qvel().len().pow(2), "an nv x nv matrix");
        // Its size is right, as asserted.
        let _ = self.data.full_m(matrix);
    }

    /// Bias h(q, v) (nv) for the state that was set: M a + h = torques + J^T f. Coriolis, gravity, and damping where the
    /// model has any; not dry friction.
    ///
    /// # Panics
    /// When `bias` has another length.
    pub fn bias_into(&mut self, bias: &mut [f64]) {
        self.data.rne_into(false, bias);
        for (bias, passive) in bias.iter_mut().zip(self.data.qfrc_passive()) {
            *bias -= passive;
        }
    }

    /// Generalised forces (nv) that give the acceleration `a` (nv) in the state that was set while `forces` act on
    /// the robot: M a + h(q, v) - sum J^T f, equation (33) of paper 1. The first six are the wrench that the
    /// unactuated base would need: zero for a motion that is physically possible.
    ///
    /// Each force is a point of a link and a force on it in the world, N.
    ///
    /// # Panics
    /// When `a` or `torques` has another length.
    pub fn inverse_dynamics_into(&mut self, a: &[f64], forces: &[(LinkPoint, Vector3<f64>)], torques: &mut [f64]) {
        // Newton-Euler for the bias, the mass matrix for the acceleration: MuJoCo's own recursion with acceleration
        // leaves the rotor inertias out.
        self.bias_into(torques);
        let mut inertial = std::mem::take(&mut self.acceleration);
        assert_eq!(inertial.len(), a.len(), "an acceleration of length nv");
        // SAFETY: model and data belong together; both vectors have nv numbers, as asserted.
        unsafe { mujoco_c::mj_mulM(self.data.model().ffi(), self.data.ffi(), inertial.as_mut_ptr(), a.as_ptr()) };
        for (torque, inertial) in torques.iter_mut().zip(&inertial) {
            *torque += inertial;
        }
        self.acceleration = inertial;
        let nv = a.len();
        let mut jacobian = std::mem::take(&mut self.jacobian);
        for (at, force) in forces {
            let world = self.point(at);
            self.point_jacobian_into(at.link, &world, &mut jacobian);
            for (j, torque) in torques.iter_mut().enumerate() {
                *torque -= jacobian[j] * force.x + jacobian[nv + j] * force.y + jacobian[2 * nv + j] * force.z;
            }
        }
        self.jacobian = jacobian;
    }

    /// Effective mass (kg) of a point of a link along the unit vector `direction`: 1 / (n^T J M^-1 J^T n), what a
    /// ball would feel there if the joints were free.
    pub fn effective_mass(&mut self, at: &LinkPoint, direction: &Vector3<f64>) -> f64 {
        let nv = self.data.qvel().len();
        let world = self.point(at);
        let mut jacobian = vec![0.0; 3 * nv];
        self.point_jacobian_into(at.link, &world, &mut jacobian);
        let along = DVector::from_fn(nv, |j, _| {
            jacobian[j] * direction.x + jacobian[nv + j] * direction.y + jacobian[2 * nv + j] * direction.z
        });
        let Some(factor) = self.mass_matrix().cholesky() else { return f64::NAN };
        1.0 / along.dot(&factor.solve(&along))
    }

    /// The axis of a capsule geom (or twice the centre of a sphere) in the world, and its radius, m.
    #[must_use]
    pub fn capsule(&self, geom: usize) -> ([Vector3<f64>; 2], f64) {
        let model = self.data.model();
        let centre = Vector3::from(self.data.geom_xpos()[geom]);
        let [radius, half_length, _] = model.geom_size()[geom];
        if model.geom_type()[geom] == MjtGeomBase::mjGEOM_CAPSULE {
            let axis = Matrix3::from_row_slice(&self.data.geom_xmat()[geom]).column(2) * half_length;
            ([centre - axis, centre + axis], radius)
        } else {
            ([centre; 2], radius)
        }
    }

    /// The closest points on the axes of two capsules, and the gap between their surfaces (m, negative when they
    /// overlap): constraint (14) of paper 1 asks for a gap of at least zero.
    #[must_use]
    pub fn capsule_gap(&self, [first, second]: [usize; 2]) -> (SegmentPair, f64) {
        let (a, radius_a) = self.capsule(first);
        let (b, radius_b) = self.capsule(second);
        let pair = closest_points(a, b);
        (pair, pair.distance() - radius_a - radius_b)
    }

    /// The link that a geom is fixed to.
    #[must_use]
    pub fn geom_link(&self, geom: usize) -> usize {
        usize::try_from(self.data.model().geom_bodyid()[geom]).unwrap_or(0)
    }
}

/// J v for a 3 x nv Jacobian.
fn times_v(jacobian: &[f64], v: &[f64]) -> Vector3<f64> {
    let nv = v.len();
    let row = |i: usize| jacobian[i * nv..(i + 1) * nv].iter().zip(v).map(|(j, v)| j * v).sum();
    Vector3::new(row(0), row(1), row(2))
}
