//! What the renderer is given: plain data, filled at random ([`random`]) or from a world's state ([`staged`]).

pub mod humanoid;
pub mod moving;
pub mod random;
pub mod staged;

use nalgebra::{Matrix3, Vector3};

use crate::camera::CameraPose;
use crate::class::{Class, Team};

/// A body's form, in its own frame, centred at its origin. m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Radius.
    Sphere(f32),
    /// Radius, and half the length between the ends' centres, along z.
    Capsule(f32, f32),
    /// Radius and half length, along z.
    Cylinder(f32, f32),
    /// Half sides along x, y, z.
    Box([f32; 3]),
}

/// How a body's surface looks. Colours are linear reflectances from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Paint {
    /// One colour.
    Plain([f32; 3]),
    /// Cells of two colours by a hash: what writing, windows and clothes look like from afar. Colours and cell side, m.
    Cells([f32; 3], [f32; 3], f32),
    /// Twelve round patches as a classic ball has them, or six of another size. Ground, patch, cosine of the patch's half
    /// angle, whether there are six.
    Patches([f32; 3], [f32; 3], f32, bool),
}

/// A body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// Its form.
    pub shape: Shape,
    /// World frame, m.
    pub position: Vector3<f32>,
    /// World from body.
    pub rotation: Matrix3<f32>,
    /// Its surface.
    pub paint: Paint,
    /// Which of [`Scene::things`] it belongs to, counted from 1; 0 for surroundings.
    pub thing: u16,
}

/// A thing that is labelled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thing {
    /// Ball, goal post or robot.
    pub class: Class,
    /// A robot's team.
    pub team: Option<Team>,
    /// Its middle (ball) or foot on the ground (post, robot), world frame, m.
    pub position: Vector3<f32>,
    /// The radius of a ball or post, half the height of a robot, m.
    pub size: f32,
}

/// A shadow on the ground: an ellipse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shadow {
    /// Middle, m.
    pub center: [f32; 2],
    /// Direction of its long axis, unit vector.
    pub along: [f32; 2],
    /// Half axes, m.
    pub half: [f32; 2],
    /// Share of light that it takes, 0 to 1.
    pub depth: f32,
}

/// Light, ground, surroundings and what the camera does to them.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    /// Toward the main light, unit vector, z > 0.
    pub light: Vector3<f32>,
    /// Light from everywhere, and from the main light.
    pub ambient: f32,
    /// See `ambient`.
    pub direct: f32,
    /// Turf.
    pub turf: [f32; 3],
    /// Relative size of patches, grain and mown stripes in the turf.
    pub turf_noise: [f32; 3],
    /// Width of a mown stripe, m.
    pub stripe: f32,
    /// Lines.
    pub line: [f32; 3],
    /// Share of the lines' paint that is worn, 0 to 1.
    pub wear: f32,
    /// Ground outside the field, walls, ceiling.
    pub floor: [f32; 3],
    /// See `floor`.
    pub wall: [f32; 3],
    /// See `floor`.
    pub ceiling: [f32; 3],
    /// How strongly the wall's panels differ.
    pub panels: f32,
    /// Half sides of the hall, and its height, m.
    pub hall: [f32; 3],
    /// Where the noise begins: another texture for each seed.
    pub texture: u32,
    /// Motion blur, pixels along x and y.
    pub motion: [f32; 2],
    /// Lens blur: share that goes to the neighbours, 0 to 0.25.
    pub blur: f32,
    /// Standard deviation of the sensor's noise at full white, of 1.
    pub noise: f32,
    /// Gains of red, green and blue.
    pub white: [f32; 3],
    /// Exposure.
    pub exposure: f32,
    /// Gamma of the camera's curve.
    pub gamma: f32,
    /// Glare: middle in pixels, radius in pixels, strength; and a veil over everything.
    pub glare: [f32; 4],
    /// See `glare`.
    pub veil: f32,
}

impl Default for Look {
    /// A plain hall in even light.
    fn default() -> Self {
        Look {
            light: Vector3::new(0.3, 0.2, 0.93),
            ambient: 0.55,
            direct: 0.5,
            turf: [0.07, 0.22, 0.06],
            turf_noise: [0.15, 0.3, 0.05],
            stripe: 1.0,
            line: [0.8, 0.8, 0.8],
            wear: 0.1,
            floor: [0.25, 0.24, 0.23],
            wall: [0.5, 0.5, 0.5],
            ceiling: [0.6, 0.6, 0.62],
            panels: 0.2,
            hall: [16.0, 13.0, 6.0],
            texture: 1,
            motion: [0.0; 2],
            blur: 0.1,
            noise: 0.01,
            white: [1.0; 3],
            exposure: 1.0,
            gamma: 2.2,
            glare: [0.0, 0.0, 1.0, 0.0],
            veil: 0.0,
        }
    }
}

/// A scene in the field frame, ground at z = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Where the left eye is.
    pub camera: CameraPose,
    /// All bodies.
    pub solids: Vec<Solid>,
    /// What is labelled.
    pub things: Vec<Thing>,
    /// Shadows on the ground.
    pub shadows: Vec<Shadow>,
    /// Light and textures.
    pub look: Look,
    /// Seed of the sensors' noise.
    pub seed: u64,
}

impl Scene {
    /// An empty field.
    pub fn new(camera: CameraPose, look: Look, seed: u64) -> Self {
        Scene { camera, solids: Vec::new(), things: Vec::new(), shadows: Vec::new(), look, seed }
    }

    /// Adds a labelled thing; what it gets is the number its bodies carry.
    pub fn add(&mut self, thing: Thing) -> u16 {
        self.things.push(thing);
        u16::try_from(self.things.len()).unwrap_or(0)
    }

    /// A ball with its shadow.
    pub fn add_ball(&mut self, position: Vector3<f32>, radius: f32, rotation: Matrix3<f32>, paint: Paint) {
        let thing = self.add(Thing { class: Class::Ball, team: None, position, size: radius });
        self.solids.push(Solid { shape: Shape::Sphere(radius), position, rotation, paint, thing });
        self.add_shadow([position.x, position.y], radius, (2.0 * position.z).max(radius), 0.75);
    }

    /// Both goals: two posts each, labelled, and a bar.
    pub fn add_goals(&mut self, field: &instep_field::Field, post_radius: f32, paint: Paint, net: bool) {
        for goal in [field.opponent_goal(), field.own_goal()] {
            let h = goal.height as f32;
            for post in goal.posts {
                let foot = Vector3::new(post[0] as f32, post[1] as f32, 0.0);
                let thing = self.add(Thing { class: Class::GoalPost, team: None, position: foot, size: post_radius });
                let position = foot + Vector3::new(0.0, 0.0, h / 2.0);
                let shape = Shape::Cylinder(post_radius, h / 2.0);
                self.solids.push(Solid { shape, position, rotation: Matrix3::identity(), paint, thing });
                self.add_shadow([foot.x, foot.y], post_radius, h, 0.4);
                // The frame behind the post.
                let back = foot.x + foot.x.signum() * goal.depth as f32;
                self.bar([foot.x, foot.y, 0.02], [back, foot.y, 0.02], 0.02, paint);
                self.bar([back, foot.y, 0.0], [back, foot.y, 0.6 * h], 0.02, paint);
            }
            let [a, b] = goal.posts.map(|p| [p[0] as f32, p[1] as f32, h]);
            self.bar(a, b, post_radius, paint);
            let back = a[0] + a[0].signum() * goal.depth as f32;
            self.bar([back, a[1], 0.02], [back, b[1], 0.02], 0.02, paint);
            if net {
                for k in 1..8 {
                    let y = a[1] + (b[1] - a[1]) * k as f32 / 8.0;
                    self.bar([back, y, 0.0], [a[0], y, h], 0.006, paint);
                }
            }
        }
    }

    /// A round bar between two points, part of the surroundings.
    fn bar(&mut self, from: [f32; 3], to: [f32; 3], radius: f32, paint: Paint) {
        self.solids.push(limb(from.into(), to.into(), radius, Limb::Round, paint, 0));
    }

    /// The shadow of something upright: in the light's direction as long as it is high.
    pub fn add_shadow(&mut self, foot: [f32; 2], radius: f32, height: f32, depth: f32) {
        let light = self.look.light;
        let flat = light.x.hypot(light.y).max(1e-3);
        let along = [-light.x / flat, -light.y / flat];
        let reach = (height * flat / light.z.max(0.2)).min(2.5);
        let shade = depth * self.look.direct / (self.look.direct + self.look.ambient).max(1e-3);
        let center = [foot[0] + along[0] * reach / 2.0, foot[1] + along[1] * reach / 2.0];
        self.shadows.push(Shadow { center, along, half: [radius + reach / 2.0, radius], depth: shade });
        self.shadows.push(Shadow { center: foot, along, half: [1.6 * radius, 1.6 * radius], depth: 0.35 });
    }
}

/// How a limb is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limb {
    /// A capsule.
    Round,
    /// A cylinder.
    Tube,
    /// A box.
    Square,
}

/// A limb between two points.
pub fn limb(from: Vector3<f32>, to: Vector3<f32>, radius: f32, form: Limb, paint: Paint, thing: u16) -> Solid {
    let (axis, half) = ((to - from), (to - from).norm() / 2.0);
    let z = if half > 1e-6 { axis / (2.0 * half) } else { Vector3::z() };
    let side = if z.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let x = side.cross(&z).normalize();
    let rotation = Matrix3::from_columns(&[x, z.cross(&x), z]);
    let shape = match form {
        Limb::Round => Shape::Capsule(radius, half),
        Limb::Tube => Shape::Cylinder(radius, half + 0.5 * radius),
        Limb::Square => Shape::Box([radius, 0.9 * radius, half + 0.5 * radius]),
    };
    Solid { shape, position: (from + to) / 2.0, rotation, paint, thing }
}
