//! One robot of a world: where its numbers lie in MuJoCo's, its drives, and what is kept of it.

use std::sync::Arc;

use instep_field::Side;
use instep_robot::Robot;
use instep_robot::control::{JointCommand, drive_torque, torque_range_over_step};
use instep_robot::drive::{Drives, Measured};
use mujoco_rs::prelude::*;
use nalgebra::Vector3;

use super::{Entrant, GeomRole, JointPeak, orientation};
use crate::model::{foot_links, part, solid_geoms};
use crate::settings::{Fidelity, WorldSettings};

/// A robot of a world.
pub(super) struct Body {
    pub(super) robot: Arc<Robot>,
    pub(super) team: Side,
    /// Position at the start, 7 + n.
    pub(super) start: Vec<f64>,
    /// Where its numbers begin in the world's q and v.
    pub(super) at: [usize; 2],
    /// To be added to the index of a link for that of the world's body.
    pub(super) links: usize,
    /// Striking geoms as (geom, bounding radius).
    pub(super) strike: Vec<(usize, f64)>,
    /// `None`: ideal ones.
    pub(super) drives: Option<Drives>,
    /// Zeros of the encoders, which drives and sensors share, rad.
    pub(super) encoder_offsets: Vec<f64>,
    pub(super) peaks: Vec<JointPeak>,
    pub(super) motor_work: f64,
    /// Force on the base link's centre of mass, N.
    pub(super) push: Vector3<f64>,
    pub(super) push_work: f64,
}

impl Body {
    /// Robot `index` in `model`, whose q, v and links before its own are `before`; tells of its geoms.
    pub(super) fn new(
        index: usize,
        entrant: &Entrant,
        before: [usize; 3],
        model: &MjModel,
        settings: &WorldSettings,
        geoms: &mut [GeomRole],
        obstacles: &mut Vec<usize>,
    ) -> Result<Self, String> {
        let robot = Arc::clone(&entrant.robot);
        let [q, v, links] = before;
        let base = robot.base + links;
        if model.name_to_id(MjtObjBase::mjOBJ_BODY, &part(index, robot.link_name(robot.base))) != Some(base)
            || usize::try_from(model.body_dofadr()[base]) != Ok(v)
        {
            return Err(format!("the links of robot {index} ({}) are out of order", robot.name));
        }
        let world_geom = |geom: usize| {
            robot
                .model()
                .id_to_name(MjtObjBase::mjOBJ_GEOM, geom)
                .and_then(|name| model.name_to_id(MjtObjBase::mjOBJ_GEOM, &part(index, name)))
                .ok_or_else(|| format!("geom {geom} was lost in compilation"))
        };
        let mut strike = Vec::new();
        for &geom in robot.legs.iter().flat_map(|leg| &leg.strike) {
            let id = world_geom(geom)?;
            strike.push((id, model.geom_rbound()[id]));
        }
        for geom in solid_geoms(&robot) {
            obstacles.push(world_geom(geom)?);
        }
        let feet = foot_links(&robot);
        let own = links + 1..links + robot.model().body_parentid().len();
        for (role, &body) in geoms.iter_mut().zip(model.geom_bodyid()) {
            let body = usize::try_from(body).unwrap_or(0);
            if own.contains(&body) {
                *role = GeomRole { robot: Some(index), contact: None, above_feet: !feet.contains(&(body - links)) };
            }
        }
        for (i, contact) in robot.contacts.iter().enumerate() {
            geoms[world_geom(contact.geom)?].contact = Some(i);
        }
        // The stand, turned and carried to its place; at the origin it is kept to the last bit.
        let mut start = robot.stand.clone();
        let pose = entrant.pose;
        if pose != instep_field::Pose::default() {
            let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.heading);
            let turned = turn * orientation(&start);
            let at = turn * Vector3::new(start[0], start[1], 0.0);
            (start[0], start[1]) = (pose.x + at.x, pose.y + at.y);
            start[3..7].copy_from_slice(&[turned.w, turned.i, turned.j, turned.k]);
        }
        let joints = robot.joints.len();
        Ok(Self {
            team: entrant.team,
            start,
            at: [q, v],
            links,
            strike,
            drives: (settings.drives == Fidelity::AsBuilt).then(|| Drives::new(&robot)),
            encoder_offsets: vec![0.0; joints],
            peaks: vec![JointPeak::default(); joints],
            motor_work: 0.0,
            push: Vector3::zeros(),
            push_work: 0.0,
            robot,
        })
    }

    /// Its base link among the world's bodies.
    pub(super) fn base(&self) -> usize {
        self.robot.base + self.links
    }

    /// Name of the link that carries one of its geoms.
    pub(super) fn link_name(&self, data: &MjData<Box<MjModel>>, geom: usize) -> &str {
        let body = usize::try_from(data.model().geom_bodyid()[geom]).unwrap_or(0);
        self.robot.link_name(body - self.links)
    }

    /// Nothing has happened to it yet.
    pub(super) fn reset(&mut self) {
        if let Some(drives) = &mut self.drives {
            drives.reset();
        }
        self.peaks.fill(JointPeak::default());
        self.motor_work = 0.0;
        self.push = Vector3::zeros();
        self.push_work = 0.0;
    }

    /// Puts its drives' torques into the world for a step of `dt` (s) from `time` (s); returns their sum.
    pub(super) fn drive(&mut self, data: &mut MjData<Box<MjModel>>, command: &JointCommand, time: f64, dt: f64) -> f64 {
        if self.push != Vector3::zeros() {
            self.push_work += 0.5 * dt * self.push.dot(&self.base_com_velocity(data));
        }
        let [q_at, v_at] = self.at.map(|at| at + 6);
        let (mut torque_sum, mut load) = (0.0, 0.0);
        for (i, joint) in self.robot.joints.iter().enumerate() {
            let (q, v) = (data.qpos()[q_at + 1 + i], data.qvel()[v_at + i]);
            // 1 / D of M = L^T D L: the joint's inertia with the links below it free and those above it held.
            let inverse_inertia = data.q_ldiag_inv()[v_at + i];
            let torque = match &mut self.drives {
                Some(drives) => {
                    let position = q + self.encoder_offsets[i];
                    let now = Measured { position, velocity: v, voltage: 1.0, step: dt, inverse_inertia };
                    drives.torque(i, joint, now)
                }
                None => {
                    let target = (command.positions[i], command.velocities[i], command.torques[i]);
                    let wanted = drive_torque(joint, target.0, target.1, target.2, q, v);
                    let [least, greatest] = torque_range_over_step(joint, v, dt * inverse_inertia, 1.0);
                    wanted.clamp(least, greatest)
                }
            };
            load += torque.abs();
            torque_sum += torque;
            self.motor_work += 0.5 * dt * torque * v;
            data.qfrc_applied_mut()[v_at + i] = torque;
            let peak = &mut self.peaks[i];
            if torque.abs() > peak.torque {
                (peak.torque, peak.torque_time) = (torque.abs(), time);
            }
            if v.abs() > peak.speed {
                (peak.speed, peak.speed_time) = (v.abs(), time);
            }
        }
        if let Some(drives) = &mut self.drives {
            drives.loaded(load);
        }
        torque_sum
    }

    /// Books the second half of the work of a step of `dt` (s): by the mean of the speeds before and after it. Returns a sum that
    /// is finite when the state is.
    pub(super) fn account(&mut self, data: &MjData<Box<MjModel>>, dt: f64) -> f64 {
        let [q_at, v_at] = self.at;
        let mut speed_sum = 0.0;
        for i in v_at + 6..v_at + self.robot.nv() {
            let v = data.qvel()[i];
            speed_sum += v;
            self.motor_work += 0.5 * dt * data.qfrc_applied()[i] * v;
        }
        if self.push != Vector3::zeros() {
            self.push_work += 0.5 * dt * self.push.dot(&self.base_com_velocity(data));
        }
        speed_sum + data.qpos()[q_at + 2]
    }

    /// Velocity of the base link's centre of mass, m/s.
    fn base_com_velocity(&self, data: &MjData<Box<MjModel>>) -> Vector3<f64> {
        let (q, v) = (&data.qpos()[self.at[0]..], &data.qvel()[self.at[1]..]);
        let centre = Vector3::from(data.model().body_ipos()[self.base()]);
        let spin = orientation(q) * Vector3::new(v[3], v[4], v[5]).cross(&centre);
        Vector3::new(v[0], v[1], v[2]) + spin
    }
}
