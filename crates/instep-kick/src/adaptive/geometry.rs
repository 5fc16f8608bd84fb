//! Where the foot must be to send the ball in a direction (paper 3, figure 1 and section 2).
//!
//! The paper's rule takes ball and foot for two spheres: p_h = p_b - v_b r_b, p_f = p_h - v_b r_f. Its experiments show a
//! systematic offset and a hole around 20 degrees, which it puts down to the foot's true shape and to a kick that is not
//! fully elastic. Here the foot is what it is: flat at the front and at the sides, round at its two front corners. A flat part
//! strikes along its normal wherever it is hit, so the foot turns until that is the wanted direction; where it cannot, a
//! corner is used. Friction throws the ball toward the foot's own direction; the target is turned back by that angle.

use std::f64::consts::FRAC_PI_2;

use instep_motion::phase::Side;
use nalgebra::{Vector2, Vector3};

use crate::engine::Face;
use crate::whole_body::body::Body;
use crate::whole_body::foot::{FacePoint, Foot, contact_point, wrap};

/// Which part of the foot strikes, and how the foot is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Part {
    pub(crate) face: Face,
    /// How far from a flat part's middle the ball is met, as a share of its half width.
    pub(crate) slide: f64,
    /// Foot yaw with a corner, rad; with a flat part it follows from the direction.
    pub(crate) yaw: f64,
}

/// Yaw of the foot from one corner part to the next, rad.
const YAW_STEP: f64 = 0.15;
/// Shares of the half width at which a flat part may be hit.
const SLIDES: [f64; 5] = [0.0, 0.5, -0.5, 0.95, -0.95];
const FLAT: usize = 3 * SLIDES.len();
/// Corner parts.
const CORNERS: usize = 11;
/// All parts that are tried, in order.
pub(crate) const PARTS: usize = FLAT + CORNERS;
/// Least and greatest angle from the foot's x axis at which a corner strikes, rad.
const CORNER_RANGE: [f64; 2] = [0.03, 1.5];

impl Part {
    /// Part `index` of [`PARTS`].
    pub(crate) fn of(index: usize) -> Self {
        match index {
            ..FLAT => Self {
                face: [Face::Front, Face::Inner, Face::Outer][index / SLIDES.len()],
                slide: SLIDES[index % SLIDES.len()],
                yaw: 0.0,
            },
            _ => {
                // 0, then one step to either side, then two.
                let step = (index - FLAT).div_ceil(2) as f64;
                let side = if (index - FLAT) % 2 == 1 { 1.0 } else { -1.0 };
                Self { face: Face::Corner, slide: 0.0, yaw: side * step * YAW_STEP }
            }
        }
    }

    /// The foot's yaw (rad) and striking point for a push along `normal` (rad); `None` where this part cannot.
    pub(crate) fn meet(&self, foot: &Foot, normal: f64, yaw_limit: f64) -> Option<(f64, FacePoint)> {
        if self.face == Face::Corner {
            let turned = wrap(normal - self.yaw);
            let fits = self.yaw.abs() <= yaw_limit && (CORNER_RANGE[0]..=CORNER_RANGE[1]).contains(&turned.abs());
            return fits.then(|| (self.yaw, foot.face(Face::Corner, turned)));
        }
        let mut point = foot.face(self.face, 0.0);
        let yaw = wrap(normal - point.angle);
        let across = Vector3::new(-point.angle.sin(), point.angle.cos(), 0.0);
        point.axis += across * (self.slide * point.half_width);
        (yaw.abs() <= yaw_limit).then_some((yaw, point))
    }
}

/// The paper's foot: a sphere of half the foot's width behind the toes.
pub(crate) fn sphere(foot: &Foot) -> FacePoint {
    let [right, left] = foot.outline_y;
    let radius = 0.5 * (left - right);
    let axis = Vector3::new(foot.outline_x[1] - radius, 0.5 * (left + right), foot.faces[0].axis.z);
    FacePoint { axis, radius, angle: 0.0, half_width: 0.0 }
}

/// The sole's centre p_f for a ball at `ball` (m) that `point` of the foot, turned by `yaw` (rad), pushes along
/// `normal` (rad). The striking part is `height` (m) over the ball's centre, the sole at least at `floor` (m).
pub(crate) fn target(
    ball: Vector2<f64>,
    normal: f64,
    (yaw, point): (f64, &FacePoint),
    radius: f64,
    [height, floor]: [f64; 2],
) -> Vector3<f64> {
    let sole = (radius + height - point.axis.z).max(floor);
    contact_point(ball, normal, point, yaw, sole, radius)
}

/// Angle (rad) by which friction turns the ball from the contact's normal toward the foot's direction, which is `off` (rad)
/// from the normal.
///
/// A foot much heavier than the ball gives it (1 + e) v cos(off) along the normal. Across it, friction brings the surface of
/// the ball, a thin shell, to the foot's speed: 2/5 v sin(off) at its centre, unless that asks for more than the friction
/// coefficient times the normal impulse.
pub(crate) fn throw(off: f64, restitution: f64, friction: f64) -> f64 {
    let stick = 0.4 * off.clamp(-1.4, 1.4).tan() / (1.0 + restitution);
    stick.clamp(-friction, friction).atan()
}

/// A place or direction in the support sole's frame as the grid was measured: with the right foot swinging.
pub(crate) fn measured(swing: Side, point: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(point.x, -Body::sign(swing) * point.y, point.z)
}

/// Whether `direction` is within a right angle of the foot's front, so that some part can push that way.
pub(crate) fn possible(direction: f64) -> bool {
    wrap(direction).abs() <= FRAC_PI_2 + 0.8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_throw_is_a_quarter_of_the_angle_until_the_foot_slips() {
        assert!((throw(0.1, 0.6, 0.5) - 0.025).abs() < 1e-3);
        assert!((throw(-0.1, 0.6, 0.5) + throw(0.1, 0.6, 0.5)).abs() < 1e-15);
        assert!((throw(1.3, 0.6, 0.2) - 0.2_f64.atan()).abs() < 1e-12);
    }

    #[test]
    fn every_part_is_another() {
        let parts: Vec<Part> = (0..PARTS).map(Part::of).collect();
        for (i, a) in parts.iter().enumerate() {
            assert!(parts[..i].iter().all(|b| a != b), "{a:?}");
        }
        assert!(parts[FLAT].yaw.abs() < 1e-12 && (parts[FLAT + 1].yaw - YAW_STEP).abs() < 1e-12);
    }
}
