//! The robot keeps its camera on the ball: neck joints turn until the camera's axis points at where the ball was last seen, or
//! was said to be.
//!
//! Cyclic coordinate descent (Wang and Chen 1991, IEEE Transactions on Robotics and Automation 7(4)): each neck joint in turn
//! is set to the angle that brings the axis closest to the ball; one sweep a tick is enough for two joints. The base's height is
//! taken for that of the stand. The neck joints are found, not named: those between trunk and camera that carry nothing else. A
//! robot without any looks where its trunk looks.

use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_robot::senses::Camera;
use nalgebra::{UnitQuaternion, Vector3};

use crate::engine::{BreakOff, KickEngine, KickPlan, KickStart, Progress};
use crate::request::{KickRequest, Refusal};
use crate::stand::Standing;
use instep_robot::tree::{Tree, TreePose};

/// How fast the neck is turned, rad/s.
const SPEED: f64 = 2.0;
/// How far targets stay from a joint's stops, rad.
const MARGIN: f64 = 0.01;
/// An axis that is within this of a joint's axis (sine) cannot be turned about it.
const PARALLEL: f64 = 0.05;
/// Sweeps that take the neck to its angles from anywhere.
const SWEEPS: usize = 20;

/// A neck that follows the ball. A value of its own for each engine; allocates nothing once made.
#[derive(Debug, Clone)]
pub struct Gaze {
    tree: Tree,
    pose: TreePose,
    camera: Camera,
    /// Neck joints from the trunk on, each with the least and greatest angle, rad.
    neck: Vec<(usize, [f64; 2])>,
    /// Its angles in the stand, rad.
    stand: Vec<f64>,
    /// Links from the base to the camera.
    links: Vec<usize>,
    /// Height of the base above the ground, m.
    height: f64,
    /// From the base's ground projection to the footprint, both of the stand, m.
    footprint: [f64; 2],
    /// Angles of all joints; those of the neck are the last targets, rad.
    angles: Vec<f64>,
}

/// Joints of `robot`'s neck: those between trunk and camera that carry nothing else; none where there is no camera.
pub(crate) fn neck(robot: &Robot, tree: &Tree) -> Vec<usize> {
    let Some(camera) = robot.camera else { return Vec::new() };
    let joints = 0..robot.joints.len();
    let carries_camera = |joint: usize| tree.moves(joint, camera.at.link);
    joints
        .clone()
        .filter(|&joint| {
            let beyond = |&other: &usize| tree.moves(joint, tree.link_of(other));
            carries_camera(joint) && joints.clone().filter(beyond).all(carries_camera)
        })
        .collect()
}

impl Gaze {
    /// Of `robot`, whose footprint is at `footprint` (m, world) when it stands; `None` where it has no camera or no neck.
    #[must_use]
    pub fn of(robot: &Robot, footprint: [f64; 2]) -> Option<Self> {
        let camera = robot.camera?;
        let tree = Tree::new(robot);
        let neck: Vec<_> = neck(robot, &tree)
            .into_iter()
            .map(|joint| {
                let [least, greatest] = robot.joints[joint].range;
                (joint, [least + MARGIN, greatest - MARGIN])
            })
            .collect();
        if neck.is_empty() {
            return None;
        }
        let [x, y, height] = [robot.stand[0], robot.stand[1], robot.stand[2]];
        Some(Self {
            pose: tree.pose(),
            stand: neck.iter().map(|(joint, _)| robot.stand[7 + joint]).collect(),
            links: tree.links_carrying(&[camera.at.link]),
            tree,
            camera,
            neck,
            height,
            footprint: [footprint[0] - x, footprint[1] - y],
            angles: robot.stand[7..].to_vec(),
        })
    }

    /// Turns the neck in `angles` (rad, every joint) of a robot that stands to a ball at `ball` (m, footprint frame) on the
    /// ground.
    pub fn aim(&mut self, ball: [f64; 2], angles: &mut [f64]) {
        let ball = self.before_base(ball);
        for _ in 0..SWEEPS {
            self.turn(&ball, &UnitQuaternion::identity(), angles, f64::INFINITY);
        }
        for &(joint, _) in &self.neck {
            angles[joint] = self.angles[joint];
        }
    }

    /// A place on the ground of the footprint frame, in that of a sight: from the base's ground projection, m.
    fn before_base(&self, [x, y]: [f64; 2]) -> Vector3<f64> {
        Vector3::new(x + self.footprint[0], y + self.footprint[1], 0.0)
    }

    /// One sweep over the neck, of which each joint's target moves by at most `most` (rad), toward `ball` (m, from the base's
    /// ground projection, axes of the heading), with the base turned by `heading_from_base` and the other joints at `angles`.
    fn turn(&mut self, ball: &Vector3<f64>, heading_from_base: &UnitQuaternion<f64>, angles: &[f64], most: f64) {
        let ball = heading_from_base.inverse() * (ball - Vector3::z() * self.height);
        for (joint, angle) in angles.iter().enumerate() {
            if self.neck.iter().all(|(other, _)| *other != joint) {
                self.angles[joint] = *angle;
            }
        }
        for &(joint, [least, greatest]) in &self.neck {
            self.tree.place(self.links.iter().copied(), &self.angles, &mut self.pose);
            let axis = self.pose.axis[joint];
            let across = |v: Vector3<f64>| v - axis * axis.dot(&v);
            let ahead = self.pose.rotation[self.camera.at.link] * (self.camera.link_from_camera * Vector3::x());
            let (ahead, wanted) = (across(ahead), across(ball - self.pose.point(&self.camera.at)));
            if ahead.norm() < PARALLEL || wanted.norm() < PARALLEL * ball.norm() {
                continue;
            }
            let way = axis.dot(&ahead.cross(&wanted)).atan2(ahead.dot(&wanted)).clamp(-most, most);
            self.angles[joint] = (self.angles[joint] + way).clamp(least.min(greatest), greatest.max(least));
        }
    }
}

/// An engine whose robot looks at the ball: at the requested place until there is a sight, then at the last sight.
pub struct Gazing {
    engine: Box<dyn KickEngine + Send>,
    gaze: Gaze,
    /// Where the ball is, m, as a sight has it; `None` before the first plan and sight.
    ball: Option<Vector3<f64>>,
    /// Of the last tick, s.
    time: Option<f64>,
}

impl Gazing {
    /// `engine` with the neck of `gaze`.
    #[must_use]
    pub fn new(engine: Box<dyn KickEngine + Send>, gaze: Gaze) -> Self {
        Self { engine, gaze, ball: None, time: None }
    }
}

impl Controller for Gazing {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        self.engine.tick(sensors, command);
        if let Some(sight) = &sensors.ball {
            self.ball = Some(sight.position.into());
        }
        let Some(ball) = self.ball else { return };
        let since = self.time.map(|time| sensors.time - time);
        self.time = Some(sensors.time);
        if since.is_none() {
            // The neck goes on from where it is.
            for &(joint, _) in &self.gaze.neck {
                self.gaze.angles[joint] = sensors.joint_positions[joint];
            }
        }
        let [w, x, y, z] = sensors.orientation;
        let turned = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turned.euler_angles().2);
        let most = SPEED * since.unwrap_or(0.0).max(0.0);
        self.gaze.turn(&ball, &(yaw.inverse() * turned), &sensors.joint_positions, most);
        for &(joint, _) in &self.gaze.neck {
            command.positions[joint] = self.gaze.angles[joint];
            command.velocities[joint] = 0.0;
        }
    }
}

impl KickEngine for Gazing {
    fn name(&self) -> &'static str {
        self.engine.name()
    }

    fn control_period(&self) -> f64 {
        self.engine.control_period()
    }

    fn own_start(&self) -> Option<KickStart> {
        self.engine.own_start()
    }

    fn plan(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<KickPlan, Refusal> {
        // The neck is not the engine's, which takes it for that of the stand.
        let mut told = sensors.clone();
        for (&(joint, _), stand) in self.gaze.neck.iter().zip(&self.gaze.stand) {
            if let Some(angle) = told.joint_positions.get_mut(joint) {
                *angle = *stand;
            }
        }
        let plan = self.engine.plan(request, &told)?;
        self.ball = Some(self.gaze.before_base(request.ball));
        self.time = None;
        Ok(plan)
    }

    fn update(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<(), Refusal> {
        self.engine.update(request, sensors)
    }

    fn where_to_stand(&mut self, request: &KickRequest) -> Option<Standing> {
        self.engine.where_to_stand(request)
    }

    fn release(&mut self) {
        self.engine.release();
    }

    fn cancel(&mut self) {
        self.engine.cancel();
    }

    fn progress(&self) -> Progress {
        self.engine.progress()
    }

    fn forecast(&self) -> Option<f64> {
        self.engine.forecast()
    }

    fn broken_off(&self) -> Option<BreakOff> {
        self.engine.broken_off()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn robot(name: &str) -> Robot {
        Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots").join(name)).unwrap()
    }

    fn neck(robot: &Robot) -> Option<Vec<&str>> {
        let gaze = Gaze::of(robot, [0.0; 2])?;
        Some(gaze.neck.iter().map(|(joint, _)| robot.joints[*joint].name.as_str()).collect())
    }

    #[test]
    fn the_neck_is_what_carries_the_camera_alone() {
        assert_eq!(neck(&robot("nao")), Some(vec!["HeadYaw", "HeadPitch"]));
        assert_eq!(neck(&robot("wolfgang")), Some(vec!["HeadPan", "HeadTilt"]));
        assert_eq!(neck(&robot("artemis")), Some(vec!["neck_yaw", "neck_pitch"]));
        // The camera sits on the trunk, which turns the arms too.
        assert_eq!(neck(&robot("prestoe")), None);
    }

    /// The ball's direction in the camera's frame after the neck was turned to it, and whether it is in the picture.
    fn aimed(robot: &Robot, ball: [f64; 2]) -> (Vector3<f64>, bool) {
        let mut q = robot.stand.clone();
        let base = [q[0], q[1]];
        Gaze::of(robot, base).unwrap().aim(ball, &mut q[7..]);
        for (joint, angle) in robot.joints.iter().zip(&q[7..]) {
            assert!((joint.range[0]..=joint.range[1]).contains(angle), "{}: {angle}", joint.name);
        }
        let camera = robot.camera.unwrap();
        let mut data = robot.data();
        data.set_position(&q);
        let turn = data.link_rotation(camera.at.link) * camera.link_from_camera;
        let place = Vector3::new(base[0] + ball[0], base[1] + ball[1], 0.0);
        let seen = turn.inverse() * (place - data.point(&camera.at));
        (seen.normalize(), camera.frames(&seen))
    }

    #[test]
    fn a_ball_at_the_feet_is_in_the_picture_and_one_before_the_robot_in_its_middle() {
        for name in ["nao", "wolfgang", "t1", "k1", "artemis"] {
            let robot = robot(name);
            for ball in [[0.18, 0.1], [0.22, -0.15], [0.3, 0.0], [1.0, 0.8]] {
                let (seen, framed) = aimed(&robot, ball);
                assert!(framed, "{name}: {ball:?} at {seen:?}");
            }
            let (seen, _) = aimed(&robot, [1.0, -0.4]);
            assert!(seen.x > 0.999, "{name}: {seen:?}");
        }
    }
}
