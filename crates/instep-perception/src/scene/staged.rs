//! A scene from a world's state: where bodies are, in; what a camera on one of them sees, out of the renderer.
//!
//! Whoever has a world (a simulation, a log) hands over plain poses in the field frame; nothing here knows a simulator.

use instep_field::Field;
use nalgebra::{Matrix3, Vector3};

use super::{Look, Paint, Scene, Shape, Solid, Thing};
use crate::camera::CameraPose;
use crate::class::{Class, Team};

/// A body's form and pose in the field frame.
pub type Part = (Shape, Vector3<f32>, Matrix3<f32>, Paint);

/// A robot on the field.
#[derive(Debug, Clone, PartialEq)]
pub struct Player {
    /// Its team.
    pub team: Option<Team>,
    /// Its bodies: shape, position of the middle (m), rotation field_from_body, paint. For the robot that carries the
    /// camera leave out what encloses it: the camera sees whatever is farther than 3 cm.
    pub parts: Vec<Part>,
}

/// The ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Its middle, field frame, m.
    pub position: Vector3<f32>,
    /// Field from ball.
    pub rotation: Matrix3<f32>,
    /// Radius, m.
    pub radius: f32,
}

/// A usual ball's paint: black patches on white.
pub const BALL: Paint = Paint::Patches([0.85; 3], [0.03; 3], 0.92, false);

/// A team's colour.
pub fn colour(team: Team) -> Paint {
    Paint::Plain(match team {
        Team::Red => [0.6, 0.04, 0.04],
        Team::Blue => [0.04, 0.1, 0.6],
    })
}

/// The field with its goals, a ball and players, in the light of `look`, seen from `camera`; `seed` is the sensors' noise:
/// another one each frame.
pub fn staged(
    field: &Field,
    camera: CameraPose,
    look: Look,
    ball: Option<Ball>,
    players: &[Player],
    seed: u64,
) -> Scene {
    let mut scene = Scene::new(camera, look, seed);
    scene.add_goals(field, 0.05, Paint::Plain([0.85; 3]), true);
    for player in players {
        let count = player.parts.len().max(1) as f32;
        let middle = player.parts.iter().map(|part| part.1).sum::<Vector3<f32>>() / count;
        let height = player.parts.iter().map(|part| part.1.z + reach(part.0)).fold(0.0, f32::max);
        let position = Vector3::new(middle.x, middle.y, 0.0);
        let thing = scene.add(Thing { class: Class::Robot, team: player.team, position, size: height / 2.0 });
        let solids = player.parts.iter().map(|&(shape, position, rotation, paint)| Solid {
            shape,
            position,
            rotation,
            paint,
            thing,
        });
        scene.solids.extend(solids);
        scene.add_shadow([middle.x, middle.y], 0.12 * height, height, 0.7);
    }
    if let Some(ball) = ball {
        scene.add_ball(ball.position, ball.radius, ball.rotation, BALL);
    }
    scene
}

/// How far a shape reaches from its middle at most, roughly, m.
fn reach(shape: Shape) -> f32 {
    match shape {
        Shape::Sphere(r) => r,
        Shape::Capsule(r, half) | Shape::Cylinder(r, half) => r + half,
        Shape::Box(half) => half.iter().copied().fold(0.0, f32::max),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::label::labels;
    use crate::render::Renderer;

    #[test]
    fn a_ball_and_a_player_are_seen_where_they_are() {
        let field = Field::named("adult-2024").unwrap();
        let camera = Camera::default();
        let pose = CameraPose::looking([-1.0, 0.0, 1.2], 0.0, 0.25, 0.0);
        let ball = Ball { position: Vector3::new(1.5, 0.3, 0.11), rotation: Matrix3::identity(), radius: 0.11 };
        let trunk =
            (Shape::Box([0.1, 0.15, 0.5]), Vector3::new(2.0, -0.8, 0.5), Matrix3::identity(), colour(Team::Red));
        let player = Player { team: Some(Team::Red), parts: vec![trunk] };
        let scene = staged(&field, pose, Look::default(), Some(ball), &[player], 1);
        let view = Renderer::new(camera, &field).render(&scene);
        let labels = labels(&camera, &field, &scene, &view);
        let of = |class| labels.iter().find(|l| l.class == class && !l.ignored).copied().unwrap();
        let middle = camera.project(pose.camera_from_world(ball.position)).unwrap();
        let found = of(Class::Ball).rect.middle();
        assert!((found[0] - middle[0]).abs() < 1.0 && (found[1] - middle[1]).abs() < 1.0, "{found:?} {middle:?}");
        assert_eq!(of(Class::Robot).team, Some(Team::Red));
        assert_eq!(crate::detector::team(&view.frame, &of(Class::Robot).rect), Some(Team::Red));
    }
}
