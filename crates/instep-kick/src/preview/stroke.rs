//! The kick: two cubics through a via point (paper 5, section 5 and equation (12); the polynomial and the slips of the
//! printed system are in [`instep_motion::spline::ViaPoint`]), laid so that the foot passes the ball as it should.
//!
//! The paper's foot comes to rest at the contact point. A foot at rest moves no ball, so the curve ends `follow` behind
//! the contact here, and the foot meets the ball on the way. The curve is that of the striking face in the kick's frame:
//! x along the kick, y to the left, z up, origin where the face is at the contact. A via point aside of the straight way
//! bends the curve; it is then moved and turned so that it goes through the contact along the kick's direction all the
//! same. All times of the curve are proportional, so one shape serves every strength.

use instep_motion::phase::Side;
use instep_motion::spline::ViaPoint;
use nalgebra::{Rotation2, Rotation3, Vector2, Vector3};

use crate::engine::Face;
use crate::preview::settings::{Kick, Swing};

/// The shape of a kick, in a time of one second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Retraction, via and end point, m.
    pub points: [Vector3<f64>; 3],
    /// Share of the time from the retraction to the via point.
    pub share: f64,
    /// Share of the time until the contact.
    pub contact: f64,
    /// Speed along the kick at the contact, m (in one second): over the whole time, the speed of a real kick.
    pub speed: f64,
}

impl Shape {
    /// The shape that `kick` asks for between a retraction point `retraction` (m) behind and an end `follow` (m) after the
    /// contact; `None` when it does not pass the contact forward.
    #[must_use]
    pub fn new(kick: &Kick, swing: &Swing, retraction: f64, follow: f64) -> Option<Self> {
        let start = Vector3::new(-retraction, 0.0, swing.rise * retraction / swing.retraction);
        let end = Vector3::new(follow, 0.0, swing.follow_rise * follow / swing.follow);
        let via = start + (end - start) * kick.via + Vector3::from(kick.offset);
        let mut shape = Self { points: [start, via, end], share: kick.share, contact: 0.0, speed: 0.0 };
        let curve = shape.curve(1.0)?;
        // The first passage of the contact, by bisection between the last sample before it and the next.
        let samples = (1..=200).map(|i| f64::from(i) / 200.0);
        let after = samples.into_iter().find(|t| curve.position(*t)[0] >= 0.0)?;
        let (mut low, mut high) = (after - 1.0 / 200.0, after);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if curve.position(middle)[0] < 0.0 { low = middle } else { high = middle }
        }
        shape.contact = 0.5 * (low + high);
        let [_, y, z] = curve.position(shape.contact);
        let [vx, vy, _] = curve.velocity(shape.contact);
        shape.speed = vx.hypot(vy);
        // Every coordinate is linear in the points: what moves them moves the curve.
        let turn = Rotation2::new(-vy.atan2(vx));
        for point in &mut shape.points {
            let level = turn * Vector2::new(point.x, point.y - y);
            *point = Vector3::new(level.x, level.y, point.z - z);
        }
        (vx > 1e-3).then_some(shape)
    }

    /// The curve over `time` (s) in all; `None` when a time cannot be.
    #[must_use]
    pub fn curve(&self, time: f64) -> Option<ViaPoint<3>> {
        let [start, via, end] = self.points.map(Into::into);
        ViaPoint::new(start, (time * self.share, via), (time * (1.0 - self.share), end), [0.0; 3]).ok()
    }
}

/// The kicking part of a motion: everything that depends on the ball.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stroke {
    pub(crate) swing: Side,
    pub(crate) face: Face,
    /// Foot yaw, rad.
    pub(crate) yaw: f64,
    /// Sole's centre at the contact in the support sole's frame, m.
    pub(crate) contact: Vector3<f64>,
    /// Direction in which the foot moves, rad.
    pub(crate) direction: f64,
    /// The striking face's axis in the sole's frame, m: the foot pitches about it.
    pub(crate) axis: Vector3<f64>,
    /// Pitch of the foot over its way, rad/m.
    pub(crate) pitch: f64,
    pub(crate) shape: Shape,
    /// Whole time of the curve, s.
    pub(crate) time: f64,
}

impl Stroke {
    /// Sole's x, y, z, yaw and pitch where the striking face is at `point` (m) of the kick's frame.
    pub(crate) fn pose(&self, point: &Vector3<f64>) -> [f64; 5] {
        let pitch = -self.pitch * point.x;
        let yaw = Rotation3::from_axis_angle(&Vector3::z_axis(), self.yaw);
        let pitched = yaw * Rotation3::from_axis_angle(&Vector3::y_axis(), pitch) * self.axis;
        let kick = Rotation3::from_axis_angle(&Vector3::z_axis(), self.direction);
        let sole = self.contact + yaw * self.axis + kick * point - pitched;
        [sole.x, sole.y, sole.z, self.yaw, pitch]
    }

    /// The retraction point.
    pub(crate) fn retraction(&self) -> [f64; 5] {
        self.pose(&self.shape.points[0])
    }

    /// Where the foot comes to rest.
    pub(crate) fn end(&self) -> [f64; 5] {
        self.pose(&self.shape.points[2])
    }

    /// The foot at `time` (s) after the retraction point.
    pub(crate) fn at(&self, time: f64) -> [f64; 5] {
        let point = self.shape.curve(self.time).map_or(self.shape.points[2], |curve| curve.position(time).into());
        self.pose(&point)
    }

    /// Speed of the foot at the contact, m/s.
    pub(crate) fn speed(&self) -> f64 {
        self.shape.speed / self.time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing() -> Swing {
        Swing {
            retraction: 0.09,
            retraction_least: 0.03,
            rise: 0.02,
            follow: 0.06,
            follow_rise: 0.01,
            lift: 0.03,
            height: 0.0,
            sole_least: 0.01,
            pitch: 1.0,
            speed_gain: 1.0,
            corridor: 0.2,
            yaw: 0.9,
            base_yaw: 0.4,
        }
    }

    #[test]
    fn a_bent_curve_still_passes_the_contact_along_the_kick() {
        for offset in [[0.0; 3], [0.01, 0.02, -0.01], [-0.02, -0.015, 0.02]] {
            for share in [0.3, 0.5, 0.7] {
                let kick = Kick { time: 0.4, share, via: 0.5, offset };
                let shape = Shape::new(&kick, &swing(), 0.09, 0.06).unwrap();
                let curve = shape.curve(0.5).unwrap();
                let at = curve.position(0.5 * shape.contact);
                assert!(at.iter().all(|x| x.abs() < 1e-9), "{at:?}");
                let v = curve.velocity(0.5 * shape.contact);
                assert!(v[1].abs() < 1e-9 && (v[0] - shape.speed / 0.5).abs() < 1e-6, "{v:?}");
            }
        }
    }

    #[test]
    fn the_constraints_of_equation_12_hold() {
        let kick = Kick { time: 0.4, share: 0.45, via: 0.6, offset: [0.01, 0.01, -0.01] };
        let shape = Shape::new(&kick, &swing(), 0.09, 0.06).unwrap();
        let curve = shape.curve(0.4).unwrap();
        let (t, end, tiny) = (curve.t_via(), curve.duration(), 1e-12);
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(near(curve.position(0.0), shape.points[0].into()) && near(curve.velocity(0.0), [0.0; 3]));
        assert!(near(curve.position(end), shape.points[2].into()) && near(curve.velocity(end), [0.0; 3]));
        assert!(near(curve.position(t), shape.points[1].into()));
        assert!(near(curve.position(t - tiny), curve.position(t)) && near(curve.velocity(t - tiny), curve.velocity(t)));
        assert!(near(curve.acceleration(t - tiny), curve.acceleration(t)));
    }
}
