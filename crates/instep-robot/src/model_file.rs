//! The model file on its way into MuJoCo: read, found sane, and made a robot (free joint, no actuators, contact spheres).

use std::path::Path;

use mujoco_rs::prelude::*;
use mujoco_rs::wrappers::mj_editing::{MjSpec, SpecItem};

use crate::RobotError;
use crate::settings::RobotFile;

/// Reads a model's text. MuJoCo reads the file itself; this says what is wrong where MuJoCo or its bindings would not:
/// a missing file, bytes that are no text, and NaN or infinity, which MuJoCo lets pass.
pub(crate) fn read_model(file: &Path) -> Result<String, RobotError> {
    crate::warnings::silence();
    let bytes = std::fs::read(file).map_err(|source| RobotError::Read { file: file.to_owned(), source })?;
    let refused = |detail: String| RobotError::Model { file: file.to_owned(), detail };
    let text = String::from_utf8(bytes)
        .map_err(|e| refused(format!("byte {} is no UTF-8 text", e.utf8_error().valid_up_to())))?;
    match crate::check::not_finite(&text) {
        Some((line, found)) => Err(refused(format!("line {line}: {found}; expected finite numbers"))),
        None => Ok(text),
    }
}

/// Every number of the settings is finite and no text has a NUL, which would end a name early in MuJoCo.
pub(crate) fn sane(file: &Path, settings: &RobotFile) -> Result<(), RobotError> {
    fn walk(value: &toml::Value, field: &str) -> Option<(String, String, &'static str)> {
        match value {
            toml::Value::Float(x) if !x.is_finite() => Some((field.to_owned(), x.to_string(), "a finite number")),
            toml::Value::String(s) if s.contains('\0') => {
                Some((field.to_owned(), format!("{s:?}"), "text without a NUL"))
            }
            toml::Value::Array(items) => {
                items.iter().enumerate().find_map(|(i, item)| walk(item, &format!("{field}[{i}]")))
            }
            toml::Value::Table(table) => table.iter().find_map(|(key, item)| {
                let field = if field.is_empty() { key.clone() } else { format!("{field}.{key}") };
                if key.contains('\0') {
                    return Some((format!("{field:?}"), format!("{key:?}"), "a name without a NUL"));
                }
                walk(item, &field)
            }),
            _ => None,
        }
    }
    let value = toml::Value::try_from(settings)
        .map_err(|e| RobotError::Settings { file: file.to_owned(), detail: e.to_string() })?;
    match walk(&value, "") {
        Some((field, found, expected)) => {
            Err(RobotError::Field { file: file.to_owned(), field, found, expected: expected.into() })
        }
        None => Ok(()),
    }
}

/// Reads the model and makes it a robot: a free joint for a URDF, no actuators, contact spheres.
pub(crate) fn spec(file: &Path, model_file: &Path, settings: &RobotFile) -> Result<MjSpec, RobotError> {
    let text = read_model(model_file)?;
    let refused = |detail: String| RobotError::Model { file: model_file.to_owned(), detail };
    let mut spec = MjSpec::from_xml(model_file).map_err(|e| refused(e.to_string()))?;
    let is_urdf = crate::check::is_urdf(&text);
    if is_urdf {
        spec.compiler_mut().set_fusestatic(false);
        crate::meshes::resolve(&mut spec, model_file);
    }
    complete(&mut spec, is_urdf, file, model_file, settings)?;
    Ok(spec)
}

/// The same of an MJCF's text, which stands for `model_file`.
pub(crate) fn spec_of_text(
    file: &Path,
    model_file: &Path,
    text: &str,
    settings: &RobotFile,
) -> Result<MjSpec, RobotError> {
    let refused = |detail: String| RobotError::Model { file: model_file.to_owned(), detail };
    let mut spec = MjSpec::from_xml_string(text).map_err(|e| refused(e.to_string()))?;
    complete(&mut spec, false, file, model_file, settings)?;
    Ok(spec)
}

/// Makes a model a robot.
fn complete(
    spec: &mut MjSpec,
    is_urdf: bool,
    file: &Path,
    model_file: &Path,
    settings: &RobotFile,
) -> Result<(), RobotError> {
    let refused = |detail: String| RobotError::Model { file: model_file.to_owned(), detail };
    let wrong = |field: String, found: &str, expected: String| RobotError::Field {
        file: file.to_owned(),
        field,
        found: format!("\"{found}\""),
        expected,
    };
    // Our own drives take the place of the model's actuators; a sensor or keyframe might refer to them.
    let actuators: Vec<_> = spec.actuator_iter_mut().map(std::ptr::from_mut).collect();
    for actuator in actuators {
        // SAFETY: each element is deleted once, before anything else is changed in the specification.
        unsafe { (*actuator).delete() }.map_err(|e| refused(e.to_string()))?;
    }
    let keys: Vec<_> = spec.key_iter_mut().map(std::ptr::from_mut).collect();
    for key in keys {
        // SAFETY: as above.
        unsafe { (*key).delete() }.map_err(|e| refused(e.to_string()))?;
    }
    let world = spec.world_body_mut();
    if is_urdf {
        let base = world.child_mut(&settings.base.link).ok_or_else(|| {
            wrong("base.link".into(), &settings.base.link, format!("the root link of {}", model_file.display()))
        })?;
        base.add_free_joint().set_name("root").map_err(|e| refused(e.to_string()))?;
    }
    for (i, contact) in settings.contact.iter().enumerate() {
        if contact.radius.is_nan() || contact.radius <= 0.0 {
            return Err(RobotError::Field {
                file: file.to_owned(),
                field: format!("contact[{i}].radius"),
                found: contact.radius.to_string(),
                expected: "a radius above 0 m".into(),
            });
        }
        let link = world.child_mut(&contact.link).ok_or_else(|| {
            wrong(format!("contact[{i}].link"), &contact.link, format!("a link of {}", model_file.display()))
        })?;
        let sphere = link.add_geom();
        sphere
            .with_type(MjtGeomBase::mjGEOM_SPHERE)
            .with_size([contact.radius, 0.0, 0.0])
            .with_pos(contact.point)
            .with_mass(0.0)
            .with_rgba([0.2, 0.2, 0.2, 1.0])
            .set_name(&contact.name)
            .map_err(|_| wrong(format!("contact[{i}].name"), &contact.name, "a name that no other geom has".into()))?;
    }
    Ok(())
}
