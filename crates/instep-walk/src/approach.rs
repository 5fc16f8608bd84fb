//! From where the robot is to a pose on the ground, as a velocity: far away it turns toward the goal and walks ahead, close by
//! it steps in any direction while it turns to the wanted heading. Knows no obstacles: those are navigation's.

use nalgebra::{Rotation2, Vector2};

use crate::Velocity;
use crate::settings::Limits;

/// How fast a distance and an angle are closed, 1/s: slower than a step takes.
const RATE: [f64; 2] = [0.8, 1.2];
/// Distance from which the robot faces where it goes, m.
const FAR: f64 = 0.9;
/// Distance and angle that count as there, m and rad.
const THERE: [f64; 2] = [0.05, 0.06];

/// Velocity from `pose` to `goal`, each x, y (m) and heading (rad) in one frame; zero when there.
#[must_use]
pub fn toward(pose: [f64; 3], goal: [f64; 3], limits: &Limits) -> Velocity {
    let way = Vector2::new(goal[0] - pose[0], goal[1] - pose[1]);
    let distance = way.norm();
    let turn_to = |heading: f64| wrap(heading - pose[2]);
    if distance < THERE[0] && turn_to(goal[2]).abs() < THERE[1] {
        return Velocity::default();
    }
    let local = Rotation2::new(-pose[2]) * way;
    let turn = if distance > FAR { turn_to(way.y.atan2(way.x)) } else { turn_to(goal[2]) };
    // A goal behind is turned to before it is walked to.
    let ahead = if distance > FAR { turn.cos().max(0.0) } else { 1.0 };
    let turn = RATE[1] * turn;
    limits.clip(Velocity { x: RATE[0] * local.x * ahead, y: RATE[0] * local.y * ahead, turn })
}

fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}
