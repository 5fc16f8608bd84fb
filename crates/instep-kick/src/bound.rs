//! What a robot's geometry and its joints' speeds allow of a kick, whatever the engine: an upper bound that a plan is held against.
//!
//! Looked at is the contact alone: a foot is brought to the ball by inverse kinematics with the centre of mass over the other
//! foot, with every part of both feet and every yaw on a grid. There the kicking leg's joints, each within its greatest speed, drive
//! the point that strikes along the push and nowhere else: the greatest speed s with J w = s d, |w_j| <= limit, is the vertex of a
//! small linear program. The foot's effective mass M makes (1 + e) M / (M + m) times as much of it at the ball
//! (facts/physics-of-the-kick.md). Wind-up, follow-through, torques (a motor at its greatest speed has none), the rest of the foot
//! and balance in motion are left out, so no kick of that leg can be faster and few as fast.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::Robot;
use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};

use crate::KickError;
use crate::ball::BallModel;
use crate::dynamic::DynamicSettings;
use crate::engine::Face;
use crate::request::{KickRequest, Place};
use crate::whole_body::body::Body;
use crate::whole_body::foot::{FacePoint, contact_point, wrap};
use crate::whole_body::forecast::{FAR, ROLL, Rehearsal, ground_gap, judge};
use crate::whole_body::motion::goals;
use crate::whole_body::torque::Dynamics;
use instep_robot::ik::Ik;

/// Yaws of the foot that are tried with a corner, rad.
const YAW_STEP: f64 = 0.15;
const YAWS: i32 = 9;
/// Shares of a flat face's half width at which it may meet the ball.
const SLIDES: [f64; 5] = [0.0, 0.5, -0.5, 0.95, -0.95];
/// Largest angle from the front at which a corner strikes, rad.
const CORNER: f64 = 1.4;
/// Times at which a rolling ball may be met, s after the request: a foot is not up sooner, and nobody waits longer.
const MEETING: [f64; 2] = [1.2, 4.0];
const MEETING_STEP: f64 = 0.1;

/// The fastest that geometry and joint speeds allow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// The foot.
    pub foot: Side,
    /// The part of it that strikes.
    pub face: Face,
    /// Its yaw, rad.
    pub yaw: f64,
    /// Speed of the point that strikes, m/s.
    pub foot_speed: f64,
    /// Effective mass there, kg.
    pub mass: f64,
    /// Speed of the ball, m/s.
    pub ball_speed: f64,
}

/// Scratch space in which bounds of one robot are looked for.
#[derive(Debug)]
pub struct Bounds {
    body: Body,
    settings: DynamicSettings,
    rehearsal: Rehearsal,
}

impl Bounds {
    /// For `robot` with `ball`; of `settings` the joints that one motor turns, arms, stance and what counts as a place reached.
    ///
    /// # Errors
    /// When a setting does not fit the robot.
    pub fn new(robot: Arc<Robot>, ball: BallModel, settings: DynamicSettings) -> Result<Self, KickError> {
        let ik = Ik::new(&robot, &settings.coupled, settings.limits.joint_margin, settings.limits.knee_bend)?;
        let dynamics = Dynamics::new(&robot, &settings.coupled);
        let body = Body::new(robot, ball, &settings.arms)?;
        let rehearsal = Rehearsal::new(&body, &settings.manner(), ik, dynamics);
        Ok(Self { body, settings, rehearsal })
    }

    /// The fastest kick that `request` allows, `None` where no part of a foot can be brought behind the ball. A search leaves off
    /// at the ball speed `enough` (m/s).
    pub fn of(&mut self, request: &KickRequest, enough: f64) -> Option<Bound> {
        if request.check().is_err() {
            return None;
        }
        let rolls = Vector2::from(request.ball_velocity).norm() > 0.02;
        let steps = if rolls { ((MEETING[1] - MEETING[0]) / MEETING_STEP) as u32 } else { 0 };
        let mut best: Option<Bound> = None;
        for step in 0..=steps {
            let time = if rolls { MEETING[0] + f64::from(step) * MEETING_STEP } else { 0.0 };
            let (ball, velocity) = self.body.ball.roll(request.ball, request.ball_velocity, time);
            for swing in [Side::Left, Side::Right] {
                if request.foot.is_some_and(|foot| foot != swing) {
                    continue;
                }
                let found = self.at(request, ball, velocity, swing, enough);
                best = [best, found].into_iter().flatten().max_by(|a, b| a.ball_speed.total_cmp(&b.ball_speed));
                if best.is_some_and(|best| best.ball_speed >= enough) {
                    return best;
                }
            }
        }
        best
    }

    fn at(
        &mut self,
        request: &KickRequest,
        ball: [f64; 2],
        velocity: [f64; 2],
        swing: Side,
        enough: f64,
    ) -> Option<Bound> {
        let velocity = Vector2::from(velocity);
        let wanted = Vector2::new(request.direction.cos(), request.direction.sin());
        let speed = request.strength.ball_speed(&self.body.ball, 1.0);
        let push = wanted * speed - velocity;
        let direction = push.y.atan2(push.x);
        let foot = self.body.feet[swing as usize];
        let mut ways: Vec<(Face, f64, FacePoint)> = Vec::new();
        for face in [Face::Front, Face::Inner, Face::Outer, Face::Back] {
            for slide in SLIDES {
                let mut point = foot.face(face, 0.0);
                let across = Vector3::new(-point.angle.sin(), point.angle.cos(), 0.0);
                point.axis += across * (slide * point.half_width);
                ways.push((face, wrap(direction - point.angle), point));
            }
        }
        for step in -YAWS..=YAWS {
            let yaw = f64::from(step) * YAW_STEP;
            let turned = wrap(direction - yaw);
            if turned.abs() < CORNER {
                ways.push((Face::Corner, yaw, foot.face(Face::Corner, turned)));
            }
        }
        let mut best: Option<Bound> = None;
        for (face, yaw, point) in ways.into_iter().filter(|(_, yaw, _)| yaw.abs() < FRAC_PI_2) {
            let Some((foot_speed, mass)) = self.fastest(ball, direction, swing, yaw, &point) else { continue };
            let along = velocity.dot(&push.normalize());
            let given = (foot_speed - along).max(0.0) * self.body.ball.gain(mass);
            // Of the push that is wanted, what there is of it; the ball keeps what it has.
            let ball_speed = (velocity + push.normalize() * given.min(push.norm())).norm();
            let ball_speed = if given >= push.norm() { ball_speed + given - push.norm() } else { ball_speed };
            if best.is_none_or(|best| ball_speed > best.ball_speed) {
                best = Some(Bound { foot: swing, face, yaw, foot_speed, mass, ball_speed });
            }
            if ball_speed >= enough {
                break;
            }
        }
        best
    }

    /// Greatest speed (m/s) along `direction` (rad) of a part of the foot at the ball, and the effective mass (kg) behind it;
    /// `None` where it cannot be brought there.
    fn fastest(
        &mut self,
        ball: [f64; 2],
        direction: f64,
        swing: Side,
        yaw: f64,
        point: &FacePoint,
    ) -> Option<(f64, f64)> {
        let Self { body, settings, rehearsal } = self;
        let radius = body.ball.radius;
        let height = (radius + settings.swing.height - point.axis.z).max(settings.swing.sole_least);
        let center = Vector2::from(body.support_from_footprint(swing, ball));
        let contact = contact_point(center, direction, point, yaw, height, radius);
        let trunk = settings.manner().trunk_support(body, swing, yaw);
        rehearsal.lift(swing);
        let foot = [contact.x, contact.y, contact.z, yaw, 0.0];
        let gap = rehearsal.go(body, swing, &goals(&foot, &trunk), 2 * FAR, ROLL);
        judge(body, &settings.limits, &rehearsal.pose, swing, Place::Contact, gap).ok()?;
        (ground_gap(body, &rehearsal.pose, swing) > 0.0).then_some(())?;
        let (leg, sole) = (body.robot.leg(swing), body.robot.leg(swing.other()).sole);
        let pose = &rehearsal.pose;
        let toward = Vector3::new(direction.cos(), direction.sin(), 0.0);
        let strike = contact + Rotation3::from_axis_angle(&Vector3::z_axis(), yaw) * point.axis;
        // From the support sole's frame into the base's.
        let turn = pose.rotation[sole.link];
        let (along, at) = (turn * toward, turn * strike + pose.point(&sole));
        let moved: Vec<Vector3<f64>> = leg
            .joints()
            .filter(|j| Some(*j) != leg.toe)
            .map(|j| body.tree.point_column(pose, j, leg.foot, &at) * body.robot.joints[j].speed)
            .collect();
        let speed = fastest(&moved, &along);
        rehearsal.dynamics.fill(body, swing.other(), &rehearsal.angles, pose);
        Some((speed, rehearsal.dynamics.effective_mass(leg.foot, &strike, &toward)))
    }
}

/// The greatest s with sum_j a_j c_j = s `along`, |a_j| <= 1, for the columns c_j: at a vertex all but two of the a_j are at an end.
fn fastest(columns: &[Vector3<f64>], along: &Vector3<f64>) -> f64 {
    let count = columns.len();
    let mut best = 0.0_f64;
    for a in 0..count {
        for b in a + 1..count {
            let free = Matrix3::from_columns(&[columns[a], columns[b], -along]);
            let Some(inverse) = free.try_inverse() else { continue };
            for signs in 0..1_usize << (count - 2) {
                let others = (0..count).filter(|j| *j != a && *j != b).enumerate();
                let rest: Vector3<f64> =
                    others.map(|(k, j)| columns[j] * if signs >> k & 1 == 1 { 1.0 } else { -1.0 }).sum();
                let x = inverse * -rest;
                if x.x.abs() <= 1.0 && x.y.abs() <= 1.0 {
                    best = best.max(x.z);
                }
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fastest_is_a_vertex_of_what_the_joints_can() {
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
        // Three joints straight along, one each across: only the first counts.
        assert!((fastest(&[x, y, z], &x) - 1.0).abs() < 1e-12);
        // Two that go askew to either side and cancel there: all of both counts.
        assert!((fastest(&[x + y, x - y, z, 0.5 * x], &x) - 2.5).abs() < 1e-12);
        // One goes aside more than the other can take back: it must go slower.
        assert!((fastest(&[x + 2.0 * y, x - y, z], &x) - 1.5).abs() < 1e-12);
        assert_eq!(fastest(&[y, z, y + z], &x), 0.0);
    }
}
