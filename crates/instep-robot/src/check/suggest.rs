//! A starting `robot.toml` for a model that has none: every role that could be guessed, and a plain word where not.

use std::collections::BTreeMap;
use std::path::Path;

use instep_motion::phase::Side;
use nalgebra::Vector3;

use super::legs::{LegRoles, Limbs, roles};
use super::markup::Markup;
use super::outline::Outline;
use crate::settings::{BaseFile, ContactFile, GroupFile, LegFile, LegsFile, PointFile, RobotFile, SelfCollisionFile};

/// Stands where a name could not be guessed.
pub(crate) const UNKNOWN: &str = "FILL IN";
/// Speed limit where the model gives none, rad/s.
const SPEED: f64 = 6.0;
/// Torque limit where the model gives none, N m per kg of the robot's mass.
const TORQUE_PER_MASS: f64 = 0.8;
/// Radius of the contact spheres, m.
const RADIUS: f64 = 0.005;

/// The suggestion as a file, and what in it is a guess that its owner must look at.
pub(crate) struct Suggestion {
    pub(crate) file: RobotFile,
    pub(crate) guesses: Vec<String>,
}

/// Makes the suggestion for the model file `model`.
pub(crate) fn suggest(outline: &Outline, markup: &Markup, limbs: &Limbs, model: &Path) -> Suggestion {
    let mut guesses = vec!["drive gains kp, kd and the corner speed of every group".to_owned()];
    let name = markup.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| "robot".into());
    let sides = limbs.legs.as_ref().map(|pair| [0, 1].map(|side| roles(outline, &pair[side])));
    let group = groups(outline, markup, limbs, sides.as_ref(), &mut guesses);
    let legs = [Side::Left, Side::Right].map(|side| {
        let at = side as usize;
        match (&limbs.legs, &sides) {
            (Some(pair), Some(sides)) => leg(outline, side, &pair[at], &sides[at]),
            _ => (unknown_leg(), Vec::new()),
        }
    });
    let [(left, mut contact), (right, contacts_right)] = legs;
    contact.extend(contacts_right);
    if limbs.legs.is_some() {
        guesses.push("soles and contact points: the corners of each foot's bounding box".into());
    }
    guesses.push("strike: every named geom of foot and shank".into());
    let stand = outline
        .joints
        .iter()
        .filter_map(|joint| {
            let [least, greatest] = joint.range?;
            (least > 0.0 || greatest < 0.0).then(|| (joint.name.clone(), if least > 0.0 { least } else { greatest }))
        })
        .collect();
    guesses.push("stand: the model's zero pose; bend the knees a little".into());
    let file = RobotFile {
        title: format!("{name}, {} joints, {:.3} kg", outline.joints.len(), outline.model.totalmass()),
        name,
        model: model.file_name().map_or_else(|| UNKNOWN.into(), |file| file.to_string_lossy().into_owned()),
        engine: None,
        base: BaseFile { link: known(outline.base.map_or("", |base| outline.link_name(base))), imu: [0.0; 3] },
        drives: crate::drive::DriveSettings::default(),
        senses: crate::senses::SenseSettings::default(),
        group,
        stand,
        landmark: landmarks(outline, limbs, sides.as_ref(), &contact),
        leg: LegsFile { left, right },
        contact,
        self_collision: SelfCollisionFile::default(),
    };
    Suggestion { file, guesses }
}

fn known(name: &str) -> String {
    if name.is_empty() { UNKNOWN.into() } else { name.to_owned() }
}

fn unknown_leg() -> LegFile {
    let fill = || UNKNOWN.to_owned();
    LegFile {
        hip_yaw: fill(),
        hip_roll: fill(),
        hip_pitch: fill(),
        knee: fill(),
        ankle_pitch: fill(),
        ankle_roll: None,
        toe: None,
        thigh: fill(),
        shank: fill(),
        foot: fill(),
        toe_link: None,
        sole: [0.0; 3],
        strike: Vec::new(),
    }
}

/// One leg's roles, sole and contact points.
fn leg(outline: &Outline, side: Side, chain: &[usize], roles: &LegRoles) -> (LegFile, Vec<ContactFile>) {
    let joint = |role: Option<usize>| role.map_or_else(|| UNKNOWN.into(), |j| known(&outline.joints[j].name));
    let link_of = |joint: usize| outline.joints[joint].link;
    let place = |role: Option<usize>| role.and_then(|role| chain.iter().position(|&j| j == role));
    // The thigh is what the last joint before the knee moves; the foot what the last joint before the toe moves.
    let thigh = place(roles.knee).and_then(|k| k.checked_sub(1)).map(|at| link_of(chain[at]));
    let shank = roles.knee.map(link_of);
    let foot = roles.foot(chain).map(link_of);
    let link = |link: Option<usize>| link.map_or_else(|| UNKNOWN.into(), |link| known(outline.link_name(link)));
    let strike = [foot, roles.toe.map(link_of), shank]
        .into_iter()
        .flatten()
        .flat_map(|link| outline.geoms(link))
        .map(|geom| outline.geom_name(geom).to_owned())
        .filter(|name| !name.is_empty())
        .collect();
    let (sole, contacts) =
        foot.map_or(([0.0; 3], Vec::new()), |foot| sole_and_contacts(outline, side, foot, roles.toe.map(link_of)));
    let file = LegFile {
        hip_yaw: joint(roles.hip_yaw),
        hip_roll: joint(roles.hip_roll),
        hip_pitch: joint(roles.hip_pitch),
        knee: joint(roles.knee),
        ankle_pitch: joint(roles.ankle_pitch),
        ankle_roll: roles.ankle_roll.map(|roll| known(&outline.joints[roll].name)),
        toe: roles.toe.map(|toe| known(&outline.joints[toe].name)),
        thigh: link(thigh),
        shank: link(shank),
        foot: link(foot),
        toe_link: roles.toe.map(|toe| known(outline.link_name(link_of(toe)))),
        sole,
        strike,
    };
    (file, contacts)
}

/// The centre of the foot's bottom in its frame, and small spheres in its four corners; with a toe, the front two are
/// the toe's.
fn sole_and_contacts(outline: &Outline, side: Side, foot: usize, toe: Option<usize>) -> ([f64; 3], Vec<ContactFile>) {
    let within = |link: usize, world: Vector3<f64>| -> [f64; 3] {
        let local = outline.rotations[link].transpose() * (world - outline.positions[link]);
        local.map(|x| (x * 1e6).round() / 1e6).into()
    };
    let front = toe.unwrap_or(foot);
    let ([least, greatest], [toe_least, toe_greatest]) = (outline.bounds(foot), outline.bounds(front));
    let bottom = least.z.min(toe_least.z);
    let middle = (least.inf(&toe_least) + greatest.sup(&toe_greatest)) / 2.0;
    let sole = within(foot, Vector3::new(middle.x, middle.y, bottom));
    let word = if side == Side::Left { "left" } else { "right" };
    let corners = [
        ("front_inner", front, toe_greatest.x, false),
        ("front_outer", front, toe_greatest.x, true),
        ("back_inner", foot, least.x, false),
        ("back_outer", foot, least.x, true),
    ];
    let contacts = corners.map(|(corner, link, x, outer)| {
        let [least, greatest] = outline.bounds(link);
        let y = if outer == (side == Side::Left) { greatest.y } else { least.y };
        let inward = |edge: f64, centre: f64| edge - (edge - centre).signum() * RADIUS.min((edge - centre).abs());
        let centre = (least + greatest) / 2.0;
        ContactFile {
            name: format!("{word}_contact_{corner}"),
            leg: side,
            link: known(outline.link_name(link)),
            point: within(link, Vector3::new(inward(x, middle.x), inward(y, centre.y), bottom + RADIUS)),
            radius: RADIUS,
        }
    });
    (sole, contacts.into())
}

/// Groups by role in the legs, `arm` and `body` for the rest.
fn groups(
    outline: &Outline,
    markup: &Markup,
    limbs: &Limbs,
    legs: Option<&[LegRoles; 2]>,
    guesses: &mut Vec<String>,
) -> Vec<GroupFile> {
    let mut members: Vec<(String, Vec<usize>)> = Vec::new();
    for joint in 0..outline.joints.len() {
        let role = legs.into_iter().flatten().flat_map(LegRoles::roles).find(|(_, j)| *j == Some(joint));
        let name = match role {
            Some((role, _)) => role,
            None if limbs.legs.iter().flatten().flatten().any(|&j| j == joint) => "leg",
            None if limbs.arms.iter().flatten().flatten().any(|&j| j == joint) => "arm",
            None => "body",
        };
        match members.iter_mut().find(|(known, _)| known == name) {
            Some((_, joints)) => joints.push(joint),
            None => members.push((name.to_owned(), vec![joint])),
        }
    }
    let mass = outline.model.totalmass();
    let (mut no_torque, mut no_speed) = (Vec::new(), Vec::new());
    let groups = members
        .into_iter()
        .map(|(name, joints)| {
            let least = |value: &dyn Fn(usize) -> Option<f64>| {
                joints.iter().filter_map(|&j| value(j)).fold(None, |m: Option<f64>, x| Some(m.map_or(x, |m| m.min(x))))
            };
            let in_model = joints.iter().all(|&j| outline.joints[j].torque.is_some());
            let from_actuators = least(&|j| outline.joints[j].torque.or(outline.joints[j].actuator));
            let torque = from_actuators.unwrap_or_else(|| {
                no_torque.push(name.clone());
                (TORQUE_PER_MASS * mass).max(0.1)
            });
            let speed = least(&|j| markup.speeds.get(&outline.joints[j].name).copied()).unwrap_or_else(|| {
                no_speed.push(name.clone());
                SPEED
            });
            // A third of a radian off asks for the whole torque, unless a 2 ms step could not hold such gains.
            let inertia = least(&|j| outline.joints[j].inertia).unwrap_or(f64::INFINITY);
            let (step, share) = (0.002, 0.2);
            let round = |x: f64| format!("{x:.2e}").parse().unwrap_or(x);
            GroupFile {
                joints: joints.iter().map(|&j| known(&outline.joints[j].name)).collect(),
                name,
                torque: (!in_model).then_some(torque),
                speed,
                corner: 0.5,
                kp: round((3.0 * torque).min(share * inertia / (step * step))),
                kd: round((0.06 * torque).min(share * inertia / step)),
                pid: None,
                dead_zone: 0.0,
                play: 0.0,
                static_friction: 0.0,
                viscous_friction: 0.0,
            }
        })
        .collect();
    for (limit, groups) in [("torque", no_torque), ("speed", no_speed)] {
        if !groups.is_empty() {
            guesses.push(format!("{limit} limits, which the model lacks: groups {}", groups.join(", ")));
        }
    }
    groups
}

/// Landmarks that follow from legs and arms.
pub(crate) fn landmarks(
    outline: &Outline,
    limbs: &Limbs,
    legs: Option<&[LegRoles; 2]>,
    contacts: &[ContactFile],
) -> BTreeMap<String, PointFile> {
    let mut landmarks = BTreeMap::new();
    let mut add = |name: String, link: usize, point: [f64; 3]| {
        let link = outline.link_name(link);
        if !link.is_empty() {
            landmarks.insert(name, PointFile { link: link.to_owned(), point });
        }
    };
    if let Some(base) = outline.base {
        add("pelvis".into(), base, [0.0; 3]);
    }
    for (at, word) in ["left", "right"].into_iter().enumerate() {
        if let Some(legs) = legs {
            let roles = &legs[at];
            for (name, joint) in [("hip", roles.hip_pitch), ("knee", roles.knee), ("ankle", roles.ankle_pitch)] {
                if let Some(joint) = joint {
                    add(format!("{word}_{name}"), outline.joints[joint].link, [0.0; 3]);
                }
            }
            let front: Vec<_> =
                contacts.iter().filter(|c| c.name.starts_with(&format!("{word}_contact_front"))).collect();
            if let ([a, b], Some(foot)) = (front.as_slice(), outline_link(outline, contacts, word)) {
                let middle = [0, 1, 2].map(|i| (a.point[i] + b.point[i]) / 2.0);
                add(format!("{word}_toe_tip"), foot, middle);
                add(format!("{word}_toe_base"), foot, middle.map(|x| 0.7 * x));
            }
        }
        if let Some(chain) = limbs.arms.as_ref().map(|pair| &pair[at]) {
            let named =
                |word: &str| chain.iter().rfind(|&&j| outline.joints[j].name.to_lowercase().contains(word)).copied();
            let shoulder = named("shoulder").or(chain.first().copied());
            let wrist = named("wrist").or(chain.last().copied());
            for (name, joint) in [("shoulder", shoulder), ("elbow", named("elbow")), ("wrist", wrist)] {
                if let Some(joint) = joint {
                    add(format!("{word}_{name}"), outline.joints[joint].link, [0.0; 3]);
                }
            }
        }
    }
    landmarks
}

fn outline_link(outline: &Outline, contacts: &[ContactFile], word: &str) -> Option<usize> {
    let contact = contacts.iter().find(|contact| contact.name.starts_with(word))?;
    (0..outline.positions.len()).find(|&link| outline.link_name(link) == contact.link)
}
