//! A model's structure as far as it matters for finding a robot in it: moving joints, links, chains and end points,
//! all in the model's zero pose.

use std::sync::Arc;

use mujoco_rs::prelude::*;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// A joint that is not the free one.
#[derive(Debug, Clone)]
pub(crate) struct JointOutline {
    /// Its name; empty where it has none.
    pub(crate) name: String,
    /// Its kind as MuJoCo names it, without the prefix: "hinge", "slide", "ball", "free".
    pub(crate) kind: &'static str,
    /// Link that it moves.
    pub(crate) link: usize,
    /// Axis in the world.
    pub(crate) axis: Vector3<f64>,
    /// Least and greatest angle, rad.
    pub(crate) range: Option<[f64; 2]>,
    /// Largest torque of the joint itself (`actuatorfrcrange`, URDF `effort`), N m.
    pub(crate) torque: Option<f64>,
    /// Largest torque that the model's own actuators imply, N m.
    pub(crate) actuator: Option<f64>,
    /// Inertia that a torque at the joint feels while every other joint is free, kg m^2.
    pub(crate) inertia: Option<f64>,
}

/// The structure of a compiled model in its zero pose.
pub(crate) struct Outline {
    pub(crate) model: Arc<MjModel>,
    /// Link origins in the world, m.
    pub(crate) positions: Vec<Vector3<f64>>,
    /// `world_from_link`.
    pub(crate) rotations: Vec<Matrix3<f64>>,
    /// Joints except a free one at the first place.
    pub(crate) joints: Vec<JointOutline>,
    /// Whether the first joint is free.
    pub(crate) free: bool,
    /// The base: the link with the free joint, else the first child of the world.
    pub(crate) base: Option<usize>,
}

impl Outline {
    pub(crate) fn new(model: MjModel) -> Self {
        let model = Arc::new(model);
        let mut data = MjData::new(Arc::clone(&model));
        data.kinematics();
        data.com_pos();
        data.make_m();
        let inertias = effective_inertias(&data);
        let positions = data.xpos().iter().copied().map(Vector3::from).collect();
        let rotations = data.xmat().iter().map(|m| Matrix3::from_row_slice(m)).collect();
        let axes: Vec<Vector3<f64>> = data.xaxis().iter().copied().map(Vector3::from).collect();
        let free = model.jnt_type().first() == Some(&MjtJoint::mjJNT_FREE);
        let actuators = actuator_torques(&model);
        let joints = (usize::from(free)..model.jnt_type().len())
            .map(|i| JointOutline {
                name: model.id_to_name(MjtObjBase::mjOBJ_JOINT, i).unwrap_or_default().to_owned(),
                kind: match model.jnt_type()[i] {
                    MjtJoint::mjJNT_HINGE => "hinge",
                    MjtJoint::mjJNT_SLIDE => "slide",
                    MjtJoint::mjJNT_BALL => "ball",
                    MjtJoint::mjJNT_FREE => "free",
                },
                link: index(model.jnt_bodyid()[i]),
                axis: axes[i],
                range: model.jnt_limited()[i].then(|| model.jnt_range()[i]),
                torque: model.jnt_actfrclimited()[i].then(|| model.jnt_actfrcrange()[i][1]).filter(|t| *t > 0.0),
                actuator: actuators[i],
                inertia: inertias.get(index(model.jnt_dofadr()[i])).copied().flatten(),
            })
            .collect();
        let base = if free {
            Some(index(model.jnt_bodyid()[0]))
        } else {
            (1..model.body_parentid().len()).find(|&link| model.body_parentid()[link] == 0)
        };
        Self { model, positions, rotations, joints, free, base }
    }

    /// A link's name; empty where it has none.
    pub(crate) fn link_name(&self, link: usize) -> &str {
        self.model.id_to_name(MjtObjBase::mjOBJ_BODY, link).unwrap_or_default()
    }

    /// A geom's name; empty where it has none.
    pub(crate) fn geom_name(&self, geom: usize) -> &str {
        self.model.id_to_name(MjtObjBase::mjOBJ_GEOM, geom).unwrap_or_default()
    }

    /// Number of links, the world left out.
    pub(crate) fn links(&self) -> usize {
        self.positions.len().saturating_sub(1)
    }

    fn parent(&self, link: usize) -> usize {
        index(self.model.body_parentid()[link])
    }

    /// Whether `link` is `ancestor` or hangs from it without a joint between them.
    pub(crate) fn moves_with(&self, mut link: usize, ancestor: usize) -> bool {
        while link != ancestor && link != 0 && self.model.body_dofnum()[link] == 0 {
            link = self.parent(link);
        }
        link == ancestor
    }

    /// For each joint from which no other hangs: the joints from the base to it, as indices into `joints`.
    pub(crate) fn chains(&self) -> Vec<Vec<usize>> {
        let chain_to = |mut link: usize| {
            let mut chain = Vec::new();
            while link != 0 {
                chain.extend((0..self.joints.len()).rev().filter(|&j| self.joints[j].link == link));
                link = self.parent(link);
            }
            chain.reverse();
            chain
        };
        let mut carries_more = vec![false; self.positions.len()];
        for joint in &self.joints {
            let mut link = self.parent(joint.link);
            while link != 0 {
                carries_more[link] = true;
                link = self.parent(link);
            }
        }
        let mut ends: Vec<usize> = self.joints.iter().map(|j| j.link).filter(|&link| !carries_more[link]).collect();
        ends.dedup();
        ends.into_iter().map(chain_to).filter(|chain| !chain.is_empty()).collect()
    }

    /// Geoms that move with `link`.
    pub(crate) fn geoms(&self, link: usize) -> impl Iterator<Item = usize> {
        (0..self.model.geom_bodyid().len()).filter(move |&g| self.moves_with(index(self.model.geom_bodyid()[g]), link))
    }

    /// Least and greatest corner of what moves with `link`, in the world, m; its origin where it has no geoms.
    pub(crate) fn bounds(&self, link: usize) -> [Vector3<f64>; 2] {
        let mut least = Vector3::repeat(f64::INFINITY);
        let mut greatest = -least;
        for geom in self.geoms(link) {
            let on = index(self.model.geom_bodyid()[geom]);
            let [w, x, y, z] = self.model.geom_quat()[geom];
            let turn = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
            let turn = self.rotations[on] * turn.to_rotation_matrix().into_inner();
            let origin = self.positions[on] + self.rotations[on] * Vector3::from(self.model.geom_pos()[geom]);
            let [cx, cy, cz, hx, hy, hz] = self.model.geom_aabb()[geom];
            let centre = origin + turn * Vector3::new(cx, cy, cz);
            let half = turn.abs() * Vector3::new(hx, hy, hz);
            // A plane has no bounds worth having.
            if half.iter().all(|h| h.is_finite() && *h < 10.0) {
                least = least.inf(&(centre - half));
                greatest = greatest.sup(&(centre + half));
            }
        }
        if least.x.is_finite() { [least, greatest] } else { [self.positions[link]; 2] }
    }
}

/// MuJoCo's indices are never negative where we ask.
pub(crate) fn index(id: i32) -> usize {
    usize::try_from(id).unwrap_or(0)
}

/// The largest torque that each joint's own actuator can give, N m, where the model limits it.
pub(crate) fn actuator_torques(model: &MjModel) -> Vec<Option<f64>> {
    let mut torques = vec![None; model.jnt_type().len()];
    for a in 0..model.actuator_trnid().len() {
        if !matches!(model.actuator_trntype()[a], MjtTrn::mjTRN_JOINT | MjtTrn::mjTRN_JOINTINPARENT) {
            continue;
        }
        let gear = model.actuator_gear().get(a).map_or(1.0, |gear| gear[0].abs());
        let torque = if model.actuator_forcelimited()[a] {
            Some(model.actuator_forcerange()[a][1] * gear)
        } else if model.actuator_biastype()[a] == MjtBias::mjBIAS_NONE
            && model.actuator_ctrllimited().get(a).copied().unwrap_or(false)
        {
            Some(model.actuator_ctrlrange()[a][1] * model.actuator_gainprm()[a][0] * gear)
        } else {
            None
        };
        let joint = index(model.actuator_trnid()[a][0]);
        if let (Some(torque), Some(place)) = (torque.filter(|t| *t > 0.0), torques.get_mut(joint)) {
            *place = Some(torque);
        }
    }
    torques
}

/// 1 / (M^-1)_jj for each degree of freedom, in the state of `data`; `None` where the mass matrix is no such.
pub(crate) fn effective_inertias(data: &MjData<Arc<MjModel>>) -> Vec<Option<f64>> {
    let nv = data.qvel().len();
    let mut matrix = DMatrix::zeros(nv, nv);
    if nv == 0 || data.full_m(matrix.as_mut_slice()).is_err() {
        return vec![None; nv];
    }
    let Some(factor) = matrix.cholesky() else { return vec![None; nv] };
    factor.inverse().diagonal().iter().map(|x| (*x > 0.0).then(|| 1.0 / x)).collect()
}
