//! Turf with its lines, the floor around it, walls and ceiling: what fills the frame before any body is drawn.
//!
//! Lines are smoothed exactly: the share of a pixel's footprint on the ground, taken across the line, that lies on paint.

use instep_field::{Field, LandmarkClass, Line};
use nalgebra::Vector3;

use super::noise::{Noise, hash};
use super::{Light, View};
use crate::camera::Camera;
use crate::scene::{Look, Scene, Shadow};

/// Distance to the nearest line's middle on a grid over the ground, m, cut off at [`FAR`].
#[derive(Debug, Clone)]
pub(crate) struct LineMap {
    distance: Vec<f32>,
    columns: usize,
    rows: usize,
    origin: [f32; 2],
    half_line: f32,
    /// Half sides of the turf.
    turf: [f32; 2],
}

/// Side of a grid cell, m.
const CELL: f32 = 0.025;
/// Farther than this from a line nothing is kept, m.
const FAR: f32 = 0.6;

impl LineMap {
    pub(crate) fn new(field: &Field) -> Self {
        let turf = [field.length / 2.0 + field.border, field.width / 2.0 + field.border].map(|v| v as f32);
        let origin = turf.map(|v| -v - 0.1);
        let columns = (-2.0 * origin[0] / CELL) as usize + 2;
        let rows = (-2.0 * origin[1] / CELL) as usize + 2;
        let mut distance = vec![FAR; columns * rows];
        // Marks are drawn too: crosses of 20 cm at the penalty marks and across the halfway line.
        let mut lines = field.lines();
        let segment = |from, to| Line::Segment { from, to };
        lines.push(segment([-0.1, 0.0], [0.1, 0.0]));
        for mark in field.landmarks().iter().filter(|l| l.class == LandmarkClass::PenaltyMark) {
            lines.push(segment([mark.x - 0.1, mark.y], [mark.x + 0.1, mark.y]));
            lines.push(segment([mark.x, mark.y - 0.1], [mark.x, mark.y + 0.1]));
        }
        for line in lines {
            let reach = f64::from(FAR);
            let (low, high) = match line {
                Line::Segment { from, to } => (
                    [from[0].min(to[0]) - reach, from[1].min(to[1]) - reach],
                    [from[0].max(to[0]) + reach, from[1].max(to[1]) + reach],
                ),
                Line::Circle { center, radius } => {
                    (center.map(|c| c - radius - reach), center.map(|c| c + radius + reach))
                }
            };
            let index = |value: f64, axis: usize, most: usize| {
                (((value as f32 - origin[axis]) / CELL).max(0.0) as usize).min(most)
            };
            for row in index(low[1], 1, rows)..index(high[1], 1, rows) {
                for column in index(low[0], 0, columns)..index(high[0], 0, columns) {
                    let point = [origin[0] + column as f32 * CELL, origin[1] + row as f32 * CELL].map(f64::from);
                    let cell = &mut distance[row * columns + column];
                    *cell = cell.min(line.distance(point) as f32);
                }
            }
        }
        LineMap { distance, columns, rows, origin, half_line: field.line_width as f32 / 2.0, turf }
    }

    /// Distance to the nearest line's middle, m, and its slope.
    #[inline(always)]
    fn at(&self, x: f32, y: f32) -> (f32, [f32; 2]) {
        let (u, v) = ((x - self.origin[0]) / CELL, (y - self.origin[1]) / CELL);
        if !(u >= 0.0 && v >= 0.0 && u < (self.columns - 1) as f32 && v < (self.rows - 1) as f32) {
            return (FAR, [0.0; 2]);
        }
        let (i, j) = (u as usize, v as usize);
        let (fu, fv) = (u - i as f32, v - j as f32);
        let k = j * self.columns + i;
        let (a, b) = (self.distance[k], self.distance[k + 1]);
        let (c, d) = (self.distance[k + self.columns], self.distance[k + self.columns + 1]);
        let (top, low) = (a + (b - a) * fu, c + (d - c) * fu);
        let slope = [((b - a) * (1.0 - fv) + (d - c) * fv) / CELL, (low - top) / CELL];
        (top + (low - top) * fv, slope)
    }
}

super::also_wide!(
    draw,
    drawn,
    (
        camera: &Camera, scene: &Scene, lines: &LineMap, noise: &Noise, light: &mut Light, depth: &mut [f32],
        things: &mut [u16]
    )
);

/// Fills colour, depth and marks with ground and surroundings.
#[inline(always)]
fn drawn(
    camera: &Camera,
    scene: &Scene,
    lines: &LineMap,
    noise: &Noise,
    light: &mut Light,
    depth: &mut [f32],
    things: &mut [u16],
) {
    let (eye, turn, look) = (scene.camera.position, scene.camera.rotation, &scene.look);
    let step = 1.0 / camera.focal();
    let along = turn.column(0) * step;
    let down = turn.column(1) * step;
    let shade = look.ambient + look.direct * look.light.z;
    let shift = [(look.texture % 251) as f32, (look.texture / 251 % 241) as f32];
    let [red, green, blue] = light;
    let lines_of = |row: usize| row * camera.width..(row + 1) * camera.width;
    for row in 0..camera.height {
        let first = turn * camera.ray(0.5, row as f32 + 0.5);
        let (red, green, blue) = (&mut red[lines_of(row)], &mut green[lines_of(row)], &mut blue[lines_of(row)]);
        let (depth, things) = (&mut depth[lines_of(row)], &mut things[lines_of(row)]);
        let mut put = |pixel: usize, colour: [f32; 3], t: f32, thing: u16| {
            [red[pixel], green[pixel], blue[pixel]] = colour;
            (depth[pixel], things[pixel]) = (t, thing);
        };
        for pixel in 0..camera.width {
            let ray = first + along * pixel as f32;
            if ray.z < -1e-4 {
                let t = -eye.z / ray.z;
                let (x, y) = (eye.x + t * ray.x, eye.y + t * ray.y);
                if x.abs() < lines.turf[0] && y.abs() < lines.turf[1] {
                    // How the place on the ground moves from pixel to pixel.
                    let (su, sv) = (along.z / ray.z, down.z / ray.z);
                    let du = [t * (along.x - ray.x * su), t * (along.y - ray.y * su)];
                    let dv = [t * (down.x - ray.x * sv), t * (down.y - ray.y * sv)];
                    let colour = turf(look, lines, noise, [x, y], du, dv, shift).map(|c| c * shade);
                    put(pixel, colour, t, View::GROUND);
                    continue;
                }
                if x.abs() < look.hall[0] && y.abs() < look.hall[1] {
                    let tile = noise.smooth(4.0 * x + shift[0], 4.0 * y + shift[1]);
                    put(pixel, look.floor.map(|c| c * shade * (1.0 + 0.15 * tile)), t, 0);
                    continue;
                }
            }
            let (colour, t) = wall(look, eye, ray, shade);
            put(pixel, colour, t, 0);
        }
    }
    for shadow in &scene.shadows {
        darken(camera, scene, shadow, light, depth, things);
    }
}

/// Turf and lines at a place.
#[inline(always)]
fn turf(
    look: &Look,
    lines: &LineMap,
    noise: &Noise,
    [x, y]: [f32; 2],
    du: [f32; 2],
    dv: [f32; 2],
    shift: [f32; 2],
) -> [f32; 3] {
    let footprint = (du[0].abs() + du[1].abs()).max(dv[0].abs() + dv[1].abs());
    let patches = noise.smooth(12.0 * x + shift[0], 12.0 * y + shift[1]) + noise.smooth(3.0 * x - shift[1], 3.0 * y);
    let fine = (0.05 / footprint.max(0.004)).min(1.0);
    let grain = noise.grain((x * 90.0 + shift[1]) as i32, (y * 90.0 + shift[0]) as i32) * fine;
    let mown = if (x / look.stripe).floor() as i32 & 1 == 0 { look.turf_noise[2] } else { -look.turf_noise[2] };
    let level = 1.0 + look.turf_noise[0] * patches + look.turf_noise[1] * grain + mown;
    let ground = look.turf.map(|c| c * level.max(0.1));
    let (distance, slope) = lines.at(x, y);
    if distance > 0.5 * FAR {
        return ground;
    }
    let (right, down) = (slope[0] * du[0] + slope[1] * du[1], slope[0] * dv[0] + slope[1] * dv[1]);
    let across = (right * right + down * down).sqrt().clamp(1e-3, FAR);
    let (low, high) = ((distance - across / 2.0).max(-lines.half_line), (distance + across / 2.0).min(lines.half_line));
    let mut cover = ((high - low) / across).clamp(0.0, 1.0);
    if cover > 0.0 && look.wear > 0.0 {
        let worn = 0.5 * noise.smooth(20.0 * x + shift[1], 20.0 * y - shift[0]) + 0.25 * grain + 0.5;
        cover *= 1.0 - (3.0 * (1.6 * look.wear - worn)).clamp(0.0, 0.9);
    }
    std::array::from_fn(|c| ground[c] + cover * (look.line[c] * (1.0 + 0.1 * grain) - ground[c]))
}

/// The inside of a hall.
#[inline(always)]
fn wall(look: &Look, eye: Vector3<f32>, ray: Vector3<f32>, shade: f32) -> ([f32; 3], f32) {
    let to = |axis: usize| {
        let edge = if ray[axis] > 0.0 { look.hall[axis] } else { -look.hall[axis] };
        if ray[axis].abs() > 1e-6 { (edge - eye[axis]) / ray[axis] } else { f32::MAX }
    };
    let (tx, ty) = (to(0), to(1));
    let tz = if ray.z > 1e-6 { (look.hall[2] - eye.z) / ray.z } else { f32::MAX };
    let t = tx.min(ty).min(tz).max(0.0);
    let place = eye + ray * t;
    let seed = look.texture as i32;
    if tz <= tx && tz <= ty {
        let lamp = hash((place.x / 2.0).floor() as i32, (place.y / 0.8).floor() as i32, seed).is_multiple_of(5);
        return (if lamp { [2.0; 3] } else { look.ceiling.map(|c| c * shade) }, t);
    }
    let along = if tx < ty { place.y } else { place.x };
    let cell = hash((along / 1.3).floor() as i32, (place.z / 0.9).floor() as i32, seed);
    let level = 1.0 + look.panels * ((cell & 255) as f32 / 128.0 - 1.0);
    let tint =
        [cell >> 8 & 255, cell >> 16 & 255, cell >> 24 & 255].map(|c| 1.0 + look.panels * (c as f32 / 200.0 - 0.6));
    (std::array::from_fn(|c| (look.wall[c] * level * tint[c]).max(0.01) * (0.4 + 0.6 * shade)), t)
}

/// Takes light from the ground inside a shadow.
#[inline(always)]
fn darken(camera: &Camera, scene: &Scene, shadow: &Shadow, light: &mut Light, depth: &[f32], things: &[u16]) {
    // The rectangle of pixels that the shadow's box can cover.
    let [a, b] = shadow.along;
    let reach =
        [shadow.half[0] * a.abs() + shadow.half[1] * b.abs(), shadow.half[0] * b.abs() + shadow.half[1] * a.abs()];
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]]
        .map(|[i, j]| Vector3::new(shadow.center[0] + i * reach[0], shadow.center[1] + j * reach[1], 0.0));
    let Some([left, top, right, low]) =
        super::solid::bounds(camera, corners.map(|c| (scene.camera.camera_from_world(c), 0.0)))
    else {
        return;
    };
    let (eye, turn) = (scene.camera.position, scene.camera.rotation);
    for row in top..low {
        for column in left..right {
            let pixel = row * camera.width + column;
            if things[pixel] != View::GROUND {
                continue;
            }
            let place = eye + turn * camera.ray(column as f32 + 0.5, row as f32 + 0.5) * depth[pixel];
            let (dx, dy) = (place.x - shadow.center[0], place.y - shadow.center[1]);
            let (along, across) = ((a * dx + b * dy) / shadow.half[0], (a * dy - b * dx) / shadow.half[1]);
            let inside = 1.0 - along * along - across * across;
            if inside > 0.0 {
                let keep = 1.0 - shadow.depth * (2.0 * inside).min(1.0);
                light.iter_mut().for_each(|plane| plane[pixel] *= keep);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The map's distance against the field's own.
    #[test]
    fn the_line_map_tells_the_distance_to_the_nearest_line() {
        let field = Field::named("adult-2024").unwrap();
        let map = LineMap::new(&field);
        let lines = field.lines();
        for k in 0..600 {
            let (x, y) = (-7.5 + 0.37 * f64::from(k % 40), -5.0 + 0.7 * f64::from(k / 40));
            let nearest = lines.iter().map(|l| l.distance([x, y])).fold(f64::INFINITY, f64::min);
            let marks = x.hypot(y) < 0.4 || (x.abs() - 4.9).hypot(y) < 0.9;
            if nearest < 0.4 && !marks {
                let (found, _) = map.at(x as f32, y as f32);
                assert!((f64::from(found) - nearest).abs() < 0.013, "{x} {y}: {found} {nearest}");
            }
        }
    }
}
