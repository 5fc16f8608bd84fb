//! A replay as one small picture that moves: an SVG, for a README or a slide.
//!
//! Seen from afar, without perspective: capsules become lines with round ends, spheres circles, boxes and ellipsoids lines along their
//! longest side. What is nearer is drawn over what is farther, by the mean of all frames. Ghosts, arrows and pitches are left out.

use std::fmt::Write;

use crate::{Actor, Pose, Replay, Shape};

/// Where the picture is seen from and how large it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picture {
    /// Direction from the scene to the eye about z, rad: -pi/2 looks from the right side, with x to the right.
    pub azimuth: f64,
    /// Height of the eye over the horizon, rad.
    pub elevation: f64,
    /// Width and height, pixels.
    pub size: [f64; 2],
    /// Frames a second; between them the picture interpolates.
    pub rate: f64,
    /// Part of the replay that is shown, s.
    pub span: [f64; 2],
}

/// One shape in the plane: the ends of its axis in every frame, its half width, m, and its depth.
struct Line {
    ends: Vec<[[f64; 2]; 2]>,
    radius: f64,
    color: String,
    depth: f64,
}

impl Picture {
    /// The SVG; it repeats without end.
    #[must_use]
    pub fn svg(&self, replay: &Replay) -> String {
        let [from, to] = self.span;
        let count = (((to - from) * self.rate).round() as usize).max(1);
        let frames: Vec<usize> = (0..=count)
            .map(|i| {
                let time = from + i as f64 / self.rate;
                replay.times.partition_point(|t| *t < time).min(replay.times.len().saturating_sub(1))
            })
            .collect();
        let mut lines: Vec<Line> = replay.actors.iter().flat_map(|actor| self.lines(actor, &frames)).collect();
        lines.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        let points = || lines.iter().flat_map(|line| line.ends.iter().flatten().map(move |p| (p, line.radius)));
        let low = [0, 1].map(|k| points().map(|(p, r)| p[k] - r).fold(f64::INFINITY, f64::min));
        let high = [0, 1].map(|k| points().map(|(p, r)| p[k] + r).fold(f64::NEG_INFINITY, f64::max));
        let [width, height] = self.size;
        let margin = 14.0;
        let scale = ((width - 2.0 * margin) / (high[0] - low[0])).min((height - 2.0 * margin) / (high[1] - low[1]));
        let place = |p: &[f64; 2]| {
            let x = 0.5 * width + scale * (p[0] - 0.5 * (low[0] + high[0]));
            [x, height - margin - scale * (p[1] - low[1])]
        };
        let length = count as f64 / self.rate;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\">\n\
             <rect width=\"{width}\" height=\"{height}\" rx=\"10\" fill=\"#eef1f5\"/>\n\
             <path d=\"M0 {ground} H{width} V{height} H0 Z\" fill=\"#cfe3d2\"/>\n\
             <g stroke-linecap=\"round\">\n",
            ground = shown(height - margin),
        );
        for line in &lines {
            let ends: Vec<[[f64; 2]; 2]> = line.ends.iter().map(|ends| [place(&ends[0]), place(&ends[1])]).collect();
            let Some(first) = ends.first() else { continue };
            let _ =
                write!(svg, "<line stroke=\"{}\" stroke-width=\"{}\"", line.color, shown(2.0 * scale * line.radius));
            let names = [["x1", "y1"], ["x2", "y2"]];
            for (end, names) in first.iter().zip(names) {
                for (value, name) in end.iter().zip(names) {
                    let _ = write!(svg, " {name}=\"{}\"", shown(*value));
                }
            }
            svg.push('>');
            for (e, names) in names.iter().enumerate() {
                for (k, name) in names.iter().enumerate() {
                    let values: Vec<String> = ends.iter().map(|ends| shown(ends[e][k])).collect();
                    if values.iter().any(|value| *value != values[0]) {
                        let _ = write!(
                            svg,
                            "<animate attributeName=\"{name}\" dur=\"{}s\" repeatCount=\"indefinite\" values=\"{}\"/>",
                            shown(length),
                            values.join(";")
                        );
                    }
                }
            }
            svg.push_str("</line>\n");
        }
        svg.push_str("</g>\n</svg>\n");
        svg
    }

    /// The lines of an actor, its own outline under each.
    fn lines(&self, actor: &Actor, frames: &[usize]) -> Vec<Line> {
        let (sin, cos) = self.azimuth.sin_cos();
        let (up, level) = self.elevation.sin_cos();
        // The plane's x is to the right of the eye, y up.
        let project = |p: [f64; 3]| {
            let along = p[0] * cos + p[1] * sin;
            [-p[0] * sin + p[1] * cos, p[2] * level - along * up]
        };
        let depth = |p: [f64; 3]| (p[0] * cos + p[1] * sin) * level + p[2] * up;
        let mut lines = Vec::new();
        // Ghosts are left out.
        for part in actor.parts.iter().filter(|part| part.color.a == 255) {
            let (radius, axis) = match part.shape {
                Shape::Sphere { radius } => (radius, [0.0; 3]),
                Shape::Capsule { radius, half_length } => (radius, [0.0, 0.0, half_length]),
                Shape::Cylinder { radius, half_length } => (radius, [0.0, 0.0, (half_length - radius).max(0.0)]),
                Shape::Box { half_extents: half } | Shape::Ellipsoid { radii: half } => {
                    let long = (0..3).max_by(|a, b| half[*a].total_cmp(&half[*b])).unwrap_or(0);
                    let radius = 0.5 * (half.iter().sum::<f32>() - half[long]);
                    let mut axis = [0.0; 3];
                    axis[long] = (half[long] - radius).max(0.0);
                    (radius, axis)
                }
            };
            let mut sum = 0.0;
            let ends: Vec<[[f64; 2]; 2]> = frames
                .iter()
                .filter_map(|&frame| part.poses.get(frame).or(part.poses.last()))
                .map(|pose| {
                    let turned = turn(pose, axis.map(f64::from));
                    let centre = [0, 1, 2].map(|k| f64::from(pose.position[k]) + f64::from(actor.offset[k]));
                    sum += depth(centre);
                    [-1.0, 1.0].map(|sign| project([0, 1, 2].map(|k| centre[k] + sign * turned[k])))
                })
                .collect();
            let depth = sum / ends.len().max(1) as f64;
            let c = part.color;
            let dark = [c.r, c.g, c.b].map(|x| (f64::from(x) * 0.55) as u8);
            let outline = format!("#{:02x}{:02x}{:02x}", dark[0], dark[1], dark[2]);
            let radius = f64::from(radius);
            lines.push(Line { ends: ends.clone(), radius, color: outline, depth: depth - 1e-6 });
            let color = format!("#{:02x}{:02x}{:02x}", c.r, c.g, c.b);
            lines.push(Line { ends, radius: 0.86 * radius, color, depth });
        }
        lines
    }
}

/// `v` turned by the pose.
fn turn(pose: &Pose, v: [f64; 3]) -> [f64; 3] {
    let [w, x, y, z] = pose.rotation.map(f64::from);
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let t = cross([x, y, z], v).map(|c| 2.0 * c);
    let u = cross([x, y, z], t);
    [0, 1, 2].map(|k| v[k] + w * t[k] + u[k])
}

/// A tenth of a pixel.
fn shown(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Color, Finish, Part};

    fn view() -> Picture {
        let azimuth = -std::f64::consts::FRAC_PI_2;
        Picture { azimuth, elevation: 0.0, size: [200.0, 100.0], rate: 10.0, span: [0.0, 1.0] }
    }

    fn replay() -> Replay {
        let poses = (0..=10).map(|i| Pose::at([i as f32 * 0.1, 0.0, 0.1])).collect();
        let part = Part { shape: Shape::Sphere { radius: 0.1 }, color: Color::BLUE, finish: Finish::Plain, poses };
        let times = (0..=10).map(|i| f64::from(i) * 0.1).collect();
        Replay { times, actors: vec![Actor { parts: vec![part], ..Actor::default() }], ..Replay::default() }
    }

    #[test]
    fn a_ball_that_rolls_to_the_right_moves_to_the_right_and_stays_on_the_ground() {
        let svg = view().svg(&replay());
        let values = svg.split("attributeName=\"x1\"").nth(1).unwrap().split("values=\"").nth(1).unwrap();
        let xs: Vec<f64> = values.split('"').next().unwrap().split(';').map(|x| x.parse().unwrap()).collect();
        assert_eq!(xs.len(), 11);
        assert!(xs.windows(2).all(|pair| pair[1] > pair[0]), "{xs:?}");
        // The whole width is used: 1.2 m of picture in 172 pixels, less what the height allows.
        assert!(!svg.contains("attributeName=\"y1\""), "{svg}");
        assert_eq!(svg, view().svg(&replay()));
    }

    #[test]
    fn a_pose_turns_as_quaternions_do() {
        let h = std::f32::consts::FRAC_1_SQRT_2;
        let pose = Pose { position: [0.0; 3], rotation: [h, 0.0, h, 0.0] };
        let turned = turn(&pose, [0.0, 0.0, 1.0]);
        assert!((turned[0] - 1.0).abs() < 1e-6 && turned[1].abs() < 1e-6 && turned[2].abs() < 1e-6, "{turned:?}");
    }
}
