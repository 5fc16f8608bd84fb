//! Forward kinematics of a robot as plain numbers, for a control tick: link poses, joint axes and masses in the base
//! frame in a few microseconds, without MuJoCo's state.
//!
//! Source: the textbook recursion over the tree (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 4.3) with
//! MuJoCo's convention of a link's pose, joint anchor and axis. The base link is at the identity: everything is in the
//! base frame. A point's Jacobian column for joint j is axis x (point - anchor); the centre of mass's is that of the
//! joint's subtree, weighted by its share of the mass. Nothing here knows velocities, forces or the ground.

use mujoco_rs::prelude::MjtGeomBase;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::{LinkPoint, Robot, closest_points};

/// One link of the tree.
#[derive(Debug, Clone)]
struct Link {
    parent: usize,
    position: Vector3<f64>,
    rotation: Matrix3<f64>,
    /// Joints of this link in order.
    joints: Vec<Joint>,
    mass: f64,
    centre: Vector3<f64>,
}

/// A joint in its link's frame.
#[derive(Debug, Clone)]
struct Joint {
    index: usize,
    axis: Vector3<f64>,
    anchor: Vector3<f64>,
    /// The matrix of the cross product with the axis, and its square.
    cross: Matrix3<f64>,
    cross_square: Matrix3<f64>,
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
            let axis = Vector3::from(model.jnt_axis()[j + 1]).normalize();
            let (cross, anchor) = (axis.cross_matrix(), model.jnt_pos()[j + 1].into());
            links[*link].joints.push(Joint { index: j, axis, anchor, cross, cross_square: cross * cross });
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

    /// The link that joint `joint` moves first.
    #[must_use]
    pub fn link_of(&self, joint: usize) -> usize {
        self.link_of[joint]
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
            centre: vec![zero; links],
            moment: vec![zero; links],
            mass: vec![0.0; links],
        }
    }

    /// Links that at least one of `joints` moves, parents first: what [`Tree::update_links`] has to look at when nothing
    /// else has changed.
    #[must_use]
    pub fn links_moved_by(&self, joints: &[usize]) -> Vec<usize> {
        (1..self.links.len()).filter(|&link| joints.iter().any(|&joint| self.moves[joint][link])).collect()
    }

    /// `links` and those that carry them, parents first: all that [`Tree::place`] needs to place these.
    #[must_use]
    pub fn links_carrying(&self, links: &[usize]) -> Vec<usize> {
        let mut needed = vec![false; self.links.len()];
        for &link in links {
            let mut at = link;
            while at != 0 {
                needed[at] = true;
                at = self.links[at].parent;
            }
        }
        (1..self.links.len()).filter(|&link| needed[link]).collect()
    }

    /// Computes all of `pose` for the joint angles (rad).
    pub fn update(&self, angles: &[f64], pose: &mut TreePose) {
        self.place(1..self.links.len(), angles, pose);
        self.weigh(pose);
    }

    /// The same for a pose in which only joints have changed whose links are `links`.
    pub fn update_links(&self, links: &[usize], angles: &[f64], pose: &mut TreePose) {
        self.place(links.iter().copied(), angles, pose);
        self.weigh(pose);
    }

    /// Places `links` alone, parents first, in `pose`: positions, rotations, joint axes and anchors, no subtree's mass.
    pub fn place(&self, links: impl Iterator<Item = usize>, angles: &[f64], pose: &mut TreePose) {
        for b in links {
            let link = &self.links[b];
            let (mut position, mut rotation) = if b == self.base {
                (Vector3::zeros(), Matrix3::identity())
            } else {
                let (p, r) = (pose.position[link.parent], pose.rotation[link.parent]);
                (p + r * link.position, r * link.rotation)
            };
            for joint in &link.joints {
                let pivot = position + rotation * joint.anchor;
                pose.anchor[joint.index] = pivot;
                pose.axis[joint.index] = rotation * joint.axis;
                // Rodrigues' formula.
                let (sine, cosine) = angles[joint.index].sin_cos();
                rotation *= Matrix3::identity() + joint.cross * sine + joint.cross_square * (1.0 - cosine);
                position = pivot - rotation * joint.anchor;
            }
            pose.position[b] = position;
            pose.rotation[b] = rotation;
            pose.centre[b] = position + rotation * link.centre;
        }
    }

    /// Masses and moments of the subtrees.
    fn weigh(&self, pose: &mut TreePose) {
        for (b, link) in self.links.iter().enumerate().skip(1) {
            pose.mass[b] = link.mass;
            pose.moment[b] = pose.centre[b] * link.mass;
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
    /// Centre of mass of each link, m.
    centre: Vec<Vector3<f64>>,
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
