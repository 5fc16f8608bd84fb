//! A foreign model boiled down to what a robot is here: a tree of links that hinges join, hung on one free base.
//!
//! Everything is taken from the model as MuJoCo compiled it, so that includes, defaults, meshes and URDF need no thought any more: masses,
//! joints and the points of the links' surfaces, in the world's axes with every joint at zero. What is no hinge is held at zero and said:
//! slides, ball joints, fingers, followers (mimic). Links without a joint join the link that they are fixed to. Loops are opened and said.

use std::collections::{BTreeMap, BTreeSet};

use mujoco_rs::prelude::*;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::check::markup::Markup;
use crate::check::outline::{actuator_torques, index};

/// Least mass of a link that moves, kg: MuJoCo wants one.
const LEAST_MASS: f64 = 0.01;
/// A subtree lighter than this share of the robot, beside another such at the end of an arm, is a finger.
const FINGER: f64 = 0.015;
/// Joints between the base and a hand, at least.
const HAND_DEPTH: usize = 4;
/// A follower whose links weigh less than this share is a part of a hand or of a linkage.
const FOLLOWER: f64 = 0.02;

/// One hinge.
#[derive(Debug, Clone)]
pub(super) struct Hinge {
    pub(super) name: String,
    /// World axis.
    pub(super) axis: Vector3<f64>,
    pub(super) range: Option<[f64; 2]>,
    /// Largest torque, N m: the joint's own or its actuator's.
    pub(super) torque: Option<f64>,
    /// Largest speed, rad/s.
    pub(super) speed: Option<f64>,
    pub(super) armature: f64,
    pub(super) friction: f64,
    pub(super) damping: f64,
    /// Its angle in the model's standing keyframe, where there is one, rad.
    pub(super) key: Option<f64>,
}

/// One link; lengths in the world's axes, all joints at zero.
#[derive(Debug, Clone)]
pub(super) struct Link {
    pub(super) name: String,
    pub(super) parent: Option<usize>,
    /// Where its hinge is, m.
    pub(super) origin: Vector3<f64>,
    pub(super) mass: f64,
    pub(super) com: Vector3<f64>,
    /// About the centre of mass.
    pub(super) inertia: Matrix3<f64>,
    /// `world_from_link`, all joints at zero: the world's axes, but for a foot whose zero is not level.
    pub(super) turn: Matrix3<f64>,
    /// `None` for the base alone.
    pub(super) hinge: Option<Hinge>,
    /// Points of its surface, m.
    pub(super) points: Vec<Vector3<f64>>,
}

/// A camera of the model.
#[derive(Debug, Clone)]
pub(super) struct CameraAt {
    pub(super) link: usize,
    pub(super) name: String,
    pub(super) position: Vector3<f64>,
    /// Where it looks.
    pub(super) forward: Vector3<f64>,
    /// Height of its field of view, rad.
    pub(super) height: f64,
}

/// The whole robot.
#[derive(Debug, Clone)]
pub(super) struct Skeleton {
    pub(super) links: Vec<Link>,
    pub(super) cameras: Vec<CameraAt>,
    /// Inertial sensor in the base, where the model has one.
    pub(super) imu: Option<Vector3<f64>>,
    /// What is not as in the model, in words.
    pub(super) notes: Vec<String>,
}

/// What keeps a model from being a robot: what was found, and what would be right.
pub(super) type Fault = (String, String);

impl Skeleton {
    pub(super) fn new(model: &std::sync::Arc<MjModel>, markup: &Markup) -> Result<Self, Fault> {
        let mut notes = Vec::new();
        let base = base(model, &mut notes)?;
        let mut data = MjData::new(std::sync::Arc::clone(model));
        let kinds = model.jnt_type();
        for (joint, kind) in kinds.iter().enumerate() {
            let at = index(model.jnt_qposadr()[joint]);
            match kind {
                MjtJoint::mjJNT_HINGE | MjtJoint::mjJNT_SLIDE => data.qpos_mut()[at] = 0.0,
                MjtJoint::mjJNT_BALL => data.qpos_mut()[at..at + 4].copy_from_slice(&[1.0, 0.0, 0.0, 0.0]),
                MjtJoint::mjJNT_FREE => {
                    data.qpos_mut()[at..at + 7].copy_from_slice(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
                }
            }
        }
        data.kinematics();
        let place = |body: usize| Vector3::from(data.xpos()[body]);
        let turn = |body: usize| Matrix3::from_row_slice(&data.xmat()[body]);

        let parent = |body: usize| index(model.body_parentid()[body]);
        let within = |mut body: usize| {
            while body != base && body != 0 {
                body = parent(body);
            }
            body == base
        };
        let bodies: Vec<usize> = (1..model.body_parentid().len()).filter(|&body| within(body)).collect();
        let held = held(model, base, &bodies, markup, &mut notes);
        let torques = actuator_torques(model);
        let key = standing_key(model);
        let name = |kind, id: usize| model.id_to_name(kind, id).unwrap_or_default().to_owned();

        let mut names = BTreeSet::new();
        let mut unique = |wanted: String| {
            let mut name = wanted.clone();
            let mut n = 2;
            while !names.insert(name.clone()) {
                name = format!("{wanted}_{n}");
                n += 1;
            }
            name
        };
        let mut links: Vec<Link> = Vec::new();
        let mut link_of = vec![usize::MAX; model.body_parentid().len()];
        // The heaviest body that was joined into a link names it.
        let mut heaviest: Vec<f64> = Vec::new();
        for &body in &bodies {
            let hinges: Vec<usize> = (0..kinds.len())
                .filter(|&joint| index(model.jnt_bodyid()[joint]) == body && body != base && !held.contains(&joint))
                .collect();
            let called = name(MjtObjBase::mjOBJ_BODY, body);
            let called = if called.is_empty() { format!("link_{body}") } else { called };
            let mut at = if body == base { None } else { Some(link_of[parent(body)]) };
            for &joint in &hinges {
                let of_joint = name(MjtObjBase::mjOBJ_JOINT, joint);
                let of_joint = if of_joint.is_empty() { format!("{called}_joint") } else { of_joint };
                let dof = index(model.jnt_dofadr()[joint]);
                let axis = Vector3::from(data.xaxis()[joint]);
                let origin = Vector3::from(data.xanchor()[joint]);
                let last = hinges.last() == Some(&joint);
                let own = model.jnt_actfrclimited()[joint].then(|| model.jnt_actfrcrange()[joint][1]);
                links.push(Link {
                    name: unique(if last { called.clone() } else { format!("{called}_{of_joint}") }),
                    parent: at,
                    origin,
                    mass: 0.0,
                    com: origin,
                    inertia: Matrix3::zeros(),
                    turn: Matrix3::identity(),
                    hinge: Some(Hinge {
                        axis,
                        range: model.jnt_limited()[joint].then(|| model.jnt_range()[joint]),
                        torque: own.filter(|t| *t > 0.0).or(torques[joint]),
                        speed: markup.speeds.get(&of_joint).copied(),
                        armature: model.dof_armature()[dof],
                        friction: model.dof_frictionloss()[dof],
                        damping: model.dof_damping()[dof],
                        key: key.as_ref().map(|q| q[index(model.jnt_qposadr()[joint])]),
                        name: of_joint,
                    }),
                    points: Vec::new(),
                });
                heaviest.push(f64::INFINITY);
                at = Some(links.len() - 1);
            }
            if body == base {
                links.push(Link {
                    name: unique(called.clone()),
                    parent: None,
                    origin: place(body),
                    mass: 0.0,
                    com: place(body),
                    inertia: Matrix3::zeros(),
                    turn: Matrix3::identity(),
                    hinge: None,
                    points: Vec::new(),
                });
                heaviest.push(0.0);
                at = Some(0);
            }
            let Some(link) = at else { continue };
            link_of[body] = link;
            let [w, x, y, z] = model.body_iquat()[body];
            let axes = turn(body) * rotation([w, x, y, z]);
            let inertia = axes * Matrix3::from_diagonal(&Vector3::from(model.body_inertia()[body])) * axes.transpose();
            let com = place(body) + turn(body) * Vector3::from(model.body_ipos()[body]);
            let mass = model.body_mass()[body];
            // A root that weighs nothing, as ROS has it, is named by what is fixed to it.
            if link == 0 && mass > heaviest[0] && body != base {
                links[0].name = unique(called);
            }
            heaviest[link] = heaviest[link].max(mass);
            links[link].add(mass, com, inertia);
        }
        for (i, link) in links.iter_mut().enumerate() {
            if link.mass < LEAST_MASS {
                if i == 0 && link.mass <= 0.0 {
                    let found = format!("the base link \"{}\" has no mass", link.name);
                    return Err((found, "an <inertial> with mass and inertia for it".into()));
                }
                let radius = 0.02;
                link.add(LEAST_MASS, link.com, Matrix3::identity() * (0.4 * LEAST_MASS * radius * radius));
            }
        }
        points(model, &data, &link_of, &mut links);
        let cameras = (0..model.cam_bodyid().len())
            .filter(|&camera| link_of[index(model.cam_bodyid()[camera])] != usize::MAX)
            .map(|camera| {
                let body = index(model.cam_bodyid()[camera]);
                CameraAt {
                    link: link_of[body],
                    name: name(MjtObjBase::mjOBJ_CAMERA, camera),
                    position: place(body) + turn(body) * Vector3::from(model.cam_pos()[camera]),
                    // A camera of MuJoCo looks along its -z.
                    forward: -(turn(body) * rotation(model.cam_quat()[camera])).column(2).into_owned(),
                    height: model.cam_fovy()[camera].to_radians(),
                }
            })
            .collect();
        let imu = (0..model.sensor_type().len())
            .filter(|&s| matches!(model.sensor_type()[s], MjtSensor::mjSENS_GYRO | MjtSensor::mjSENS_ACCELEROMETER))
            .map(|s| index(model.sensor_objid()[s]))
            .find(|&site| link_of[index(model.site_bodyid()[site])] == 0)
            .map(|site| {
                let body = index(model.site_bodyid()[site]);
                place(body) + turn(body) * Vector3::from(model.site_pos()[site])
            });
        Ok(Self { links, cameras, imu, notes })
    }

    /// Turned about the vertical by `angle` (rad).
    pub(super) fn turned(mut self, angle: f64) -> Self {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle).to_rotation_matrix().into_inner();
        for link in &mut self.links {
            link.origin = turn * link.origin;
            link.com = turn * link.com;
            link.inertia = turn * link.inertia * turn.transpose();
            if let Some(hinge) = &mut link.hinge {
                hinge.axis = turn * hinge.axis;
            }
            link.points.iter_mut().for_each(|point| *point = turn * *point);
        }
        for camera in &mut self.cameras {
            camera.position = turn * camera.position;
            camera.forward = turn * camera.forward;
        }
        self.imu = self.imu.map(|imu| turn * imu);
        self
    }

    /// Mass of all links, kg.
    pub(super) fn mass(&self) -> f64 {
        self.links.iter().map(|link| link.mass).sum()
    }

    /// The link that the joint called `name` moves.
    pub(super) fn link_of(&self, joint: &str) -> Option<usize> {
        self.links.iter().position(|link| link.hinge.as_ref().is_some_and(|hinge| hinge.name == joint))
    }

    /// The first link that hangs on `link` by a hinge.
    pub(super) fn child(&self, link: usize) -> Option<usize> {
        self.links.iter().position(|other| other.parent == Some(link))
    }

    /// Least and greatest corner of a link's points, m.
    pub(super) fn bounds(&self, link: usize) -> Option<[Vector3<f64>; 2]> {
        let points = &self.links[link].points;
        let first = *points.first()?;
        Some(points.iter().fold([first; 2], |[low, high], p| [low.inf(p), high.sup(p)]))
    }
}

impl Link {
    /// Joins a rigid body: the parallel axis theorem.
    fn add(&mut self, mass: f64, com: Vector3<f64>, inertia: Matrix3<f64>) {
        let total = self.mass + mass;
        if total <= 0.0 {
            return;
        }
        let middle = (self.com * self.mass + com * mass) / total;
        let about = |mass: f64, from: Vector3<f64>| {
            let d = from - middle;
            (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * mass
        };
        self.inertia += about(self.mass, self.com) + inertia + about(mass, com);
        (self.mass, self.com) = (total, middle);
    }
}

fn rotation([w, x, y, z]: [f64; 4]) -> Matrix3<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)).to_rotation_matrix().into_inner()
}

/// The base: what has the free joint, else the child of the world on which most hinges hang.
fn base(model: &MjModel, notes: &mut Vec<String>) -> Result<usize, Fault> {
    let name = |body: usize| model.id_to_name(MjtObjBase::mjOBJ_BODY, body).unwrap_or_default().to_owned();
    let free: Vec<usize> = (0..model.jnt_type().len())
        .filter(|&joint| model.jnt_type()[joint] == MjtJoint::mjJNT_FREE)
        .map(|joint| index(model.jnt_bodyid()[joint]))
        .collect();
    match free.as_slice() {
        [base] => return Ok(*base),
        [] => {}
        several => {
            let names: Vec<String> = several.iter().map(|&body| format!("\"{}\"", name(body))).collect();
            return Err((
                format!("{} free joints, on {}", several.len(), names.join(" and ")),
                "one robot alone: one free joint, in its base link; leave balls, boxes and other robots out of the file".into(),
            ));
        }
    }
    let hinges = |root: usize| {
        let moves = |&&joint: &&i32| {
            let mut body = index(joint);
            while index(model.body_parentid()[body]) != 0 {
                body = index(model.body_parentid()[body]);
            }
            body == root
        };
        model.jnt_bodyid().iter().filter(moves).count()
    };
    let roots = (1..model.body_parentid().len()).filter(|&body| model.body_parentid()[body] == 0);
    let base = roots.max_by_key(|&root| (hinges(root), usize::MAX - root));
    let Some(base) = base.filter(|&root| hinges(root) > 0) else {
        return Err((
            format!("{} bodies and no joint", model.body_parentid().len().saturating_sub(1)),
            "a humanoid: a base with two legs, each of five to seven hinges".into(),
        ));
    };
    let own = (0..model.jnt_bodyid().len()).filter(|&joint| index(model.jnt_bodyid()[joint]) == base).count();
    if own > 0 {
        notes.push(format!("\"{}\" hung on the world by {own} joints; a free joint takes their place", name(base)));
    } else {
        notes.push(format!("no free joint in the model; \"{}\" got one", name(base)));
    }
    Ok(base)
}

/// Joints that are held at zero.
fn held(model: &MjModel, base: usize, bodies: &[usize], markup: &Markup, notes: &mut Vec<String>) -> BTreeSet<usize> {
    let name = |kind, id: usize| model.id_to_name(kind, id).unwrap_or_default().to_owned();
    let joint_name = |joint: usize| {
        let of_joint = name(MjtObjBase::mjOBJ_JOINT, joint);
        if of_joint.is_empty() {
            format!("of {}", name(MjtObjBase::mjOBJ_BODY, index(model.jnt_bodyid()[joint])))
        } else {
            of_joint
        }
    };
    let mut held = BTreeSet::new();
    let of = |body: usize| {
        (0..model.jnt_type().len()).filter(move |&joint| index(model.jnt_bodyid()[joint]) == body && body != base)
    };
    let total: f64 = model.body_subtreemass()[base];
    let (mut others, mut followers, mut fingers) = (Vec::new(), Vec::new(), Vec::new());
    for joint in bodies.iter().flat_map(|&body| of(body)) {
        let light = model.body_subtreemass()[index(model.jnt_bodyid()[joint])] < FOLLOWER * total;
        if model.jnt_type()[joint] != MjtJoint::mjJNT_HINGE {
            held.insert(joint);
            others.push(joint_name(joint));
        } else if markup.followers.contains(&name(MjtObjBase::mjOBJ_JOINT, joint)) {
            if light {
                held.insert(joint);
                followers.push(joint_name(joint));
            } else {
                notes.push(format!(
                    "\"{}\" follows another joint (mimic) in the model; here it has a drive of its own",
                    joint_name(joint)
                ));
            }
        }
    }
    // Depth in joints, from the base.
    let mut depth = vec![0_usize; model.body_parentid().len()];
    for &body in bodies {
        depth[body] = depth[index(model.body_parentid()[body])] + of(body).count();
    }
    // What hangs on one link by joints of its own.
    let mut carried: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for &body in bodies.iter().filter(|&&body| of(body).next().is_some()) {
        let mut carrier = index(model.body_parentid()[body]);
        while carrier != base && of(carrier).next().is_none() {
            carrier = index(model.body_parentid()[carrier]);
        }
        carried.entry(carrier).or_default().push(body);
    }
    let light = |&body: &usize| model.body_subtreemass()[body] < FINGER * total;
    let mut hands: BTreeSet<usize> = carried
        .into_iter()
        .filter(|(hand, parts)| depth[*hand] >= HAND_DEPTH && parts.len() >= 2 && parts.iter().all(light))
        .flat_map(|(_, parts)| parts)
        .collect();
    for &body in bodies {
        if hands.contains(&body) || hands.contains(&index(model.body_parentid()[body])) {
            hands.insert(body);
            fingers.extend(of(body).filter(|&joint| held.insert(joint)).map(joint_name));
        }
    }
    for (what, joints) in [
        ("no hinges, held still", others),
        ("followers (mimic), held still", followers),
        ("fingers, held still", fingers),
    ] {
        if !joints.is_empty() {
            notes.push(format!("{what}: {}", joints.join(", ")));
        }
    }
    for equality in 0..model.eq_type().len() {
        let kind = match model.eq_type()[equality] {
            MjtEq::mjEQ_CONNECT => "connect",
            MjtEq::mjEQ_WELD => "weld",
            MjtEq::mjEQ_JOINT => "joint",
            _ => "other",
        };
        let what = if kind == "joint" { MjtObjBase::mjOBJ_JOINT } else { MjtObjBase::mjOBJ_BODY };
        let ends = [model.eq_obj1id()[equality], model.eq_obj2id()[equality]]
            .into_iter()
            .filter(|&id| id >= 0)
            .map(|id| format!("\"{}\"", name(what, index(id))))
            .collect::<Vec<_>>()
            .join(" and ");
        notes.push(format!(
            "closed chain opened: the model couples {ends} ({kind}); here every hinge has a drive of its own"
        ));
    }
    held
}

/// Positions of the keyframe that stands: named so, else the first.
fn standing_key(model: &MjModel) -> Option<Vec<f64>> {
    let keys = usize::try_from(model.ffi().nkey).unwrap_or(0);
    let nq = model.qpos0().len();
    let named = |key: usize| {
        let name = model.id_to_name(MjtObjBase::mjOBJ_KEY, key).unwrap_or_default().to_lowercase();
        ["home", "stand", "knees_bent", "default"].iter().any(|word| name.contains(word))
    };
    let key = (0..keys).find(|&key| named(key)).or((keys > 0).then_some(0))?;
    model.key_qpos().get(key * nq..(key + 1) * nq).map(<[f64]>::to_vec)
}

/// Points of every link's surface: those of its colliding geoms, else of what is seen.
fn points(model: &MjModel, data: &MjData<std::sync::Arc<MjModel>>, link_of: &[usize], links: &mut [Link]) {
    let mut seen: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); links.len()];
    for geom in 0..model.geom_bodyid().len() {
        let link = link_of[index(model.geom_bodyid()[geom])];
        if link == usize::MAX {
            continue;
        }
        let place = Vector3::from(data.xpos()[index(model.geom_bodyid()[geom])]);
        let turn = Matrix3::from_row_slice(&data.xmat()[index(model.geom_bodyid()[geom])]);
        let axes = turn * rotation(model.geom_quat()[geom]);
        let centre = place + turn * Vector3::from(model.geom_pos()[geom]);
        let local = surface(model, geom);
        let solid = model.geom_contype()[geom] != 0 || model.geom_conaffinity()[geom] != 0;
        let to = if solid { &mut links[link].points } else { &mut seen[link] };
        to.extend(local.into_iter().map(|point| centre + axes * point));
    }
    for (link, seen) in links.iter_mut().zip(seen) {
        if link.points.is_empty() {
            link.points = seen;
        }
    }
}

/// Points of a geom's surface in its own frame, m.
fn surface(model: &MjModel, geom: usize) -> Vec<Vector3<f64>> {
    let [a, b, c] = model.geom_size()[geom];
    // Directions over the sphere: the corners and faces of a cube, and the edges' middles.
    let directions = || {
        (0..27)
            .map(|i| Vector3::new((i % 3) as f64 - 1.0, (i / 3 % 3) as f64 - 1.0, (i / 9) as f64 - 1.0))
            .filter(|d| d.norm() > 0.5)
    };
    match model.geom_type()[geom] {
        MjtGeomBase::mjGEOM_SPHERE => directions().map(|d| d.normalize() * a).collect(),
        MjtGeomBase::mjGEOM_ELLIPSOID => {
            directions().map(|d| d.normalize().component_mul(&Vector3::new(a, b, c))).collect()
        }
        MjtGeomBase::mjGEOM_BOX => directions().map(|d| d.component_mul(&Vector3::new(a, b, c))).collect(),
        MjtGeomBase::mjGEOM_CAPSULE => directions().map(|d| d.normalize() * a + Vector3::z() * (b * d.z)).collect(),
        MjtGeomBase::mjGEOM_CYLINDER => (0..16)
            .flat_map(|i| {
                let angle = std::f64::consts::TAU * f64::from(i) / 16.0;
                [-b, 0.0, b].map(|z| Vector3::new(a * angle.cos(), a * angle.sin(), z))
            })
            .collect(),
        MjtGeomBase::mjGEOM_MESH => {
            let Ok(mesh) = usize::try_from(model.geom_dataid()[geom]) else { return Vec::new() };
            let first = index(model.mesh_vertadr()[mesh]);
            let count = index(model.mesh_vertnum()[mesh]);
            model.mesh_vert()[first..first + count].iter().map(|v| Vector3::from(v.map(f64::from))).collect()
        }
        _ => Vec::new(),
    }
}
