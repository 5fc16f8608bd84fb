//! Where robots and references are found: in the folder the user stands in, beside or above the program, and last in
//! the workspace that the program was built from. Robots are looked for first in the folder that the environment's
//! `INSTEP_ROBOTS` names.

use std::path::{Path, PathBuf};

use instep_kick::Settings;
use instep_kick::policy::PolicySettings;
use instep_robot::Robot;
use serde::de::DeserializeOwned;

use crate::failure::Failure;

/// The folders that may hold `robots/` and `references/`, in the order in which they are tried.
fn roots() -> Vec<PathBuf> {
    let mut roots = vec![PathBuf::new()];
    if let Ok(program) = std::env::current_exe() {
        roots.extend(program.ancestors().skip(1).map(Path::to_owned));
    }
    roots.extend(Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).map(Path::to_owned));
    roots
}

/// The file or folder `relative` under the first of the roots that has it.
fn find(relative: &Path) -> Option<PathBuf> {
    roots().into_iter().map(|root| root.join(relative)).find(|path| path.exists())
}

/// The file that `flag` names, which must be there; `what` says what kind of file it is.
///
/// # Errors
/// When there is none, or it is a folder.
pub(crate) fn existing_file(flag: &str, path: &Path, what: &str) -> Result<PathBuf, Failure> {
    let found = match std::fs::metadata(path) {
        Ok(metadata) if !metadata.is_dir() => return Ok(path.to_owned()),
        Ok(_) => "is a folder".to_owned(),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => "no such file".to_owned(),
        Err(error) => format!("cannot be read: {error}"),
    };
    Err(Failure::input(format!("{}: {found}; expected {what} ({flag})", path.display())))
}

/// What `flag` names as a TOML file; `what` says what kind of settings it holds. Their ranges are not checked.
///
/// # Errors
/// When it cannot be read, or is not what it should be: with line and column.
pub(crate) fn settings<T: DeserializeOwned>(flag: &str, path: &Path, what: &str) -> Result<T, Failure> {
    existing_file(flag, path, &format!("{what} (TOML)"))?;
    let text = std::fs::read_to_string(path)
        .map_err(|e| Failure::input(format!("{}: cannot be read: {e}; expected TOML", path.display())))?;
    toml::from_str(&text).map_err(|e| Failure::input(format!("{}: {}", path.display(), e.to_string().trim_end())))
}

/// The reference that the user means: a path, or one of the shipped ones as `references/<robot>/<name>.json`.
///
/// # Errors
/// When there is none.
pub(crate) fn reference(path: &Path) -> Result<PathBuf, Failure> {
    let found = if path.is_relative() { find(path) } else { None };
    existing_file("--reference", found.as_deref().unwrap_or(path), "a reference (JSON), as `instep retarget` writes it")
}

/// The policy that the user means: a path, or one of the shipped ones as `policies/<robot>/<name>.safetensors`.
///
/// # Errors
/// When there is none.
pub(crate) fn policy(path: &Path) -> Result<PathBuf, Failure> {
    let found = if path.is_relative() { find(path) } else { None };
    existing_file("--policy", found.as_deref().unwrap_or(path), "a policy (safetensors), as `instep train` writes it")
}

/// The policy that the engine `policy` runs on the robot that the user means.
///
/// # Errors
/// When there is no such robot, or it has no policy.
pub(crate) fn shipped_policy(name_or_path: &str) -> Result<PathBuf, Failure> {
    let robot = robot(name_or_path)?;
    Ok(PolicySettings::load(robot.folder())?.path(robot.folder()))
}

/// The tuning file that the user means: a path, or one of the shipped ones as `tuning/<name>.toml`.
///
/// # Errors
/// When there is none.
pub(crate) fn tuning(path: &Path) -> Result<PathBuf, Failure> {
    let found = if path.is_relative() { find(path) } else { None };
    existing_file("--tuning", found.as_deref().unwrap_or(path), "a tuning file (TOML)")
}

/// The folder of KickBench's scenarios.
///
/// # Errors
/// When there is none.
pub(crate) fn scenarios() -> Result<PathBuf, Failure> {
    find(Path::new("scenarios"))
        .ok_or_else(|| Failure::input("scenarios/: no such folder; run from the project's folder"))
}

/// The folder of robots that the user's environment names.
fn robots_of_user() -> Option<PathBuf> {
    std::env::var_os("INSTEP_ROBOTS").filter(|folder| !folder.is_empty()).map(PathBuf::from)
}

/// The `robot.toml` of the robot called `name`, if that is a plain name and there is one.
fn shipped(name: &Path) -> Option<PathBuf> {
    let is_name = name.components().count() == 1 && name.file_name().is_some();
    let file = name.join("robot.toml");
    let of_user = || robots_of_user().map(|folder| folder.join(&file)).filter(|file| file.is_file());
    if is_name { of_user().or_else(|| find(&Path::new("robots").join(&file))) } else { None }
}

/// The files of a robot that the user wants looked at: a path, or the name of a robot that can be found.
///
/// # Errors
/// When there are none.
pub(crate) fn robot_files(path: &Path) -> Result<PathBuf, Failure> {
    if path.exists() {
        return Ok(path.to_owned());
    }
    shipped(path).ok_or_else(|| {
        Failure::input(format!(
            "{}: no such file or folder; expected a robot's folder, its robot.toml, or a model (MJCF or URDF)",
            path.display()
        ))
    })
}

/// The robot that the user means, a name or the path of its folder or `robot.toml`.
///
/// # Errors
/// When there is none, or it cannot be loaded.
pub(crate) fn robot(name_or_path: &str) -> Result<Robot, Failure> {
    let path = Path::new(name_or_path);
    let is_robot = |path: &Path| path.is_file() || path.join("robot.toml").is_file();
    if is_robot(path) {
        return Ok(Robot::load(path)?);
    }
    match shipped(path) {
        Some(path) => Ok(Robot::load(&path)?),
        None => {
            let found = if path.is_dir() { "a folder without robot.toml" } else { "no such robot" };
            let known = robots();
            let known = if known.is_empty() { "no folder robots/ was found".into() } else { known.join(", ") };
            Err(Failure::input(format!(
                "{name_or_path}: {found}; expected a robot's name ({known}) or the path of its robot.toml (--robot)"
            )))
        }
    }
}

/// The table of kicks that the user means: a path, or the shipped `kicks/kicks.toml`.
///
/// # Errors
/// When there is none.
pub(crate) fn kicks(path: &Path) -> Result<PathBuf, Failure> {
    let found = if path.is_relative() { find(path) } else { None };
    existing_file("--kicks", found.as_deref().unwrap_or(path), "a table of kicks (TOML, or KickBench's JSON)")
}

/// The strategy that `flag` names: a path, or a shipped one as `strategies/<name>.toml`.
///
/// # Errors
/// When there is none.
pub(crate) fn strategy(flag: &str, path: &Path) -> Result<PathBuf, Failure> {
    let found = if path.is_relative() { find(path) } else { None };
    existing_file(flag, found.as_deref().unwrap_or(path), "a strategy (TOML)")
}

/// The scenario of the rules that the user means: a path, or a shipped one as `scenarios/rules/<name>.toml`.
///
/// # Errors
/// When there is none.
pub(crate) fn rule(path: &Path) -> Result<PathBuf, Failure> {
    let found = if path.is_relative() { find(path) } else { None };
    existing_file("--scenario", found.as_deref().unwrap_or(path), "a scenario of the rules (TOML)")
}

/// Names of the robots that can be found.
fn robots() -> Vec<String> {
    let mut names: Vec<String> = robots_of_user()
        .into_iter()
        .chain(roots().into_iter().map(|root| root.join("robots")))
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flatten()
        .flatten()
        .filter(|entry| entry.path().join("robot.toml").is_file())
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| !name.starts_with('.'))
        .collect();
    names.sort_unstable();
    names.dedup();
    names
}
