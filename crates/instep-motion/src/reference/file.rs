//! The reference's file: JSON, one knot a line, written whole or not at all.
//!
//! A file is first written beside its place under another name and then renamed, so that a reader, a full disk or a
//! killed process never leaves half a file under the final name. JSON has no NaN: such a reference is refused.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;

use super::Reference;
use crate::{MotionError, text};

impl Reference {
    /// Reads and validates a reference.
    ///
    /// # Errors
    ///
    /// [`MotionError::Read`] if the file cannot be read, [`MotionError::Syntax`] with the line if it is no JSON of this
    /// layout, [`MotionError::Content`] with the field if its values cannot be used ([`Self::validate`]).
    pub fn load(path: &Path) -> Result<Self, MotionError> {
        let text = text::read(path)?;
        let reference: Self = serde_json::from_str(&text)
            .map_err(|error| MotionError::syntax(path, error.line().max(1), error.to_string(), "a reference (JSON)"))?;
        reference.validate().map_err(|error| of_file(path, error))?;
        Ok(reference)
    }

    /// Validates and writes the reference, whole or not at all: to a new file in the same folder, then renamed. Same
    /// reference, same bytes.
    ///
    /// # Errors
    ///
    /// [`MotionError::Content`] with the field if a value cannot be used ([`Self::validate`]), [`MotionError::Write`] if
    /// the file or its folder cannot be written; what stood at `path` before is then still there.
    pub fn save(&self, path: &Path) -> Result<(), MotionError> {
        self.validate().map_err(|error| of_file(path, error))?;
        let write = |source: std::io::Error| MotionError::Write { file: path.to_owned(), source };
        let text = self.to_json().map_err(|error| write(error.into()))?;
        let temporary = beside(path);
        let written = write_new(&temporary, text.as_bytes()).and_then(|()| std::fs::rename(&temporary, path));
        written.map_err(|source| {
            // Nothing more can be done about a temporary file that cannot be removed either.
            let _ = std::fs::remove_file(&temporary);
            write(source)
        })
    }

    /// The file's text.
    fn to_json(&self) -> Result<String, serde_json::Error> {
        let mut text = String::from("{\n");
        let mut field = |name: &str, value: String| {
            text.push_str(&format!("  \"{name}\": {value},\n"));
        };
        field("format", json(&self.format)?);
        field("robot", json(&self.robot)?);
        field("kind", json(&self.kind)?);
        field("source", json(&self.source)?);
        field("rate", json(&self.rate)?);
        field("ball", json(&self.ball)?);
        field("phases", json(&self.phases)?);
        field("joint_names", json(&self.joint_names)?);
        field("contact_names", json(&self.contact_names)?);
        text.push_str("  \"knots\": [\n");
        for (i, knot) in self.knots.iter().enumerate() {
            text.push_str("    ");
            text.push_str(&json(knot)?);
            text.push_str(if i + 1 < self.knots.len() { ",\n" } else { "\n" });
        }
        text.push_str("  ]\n}\n");
        Ok(text)
    }
}

fn json(value: &impl Serialize) -> Result<String, serde_json::Error> {
    serde_json::to_string(value)
}

/// The fault of a value, told as one of a file.
fn of_file(path: &Path, error: MotionError) -> MotionError {
    match error {
        MotionError::Argument { name, found, expected } => MotionError::content(path, name, found, expected),
        other => other,
    }
}

/// A name in the same folder that no other process or thread uses.
fn beside(path: &Path) -> PathBuf {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    path.with_file_name(format!(".{name}.{}.{count}.tmp", std::process::id()))
}

fn write_new(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = std::fs::File::create_new(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}
