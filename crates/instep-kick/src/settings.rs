//! Settings of a robot's folder: TOML files that are read and checked in one way, whatever they hold.

use std::path::Path;

use serde::de::DeserializeOwned;

use crate::KickError;

/// The settings of one file.
pub trait Settings: DeserializeOwned {
    /// The file's name in a robot's folder.
    const FILE: &'static str;
    /// What it holds, in words.
    const HOLDS: &'static str;

    /// Checks every value.
    ///
    /// # Errors
    /// Names the first field whose value cannot be.
    fn validate(&self) -> Result<(), KickError>;

    /// Reads and checks the settings in a robot's folder, or in the file itself.
    ///
    /// # Errors
    /// When the file is missing, is not TOML of this layout, or a value cannot be: with file and field.
    fn load(path: &Path) -> Result<Self, KickError> {
        let file = if path.is_dir() { path.join(Self::FILE) } else { path.to_owned() };
        let name = file.display().to_string();
        let text = std::fs::read_to_string(&file).map_err(|e| KickError::Read {
            file: name.clone(),
            detail: format!("{e}; expected {} of this robot", Self::HOLDS),
        })?;
        Self::parse(&name, &text)
    }

    /// Reads and checks the settings from `text`; `name` stands in errors.
    ///
    /// # Errors
    /// As [`Settings::load`].
    fn parse(name: &str, text: &str) -> Result<Self, KickError> {
        let settings: Self = toml::from_str(text)
            .map_err(|e| KickError::Parse { file: name.to_owned(), detail: e.to_string().trim_end().to_owned() })?;
        settings.validate().map_err(|error| match error {
            KickError::Setting { field, found, expected } => {
                KickError::Setting { field: format!("{name}: {field}"), found, expected }
            }
            other => other,
        })?;
        Ok(settings)
    }
}

/// Checks that the setting `field` lies between `low` and `high`.
///
/// # Errors
/// When it does not, or is not a number.
pub(crate) fn within(field: &str, value: f64, low: f64, high: f64) -> Result<(), KickError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    let expected = format!("a number in [{low}, {high}]");
    Err(KickError::Setting { field: field.to_owned(), found: value.to_string(), expected })
}
