//! Mesh files of a URDF: ROS names them `package://<package>/<path>`, which MuJoCo takes for a path. Here the file is
//! looked for near the URDF: in its folder and the folders above it, with and without the package's name.

use std::path::{Path, PathBuf};

use mujoco_rs::wrappers::mj_editing::MjSpec;

/// How many folders above the model's own are searched.
const ABOVE: usize = 4;

/// Points every mesh named `package://` at its file, where there is one.
pub(crate) fn resolve(spec: &mut MjSpec, model_file: &Path) {
    let folder = folder_of(model_file);
    for mesh in spec.mesh_iter_mut() {
        let found = find(folder, mesh.file());
        if let Some(path) = found.as_deref().and_then(Path::to_str).filter(|path| !path.contains('\0')) {
            mesh.set_file(path);
        }
    }
}

/// The file of a mesh named `package://`; `None` for other names and where there is no such file.
pub(crate) fn find(folder: &Path, name: &str) -> Option<PathBuf> {
    let path = name.strip_prefix("package://").or_else(|| name.strip_prefix("package:/"))?;
    let (_, within) = path.split_once('/').unwrap_or(("", path));
    let bare = Path::new(path).file_name()?;
    let folder = folder.canonicalize().ok()?;
    folder
        .ancestors()
        .take(ABOVE)
        .flat_map(|above| [above.join(within), above.join(path)])
        .chain([folder.join(bare)])
        .find(|file| file.is_file())
}

/// The folder that a model file stands in.
pub(crate) fn folder_of(model_file: &Path) -> &Path {
    match model_file.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}
