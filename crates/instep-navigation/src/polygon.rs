//! Keep-outs as the planner sees them: regular octagons.
//!
//! Circumscribed about the disc that the tracker keeps out of. An inscribed polygon would lead the path through the disc,
//! and planner and tracker would fight.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Corners.
pub const SIDES: usize = 8;
/// Normals of the faces; the other four are opposite.
const NORMALS: [[f64; 2]; 4] =
    [[1.0, 0.0], [FRAC_1_SQRT_2, FRAC_1_SQRT_2], [0.0, 1.0], [-FRAC_1_SQRT_2, FRAC_1_SQRT_2]];
/// What lies less deep inside is not inside, m: a side of a polygon does not cut it.
const SKIN: f64 = 1e-7;

/// A regular octagon with two faces across x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polygon {
    /// Middle, m.
    pub center: [f64; 2],
    /// From the middle to each face: the radius of the disc inside, m.
    pub apothem: f64,
}

impl Polygon {
    /// From the middle to each corner, m.
    #[must_use]
    pub fn circumradius(&self) -> f64 {
        self.apothem / (PI / SIDES as f64).cos()
    }

    /// Corner `k`, counter-clockwise.
    #[must_use]
    pub fn corner(&self, k: usize) -> [f64; 2] {
        let (s, c) = (PI / SIDES as f64 * (2 * (k % SIDES) + 1) as f64).sin_cos();
        let r = self.circumradius();
        [self.center[0] + r * c, self.center[1] + r * s]
    }

    /// Whether a point lies inside; the edge does not.
    #[must_use]
    pub fn contains(&self, point: [f64; 2]) -> bool {
        let [x, y] = [point[0] - self.center[0], point[1] - self.center[1]];
        NORMALS.iter().all(|n| (n[0] * x + n[1] * y).abs() < self.apothem - SKIN)
    }

    /// How far a point lies inside, to the nearest face, m; negative outside.
    #[must_use]
    pub fn depth(&self, point: [f64; 2]) -> f64 {
        let [x, y] = [point[0] - self.center[0], point[1] - self.center[1]];
        self.apothem - NORMALS.iter().fold(0.0_f64, |most, n| most.max((n[0] * x + n[1] * y).abs()))
    }

    /// Which share of the segment lies inside: four slabs, each of which cuts a piece off.
    #[must_use]
    pub fn share_inside(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let half = self.apothem - SKIN;
        let a = [from[0] - self.center[0], from[1] - self.center[1]];
        let b = [to[0] - self.center[0], to[1] - self.center[1]];
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for n in &NORMALS {
            let p = n[0] * a[0] + n[1] * a[1];
            let q = n[0] * b[0] + n[1] * b[1];
            let d = q - p;
            if d.abs() < 1e-12 {
                if p.abs() >= half {
                    return 0.0;
                }
                continue;
            }
            let (t, u) = ((-half - p) / d, (half - p) / d);
            enter = enter.max(t.min(u));
            leave = leave.min(t.max(u));
            if enter >= leave {
                return 0.0;
            }
        }
        leave - enter
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Polygon = Polygon { center: [1.0, 2.0], apothem: 1.0 };

    #[test]
    fn the_disc_lies_inside_and_touches_each_face() {
        for k in 0..SIDES {
            let (a, b) = (UNIT.corner(k), UNIT.corner(k + 1));
            let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            assert!(((middle[0] - 1.0).hypot(middle[1] - 2.0) - 1.0).abs() < 1e-12);
            assert_eq!(UNIT.share_inside(a, b), 0.0, "a side does not cut");
            assert!(UNIT.share_inside(a, UNIT.corner(k + 2)) > 0.99, "a diagonal does");
        }
    }

    #[test]
    fn the_share_is_that_of_a_fine_sampling() {
        for k in 0..200 {
            let t = f64::from(k);
            let from = [1.0 + 3.0 * (0.7 * t).sin(), 2.0 + 2.0 * (1.3 * t).cos()];
            let to = [1.0 + 2.5 * (2.1 * t).cos(), 2.0 + 3.0 * (0.4 * t).sin()];
            let count = 4000;
            let inside = (0..count).filter(|i| {
                let s = (f64::from(*i) + 0.5) / f64::from(count);
                UNIT.contains([from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1])])
            });
            let sampled = inside.count() as f64 / f64::from(count);
            assert!((UNIT.share_inside(from, to) - sampled).abs() < 1e-3, "{from:?} {to:?}");
        }
    }
}
