//! Perceptions of the server as a player's senses.
//!
//! The server tells its torso's true place (to a millimetre) and orientation (to three digits), the joints, gyro and
//! accelerometer, and nothing of the soles. So a sole's load is told from how deep its corners stand in the soft ground, and
//! the speed from the accelerometer, the place and the foot that stands, as a complementary filter.
//!
//! A command takes effect a cycle after the perception that it answers, and then holds for a cycle. So everything that walking
//! sees is carried forward by that cycle with the accelerations that it asked for itself; what goes out is set for the middle of
//! the cycle in which it holds ([`lead`]).

use std::sync::Arc;

use instep_field::{LandmarkClass, Pose};
use instep_localisation::Sight;
use instep_player::{BallSight, Fix, RobotSight, Sights};
use instep_robot::control::{JointCommand, Sensors};
use instep_robot::{Robot, RobotData};
use instep_walk::StateEstimate;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::model::{CYCLE, Wiring};
use crate::perception::{Perception, Picture};

/// A corner of a sole that is lower than this stands on the ground, m; under the weight it sinks in by 6 mm.
const STANDS: f64 = 0.001;
/// How much of what the told place and the one standing leg say of the speed is believed in a cycle.
const BELIEVED: [f64; 2] = [0.6, 0.3];
/// Share of the weight from which a foot stands alone: while both carry, one of them slips or sinks.
const ALONE: f64 = 0.95;
/// A place that changes by this much in a cycle was not walked to, m.
const CARRIED: f64 = 0.25;
/// More acceleration than this is not believed to happen, m/s^2 and rad/s^2.
const WILDEST: f64 = 300.0;
/// Acceleration of free fall, m/s^2.
const GRAVITY: f64 = 9.81;
/// Standard deviation of the told pose: m, rad.
const TOLD: [f64; 2] = [0.01, 0.01];
/// Standard deviation of what is seen: the server gives two digits of m and degrees.
const SEEN: f64 = 0.02;

/// What became of a cycle's perception.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cycle {
    /// Senses are there.
    Good,
    /// Senses are there, and the robot stands elsewhere than before: it was put there.
    Carried,
    /// Something that belongs to a perception is missing.
    Incomplete,
}

/// The body of one player on the server.
#[derive(Debug)]
pub struct Body {
    robot: Arc<Robot>,
    wires: Vec<Wiring>,
    data: RobotData,
    /// Plays from the right: the world is turned by half a turn.
    right: bool,
    velocity: Vector3<f64>,
    /// Acceleration of the cycle before, m/s^2.
    felt: Vector3<f64>,
    last: Option<(f64, Vector3<f64>)>,
    sensors: Sensors,
    /// As the server tells it, in the own team's frame.
    now: StateEstimate,
    /// Carried forward to when a command takes effect.
    ahead: StateEstimate,
    mean: Vec<f64>,
}

impl Body {
    /// Of `robot`, whose joints are at `wires`.
    #[must_use]
    pub fn new(robot: Arc<Robot>, wires: Vec<Wiring>) -> Self {
        let sensors = Sensors {
            joint_positions: robot.stand[7..].to_vec(),
            joint_velocities: vec![0.0; robot.joints.len()],
            contact_forces: vec![0.0; robot.contacts.len()],
            orientation: [1.0, 0.0, 0.0, 0.0],
            ..Sensors::default()
        };
        Self {
            data: robot.data(),
            right: false,
            velocity: Vector3::zeros(),
            felt: Vector3::zeros(),
            last: None,
            sensors,
            now: StateEstimate::standing(&robot),
            ahead: StateEstimate::standing(&robot),
            mean: vec![0.0; robot.nv()],
            wires,
            robot,
        }
    }

    /// Which side the team plays from.
    pub fn set_side(&mut self, right: bool) {
        if self.right != right {
            self.right = right;
            self.last = None;
        }
    }

    /// Whether the team plays from the right.
    #[must_use]
    pub fn is_right(&self) -> bool {
        self.right
    }

    /// Joints and their motors.
    #[must_use]
    pub fn wires(&self) -> &[Wiring] {
        &self.wires
    }

    /// The body's readings.
    #[must_use]
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// The state when a command of now takes effect.
    #[must_use]
    pub fn ahead(&self) -> &StateEstimate {
        &self.ahead
    }

    /// The pose that the server tells, in the own team's frame.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose::new(self.now.q[0], self.now.q[1], heading(&self.now.q))
    }

    /// The pose as a fix.
    #[must_use]
    pub fn fix(&self) -> Fix {
        Fix { time: self.sensors.time, pose: self.pose(), std: TOLD }
    }

    /// Takes a perception. `acceleration` (6 + n) is what the command that is under way asks for.
    pub fn take(&mut self, perception: &Perception, acceleration: &[f64]) -> Cycle {
        let (Some(time), Some(gyro), Some(accelerometer), Some(orientation), Some(position)) =
            (perception.time, perception.gyro, perception.accelerometer, perception.orientation, perception.position)
        else {
            return Cycle::Incomplete;
        };
        for wire in &self.wires {
            let Some(reading) = perception.joints.iter().find(|reading| reading.name == wire.sensor) else {
                return Cycle::Incomplete;
            };
            self.sensors.joint_positions[wire.joint] = reading.angle;
            self.sensors.joint_velocities[wire.joint] = reading.speed;
        }
        let [w, x, y, z] = orientation;
        let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        if !turn.w.is_finite() {
            return Cycle::Incomplete;
        }
        let (turn, position) = if self.right {
            let half = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
            (half * turn, Vector3::new(-position[0], -position[1], position[2]))
        } else {
            (turn, Vector3::from(position))
        };
        let sensors = &mut self.sensors;
        (sensors.time, sensors.gyro, sensors.accelerometer) = (time, gyro, accelerometer);
        sensors.orientation = [turn.w, turn.i, turn.j, turn.k];

        let now = &mut self.now;
        now.time = time;
        now.q[..3].copy_from_slice(position.as_slice());
        now.q[3..7].copy_from_slice(&sensors.orientation);
        now.q[7..].copy_from_slice(&sensors.joint_positions);
        let before = self.last.replace((time, position));
        let since = before.map_or(0.0, |(before, _)| time - before);
        let moved = before.map_or(Vector3::zeros(), |(_, before)| position - before);
        let carried = before.is_none() || moved.norm() > CARRIED || !(since > 0.0 && since < 0.5);
        if carried {
            self.velocity = Vector3::zeros();
        }
        // Speed: the accelerometer's integral over the cycle, corrected by the way that was made in it and by the standing leg.
        now.v[..3].fill(0.0);
        now.v[3..6].copy_from_slice(&gyro);
        now.v[6..].copy_from_slice(&sensors.joint_velocities);
        let weight = self.robot.mass() * GRAVITY;
        self.data.set_state(&now.q, &now.v);
        let (legs, load) = stand(&self.robot, &mut self.data, weight, &mut sensors.contact_forces);
        let felt = turn * Vector3::from(accelerometer) - Vector3::new(0.0, 0.0, GRAVITY);
        let mean = 0.5 * (felt + self.felt);
        self.felt = felt;
        if !carried {
            // Half of the cycle's change is still to come when its way is half made.
            let way = moved / since + 0.5 * since * mean;
            self.velocity += since * mean;
            self.velocity += (way - self.velocity) * BELIEVED[0];
            if let Some(legs) = legs.filter(|_| load.iter().any(|load| *load > ALONE * weight)) {
                self.velocity += (legs - self.velocity) * BELIEVED[1];
            }
        }
        now.v[..3].copy_from_slice(self.velocity.as_slice());
        now.load = load;
        now.contact = load.map(|load| load > 0.0);

        self.predict(acceleration, if carried { 0.0 } else { CYCLE }, weight);
        if carried { Cycle::Carried } else { Cycle::Good }
    }

    /// Carries the state forward by `horizon` (s) with a constant `acceleration`.
    fn predict(&mut self, acceleration: &[f64], horizon: f64, weight: f64) {
        let (now, ahead) = (&self.now, &mut self.ahead);
        ahead.q.copy_from_slice(&now.q);
        ahead.v.copy_from_slice(&now.v);
        ahead.time = now.time;
        if horizon > 0.0 && acceleration.len() == self.mean.len() && acceleration.iter().all(|a| a.is_finite()) {
            for ((mean, v), a) in self.mean.iter_mut().zip(&mut ahead.v).zip(acceleration) {
                let a = a.clamp(-WILDEST, WILDEST);
                *mean = *v + 0.5 * horizon * a;
                *v += horizon * a;
            }
            self.data.integrate(&mut ahead.q, &self.mean, horizon);
        }
        self.data.set_state(&ahead.q, &ahead.v);
        let mut forces = [0.0; 32];
        let count = self.robot.contacts.len().min(forces.len());
        let (_, load) = stand(&self.robot, &mut self.data, weight, &mut forces[..count]);
        ahead.load = load;
        ahead.contact = load.map(|load| load > 0.0);
    }

    /// What the picture shows, in the robot's frame.
    pub fn see(&mut self, picture: &Picture, team: &str, number: u8) -> Sights {
        let mut sights = Sights { time: self.sensors.time, ..Sights::default() };
        let Some(camera) = self.robot.camera else { return sights };
        self.data.set_position(&self.now.q);
        let (eye, turn) =
            (self.data.point(&camera.at), self.data.link_rotation(camera.at.link) * camera.link_from_camera);
        let own = self.pose();
        sights.gaze_yaw = instep_field::wrap(heading_of(&turn) - own.heading);
        let ground = |polar: &crate::perception::Polar| {
            let world = eye + turn * polar.point();
            (own.local_from_outer([world.x, world.y]), world.z)
        };
        sights.ball = picture.ball.map(|ball| {
            let (position, height) = ground(&ball);
            BallSight { position, height, std: SEEN + 0.003 * ball.distance }
        });
        for (name, polar) in &picture.landmarks {
            let Some(class) = class(name) else { continue };
            let (position, height) = ground(polar);
            // A goal post is told by its top, which stands over its foot.
            if (class == LandmarkClass::GoalPost || height.abs() < 0.5) && position[0].hypot(position[1]) > 0.1 {
                sights.landmarks.push(Sight { class, position, confidence: 1.0, covariance: None });
            }
        }
        for seen in &picture.robots {
            if seen.team == team && seen.number == number {
                continue;
            }
            let head = seen.parts.iter().find(|(name, _)| name == "head").or(seen.parts.first());
            if let Some((name, polar)) = head {
                let (position, height) = ground(polar);
                let fallen = name == "head" && height < 0.5;
                sights.robots.push(RobotSight {
                    position,
                    mate: Some(seen.team == team),
                    number: Some(seen.number),
                    fallen,
                });
            }
        }
        sights
    }
}

/// Load of each contact point by how deep it stands in the ground, into `forces`; the base's velocity by the standing points, and
/// each foot's load.
fn stand(robot: &Robot, data: &mut RobotData, weight: f64, forces: &mut [f64]) -> (Option<Vector3<f64>>, [f64; 2]) {
    let mut depth = 0.0;
    for (contact, force) in robot.contacts.iter().zip(forces.iter_mut()) {
        *force = (STANDS - (data.point(&contact.at).z - contact.radius)).max(0.0);
        depth += *force;
    }
    if depth <= 0.0 {
        return (None, [0.0; 2]);
    }
    let (mut legs, mut load) = (Vector3::zeros(), [0.0; 2]);
    for (contact, force) in robot.contacts.iter().zip(forces.iter_mut()) {
        *force *= weight / depth;
        if *force > 0.0 {
            legs -= data.point_velocity(&contact.at) * *force;
            load[contact.leg as usize] += *force;
        }
    }
    (Some(legs / weight), load)
}

fn heading(q: &[f64]) -> f64 {
    let [w, x, y, z] = [q[3], q[4], q[5], q[6]];
    (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
}

fn heading_of(turn: &UnitQuaternion<f64>) -> f64 {
    let ahead = turn * Vector3::x();
    ahead.y.atan2(ahead.x)
}

/// What a landmark of the server is, by the first letter of its name.
fn class(name: &str) -> Option<LandmarkClass> {
    Some(match name.as_bytes() {
        [b'l', b'_', ..] => LandmarkClass::L,
        [b't', b'_', ..] => LandmarkClass::T,
        [b'x', b'_', ..] => LandmarkClass::X,
        [b'p', b'_', ..] => LandmarkClass::PenaltyMark,
        [b'g', b'_', ..] => LandmarkClass::GoalPost,
        _ => return None,
    })
}

/// Sets a command, whose positions are for the moment when it takes effect and whose speeds for a cycle later, to the middle of
/// the cycle in which it holds: the motors follow one place and one speed all that time. `acceleration` (6 + n) is what it asks for.
pub fn lead(command: &mut JointCommand, acceleration: &[f64]) {
    let JointCommand { positions, velocities, .. } = command;
    for (j, (position, velocity)) in positions.iter_mut().zip(velocities).enumerate() {
        *velocity -= 0.5 * CYCLE * acceleration.get(6 + j).copied().unwrap_or(0.0);
        *position += 0.5 * CYCLE * *velocity;
    }
}
