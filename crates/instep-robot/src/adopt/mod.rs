//! Adopting a robot: from somebody's MJCF or URDF to a folder with which Instep works.
//!
//! The model is compiled by MuJoCo, boiled down to links and hinges ([`skeleton`]), searched for legs and arms (as `robot check` does), given
//! capsules, soles and striking edges ([`shapes`]), drives ([`drives`]), a stand ([`stand`]) and pairs of parts that must not touch
//! ([`collide`]), and written anew ([`write`]). What only its owner can know stands in `robot.toml` (some 30 lines), all that was derived in
//! `derived.toml`, over which `robot.toml` is laid.
//!
//! Not done: telling whether the world stays up in the stand, and kicking: that is for the floors above.

mod actuators;
mod collide;
mod drives;
mod file;
mod shapes;
mod skeleton;
mod source;
mod stand;
mod write;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use instep_motion::phase::Side;
use mujoco_rs::prelude::*;
use mujoco_rs::wrappers::mj_editing::MjSpec;
use nalgebra::Vector3;

use crate::check::legs::{LegRoles, limbs, roles};
use crate::check::outline::Outline;
use crate::check::suggest;
use crate::senses::CameraSettings;
use crate::settings::{BaseFile, ContactFile, GroupFile, LegFile, LegsFile, PointFile, RobotFile, SelfCollisionFile};
use crate::{Robot, RobotError};

use drives::Part;
use shapes::Capsule;
use skeleton::{Fault, Skeleton};

/// Name of the file with what was derived.
pub const DERIVED: &str = "derived.toml";
/// Name of the model in the robot's folder.
pub const MODEL: &str = "model.xml";

/// A robot that was adopted, not yet on disk.
#[derive(Debug, Clone)]
pub struct Adoption {
    /// Everything, as one `robot.toml` would say it.
    pub file: RobotFile,
    /// What a person must look at, in words.
    pub asked: Vec<String>,
    /// What was left out of the model or changed, in words.
    pub notes: Vec<String>,
    /// How many numbers and names were derived.
    pub derived: usize,
    /// Height in the model's zero pose, m.
    pub height: f64,
    /// Mass, kg.
    pub mass: f64,
    source: PathBuf,
    model: String,
    /// Joint angles from which stands are made: legs straight, arms hanging.
    rest: Vec<f64>,
}

/// Reads `model` (MJCF or URDF) and makes a robot called `name` of it.
///
/// # Errors
/// When it cannot be read, or is no humanoid that can stand on one foot: what was found, what is missing, what to do.
pub fn adopt(model: &Path, name: &str) -> Result<Adoption, RobotError> {
    let source = source::read(model)?;
    let refused = |(found, expected): Fault| RobotError::Structure { file: model.to_owned(), found, expected };
    let skeleton = Skeleton::new(&source.model, &source.markup).map_err(refused)?;
    let mut notes = source.notes;
    let (mut skeleton, turn) = oriented(skeleton, model)?;
    if turn != 0.0 {
        notes.push(format!("turned by {:.0} degrees, so that it faces along x", turn.to_degrees()));
    }
    notes.append(&mut skeleton.notes);

    let legs = [0, 1].map(|side| find_leg(&skeleton, model, side));
    let [left, right] = legs;
    let legs = [left?, right?];
    let chain_arms = arms(&skeleton, model)?;
    let mut parts: Vec<Option<Part>> =
        skeleton.links.iter().map(|link| link.hinge.as_ref().map(|_| Part::Body)).collect();
    for leg in &legs {
        for (role, link) in &leg.joints {
            parts[*link] = Some(Part::Leg(role));
        }
        for &link in &leg.others {
            parts[link] = Some(Part::Leg("leg"));
        }
    }
    for &link in chain_arms.iter().flatten() {
        parts[link] = Some(Part::Arm);
    }

    let mut asked = Vec::new();
    let mut ranges = Vec::with_capacity(skeleton.links.len());
    let mut unlimited = Vec::new();
    for (i, link) in skeleton.links.iter().enumerate() {
        let Some(hinge) = &link.hinge else {
            ranges.push([0.0; 2]);
            continue;
        };
        let range = hinge.range.filter(|[low, high]| high - low > 0.02 && high - low < 12.0).unwrap_or_else(|| {
            unlimited.push(hinge.name.clone());
            usual_range(&parts[i], hinge.axis, i, &legs)
        });
        ranges.push(range);
    }
    if !unlimited.is_empty() {
        let which = if unlimited.len() > 6 { format!("{} joints", unlimited.len()) } else { unlimited.join(", ") };
        asked.push(format!("ranges of {which}: the model has none; a humanoid's were taken (in {MODEL})"));
    }
    let had_torque: Vec<bool> =
        skeleton.links.iter().map(|link| link.hinge.as_ref().is_none_or(|hinge| hinge.torque.is_some())).collect();
    let servos = drives::servos(&skeleton);
    asked.extend(drives::fill_in(&mut skeleton, &parts, servos));
    asked.push(if servos {
        "drive kind: position servos every 8 ms, 8 ms late (light, weak motors)".into()
    } else {
        "drive kind: torque drives every 2 ms, 2 ms late".into()
    });

    for (leg, word) in legs.iter().zip(["left", "right"]) {
        if leg.toe.is_none() {
            shapes::level(&mut skeleton, leg.foot);
            let turn = skeleton.links[leg.foot].turn;
            let angle = turn[(2, 2)].clamp(-1.0, 1.0).acos().to_degrees();
            if angle > 1.0 {
                notes.push(format!("the {word} sole is {angle:.1} degrees off level with every joint at zero; the foot's axes are the sole's"));
            }
        }
    }

    let hip = |leg: &FoundLeg| skeleton.links[leg.joint("hip_pitch")].origin;
    let foot_points = skeleton.bounds(legs[0].foot).map_or(skeleton.links[legs[0].foot].origin.z, |[low, _]| low.z);
    let length = hip(&legs[0]).z - foot_points;
    let feet = [0, 1].map(|side| {
        let word = ["left", "right"][side];
        shapes::foot(&skeleton, word, legs[side].foot, legs[side].toe, length)
    });
    let [left, right] = feet;
    let feet = [left.map_err(refused)?, right.map_err(refused)?];
    let step = (feet[0].sole.z - feet[1].sole.z).abs();
    if step > 0.01 * length + 0.003 {
        return Err(refused((
            format!("soles at different heights with every joint at zero: {:.1} mm apart", 1e3 * step),
            "two legs alike, whose soles are level with each other in the zero pose".into(),
        )));
    }

    let mut capsules: Vec<Capsule> = Vec::new();
    for side in 0..2 {
        let word = ["left", "right"][side];
        let leg = &legs[side];
        capsules.extend(feet[side].strike.iter().cloned());
        let (knee, ankle) = (leg.joint("knee"), leg.joint("ankle_pitch"));
        let thigh = skeleton.links[knee].parent.unwrap_or(0);
        let (knee_at, ankle_at) = (skeleton.links[knee].origin, skeleton.links[ankle].origin);
        // The thigh may be spread over several links; its capsule goes with the last.
        let top = skeleton.links[leg.joint("hip_pitch")].origin;
        capsules.extend(thigh_capsule(&skeleton, word, thigh, top, knee_at, length));
        capsules.extend(shapes::limb(&skeleton, format!("{word}_shank"), knee, ankle_at, length));
        for &link in &chain_arms[side] {
            let part = format!("{word}_arm_{}", skeleton.links[link].name);
            let limb = skeleton
                .child(link)
                .and_then(|child| shapes::limb(&skeleton, part.clone(), link, skeleton.links[child].origin, length));
            capsules.extend(
                limb.or_else(|| shapes::body(&skeleton, part, link, length).filter(|_| skeleton.child(link).is_none())),
            );
        }
    }
    for (link, part) in parts.iter().enumerate() {
        if matches!(part, None | Some(Part::Body)) {
            capsules.extend(shapes::body(&skeleton, format!("body_{}", skeleton.links[link].name), link, length));
        }
    }
    let file_name = model.file_name().unwrap_or_default().to_string_lossy();
    let head = format!(
        "{name}, adopted by Instep from {file_name}: links, hinges and masses are the model's, capsules stand for its shapes."
    );
    let text = write::mjcf(name, &head, &skeleton, &ranges, &capsules);
    let compiled = Arc::new(compile(model, &text)?);

    let group = drives::groups(&compiled, &skeleton, &parts, length, servos);
    let mut contact = Vec::new();
    for (side, foot) in [Side::Left, Side::Right].into_iter().zip(&feet) {
        for (name, link, at) in &foot.contacts {
            contact.push(ContactFile {
                name: name.clone(),
                leg: side,
                link: skeleton.links[*link].name.clone(),
                point: rounded(at - skeleton.links[*link].origin),
                radius: shapes::contact_radius(),
            });
        }
    }
    let leg = [0, 1].map(|side| leg_file(&skeleton, &legs[side], &feet[side], &capsules, ["left", "right"][side]));
    let [left, right] = leg;
    let camera = camera(&skeleton, &mut notes);
    let outline = Outline::new((*compiled).clone());
    let found = limbs(&outline);
    let sides = found.legs.as_ref().map(|pair| [0, 1].map(|side| roles(&outline, &pair[side])));
    let mut landmark = suggest::landmarks(&outline, &found, sides.as_ref(), &contact);
    torso_landmarks(&skeleton, &chain_arms, &mut landmark);
    let height = skeleton.links.iter().flat_map(|link| &link.points).map(|p| p.z).fold(f64::NEG_INFINITY, f64::max)
        - feet[0].sole.z.min(feet[1].sole.z);
    let mass = skeleton.mass();
    let joints = skeleton.links.len() - 1;
    let mut file = RobotFile {
        name: name.to_owned(),
        title: format!("{name}, {joints} joints, {height:.2} m, {mass:.1} kg (adopted from {file_name})"),
        model: MODEL.to_owned(),
        engine: None,
        base: BaseFile {
            link: skeleton.links[0].name.clone(),
            imu: skeleton.imu.map_or([0.0; 3], |imu| rounded(imu - skeleton.links[0].origin)),
        },
        drives: drives::settings(servos),
        senses: crate::senses::SenseSettings { camera, ..drives::senses(servos) },
        group,
        stand: BTreeMap::new(),
        leg: LegsFile { left, right },
        contact,
        self_collision: SelfCollisionFile::default(),
        landmark,
    };
    if skeleton.imu.is_none() {
        asked.push(format!(
            "inertial sensor: none in the base of the model; taken to sit in the origin of \"{}\"",
            file.base.link
        ));
    }

    // With a robot in hand: where the arms hang, and what can touch what.
    let robot = Robot::resolve_text(Path::new("robot.toml"), &text, file.clone())?;
    let geoms: Vec<usize> =
        capsules.iter().filter_map(|capsule| robot.model().name_to_id(MjtObjBase::mjOBJ_GEOM, &capsule.name)).collect();
    let mut rest: Vec<f64> = robot
        .joints
        .iter()
        .map(|joint| {
            let [low, high] = joint.range;
            let key = skeleton.link_of(&joint.name).and_then(|link| {
                matches!(parts[link], Some(Part::Arm)).then(|| skeleton.links[link].hinge.as_ref()?.key).flatten()
            });
            let room = 0.02_f64.min(0.25 * (high - low));
            key.unwrap_or(0.0).clamp(low + room, high - room)
        })
        .collect();
    let gap = 0.014 * length;
    let zero = rest.clone();
    let all = collide::Pairs::candidates(robot.model(), &geoms);
    let keyed = skeleton.links.iter().zip(&parts).any(|(link, part)| {
        matches!(part, Some(Part::Arm))
            && link.hinge.as_ref().is_some_and(|hinge| hinge.key.is_some_and(|key| key != 0.0))
    });
    if !keyed {
        let arms = chain_arms.clone().map(|arm| {
            arm.iter()
                .filter_map(|&link| robot.joint_index(&skeleton.links[link].hinge.as_ref()?.name))
                .collect::<Vec<_>>()
        });
        let near = collide::Pairs::candidates(robot.model(), &geoms).touching(&robot, &zero, 0.0);
        // Room for a thigh that swings aside.
        stand::hang_arms(&robot, &arms, &near, 0.08 * length, &mut rest);
    }
    let bent = (1..=8).find_map(|i| stand::stand(&robot, &rest, 0.1 * f64::from(i))).unwrap_or_else(|| rest.clone());
    let pairs = all.touching(&robot, &bent, gap);
    let geom_name = |geom: usize| robot.model().id_to_name(MjtObjBase::mjOBJ_GEOM, geom).unwrap_or_default().to_owned();
    file.self_collision = SelfCollisionFile { pairs: pairs.pairs.iter().map(|pair| pair.map(geom_name)).collect() };

    if !had_torque.iter().all(|had| *had) {
        notes.push("torque limits that the model lacks are guesses: see robot.toml".into());
    }
    asked.push("the ball that it plays (ball.toml)".into());
    let derived = count(&file);
    Ok(Adoption { file, asked, notes, derived, height, mass, source: model.to_owned(), model: text, rest })
}

impl Adoption {
    /// Bends the knees by `bend` (rad) in the stand; says whether there is such a pose.
    ///
    /// # Errors
    /// When the robot does not resolve, which would be a fault of this module.
    pub fn bend_knees(&mut self, bend: f64) -> Result<bool, RobotError> {
        let robot = Robot::resolve_text(Path::new("robot.toml"), &self.model, self.file.clone())?;
        let Some(q) = stand::stand(&robot, &self.rest, bend) else { return Ok(false) };
        let angles = robot.joints.iter().zip(&q).filter(|(_, angle)| angle.abs() > 1e-6);
        self.file.stand = angles.map(|(joint, angle)| (joint.name.clone(), (angle * 1e6).round() / 1e6)).collect();
        Ok(true)
    }

    /// Writes model, `robot.toml` and `derived.toml` into `folder`, which must be there.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), RobotError> {
        let source = self.source.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let files = [
            (MODEL, self.model.clone()),
            (DERIVED, file::derived(&self.file, &self.notes, &source)),
            ("robot.toml", file::asked(&self.file, &self.asked, &source)),
        ];
        for (name, text) in files {
            let file = folder.join(name);
            std::fs::write(&file, text).map_err(|source| RobotError::Write { file, source })?;
        }
        Ok(())
    }
}

/// One leg as it was found.
#[derive(Debug, Clone)]
struct FoundLeg {
    /// Role and the link that its joint moves, from hip to toe.
    joints: Vec<(&'static str, usize)>,
    /// Links of joints of the leg without a role.
    others: Vec<usize>,
    /// Link with the sole.
    foot: usize,
    toe: Option<usize>,
}

impl FoundLeg {
    fn joint(&self, role: &str) -> usize {
        self.joints.iter().find(|(known, _)| *known == role).map_or(0, |(_, link)| *link)
    }

    fn has(&self, role: &str) -> Option<usize> {
        self.joints.iter().find(|(known, _)| *known == role).map(|(_, link)| *link)
    }
}

fn compile(file: &Path, text: &str) -> Result<MjModel, RobotError> {
    let refused = |detail: String| RobotError::Model { file: file.to_owned(), detail };
    let mut spec = MjSpec::from_xml_string(text).map_err(|e| refused(e.to_string()))?;
    spec.compile().map_err(|e| refused(e.to_string()))
}

/// The skeleton as MuJoCo sees it, for the search of limbs.
fn outline(skeleton: &Skeleton, file: &Path) -> Result<Outline, RobotError> {
    let ranges: Vec<[f64; 2]> =
        skeleton.links.iter().map(|link| link.hinge.as_ref().and_then(|h| h.range).unwrap_or([-1.0, 1.0])).collect();
    Ok(Outline::new(compile(file, &write::mjcf("limbs", "", skeleton, &ranges, &[]))?))
}

/// Turned so that it faces along x, and by how much, rad.
fn oriented(skeleton: Skeleton, file: &Path) -> Result<(Skeleton, f64), RobotError> {
    let mut best: Option<(f64, Skeleton, f64)> = None;
    for quarter in [0, 1, 3, 2] {
        let angle = f64::from(quarter) * std::f64::consts::FRAC_PI_2;
        let turned = if quarter == 0 { skeleton.clone() } else { skeleton.clone().turned(angle) };
        let outline = outline(&turned, file)?;
        let Some(pair) = limbs(&outline).legs else { continue };
        // How far the feet reach ahead of their ankles; without a foot to see, how well sides and names agree.
        let ahead: f64 = pair
            .iter()
            .filter_map(|chain| {
                let link = turned.link_of(&outline.joints[*chain.last()?].name)?;
                let [low, high] = turned.bounds(link)?;
                Some((0.5 * (low.x + high.x) - turned.links[link].origin.x) / (high.x - low.x).max(0.01))
            })
            .sum();
        let names: f64 = pair
            .iter()
            .enumerate()
            .filter_map(|(side, chain)| {
                let name = outline.joints[*chain.last()?].name.to_lowercase();
                let is = |word: &str, letter: &str| name.contains(word) || name.starts_with(letter);
                let (left, right) = (is("left", "l_"), is("right", "r_"));
                Some(f64::from(i8::from(left) - i8::from(right)) * if side == 0 { 0.5 } else { -0.5 })
            })
            .sum();
        let score = ahead + names;
        if best.as_ref().is_none_or(|(known, ..)| score > known + 0.1) {
            best = Some((score, turned, angle));
        }
    }
    match best {
        Some((_, skeleton, angle)) => {
            diagnose(&skeleton, file, true)?;
            Ok((skeleton, angle))
        }
        None => {
            diagnose(&skeleton, file, false)?;
            Err(RobotError::Structure {
                file: file.to_owned(),
                found: format!("no two mirrored chains of five to seven hinges; {}", chains_in_words(&skeleton)),
                expected: "two legs, mirror images of one another, each of hip yaw, roll and pitch, knee, ankle pitch and, as a rule, roll".into(),
            })
        }
    }
}

/// What stands on the ground in the zero pose: links that no other hangs on, by their lowest point.
fn standing_ends(skeleton: &Skeleton) -> Vec<(usize, f64)> {
    let ends = (1..skeleton.links.len()).filter(|&link| skeleton.child(link).is_none());
    let low = |link: usize| skeleton.bounds(link).map_or(skeleton.links[link].origin.z, |[low, _]| low.z);
    // What ends above the base's own joint is a head or a raised arm.
    let base = skeleton.links[0].origin.z;
    let ends: Vec<(usize, f64)> = ends.map(|link| (link, low(link))).filter(|(_, z)| *z < base).collect();
    let ground = ends.iter().map(|(_, z)| *z).fold(f64::INFINITY, f64::min);
    let top = skeleton.links.iter().map(|link| link.origin.z).fold(f64::NEG_INFINITY, f64::max);
    let mut ends: Vec<(usize, f64)> =
        ends.into_iter().filter(|(_, z)| *z < ground + 0.08 * (top - ground).max(1e-3)).collect();
    ends.sort_by(|a, b| a.1.total_cmp(&b.1));
    ends
}

fn hinges_to(skeleton: &Skeleton, mut link: usize) -> usize {
    let mut count = 0;
    while let Some(parent) = skeleton.links[link].parent {
        count += 1;
        link = parent;
    }
    count
}

fn chains_in_words(skeleton: &Skeleton) -> String {
    let ends = (1..skeleton.links.len()).filter(|&link| skeleton.child(link).is_none());
    let words: Vec<String> =
        ends.map(|link| format!("\"{}\" ({} hinges)", skeleton.links[link].name, hinges_to(skeleton, link))).collect();
    if words.is_empty() { "it has no hinges".into() } else { format!("its chains end at {}", words.join(", ")) }
}

/// Refuses what has another number of legs than two, or wheels.
fn diagnose(skeleton: &Skeleton, file: &Path, legs_found: bool) -> Result<(), RobotError> {
    let refused = |found: String, expected: &str| {
        Err(RobotError::Structure { file: file.to_owned(), found, expected: expected.to_owned() })
    };
    let ends = standing_ends(skeleton);
    let named =
        || ends.iter().map(|(link, _)| format!("\"{}\"", skeleton.links[*link].name)).collect::<Vec<_>>().join(", ");
    let wheels: Vec<&str> = ends
        .iter()
        .filter(|(link, _)| {
            let link = &skeleton.links[*link];
            let free = link.hinge.as_ref().is_some_and(|hinge| {
                hinge.range.is_none_or(|[low, high]| high - low > 6.5) && hinge.axis.z.abs() < 0.7
            });
            // Round about its hinge: as high as long, with the hinge in the middle.
            let round = skeleton.bounds(ends_link(skeleton, &link.name)).is_some_and(|[low, high]| {
                let (size, middle) = (high - low, 0.5 * (low + high));
                let across = size.x.max(size.y);
                (size.z - across).abs() < 0.15 * size.z && (middle.z - link.origin.z).abs() < 0.15 * size.z
            });
            free && round
        })
        .map(|(link, _)| skeleton.links[*link].name.as_str())
        .collect();
    if !wheels.is_empty() {
        return refused(
            format!("wheels: {} turn without limit where the robot stands", wheels.join(", ")),
            "a robot with two legs that end in feet",
        );
    }
    match ends.len() {
        0 => refused(
            format!("no legs: {}", chains_in_words(skeleton)),
            "a robot with two legs, each of five to seven hinges",
        ),
        1 => refused(
            format!("one leg alone: it stands on {}; {}", named(), chains_in_words(skeleton)),
            "two legs, mirror images of one another, each of five to seven hinges",
        ),
        2 if legs_found => Ok(()),
        2 => {
            let short: Vec<String> = ends
                .iter()
                .map(|(link, _)| format!("\"{}\" ({} hinges)", skeleton.links[*link].name, hinges_to(skeleton, *link)))
                .collect();
            refused(
                format!("no legs that could kick: it stands on {}; {}", short.join(" and "), chains_in_words(skeleton)),
                "two legs, mirror images of one another, each of five to seven hinges (hip yaw, roll and pitch, knee, ankle pitch and, as a rule, roll)",
            )
        }
        n => refused(
            format!("{n} legs: it stands on {}", named()),
            "a robot with two legs; arms must not reach the ground in the zero pose",
        ),
    }
}

fn ends_link(skeleton: &Skeleton, name: &str) -> usize {
    skeleton.links.iter().position(|link| link.name == name).unwrap_or(0)
}

/// The leg on `side`: 0 is left.
fn find_leg(skeleton: &Skeleton, file: &Path, side: usize) -> Result<FoundLeg, RobotError> {
    let word = ["left", "right"][side];
    let refused = |found: String, expected: &str| RobotError::Structure {
        file: file.to_owned(),
        found,
        expected: expected.to_owned(),
    };
    let outline = outline(skeleton, file)?;
    let chain = limbs(&outline).legs.map(|pair| pair[side].clone()).unwrap_or_default();
    let found: LegRoles = roles(&outline, &chain);
    let link = |joint: usize| skeleton.link_of(&outline.joints[joint].name).unwrap_or(0);
    let joints: Vec<(&'static str, usize)> =
        found.roles().into_iter().filter_map(|(role, joint)| Some((role, link(joint?)))).collect();
    let lacking: Vec<&str> = found
        .roles()
        .into_iter()
        .filter(|(role, joint)| joint.is_none() && !matches!(*role, "toe" | "ankle_roll"))
        .map(|(role, _)| role)
        .collect();
    if !lacking.is_empty() {
        let names: Vec<String> = chain.iter().map(|&joint| format!("\"{}\"", outline.joints[joint].name)).collect();
        return Err(refused(
            format!("the {word} leg has no {} (its joints: {})", lacking.join(", no "), names.join(", ")),
            "hip yaw, roll and pitch, knee and ankle pitch in each leg; axes are read with every joint at zero, along x, y or z",
        ));
    }
    let foot = found.foot(&chain).map(link).ok_or_else(|| refused(format!("the {word} leg has no foot"), "a foot"))?;
    let others =
        chain.iter().map(|&joint| link(joint)).filter(|at| !joints.iter().any(|(_, known)| known == at)).collect();
    Ok(FoundLeg { toe: found.toe.map(link), joints, others, foot })
}

/// Links of both arms from the shoulder, left first; empty where there are none.
fn arms(skeleton: &Skeleton, file: &Path) -> Result<[Vec<usize>; 2], RobotError> {
    let outline = outline(skeleton, file)?;
    let chains = limbs(&outline).arms.unwrap_or_default();
    Ok(chains.map(|chain| chain.iter().filter_map(|&joint| skeleton.link_of(&outline.joints[joint].name)).collect()))
}

/// A humanoid's range of a joint whose model has none, rad.
fn usual_range(part: &Option<Part>, axis: Vector3<f64>, link: usize, legs: &[FoundLeg; 2]) -> [f64; 2] {
    let signed = |[low, high]: [f64; 2], sign: f64| if sign >= 0.0 { [low, high] } else { [-high, -low] };
    match part {
        Some(Part::Leg("knee")) => signed([0.0, 2.3], axis.y),
        Some(Part::Leg("hip_pitch")) => signed([-1.7, 0.8], axis.y),
        Some(Part::Leg("ankle_pitch")) => signed([-1.0, 0.8], axis.y),
        Some(Part::Leg("hip_roll" | "ankle_roll")) => {
            let left = legs[0].joints.iter().any(|(_, known)| *known == link);
            signed(if left { [-0.5, 0.7] } else { [-0.7, 0.5] }, axis.x)
        }
        Some(Part::Leg(_)) => [-0.8, 0.8],
        _ => [-1.5, 1.5],
    }
}

/// The thigh's capsule, on the link before the knee.
fn thigh_capsule(
    skeleton: &Skeleton,
    word: &str,
    thigh: usize,
    top: Vector3<f64>,
    knee: Vector3<f64>,
    leg: f64,
) -> Option<Capsule> {
    let mut lent = skeleton.clone();
    lent.links[thigh].origin = top;
    shapes::limb(&lent, format!("{word}_thigh"), thigh, knee, leg)
}

fn leg_file(
    skeleton: &Skeleton,
    leg: &FoundLeg,
    foot: &shapes::FootShape,
    capsules: &[Capsule],
    word: &str,
) -> LegFile {
    let joint = |role: &str| {
        skeleton.links[leg.joint(role)].hinge.as_ref().map_or_else(String::new, |hinge| hinge.name.clone())
    };
    let optional = |role: &str| leg.has(role).map(|_| joint(role));
    let link = |at: usize| skeleton.links[at].name.clone();
    let knee = leg.joint("knee");
    let shank = format!("{word}_shank");
    let mut strike: Vec<String> = foot.strike.iter().map(|capsule| capsule.name.clone()).collect();
    strike.extend(capsules.iter().any(|capsule| capsule.name == shank).then_some(shank));
    LegFile {
        hip_yaw: joint("hip_yaw"),
        hip_roll: joint("hip_roll"),
        hip_pitch: joint("hip_pitch"),
        knee: joint("knee"),
        ankle_pitch: joint("ankle_pitch"),
        ankle_roll: optional("ankle_roll"),
        toe: optional("toe"),
        thigh: link(skeleton.links[knee].parent.unwrap_or(0)),
        shank: link(knee),
        foot: link(leg.foot),
        toe_link: leg.toe.map(link),
        sole: rounded(foot.sole - skeleton.links[leg.foot].origin),
        strike,
    }
}

/// The camera that looks ahead, highest of those that do.
fn camera(skeleton: &Skeleton, notes: &mut Vec<String>) -> Option<CameraSettings> {
    let sees =
        |name: &str| !["track", "follow", "back", "rear", "side"].iter().any(|word| name.to_lowercase().contains(word));
    let best = skeleton
        .cameras
        .iter()
        .filter(|camera| sees(&camera.name) && camera.forward.x > 0.5)
        .max_by(|a, b| a.position.z.total_cmp(&b.position.z))?;
    notes.push(format!("camera: \"{}\" of the model, with a picture a third wider than high", best.name));
    let height = best.height.clamp(0.1, 2.5);
    let width = 2.0 * ((0.5 * height).tan() * 4.0 / 3.0).atan();
    let text = format!(
        "link = {:?}\nposition = {:?}\npitch = {:.6}\nfield_of_view = [{width:.6}, {height:.6}]\n",
        skeleton.links[best.link].name,
        rounded(best.position - skeleton.links[best.link].origin),
        (-best.forward.z).clamp(-1.0, 1.0).asin(),
    );
    toml::from_str(&text).ok()
}

/// Chest and head, which no leg tells of.
fn torso_landmarks(skeleton: &Skeleton, arms: &[Vec<usize>; 2], landmarks: &mut BTreeMap<String, PointFile>) {
    let shoulders: Vec<usize> = arms.iter().filter_map(|arm| arm.first().copied()).collect();
    if let [left, right] = shoulders.as_slice() {
        let torso = skeleton.links[*left].parent.unwrap_or(0);
        let middle = 0.5 * (skeleton.links[*left].origin + skeleton.links[*right].origin);
        let point = rounded(middle - skeleton.links[torso].origin);
        landmarks.insert("chest".into(), PointFile { link: skeleton.links[torso].name.clone(), point });
    }
}

/// A point in tenths of a micrometre.
fn rounded(v: Vector3<f64>) -> [f64; 3] {
    let round = |x: f64| {
        let x = (x * 1e6).round() / 1e6;
        if x == 0.0 { 0.0 } else { x }
    };
    v.map(round).into()
}

/// Numbers and names in a file.
fn count(file: &RobotFile) -> usize {
    fn leaves(value: &toml::Value) -> usize {
        match value {
            toml::Value::Array(items) => items.iter().map(leaves).sum(),
            toml::Value::Table(table) => table.values().map(leaves).sum(),
            _ => 1,
        }
    }
    toml::Value::try_from(file).map_or(0, |value| leaves(&value))
}

/// Group settings that a person must look at.
fn asked_of(group: &GroupFile) -> (&str, Option<f64>, f64) {
    (&group.name, group.torque, group.speed)
}
