//! What a robot's camera tells of the ball: frames at its rate, sights that come late and err with distance, and none where
//! the ball is out of the field of view or behind a part of the robot or of another.
//!
//! The error of a sight is an angle, aside and up, that changes slowly (a first-order Gauss-Markov process, so that successive
//! sights are wrong in the same way); its effect on the ground is that of projecting it from the camera's height. Detector
//! failures and false balls are left out.

use instep_robot::control::BallObservation;
use instep_robot::senses::Camera;
use nalgebra::{Isometry3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::world::View;

/// Frames that can be under way.
const PLACES: usize = 64;
/// Sights that are kept after their arrival.
const KEPT: usize = 16;
/// Share of the true depression to which an error can bring it: a ball is never seen at the horizon.
const LEAST_DEPRESSION: f64 = 0.3;
/// Times are sums of steps: a frame is taken this much early, s.
const GRACE: f64 = 1e-7;

/// The sights of one robot.
#[derive(Debug, Clone)]
pub(crate) struct Sights {
    camera: Camera,
    /// Sights under way, oldest first, as a ring: when each arrives, s.
    queue: Vec<(f64, BallObservation)>,
    first: usize,
    waiting: usize,
    /// When the next frame is taken, s.
    next: f64,
    /// Errors of direction as shares of their deviation: aside and up.
    errors: [f64; 2],
    /// Those that have arrived, newest last.
    arrived: Vec<BallObservation>,
    /// White noise on a sight, m, and further delay, s.
    noise: [f64; 2],
}

impl Sights {
    /// Of `camera`, which takes its first frame at a random time within a period.
    /// `noise`: white, m, and further delay, s.
    pub(crate) fn new(camera: Camera, noise: [f64; 2], rng: &mut ChaCha8Rng) -> Self {
        let blank = BallObservation { time: 0.0, position: [0.0; 3] };
        let errors = [0, 1].map(|_| StandardNormal.sample(rng));
        let next = camera.period * rng.random::<f64>();
        let (queue, arrived) = (vec![(0.0, blank); PLACES], Vec::with_capacity(KEPT));
        Self { camera, queue, first: 0, waiting: 0, next, errors, arrived, noise }
    }

    /// What was seen before the start, when robot and ball were as they are now but for the ball's motion: for `time` (s).
    pub(crate) fn look_back(&mut self, world: &View<'_>, time: f64, rng: &mut ChaCha8Rng) {
        let now = world.time();
        let frames = (time / self.camera.period).ceil().max(1.0);
        self.next -= frames * self.camera.period;
        while self.next < now - GRACE {
            self.frame(world, self.next, rng);
            self.deliver(now);
        }
    }

    /// Takes a frame if it is time.
    pub(crate) fn look(&mut self, world: &View<'_>, rng: &mut ChaCha8Rng) {
        if world.time() + GRACE >= self.next {
            self.frame(world, world.time(), rng);
        }
        self.deliver(world.time());
    }

    /// The last sights that have arrived, newest last.
    pub(crate) fn arrived(&self) -> &[BallObservation] {
        &self.arrived
    }

    fn deliver(&mut self, now: f64) {
        while self.waiting > 0 && self.queue[self.first].0 <= now + GRACE {
            if self.arrived.len() == KEPT {
                self.arrived.remove(0);
            }
            self.arrived.push(self.queue[self.first].1);
            self.first = (self.first + 1) % PLACES;
            self.waiting -= 1;
        }
    }

    fn frame(&mut self, world: &View<'_>, time: f64, rng: &mut ChaCha8Rng) {
        let camera = &self.camera;
        self.next += camera.period;
        let keep = if camera.correlation > 0.0 { (-camera.period / camera.correlation).exp() } else { 0.0 };
        for error in &mut self.errors {
            let new: f64 = StandardNormal.sample(rng);
            *error = keep * *error + (1.0 - keep * keep).sqrt() * new;
        }
        let [least, greatest] = camera.latency;
        let [noise, further] = self.noise;
        let latency = least + (greatest - least) * rng.random::<f64>() + further;
        let white: [f64; 2] = [0, 1].map(|_| StandardNormal.sample(rng));
        let ball = world.ball();
        let place = Vector3::from(ball.position) + Vector3::from(ball.velocity) * (time - world.time());
        let Some([x, y, z]) = self.sight(world, &place) else { return };
        let position = [x + noise * white[0], y + noise * white[1], z];
        if self.waiting == PLACES {
            return;
        }
        // Frames do not overtake each other.
        let before =
            if self.waiting == 0 { f64::NEG_INFINITY } else { self.queue[(self.first + self.waiting - 1) % PLACES].0 };
        self.queue[(self.first + self.waiting) % PLACES] =
            ((time + latency).max(before), BallObservation { time, position });
        self.waiting += 1;
    }

    /// The ball at `place` (m, world) as it is seen: in the base's heading frame, m.
    fn sight(&self, world: &View<'_>, place: &Vector3<f64>) -> Option<[f64; 3]> {
        let eye = world.camera_pose(&self.camera);
        let seen = eye.inverse_transform_point(&(*place).into()).coords;
        if !self.camera.frames(&seen) || !world.sees(eye.translation.vector, *place, self.camera.at.link) {
            return None;
        }
        let [aside, up] = self.errors.map(|error| error * self.camera.angle_error);
        let from_eye = place - eye.translation.vector;
        let (distance, height) = (from_eye.xy().norm(), -from_eye.z);
        let depression = height.atan2(distance);
        let erring = (depression - up).max(LEAST_DEPRESSION * depression);
        let far = if height > 0.0 { height / erring.tan() } else { distance };
        let direction = from_eye.y.atan2(from_eye.x) + aside;
        let ground = eye.translation.vector + Vector3::new(far * direction.cos(), far * direction.sin(), -height);
        let seen: Isometry3<f64> = world.heading();
        Some(seen.inverse_transform_point(&ground.into()).coords.into())
    }
}
