//! Bodies: exact ray intersection inside the rectangle of pixels that a body can cover.
//!
//! In a body's own frame each ray is origin + t direction, the origin the same for all, the direction linear in the
//! pixel; its z in the camera frame is 1, so t is the depth. A body costs what its rectangle costs.

use nalgebra::Vector3;

use super::Light;
use super::noise::hash;
use crate::camera::Camera;
use crate::scene::{Paint, Scene, Shape, Solid};

/// Nearer than this nothing is drawn, m.
const NEAR: f32 = 0.03;

/// The pixels [left, top, right, low) that spheres (middle in the camera frame, radius) can cover together with what lies
/// between them; `None` when that is none.
pub(super) fn bounds<const N: usize>(camera: &Camera, spheres: [(Vector3<f32>, f32); N]) -> Option<[usize; 4]> {
    let f = camera.focal();
    let (w, h) = (camera.width as f32, camera.height as f32);
    let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
    let mut behind = 0;
    for (p, r) in spheres {
        if p.z + r < NEAR {
            behind += 1;
            continue;
        }
        // Whatever reaches the eye's plane may lie anywhere.
        let (near, far) = (p.z - r, p.z + r);
        if near < NEAR {
            (low, high) = ([f32::MIN; 2], [f32::MAX; 2]);
            continue;
        }
        for axis in 0..2 {
            let (a, b) = (p[axis] - r, p[axis] + r);
            low[axis] = low[axis].min(a / if a < 0.0 { near } else { far });
            high[axis] = high[axis].max(b / if b > 0.0 { near } else { far });
        }
    }
    if behind == N {
        return None;
    }
    if behind > 0 {
        (low, high) = ([f32::MIN; 2], [f32::MAX; 2]);
    }
    let clamp = |value: f32, middle: f32, most: f32| (f * value + middle).clamp(0.0, most);
    let left = clamp(low[0], w / 2.0, w).floor() as usize;
    let right = clamp(high[0], w / 2.0, w).ceil() as usize;
    let top = clamp(low[1], h / 2.0, h).floor() as usize;
    let bottom = clamp(high[1], h / 2.0, h).ceil() as usize;
    (left < right && top < bottom).then_some([left, top, right, bottom])
}

super::also_wide!(
    draw,
    drawn,
    (camera: &Camera, scene: &Scene, light: &mut Light, depth: &mut [f32], things: &mut [u16])
);

/// Draws all bodies over what is there, nearest first by depth.
#[inline(always)]
fn drawn(camera: &Camera, scene: &Scene, light: &mut Light, depth: &mut [f32], things: &mut [u16]) {
    let mut sheet = Sheet { light, depth, things };
    for solid in &scene.solids {
        let middle = scene.camera.camera_from_world(solid.position);
        let axis = scene.camera.rotation.tr_mul(&solid.rotation.column(2).into_owned());
        let sheet = &mut sheet;
        match solid.shape {
            Shape::Sphere(r) => {
                let rectangle = bounds(camera, [(middle, r)]);
                fill(camera, scene, solid, rectangle, sheet, |origin, ray| sphere(origin, ray, r));
            }
            Shape::Capsule(r, half) => {
                let rectangle = bounds(camera, [(middle - axis * half, r), (middle + axis * half, r)]);
                fill(camera, scene, solid, rectangle, sheet, |origin, ray| capsule(origin, ray, r, half));
            }
            Shape::Cylinder(r, half) => {
                let rectangle = bounds(camera, [(middle - axis * half, r), (middle + axis * half, r)]);
                fill(camera, scene, solid, rectangle, sheet, |origin, ray| cylinder(origin, ray, r, half));
            }
            Shape::Box(half) => {
                let corner = |k: usize| {
                    let sign = |bit: usize, a: f32| if k >> bit & 1 == 0 { -a } else { a };
                    let local = Vector3::new(sign(0, half[0]), sign(1, half[1]), sign(2, half[2]));
                    (middle + scene.camera.rotation.tr_mul(&(solid.rotation * local)), 0.0)
                };
                let rectangle = bounds(camera, std::array::from_fn::<_, 8, _>(corner));
                fill(camera, scene, solid, rectangle, sheet, |origin, ray| cuboid(origin, ray, half));
            }
        }
    }
}

/// What is drawn on.
struct Sheet<'a> {
    light: &'a mut Light,
    depth: &'a mut [f32],
    things: &'a mut [u16],
}

/// Draws what rays hit inside a rectangle.
#[inline(always)]
fn fill(
    camera: &Camera,
    scene: &Scene,
    solid: &Solid,
    rectangle: Option<[usize; 4]>,
    sheet: &mut Sheet<'_>,
    hit: impl Fn(Vector3<f32>, Vector3<f32>) -> Option<(f32, Vector3<f32>)>,
) {
    let Some([left, top, right, low]) = rectangle else { return };
    let look = &scene.look;
    // Rays in the body's frame.
    let local_from_camera = solid.rotation.tr_mul(&scene.camera.rotation);
    let origin = solid.rotation.tr_mul(&(scene.camera.position - solid.position));
    let sun = solid.rotation.tr_mul(&look.light);
    let up = solid.rotation.row(2).transpose();
    let step = local_from_camera.column(0) / camera.focal();
    for row in top..low {
        let first = local_from_camera * camera.ray(left as f32 + 0.5, row as f32 + 0.5);
        for column in left..right {
            let ray = first + step * (column - left) as f32;
            let Some((t, normal)) = hit(origin, ray) else { continue };
            let pixel = row * camera.width + column;
            if t < NEAR || t >= sheet.depth[pixel] {
                continue;
            }
            sheet.depth[pixel] = t;
            sheet.things[pixel] = solid.thing;
            let paint = colour(solid, origin + ray * t, normal);
            let shade = look.ambient * (0.75 + 0.25 * normal.dot(&up)) + look.direct * normal.dot(&sun).max(0.0);
            for (plane, value) in sheet.light.iter_mut().zip(paint) {
                plane[pixel] = value * shade;
            }
        }
    }
}

/// The surface's colour at a place of the body.
#[inline(always)]
fn colour(solid: &Solid, place: Vector3<f32>, normal: Vector3<f32>) -> [f32; 3] {
    match solid.paint {
        Paint::Plain(colour) => colour,
        Paint::Cells(a, b, cell) => {
            let of = |axis: usize| if normal[axis].abs() > 0.9 { 0 } else { (place[axis] / cell).floor() as i32 };
            let seed = (solid.position.x * 100.0) as i32 ^ (solid.position.y * 311.0) as i32;
            if hash(of(0) ^ seed, of(1), of(2)) & 3 == 0 { b } else { a }
        }
        Paint::Patches(ground, patch, cosine, six) => {
            if nearest_patch(normal, six) > cosine {
                patch
            } else {
                ground
            }
        }
    }
}

/// Cosine of the angle to the nearest patch's middle: the twelve corners of an icosahedron, or the six axes.
#[inline(always)]
fn nearest_patch(normal: Vector3<f32>, six: bool) -> f32 {
    let [x, y, z] = [normal.x.abs(), normal.y.abs(), normal.z.abs()];
    if six {
        return x.max(y).max(z);
    }
    // (0, 1, golden) and its cyclic turns, of unit length.
    const A: f32 = 0.525_731_1;
    const B: f32 = 0.850_650_8;
    (A * y + B * z).max(A * z + B * x).max(A * x + B * y)
}

// Where a ray first meets a body from outside: the ray's parameter and the outward unit normal, body frame.

#[inline(always)]
fn capsule(origin: Vector3<f32>, ray: Vector3<f32>, r: f32, half: f32) -> Option<(f32, Vector3<f32>)> {
    if let Some(found) = tube(origin, ray, r, half) {
        return Some(found);
    }
    let end = |z: f32| sphere(origin - Vector3::new(0.0, 0.0, z), ray, r);
    match (end(half), end(-half)) {
        (Some(a), Some(b)) => Some(if a.0 < b.0 { a } else { b }),
        (a, b) => a.or(b),
    }
}

#[inline(always)]
fn cylinder(origin: Vector3<f32>, ray: Vector3<f32>, r: f32, half: f32) -> Option<(f32, Vector3<f32>)> {
    if let Some(found) = tube(origin, ray, r, half) {
        return Some(found);
    }
    // The end toward the eye.
    let side = -ray.z.signum();
    let t = (side * half - origin.z) / ray.z;
    let (x, y) = (origin.x + t * ray.x, origin.y + t * ray.y);
    (t > 0.0 && x * x + y * y <= r * r).then_some((t, Vector3::new(0.0, 0.0, side)))
}

#[inline(always)]
fn cuboid(origin: Vector3<f32>, ray: Vector3<f32>, half: [f32; 3]) -> Option<(f32, Vector3<f32>)> {
    let (mut near, mut far, mut axis) = (f32::MIN, f32::MAX, 0);
    for k in 0..3 {
        let inverse = 1.0 / ray[k];
        let (a, b) = ((-half[k] - origin[k]) * inverse, (half[k] - origin[k]) * inverse);
        let (a, b) = (a.min(b), a.max(b));
        if a > near {
            (near, axis) = (a, k);
        }
        far = far.min(b);
    }
    if !(near <= far && near > 0.0) {
        return None;
    }
    let mut normal = Vector3::zeros();
    normal[axis] = -ray[axis].signum();
    Some((near, normal))
}

#[inline(always)]
fn sphere(origin: Vector3<f32>, ray: Vector3<f32>, r: f32) -> Option<(f32, Vector3<f32>)> {
    let (a, b, c) = (ray.dot(&ray), origin.dot(&ray), origin.dot(&origin) - r * r);
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return None;
    }
    let t = (-b - discriminant.sqrt()) / a;
    (t > 0.0).then(|| (t, (origin + ray * t) / r))
}

/// The side of a cylinder along z between -half and half.
#[inline(always)]
fn tube(origin: Vector3<f32>, ray: Vector3<f32>, r: f32, half: f32) -> Option<(f32, Vector3<f32>)> {
    let a = ray.x * ray.x + ray.y * ray.y;
    let b = origin.x * ray.x + origin.y * ray.y;
    let c = origin.x * origin.x + origin.y * origin.y - r * r;
    let discriminant = b * b - a * c;
    if discriminant < 0.0 || a < 1e-12 {
        return None;
    }
    let t = (-b - discriminant.sqrt()) / a;
    let place = origin + ray * t;
    (t > 0.0 && place.z.abs() <= half).then(|| (t, Vector3::new(place.x / r, place.y / r, 0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// How far outside a body a point lies; negative inside.
    fn outside(shape: Shape, p: Vector3<f32>) -> f32 {
        match shape {
            Shape::Sphere(r) => p.norm() - r,
            Shape::Capsule(r, half) => (p - Vector3::new(0.0, 0.0, p.z.clamp(-half, half))).norm() - r,
            Shape::Cylinder(r, half) => (p.x.hypot(p.y) - r).max(p.z.abs() - half),
            Shape::Box(h) => (p.x.abs() - h[0]).max(p.y.abs() - h[1]).max(p.z.abs() - h[2]),
        }
    }

    proptest! {
        /// The hit lies on the surface, nothing before it is inside, and a miss stays outside: by walking the ray.
        #[test]
        fn a_ray_meets_the_surface_first_where_it_is_said(
            kind in 0..4usize,
            from in prop::array::uniform3(-3.0f32..3.0),
            toward in prop::array::uniform3(-0.5f32..0.5),
        ) {
            let shape = [Shape::Sphere(0.5), Shape::Capsule(0.3, 0.4), Shape::Cylinder(0.3, 0.5), Shape::Box([0.3, 0.4, 0.5])][kind];
            let origin = Vector3::from(from);
            let ray = (Vector3::from(toward) - origin).normalize();
            prop_assume!(outside(shape, origin) > 0.05);
            let found = match shape {
                Shape::Sphere(r) => sphere(origin, ray, r),
                Shape::Capsule(r, half) => capsule(origin, ray, r, half),
                Shape::Cylinder(r, half) => cylinder(origin, ray, r, half),
                Shape::Box(half) => cuboid(origin, ray, half),
            };
            let end = found.map_or(8.0, |(t, _)| t - 1e-3);
            for k in 0..400 {
                let p = origin + ray * (end * k as f32 / 400.0);
                prop_assert!(outside(shape, p) > -2e-3, "inside before the hit");
            }
            if let Some((t, normal)) = found {
                prop_assert!(outside(shape, origin + ray * t).abs() < 1e-3);
                prop_assert!((normal.norm() - 1.0).abs() < 1e-3 && normal.dot(&ray) < 1e-3);
            }
        }
    }
}
