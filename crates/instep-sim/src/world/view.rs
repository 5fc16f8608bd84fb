//! One robot of a world as it can be looked at: what its sensors are made of, and what a trial or a match measures.

use std::sync::Arc;

use instep_field::Side;
use instep_robot::Robot;
use instep_robot::senses::Camera;
use mujoco_rs::mujoco_c;
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::body::Body;
use super::{BallState, JointPeak, World, contact_force, orientation};
use crate::settings::WorldSettings;
use crate::trial::FALLEN_TILT;

/// Height of the base link, as a share of its standing height, below which the robot counts as fallen.
const FALLEN_HEIGHT: f64 = 0.5;

/// One robot of a world. Positions and speeds are in the world's frame, m, rad, s.
#[derive(Clone, Copy)]
pub struct View<'a> {
    world: &'a World,
    body: &'a Body,
}

impl std::fmt::Debug for View<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("View").field("robot", &self.body.robot.name).finish_non_exhaustive()
    }
}

impl<'a> View<'a> {
    pub(super) fn new(world: &'a World, body: &'a Body) -> Self {
        Self { world, body }
    }

    /// The robot.
    #[must_use]
    pub fn robot(&self) -> &'a Arc<Robot> {
        &self.body.robot
    }

    /// Whose player it is.
    #[must_use]
    pub fn team(&self) -> Side {
        self.body.team
    }

    /// The world's constants.
    #[must_use]
    pub fn settings(&self) -> &'a WorldSettings {
        &self.world.settings
    }

    /// Since the last reset, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.world.time
    }

    /// The ball.
    #[must_use]
    pub fn ball(&self) -> BallState {
        self.world.ball()
    }

    /// Position, 7 + n.
    #[must_use]
    pub fn q(&self) -> &'a [f64] {
        let [at, _] = self.body.at;
        &self.world.data.qpos()[at..at + self.body.robot.nq()]
    }

    /// Speed, 6 + n.
    #[must_use]
    pub fn v(&self) -> &'a [f64] {
        let [_, at] = self.body.at;
        &self.world.data.qvel()[at..at + self.body.robot.nv()]
    }

    /// Position at the start, 7 + n: the heading from which the inertial sensor counts.
    #[must_use]
    pub fn start(&self) -> &'a [f64] {
        &self.body.start
    }

    /// The torques of the last step, N m.
    #[must_use]
    pub fn torques(&self) -> &'a [f64] {
        let [_, at] = self.body.at;
        &self.world.data.qfrc_applied()[at + 6..at + self.body.robot.nv()]
    }

    /// Each joint's peaks since the last reset.
    #[must_use]
    pub fn peaks(&self) -> &'a [JointPeak] {
        &self.body.peaks
    }

    /// Force of the ground on each contact point in the world, N, as of the last step; `forces` has one entry a point.
    pub fn contact_forces_into(&self, forces: &mut [Vector3<f64>]) {
        forces.fill(Vector3::zeros());
        for (i, contact) in self.world.data.contact().iter().enumerate() {
            let Some((geom, sign)) = self.on_ground(contact.geom) else { continue };
            if let Some(index) = self.world.geoms[geom].contact {
                forces[index] += contact_force(&self.world.data, i) * sign;
            }
        }
    }

    /// Whether a part of the robot other than its feet touches the ground.
    #[must_use]
    pub fn body_touches_ground(&self) -> bool {
        self.world.data.contact().iter().any(|contact| {
            let Some((geom, _)) = self.on_ground(contact.geom) else { return false };
            contact.dist < 0.0 && self.world.geoms[geom].above_feet
        })
    }

    /// Whether the robot lies: its body on the ground, the base lower than half its standing height or tilted beyond 60 degrees.
    #[must_use]
    pub fn has_fallen(&self) -> bool {
        let q = self.q();
        let up = orientation(q) * Vector3::z();
        let tilt = up.z.clamp(-1.0, 1.0).acos();
        let lowest = FALLEN_HEIGHT * self.body.robot.stand[2];
        q[2] < lowest || tilt > FALLEN_TILT || self.body_touches_ground()
    }

    /// The geom of this robot that a contact's pair has on the ground, and the sign of the pair's force on it.
    fn on_ground(&self, pair: [i32; 2]) -> Option<(usize, f64)> {
        let [a, b] = pair.map(|geom| usize::try_from(geom).unwrap_or(usize::MAX));
        let (geom, sign) = match (a == self.world.floor_geom, b == self.world.floor_geom) {
            (true, false) => (b, 1.0),
            (false, true) => (a, -1.0),
            _ => return None,
        };
        let robot = self.world.geoms.get(geom)?.robot?;
        std::ptr::eq(self.body, &raw const self.world.bodies[robot]).then_some((geom, sign))
    }

    /// Origin of a link (m) and `world_from_link`, as of the start of the last step.
    #[must_use]
    pub fn link_pose(&self, link: usize) -> (Vector3<f64>, Matrix3<f64>) {
        let (data, body) = (&self.world.data, link + self.body.links);
        (data.xpos()[body].into(), Matrix3::from_row_slice(&data.xmat()[body]))
    }

    /// `world_from_camera` of the robot's `camera`, m, as of the start of the last step.
    #[must_use]
    pub fn camera_pose(&self, camera: &Camera) -> Isometry3<f64> {
        let (origin, rotation) = self.link_pose(camera.at.link);
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Isometry3::from_parts((origin + rotation * camera.at.point).into(), turn * camera.link_from_camera)
    }

    /// `world_from_heading`: the base link's ground projection and its heading.
    #[must_use]
    pub fn heading(&self) -> Isometry3<f64> {
        let q = self.q();
        let yaw = orientation(q).euler_angles().2;
        Isometry3::new(Vector3::new(q[0], q[1], 0.0), Vector3::z() * yaw)
    }

    /// Whether nothing but the link `but` of this robot stands between `from` and the ball at `to` (m).
    pub(crate) fn sees(&self, from: Vector3<f64>, to: Vector3<f64>, but: usize) -> bool {
        let radius = self.world.settings.ball.radius;
        self.first_hit(from, to, but)
            .is_none_or(|(geom, hit)| geom == self.world.ball_geom || hit >= (to - from).norm() - radius)
    }

    /// The first geom on the ray from `from` through `to` (m) but those of this robot's link `but`, and its distance.
    pub(crate) fn first_hit(&self, from: Vector3<f64>, to: Vector3<f64>, but: usize) -> Option<(usize, f64)> {
        let way = to - from;
        let distance = way.norm();
        let (from, way) = ([from.x, from.y, from.z], [way.x / distance, way.y / distance, way.z / distance]);
        let mut geom = -1;
        let data = &self.world.data;
        // SAFETY: model and data belong together, the vectors have three numbers, no groups and no normal are asked for.
        let hit = unsafe {
            mujoco_c::mj_ray(
                data.model().ffi(),
                data.ffi(),
                &raw const from,
                &raw const way,
                std::ptr::null(),
                true,
                i32::try_from(but + self.body.links).unwrap_or(-1),
                &raw mut geom,
                std::ptr::null_mut(),
            )
        };
        usize::try_from(geom).ok().filter(|_| hit >= 0.0).map(|geom| (geom, hit))
    }
}
