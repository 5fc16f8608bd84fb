//! A bare MJCF or URDF: what of a robot is in it, and what its `robot.toml` must add.

use std::path::Path;

use mujoco_rs::prelude::*;
use mujoco_rs::wrappers::mj_editing::MjSpec;

use super::legs::{LegRoles, limbs, roles};
use super::markup::{self, Markup};
use super::outline::{JointOutline, Outline};
use super::suggest::suggest;
use super::{CheckReport, Findings, Kind};
use crate::settings::RobotFile;
use crate::{Robot, RobotError};

pub(crate) fn check(path: &Path) -> Result<CheckReport, RobotError> {
    let text = crate::model_file::read_model(path)?;
    let markup = markup::read(&text);
    let kind = if markup.root == "robot" { Kind::Urdf } else { Kind::Mjcf };
    let mut findings = Findings::default();
    let without_meshes = meshes(path, &markup, &mut findings);
    let outline = Outline::new(compile(path, kind, without_meshes)?);

    base(&outline, kind, &mut findings);
    joints(&outline, &markup, &mut findings);
    let limbs = limbs(&outline);
    feet(&outline, &limbs, &mut findings);
    let suggestion = suggest(&outline, &markup, &limbs, path);
    let toml = render(&suggestion.file, &suggestion.guesses);
    findings.missing(
        "robot.toml",
        format!("roles, limits and gains; guessed, to be looked at: {}", suggestion.guesses.join("; ")),
    );
    // The suggestion is put to the same test as a finished file.
    match Robot::resolve(&path.with_file_name("robot.toml"), path.to_owned(), suggestion.file) {
        Ok(_) => findings.found("suggested robot.toml", "resolves against this model"),
        Err(error) => findings.missing("suggested robot.toml", format!("does not resolve yet: {error}")),
    }
    let name = markup.name.unwrap_or_default();
    Ok(findings.report(kind, name, Some(toml)))
}

/// Notes mesh files; says whether any of them is missing.
fn meshes(path: &Path, markup: &Markup, findings: &mut Findings) -> bool {
    let near = crate::meshes::folder_of(path);
    let folder = markup.mesh_folder.as_ref().map_or(near.to_owned(), |mesh| near.join(mesh));
    let there = |mesh: &str| folder.join(mesh).is_file() || crate::meshes::find(near, mesh).is_some();
    let missing: Vec<&str> = markup.meshes.iter().map(String::as_str).filter(|mesh| !there(mesh)).collect();
    let named = markup.meshes.len();
    if named > 0 {
        findings.found("meshes", format!("{named} files named, {} there", named - missing.len()));
    }
    if !missing.is_empty() {
        let shown = missing.iter().take(5).copied().collect::<Vec<_>>().join(", ");
        let more = if missing.len() > 5 { format!(" and {} more", missing.len() - 5) } else { String::new() };
        findings.missing("mesh files", format!("not near {}: {shown}{more}", folder.display()));
    }
    !missing.is_empty()
}

/// Compiles the model as it is; without its mesh geoms where mesh files are missing.
fn compile(path: &Path, kind: Kind, without_meshes: bool) -> Result<MjModel, RobotError> {
    let refused = |detail: String| RobotError::Model { file: path.to_owned(), detail };
    let mut spec = MjSpec::from_xml(path).map_err(|e| refused(e.to_string()))?;
    if kind == Kind::Urdf {
        spec.compiler_mut().set_fusestatic(false);
        crate::meshes::resolve(&mut spec, path);
    }
    if without_meshes {
        let geoms: Vec<_> = spec
            .geom_iter_mut()
            .filter(|geom| geom.type_() == MjtGeomBase::mjGEOM_MESH)
            .map(std::ptr::from_mut)
            .collect();
        for geom in geoms {
            // SAFETY: each element is deleted once, before anything else is changed in the specification.
            unsafe { (*geom).delete() }.map_err(|e| refused(e.to_string()))?;
        }
        let meshes: Vec<_> = spec.mesh_iter_mut().map(std::ptr::from_mut).collect();
        for mesh in meshes {
            // SAFETY: as above.
            unsafe { (*mesh).delete() }.map_err(|e| refused(e.to_string()))?;
        }
    }
    spec.compile().map_err(|e| refused(e.to_string()))
}

fn base(outline: &Outline, kind: Kind, findings: &mut Findings) {
    findings.found("mass", format!("{:.3} kg in all", outline.model.totalmass()));
    findings.found("links", format!("{}", outline.links()));
    let name = outline.base.map_or("", |base| outline.link_name(base));
    match (kind, outline.free) {
        (_, true) => findings.found("free joint", format!("on \"{name}\"")),
        (Kind::Urdf, false) => {
            findings.found("free joint", format!("a URDF has none; the root link \"{name}\" will get one"));
        }
        (_, false) => findings.missing("free joint", "the first joint must be a <freejoint/> in the base link"),
    }
    if name.is_empty() {
        findings.missing("base link", "it has no name, so that base.link cannot name it");
    }
}

fn joints(outline: &Outline, markup: &Markup, findings: &mut Findings) {
    // Names, or how many when it is all of them.
    let listed = |joints: &[&JointOutline]| {
        if joints.len() == outline.joints.len() && joints.len() > 3 {
            return format!("all {} joints", joints.len());
        }
        joints.iter().map(|j| format!("\"{}\"", j.name)).collect::<Vec<_>>().join(", ")
    };
    let (hinges, others): (Vec<_>, Vec<_>) = outline.joints.iter().partition(|joint| joint.kind == "hinge");
    findings.found("joints", format!("{} hinges", hinges.len()));
    for joint in &hinges {
        let range = joint.range.map_or("no range".into(), |[a, b]| format!("{a:.3} to {b:.3} rad"));
        let torque = match (joint.torque, joint.actuator) {
            (Some(torque), _) => format!("{torque} N m"),
            (None, Some(torque)) => format!("{torque} N m (its actuator's)"),
            (None, None) => "no torque limit".into(),
        };
        let speed = markup.speeds.get(&joint.name).map_or("no speed limit".into(), |speed| format!("{speed} rad/s"));
        findings.found("joint", format!("\"{}\": {range}, {torque}, {speed}", joint.name));
    }
    for joint in others {
        findings.missing(
            "hinge",
            format!("joint \"{}\" is a {} joint; robots here have hinges only", joint.name, joint.kind),
        );
    }
    let unnamed = outline.joints.iter().filter(|joint| joint.name.is_empty()).count();
    if unnamed > 0 {
        findings.missing("joint names", format!("{unnamed} joints have no name; robot.toml names every joint"));
    }
    let named: Vec<_> = hinges.iter().filter(|joint| !joint.name.is_empty()).copied().collect();
    let without = |test: &dyn Fn(&JointOutline) -> bool| named.iter().filter(|j| test(j)).copied().collect::<Vec<_>>();
    let no_range = without(&|joint| joint.range.is_none());
    if !no_range.is_empty() {
        findings.missing("range", format!("the model must limit {}", listed(&no_range)));
    }
    let no_torque = without(&|joint| joint.torque.is_none());
    if !no_torque.is_empty() {
        findings.missing("torque limit", format!("robot.toml must say group.torque for {}", listed(&no_torque)));
    }
    let no_speed = without(&|joint| !markup.speeds.contains_key(&joint.name));
    if !no_speed.is_empty() {
        findings.missing("speed limit", format!("robot.toml must say group.speed for {}", listed(&no_speed)));
    }
}

fn feet(outline: &Outline, limbs: &super::legs::Limbs, findings: &mut Findings) {
    let Some(pair) = &limbs.legs else {
        let chains: Vec<String> = outline
            .chains()
            .iter()
            .filter_map(|chain| {
                let end = outline.joints[*chain.last()?].link;
                Some(format!(
                    "\"{}\" ({} joints, lowest point {:.3} m)",
                    outline.link_name(end),
                    chain.len(),
                    outline.bounds(end)[0].z
                ))
            })
            .collect();
        findings.missing(
            "legs",
            format!("no two mirrored chains of five to seven hinges; chains end at: {}", chains.join(", ")),
        );
        return;
    };
    for (word, chain) in ["left", "right"].into_iter().zip(pair) {
        let found = roles(outline, chain);
        let named = |roles: &LegRoles| {
            roles
                .roles()
                .iter()
                .filter_map(|(role, joint)| Some(format!("{role} \"{}\"", outline.joints[(*joint)?].name)))
                .collect::<Vec<_>>()
                .join(", ")
        };
        findings.found("leg", format!("{word}: {}", named(&found)));
        let end = found.foot(chain);
        if let Some(end) = end {
            let link = outline.joints[end].link;
            let [least, greatest] = outline.bounds(link);
            let size = greatest - least;
            findings.found(
                "foot",
                format!(
                    "{word}: \"{}\", lowest point {:.3} m, {:.3} m long, {:.3} m wide",
                    outline.link_name(link),
                    least.z,
                    size.x,
                    size.y
                ),
            );
            if size.norm() == 0.0 {
                findings.missing("contact points", format!("the {word} foot has no geoms to take its sole from"));
            }
        }
        let lacking: Vec<_> = found
            .roles()
            .iter()
            .filter(|(role, joint)| joint.is_none() && *role != "toe")
            .map(|(role, _)| *role)
            .collect();
        if !lacking.is_empty() {
            findings.missing(
                "leg joints",
                format!("{word}: no {}; a leg here has six joints, or seven with a toe", lacking.join(", ")),
            );
        }
        let strikes = chain
            .iter()
            .flat_map(|&j| outline.geoms(outline.joints[j].link))
            .any(|geom| !outline.geom_name(geom).is_empty());
        if !strikes {
            findings.missing(
                "strike geoms",
                format!("{word}: no geom of the leg has a name, so that strike cannot name any"),
            );
        }
    }
}

/// The suggestion as text that reads back as the same file.
fn render(file: &RobotFile, guesses: &[String]) -> String {
    let body = toml::to_string(file).unwrap_or_default();
    let mut text = format!(
        "# A starting robot.toml for {}, made by `instep robot check`. Look at what was guessed:\n",
        file.model
    );
    for guess in guesses {
        text.push_str(&format!("# - {guess}\n"));
    }
    text + "\n" + &body
}
