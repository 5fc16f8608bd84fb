//! Random scenes: a field, a camera at a robot's head, ball, robots, goals, people, adverts, clutter, light and faults.
//!
//! Training and test draw from different ranges of seeds ([`Split`]), from different textures (balls, turf grain,
//! adverts), lights (side and colour) and robots (round limbs and tubes in training, boxes in the test).

use instep_field::{Field, Landmark, LandmarkClass, Pose};
use nalgebra::{Rotation3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::humanoid::{self, Build};
use super::{Limb, Look, Paint, Scene, Shape, Solid};
use crate::camera::{Camera, CameraPose};
use crate::class::Team;

/// What frames are for. The sets share no seed, no texture, no light and no robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// To learn from.
    Train,
    /// To measure with.
    Test,
}

/// How a head carries its camera: the ranges of its height (m) and of its look down (rad).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// Least and greatest height, m.
    pub height: [f32; 2],
    /// Least and greatest angle below the horizon, rad.
    pub pitch: [f32; 2],
}

impl Default for Mount {
    /// An adult-size humanoid's.
    fn default() -> Self {
        Mount { height: [1.05, 1.45], pitch: [0.08, 0.62] }
    }
}

/// How a head looks down at a ball before its feet, rad below the horizon.
const DOWN: [f32; 2] = [0.6, 1.15];

/// One random scene of `split`, seen by an adult-size humanoid.
pub fn scene(field: &Field, camera: &Camera, split: Split, seed: u64) -> Scene {
    scene_from(&Mount::default(), field, camera, split, seed)
}

/// One random scene of `split`, seen from a camera of `mount`.
pub fn scene_from(mount: &Mount, field: &Field, camera: &Camera, split: Split, seed: u64) -> Scene {
    // The splits' seeds never meet.
    let test = split == Split::Test;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(if test { 2 } else { 1 });
    let rng = &mut rng;
    let look = look(camera, test, rng);
    // To learn from: a head that looks down at a ball before its feet. The test keeps to what it has always shown.
    let down = !test && rng.random_bool(0.25);
    let mount = if down { &Mount { pitch: DOWN, ..*mount } } else { mount };
    let pose = camera_pose(mount, field, rng);
    let mut scene = Scene::new(pose, look, rng.random());
    let white = paint_white(rng);
    let (post, net) = (rng.random_range(0.045..0.065), rng.random_bool(0.5));
    scene.add_goals(field, post, Paint::Plain(white), net);
    robots(&mut scene, field, test, rng);
    surroundings(&mut scene, field, test, rng);
    if down {
        own_feet(&mut scene, rng);
    }
    let near = if down { [0.12, 1.3] } else { [0.5, 9.0] };
    // Two to learn from: a frame costs more than a ball in it.
    for _ in 0..if test { 1 } else { 2 } {
        ball(&mut scene, field, test, near, rng);
    }
    scene
}

fn unit(rng: &mut ChaCha8Rng) -> f32 {
    rng.random()
}

fn paint_white(rng: &mut ChaCha8Rng) -> [f32; 3] {
    let level = rng.random_range(0.6..0.95f32);
    [level, level * rng.random_range(0.94..1.03), level * rng.random_range(0.9..1.05)]
}

fn grey(rng: &mut ChaCha8Rng) -> [f32; 3] {
    let level: f32 = rng.random_range(0.02..0.55);
    [level, level * rng.random_range(0.9..1.1), level * rng.random_range(0.9..1.1)]
}

fn any(rng: &mut ChaCha8Rng) -> [f32; 3] {
    [unit(rng), unit(rng), unit(rng)].map(|x| 0.02 + 0.85 * x * x)
}

fn look(camera: &Camera, test: bool, rng: &mut ChaCha8Rng) -> Look {
    // Training is lit from the left and the front half of the hall, the test from the other.
    let angle = rng.random_range(0.0..3.1f32) + if test { std::f32::consts::PI } else { 0.0 };
    let flat = rng.random_range(0.1..0.9f32);
    let light = Vector3::new(angle.cos() * flat, angle.sin() * flat, 1.0).normalize();
    let (r, g) = (rng.random_range(0.02..0.11f32), rng.random_range(0.12..0.34f32));
    let turf = [r, g, rng.random_range(0.3..0.75f32) * g * 0.6];
    let line = paint_white(rng).map(|c| c * rng.random_range(0.8..1.0));
    let hall = [rng.random_range(11.0..25.0), rng.random_range(9.0..20.0), rng.random_range(3.5..9.0)];
    let speed = rng.random_range(0.0..1.0f32).powi(3) * 2.5;
    // The head turns at up to 2.5 rad/s while the shutter is open.
    let smear = speed * camera.exposure as f32 * camera.focal() * rng.random_range(0.5..1.5);
    let way = rng.random_range(0.0..std::f32::consts::TAU);
    let warm = rng.random_range(-1.0..1.0f32);
    let warm = if test { 0.13 * warm + 0.02 } else { 0.16 * warm };
    let glare = if rng.random_bool(0.3) { rng.random_range(0.1..0.7) } else { 0.0 };
    Look {
        light,
        ambient: rng.random_range(0.3..0.8),
        direct: rng.random_range(0.1..0.9),
        turf,
        turf_noise: [rng.random_range(0.05..0.35), rng.random_range(0.1..0.55), rng.random_range(0.0..0.12)],
        stripe: rng.random_range(0.5..2.0),
        line,
        wear: if rng.random_bool(0.5) { rng.random_range(0.0..0.2) } else { rng.random_range(0.2..0.5) },
        floor: grey(rng).map(|c| c + 0.05),
        wall: if rng.random_bool(0.5) { grey(rng).map(|c| c + 0.1) } else { any(rng) },
        ceiling: grey(rng).map(|c| c + 0.2),
        panels: rng.random_range(0.0..0.6),
        hall,
        // Other places of the noise: training below, test above.
        texture: rng.random_range(0..1u32 << 20) + if test { 1 << 24 } else { 0 },
        motion: [smear * way.cos(), smear * way.sin()],
        blur: rng.random_range(0.0..0.2),
        noise: rng.random_range(0.0..0.04f32),
        white: [1.0 + warm, 1.0 + rng.random_range(-0.05..0.05), 1.0 - warm],
        exposure: (rng.random_range(-0.55..0.5f32)).exp(),
        gamma: rng.random_range(1.8..2.4),
        glare: [
            rng.random_range(0.0..camera.width as f32),
            rng.random_range(-30.0..0.6 * camera.height as f32),
            rng.random_range(15.0..90.0),
            glare,
        ],
        veil: if rng.random_bool(0.3) { rng.random_range(0.0..0.12) } else { 0.0 },
    }
}

/// A head over the field that mostly looks at something of it.
fn camera_pose(mount: &Mount, field: &Field, rng: &mut ChaCha8Rng) -> CameraPose {
    let (x, y) = (field.length as f32 / 2.0 + 0.4, field.width as f32 / 2.0 + 0.4);
    let [low, high] = mount.height;
    let position = [rng.random_range(-x..x), rng.random_range(-y..y), rng.random_range(low..=high)];
    let landmarks: Vec<Landmark> = field
        .landmarks()
        .into_iter()
        .filter(|l| {
            let d = (l.x as f32 - position[0]).hypot(l.y as f32 - position[1]);
            l.class != LandmarkClass::PenaltyMark && (1.0..7.0).contains(&d)
        })
        .collect();
    let yaw = if landmarks.is_empty() || rng.random_bool(0.2) {
        rng.random_range(-3.2..3.2)
    } else {
        // Crossings are rarer than corners: each class has the same share.
        let class = landmarks[rng.random_range(0..landmarks.len())].class;
        let wanted = if rng.random_bool(0.4) { LandmarkClass::X } else { class };
        let of_class: Vec<_> = landmarks.iter().filter(|l| l.class == wanted).collect();
        let at = if of_class.is_empty() { &landmarks[0] } else { of_class[rng.random_range(0..of_class.len())] };
        (at.y as f32 - position[1]).atan2(at.x as f32 - position[0]) + rng.random_range(-0.55..0.55)
    };
    let [level, down] = mount.pitch;
    CameraPose::looking(position, yaw, rng.random_range(level..=down), rng.random_range(-0.06..0.06))
}

/// A place on the ground that the camera sees, `near` to `far` ahead; log-uniform in distance.
fn seen_place(scene: &Scene, near: f32, far: f32, rng: &mut ChaCha8Rng) -> [f32; 2] {
    let distance = (rng.random_range(near.ln()..far.ln())).exp();
    let bearing = scene.camera.yaw() + rng.random_range(-0.75..0.75f32);
    [scene.camera.position.x + distance * bearing.cos(), scene.camera.position.y + distance * bearing.sin()]
}

fn robots(scene: &mut Scene, field: &Field, test: bool, rng: &mut ChaCha8Rng) {
    let count = if rng.random_bool(0.25) { rng.random_range(3..7) } else { rng.random_range(0..4) };
    for k in 0..count {
        // Every third is close enough to be cut off by the frame.
        let (near, far) = if k % 3 == 2 { (0.6, 1.6) } else { (1.2, 9.0) };
        let foot = seen_place(scene, near, far, rng);
        if !field.contains([f64::from(foot[0]), f64::from(foot[1])], 1.0) {
            continue;
        }
        let team = if rng.random_bool(0.5) { Team::Red } else { Team::Blue };
        let build = robot_build(team, test, rng);
        let heading = rng.random_range(-3.2..3.2);
        let fallen = rng.random_bool(0.06);
        humanoid::add(scene, &build, foot, heading, fallen, Some(team), rng);
    }
}

fn team_colour(team: Team, rng: &mut ChaCha8Rng) -> [f32; 3] {
    let low = rng.random_range(0.01..0.1f32);
    let high = rng.random_range(0.35..0.85f32);
    match team {
        Team::Red => [high, low, rng.random_range(0.5..1.2f32) * low],
        Team::Blue => [low, rng.random_range(1.0..3.0f32) * low, high],
    }
}

fn robot_build(team: Team, test: bool, rng: &mut ChaCha8Rng) -> Build {
    let colour = Paint::Plain(team_colour(team, rng));
    let body = if rng.random_bool(0.35) { Paint::Plain(paint_white(rng)) } else { Paint::Plain(grey(rng)) };
    let form = match (test, rng.random_bool(0.5)) {
        (true, _) => Limb::Square,
        (false, true) => Limb::Round,
        (false, false) => Limb::Tube,
    };
    let jersey = rng.random_bool(0.8);
    Build {
        height: if rng.random_bool(0.3) { rng.random_range(0.45..0.95) } else { rng.random_range(1.0..1.65) },
        breadth: if test { rng.random_range(0.9..1.15) } else { rng.random_range(0.8..1.3) },
        form,
        trunk: if jersey { colour } else { body },
        limbs: body,
        bands: if !jersey || rng.random_bool(0.4) { colour } else { body },
        head: Paint::Plain(grey(rng)),
        square_head: test || rng.random_bool(0.5),
    }
}

fn surroundings(scene: &mut Scene, field: &Field, test: bool, rng: &mut ChaCha8Rng) {
    let (x, y) = (field.length as f32 / 2.0 + field.border as f32, field.width as f32 / 2.0 + field.border as f32);
    // Boards around the field.
    if rng.random_bool(0.6) {
        let h: f32 = rng.random_range(0.25..0.5);
        for side in 0..4 {
            let (long, sign) = (side < 2, if side % 2 == 0 { 1.0 } else { -1.0 });
            let reach = if long { x } else { y };
            let count = (reach / 1.5) as usize;
            for k in 0..count {
                if rng.random_bool(0.25) {
                    continue;
                }
                let along = -reach + (2.0 * k as f32 + 1.0) * reach / count as f32;
                let half = 0.95 * reach / count as f32;
                let (place, half) = if long {
                    ([along, sign * (y + 0.3), h], [half, 0.02, h])
                } else {
                    ([sign * (x + 0.3), along, h], [0.02, half, h])
                };
                let cell = if test { rng.random_range(0.09..0.2) } else { rng.random_range(0.05..0.3) };
                scene.solids.push(block(place, half, Paint::Cells(any(rng), any(rng), cell)));
            }
        }
    }
    // People around the field, and sometimes a referee on it.
    let people = rng.random_range(0..9);
    for k in 0..people {
        let foot = if k == 0 && rng.random_bool(0.3) {
            seen_place(scene, 2.0, 6.0, rng)
        } else {
            let far = seen_place(scene, 4.0, 14.0, rng);
            if field.contains([f64::from(far[0]), f64::from(far[1])], 0.6) {
                continue;
            }
            far
        };
        let skin =
            Paint::Plain([rng.random_range(0.2..0.7), rng.random_range(0.12..0.45), rng.random_range(0.08..0.35)]);
        let shirt = Paint::Cells(any(rng), any(rng), rng.random_range(0.05..0.5));
        let trousers = Paint::Plain(grey(rng));
        let build = Build {
            height: rng.random_range(1.66..1.95),
            breadth: rng.random_range(0.9..1.25),
            form: Limb::Round,
            trunk: shirt,
            limbs: trousers,
            bands: trousers,
            head: skin,
            square_head: false,
        };
        let heading = rng.random_range(-3.2..3.2);
        humanoid::add(scene, &build, foot, heading, false, None, rng);
    }
    // Tables, bags, white and round things beside the field.
    for _ in 0..rng.random_range(0..7) {
        let at = seen_place(scene, 3.0, 14.0, rng);
        if field.contains([f64::from(at[0]), f64::from(at[1])], 0.7) {
            continue;
        }
        let size = [rng.random_range(0.1..0.7), rng.random_range(0.1..0.5), rng.random_range(0.1..0.8f32)];
        let paint = match rng.random_range(0..3) {
            0 => Paint::Plain(paint_white(rng)),
            1 => Paint::Plain(any(rng)),
            _ => Paint::Cells(any(rng), any(rng), rng.random_range(0.05..0.4)),
        };
        let solid = block([at[0], at[1], size[2]], size, paint);
        let round = Solid { shape: Shape::Sphere(size[0].min(0.35)), ..solid };
        scene.solids.push(if rng.random_bool(0.2) { round } else { solid });
    }
}

/// The feet and shanks of the robot that carries the camera: no robot to be found.
fn own_feet(scene: &mut Scene, rng: &mut ChaCha8Rng) {
    let (s, c) = scene.camera.yaw().sin_cos();
    let paint = Paint::Plain(if rng.random_bool(0.7) { grey(rng) } else { any(rng) });
    for side in [-1.0, 1.0] {
        let (x, y) = (rng.random_range(-0.1..0.4f32), side * rng.random_range(0.06..0.14f32));
        let [px, py] = [scene.camera.position.x + c * x - s * y, scene.camera.position.y + s * x + c * y];
        let turn = Rotation3::from_euler_angles(0.0, 0.0, scene.camera.yaw() + rng.random_range(-0.3..0.3));
        let half = [rng.random_range(0.08..0.14), rng.random_range(0.03..0.06), 0.03];
        let z = rng.random_range(0.03..0.12f32);
        let foot = block([px, py, z], half, paint);
        scene.solids.push(Solid { rotation: *turn.matrix(), ..foot });
        let shank = Solid { shape: Shape::Capsule(rng.random_range(0.03..0.05), 0.15), ..foot };
        scene.solids.push(Solid { position: Vector3::new(px - 0.03 * c, py - 0.03 * s, z + 0.2), ..shank });
    }
}

/// An upright box of the surroundings.
fn block(place: [f32; 3], half: [f32; 3], paint: Paint) -> Solid {
    Solid { shape: Shape::Box(half), position: place.into(), rotation: nalgebra::Matrix3::identity(), paint, thing: 0 }
}

fn ball(scene: &mut Scene, field: &Field, test: bool, [near, far]: [f32; 2], rng: &mut ChaCha8Rng) {
    if rng.random_bool(0.15) {
        return;
    }
    let radius = field.ball.radius as f32;
    let at = seen_place(scene, near, far, rng);
    if !field.contains([f64::from(at[0]), f64::from(at[1])], 0.9) {
        return;
    }
    let z = if rng.random_bool(0.06) { rng.random_range(radius..0.3) } else { radius };
    let turn = Rotation3::from_euler_angles(
        rng.random_range(-3.1..3.1f32),
        rng.random_range(-1.5..1.5),
        rng.random_range(-3.1..3.1),
    );
    let ground = if rng.random_bool(0.8) { paint_white(rng) } else { [0.8, rng.random_range(0.3..0.8), 0.1] };
    let patch = if rng.random_bool(0.5) { [0.03; 3] } else { any(rng) };
    // The test's balls have patches of other sizes and numbers than those of training.
    let paint = if test {
        Paint::Patches(ground, patch, rng.random_range(0.90..0.94), rng.random_bool(0.4))
    } else if rng.random_bool(0.12) {
        Paint::Plain(ground)
    } else {
        let small = rng.random_bool(0.5);
        let cosine = if small { rng.random_range(0.945..0.98) } else { rng.random_range(0.82..0.895) };
        Paint::Patches(ground, patch, cosine, rng.random_bool(0.4))
    };
    scene.add_ball(Vector3::new(at[0], at[1], z), radius, *turn.matrix(), paint);
}

/// Where the robot that carries the camera stands.
pub fn robot_pose(scene: &Scene) -> Pose {
    let camera = &scene.camera;
    Pose::new(f64::from(camera.position.x), f64::from(camera.position.y), f64::from(camera.yaw()))
}
