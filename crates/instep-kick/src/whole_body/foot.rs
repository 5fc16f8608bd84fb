//! The parts of a foot that can strike a ball, and where a foot must be to strike it: paper 2, equations (1) and (2),
//! and the 45-degree rule of its section 3.4.
//!
//! A face is found from the striking capsules of the foot: those that reach farthest toward the front or a side, within
//! [`FLUSH`]. Everything is in the plane; heights are kept beside.

use std::f64::consts::{FRAC_PI_2, PI};

use instep_motion::phase::Side;
use instep_robot::Robot;
use nalgebra::{Rotation2, Vector2, Vector3};

use crate::engine::Face;
use instep_robot::tree::{Tree, TreePose};

/// Capsule ends that reach this near to the farthest belong to the same face, m.
const FLUSH: f64 = 0.006;

/// One face, in the sole's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacePoint {
    /// Middle of the axis of the capsules that make the face, m; z over the sole.
    pub axis: Vector3<f64>,
    /// The capsules' radius, m.
    pub radius: f64,
    /// Direction in which the face strikes, rad from the foot's x axis.
    pub angle: f64,
    /// Half of the face's width, m.
    pub half_width: f64,
}

/// One foot's outline and faces, in its sole's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Front, inner, outer and back face.
    pub faces: [FacePoint; 4],
    /// Least and largest x of what stands on the ground, m.
    pub stand_x: [f64; 2],
    /// Least and largest y of what stands on the ground, m.
    pub stand_y: [f64; 2],
    /// Least and largest x of the whole foot, m.
    pub outline_x: [f64; 2],
    /// Least and largest y of the whole foot, m.
    pub outline_y: [f64; 2],
}

impl Foot {
    /// The foot on `side` in the pose `pose` of the stand.
    #[must_use]
    pub fn new(robot: &Robot, tree: &Tree, pose: &TreePose, side: Side) -> Self {
        let leg = robot.leg(side);
        let sole = pose.point(&leg.sole);
        let turn = pose.rotation[leg.sole.link].transpose();
        let mut ends: Vec<(Vector3<f64>, f64)> = Vec::new();
        for &geom in &leg.strike {
            let capsule = tree.capsule(robot, geom);
            if capsule.link == leg.foot || Some(capsule.link) == leg.toe_link {
                ends.extend(pose.axis_of(&capsule).map(|end| (turn * (end - sole), capsule.radius)));
            }
        }
        let out = if side == Side::Left { 1.0 } else { -1.0 };
        let face = |angle: f64| {
            let toward = Vector3::new(angle.cos(), angle.sin(), 0.0);
            let across = Vector3::new(-angle.sin(), angle.cos(), 0.0);
            let reach = |(end, radius): &(Vector3<f64>, f64)| end.dot(&toward) + radius;
            let farthest = ends.iter().map(reach).fold(f64::NEG_INFINITY, f64::max);
            let flush = || ends.iter().filter(|end| reach(end) > farthest - FLUSH);
            let [low, high] = bounds(flush().map(|(end, _)| end.dot(&across)));
            let count = flush().count().max(1) as f64;
            let radius = flush().map(|(_, radius)| radius).sum::<f64>() / count;
            let height = flush().map(|(end, _)| end.z).sum::<f64>() / count;
            FacePoint {
                axis: toward * (farthest - radius) + across * (0.5 * (low + high)) + Vector3::z() * height,
                radius,
                angle,
                half_width: 0.5 * (high - low),
            }
        };
        let ground = || robot.contacts.iter().filter(|c| c.leg == side).map(|c| turn * (pose.point(&c.at) - sole));
        let spread = |k: usize| {
            let low = ends.iter().map(|(end, radius)| end[k] - radius).fold(f64::INFINITY, f64::min);
            let high = ends.iter().map(|(end, radius)| end[k] + radius).fold(f64::NEG_INFINITY, f64::max);
            [low, high]
        };
        Self {
            faces: [face(0.0), face(-out * FRAC_PI_2), face(out * FRAC_PI_2), face(PI)],
            stand_x: bounds(ground().map(|p| p.x)),
            stand_y: bounds(ground().map(|p| p.y)),
            outline_x: spread(0),
            outline_y: spread(1),
        }
    }

    /// A face; `turn` (rad) is the kick's direction from the foot's x axis and says which corner.
    #[must_use]
    pub fn face(&self, face: Face, turn: f64) -> FacePoint {
        let front = self.faces[0];
        match face {
            Face::Front => front,
            Face::Inner => self.faces[1],
            Face::Outer => self.faces[2],
            Face::Back => self.faces[3],
            // The end of the front capsule is a sphere: it strikes in every direction between front and side.
            Face::Corner => FacePoint {
                axis: front.axis + Vector3::y() * front.half_width.copysign(turn),
                angle: turn,
                half_width: 0.0,
                ..front
            },
        }
    }
}

fn bounds(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

/// Angle in (-pi, pi].
pub(crate) fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

/// Equation (1) with its corridor: the foot that the paper's rule chooses for a ball at `ball` (m) and a kick toward
/// `direction` (rad) in the footprint frame; `corridor` is its full width (m).
#[must_use]
pub fn paper_choice(ball: [f64; 2], direction: f64, corridor: f64) -> Side {
    let left = if ball[1].abs() > 0.5 * corridor {
        ball[1] > 0.0
    } else {
        // alpha: angle of the ball's place; beta: angle of the kick.
        direction - ball[1].atan2(ball[0]) < 0.0
    };
    if left { Side::Left } else { Side::Right }
}

/// Section 3.4: the face that the paper's rule chooses for `side` and `direction` (rad).
#[must_use]
pub fn paper_face(side: Side, direction: f64) -> Face {
    let outward = if side == Side::Left { direction } else { -direction };
    match outward {
        o if o.abs() <= std::f64::consts::FRAC_PI_4 => Face::Front,
        o if o > 0.0 => Face::Outer,
        _ => Face::Inner,
    }
}

/// Sole's centre and height at the contact with a ball at `ball` (m, any frame) for a kick toward `direction` (rad)
/// with `face` and the foot's `yaw` (rad); `height` (m) is the sole's.
#[must_use]
pub fn contact_point(
    ball: Vector2<f64>,
    direction: f64,
    face: &FacePoint,
    yaw: f64,
    height: f64,
    radius: f64,
) -> Vector3<f64> {
    let rise = radius - (height + face.axis.z);
    let reach = radius + face.radius;
    let apart = (reach * reach - rise * rise).max(0.0).sqrt();
    let axis = ball - Vector2::new(direction.cos(), direction.sin()) * apart;
    let sole = axis - Rotation2::new(yaw) * face.axis.xy();
    Vector3::new(sole.x, sole.y, height)
}

/// Equation (2): the point `distance` (m) behind `contact` against `direction` (rad), at the same height.
#[must_use]
pub fn windup_point(contact: &Vector3<f64>, direction: f64, distance: f64) -> Vector3<f64> {
    contact - Vector3::new(direction.cos(), direction.sin(), 0.0) * distance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equation_1_divides_by_angle_inside_the_corridor_and_by_side_outside() {
        assert_eq!(paper_choice([0.2, 0.05], 0.0, 0.4), Side::Left);
        assert_eq!(paper_choice([0.2, -0.05], 0.0, 0.4), Side::Right);
        // A ball on the right to be kicked to the right: the left foot, where the ball is in the corridor.
        assert_eq!(paper_choice([0.2, -0.05], -0.5, 0.4), Side::Left);
        assert_eq!(paper_choice([0.2, -0.25], -0.5, 0.4), Side::Right);
    }

    #[test]
    fn equation_2_lies_behind_the_ball() {
        let p = windup_point(&Vector3::new(0.2, 0.1, 0.03), 0.5, 0.1);
        assert!((p - Vector3::new(0.2 - 0.1 * 0.5f64.cos(), 0.1 - 0.1 * 0.5f64.sin(), 0.03)).norm() < 1e-15);
    }

    #[test]
    fn the_face_turns_at_45_degrees() {
        assert_eq!(paper_face(Side::Right, 0.78), Face::Front);
        assert_eq!(paper_face(Side::Right, 0.79), Face::Inner);
        assert_eq!(paper_face(Side::Right, -0.79), Face::Outer);
        assert_eq!(paper_face(Side::Left, 0.79), Face::Outer);
    }
}
