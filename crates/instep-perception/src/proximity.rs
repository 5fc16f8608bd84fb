//! Proximity (paper 4, section IV-B): what is too near, from depth alone; works with the network switched off.
//!
//! What is printed and what is meant: equation (3) divides by the sine of a row's angle below the horizon and is then
//! compared with a depth map. Rays at or above the horizon meet no floor: infinity. The quotient is the length of the
//! ray in the camera's middle column; a depth map holds the distance along the optical axis. Both, and the camera's
//! roll, are right at once when the floor's depth is taken from the ray whose z is 1: (h_camera - h_safe) / -ray.z.

use crate::camera::{Camera, CameraPose};
use crate::class::Team;
use crate::detector;
use crate::label::Rect;
use crate::picture::{Depth, Frame};

/// Settings of the obstacle finder. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proximity {
    /// Every how manyth pixel is looked at, along rows and columns.
    pub stride: usize,
    /// h_safe of equation (3): lower things are no obstacles.
    pub safe_height: f32,
    /// D_thresh of equation (4).
    pub farthest: f32,
    /// c_min, c_max of equation (1): shares of the image without depth.
    pub coverage: [f32; 2],
    /// d_min, d_max of equation (1).
    pub near: [f32; 2],
    /// Components of fewer pixels (of those looked at) are noise.
    pub smallest: usize,
    /// Boxes nearer to each other than this share of the frame's width are one obstacle, when their depths agree.
    pub gap: f32,
    /// Depths that differ by less agree.
    pub depth_gap: f32,
}

impl Default for Proximity {
    fn default() -> Self {
        Proximity {
            stride: 2,
            safe_height: 0.15,
            farthest: 3.0,
            coverage: [0.12, 0.6],
            near: [0.15, 0.4],
            smallest: 40,
            gap: 0.02,
            depth_gap: 0.35,
        }
    }
}

/// An obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// Where in the image.
    pub rect: Rect,
    /// Mean depth of its nearest face, m; infinite for a dummy.
    pub depth: f32,
    /// On the ground in the robot's frame, x ahead, y left, m; far away for a dummy.
    pub position: [f32; 2],
    /// A robot's team by its hue.
    pub team: Option<Team>,
    /// Whether it stands for "nothing there".
    pub dummy: bool,
}

impl Obstacle {
    /// What stands for "nothing there".
    pub const DUMMY: Obstacle = Obstacle {
        rect: Rect { left: 0.0, top: 0.0, right: 0.0, low: 0.0 },
        depth: f32::INFINITY,
        position: [1000.0, 0.0],
        team: None,
        dummy: true,
    };
}

/// Equation (1): the distance of something so near that a share `coverage` of the image has no depth, m.
pub fn near_distance(settings: &Proximity, coverage: f32) -> f32 {
    let ([low, high], [near, far]) = (settings.coverage, settings.near);
    let slope = (far - near) / (high - low).max(1e-6);
    (far - slope * (coverage - low)).clamp(near, far)
}

/// Equations (2) and (3) as they are meant: the depth at which the ray of a pixel meets the plane at the safe height, m.
pub fn floor_depth(camera: &Camera, pose: &CameraPose, safe_height: f32, u: f32, v: f32) -> f32 {
    let down = -(pose.rotation * camera.ray(u, v)).z;
    let above = pose.position.z - safe_height;
    if down > 1e-6 && above > 0.0 { above / down } else { f32::INFINITY }
}

/// The two nearest obstacles, dummies where there are fewer. `frame` tells teams, where there is one.
///
/// Depths that are NaN, zero or less count as missing; infinity is too far to matter.
pub fn nearest(
    settings: &Proximity,
    camera: &Camera,
    pose: &CameraPose,
    depth: &Depth,
    frame: Option<&Frame>,
) -> [Obstacle; 2] {
    let stride = settings.stride.max(1);
    let (columns, rows) = (depth.width / stride, depth.height / stride);
    let at = |k: usize| depth.meters[(k / columns) * stride * depth.width + (k % columns) * stride];
    let pixel = |k: usize| [((k % columns) * stride) as f32 + 0.5, ((k / columns) * stride) as f32 + 0.5];
    let mut found = Vec::new();

    // Near field: what has no depth though it is not too far for one.
    let missing: Vec<bool> = (0..columns * rows).map(|k| !(at(k) > 0.0)).collect();
    let share = missing.iter().filter(|m| **m).count() as f32 / missing.len().max(1) as f32;
    if share > settings.coverage[0] {
        for part in components(&missing, columns) {
            let coverage = part.len() as f32 / missing.len() as f32;
            if coverage > settings.coverage[0] {
                let rect = extent(&part, columns, stride);
                let depth = near_distance(settings, coverage);
                found.push(obstacle(camera, pose, rect, depth, frame));
            }
        }
    }

    // Equation (4).
    let kept: Vec<bool> = (0..columns * rows)
        .map(|k| {
            let [u, v] = pixel(k);
            let z = at(k);
            z > 0.0 && z < settings.farthest.min(floor_depth(camera, pose, settings.safe_height, u, v))
        })
        .collect();
    let mut parts: Vec<(Rect, Vec<[f32; 3]>)> = components(&kept, columns)
        .into_iter()
        .filter(|part| part.len() >= settings.smallest)
        .map(|part| {
            let places = part.iter().map(|&k| {
                let [u, v] = pixel(k);
                let place = pose.robot_from_camera(camera.ray(u, v) * at(k));
                [at(k), place.x, place.y]
            });
            (extent(&part, columns, stride), places.collect())
        })
        .collect();
    merge(settings, depth.width as f32, &mut parts);
    for (rect, mut places) in parts {
        places.sort_by(|a, b| a[1].hypot(a[2]).total_cmp(&b[1].hypot(b[2])));
        // The nearest face: the mean of the nearer half, without the nearest tenth, which noise makes.
        let face = &places[places.len() / 10..(places.len() / 2).max(places.len() / 10 + 1)];
        let [depth, x, y] = mean(face);
        let team = frame.and_then(|frame| detector::team(frame, &rect));
        found.push(Obstacle { rect, depth, position: [x, y], team, dummy: false });
    }
    found.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    let mut nearest = found.into_iter();
    [(); 2].map(|()| nearest.next().unwrap_or(Obstacle::DUMMY))
}

fn obstacle(camera: &Camera, pose: &CameraPose, rect: Rect, depth: f32, frame: Option<&Frame>) -> Obstacle {
    let [u, v] = rect.middle();
    let place = pose.robot_from_camera(camera.ray(u, v) * depth);
    let team = frame.and_then(|frame| detector::team(frame, &rect));
    Obstacle { rect, depth, position: [place.x, place.y], team, dummy: false }
}

/// The 8-connected components of a mask with `columns` in a row, each as its pixels.
pub fn components(mask: &[bool], columns: usize) -> Vec<Vec<usize>> {
    let rows = mask.len().checked_div(columns).unwrap_or(0);
    let mut seen = vec![false; mask.len()];
    let (mut parts, mut open) = (Vec::new(), Vec::new());
    for start in 0..rows * columns {
        if !mask[start] || seen[start] {
            continue;
        }
        seen[start] = true;
        open.push(start);
        let mut part = Vec::new();
        while let Some(k) = open.pop() {
            part.push(k);
            let (row, column) = (k / columns, k % columns);
            for r in row.saturating_sub(1)..(row + 2).min(rows) {
                for c in column.saturating_sub(1)..(column + 2).min(columns) {
                    let other = r * columns + c;
                    if mask[other] && !seen[other] {
                        seen[other] = true;
                        open.push(other);
                    }
                }
            }
        }
        parts.push(part);
    }
    parts
}

fn extent(part: &[usize], columns: usize, stride: usize) -> Rect {
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for &k in part {
        let place = [k % columns, k / columns];
        for axis in 0..2 {
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis] + 1);
        }
    }
    let scale = |n: usize| (n * stride) as f32;
    Rect { left: scale(low[0]), top: scale(low[1]), right: scale(high[0]), low: scale(high[1]) }
}

/// The mean of depth and place on the ground.
fn mean(places: &[[f32; 3]]) -> [f32; 3] {
    let n = places.len().max(1) as f32;
    std::array::from_fn(|k| places.iter().map(|p| p[k]).sum::<f32>() / n)
}

/// Merges boxes that overlap or nearly touch and whose depths agree, until none do.
fn merge(settings: &Proximity, width: f32, parts: &mut Vec<(Rect, Vec<[f32; 3]>)>) {
    let gap = settings.gap * width;
    let mut i = 0;
    while i < parts.len() {
        let near = (i + 1..parts.len()).find(|&j| {
            let meet = parts[i].0.meet(&parts[j].0);
            let touching = meet.width() > -gap && meet.height() > -gap;
            touching && (mean(&parts[i].1)[0] - mean(&parts[j].1)[0]).abs() < settings.depth_gap
        });
        if let Some(j) = near {
            let (rect, values) = parts.swap_remove(j);
            let to = &mut parts[i];
            to.0 = Rect {
                left: to.0.left.min(rect.left),
                top: to.0.top.min(rect.top),
                right: to.0.right.max(rect.right),
                low: to.0.low.max(rect.low),
            };
            to.1.extend(values);
            i = 0;
        } else {
            i += 1;
        }
    }
}

/// What a walk past obstacles gave, as paper 4's Table III has it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Run {
    /// Detections that are within 0.2 m of an obstacle's box.
    pub precision: f64,
    /// Obstacles in view and in reach that were found.
    pub recall: f64,
    /// Harmonic mean of both.
    pub f1: f64,
    /// Mean distance of true detections to the obstacle's box, m.
    pub error_mean: f64,
    /// Its standard deviation, m.
    pub error_std: f64,
}

/// Distance of a point to a box on the ground of 0.4 m x 0.4 m around `middle` (section V-A2), m.
pub fn distance_to_box(point: [f64; 2], middle: [f64; 2]) -> f64 {
    let out = |k: usize| ((point[k] - middle[k]).abs() - 0.2).max(0.0);
    out(0).hypot(out(1))
}

/// A walk of `seed` past two obstacles of 0.4 m x 0.4 m and a robot's height, one frame every 0.1 s.
///
/// The camera sways and nods as a walking head does. An obstacle is asked for where its middle is within the field of view
/// less its own width and nearer than the reach less half a box.
pub fn walk(settings: &Proximity, camera: &Camera, field: &instep_field::Field, seed: u64) -> Run {
    use crate::render::Renderer;
    use crate::scene::random::{Split, scene};
    use rand::{RngExt as _, SeedableRng as _};

    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut renderer = Renderer::new(*camera, field);
    let look = scene(field, camera, Split::Test, 77_000 + seed).look;
    let boxes = [
        [1.9 + rng.random_range(-0.2..0.2), 0.75 + rng.random_range(-0.15..0.15)],
        [3.6 + rng.random_range(-0.2..0.2), -0.7 + rng.random_range(-0.15..0.15f64)],
    ];
    let (mut right, mut wrong, mut asked, mut hit) = (0u32, 0u32, 0u32, 0u32);
    let mut errors = Vec::new();
    for k in 0..120 {
        let t = 0.1 * f64::from(k);
        let x = -0.8 + 0.33 * t;
        let y = 0.1 * (0.9 * t).sin();
        let yaw = 0.35 * (0.8 * t + seed as f64).sin();
        let (nod, roll) = (0.42 + 0.03 * (7.0 * t).sin(), 0.02 * (3.5 * t).cos());
        let eye = [x as f32, y as f32, 1.3 + 0.015 * (7.0 * t).cos() as f32];
        let pose = CameraPose::looking(eye, yaw as f32, nod as f32, roll as f32);
        let mut scene = crate::scene::Scene::new(pose, look.clone(), rng.random());
        for (b, paint) in boxes.iter().zip([[0.6, 0.05, 0.05], [0.05, 0.08, 0.6]]) {
            scene.solids.push(crate::scene::Solid {
                shape: crate::scene::Shape::Box([0.2, 0.2, 0.6]),
                position: nalgebra::Vector3::new(b[0] as f32, b[1] as f32, 0.6),
                rotation: nalgebra::Matrix3::identity(),
                paint: crate::scene::Paint::Plain(paint),
                thing: 0,
            });
            scene.add_shadow([b[0] as f32, b[1] as f32], 0.25, 1.2, 0.6);
        }
        let view = renderer.render(&scene);
        let here = instep_field::Pose::new(x, y, yaw);
        let found = nearest(settings, camera, &pose, &view.depth, Some(&view.frame));
        let places: Vec<[f64; 2]> = found
            .iter()
            .filter(|o| !o.dummy)
            .map(|o| here.outer_from_local([f64::from(o.position[0]), f64::from(o.position[1])]))
            .collect();
        for place in &places {
            let error = boxes.iter().map(|b| distance_to_box(*place, *b)).fold(f64::INFINITY, f64::min);
            if error < 0.2 {
                right += 1;
                errors.push(error);
            } else {
                wrong += 1;
            }
        }
        for b in &boxes {
            let [ahead, left] = here.local_from_outer(*b);
            let angle = left.atan2(ahead).abs() + 0.3 / ahead.hypot(left).max(0.3);
            if ahead > 0.7 && ahead < f64::from(settings.farthest) - 0.3 && angle < camera.field_of_view / 2.0 {
                asked += 1;
                hit += u32::from(places.iter().any(|place| distance_to_box(*place, *b) < 0.2));
            }
        }
    }
    let precision = f64::from(right) / f64::from((right + wrong).max(1));
    let recall = f64::from(hit) / f64::from(asked.max(1));
    let n = errors.len().max(1) as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let spread = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n).sqrt();
    let f1 = 2.0 * precision * recall / (precision + recall).max(1e-12);
    Run { precision, recall, f1, error_mean: mean, error_std: spread }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equation_1_at_its_ends() {
        let s = Proximity::default();
        assert!((near_distance(&s, 0.12) - 0.4).abs() < 1e-6 && (near_distance(&s, 0.6) - 0.15).abs() < 1e-6);
        assert_eq!(near_distance(&s, 1.0), 0.15);
    }

    /// In the middle column without roll the meant form is the printed one times the cosine of the ray to the axis.
    #[test]
    fn the_floor_is_where_the_printed_equation_says_along_the_ray() {
        let camera = Camera::default();
        let pose = CameraPose::looking([0.0, 0.0, 1.3], 0.4, 0.35, 0.0);
        for v in [40.5f32, 112.0, 200.5] {
            let to_axis = ((v - 112.0) / camera.focal()).atan();
            let theta = to_axis + 0.35;
            let printed = (1.3 - 0.15) / theta.sin() * to_axis.cos();
            let found = floor_depth(&camera, &pose, 0.15, 192.0, v);
            assert!(
                if theta > 0.0 { (found - printed).abs() < 1e-3 } else { found.is_infinite() },
                "{v}: {found} {printed}"
            );
        }
    }

    #[test]
    fn corners_connect_and_gaps_do_not() {
        let mask: Vec<bool> = "x....|.x...|...x.|...x.".chars().filter(|c| *c != '|').map(|c| c == 'x').collect();
        let mut sizes: Vec<usize> = components(&mask, 5).iter().map(Vec::len).collect();
        sizes.sort_unstable();
        assert_eq!(sizes, [2, 2]);
    }

    #[test]
    fn nothing_but_missing_depth_is_something_very_near_and_no_depth_map_panics() {
        let camera = Camera::default();
        let pose = CameraPose::looking([0.0, 0.0, 1.3], 0.0, 0.3, 0.0);
        let map = |z: f32| Depth { width: 384, height: 224, meters: vec![z; 384 * 224] };
        for z in [f32::NAN, f32::NEG_INFINITY, 0.0, -1.0] {
            let found = nearest(&Proximity::default(), &camera, &pose, &map(z), None);
            assert!((found[0].depth - 0.15).abs() < 1e-6 && found[1].dummy);
        }
        for z in [f32::INFINITY, 1e30] {
            assert!(nearest(&Proximity::default(), &camera, &pose, &map(z), None).iter().all(|o| o.dummy), "{z}");
        }
    }

    #[test]
    fn a_walk_past_two_boxes_finds_them() {
        let field = instep_field::Field::named("adult-2024").unwrap();
        let run = walk(&Proximity::default(), &Camera::default(), &field, 1);
        assert!(run.precision > 0.9 && run.recall > 0.9 && run.error_mean < 0.04, "{run:?}");
    }
}
