//! What a player's camera tells in a physics match without rendering: simulated detections.
//!
//! The ball is the sensor suite's: in the field of view, hidden by robots and by the own body, late, with an error that lasts.
//! Landmarks err, are missed, confused and made up as instep-localisation's streams have them; other robots are seen as in the
//! game simulator. A frame is of the time at which the ball was seen, or, while it is not, comes at the camera's rate as late
//! as the camera can be. Robots do not hide landmarks or each other.

use std::collections::VecDeque;
use std::sync::Arc;

use instep_behaviour::View as Cone;
use instep_field::Pose;
use instep_localisation::Map;
use instep_localisation::scenario::{SCENARIOS, Scenario};
use instep_localisation::stream::{Camera as LandmarkCamera, Gaze};
use instep_player::{BallSight, RobotSight, Sights};
use instep_robot::control::BallObservation;
use instep_robot::senses::Camera;
use instep_sim::View;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::settings::SightSettings;
use crate::sight::look;

/// How long poses are kept for frames that come late, s.
const KEPT: f64 = 0.3;
/// Streams of chance of the robots that are seen.
const OTHERS: u64 = 11;

/// Another robot, in the own team's frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Other {
    pub position: [f64; 2],
    pub mate: bool,
    pub fallen: bool,
}

/// Where a camera was at a time.
#[derive(Debug, Clone, Copy)]
struct Moment {
    time: f64,
    pose: Pose,
    yaw: f64,
}

/// The eyes of one player.
#[derive(Debug, Clone)]
pub(crate) struct Eyes {
    camera: Camera,
    landmarks: LandmarkCamera<'static>,
    map: Arc<Map>,
    settings: SightSettings,
    rng: ChaCha8Rng,
    trail: VecDeque<Moment>,
    /// Of the last frame, s.
    frame: f64,
    /// Of the camera over the ground, m.
    height: f64,
}

impl Eyes {
    pub(crate) fn new(camera: Camera, map: Arc<Map>, settings: &SightSettings, seed: u64) -> Self {
        // The first one: paper 4's detector with errors that last.
        let scenario: &'static Scenario = &SCENARIOS[0];
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(OTHERS);
        let view = Cone { half_angle: 0.5 * camera.field_of_view[0], ..settings.view };
        Self {
            landmarks: LandmarkCamera::new(scenario, &map, seed),
            camera,
            map,
            settings: SightSettings { view, ..*settings },
            rng,
            trail: VecDeque::with_capacity(64),
            frame: f64::NEG_INFINITY,
            height: 1.0,
        }
    }

    /// Remembers where the camera is now: `pose` of the robot in its team's frame.
    pub(crate) fn be_at(&mut self, view: &View<'_>, pose: Pose) {
        let eye = view.camera_pose(&self.camera);
        let ahead = view.heading().rotation.inverse() * eye.rotation * nalgebra::Vector3::x();
        self.height = eye.translation.z.max(0.1);
        while self.trail.front().is_some_and(|moment| moment.time < view.time() - KEPT) {
            self.trail.pop_front();
        }
        self.trail.push_back(Moment { time: view.time(), pose, yaw: ahead.y.atan2(ahead.x) });
    }

    /// The frame that arrives at `time`, if one does; `ball` is its last sight that has arrived.
    pub(crate) fn frame(&mut self, time: f64, ball: Option<&BallObservation>, others: &[Other]) -> Option<Sights> {
        let late = self.camera.latency[1];
        let ball = ball.filter(|ball| ball.time > self.frame + 1e-6);
        let taken = match ball {
            Some(ball) => ball.time,
            None if time - late >= self.frame + self.camera.period => time - late,
            None => return None,
        };
        self.frame = taken;
        let moment = *self.trail.iter().find(|moment| moment.time >= taken - 1e-6).or(self.trail.back())?;
        let gaze = Gaze { yaw: moment.yaw, width: self.camera.field_of_view[0] };
        let frame = self.landmarks.look_to(&self.map, taken.max(0.0), &moment.pose, gaze);
        let mut robots = Vec::new();
        for other in others {
            let seen = look(&moment.pose, moment.yaw, other.position, &self.settings, &mut self.rng);
            robots.extend(seen.map(|(position, _)| RobotSight {
                position,
                mate: Some(other.mate),
                number: None,
                fallen: other.fallen,
            }));
        }
        let height = self.height;
        let ball = ball.map(|ball| {
            let [x, y, z] = ball.position;
            let std = self.camera.angle_error * (x * x + y * y + height * height) / height;
            BallSight { position: [x, y], height: z, std }
        });
        Some(Sights { time: taken, gaze_yaw: moment.yaw, ball, landmarks: frame.landmarks, lines: frame.lines, robots })
    }
}
