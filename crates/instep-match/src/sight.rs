//! What a robot's camera gives: a cone, a range, shadows, noise, misses, and a frame's delay.

use arrayvec::ArrayVec;
use instep_behaviour::{BallSight, Circle, Point, Sight};
use instep_field::{Pose, wrap};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, Uniform};

use crate::settings::SightSettings;

/// A frame that is being worked on: taken with the neck at `yaw`, from where the robot believed to be.
#[derive(Debug, Clone, Default)]
pub(crate) struct Frame {
    pub sight: Sight,
    pub own: Pose,
    pub yaw: f64,
}

pub(crate) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

pub(crate) fn chance(rng: &mut ChaCha8Rng) -> f64 {
    // From 0 to 1 is always a valid range.
    Uniform::new(0.0, 1.0).map_or(0.0, |u| u.sample(rng))
}

/// One robot seen by another.
pub(crate) struct Seen {
    pub circle: Circle,
    pub opponent: bool,
}

/// Takes a frame from the true pose `eye`.
pub(crate) fn take(
    eye: &Pose,
    yaw: f64,
    ball: Point,
    others: &ArrayVec<Seen, 22>,
    settings: &SightSettings,
    rng: &mut ChaCha8Rng,
    sight: &mut Sight,
) {
    sight.ball = None;
    sight.opponents.clear();
    let covered = others.iter().any(|o| shadowed([eye.x, eye.y], ball, &o.circle));
    if !covered {
        sight.ball = look(eye, yaw, ball, settings, rng).map(|(position, std)| BallSight { position, std });
    }
    for other in others.iter().filter(|o| o.opponent) {
        if let Some((position, _)) = look(eye, yaw, other.circle.center, settings, rng) {
            // As many as a team has fit.
            let _ = sight.opponents.try_push(position);
        }
    }
}

/// Where a point seems to be in the robot frame, if it is found, and its standard deviation, m.
pub(crate) fn look(
    eye: &Pose,
    yaw: f64,
    point: Point,
    settings: &SightSettings,
    rng: &mut ChaCha8Rng,
) -> Option<(Point, f64)> {
    let (dx, dy) = (point[0] - eye.x, point[1] - eye.y);
    let d = dx.hypot(dy);
    let angle = wrap(dy.atan2(dx) - eye.heading);
    if d > settings.view.range || wrap(angle - yaw).abs() > settings.view.half_angle || chance(rng) < settings.misses {
        return None;
    }
    let measured = d * (1.0 + settings.range_noise * normal(rng));
    let angle = angle + settings.angle_noise * normal(rng);
    let std = (settings.range_noise * d).max(settings.angle_noise * d).max(0.01);
    Some(([measured * angle.cos(), measured * angle.sin()], std))
}

/// Whether a robot's legs hide the ball: narrower than its shoulders.
fn shadowed(eye: Point, point: Point, circle: &Circle) -> bool {
    let way = [point[0] - eye[0], point[1] - eye[1]];
    let square = way[0] * way[0] + way[1] * way[1];
    let off = [circle.center[0] - eye[0], circle.center[1] - eye[1]];
    let t = (off[0] * way[0] + off[1] * way[1]) / square.max(1e-9);
    if t <= 0.0 || t >= 1.0 {
        return false;
    }
    let beside = [off[0] - t * way[0], off[1] - t * way[1]];
    beside[0] * beside[0] + beside[1] * beside[1] < 0.36 * circle.radius * circle.radius
}
