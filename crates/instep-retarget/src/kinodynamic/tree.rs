//! The robot as a tree of single-axis joints on a base with six coordinates: kinematics for the transcription.
//!
//! Coordinates `x` (6 + n): base position in the world (m); the base's yaw, pitch and roll (rad), its rotation being
//! Rz(yaw) Ry(pitch) Rx(roll); joint angles (rad). All of them live in a vector space, so that splines, differences
//! and bounds apply to them without exponential maps; the price is a singularity at a pitch of 90 degrees, which
//! [`MAX_PITCH`] keeps away from. A kicking robot does not come near it.
//!
//! Spatial vectors are in world axes about the world's origin, angular part first (R. Featherstone, Rigid Body
//! Dynamics Algorithms, 2008, chapters 2 and 5). Masses and geometry come from the compiled MuJoCo model; MuJoCo
//! itself is the oracle of the tests and of [`super::verify`].

use instep_robot::{LinkPoint, Robot};
use nalgebra::{Matrix3, Matrix6, Quaternion, Rotation3, UnitQuaternion, Vector3, Vector6};

/// Largest pitch of the base that the coordinates are used for, rad.
pub(crate) const MAX_PITCH: f64 = 1.2;

/// How a degree of freedom moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Along its axis.
    Slide,
    /// About its axis.
    Turn,
}

/// A joint of a body: its degree of freedom, its axis and its anchor in the body's frame.
#[derive(Debug, Clone, Copy)]
struct Hinge {
    dof: usize,
    axis: Vector3<f64>,
    anchor: Vector3<f64>,
}

/// A rigid body of the model.
#[derive(Debug, Clone)]
struct Body {
    parent: usize,
    position: Vector3<f64>,
    rotation: Matrix3<f64>,
    hinges: Vec<Hinge>,
    /// The last degree of freedom that moves it; none for the world.
    dof: Option<usize>,
    mass: f64,
    com: Vector3<f64>,
    /// About the centre of mass, body axes.
    inertia: Matrix3<f64>,
}

/// The robot's constant part.
#[derive(Debug, Clone)]
pub(crate) struct Tree {
    pub nv: usize,
    pub mass: f64,
    /// Magnitude of gravity, m/s^2, along -z.
    pub gravity: f64,
    pub parents: Vec<Option<usize>>,
    pub kinds: Vec<Kind>,
    /// Rotor inertias, kg m^2.
    pub armature: Vec<f64>,
    /// Viscous friction, N m s/rad.
    pub damping: Vec<f64>,
    /// For each degree of freedom, it and those that it hangs on, ascending.
    pub support: Vec<Vec<usize>>,
    bodies: Vec<Body>,
    base: usize,
}

/// Positions of all bodies and axes for one `x`.
#[derive(Debug, Clone)]
pub(crate) struct Pose {
    pub rotations: Vec<Matrix3<f64>>,
    pub positions: Vec<Vector3<f64>>,
    /// World axis of each degree of freedom.
    pub axes: Vec<Vector3<f64>>,
    /// A point on each axis, m.
    pub origins: Vec<Vector3<f64>>,
}

impl Tree {
    pub(crate) fn new(robot: &Robot) -> Self {
        let model = robot.model();
        let nv = robot.nv();
        let index = |i: i32| usize::try_from(i).unwrap_or(0);
        let turn = |q: &[f64; 4]| {
            *UnitQuaternion::new_normalize(Quaternion::new(q[0], q[1], q[2], q[3])).to_rotation_matrix().matrix()
        };
        let mut bodies: Vec<Body> = Vec::new();
        let mut parents: Vec<Option<usize>> = (0..6).map(|i: usize| i.checked_sub(1)).collect();
        let mut kinds = vec![Kind::Slide; 3];
        kinds.resize(nv, Kind::Turn);
        parents.resize(nv, None);
        for b in 0..model.body_mass().len() {
            let parent = index(model.body_parentid()[b]);
            let mut hinges = Vec::new();
            let mut dof = if b == 0 { None } else { bodies[parent].dof };
            if b == robot.base {
                dof = Some(5);
            } else {
                // Joint 0 is the free joint, so joint i turns degree of freedom 5 + i.
                for (joint, _) in model.jnt_bodyid().iter().enumerate().skip(1).filter(|(_, id)| index(**id) == b) {
                    let own = 5 + joint;
                    parents[own] = dof;
                    dof = Some(own);
                    let axis = Vector3::from(model.jnt_axis()[joint]);
                    hinges.push(Hinge { dof: own, axis, anchor: model.jnt_pos()[joint].into() });
                }
            }
            let axes = turn(&model.body_iquat()[b]);
            bodies.push(Body {
                parent,
                position: model.body_pos()[b].into(),
                rotation: turn(&model.body_quat()[b]),
                hinges,
                dof,
                mass: model.body_mass()[b],
                com: model.body_ipos()[b].into(),
                inertia: axes * Matrix3::from_diagonal(&model.body_inertia()[b].into()) * axes.transpose(),
            });
        }
        let mut support: Vec<Vec<usize>> = Vec::new();
        for (i, parent) in parents.iter().enumerate() {
            let mut chain: Vec<usize> = parent.map(|p: usize| support[p].clone()).unwrap_or_default();
            chain.push(i);
            support.push(chain);
        }
        let mass = bodies.iter().filter(|body| body.dof.is_some()).map(|body| body.mass).sum();
        let armature = model.dof_armature().to_vec();
        let damping = model.dof_damping().to_vec();
        Self { nv, mass, gravity: 9.81, parents, kinds, armature, damping, support, bodies, base: robot.base }
    }

    /// The degrees of freedom that move a link, ascending.
    pub(crate) fn chain(&self, link: usize) -> &[usize] {
        self.bodies.get(link).and_then(|body| body.dof).map_or(&[], |dof| &self.support[dof])
    }

    /// Room for the positions of one state.
    pub(crate) fn pose(&self) -> Pose {
        Pose {
            rotations: vec![Matrix3::identity(); self.bodies.len()],
            positions: vec![Vector3::zeros(); self.bodies.len()],
            axes: vec![Vector3::z(); self.nv],
            origins: vec![Vector3::zeros(); self.nv],
        }
    }

    /// Forward kinematics.
    pub(crate) fn place(&self, x: &[f64], pose: &mut Pose) {
        for (b, body) in self.bodies.iter().enumerate().skip(1) {
            if b == self.base {
                let at = Vector3::new(x[0], x[1], x[2]);
                let yaw = Rotation3::from_axis_angle(&Vector3::z_axis(), x[3]);
                let pitch = Rotation3::from_axis_angle(&Vector3::y_axis(), x[4]);
                let roll = Rotation3::from_axis_angle(&Vector3::x_axis(), x[5]);
                let turned = yaw * pitch;
                let axes =
                    [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::z(), yaw * Vector3::y(), turned * Vector3::x()];
                pose.axes[..6].copy_from_slice(&axes);
                pose.origins[..6].fill(at);
                pose.positions[b] = at;
                pose.rotations[b] = *(turned * roll).matrix();
                continue;
            }
            let mut rotation = pose.rotations[body.parent] * body.rotation;
            let mut position = pose.positions[body.parent] + pose.rotations[body.parent] * body.position;
            for hinge in &body.hinges {
                let anchor = position + rotation * hinge.anchor;
                pose.axes[hinge.dof] = rotation * hinge.axis;
                pose.origins[hinge.dof] = anchor;
                let axis = nalgebra::Unit::new_unchecked(hinge.axis);
                rotation *= *Rotation3::from_axis_angle(&axis, x[hinge.dof]).matrix();
                position = anchor - rotation * hinge.anchor;
            }
            pose.rotations[b] = rotation;
            pose.positions[b] = position;
        }
    }

    /// The motion of degree of freedom `i` as a spatial vector.
    pub(crate) fn axis(&self, pose: &Pose, i: usize) -> Vector6<f64> {
        let a = pose.axes[i];
        match self.kinds[i] {
            Kind::Slide => Vector6::new(0.0, 0.0, 0.0, a.x, a.y, a.z),
            Kind::Turn => {
                let u = pose.origins[i].cross(&a);
                Vector6::new(a.x, a.y, a.z, u.x, u.y, u.z)
            }
        }
    }

    /// Spatial inertia of what degree of freedom `i` carries rigidly, for all of them.
    pub(crate) fn inertias_into(&self, pose: &Pose, inertias: &mut [Matrix6<f64>]) {
        inertias.fill(Matrix6::zeros());
        for (b, body) in self.bodies.iter().enumerate() {
            let Some(dof) = body.dof else { continue };
            let rotation = pose.rotations[b];
            let c = pose.positions[b] + rotation * body.com;
            let cross = c.cross_matrix();
            let about = rotation * body.inertia * rotation.transpose() - cross * cross * body.mass;
            let into = &mut inertias[dof];
            add_block(into, 0, 0, &about);
            add_block(into, 0, 3, &(cross * body.mass));
            add_block(into, 3, 0, &(-cross * body.mass));
            add_block(into, 3, 3, &(Matrix3::identity() * body.mass));
        }
    }

    /// Velocity of the point `at` (world, m) of a link per unit speed of degree of freedom `i` of its chain.
    pub(crate) fn column(&self, pose: &Pose, i: usize, at: &Vector3<f64>) -> Vector3<f64> {
        match self.kinds[i] {
            Kind::Slide => pose.axes[i],
            Kind::Turn => pose.axes[i].cross(&(at - pose.origins[i])),
        }
    }

    /// Angular velocity per unit speed of degree of freedom `i`.
    pub(crate) fn turning(&self, pose: &Pose, i: usize) -> Vector3<f64> {
        match self.kinds[i] {
            Kind::Slide => Vector3::zeros(),
            Kind::Turn => pose.axes[i],
        }
    }

    /// Derivative of [`Self::column`] of `i` with respect to coordinate `j`, both of the same chain, for a point fixed
    /// to the link: a joint nearer the base turns the column as a whole, one farther out moves the point only.
    pub(crate) fn column_derivative(&self, pose: &Pose, i: usize, j: usize, at: &Vector3<f64>) -> Vector3<f64> {
        if j <= i {
            self.turning(pose, j).cross(&self.column(pose, i, at))
        } else {
            self.turning(pose, i).cross(&self.column(pose, j, at))
        }
    }

    /// `x` of the position `q` (7 + n) in the robot's convention, with the yaw within half a turn of `near`.
    pub(crate) fn coordinates(&self, q: &[f64], near: f64) -> Vec<f64> {
        let turn = UnitQuaternion::new_normalize(Quaternion::new(q[3], q[4], q[5], q[6]));
        let (roll, pitch, yaw) = turn.euler_angles();
        let tau = std::f64::consts::TAU;
        let yaw = yaw - tau * ((yaw - near) / tau).round();
        let mut x = vec![q[0], q[1], q[2], yaw, pitch, roll];
        x.extend_from_slice(&q[7..]);
        x
    }

    /// Position (7 + n) and speed (6 + n) in the robot's convention: the quaternion, and the base's angular velocity
    /// in its own frame.
    pub(crate) fn state(&self, x: &[f64], speed: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (yaw, pitch, roll) = (x[3], x[4], x[5]);
        let turn = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        let mut q = vec![x[0], x[1], x[2], turn.w, turn.i, turn.j, turn.k];
        q.extend_from_slice(&x[6..]);
        let omega = Vector3::z() * speed[3]
            + Rotation3::from_axis_angle(&Vector3::z_axis(), yaw) * Vector3::y() * speed[4]
            + turn * Vector3::x() * speed[5];
        let own = turn.inverse() * omega;
        let mut v = vec![speed[0], speed[1], speed[2], own.x, own.y, own.z];
        v.extend_from_slice(&speed[6..]);
        (q, v)
    }
}

impl Pose {
    /// A point of a link in the world, m.
    pub(crate) fn point(&self, at: &LinkPoint) -> Vector3<f64> {
        self.positions[at.link] + self.rotations[at.link] * at.point
    }
}

fn add_block(matrix: &mut Matrix6<f64>, row: usize, column: usize, block: &Matrix3<f64>) {
    let mut view = matrix.fixed_view_mut::<3, 3>(row, column);
    view += block;
}
