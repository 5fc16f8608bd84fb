//! Poses in the plane: where a robot's base stands on the ground and where it looks (the group SE(2)).

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

/// An angle brought into (-pi, pi], rad.
pub fn wrap(angle: f64) -> f64 {
    let turned = (angle + PI).rem_euclid(TAU) - PI;
    if turned <= -PI { PI } else { turned }
}

/// A pose in the plane. Read as `field_from_robot`: the robot's ground projection in the field frame, and the
/// direction of its x axis.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// Along the field's x, m.
    pub x: f64,
    /// Along the field's y, m.
    pub y: f64,
    /// From the field's x axis to the robot's, counter-clockwise, rad.
    pub heading: f64,
}

impl Pose {
    /// A pose; the heading is wrapped.
    pub fn new(x: f64, y: f64, heading: f64) -> Self {
        Self { x, y, heading: wrap(heading) }
    }

    /// The position alone, m.
    pub fn position(&self) -> [f64; 2] {
        [self.x, self.y]
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.heading.is_finite()
    }

    /// `a_from_b.then(b_from_c)` is `a_from_c`: a step or a sight in this pose's own frame, put into the outer frame.
    #[must_use]
    pub fn then(&self, inner: &Pose) -> Pose {
        let [x, y] = self.outer_from_local([inner.x, inner.y]);
        Pose::new(x, y, self.heading + inner.heading)
    }

    /// `b_from_a` of an `a_from_b`.
    #[must_use]
    pub fn inverse(&self) -> Pose {
        let (s, c) = self.heading.sin_cos();
        Pose::new(-c * self.x - s * self.y, s * self.x - c * self.y, -self.heading)
    }

    /// `self` seen from `from`: `from.then(&from.relative(to)) == to`.
    #[must_use]
    pub fn relative(&self, to: &Pose) -> Pose {
        let [x, y] = self.local_from_outer([to.x, to.y]);
        Pose::new(x, y, to.heading - self.heading)
    }

    /// A point of this pose's own frame (robot) in the outer one (field), m.
    pub fn outer_from_local(&self, point: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.heading.sin_cos();
        [self.x + c * point[0] - s * point[1], self.y + s * point[0] + c * point[1]]
    }

    /// A point of the outer frame (field) in this pose's own (robot), m.
    pub fn local_from_outer(&self, point: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.heading.sin_cos();
        let [dx, dy] = [point[0] - self.x, point[1] - self.y];
        [c * dx + s * dy, -s * dx + c * dy]
    }

    /// Distance on the ground, m.
    pub fn distance(&self, other: &Pose) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }

    /// Direction from here to a point, in the outer frame, rad.
    pub fn bearing_to(&self, point: [f64; 2]) -> f64 {
        (point[1] - self.y).atan2(point[0] - self.x)
    }

    /// The pose that looks the same on a soccer field: half a turn about the centre mark. Also this pose in the other
    /// team's frame.
    #[must_use]
    pub fn mirrored(&self) -> Pose {
        Pose::new(-self.x, -self.y, self.heading + PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Pose = Pose { x: 1.5, y: -2.0, heading: 2.3 };
    const B: Pose = Pose { x: -0.4, y: 3.0, heading: -1.9 };

    fn assert_close(a: Pose, b: Pose) {
        assert!(a.distance(&b) < 1e-12 && wrap(a.heading - b.heading).abs() < 1e-12, "{a:?} {b:?}");
    }

    #[test]
    fn group_laws() {
        assert_close(A.then(&A.inverse()), Pose::default());
        assert_close(A.inverse().then(&A), Pose::default());
        assert_close(A.then(&A.relative(&B)), B);
        assert_close(A.then(&B).inverse(), B.inverse().then(&A.inverse()));
        assert_close(A.mirrored().mirrored(), A);
        let there = A.outer_from_local([0.3, -0.7]);
        let back = A.local_from_outer(there);
        assert!((back[0] - 0.3).abs() < 1e-12 && (back[1] + 0.7).abs() < 1e-12);
    }

    #[test]
    fn a_robot_that_looks_left_sees_the_left_goal_post_ahead() {
        let robot = Pose::new(0.0, 0.0, PI / 2.0);
        let p = robot.local_from_outer([0.0, 2.0]);
        assert!((p[0] - 2.0).abs() < 1e-12 && p[1].abs() < 1e-12);
        assert!((robot.bearing_to([0.0, 2.0]) - PI / 2.0).abs() < 1e-12);
    }

    #[test]
    fn wrap_keeps_the_direction_and_lands_in_range() {
        for k in -50..50 {
            let angle = f64::from(k) * 0.7;
            let w = wrap(angle);
            assert!(w > -PI && w <= PI);
            assert!((w.sin() - angle.sin()).abs() < 1e-12 && (w.cos() - angle.cos()).abs() < 1e-12);
        }
        assert_eq!(wrap(PI), PI);
        assert_eq!(wrap(-PI), PI);
        assert!(wrap(f64::NAN).is_nan());
    }
}
