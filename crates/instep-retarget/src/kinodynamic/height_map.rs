//! The ground's height gamma_gnd(x, y) of (12) and (13), between the points of a regular grid.
//!
//! Inside a cell of the grid the height is bilinear: continuous everywhere, its gradient only inside a cell. A foot
//! stands well where the ground under all of it is one plane; where it is not, the verification says how far standing
//! points are off it. Beyond its edges the ground goes on level along the direction that leaves the grid, so that one
//! height alone is a level plane.
//!
//! Contact points are spheres. One touches ground of slope g = grad gamma when its centre is radius sqrt(1 + |g|^2)
//! above the ground below it: exact on a plane.
//!
//! Frame: the reference's world, x along the kick, y to its left, z up, the ball above the origin. Units: m.

use nalgebra::{Rotation3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::RetargetError;

/// The ground; level at z = 0 unless said otherwise. A plane that rises by 5 % along the kick:
///
/// ```toml
/// [kinodynamic.ground]
/// origin = [-5.0, 0.0]
/// spacing = 10.0
/// heights = [[-0.25], [0.25]]
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HeightMap {
    /// x and y of the first height, m; -100 to 100 each.
    pub origin: [f64; 2],
    /// Distance between neighbouring heights, along x and along y, m; 0.01 to 100.
    pub spacing: f64,
    /// Height i, j at x = origin\[0\] + i spacing, y = origin\[1\] + j spacing, m; -2 to 2 each. All rows are equally long.
    pub heights: Vec<Vec<f64>>,
}

impl Default for HeightMap {
    fn default() -> Self {
        Self { origin: [0.0; 2], spacing: 1.0, heights: vec![vec![0.0]] }
    }
}

/// A place between two neighbours of the grid along one axis.
struct Between {
    cell: usize,
    share: f64,
    /// By how much the share changes over a metre: none beyond the edges.
    rate: f64,
}

/// The ground at one place.
struct Surface {
    height: f64,
    gradient: Vector2<f64>,
    /// The mixed second derivative; a bilinear cell has no other.
    twist: f64,
}

impl HeightMap {
    /// Height of the ground at `x`, `y`, m.
    #[must_use]
    pub fn height(&self, x: f64, y: f64) -> f64 {
        self.surface(x, y).height
    }

    /// Slope of the ground along x and y.
    #[must_use]
    pub fn gradient(&self, x: f64, y: f64) -> Vector2<f64> {
        self.surface(x, y).gradient
    }

    /// The direction straight off the ground: unit length, z above 0.
    #[must_use]
    pub fn normal(&self, x: f64, y: f64) -> Vector3<f64> {
        normal(&self.gradient(x, y))
    }

    /// Height at which the centre of a sphere of `radius` rests on the ground, m, and its gradient.
    #[must_use]
    pub fn rest(&self, x: f64, y: f64, radius: f64) -> (f64, Vector2<f64>) {
        let Surface { height, gradient, twist } = self.surface(x, y);
        let stretch = (1.0 + gradient.norm_squared()).sqrt();
        (height + radius * stretch, gradient + gradient.yx() * (radius * twist / stretch))
    }

    fn surface(&self, x: f64, y: f64) -> Surface {
        let wide = self.heights.first().map_or(0, Vec::len);
        let (a, b) = (self.between(x - self.origin[0], self.heights.len()), self.between(y - self.origin[1], wide));
        let at = |i: usize, j: usize| {
            let row = self.heights.get((a.cell + i).min(self.heights.len().saturating_sub(1)));
            row.and_then(|row| row.get((b.cell + j).min(wide.saturating_sub(1)))).copied().unwrap_or(0.0)
        };
        let (near, far) = ([at(0, 0), at(0, 1)], [at(1, 0), at(1, 1)]);
        let mix = |[from, to]: [f64; 2], share: f64| from + share * (to - from);
        let along = [mix([near[0], far[0]], a.share), mix([near[1], far[1]], a.share)];
        let rise = [far[0] - near[0], far[1] - near[1]];
        Surface {
            height: mix(along, b.share),
            gradient: Vector2::new(mix(rise, b.share) * a.rate, (along[1] - along[0]) * b.rate),
            twist: (rise[1] - rise[0]) * a.rate * b.rate,
        }
    }

    /// Where a place `from` the first of `count` heights lies between them.
    fn between(&self, from: f64, count: usize) -> Between {
        let last = count.saturating_sub(1);
        let place = from / self.spacing;
        let inside = (0.0..=last as f64).contains(&place) && last > 0;
        let cell = (place.max(0.0) as usize).min(last.saturating_sub(1));
        let share = (place - cell as f64).clamp(0.0, 1.0);
        Between { cell, share, rate: if inside { 1.0 / self.spacing } else { 0.0 } }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// When one is out of its range, or a row of heights is of another length than the first; the error names it.
    pub(crate) fn validate(&self, field: &str) -> Result<(), RetargetError> {
        let within = |name: String, value: f64, least: f64, most: f64| {
            if (least..=most).contains(&value) {
                return Ok(());
            }
            let expected = format!("{least} to {most}");
            Err(RetargetError::Setting { field: format!("{field}.{name}"), found: value.to_string(), expected })
        };
        within("origin[0]".into(), self.origin[0], -100.0, 100.0)?;
        within("origin[1]".into(), self.origin[1], -100.0, 100.0)?;
        within("spacing".into(), self.spacing, 0.01, 100.0)?;
        let wide = self.heights.first().map_or(0, Vec::len);
        if wide == 0 {
            return Err(RetargetError::Setting {
                field: format!("{field}.heights"),
                found: "none".into(),
                expected: "rows of heights, [[0.05]] at least".into(),
            });
        }
        for (i, row) in self.heights.iter().enumerate() {
            if row.len() != wide {
                return Err(RetargetError::Setting {
                    field: format!("{field}.heights[{i}]"),
                    found: format!("{} heights", row.len()),
                    expected: format!("{wide}, as in the first row"),
                });
            }
            for (j, height) in row.iter().enumerate() {
                within(format!("heights[{i}][{j}]"), *height, -2.0, 2.0)?;
            }
        }
        Ok(())
    }
}

fn normal(gradient: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new(-gradient.x, -gradient.y, 1.0).normalize()
}

/// The least turn that lays level axes on ground of this slope.
pub(crate) fn tilt(gradient: &Vector2<f64>) -> Rotation3<f64> {
    Rotation3::rotation_between(&Vector3::z(), &normal(gradient)).unwrap_or_else(Rotation3::identity)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests stop at the first surprise")]
mod tests {
    use super::*;

    /// Two rows of three heights half a metre apart, none on one plane with its neighbours.
    fn rough() -> HeightMap {
        HeightMap {
            origin: [-0.2, -0.5],
            spacing: 0.5,
            heights: vec![vec![0.0, 0.1, 0.05], vec![0.2, -0.1, 0.12], vec![0.03, 0.3, 0.0]],
        }
    }

    #[test]
    fn heights_are_met_and_gradients_are_differences() {
        let map = rough();
        for (i, row) in map.heights.iter().enumerate() {
            for (j, height) in row.iter().enumerate() {
                let at = [-0.2 + 0.5 * i as f64, -0.5 + 0.5 * j as f64];
                assert!((map.height(at[0], at[1]) - height).abs() < 1e-12, "{at:?}");
            }
        }
        let (e, radius) = (1e-6, 0.03);
        // Inside cells and beyond every edge.
        for x in [-0.7, -0.11, 0.14, 0.47, 0.9] {
            for y in [-0.9, -0.3, 0.11, 0.43, 0.8] {
                let difference = |of: &dyn Fn(f64, f64) -> f64| {
                    Vector2::new(of(x + e, y) - of(x - e, y), of(x, y + e) - of(x, y - e)) / (2.0 * e)
                };
                let miss = difference(&|x, y| map.height(x, y)) - map.gradient(x, y);
                assert!(miss.norm() < 1e-8, "height at {x}, {y}: {miss}");
                let miss = difference(&|x, y| map.rest(x, y, radius).0) - map.rest(x, y, radius).1;
                assert!(miss.norm() < 1e-8, "rest at {x}, {y}: {miss}");
            }
        }
    }

    /// The plane in the documentation, and how far a sphere that rests on it is from it.
    #[test]
    fn a_sphere_rests_on_a_plane_at_its_radius() {
        let plane = HeightMap { origin: [-5.0, 0.0], spacing: 10.0, heights: vec![vec![-0.25], vec![0.25]] };
        assert!((plane.height(2.0, 7.0) - 0.1).abs() < 1e-12);
        let centre = Vector3::new(1.3, -0.4, plane.rest(1.3, -0.4, 0.02).0);
        let distance = (centre - Vector3::new(0.0, 0.0, plane.height(0.0, 0.0))).dot(&plane.normal(1.3, -0.4));
        assert!((distance - 0.02).abs() < 1e-12, "{distance}");
        let up = tilt(&plane.gradient(0.0, 0.0)) * Vector3::z();
        assert!((up - plane.normal(0.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn what_cannot_be_ground_is_named() {
        let says = |map: HeightMap| map.validate("kinodynamic.ground").unwrap_err().to_string();
        assert!(HeightMap::default().validate("").is_ok() && rough().validate("").is_ok());
        let mut map = rough();
        map.heights[1][2] = f64::NAN;
        assert!(says(map).starts_with("kinodynamic.ground.heights[1][2]: NaN; expected -2 to 2"));
        let mut map = rough();
        map.heights[2].pop();
        assert!(says(map).starts_with("kinodynamic.ground.heights[2]: 2 heights; expected 3"));
        assert!(says(HeightMap { spacing: 0.0, ..rough() }).contains("ground.spacing: 0"));
        assert!(says(HeightMap { heights: vec![], ..rough() }).contains("ground.heights: none"));
    }
}
