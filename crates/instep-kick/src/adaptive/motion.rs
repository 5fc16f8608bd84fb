//! Retraction and execution of paper 3 (section 2) between its preparation and its wrap-up, which are every engine's.
//!
//! Until the strike begins the curves are laid anew from where everything is, each time that the retraction point or the
//! foot target has moved.

use instep_motion::phase::Side;
use instep_motion::spline::State;
use nalgebra::{Vector2, Vector3};

use crate::adaptive::geometry::Part;
use crate::adaptive::settings::AdaptiveSettings;
use crate::dynamic::THROUGH;
use crate::engine::{Face, Phase};
use crate::whole_body::body::Body;
use crate::whole_body::motion::{Motion, place};

/// Most corners of the way from the retraction point to the foot target.
pub(crate) const CORNERS: usize = 2;
/// Pace of the way back after a break-off or from another stroke, which no forecast has seen.
pub(crate) const CAREFUL: f64 = 2.0;
/// Largest acceleration of a quintic between rests, over its way and the square of its time.
const QUINTIC: f64 = 5.77;
/// Largest acceleration of the foot when the retraction is laid anew, m/s^2.
const ACCELERATION: f64 = 3.5;
/// Way aside and forward from which on the foot goes around the ball, m.
const ASIDE: f64 = 0.03;
/// Share of the strike's speed with which the foot passes a corner.
const CORNER_SPEED: f64 = 0.6;

/// Everything that depends on the ball. Places are the sole's centre in the support sole's frame, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stroke {
    pub(crate) swing: Side,
    pub(crate) face: Face,
    pub(crate) part: Part,
    /// Foot yaw, rad.
    pub(crate) yaw: f64,
    /// Retraction point p_r.
    pub(crate) retraction: Vector3<f64>,
    /// Corners of the way between.
    pub(crate) corners: [Option<Vector3<f64>>; CORNERS],
    /// Foot target p_f.
    pub(crate) contact: Vector3<f64>,
    /// Way after the contact, m.
    pub(crate) follow: f64,
    /// Foot speed at the contact, m/s.
    pub(crate) speed: f64,
    /// g(p_r).
    pub(crate) forecast: f64,
    /// The ball at the contact, support sole's frame, m.
    pub(crate) ball: Vector2<f64>,
    /// Direction of the push at the contact, rad.
    pub(crate) normal: f64,
    /// What the times of retraction and way back are multiplied with, 1 or more.
    pub(crate) pace: f64,
    /// When the contact should be, s of the motion; 0: as soon as can be.
    pub(crate) at: f64,
}

impl Stroke {
    /// Direction in which the foot moves at the contact: a unit vector.
    pub(crate) fn direction(&self) -> Vector3<f64> {
        let before = self.corners.iter().rev().flatten().next().unwrap_or(&self.retraction);
        (self.contact - before).try_normalize(1e-9).unwrap_or(Vector3::x())
    }

    /// Where the foot comes to rest after the contact: level, whatever the way before.
    pub(crate) fn rest(&self) -> Vector3<f64> {
        let along = self.direction();
        self.contact + Vector3::new(along.x, along.y, 0.0) * self.follow
    }

    /// The sole's x, y, z, yaw, pitch at a place.
    pub(crate) fn pose(&self, place: &Vector3<f64>) -> [f64; 5] {
        [place.x, place.y, place.z, self.yaw, 0.0]
    }

    /// Length of the last straight part of the way, m.
    pub(crate) fn run(&self) -> f64 {
        let before = self.corners.iter().rev().flatten().next().unwrap_or(&self.retraction);
        (self.contact - before).norm()
    }

    /// From the retraction point to the contact, s: with a quintic from rest to the speed v without acceleration at
    /// either end the mean speed is v / 2.
    pub(crate) fn time(&self) -> f64 {
        let mut time = 0.0;
        let mut from = self.retraction;
        let mut start = 0.0;
        for corner in self.corners.iter().flatten() {
            let pass = CORNER_SPEED * self.speed;
            time += 2.0 * (corner - from).norm() / (start + pass);
            (from, start) = (*corner, pass);
        }
        time + 2.0 * (self.contact - from).norm() / (start + self.speed)
    }
}

/// The kick with `stroke`, from the stand to the stand.
pub(crate) fn kick(body: &Body, settings: &AdaptiveSettings, stroke: &Stroke) -> Motion {
    let away = if stroke.at > 0.0 { [0.0; 2] } else { body.away(stroke.swing, stroke.ball) };
    let mut motion = Motion::raised(body, &settings.manner(), stroke.swing, away);
    retract(&mut motion, body, settings, stroke, settings.times.foot_least);
    strike(&mut motion, stroke);
    motion.back(body, &settings.manner(), stroke.pace);
    motion
}

/// The retraction and what follows laid anew from `time` for another stroke; before the retraction only what comes after
/// the foot's raise changes.
pub(crate) fn adapted(motion: &Motion, body: &Body, settings: &AdaptiveSettings, time: f64, stroke: &Stroke) -> Motion {
    if motion.timeline.phase(time) < Phase::WindUp {
        return kick(body, settings, stroke);
    }
    let mut adapted = motion.from(time);
    // What is left of the time that a retraction takes, or what the way takes without haste.
    let way = (stroke.retraction - place(&adapted.foot.last().position)).norm();
    let left = motion.timeline.end_of(Phase::Raise) + settings.times.foot_least - time;
    retract(&mut adapted, body, settings, stroke, left.max((QUINTIC * way / ACCELERATION).sqrt()));
    strike(&mut adapted, stroke);
    adapted.back(body, &settings.manner(), stroke.pace.max(CAREFUL));
    adapted
}

/// From where the paths end to the retraction point, within `least` (s) or longer.
fn retract(motion: &mut Motion, body: &Body, settings: &AdaptiveSettings, stroke: &Stroke, least: f64) {
    let times = &settings.times;
    let last = motion.foot.last();
    let goal = stroke.pose(&stroke.retraction);
    let way = (stroke.retraction - place(&last.position)).norm();
    let duration = stroke.pace * (way / times.foot_speed).max(least);
    // Beside a ball that lies in front of the foot: first aside, then forward.
    let from = last.position;
    let aside = Body::sign(motion.swing) * (goal[1] - from[1]);
    if aside > ASIDE && goal[0] - from[0] > ASIDE {
        let share = [0.15, 0.85, 0.5, 0.5, 0.5];
        let rate = [0.9, 0.9, 1.0, 1.0, 1.0];
        let position = std::array::from_fn(|k| from[k] + share[k] * (goal[k] - from[k]));
        let velocity = std::array::from_fn(|k| rate[k] * (goal[k] - from[k]) / duration);
        motion.foot.to(0.5 * duration, State { position, velocity, acceleration: [0.0; 5] });
        motion.foot.to(0.5 * duration, State::at_rest(goal));
    } else {
        motion.foot.to(duration, State::at_rest(goal));
    }
    motion.trunk.to(duration, State::at_rest(settings.manner().trunk_support(body, motion.swing, stroke.yaw)));
    let wait = times.aim.max(stroke.at - stroke.time() - motion.foot.end());
    motion.foot.hold(wait);
    motion.trunk.hold(wait);
    motion.timeline.end_at(Phase::WindUp, motion.foot.end());
}

/// From the retraction point through the ball to rest.
fn strike(motion: &mut Motion, stroke: &Stroke) {
    let mut from = stroke.retraction;
    let mut speed = 0.0;
    let points = stroke.corners.iter().flatten().copied().chain([stroke.contact]);
    let count = stroke.corners.iter().flatten().count();
    for (i, point) in points.enumerate() {
        let pass = if i == count { stroke.speed } else { CORNER_SPEED * stroke.speed };
        let direction = if i == count {
            stroke.direction()
        } else {
            let next = stroke.corners.get(i + 1).copied().flatten().filter(|_| i + 1 < count).unwrap_or(stroke.contact);
            (next - from).try_normalize(1e-9).unwrap_or(Vector3::x())
        };
        let velocity = direction * pass;
        let state = State {
            position: stroke.pose(&point),
            velocity: [velocity.x, velocity.y, velocity.z, 0.0, 0.0],
            acceleration: [0.0; 5],
        };
        motion.foot.to(2.0 * (point - from).norm() / (speed + pass), state);
        (from, speed) = (point, pass);
    }
    motion.contact = Some(motion.foot.end());
    // On at the same speed for a moment: drives that lag meet the ball a little later, and a foot that brakes then kicks by chance.
    let on = THROUGH.min(0.45 * stroke.follow / stroke.speed);
    let (way, along) = (on * stroke.speed, stroke.direction());
    let position = stroke.pose(&(stroke.contact + Vector3::new(along.x, along.y, 0.0) * way));
    let velocity = [along.x * stroke.speed, along.y * stroke.speed, 0.0, 0.0, 0.0];
    motion.foot.to(on, State { position, velocity, acceleration: [0.0; 5] });
    motion.foot.to(2.0 * (stroke.follow - way) / stroke.speed, State::at_rest(stroke.pose(&stroke.rest())));
    motion.trunk.hold(motion.foot.end() - motion.trunk.end());
    motion.timeline.end_at(Phase::Kick, motion.foot.end());
}
