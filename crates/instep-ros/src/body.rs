//! What the control loop drives: the interface, and the robot whose sensors come over ROS.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use instep_robot::Robot;
use instep_robot::control::{JointCommand, Sensors};
use instep_sim::trial::FALLEN_TILT;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Whether sensor readings can be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Freshness {
    /// They are new.
    Fresh,
    /// This sensor has not been heard, or not for too long.
    Silent(&'static str),
}

/// A robot, as the control loop sees it. Called once a tick; allocates nothing there.
pub(crate) trait Body: Send {
    /// Writes the newest readings over `sensors`, but for their time, and tells how new they are.
    fn sense(&mut self, sensors: &mut Sensors) -> Freshness;

    /// Carries out `command` for one period.
    fn act(&mut self, command: &JointCommand);

    /// A kick is about to begin.
    fn prepare(&mut self) {}

    /// Where base link and ball are in the world, where that is known: q (7), ball's centre (m), footprint (x, y, yaw).
    fn whereabouts(&mut self) -> Option<Whereabouts> {
        None
    }
}

/// Where a simulated robot and its ball are, world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Whereabouts {
    /// Base link: position (m) and quaternion (w, x, y, z).
    pub(crate) base: [f64; 7],
    /// Ball's centre, m.
    pub(crate) ball: [f64; 3],
    /// The footprint: x, y (m) and yaw (rad).
    pub(crate) footprint: [f64; 3],
}

/// Copies readings without allocating, once the vectors have their size.
pub(crate) fn copy(from: &Sensors, to: &mut Sensors) {
    let Sensors { time, joint_positions, joint_velocities, gyro, accelerometer, orientation, contact_forces, .. } =
        from;
    (to.time, to.gyro, to.accelerometer, to.orientation) = (*time, *gyro, *accelerometer, *orientation);
    to.joint_positions.clone_from(joint_positions);
    to.joint_velocities.clone_from(joint_velocities);
    to.contact_forces.clone_from(contact_forces);
    (to.centre_of_pressure, to.ball) = (from.centre_of_pressure, from.ball);
}

/// How far the base leans, rad.
pub(crate) fn tilt(orientation: [f64; 4]) -> f64 {
    let [w, x, y, z] = orientation;
    let up = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)) * Vector3::z();
    up.z.clamp(-1.0, 1.0).acos()
}

/// Whether an orientation is that of a fallen robot.
pub(crate) fn fallen(orientation: [f64; 4]) -> bool {
    tilt(orientation) > FALLEN_TILT
}

/// What came over ROS last, and when (by our own clock: the senders' may differ).
#[derive(Debug, Clone)]
pub(crate) struct Inbox {
    pub(crate) sensors: Sensors,
    pub(crate) joints_at: Option<Instant>,
    pub(crate) imu_at: Option<Instant>,
    /// Left and right centre of pressure.
    pub(crate) pressure_at: [Option<Instant>; 2],
}

impl Inbox {
    pub(crate) fn new(robot: &Robot) -> Self {
        let joints = robot.joints.len();
        let sensors = Sensors {
            joint_positions: vec![0.0; joints],
            joint_velocities: vec![0.0; joints],
            orientation: [1.0, 0.0, 0.0, 0.0],
            contact_forces: vec![0.0; robot.contacts.len()],
            ..Sensors::default()
        };
        Self { sensors, joints_at: None, imu_at: None, pressure_at: [None; 2] }
    }
}

/// A robot that is reached over ROS. Its commands are published by the wire's thread.
pub(crate) struct RosBody {
    robot: Arc<Robot>,
    inbox: Arc<Mutex<Inbox>>,
    /// The last copy, used while the wire's thread is writing.
    seen: Inbox,
    /// How old a reading may be.
    patience: Duration,
    weight: f64,
}

impl RosBody {
    pub(crate) fn new(robot: Arc<Robot>, inbox: Arc<Mutex<Inbox>>, patience: Duration) -> Self {
        let (seen, weight) = (Inbox::new(&robot), 9.81 * robot.mass());
        Self { robot, inbox, seen, patience, weight }
    }
}

impl Body for RosBody {
    fn sense(&mut self, sensors: &mut Sensors) -> Freshness {
        if let Ok(inbox) = self.inbox.try_lock() {
            copy(&inbox.sensors, &mut self.seen.sensors);
            (self.seen.joints_at, self.seen.imu_at) = (inbox.joints_at, inbox.imu_at);
            self.seen.pressure_at = inbox.pressure_at;
        }
        copy(&self.seen.sensors, sensors);
        let fresh = |at: Option<Instant>| at.is_some_and(|at| at.elapsed() < self.patience);
        // A centre of pressure tells where, not how much: the weight is split evenly between the feet that have one.
        let loaded =
            [0, 1].map(|side| sensors.centre_of_pressure[side].is_some() && fresh(self.seen.pressure_at[side]));
        let feet = loaded.iter().filter(|&&on| on).count();
        for side in [0, 1] {
            if !loaded[side] {
                sensors.centre_of_pressure[side] = None;
            }
        }
        for (contact, force) in self.robot.contacts.iter().zip(&mut sensors.contact_forces) {
            let side = contact.leg as usize;
            let points = self.robot.contacts.iter().filter(|other| other.leg == contact.leg).count();
            *force = if loaded[side] { self.weight / (feet * points) as f64 } else { 0.0 };
        }
        if !fresh(self.seen.joints_at) {
            Freshness::Silent("joint_states")
        } else if !fresh(self.seen.imu_at) {
            Freshness::Silent("imu/data")
        } else {
            Freshness::Fresh
        }
    }

    fn act(&mut self, _command: &JointCommand) {}
}
