//! From a point of the search to an engine's settings and back: numbers by their path in the TOML, and their bounds.
//!
//! Each coordinate is a parameter's place between its bounds, 0 to 1. CMA-ES knows no bounds: outside of them the axis is
//! folded back like a mirror, so that every point means settings within the bounds and the cost stays continuous. An
//! optimum on a bound is found like any other.

use toml::{Table, Value};

use crate::TuneError;
use crate::tuning::Tuning;

/// The numbers that may change, in some settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    base: Table,
    names: Vec<String>,
    bounds: Vec<[f64; 2]>,
    /// Where the settings stand, 0 to 1.
    start: Vec<f64>,
}

/// Mirrors a coordinate into [0, 1].
fn fold(x: f64) -> f64 {
    let around = x.rem_euclid(2.0);
    if around > 1.0 { 2.0 - around } else { around }
}

/// Every number in `value`, by its path.
fn numbers(value: &Value, path: &str, found: &mut Vec<String>) {
    let below = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match value {
        Value::Table(table) => table.iter().for_each(|(key, value)| numbers(value, &below(key), found)),
        Value::Array(list) => list.iter().enumerate().for_each(|(i, v)| numbers(v, &below(&i.to_string()), found)),
        Value::Integer(_) | Value::Float(_) => found.push(path.to_owned()),
        _ => {}
    }
}

fn number<'a>(value: &'a mut Value, path: &str) -> Option<&'a mut Value> {
    let found = path.split('.').try_fold(value, |value, key| match value {
        Value::Table(table) => table.get_mut(key),
        Value::Array(list) => list.get_mut(key.parse::<usize>().ok()?),
        _ => None,
    })?;
    matches!(found, Value::Integer(_) | Value::Float(_)).then_some(found)
}

/// How many letters have to change, go or come to turn one word into the other (Levenshtein 1965).
fn letters_apart(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let change = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = change.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

impl Space {
    /// The parameters of `tuning` (read from `file`) in the settings `text` of an engine. They start where the settings
    /// stand, or at the nearest bound.
    ///
    /// # Errors
    /// When the settings are not TOML, or have no such number: with the nearest name that they have.
    pub fn new(tuning: &Tuning, file: &str, text: &str) -> Result<Self, TuneError> {
        let base: Table = text
            .parse()
            .map_err(|e: toml::de::Error| TuneError::File { file: "settings".into(), detail: e.to_string() })?;
        let mut whole = Value::Table(base.clone());
        let mut start = Vec::with_capacity(tuning.parameter.len());
        for (i, parameter) in tuning.parameter.iter().enumerate() {
            let value = match number(&mut whole, &parameter.name) {
                Some(Value::Integer(value)) => *value as f64,
                Some(Value::Float(value)) => *value,
                _ => {
                    let mut known = Vec::new();
                    numbers(&whole, "", &mut known);
                    let nearest = known.iter().min_by_key(|name| letters_apart(name, &parameter.name));
                    let hint = nearest.map_or(String::new(), |name| format!("; did you mean \"{name}\"?"));
                    return Err(TuneError::Field {
                        file: file.to_owned(),
                        field: format!("parameter[{i}].name"),
                        found: format!("\"{}\"", parameter.name),
                        expected: format!("the path of a number in the engine's settings{hint}"),
                    });
                }
            };
            let [low, high] = parameter.bounds;
            start.push(((value - low) / (high - low)).clamp(0.0, 1.0));
        }
        let names = tuning.parameter.iter().map(|parameter| parameter.name.clone()).collect();
        Ok(Self { base, names, bounds: tuning.parameter.iter().map(|p| p.bounds).collect(), start })
    }

    /// The parameters' names.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Where the settings stand.
    #[must_use]
    pub fn start(&self) -> &[f64] {
        &self.start
    }

    /// The parameters' values at `point`, with as many digits as their bounds' distance makes sense of.
    pub fn values<'a>(&self, point: impl IntoIterator<Item = &'a f64>) -> Vec<f64> {
        let pairs = point.into_iter().zip(&self.bounds);
        pairs
            .map(|(x, [low, high])| {
                let digits = 10f64.powi(5 - (high - low).log10().ceil() as i32);
                ((low + fold(*x) * (high - low)) * digits).round() / digits
            })
            .collect()
    }

    /// The settings' text with these values of the parameters.
    #[must_use]
    pub fn settings(&self, values: &[f64]) -> String {
        let mut whole = Value::Table(self.base.clone());
        for (name, value) in self.names.iter().zip(values) {
            if let Some(number) = number(&mut whole, name) {
                *number = Value::Float(*value);
            }
        }
        match whole {
            Value::Table(table) => table.to_string(),
            other => other.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "title = \"t\"\nscenario = \"straight\"\ncases = 2\npopulation = 4\ngenerations = 1\nstep = 0.2\n\
                        settled = 0.01\n[[parameter]]\nname = \"kick.time\"\nbounds = [0.2, 0.6]\n[[parameter]]\nname = \
                        \"kick.offset.2\"\nbounds = [-0.02, 0.02]\n";
    const SETTINGS: &str = "period = 0.012\n[kick]\ntime = 0.5\noffset = [0.0, 0.0, 0.01]\n";

    #[test]
    fn points_are_settings_within_their_bounds() {
        let tuning = Tuning::parse("f", FILE).unwrap();
        let space = Space::new(&tuning, "f", SETTINGS).unwrap();
        assert!((space.start()[0] - 0.75).abs() < 1e-12 && (space.start()[1] - 0.75).abs() < 1e-12);
        for x in [-3.4, -0.2, 0.0, 0.3, 1.0, 1.2, 7.9] {
            let values = space.values(&[x, -x]);
            assert!((0.2..=0.6).contains(&values[0]) && (-0.02..=0.02).contains(&values[1]), "{values:?}");
        }
        let text = space.settings(&[0.3, -0.005]);
        let table: Table = text.parse().unwrap();
        assert_eq!(table["kick"]["time"].as_float(), Some(0.3));
        assert_eq!(table["kick"]["offset"][2].as_float(), Some(-0.005));
        assert_eq!(table["period"].as_float(), Some(0.012));
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_nearest() {
        let tuning = Tuning::parse("f", &FILE.replace("kick.time", "kick.tiem")).unwrap();
        let error = Space::new(&tuning, "f", SETTINGS).unwrap_err().to_string();
        assert!(error.contains("kick.tiem") && error.contains("did you mean \"kick.time\""), "{error}");
    }

    #[test]
    fn bounds_that_cannot_be_are_refused() {
        for bad in ["[0.6, 0.2]", "[0.2, 0.2]", "[nan, 0.2]", "[]", "[0.1]"] {
            let error = Tuning::parse("f", &FILE.replace("[0.2, 0.6]", bad)).unwrap_err().to_string();
            assert!(error.contains("bounds"), "{bad}: {error}");
        }
    }
}
