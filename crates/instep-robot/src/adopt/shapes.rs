//! Capsules in place of a foreign model's meshes and boxes, and a foot's sole, contact points and striking edges.
//!
//! The engines and the world want capsules: their distances are exact and cheap. A limb's runs from its hinge to the next one, as thick as
//! the middle of its surface's distances from that line; a body's along the longest side of its bounding box. A foot is a plate: its sole
//! is what lies lowest, in a rectangle; its striking edges go round its outline, at half the height that it has at the toe.

use nalgebra::{UnitQuaternion, Vector3};

use super::skeleton::{Fault, Skeleton};

/// Radius of contact spheres, m.
const CONTACT: f64 = 0.005;
/// Steepest sole, with every joint at zero, that an ankle's shifted zero explains, rad; where a toe hangs on the foot, a level one is wanted.
const SHIFTED: f64 = 0.2;
/// Steepest sole that counts as level, rad.
const LEVEL: f64 = 0.12;

/// A capsule, in its link's axes about the link's place in the world with every joint at zero.
#[derive(Debug, Clone)]
pub(super) struct Capsule {
    pub(super) name: String,
    pub(super) link: usize,
    pub(super) ends: [Vector3<f64>; 2],
    pub(super) radius: f64,
}

/// What is known of a foot's surface.
#[derive(Debug, Clone)]
pub(super) struct FootShape {
    /// Centre of the sole, m.
    pub(super) sole: Vector3<f64>,
    /// Contact points by corner: name, link, centre of a sphere of [`CONTACT`] m.
    pub(super) contacts: Vec<(String, usize, Vector3<f64>)>,
    /// Striking capsules, the toe's first.
    pub(super) strike: Vec<Capsule>,
}

/// Radius of the contact spheres, m.
pub(super) const fn contact_radius() -> f64 {
    CONTACT
}

/// Turns the axes of a foot whose sole is a little off level with every joint at zero into those of its sole, and its points with them.
pub(super) fn level(skeleton: &mut Skeleton, foot: usize) {
    let link = &mut skeleton.links[foot];
    for _ in 0..3 {
        let Some(&first) = link.points.first() else { return };
        let low = link.points.iter().fold(first, |a, p| a.inf(p));
        let high = link.points.iter().fold(first, |a, p| a.sup(p));
        let slopes = tilt(&link.points, &low, &high);
        if slopes.iter().any(|angle| angle.abs() > SHIFTED) || slopes.iter().all(|angle| angle.abs() < 1e-3) {
            return;
        }
        let normal = Vector3::new(-slopes[0].tan(), -slopes[1].tan(), 1.0);
        let Some(right) = UnitQuaternion::rotation_between(&normal, &Vector3::z()) else { return };
        let right = right.to_rotation_matrix().into_inner();
        link.turn *= right.transpose();
        let origin = link.origin;
        link.points.iter_mut().for_each(|p| *p = origin + right * (*p - origin));
    }
}

/// The foot on side `word`: `foot` is the link with the sole, `toe` the one before it where there is one; `leg` is the leg's length (m).
pub(super) fn foot(
    skeleton: &Skeleton,
    word: &str,
    foot: usize,
    toe: Option<usize>,
    leg: f64,
) -> Result<FootShape, Fault> {
    let out = if word == "left" { 1.0 } else { -1.0 };
    let name = |link: usize| skeleton.links[link].name.as_str();
    let points: Vec<Vector3<f64>> =
        [Some(foot), toe].into_iter().flatten().flat_map(|link| skeleton.links[link].points.iter().copied()).collect();
    if points.is_empty() {
        let found = format!("the {word} foot \"{}\" has neither a shape nor a mesh that can be read", name(foot));
        return Err((
            found,
            "a geom or collision shape (box, sphere, capsule, cylinder, STL or OBJ mesh) for it".into(),
        ));
    }
    let low = points.iter().fold(points[0], |a, p| a.inf(p));
    let high = points.iter().fold(points[0], |a, p| a.sup(p));
    let tilt = tilt(&points, &low, &high);
    if tilt.iter().any(|angle| angle.abs() > LEVEL) {
        let [pitch, roll] = tilt.map(f64::to_degrees);
        return Err((
            format!("the {word} sole, on \"{}\", is not level with every joint at zero: {pitch:.1} degrees in pitch, {roll:.1} in roll", name(foot)),
            "a model whose zero pose stands on level soles: turn the foot's shape, or shift the zeros of its ankle joints".into(),
        ));
    }
    let band = (0.012 * leg).min(0.3 * (high.z - low.z)).max(1e-4);
    let ground: Vec<&Vector3<f64>> = points.iter().filter(|p| p.z < low.z + band).collect();
    let sole_low = ground.iter().fold(*ground[0], |a, p| a.inf(p));
    let sole_high = ground.iter().fold(*ground[0], |a, p| a.sup(p));
    let length = sole_high.x - sole_low.x;
    if length < 0.06 * leg {
        return Err((
            format!(
                "the {word} foot \"{}\" touches the ground along {:.0} mm only: a point foot",
                name(foot),
                1e3 * length
            ),
            "soles to stand on: a kick is made on one foot".into(),
        ));
    }
    let middle = 0.5 * (sole_low + sole_high);
    let sole = Vector3::new(middle.x, middle.y, low.z);
    let inset = |edge: f64, centre: f64| edge - (edge - centre).signum() * CONTACT.min((edge - centre).abs());
    let corner = |part: &str, link: usize, x: f64, outward: f64| {
        let y = if outward * out > 0.0 { sole_high.y } else { sole_low.y };
        let at = Vector3::new(inset(x, middle.x), inset(y, middle.y), low.z + CONTACT);
        (format!("{word}_{part}"), link, at)
    };
    let front = toe.unwrap_or(foot);
    let contacts = vec![
        corner("front_inner", front, sole_high.x, -1.0),
        corner("front_outer", front, sole_high.x, 1.0),
        corner("back_inner", foot, sole_low.x, -1.0),
        corner("back_outer", foot, sole_low.x, 1.0),
    ];

    // How high the foot is at the toe.
    let length = high.x - low.x;
    let at_toe = points.iter().filter(|p| p.x > high.x - 0.12 * length).map(|p| p.z).fold(low.z, f64::max);
    let radius = (0.5 * (at_toe - low.z)).clamp(0.018 * leg, 0.035 * leg).min(0.25 * (high.y - low.y)).max(0.004);
    let z = low.z + (0.5 * (at_toe - low.z)).clamp(radius, 0.05 * leg) + 0.2 * radius;
    let (x0, x1) = (low.x + radius, high.x - radius);
    let (inner, outer) = if out > 0.0 { (low.y + radius, high.y - radius) } else { (high.y - radius, low.y + radius) };
    let capsule = |part: &str, link: usize, a: [f64; 2], b: [f64; 2]| Capsule {
        name: format!("{word}_{part}"),
        link,
        ends: [Vector3::new(a[0], a[1], z), Vector3::new(b[0], b[1], z)],
        radius,
    };
    // The sides of a foot with a toe end where the toe begins.
    let bend = toe.map_or(x1, |toe| skeleton.links[toe].origin.x.clamp(x0, x1));
    let mut strike = vec![
        capsule("toe", front, [x1, inner], [x1, outer]),
        capsule("inner", foot, [x0, inner], [bend, inner]),
        capsule("outer", foot, [x0, outer], [bend, outer]),
        capsule("heel", foot, [x0, inner], [x0, outer]),
    ];
    let above = skeleton.links[foot].origin;
    if above.z - radius > z && above.x < x1 {
        strike.push(Capsule {
            name: format!("{word}_instep"),
            link: foot,
            ends: [
                Vector3::new(above.x, middle.y, (z + 0.5 * (above.z - z)).max(z)),
                Vector3::new(bend.max(above.x), middle.y, z),
            ],
            radius,
        });
    }
    Ok(FootShape { sole, contacts, strike })
}

/// Pitch and roll of a sole, rad: between the lowest points of its front and back thirds, of its left and right ones.
fn tilt(points: &[Vector3<f64>], low: &Vector3<f64>, high: &Vector3<f64>) -> [f64; 2] {
    [0, 1].map(|k| {
        let third = (high[k] - low[k]) / 3.0;
        let lowest = |inside: &dyn Fn(f64) -> bool| {
            points.iter().filter(|p| inside(p[k])).min_by(|a, b| a.z.total_cmp(&b.z)).copied()
        };
        match (lowest(&|x| x <= low[k] + third), lowest(&|x| x >= high[k] - third)) {
            (Some(a), Some(b)) if b[k] - a[k] > 1e-6 => ((b.z - a.z) / (b[k] - a[k])).atan(),
            _ => 0.0,
        }
    })
}

/// A limb's capsule from its hinge to `end` (m).
pub(super) fn limb(skeleton: &Skeleton, name: String, link: usize, end: Vector3<f64>, leg: f64) -> Option<Capsule> {
    let from = skeleton.links[link].origin;
    let (axis, length) = ((end - from).try_normalize(1e-9)?, (end - from).norm());
    if length < 0.05 * leg {
        return None;
    }
    let mut distances: Vec<f64> = skeleton.links[link]
        .points
        .iter()
        .map(|p| p - from)
        .filter(|p| (0.15 * length..0.85 * length).contains(&p.dot(&axis)))
        .map(|p| (p - axis * p.dot(&axis)).norm())
        .collect();
    distances.sort_by(f64::total_cmp);
    let middle = distances.get(distances.len() / 2).copied().unwrap_or(0.12 * length);
    let radius = middle.clamp(0.03 * leg, 0.1 * leg).min(0.45 * length);
    Some(Capsule { name, link, ends: [from + axis * (0.5 * radius), end - axis * radius], radius })
}

/// A body's capsule along the longest side of its bounding box.
pub(super) fn body(skeleton: &Skeleton, name: String, link: usize, leg: f64) -> Option<Capsule> {
    let [low, high] = skeleton.bounds(link)?;
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let long = half.imax();
    let radius = 0.5 * (half.sum() - half[long]);
    if radius < 0.02 * leg {
        return None;
    }
    let mut axis = Vector3::zeros();
    axis[long] = (half[long] - radius).max(0.0);
    Some(Capsule { name, link, ends: [middle - axis, middle + axis], radius })
}
