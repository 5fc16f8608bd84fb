//! The tuning file: which numbers of an engine's settings may change, between which bounds, and on what they are measured.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::TuneError;

/// A whole tuning file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tuning {
    /// One line for people.
    pub title: String,
    /// The KickBench scenario whose cases are tried.
    pub scenario: String,
    /// Cases that each sample is tried on: the same for all samples of a generation, new ones in the next.
    pub cases: usize,
    /// Samples in a generation, 4 or more.
    pub population: usize,
    /// Most generations.
    pub generations: usize,
    /// First step, as a share of the bounds' distance, above 0 and up to 1.
    pub step: f64,
    /// The search ends when every parameter's standard deviation is below this share of its bounds' distance.
    pub settled: f64,
    /// The numbers.
    pub parameter: Vec<Parameter>,
}

/// One number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Its path in the engine's settings, such as `kick.time`, or `kick.offset.2` for the third number of a list.
    pub name: String,
    /// Least and greatest value.
    pub bounds: [f64; 2],
}

impl Tuning {
    /// Reads and checks a tuning file.
    ///
    /// # Errors
    /// When the file is missing, is not TOML of this layout, or a value cannot be.
    pub fn load(path: &Path) -> Result<Self, TuneError> {
        let text = std::fs::read_to_string(path).map_err(|e| TuneError::file(path, format!("cannot be read: {e}")))?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// Reads and checks `text`; `file` stands in errors.
    ///
    /// # Errors
    /// As [`Tuning::load`].
    pub fn parse(file: &str, text: &str) -> Result<Self, TuneError> {
        let tuning: Self = toml::from_str(text)
            .map_err(|e| TuneError::File { file: file.to_owned(), detail: e.to_string().trim_end().to_owned() })?;
        tuning.validate(file)?;
        Ok(tuning)
    }

    fn validate(&self, file: &str) -> Result<(), TuneError> {
        let wrong = |field: String, found: String, expected: &str| {
            Err(TuneError::Field { file: file.to_owned(), field, found, expected: expected.to_owned() })
        };
        for (field, value, low, high) in [
            ("cases", self.cases, 1, 1000),
            ("population", self.population, 4, 1000),
            ("generations", self.generations, 1, 100_000),
        ] {
            if !(low..=high).contains(&value) {
                return wrong(field.into(), value.to_string(), &format!("a whole number from {low} to {high}"));
            }
        }
        if !(self.step > 0.0 && self.step <= 1.0) {
            return wrong("step".into(), self.step.to_string(), "a number above 0 and up to 1");
        }
        if !(self.settled >= 0.0 && self.settled < 1.0) {
            return wrong("settled".into(), self.settled.to_string(), "a number in [0, 1)");
        }
        if self.parameter.is_empty() {
            return wrong("parameter".into(), "none".into(), "one [[parameter]] at least");
        }
        for (i, parameter) in self.parameter.iter().enumerate() {
            let [low, high] = parameter.bounds;
            if !(low.is_finite() && high.is_finite() && low < high) {
                return wrong(
                    format!("parameter[{i}].bounds of {}", parameter.name),
                    format!("[{low}, {high}]"),
                    "two numbers, the first below the second",
                );
            }
            if self.parameter[..i].iter().any(|other| other.name == parameter.name) {
                return wrong(format!("parameter[{i}].name"), format!("\"{}\"", parameter.name), "each name once");
            }
        }
        Ok(())
    }
}
