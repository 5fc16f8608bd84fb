//! Bodies for the replay: a robot from its model's geoms, a human from landmarks, a ball.
//!
//! Which geoms are seen: `instep_robot::Robot::visible`.

use instep_motion::landmark::Landmark;
use instep_motion::phase::Side;
use instep_report::{Actor, Color, Finish, Part, Pose, Shape};
use instep_robot::{Form, Robot, RobotData, Visible};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Single precision is what the page draws with.
fn to_f32(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

fn pose(position: &Vector3<f64>, rotation: &UnitQuaternion<f64>) -> Pose {
    Pose { position: to_f32(position), rotation: [rotation.w, rotation.i, rotation.j, rotation.k].map(|x| x as f32) }
}

fn shape(form: Form) -> Shape {
    let single = |half: [f64; 3]| half.map(|x| x as f32);
    match form {
        Form::Sphere(radius) => Shape::Sphere { radius: radius as f32 },
        Form::Capsule(radius, half) => Shape::Capsule { radius: radius as f32, half_length: half as f32 },
        Form::Cylinder(radius, half) => Shape::Cylinder { radius: radius as f32, half_length: half as f32 },
        Form::Box(half) => Shape::Box { half_extents: single(half) },
        Form::Ellipsoid(half) => Shape::Ellipsoid { radii: single(half) },
    }
}

fn color(rgba: [f32; 4]) -> Color {
    let [r, g, b, a] = rgba.map(|x| (x.clamp(0.0, 1.0) * 255.0).round() as u8);
    Color { r, g, b, a }
}

fn rotation([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

/// A robot's visible geoms.
#[derive(Debug, Clone)]
pub(crate) struct Figure {
    solids: Vec<Visible>,
}

impl Figure {
    /// What can be seen of `robot`.
    pub(crate) fn new(robot: &Robot) -> Self {
        Self { solids: robot.visible().collect() }
    }

    /// The robot moving through the positions `frames` (each 7 + n); `tint` may change the colours.
    pub(crate) fn actor<'a>(
        &self,
        name: &str,
        data: &mut RobotData,
        frames: impl IntoIterator<Item = &'a [f64]>,
        tint: impl Fn(Color) -> Color,
    ) -> Actor {
        let mut parts: Vec<Part> = self
            .solids
            .iter()
            .map(|s| Part {
                shape: shape(s.form),
                color: tint(color(s.color)),
                finish: Finish::Plain,
                poses: Vec::new(),
            })
            .collect();
        for q in frames {
            data.set_position(q);
            for (part, solid) in parts.iter_mut().zip(&self.solids) {
                let world_from_link = data.link_rotation(solid.link);
                let position = data.link_position(solid.link) + world_from_link * solid.position;
                part.poses.push(pose(&position, &(world_from_link * solid.rotation)));
            }
        }
        Actor { name: name.into(), parts, ..Actor::default() }
    }
}

/// A ball at each frame: centre (m) and `world_from_ball`.
pub(crate) fn ball(radius: f64, frames: impl Iterator<Item = ([f64; 3], [f64; 4])>) -> Actor {
    let part = Part {
        shape: Shape::Sphere { radius: radius as f32 },
        color: Color::rgb(0xf4f5f7),
        finish: Finish::Football,
        poses: frames.map(|(position, turn)| pose(&position.into(), &rotation(turn))).collect(),
    };
    Actor { name: "Ball".into(), parts: vec![part], ..Actor::default() }
}

/// A limb of the human figure: its ends and its radius, m.
type Limb = (Landmark, Landmark, f64);

/// The human's limbs, middle ones first.
fn limbs() -> Vec<Limb> {
    use Landmark::{Ankle, Chest, Elbow, HandTip, Head, Hip, Knee, Pelvis, Shoulder, ToeBase, ToeTip, Wrist};
    use Side::{Left, Right};
    let mut limbs = vec![
        (Pelvis, Chest, 0.085),
        (Hip(Left), Hip(Right), 0.07),
        (Shoulder(Left), Shoulder(Right), 0.055),
        (Chest, Head, 0.05),
        (Head, Head, 0.1),
    ];
    for side in [Left, Right] {
        limbs.extend([
            (Hip(side), Knee(side), 0.06),
            (Knee(side), Ankle(side), 0.045),
            (Ankle(side), ToeBase(side), 0.035),
            (ToeBase(side), ToeTip(side), 0.028),
            (Shoulder(side), Elbow(side), 0.042),
            (Elbow(side), Wrist(side), 0.035),
            (Wrist(side), HandTip(side), 0.028),
        ]);
    }
    limbs
}

/// A human made of capsules between landmarks, moving through `frames`, each in the order of [`Landmark::ALL`]; the
/// kicking leg stands out. Limbs have their mean length.
pub(crate) fn human(name: &str, frames: &[Vec<Vector3<f64>>], kick_foot: Side) -> Actor {
    let at = |frame: &[Vector3<f64>], landmark: Landmark| {
        Landmark::ALL
            .iter()
            .position(|known| *known == landmark)
            .and_then(|i| frame.get(i))
            .copied()
            .unwrap_or_default()
    };
    let part = |(from, to, radius): Limb| {
        let mut length = 0.0;
        let poses = frames.iter().map(|frame| {
            let (from, to) = (at(frame, from), at(frame, to));
            length += (to - from).norm() / frames.len() as f64;
            // Opposite to z any half turn will do.
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &(to - from));
            pose(
                &from.lerp(&to, 0.5),
                &turn.unwrap_or_else(|| UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0)),
            )
        });
        let poses = poses.collect();
        let leg = [Landmark::Knee(kick_foot), Landmark::Ankle(kick_foot), Landmark::ToeBase(kick_foot)];
        let kicks = leg.contains(&from) || leg.contains(&to);
        let color = if kicks { Color::ORANGE } else { Color::rgb(0x9db4d6) };
        let shape = Shape::Capsule { radius: radius as f32, half_length: (length / 2.0) as f32 };
        Part { shape, color, finish: Finish::Plain, poses }
    };
    Actor { name: name.into(), parts: limbs().into_iter().map(part).collect(), ..Actor::default() }
}

/// Small spheres at `points`, one list a frame; each frame has as many as the first.
pub(crate) fn markers(name: &str, color: Color, frames: &[&[Vector3<f64>]]) -> Actor {
    let count = frames.first().map_or(0, |points| points.len());
    let part = |i: usize| Part {
        shape: Shape::Sphere { radius: 0.014 },
        color,
        finish: Finish::Plain,
        poses: frames.iter().map(|points| Pose::at(points.get(i).map_or([0.0; 3], to_f32))).collect(),
    };
    Actor { name: name.into(), parts: (0..count).map(part).collect(), ..Actor::default() }
}

/// The text with a capital letter in front.
pub(crate) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
