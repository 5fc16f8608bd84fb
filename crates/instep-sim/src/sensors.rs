//! What a controller may see of the world: joint encoders, inertial sensor, foot pressure and a sight of the ball, each
//! erring as the robot's `[senses]` say (in the ideal world not at all), and late and noisy beyond that as
//! [`crate::settings::SensorNoise`] says. All chance comes from a seeded, portable generator.

use instep_robot::Robot;
use instep_robot::control::{BallObservation, Sensors};
use instep_robot::senses::SenseSettings;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::settings::{Fidelity, SensorNoise};
use crate::sights::Sights;
use crate::world::{View, World};

/// The stream of chance from which the sensors' faults are drawn.
const FAULTS: u64 = 7;
/// How long the camera has looked before the start, s.
const LOOK_BACK: f64 = 0.6;
/// Below this load (N) a foot has no centre of pressure.
const LOADED: f64 = 1.0;

/// What is wrong with one robot's sensors for as long as it runs.
#[derive(Debug, Clone)]
struct Faults {
    /// Each encoder's zero, rad.
    encoders: Vec<f64>,
    /// rad/s.
    gyro: [f64; 3],
    /// m/s^2.
    accelerometer: [f64; 3],
    /// Roll and pitch, rad.
    tilt: Vector3<f64>,
    /// rad/s.
    yaw_rate: f64,
    /// Gain and zero (N) of each foot sensor.
    feet: Vec<[f64; 2]>,
}

impl Faults {
    fn draw(robot: &Robot, senses: &SenseSettings, rng: &mut ChaCha8Rng) -> Self {
        let mut draw = |deviation: f64| -> f64 {
            let sample: f64 = StandardNormal.sample(rng);
            deviation * sample
        };
        Self {
            encoders: robot.joints.iter().map(|_| draw(senses.encoder_offset)).collect(),
            gyro: [0, 1, 2].map(|_| draw(senses.gyro_bias)),
            accelerometer: [0, 1, 2].map(|_| draw(senses.accelerometer_bias)),
            tilt: Vector3::new(draw(senses.tilt_bias), draw(senses.tilt_bias), 0.0),
            yaw_rate: draw(senses.yaw_drift),
            feet: robot.contacts.iter().map(|_| [1.0 + draw(senses.foot_gain), draw(senses.foot_offset)]).collect(),
        }
    }
}

/// The sensors of one robot, with the readings that are still under way.
#[derive(Debug, Clone)]
pub struct SensorSuite {
    /// Whose they are in the world.
    who: usize,
    senses: SenseSettings,
    faults: Faults,
    /// Beside the senses' own.
    noise: SensorNoise,
    /// Whether any reading is noisy.
    noisy: bool,
    rng: ChaCha8Rng,
    /// Readings of the last ticks, the newest at `newest`; as many as the longest delay needs.
    history: Vec<Sensors>,
    newest: usize,
    delay: usize,
    ball_delay: usize,
    /// Ticks from one reading to the next.
    every: usize,
    ticks: usize,
    /// Joint angles of the last reading, rad.
    angles: Vec<f64>,
    imu_velocity: Option<Vector3<f64>>,
    forces: Vec<Vector3<f64>>,
    /// The camera's, where the robot has one.
    sights: Option<Sights>,
}

impl SensorSuite {
    /// Fits `world`'s (first) robot with its sensors; what is wrong with them and the noise are drawn from `seed`. The drives
    /// share the encoders.
    pub fn new(world: &mut World, seed: u64) -> Self {
        Self::of(world, 0, seed)
    }

    /// Fits robot `who` of `world` likewise.
    ///
    /// # Panics
    /// When there is no such robot.
    pub fn of(world: &mut World, who: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let robot = std::sync::Arc::clone(world.on(who).robot());
        let (noise, tick) = (world.settings().sensors, world.settings().step.tick);
        let as_built = world.settings().senses == Fidelity::AsBuilt;
        let senses = if as_built { robot.senses.clone() } else { SenseSettings::default() };
        // Drawn apart from the noise, so that each leaves the other as it is.
        let faults = Faults::draw(&robot, &senses, &mut stream(seed, FAULTS));
        world.set_encoder_offsets(who, &faults.encoders);
        let sights = robot
            .camera
            .filter(|_| as_built)
            .map(|camera| Sights::new(camera, [noise.ball, noise.delay + noise.ball_delay], &mut rng));
        let steps = |delay: f64| (delay / tick).round() as usize;
        let late = senses.delay + noise.delay;
        let (delay, ball_delay) = (steps(late), steps(late + noise.ball_delay));
        let joints = robot.joints.len();
        let blank = Sensors {
            joint_positions: vec![0.0; joints],
            joint_velocities: vec![0.0; joints],
            orientation: [1.0, 0.0, 0.0, 0.0],
            contact_forces: vec![0.0; robot.contacts.len()],
            ..Sensors::default()
        };
        let add = |own: f64, further: f64| own.hypot(further);
        let noise = SensorNoise {
            gyro: add(senses.gyro_noise, noise.gyro),
            accelerometer: add(senses.accelerometer_noise, noise.accelerometer),
            orientation: add(senses.orientation_noise, noise.orientation),
            contact_force: add(senses.foot_noise, noise.contact_force),
            ..noise
        };
        Self {
            who,
            noise,
            noisy: SensorNoise { delay: 0.0, ball_delay: 0.0, ..noise } != SensorNoise::default(),
            rng,
            history: vec![blank; ball_delay.max(delay) + 1],
            newest: 0,
            delay,
            ball_delay,
            every: if as_built { steps(robot.drives.period).max(1) } else { 1 },
            ticks: 0,
            angles: vec![0.0; joints],
            imu_velocity: None,
            forces: vec![Vector3::zeros(); robot.contacts.len()],
            senses,
            faults,
            sights,
        }
    }

    /// The robot was carried: the next reading is of where it is now, and nothing of before is still under way.
    pub fn carried(&mut self) {
        self.imu_velocity = None;
    }

    /// Reads every sensor whose turn it is; to be called after each tick, and once at the start.
    pub fn sense(&mut self, world: &World) {
        let first = self.imu_velocity.is_none();
        let world = &world.on(self.who);
        let robot = world.robot();
        let (q, v, tick) = (world.q(), world.v(), world.settings().step.tick);
        let world_from_base = orientation(q);
        let rate = Vector3::new(v[3], v[4], v[5]);
        let imu_velocity = Vector3::new(v[0], v[1], v[2]) + world_from_base * rate.cross(&robot.imu.point);
        let acceleration = (imu_velocity - self.imu_velocity.unwrap_or(imu_velocity)) / tick;
        self.imu_velocity = Some(imu_velocity);

        let before = self.newest;
        self.newest = (self.newest + 1) % self.history.len();
        let turn = first || self.ticks.is_multiple_of(self.every);
        self.ticks += 1;
        if let Some(sights) = &mut self.sights {
            if self.ticks == 1 {
                sights.look_back(world, LOOK_BACK, &mut self.rng);
            }
            sights.look(world, &mut self.rng);
        }
        if !turn {
            // Nothing new: the reading before holds on.
            if before != self.newest {
                let held = std::mem::take(&mut self.history[before]);
                self.history[self.newest].copy_from(&held);
                self.history[before] = held;
            }
            return;
        }
        let (noise, faults, senses) = (&self.noise, &self.faults, &self.senses);
        let (noisy, rng) = (self.noisy, &mut self.rng);
        let mut draw = |deviation: f64| {
            if !noisy {
                return 0.0;
            }
            let sample: f64 = StandardNormal.sample(rng);
            deviation * sample
        };
        let now = &mut self.history[self.newest];
        now.time = world.time();
        for i in 0..robot.joints.len() {
            let drawn = [draw(noise.joint_position), draw(noise.joint_velocity)];
            let angle = coarse(q[7 + i] + faults.encoders[i] + drawn[0], senses.encoder_resolution);
            // The step between two readings is all that an encoder knows of speed.
            let speed = if senses.encoder_resolution > 0.0 && !first {
                (angle - self.angles[i]) / (self.every as f64 * tick)
            } else {
                v[6 + i]
            };
            self.angles[i] = angle;
            now.joint_positions[i] = angle;
            now.joint_velocities[i] = speed + drawn[1];
        }

        now.gyro = [0, 1, 2].map(|k| rate[k] + faults.gyro[k] + draw(noise.gyro));
        let specific = world_from_base.inverse() * (acceleration + Vector3::new(0.0, 0.0, 9.81));
        now.accelerometer = [0, 1, 2].map(|k| specific[k] + faults.accelerometer[k] + draw(noise.accelerometer));
        let error = UnitQuaternion::from_scaled_axis(Vector3::from([0, 1, 2].map(|_| draw(noise.orientation))));
        let drift = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), faults.yaw_rate * world.time());
        let estimate =
            drift * from_start(world) * world_from_base * UnitQuaternion::from_scaled_axis(faults.tilt) * error;
        now.orientation = [estimate.w, estimate.i, estimate.j, estimate.k];

        world.contact_forces_into(&mut self.forces);
        for ((reading, force), [gain, zero]) in now.contact_forces.iter_mut().zip(&self.forces).zip(&faults.feet) {
            let force = (force.z * gain * (1.0 + draw(noise.contact_force)) + zero).max(0.0);
            *reading = if force > senses.foot_dead_zone { force } else { 0.0 };
        }
        now.centre_of_pressure = centre_of_pressure(robot, world, &now.contact_forces);

        if self.sights.is_none() {
            let ball = Vector3::from(world.ball().position);
            let base = Vector3::new(q[0], q[1], 0.0);
            let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -world_from_base.euler_angles().2);
            let seen = heading * (ball - base);
            now.ball = Some(BallObservation {
                time: now.time,
                position: [seen.x + draw(noise.ball), seen.y + draw(noise.ball), seen.z],
            });
        }
        if first {
            // Before the start everything was as it is now.
            let now = now.clone();
            self.history.fill(now);
        }
    }

    /// What the controller sees now, written over `sensors`.
    pub fn read_into(&self, time: f64, sensors: &mut Sensors) {
        let at = |delay: usize| &self.history[(self.newest + self.history.len() - delay) % self.history.len()];
        sensors.copy_from(at(self.delay));
        sensors.time = time;
        sensors.ball = match &self.sights {
            Some(sights) => sights.arrived().last().copied(),
            None => at(self.ball_delay).ball,
        };
    }

    /// The camera's last sights that have arrived, newest last; `None` where the ball is seen without a camera.
    #[must_use]
    pub fn ball_sights(&self) -> Option<&[BallObservation]> {
        self.sights.as_ref().map(Sights::arrived)
    }
}

/// A stream of chance of its own.
fn stream(seed: u64, number: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(number);
    rng
}

/// The heading at the start, of which the inertial sensor knows nothing, undone; nothing where it was along x.
fn from_start(world: &View<'_>) -> UnitQuaternion<f64> {
    let start = orientation(world.start());
    if start == orientation(&world.robot().stand) {
        return UnitQuaternion::identity();
    }
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -start.euler_angles().2)
}

/// The nearest multiple of `step`, where it is not zero.
fn coarse(value: f64, step: f64) -> f64 {
    if step > 0.0 { (value / step).round() * step } else { value }
}

/// `world_from_base` of a position vector.
pub(crate) fn orientation(q: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[3], q[4], q[5], q[6]))
}

/// Centre of pressure of each foot in its sole frame, m.
fn centre_of_pressure(robot: &Robot, world: &View<'_>, forces: &[f64]) -> [Option<[f64; 2]>; 2] {
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
