//! Forward kinematics of a robot as plain numbers, for a control tick: link poses, joint axes and masses in the base
//! frame in a few microseconds, without MuJoCo's state.
//!
//! Source: the textbook recursion over the tree (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 4.3) with
//! MuJoCo's convention of a link's pose, joint anchor and axis. The base link is at the identity: everything is in the
//! base frame. A point's Jacobian column for joint j is axis x (point - anchor); the centre of mass's is that of the
//! joint's subtree, weighted by its share of the mass. Nothing here knows velocities, forces or the ground.

use instep_robot::{LinkPoint, Robot, closest_points};
use mujoco_rs::prelude::MjtGeomBase;
use nalgebra::{Matrix3, Quaternion, Unit, UnitQuaternion, Vector3};

/// One link of the tree.
#[derive(Debug, Clone)]
struct Link {
    parent: usize,
    position: Vector3<f64>,
    rotation: Matrix3<f64>,
    /// Joints of this link in order: index, axis and anchor in the link's frame.
    joints: Vec<(usize, Unit<Vector3<f64>>, Vector3<f64>)>,
    mass: f64,
    centre: Vector3<f64>,
}

/// A capsule fixed to a link.
#[derive(Debug, Clone, Copy)]
pub struct Capsule {
    /// The link.
    pub link: usize,
    /// Ends of the axis in the link's frame, m.
    pub ends: [Vector3<f64>; 2],
    /// Radius, m.
    pub radius: f64,
}

/// The tree of links. Immutable.
#[derive(Debug, Clone)]
pub struct Tree {
    base: usize,
    links: Vec<Link>,
    /// For each joint, whether it moves each link.
    moves: Vec<Vec<bool>>,
    /// The link of each joint.
    link_of: Vec<usize>,
    mass: f64,
    /// Pairs of capsules that must not touch.
    pairs: Vec<[Capsule; 2]>,
}

impl Tree {
    /// The tree of `robot`.
    #[must_use]
    pub fn new(robot: &Robot) -> Self {
        let model = robot.model();
        let count = model.body_parentid().len();
        let index = |i: i32| usize::try_from(i).unwrap_or(0);
        let mut links: Vec<Link> = (0..count)
            .map(|b| {
                let [w, x, y, z] = model.body_quat()[b];
                Link {
                    parent: index(model.body_parentid()[b]),
                    position: model.body_pos()[b].into(),
                    rotation: UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
                        .to_rotation_matrix()
                        .into_inner(),
                    joints: Vec::new(),
                    mass: model.body_mass()[b],
                    centre: model.body_ipos()[b].into(),
                }
            })
            .collect();
        let joints = robot.joints.len();
        let mut link_of = vec![0; joints];
        // Model joint 0 is the free joint.
        for (j, link) in link_of.iter_mut().enumerate() {
            *link = index(model.jnt_bodyid()[j + 1]);
            let axis = Unit::new_normalize(Vector3::from(model.jnt_axis()[j + 1]));
            links[*link].joints.push((j, axis, model.jnt_pos()[j + 1].into()));
        }
        let mut moves = vec![vec![false; count]; joints];
        for (j, row) in moves.iter_mut().enumerate() {
            for b in 1..count {
                row[b] = b == link_of[j] || (links[b].parent != 0 && row[links[b].parent]);
            }
        }
        let mut tree = Self { base: robot.base, links, moves, link_of, mass: robot.mass(), pairs: Vec::new() };
        tree.pairs = robot.self_collision.iter().map(|pair| pair.map(|geom| tree.capsule(robot, geom))).collect();
        tree
    }

    /// A capsule or sphere of the robot's model.
    #[must_use]
    pub fn capsule(&self, robot: &Robot, geom: usize) -> Capsule {
        let model = robot.model();
        let centre = Vector3::from(model.geom_pos()[geom]);
        let [w, x, y, z] = model.geom_quat()[geom];
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let [radius, half, _] = model.geom_size()[geom];
        let capsule = model.geom_type()[geom] == MjtGeomBase::mjGEOM_CAPSULE;
        let axis = turn * Vector3::z() * if capsule { half } else { 0.0 };
        Capsule {
            link: usize::try_from(model.geom_bodyid()[geom]).unwrap_or(0),
            ends: [centre - axis, centre + axis],
            radius,
        }
    }

    /// Mass of the robot, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Whether joint `joint` moves link `link`.
    #[must_use]
    pub fn moves(&self, joint: usize, link: usize) -> bool {
        self.moves[joint][link]
    }

    /// Scratch space.
    #[must_use]
    pub fn pose(&self) -> TreePose {
        let zero = Vector3::zeros();
        let (links, joints) = (self.links.len(), self.link_of.len());
        TreePose {
            position: vec![zero; links],
            rotation: vec![Matrix3::identity(); links],
            axis: vec![zero; joints],
            anchor: vec![zero; joints],
            moment: vec![zero; links],
            mass: vec![0.0; links],
        }
    }

    /// Computes all of `pose` for the joint angles (rad).
    pub fn update(&self, angles: &[f64], pose: &mut TreePose) {
        for (b, link) in self.links.iter().enumerate().skip(1) {
            let (mut position, mut rotation) = if b == self.base {
                (Vector3::zeros(), Matrix3::identity())
            } else {
                let (p, r) = (pose.position[link.parent], pose.rotation[link.parent]);
                (p + r * link.position, r * link.rotation)
            };
            for (j, axis, anchor) in &link.joints {
                let pivot = position + rotation * anchor;
                pose.anchor[*j] = pivot;
                pose.axis[*j] = rotation * axis.into_inner();
                rotation *= nalgebra::Rotation3::from_axis_angle(axis, angles[*j]).into_inner();
                position = pivot - rotation * anchor;
            }
            pose.position[b] = position;
            pose.rotation[b] = rotation;
            pose.mass[b] = link.mass;
            pose.moment[b] = (position + rotation * link.centre) * link.mass;
        }
        for b in (1..self.links.len()).rev() {
            let parent = self.links[b].parent;
            if parent != 0 {
                let (mass, moment) = (pose.mass[b], pose.moment[b]);
                pose.mass[parent] += mass;
                pose.moment[parent] += moment;
            }
        }
    }

    /// Centre of mass in the base frame, m.
    #[must_use]
    pub fn com(&self, pose: &TreePose) -> Vector3<f64> {
        pose.moment[self.base] / self.mass
    }

    /// Column of the centre of mass's Jacobian, m/rad.
    #[must_use]
    pub fn com_column(&self, pose: &TreePose, joint: usize) -> Vector3<f64> {
        let link = self.link_of[joint];
        pose.axis[joint].cross(&(pose.moment[link] - pose.anchor[joint] * pose.mass[link])) / self.mass
    }

    /// Column of the Jacobian of a point of `link` that is now at `point`, m/rad.
    #[must_use]
    pub fn point_column(&self, pose: &TreePose, joint: usize, link: usize, point: &Vector3<f64>) -> Vector3<f64> {
        if self.moves[joint][link] { pose.axis[joint].cross(&(point - pose.anchor[joint])) } else { Vector3::zeros() }
    }

    /// Column of the Jacobian of `link`'s angular velocity.
    #[must_use]
    pub fn turn_column(&self, pose: &TreePose, joint: usize, link: usize) -> Vector3<f64> {
        if self.moves[joint][link] { pose.axis[joint] } else { Vector3::zeros() }
    }

    /// The smallest gap between the surfaces of the pairs that must not touch, m, and which pair of the robot's
    /// self-collision list has it; infinite when there are none.
    #[must_use]
    pub fn least_gap(&self, pose: &TreePose) -> (f64, usize) {
        self.pairs
            .iter()
            .map(|[a, b]| closest_points(pose.axis_of(a), pose.axis_of(b)).distance() - a.radius - b.radius)
            .enumerate()
            .fold((f64::INFINITY, 0), |least, (pair, gap)| if gap < least.0 { (gap, pair) } else { least })
    }
}

/// A pose of the tree; scratch space of one thread.
#[derive(Debug, Clone)]
pub struct TreePose {
    /// Origin of each link, m.
    pub position: Vec<Vector3<f64>>,
    /// `base_from_link`.
    pub rotation: Vec<Matrix3<f64>>,
    /// Axis of each joint.
    pub axis: Vec<Vector3<f64>>,
    /// Anchor of each joint, m.
    pub anchor: Vec<Vector3<f64>>,
    /// Mass times centre of each link's subtree, kg m.
    moment: Vec<Vector3<f64>>,
    /// Mass of each link's subtree, kg.
    mass: Vec<f64>,
}

impl TreePose {
    /// A point of a link, m.
    #[must_use]
    pub fn point(&self, at: &LinkPoint) -> Vector3<f64> {
        self.position[at.link] + self.rotation[at.link] * at.point
    }

    /// The ends of a capsule's axis, m.
    #[must_use]
    pub fn axis_of(&self, capsule: &Capsule) -> [Vector3<f64>; 2] {
        capsule.ends.map(|end| self.position[capsule.link] + self.rotation[capsule.link] * end)
    }
}
