//! Where the base is and how fast it moves, from joint encoders, inertial sensor and foot pressure alone.
//!
//! The accelerometer carries position and velocity forward; each contact point that bears weight is taken to stand still
//! where it first did, and pulls both back: the leg odometry of Bloesch et al., State estimation for legged robots
//! (2012), with fixed gains in place of a Kalman filter. The ground is level at z = 0. In flight nothing corrects it; a
//! foot that slides carries it along. It does not estimate orientation: the inertial sensor does.

use instep_robot::control::Sensors;
use instep_robot::{LinkPoint, Robot};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use instep_robot::tree::{Tree, TreePose};

/// Load from which a contact point counts as standing, N.
const LOADED: f64 = 15.0;
/// Time constant with which standing points correct the position, s.
const POSITION_TIME: f64 = 0.03;
/// Time constant with which they correct the velocity, s.
const VELOCITY_TIME: f64 = 0.03;
/// Standard gravity, m/s^2.
const GRAVITY: f64 = 9.81;

/// An estimate of the base's position and velocity in the world.
#[derive(Debug, Clone)]
pub struct Odometry {
    tree: Tree,
    pose: TreePose,
    /// The links between the base and the contact points.
    links: Vec<usize>,
    contacts: Vec<(LinkPoint, f64)>,
    /// For each contact point, its joints.
    movers: Vec<Vec<usize>>,
    imu: Vector3<f64>,
    /// Where each standing contact point stands, m.
    anchors: Vec<Option<Vector3<f64>>>,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    /// Velocity of the inertial sensor relative to the base link's origin at the last update, m/s.
    lever: Option<Vector3<f64>>,
    time: f64,
}

impl Odometry {
    /// For `robot`, at the world's origin and at rest.
    #[must_use]
    pub fn new(robot: &Robot) -> Self {
        let tree = Tree::new(robot);
        let contacts: Vec<_> = robot.contacts.iter().map(|contact| (contact.at, contact.radius)).collect();
        let movers = contacts
            .iter()
            .map(|(at, _)| (0..robot.joints.len()).filter(|&joint| tree.moves(joint, at.link)).collect())
            .collect();
        Self {
            pose: tree.pose(),
            links: tree.links_carrying(&contacts.iter().map(|(at, _)| at.link).collect::<Vec<_>>()),
            tree,
            movers,
            imu: robot.imu.point,
            anchors: vec![None; contacts.len()],
            contacts,
            position: Vector3::zeros(),
            velocity: Vector3::zeros(),
            lever: None,
            time: 0.0,
        }
    }

    /// Starts at `time` (s, of the sensors) with the base link's origin at `position` (m) moving at `velocity` (m/s).
    pub fn start(&mut self, time: f64, position: Vector3<f64>, velocity: Vector3<f64>) {
        self.anchors.fill(None);
        self.lever = None;
        (self.position, self.velocity, self.time) = (position, velocity, time);
    }

    /// Takes in one set of readings.
    pub fn update(&mut self, sensors: &Sensors) {
        let [w, x, y, z] = sensors.orientation;
        let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let rate = Vector3::from(sensors.gyro);
        let dt = (sensors.time - self.time).clamp(0.0, 0.1);
        self.time = sensors.time;
        // The accelerometer measures at its own point, which moves past the base link's origin by `lever`.
        let lever = turn * rate.cross(&self.imu);
        let acceleration = turn * Vector3::from(sensors.accelerometer) - Vector3::new(0.0, 0.0, GRAVITY);
        let before = self.velocity;
        self.velocity += acceleration * dt - (lever - self.lever.unwrap_or(lever));
        self.position += (before + self.velocity) * (0.5 * dt);
        self.lever = Some(lever);

        self.tree.place(self.links.iter().copied(), &sensors.joint_positions, &mut self.pose);
        let (mut load, mut position, mut velocity) = (0.0, Vector3::zeros(), Vector3::zeros());
        for (c, (at, radius)) in self.contacts.iter().enumerate() {
            let force = sensors.contact_forces[c];
            if force < LOADED {
                self.anchors[c] = None;
                continue;
            }
            let point = self.pose.point(at);
            let arm = turn * point;
            let place = self.position + arm;
            let anchor = *self.anchors[c].get_or_insert(Vector3::new(place.x, place.y, *radius));
            let joints: Vector3<f64> = self.movers[c]
                .iter()
                .map(|&j| self.tree.point_column(&self.pose, j, at.link, &point) * sensors.joint_velocities[j])
                .sum();
            load += force;
            position += (anchor - arm) * force;
            velocity -= turn * (rate.cross(&point) + joints) * force;
        }
        if load > 0.0 {
            let gain = |time: f64| 1.0 - (-dt / time).exp();
            self.position += (position / load - self.position) * gain(POSITION_TIME);
            self.velocity += (velocity / load - self.velocity) * gain(VELOCITY_TIME);
        }
    }

    /// Base link's origin in the world, m.
    #[must_use]
    pub fn position(&self) -> Vector3<f64> {
        self.position
    }

    /// Velocity of the base link's origin in the world, m/s.
    #[must_use]
    pub fn velocity(&self) -> Vector3<f64> {
        self.velocity
    }
}
