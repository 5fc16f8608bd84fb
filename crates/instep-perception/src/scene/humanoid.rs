//! Robots and people of simple bodies: how the scenes' players and bystanders are built.
//!
//! Not any one robot: proportions, forms and colours are drawn, so that a detector does not learn one maker's machine.

use nalgebra::{Matrix3, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::{Limb, Paint, Scene, Shape, Solid, Thing, limb};
use crate::class::{Class, Team};

/// How a humanoid looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Build {
    /// Standing height, m.
    pub height: f32,
    /// Breadth against a usual one, 1.
    pub breadth: f32,
    /// Form of the limbs.
    pub form: Limb,
    /// Trunk.
    pub trunk: Paint,
    /// Arms and legs.
    pub limbs: Paint,
    /// Forearms and shanks: a team's bands, or the same as `limbs`.
    pub bands: Paint,
    /// Head.
    pub head: Paint,
    /// Whether the head is a box.
    pub square_head: bool,
}

/// Adds a humanoid that stands or walks at `foot`, facing `heading`; fallen when `fallen`. Its pose is drawn.
pub fn add(
    scene: &mut Scene,
    build: &Build,
    foot: [f32; 2],
    heading: f32,
    fallen: bool,
    robot: Option<Team>,
    rng: &mut ChaCha8Rng,
) {
    let h = build.height;
    let position = Vector3::new(foot[0], foot[1], 0.0);
    let thing =
        robot.map_or(0, |team| scene.add(Thing { class: Class::Robot, team: Some(team), position, size: h / 2.0 }));
    let (s, c) = heading.sin_cos();
    let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    // A fall: forward onto the ground, about the feet.
    let (tilt, lift) = if fallen { (1.5, 0.09 * h) } else { (rng.random_range(-0.06..0.12f32), 0.0) };
    let (ts, tc) = tilt.sin_cos();
    let pose = turn * Matrix3::new(tc, 0.0, ts, 0.0, 1.0, 0.0, -ts, 0.0, tc);
    let place =
        |x: f32, y: f32, z: f32| position + Vector3::new(0.0, 0.0, lift) + pose * Vector3::new(x * h, y * h, z * h);
    let b = build.breadth;
    let mut bodies = Vec::new();
    let mut part = |from: [f32; 3], to: [f32; 3], radius: f32, paint: Paint| {
        bodies.push(limb(
            place(from[0], from[1], from[2]),
            place(to[0], to[1], to[2]),
            radius * h,
            build.form,
            paint,
            thing,
        ));
    };
    let swing = rng.random_range(-0.12..0.12f32);
    let bend = rng.random_range(0.0..0.06f32);
    for (side, swing) in [(1.0, swing), (-1.0, -swing)] {
        let hip = [0.0, side * 0.06 * b, 0.50];
        let knee = [0.5 * swing + bend, side * 0.065 * b, 0.27];
        let raised = swing.max(0.0) * 0.4;
        let ankle = [swing - 0.3 * bend, side * 0.065 * b, 0.045 + raised];
        part(hip, knee, 0.046 * b, build.limbs);
        part(knee, ankle, 0.036 * b, build.bands);
        part(
            [ankle[0] - 0.03, ankle[1], 0.022 + raised],
            [ankle[0] + 0.09, ankle[1], 0.022 + raised],
            0.022,
            build.limbs,
        );
        let shoulder = [0.0, side * (0.135 * b + 0.01), 0.79];
        let out: f32 = rng.random_range(0.02..0.10);
        let reach: f32 = rng.random_range(-0.04..0.14);
        let elbow = [reach * 0.3 - 0.02, side * (0.15 * b + out), 0.64];
        let hand = [reach, side * (0.15 * b + out), rng.random_range(0.48..0.62)];
        part(shoulder, elbow, 0.030 * b, build.limbs);
        part(elbow, hand, 0.025 * b, build.bands);
    }
    part([0.0, 0.0, 0.83], [0.0, 0.0, 0.88], 0.03, build.limbs);
    let trunk = Solid {
        shape: match build.form {
            Limb::Round => Shape::Capsule(0.095 * h * b, 0.10 * h),
            Limb::Tube => Shape::Cylinder(0.105 * h * b, 0.17 * h),
            Limb::Square => Shape::Box([0.075 * h * b, 0.12 * h * b, 0.17 * h]),
        },
        position: place(0.0, 0.0, 0.67),
        rotation: pose,
        paint: build.trunk,
        thing,
    };
    bodies.push(trunk);
    bodies.push(Solid {
        shape: Shape::Box([0.07 * h * b, 0.10 * h * b, 0.05 * h]),
        position: place(0.0, 0.0, 0.52),
        rotation: pose,
        paint: build.limbs,
        thing,
    });
    bodies.push(Solid {
        shape: if build.square_head { Shape::Box([0.05 * h, 0.06 * h, 0.05 * h]) } else { Shape::Sphere(0.063 * h) },
        position: place(0.01, 0.0, 0.935),
        rotation: pose,
        paint: build.head,
        thing,
    });
    scene.solids.extend(bodies);
    if fallen {
        let middle = place(0.0, 0.0, 0.5);
        scene.add_shadow([middle.x, middle.y], 0.3 * h, 0.1 * h, 0.7);
    } else {
        scene.add_shadow(foot, 0.12 * h, h, 0.7);
    }
}
