//! What a controller may see of the world: joint encoders, inertial sensor, foot pressure and a sight of the ball,
//! each late and noisy as [`crate::settings::SensorNoise`] says. Noise comes from a seeded, portable generator.

use instep_robot::Robot;
use instep_robot::control::{BallObservation, Sensors};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::settings::SensorNoise;
use crate::world::World;

/// Below this load (N) a foot has no centre of pressure.
const LOADED: f64 = 1.0;

/// The sensors of one robot, with the readings that are still under way.
#[derive(Debug, Clone)]
pub struct SensorSuite {
    noise: SensorNoise,
    /// Whether any reading is noisy.
    noisy: bool,
    rng: ChaCha8Rng,
    /// Readings of the last ticks, the newest at `newest`; as many as the longest delay needs.
    history: Vec<Sensors>,
    newest: usize,
    delay: usize,
    ball_delay: usize,
    imu_velocity: Option<Vector3<f64>>,
    forces: Vec<Vector3<f64>>,
}

impl SensorSuite {
    /// Sensors of `world`'s robot, with the noise of the world's settings drawn from `seed`.
    #[must_use]
    pub fn new(world: &World, seed: u64) -> Self {
        let robot = world.robot();
        let noise = world.settings().sensors;
        let steps = |delay: f64| (delay / world.settings().step.tick).round() as usize;
        let (delay, ball_delay) = (steps(noise.delay), steps(noise.delay + noise.ball_delay));
        let joints = robot.joints.len();
        let blank = Sensors {
            joint_positions: vec![0.0; joints],
            joint_velocities: vec![0.0; joints],
            orientation: [1.0, 0.0, 0.0, 0.0],
            contact_forces: vec![0.0; robot.contacts.len()],
            ..Sensors::default()
        };
        Self {
            noise,
            noisy: SensorNoise { delay: 0.0, ball_delay: 0.0, ..noise } != SensorNoise::default(),
            rng: ChaCha8Rng::seed_from_u64(seed),
            history: vec![blank; ball_delay.max(delay) + 1],
            newest: 0,
            delay,
            ball_delay,
            imu_velocity: None,
            forces: vec![Vector3::zeros(); robot.contacts.len()],
        }
    }

    /// Reads every sensor once; to be called after each tick, and once at the start.
    pub fn sense(&mut self, world: &World) {
        let first = self.imu_velocity.is_none();
        let mut draw = |deviation: f64| {
            if !self.noisy {
                return 0.0;
            }
            let sample: f64 = StandardNormal.sample(&mut self.rng);
            deviation * sample
        };
        self.newest = (self.newest + 1) % self.history.len();
        let robot = world.robot();
        let noise = &self.noise;
        let now = &mut self.history[self.newest];
        let (q, v) = (world.q(), world.v());
        now.time = world.time();
        for i in 0..robot.joints.len() {
            now.joint_positions[i] = q[7 + i] + draw(noise.joint_position);
            now.joint_velocities[i] = v[6 + i] + draw(noise.joint_velocity);
        }

        let world_from_base = orientation(q);
        let rate = Vector3::new(v[3], v[4], v[5]);
        now.gyro = [0, 1, 2].map(|k| rate[k] + draw(noise.gyro));
        let imu_velocity = Vector3::new(v[0], v[1], v[2]) + world_from_base * rate.cross(&robot.imu.point);
        let acceleration = (imu_velocity - self.imu_velocity.unwrap_or(imu_velocity)) / world.settings().step.tick;
        self.imu_velocity = Some(imu_velocity);
        let specific = world_from_base.inverse() * (acceleration + Vector3::new(0.0, 0.0, 9.81));
        now.accelerometer = [0, 1, 2].map(|k| specific[k] + draw(noise.accelerometer));
        let error = UnitQuaternion::from_scaled_axis(Vector3::from([0, 1, 2].map(|_| draw(noise.orientation))));
        let estimate = world_from_base * error;
        now.orientation = [estimate.w, estimate.i, estimate.j, estimate.k];

        world.contact_forces_into(&mut self.forces);
        for (reading, force) in now.contact_forces.iter_mut().zip(&self.forces) {
            *reading = (force.z * (1.0 + draw(noise.contact_force))).max(0.0);
        }
        now.centre_of_pressure = centre_of_pressure(robot, world, &now.contact_forces);

        let ball = Vector3::from(world.ball().position);
        let base = Vector3::new(q[0], q[1], 0.0);
        let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -world_from_base.euler_angles().2);
        let seen = heading * (ball - base);
        now.ball = Some(BallObservation {
            time: now.time,
            position: [seen.x + draw(noise.ball), seen.y + draw(noise.ball), seen.z],
        });
        if first {
            // Before the start everything was as it is now.
            let now = now.clone();
            self.history.fill(now);
        }
    }

    /// What the controller sees now, written over `sensors`.
    pub fn read_into(&self, time: f64, sensors: &mut Sensors) {
        let at = |delay: usize| &self.history[(self.newest + self.history.len() - delay) % self.history.len()];
        sensors.clone_from(at(self.delay));
        sensors.time = time;
        sensors.ball = at(self.ball_delay).ball;
    }
}

/// `world_from_base` of a position vector.
pub(crate) fn orientation(q: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[3], q[4], q[5], q[6]))
}

/// Centre of pressure of each foot in its sole frame, m.
fn centre_of_pressure(robot: &Robot, world: &World, forces: &[f64]) -> [Option<[f64; 2]>; 2] {
    let mut feet = [None; 2];
    for (foot, leg) in feet.iter_mut().zip(&robot.legs) {
        let (position, matrix) = world.link_pose(leg.sole.link);
        let mut load = 0.0;
        let mut moment = [0.0; 2];
        for (contact, force) in robot.contacts.iter().zip(forces) {
            if robot.leg(contact.leg).foot != leg.foot {
                continue;
            }
            let (origin, rotation) = world.link_pose(contact.at.link);
            let point = origin + rotation * contact.at.point;
            let local: Vector3<f64> = Matrix3::transpose(&matrix) * (point - position) - leg.sole.point;
            load += force;
            moment[0] += force * local.x;
            moment[1] += force * local.y;
        }
        *foot = (load > LOADED).then(|| moment.map(|m| m / load));
    }
    feet
}
