//! A random scene in motion: the ball rolls, the head sways as a walking robot's does.

use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::Scene;
use crate::camera::CameraPose;
use crate::class::Class;

/// The share of its speed that a ball on turf loses in a second.
const FRICTION: f32 = 0.35;
/// Highest first speed of the ball, m/s.
const FASTEST: f32 = 1.2;

/// A scene whose ball and camera move.
#[derive(Debug, Clone, PartialEq)]
pub struct Moving {
    scene: Scene,
    velocity: Vector3<f32>,
    /// Phase of the sway, rad.
    phase: f32,
}

impl Moving {
    /// `scene` at time 0; how it moves is drawn from `seed`.
    pub fn new(scene: Scene, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(3);
        let (speed, angle) = (rng.random_range(0.0..FASTEST), rng.random_range(-3.1..3.1f32));
        let velocity = Vector3::new(speed * angle.cos(), speed * angle.sin(), 0.0);
        Moving { scene, velocity, phase: rng.random_range(0.0..6.2) }
    }

    /// Where the ball's middle is at time `t` (s), m; `None` without a ball.
    pub fn ball(&self, t: f32) -> Option<Vector3<f32>> {
        let ball = self.scene.things.iter().find(|thing| thing.class == Class::Ball)?;
        Some(ball.position + self.velocity * ((1.0 - (-FRICTION * t).exp()) / FRICTION))
    }

    /// The scene at time `t`, s.
    pub fn at(&self, t: f32) -> Scene {
        let mut scene = self.scene.clone();
        scene.seed = scene.seed.wrapping_add((t * 1000.0) as u64);
        let pose = &self.scene.camera;
        let step = 7.0 * t + self.phase;
        // Two steps a second, half a degree and a centimetre.
        let sway = |amplitude: f32, angle: f32| amplitude * (angle.sin() - self.phase.sin());
        let turned = CameraPose::looking(
            [pose.position.x, pose.position.y, pose.position.z + sway(0.01, step)],
            pose.yaw() + sway(0.02, 0.5 * (step - self.phase) + self.phase),
            pose.pitch() + sway(0.009, step),
            0.0,
        );
        scene.camera = turned;
        if let (Some(now), Some(k)) = (self.ball(t), scene.things.iter().position(|thing| thing.class == Class::Ball)) {
            let way = now - scene.things[k].position;
            scene.things[k].position = now;
            for solid in scene.solids.iter_mut().filter(|solid| usize::from(solid.thing) == k + 1) {
                solid.position += way;
            }
            // The ball is added last, with two shadows.
            let first = scene.shadows.len().saturating_sub(2);
            for shadow in &mut scene.shadows[first..] {
                shadow.center = [shadow.center[0] + way.x, shadow.center[1] + way.y];
            }
        }
        scene
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::scene::random::{Split, scene};

    #[test]
    fn the_ball_rolls_where_it_is_said_and_nothing_else_moves() {
        let field = instep_field::Field::named("adult-2024").unwrap();
        let still = (0..20).map(|seed| scene(&field, &Camera::default(), Split::Test, seed));
        let still = still.into_iter().find(|s| s.things.iter().any(|t| t.class == Class::Ball)).unwrap();
        let moving = Moving::new(still.clone(), 1);
        let later = moving.at(1.0);
        let ball = moving.ball(1.0).unwrap();
        let moved = still.solids.iter().zip(&later.solids).filter(|(a, b)| a.position != b.position);
        let moved: Vec<_> = moved.map(|(_, b)| b.position).collect();
        assert_eq!(moved.len(), 1);
        assert!((moved[0] - ball).norm() < 1e-4);
        assert!((ball - moving.ball(0.0).unwrap()).norm() < FASTEST);
        let start = moving.at(0.0).camera;
        assert!((start.yaw() - still.camera.yaw()).abs() < 1e-5);
    }
}
