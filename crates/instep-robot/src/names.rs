//! Names of `robot.toml` looked up in the compiled model: what does not exist is met with the nearest name that does.

use std::path::Path;

use mujoco_rs::prelude::*;

use crate::RobotError;
use crate::drive::{DriveKind, DriveSettings, Pid};
use crate::robot::Joint;
use crate::settings::RobotFile;

/// Looks up names in the compiled model and says which field named something that is not there.
pub(crate) struct Names<'a> {
    pub(crate) file: &'a Path,
    pub(crate) model: &'a MjModel,
}

impl Names<'_> {
    pub(crate) fn wrong(&self, field: &str, found: String, expected: String) -> RobotError {
        RobotError::Field { file: self.file.to_owned(), field: field.to_owned(), found, expected }
    }

    fn find(&self, kind: MjtObjBase, what: &str, field: &str, name: &str) -> Result<usize, RobotError> {
        self.model.name_to_id(kind, name).ok_or_else(|| {
            let count = match kind {
                MjtObjBase::mjOBJ_BODY => self.model.ffi().nbody,
                _ => self.model.ffi().ngeom,
            };
            let known = (0..usize::try_from(count).unwrap_or(0)).filter_map(|i| self.model.id_to_name(kind, i));
            self.wrong(field, format!("\"{name}\""), expected_name(what, name, known))
        })
    }

    pub(crate) fn link(&self, field: &str, name: &str) -> Result<usize, RobotError> {
        self.find(MjtObjBase::mjOBJ_BODY, "link", field, name)
    }

    pub(crate) fn geom(&self, field: &str, name: &str) -> Result<usize, RobotError> {
        self.find(MjtObjBase::mjOBJ_GEOM, "geom", field, name)
    }
}

/// "a link of the model; the nearest is "left_foot"".
fn expected_name<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> String {
    let nearest = known.filter(|k| !k.is_empty() && *k != "world").min_by_key(|k| edit_distance(k, name));
    match nearest {
        Some(nearest) => format!("a {what} of the model; the nearest is \"{nearest}\""),
        None => format!("a {what} of the model, which names none"),
    }
}

/// Levenshtein's distance, to suggest the name that was probably meant.
fn edit_distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.chars().count()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.chars().enumerate() {
            let substituted = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[row.len() - 1]
}

pub(crate) fn joint_index(names: &Names<'_>, joints: &[Joint], field: &str, name: &str) -> Result<usize, RobotError> {
    joints.iter().position(|joint| joint.name == name).ok_or_else(|| {
        let known = joints.iter().map(|joint| joint.name.as_str());
        names.wrong(field, format!("\"{name}\""), expected_name("joint", name, known))
    })
}

/// The model's joints with the limits and gains of their groups.
pub(crate) fn joints(
    names: &Names<'_>,
    model_file: &Path,
    settings: &RobotFile,
) -> Result<(Vec<Joint>, Vec<String>), RobotError> {
    let model = names.model;
    let structure = |found: String, expected: &str| RobotError::Structure {
        file: model_file.to_owned(),
        found,
        expected: expected.to_owned(),
    };
    let types = model.jnt_type();
    let name_of = |i: usize| model.id_to_name(MjtObjBase::mjOBJ_JOINT, i).unwrap_or_default().to_owned();
    if types.first() != Some(&MjtJoint::mjJNT_FREE) {
        return Err(structure(
            "the model has no free joint at its root".into(),
            "one <freejoint/> in the base link, as the first joint",
        ));
    }
    let mut joints = Vec::with_capacity(types.len() - 1);
    for (i, kind) in types.iter().enumerate().skip(1) {
        let name = name_of(i);
        if *kind != MjtJoint::mjJNT_HINGE {
            return Err(structure(format!("joint \"{name}\" is no hinge"), "one free joint, then hinges only"));
        }
        if name.is_empty() {
            return Err(structure(format!("joint {i} has no name"), "a name for every joint"));
        }
        if !model.jnt_limited()[i] {
            return Err(structure(format!("joint \"{name}\" has no range"), "a range (MJCF) or a limit (URDF)"));
        }
        joints.push(Joint {
            name,
            group: usize::MAX,
            range: model.jnt_range()[i],
            torque: if model.jnt_actfrclimited()[i] { model.jnt_actfrcrange()[i][1] } else { 0.0 },
            speed: 0.0,
            corner: 0.0,
            kp: 0.0,
            kd: 0.0,
            pid: Pid::default(),
            dead_zone: 0.0,
            play: 0.0,
            static_friction: 0.0,
            viscous_friction: 0.0,
        });
    }
    for (g, group) in settings.group.iter().enumerate() {
        let positive = |part: &str, value: f64, unit: &str| {
            if value > 0.0 && value.is_finite() {
                Ok(value)
            } else {
                Err(names.wrong(&format!("group[{g}].{part}"), value.to_string(), format!("a number above 0 {unit}")))
            }
        };
        let not_negative = |part: &str, value: f64, most: f64, unit: &str| {
            if (0.0..=most).contains(&value) {
                return Ok(value);
            }
            let most = if most.is_finite() { format!("in [0, {most}]") } else { "of at least 0".into() };
            Err(names.wrong(&format!("group[{g}].{part}"), value.to_string(), format!("a number {most} {unit}")))
        };
        if !(0.0..1.0).contains(&group.corner) {
            let field = format!("group[{g}].corner");
            return Err(names.wrong(&field, group.corner.to_string(), "a share in [0, 1)".into()));
        }
        for name in &group.joints {
            let field = format!("group[{g}].joints");
            let index = joint_index(names, &joints, &field, name)?;
            let joint = &mut joints[index];
            if joint.group != usize::MAX {
                let other = &settings.group[joint.group].name;
                return Err(names.wrong(
                    &field,
                    format!("\"{name}\" again (it is in \"{other}\")"),
                    "one group".into(),
                ));
            }
            joint.group = g;
            joint.speed = positive("speed", group.speed, "rad/s")?;
            joint.corner = group.corner;
            joint.kp = positive("kp", group.kp, "N m/rad")?;
            joint.kd = positive("kd", group.kd, "N m s/rad")?;
            joint.pid = group.pid.unwrap_or(Pid { p: group.kp, i: 0.0, d: 0.0 });
            positive("pid.p", joint.pid.p, "N m/rad")?;
            not_negative("pid.i", joint.pid.i, f64::INFINITY, "N m/(rad s)")?;
            not_negative("pid.d", joint.pid.d, f64::INFINITY, "N m s/rad")?;
            let range = joint.range[1] - joint.range[0];
            joint.dead_zone = not_negative("dead_zone", group.dead_zone, range, "rad, within the joint's range")?;
            joint.play = not_negative("play", group.play, range, "rad, within the joint's range")?;
            joint.viscous_friction =
                not_negative("viscous_friction", group.viscous_friction, f64::INFINITY, "N m s/rad")?;
            if let Some(torque) = group.torque {
                joint.torque = positive("torque", torque, "N m")?;
            }
            if joint.torque <= 0.0 {
                let field = format!("group[{g}].torque");
                return Err(names.wrong(&field, format!("none, and the model has none for \"{name}\""), "N m".into()));
            }
            // The largest error that there can be must bring the whole torque, or the limit is one that the servo never reaches.
            if settings.drives.kind == DriveKind::PositionServo && joint.pid.p * range < joint.torque {
                let (most, limit) = (joint.pid.p * range, joint.torque);
                let found =
                    format!("{}, which gives {most:.3} N m over the range of \"{name}\", {range:.3} rad", joint.pid.p);
                return Err(names.wrong(
                    &format!("group[{g}].pid.p"),
                    found,
                    format!("{:.3} N m/rad or more, for its torque limit of {limit} N m", limit / range),
                ));
            }
            joint.static_friction =
                not_negative("static_friction", group.static_friction, joint.torque, "N m, at most the torque")?;
        }
    }
    if let Some(joint) = joints.iter().find(|joint| joint.group == usize::MAX) {
        return Err(names.wrong(
            "group",
            format!("joint \"{}\" is in no group", joint.name),
            "every joint in one".into(),
        ));
    }
    Ok((joints, settings.group.iter().map(|group| group.name.clone()).collect()))
}

/// Pairs of geoms, capsules or spheres.
pub(crate) fn self_collision(names: &Names<'_>, settings: &RobotFile) -> Result<Vec<[usize; 2]>, RobotError> {
    let mut pairs = Vec::with_capacity(settings.self_collision.pairs.len());
    for (i, [first, second]) in settings.self_collision.pairs.iter().enumerate() {
        let field = format!("self_collision.pairs[{i}]");
        let pair = [names.geom(&field, first)?, names.geom(&field, second)?];
        for geom in pair {
            let kind = names.model.geom_type()[geom];
            if !matches!(kind, MjtGeomBase::mjGEOM_CAPSULE | MjtGeomBase::mjGEOM_SPHERE) {
                return Err(names.wrong(&field, format!("a geom of type {kind:?}"), "capsules or spheres".into()));
            }
        }
        pairs.push(pair);
    }
    Ok(pairs)
}

/// What a robot's drives share, checked.
pub(crate) fn drives(names: &Names<'_>, drives: &DriveSettings) -> Result<DriveSettings, RobotError> {
    for (part, value, good, expected) in [
        ("period", drives.period, (0.0001..=0.1).contains(&drives.period), "a cycle of 0.0001 to 0.1 s"),
        ("delay", drives.delay, (0.0..=0.2).contains(&drives.delay), "a delay of 0 to 0.2 s"),
        ("sag", drives.sag, (0.0..=0.9).contains(&drives.sag), "a share in [0, 0.9]"),
    ] {
        if !good {
            return Err(names.wrong(&format!("drives.{part}"), value.to_string(), expected.into()));
        }
    }
    Ok(*drives)
}
