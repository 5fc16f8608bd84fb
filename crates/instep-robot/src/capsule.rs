//! Distance between two capsules: the distance between their axes, which are line segments.
//!
//! Source: Ericson, Real-Time Collision Detection (2005), section 5.1.9, closest points of two segments. Smooth
//! except where the closest points jump between ends (parallel axes); degenerate segments (spheres) are handled.

use nalgebra::Vector3;

/// The two points of two segments that are closest to each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentPair {
    /// Point on the first segment, m.
    pub first: Vector3<f64>,
    /// Point on the second segment, m.
    pub second: Vector3<f64>,
}

impl SegmentPair {
    /// Distance between the two points, m.
    #[must_use]
    pub fn distance(&self) -> f64 {
        (self.second - self.first).norm()
    }
}

/// The closest points of the segments `a[0]..a[1]` and `b[0]..b[1]`.
#[must_use]
pub fn closest_points(a: [Vector3<f64>; 2], b: [Vector3<f64>; 2]) -> SegmentPair {
    const TINY: f64 = 1e-14;
    let along_a = a[1] - a[0];
    let along_b = b[1] - b[0];
    let between = a[0] - b[0];
    let aa = along_a.norm_squared();
    let bb = along_b.norm_squared();
    let b_between = along_b.dot(&between);

    let (s, t) = if aa <= TINY && bb <= TINY {
        (0.0, 0.0)
    } else if aa <= TINY {
        (0.0, (b_between / bb).clamp(0.0, 1.0))
    } else {
        let a_between = along_a.dot(&between);
        if bb <= TINY {
            ((-a_between / aa).clamp(0.0, 1.0), 0.0)
        } else {
            let ab = along_a.dot(&along_b);
            let denominator = aa * bb - ab * ab;
            // Parallel axes: any point of the first will do; take the middle, so that the choice does not jump.
            let s = if denominator > TINY * aa * bb {
                ((ab * b_between - a_between * bb) / denominator).clamp(0.0, 1.0)
            } else {
                0.5
            };
            let t = (ab * s + b_between) / bb;
            if t < 0.0 {
                ((-a_between / aa).clamp(0.0, 1.0), 0.0)
            } else if t > 1.0 {
                (((ab - a_between) / aa).clamp(0.0, 1.0), 1.0)
            } else {
                (s, t)
            }
        }
    };
    SegmentPair { first: a[0] + along_a * s, second: b[0] + along_b * t }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(|[x, y, z]| Vector3::new(x, y, z))
    }

    #[test]
    fn crossed_segments_meet_where_they_should() {
        let pair = closest_points(
            [Vector3::new(-1.0, 0.0, 0.0), Vector3::new(1.0, 0.0, 0.0)],
            [Vector3::new(0.2, -1.0, 0.5), Vector3::new(0.2, 1.0, 0.5)],
        );
        assert!((pair.distance() - 0.5).abs() < 1e-15);
        assert!((pair.first - Vector3::new(0.2, 0.0, 0.0)).norm() < 1e-15);
    }

    proptest! {
        /// No sampled pair of points is closer than the one returned.
        #[test]
        fn no_other_points_are_closer(a0 in point(), a1 in point(), b0 in point(), b1 in point()) {
            let best = closest_points([a0, a1], [b0, b1]).distance();
            for i in 0..=20 {
                for j in 0..=20 {
                    let on_a = a0 + (a1 - a0) * (f64::from(i) / 20.0);
                    let on_b = b0 + (b1 - b0) * (f64::from(j) / 20.0);
                    prop_assert!(best <= (on_b - on_a).norm() + 1e-12);
                }
            }
        }
    }
}
