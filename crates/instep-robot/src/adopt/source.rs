//! A foreign model on its way through MuJoCo's compiler, with what MuJoCo's own messages leave unsaid.

use std::path::Path;
use std::sync::Arc;

use mujoco_rs::prelude::*;
use mujoco_rs::wrappers::mj_editing::MjSpec;

use crate::RobotError;
use crate::check::markup::{self, Markup};

/// What MuJoCo reads as a mesh.
const MESHES: [&str; 3] = ["stl", "obj", "msh"];

/// A compiled model with what its text says beside.
pub(super) struct Source {
    pub(super) model: Arc<MjModel>,
    pub(super) markup: Markup,
    pub(super) notes: Vec<String>,
}

/// Reads and compiles `path`.
pub(super) fn read(path: &Path) -> Result<Source, RobotError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    if path.exists() && !matches!(extension.as_deref(), Some("xml" | "mjcf" | "urdf")) {
        return Err(RobotError::Structure {
            file: path.to_owned(),
            found: if path.is_dir() {
                "a folder".into()
            } else {
                extension.map_or("no file extension".into(), |e| format!("a file of type .{e}"))
            },
            expected: "a model: an MJCF (.xml, .mjcf) or a URDF (.urdf); a xacro file becomes one with ROS's xacro"
                .into(),
        });
    }
    let text = crate::model_file::read_model(path)?;
    let markup = markup::read(&text);
    let refused = |detail: String| RobotError::Model { file: path.to_owned(), detail };
    let mut notes = Vec::new();
    let urdf = markup.root == "robot";
    if !urdf && markup.root != "mujoco" {
        return Err(RobotError::Structure {
            file: path.to_owned(),
            found: if markup.root.is_empty() { "no markup".into() } else { format!("a <{}>", markup.root) },
            expected: "an MJCF (<mujoco>) or a URDF (<robot>)".into(),
        });
    }
    let mut spec = MjSpec::from_xml(path).map_err(|e| refused(explained(&e.to_string())))?;
    if urdf {
        spec.compiler_mut().set_fusestatic(false);
        crate::meshes::resolve(&mut spec, path);
        unreadable(&mut spec, &mut notes).map_err(refused)?;
    }
    missing(path, &spec, &markup)?;
    let model = spec.compile().map_err(|e| refused(explained(&e.to_string())))?;
    Ok(Source { model: Arc::new(model), markup, notes })
}

/// MuJoCo's message with what to do.
fn explained(message: &str) -> String {
    let does = [
        (
            "mass and inertia of moving bodies",
            "give that link an <inertial> with mass and inertia (a joint needs something to move), or fix the joint",
        ),
        (
            "inertia must satisfy",
            "its inertia is no rigid body's: mend the <inertial>, or write balanceinertia=\"true\" into the model's <compiler>",
        ),
        ("Error opening file", "put the file where the model names it"),
    ];
    match does.iter().find(|(sign, _)| message.contains(sign)) {
        Some((_, advice)) => format!("{}; {advice}", message.trim_end()),
        None => message.trim_end().to_owned(),
    }
}

/// Refuses mesh files that are not there, all at once.
fn missing(path: &Path, spec: &MjSpec, markup: &Markup) -> Result<(), RobotError> {
    let near = crate::meshes::folder_of(path);
    let folder = spec.compiler().meshdir().to_owned();
    let folder = if folder.is_empty() { markup.mesh_folder.clone().unwrap_or_default() } else { folder };
    let there = |mesh: &str| {
        mesh.is_empty()
            || Path::new(mesh).is_file()
            || near.join(&folder).join(mesh).is_file()
            || near.join(mesh).is_file()
    };
    let missing: Vec<String> =
        spec.mesh_iter().map(|mesh| mesh.file().to_owned()).filter(|mesh| !there(mesh)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let shown = missing.iter().take(3).cloned().collect::<Vec<_>>().join(", ");
    let more = if missing.len() > 3 { format!(" and {} more", missing.len() - 3) } else { String::new() };
    Err(RobotError::Structure {
        file: path.to_owned(),
        found: format!("{} mesh files that are not there: {shown}{more}", missing.len()),
        expected: format!(
            "the meshes where the model names them (looked in {}); `package://` is looked for in the model's folder and four above",
            near.join(&folder).display()
        ),
    })
}

/// Takes meshes out that MuJoCo cannot read (COLLADA, VRML), with the geoms that show them.
fn unreadable(spec: &mut MjSpec, notes: &mut Vec<String>) -> Result<(), String> {
    let reads = |file: &str| {
        file.is_empty()
            || Path::new(file).extension().is_some_and(|e| MESHES.iter().any(|known| e.eq_ignore_ascii_case(known)))
    };
    let meshes: Vec<(String, *mut _)> = spec
        .mesh_iter_mut()
        .filter(|mesh| !reads(mesh.file()))
        .map(|mesh| (mesh.name().to_owned(), std::ptr::from_mut(mesh)))
        .collect();
    if meshes.is_empty() {
        return Ok(());
    }
    let geoms: Vec<_> = spec
        .geom_iter_mut()
        .filter(|geom| meshes.iter().any(|(name, _)| geom.meshname() == name))
        .map(std::ptr::from_mut)
        .collect();
    notes.push(format!(
        "{} meshes that MuJoCo cannot read (it reads STL and OBJ) were left out with their {} shapes",
        meshes.len(),
        geoms.len()
    ));
    for geom in geoms {
        // SAFETY: each element is deleted once, before anything else is changed in the specification.
        unsafe { (*geom).delete() }.map_err(|e| e.to_string())?;
    }
    for (_, mesh) in meshes {
        // SAFETY: as above.
        unsafe { (*mesh).delete() }.map_err(|e| e.to_string())?;
    }
    Ok(())
}
