//! The ball's track over the frames of a moving scene, and how far off it is after a second without sights.

use instep_field::Field;
use instep_perception::after::ball;
use instep_perception::after::kalman::Track;
use instep_perception::detector::{Detector, THRESHOLDS};
use instep_perception::render::Renderer;
use instep_perception::scene::moving::Moving;
use instep_perception::scene::random::{Split, scene};
use instep_perception::{CameraPose, Class};
use nalgebra::{Matrix3, Vector3};

use super::{Times, look_at};
use crate::failure::Failure;

/// Frames a second of a sequence.
pub(super) const RATE: f64 = 15.0;
/// Deviation of a sight across the line of sight, m per m.
const ACROSS: f64 = 0.006;

/// The ball's track, in the field frame.
#[derive(Debug, Default)]
pub(super) struct BallTrack {
    pub(super) track: Option<Track>,
}

impl BallTrack {
    /// Goes on by `dt` seconds, and takes a sight where there is one. `pose` is where the camera was for it, as odometry has
    /// it.
    pub(super) fn step(&mut self, dt: f64, pose: &CameraPose, sight: Option<&ball::Sight>) {
        if let Some(track) = &mut self.track {
            track.predict(dt);
        }
        let Some(sight) = sight else { return };
        let position = field_from_robot(pose, sight.position);
        let distance = f64::from(sight.position.norm());
        let along = (position - pose.position.cast::<f64>()).normalize();
        let (far, aside) = (f64::from(sight.deviation).powi(2), (ACROSS * distance).powi(2));
        let covariance = Matrix3::identity() * aside + along * along.transpose() * (far - aside).max(0.0);
        match &mut self.track {
            Some(track) => {
                track.sight(position, covariance);
            }
            None => self.track = Some(Track::new(position, covariance)),
        }
    }
}

/// A point of the robot's frame (on the ground below the camera, x ahead) in the field's, m.
fn field_from_robot(pose: &CameraPose, point: Vector3<f32>) -> Vector3<f64> {
    let (s, c) = pose.yaw().sin_cos();
    let turned = Vector3::new(c * point.x - s * point.y, s * point.x + c * point.y, point.z);
    (turned + Vector3::new(pose.position.x, pose.position.y, 0.0)).cast()
}

/// Errors on the ground of tracks whose ball was seen for a second and then hidden for a second, m: `count` of them, from
/// moving scenes with a ball in view and nearer than 5 m. A ball that is never found in its second is no track: infinity.
pub(super) fn after_occlusion(
    renderer: &mut Renderer,
    detector: &mut Detector,
    field: &Field,
    first: u64,
    count: usize,
) -> Result<Vec<f64>, Failure> {
    let camera = *renderer.camera();
    let mut errors = Vec::new();
    let mut times = Times::default();
    for seed in first.. {
        if errors.len() >= count {
            break;
        }
        let moving = Moving::new(scene(field, &camera, Split::Test, seed), seed);
        let in_view = |t: f32| {
            let place = moving.ball(t).map(|ball| moving.at(t).camera.camera_from_world(ball))?;
            let [u, v] = camera.project(place)?;
            let inside = u > 10.0 && v > 10.0 && u < camera.width as f32 - 10.0 && v < camera.height as f32 - 10.0;
            Some(inside && place.norm() < 5.0)
        };
        if in_view(0.0) != Some(true) || in_view(1.0) != Some(true) {
            continue;
        }
        let mut ball = BallTrack::default();
        for k in 0..RATE as u32 {
            let t = f64::from(k) / RATE;
            let looked = look_at(renderer, detector, field, moving.at(t as f32), &THRESHOLDS, &mut times)?;
            let hidden = !looked.view.things.iter().any(|&mark| {
                usize::from(mark)
                    .checked_sub(1)
                    .and_then(|k| looked.scene.things.get(k))
                    .is_some_and(|thing| thing.class == Class::Ball)
            });
            let sight = looked.sights.ball.as_ref().filter(|_| !hidden).map(|(sight, _)| sight);
            ball.step(1.0 / RATE, &looked.scene.camera, sight);
        }
        let Some(mut track) = ball.track else {
            errors.push(f64::INFINITY);
            continue;
        };
        let last = (RATE - 1.0) / RATE;
        for _ in 0..RATE as u32 {
            track.predict(1.0 / RATE);
        }
        let truth = moving.ball(last as f32 + 1.0).unwrap_or_default().cast::<f64>();
        errors.push((track.position() - truth).xy().norm());
    }
    Ok(errors)
}
