//! `instep robot check PATH`: what a robot's files hold and what they lack, told to someone who brings their own.
//!
//! PATH is a robot's folder, a `robot.toml`, or a bare model (MJCF or URDF). A `robot.toml` must resolve; then its
//! plausibility is checked (does the standing pose stand, are the gains stable, are the sides alike). A bare model is
//! searched for legs, feet and limits, and gets a starting `robot.toml` with everything that could be guessed.

mod bare;
pub(crate) mod legs;
pub(crate) mod markup;
pub(crate) mod outline;
mod plausible;
pub(crate) mod suggest;

use std::path::Path;

use serde::Serialize;

use crate::{Robot, RobotError};

/// What was found and what is missing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckReport {
    /// What was checked.
    pub kind: Kind,
    /// The robot's or model's name.
    pub name: String,
    /// What is there.
    pub found: Vec<Finding>,
    /// What is not there or not as it should be.
    pub missing: Vec<Finding>,
    /// Whether Instep can work with it as it is. A bare model never is usable: it lacks its `robot.toml`.
    pub usable: bool,
    /// For a bare model: a starting `robot.toml`. It parses; names that could not be guessed read "FILL IN".
    pub suggested_toml: Option<String>,
}

/// What was checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A robot with its `robot.toml`.
    Robot,
    /// A bare MuJoCo model.
    Mjcf,
    /// A bare URDF.
    Urdf,
}

/// One thing found or missing.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What it is about, in a few fixed words: "free joint", "torque limit", "stand".
    pub what: String,
    /// What there is to say about it.
    pub detail: String,
}

/// Findings as they are collected.
#[derive(Debug, Default)]
struct Findings {
    found: Vec<Finding>,
    missing: Vec<Finding>,
    blocked: bool,
}

impl Findings {
    fn found(&mut self, what: &str, detail: impl Into<String>) {
        self.found.push(Finding { what: what.to_owned(), detail: detail.into() });
    }

    /// Something to mend that does not keep the robot from being used.
    fn doubtful(&mut self, what: &str, detail: impl Into<String>) {
        self.missing.push(Finding { what: what.to_owned(), detail: detail.into() });
    }

    /// Something without which the robot cannot be used.
    fn missing(&mut self, what: &str, detail: impl Into<String>) {
        self.blocked = true;
        self.doubtful(what, detail);
    }

    fn report(self, kind: Kind, name: String, suggested_toml: Option<String>) -> CheckReport {
        CheckReport { kind, name, found: self.found, missing: self.missing, usable: !self.blocked, suggested_toml }
    }
}

/// Checks a robot's folder, a `robot.toml`, an MJCF (`.xml`, `.mjcf`) or a URDF.
///
/// # Errors
/// When a file is missing or is not what it should be, or a `robot.toml` names something that the model does not have.
pub fn check(path: &Path) -> Result<CheckReport, RobotError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    if path.is_dir() || extension.as_deref() == Some("toml") {
        return Ok(plausible::check(&Robot::load(path)?));
    }
    match extension.as_deref() {
        Some("xml" | "mjcf" | "urdf") => bare::check(path),
        _ if !path.exists() => {
            Err(RobotError::Read { file: path.to_owned(), source: std::io::ErrorKind::NotFound.into() })
        }
        other => Err(RobotError::Structure {
            file: path.to_owned(),
            found: other.map_or("no file extension".into(), |e| format!("a file of type .{e}")),
            expected: "a robot's folder, a robot.toml, an MJCF (.xml, .mjcf) or a URDF (.urdf)".into(),
        }),
    }
}

/// Whether a model file's text is a URDF: its first element is `robot`.
pub(crate) fn is_urdf(text: &str) -> bool {
    markup::read(text).root == "robot"
}

/// The first attribute with a number that is not finite: its line and text.
pub(crate) fn not_finite(text: &str) -> Option<(usize, String)> {
    markup::not_finite(text)
}
