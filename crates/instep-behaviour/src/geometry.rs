//! Vectors in the plane, as little as the decisions need.

use serde::{Deserialize, Serialize};

/// A point or a vector, m.
pub type Point = [f64; 2];

/// A robot seen from above, in the field frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Circle {
    /// Middle, m.
    pub center: Point,
    /// Radius, m.
    pub radius: f64,
}

pub(crate) fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

/// `a + t b`.
pub(crate) fn along(a: Point, b: Point, t: f64) -> Point {
    [a[0] + t * b[0], a[1] + t * b[1]]
}

pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub(crate) fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

pub(crate) fn norm(a: Point) -> f64 {
    dot(a, a).sqrt()
}

pub(crate) fn distance(a: Point, b: Point) -> f64 {
    norm(sub(a, b))
}

/// Unit vector of a direction, rad.
pub(crate) fn unit(direction: f64) -> Point {
    let (s, c) = direction.sin_cos();
    [c, s]
}

/// Direction from `a` to `b`, rad.
pub(crate) fn bearing(a: Point, b: Point) -> f64 {
    (b[1] - a[1]).atan2(b[0] - a[0])
}

/// Whether the straight line of sight from `eye` to `point` passes through the circle before it reaches the point: the
/// point lies in the circle's shadow.
pub(crate) fn in_shadow(eye: Point, point: Point, circle: &Circle) -> bool {
    let way = sub(point, eye);
    let square = dot(way, way);
    if square < 1e-12 {
        return false;
    }
    let at = dot(sub(circle.center, eye), way) / square;
    if at <= 0.0 || at >= 1.0 {
        return false;
    }
    let off = sub(circle.center, along(eye, way, at));
    dot(off, off) < circle.radius * circle.radius
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shadow_lies_behind_an_obstacle_and_nowhere_else() {
        let robot = Circle { center: [2.0, 0.0], radius: 0.3 };
        assert!(in_shadow([0.0, 0.0], [4.0, 0.1], &robot));
        assert!(!in_shadow([0.0, 0.0], [1.5, 0.0], &robot));
        assert!(!in_shadow([0.0, 0.0], [4.0, 1.0], &robot));
        assert!(!in_shadow([0.0, 0.0], [-4.0, 0.0], &robot));
    }
}
