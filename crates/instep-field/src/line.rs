//! White lines on the ground, as their middle.

use serde::Serialize;

/// A line of the field, m in the field frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Line {
    /// A straight line.
    Segment {
        /// One end.
        from: [f64; 2],
        /// The other.
        to: [f64; 2],
    },
    /// A whole circle.
    Circle {
        /// Its middle.
        center: [f64; 2],
        /// Its radius.
        radius: f64,
    },
}

impl Line {
    /// The point of the line that is nearest to `point`, m. For the middle of a circle, its point ahead along x.
    pub fn nearest(&self, point: [f64; 2]) -> [f64; 2] {
        match *self {
            Line::Segment { from, to } => {
                let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
                let square = dx * dx + dy * dy;
                let along = (point[0] - from[0]) * dx + (point[1] - from[1]) * dy;
                let t = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
                [from[0] + t * dx, from[1] + t * dy]
            }
            Line::Circle { center, radius } => {
                let [dx, dy] = [point[0] - center[0], point[1] - center[1]];
                let distance = dx.hypot(dy);
                let [ux, uy] = if distance > 0.0 { [dx / distance, dy / distance] } else { [1.0, 0.0] };
                [center[0] + radius * ux, center[1] + radius * uy]
            }
        }
    }

    /// Distance from `point`, m.
    pub fn distance(&self, point: [f64; 2]) -> f64 {
        let [x, y] = self.nearest(point);
        (x - point[0]).hypot(y - point[1])
    }

    /// Length, m.
    pub fn length(&self) -> f64 {
        match *self {
            Line::Segment { from, to } => (to[0] - from[0]).hypot(to[1] - from[1]),
            Line::Circle { radius, .. } => std::f64::consts::TAU * radius,
        }
    }

    /// The point after a share `s` in [0, 1] of the length; a circle starts ahead along x, counter-clockwise.
    pub fn point(&self, s: f64) -> [f64; 2] {
        match *self {
            Line::Segment { from, to } => [from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1])],
            Line::Circle { center, radius } => {
                let (sin, cos) = (s * std::f64::consts::TAU).sin_cos();
                [center[0] + radius * cos, center[1] + radius * sin]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nearest point against a dense walk along the line.
    #[test]
    fn nearest_is_the_nearest_of_many() {
        let lines = [
            Line::Segment { from: [-1.0, 2.0], to: [3.0, -0.5] },
            Line::Circle { center: [0.5, -1.0], radius: 1.5 },
            Line::Segment { from: [1.0, 1.0], to: [1.0, 1.0] },
        ];
        for line in lines {
            for k in 0..40 {
                let point = [f64::from(k % 8) - 4.0, f64::from(k / 8) - 2.0];
                let walked = (0..=20_000)
                    .map(|i| {
                        let [x, y] = line.point(f64::from(i) / 20_000.0);
                        (x - point[0]).hypot(y - point[1])
                    })
                    .fold(f64::INFINITY, f64::min);
                assert!((line.distance(point) - walked).abs() < 1e-3, "{line:?} {point:?}");
            }
        }
    }
}
