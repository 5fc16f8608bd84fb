//! `instep robot show`: which of a robot's numbers stand in a file, which follow from others, and from which.
//!
//! What a setting follows from is not written down a second time: each number that settings are derived from is changed by a little, and
//! what changes with it, and by which power, is seen.

use std::collections::BTreeMap;
use std::process::ExitCode;

use clap::Args;
use instep_bench::Subject;
use instep_kick::adaptive::AdaptiveSettings;
use instep_kick::dynamic::DynamicSettings;
use instep_kick::preview::PreviewSettings;
use instep_kick::{Build, Derive};
use serde::Serialize;
use toml::{Table, Value};

use crate::failure::Failure;
use crate::output::{Output, Paint};
use crate::places;

/// By how much a number is changed to see what follows from it.
const NUDGE: f64 = 0.2;

/// A number that settings follow from, by name, and its change.
type Nudge = (&'static str, fn(&mut Build));

/// The arguments of `instep robot show`.
#[derive(Debug, Args)]
pub(crate) struct Show {
    /// A robot's name, or the path of its folder or robot.toml
    robot: String,
}

/// One setting.
#[derive(Debug, Serialize)]
struct Setting {
    value: Value,
    /// "file" or "derived".
    from: &'static str,
    /// What it would be were it not in the file.
    derived: Option<Value>,
    /// What it follows from, with the power: `leg^0.5`; empty for a number that is the same for all robots.
    of: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Engine {
    file: String,
    settings: BTreeMap<String, Setting>,
}

#[derive(Debug, Serialize)]
struct Answer {
    robot: String,
    /// What settings follow from.
    build: Build,
    /// The robot's own fields that were derived from its model, by file; empty where a person wrote them all.
    model: BTreeMap<String, Vec<String>>,
    engines: BTreeMap<&'static str, Engine>,
}

impl Show {
    /// Runs the command.
    ///
    /// # Errors
    /// When the robot or its settings cannot be read.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        let subject = Subject::of(places::robot(&self.robot)?)?;
        let build = Build::of(&subject.robot, &subject.ball);
        let engines = [
            ("dynamic", engine::<DynamicSettings>(&subject, &build)?),
            ("adaptive", engine::<AdaptiveSettings>(&subject, &build)?),
            ("preview", engine::<PreviewSettings>(&subject, &build)?),
        ];
        let answer =
            Answer { robot: subject.robot.name.clone(), build, model: model(&subject), engines: engines.into() };
        output.show(&answer, |paint| text(&answer, paint))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// An engine's settings for the robot, each with where it comes from.
fn engine<S: Derive>(subject: &Subject, build: &Build) -> Result<Engine, Failure> {
    let file = subject.robot.folder().join(S::FILE);
    let table = |settings: &S| Table::try_from(settings).map(|table| leaves(&table)).map_err(Failure::other);
    let given = std::fs::read_to_string(&file).ok().and_then(|text| text.parse::<Table>().ok());
    let given = given.map(|table| leaves(&table)).unwrap_or_default();
    let now = table(&S::of_folder(build, subject.robot.folder())?)?;
    let derived = table(&S::derive(build))?;
    let mut nudged = Vec::new();
    for (name, change) in nudges() {
        let mut other = *build;
        change(&mut other);
        nudged.push((name, table(&S::derive(&other))?));
    }
    let settings = now.into_iter().map(|(path, value)| {
        let of =
            nudged.iter().filter_map(|(name, other)| follows(name, derived.get(&path)?, other.get(&path)?)).collect();
        let from = if given.contains_key(&path) { "file" } else { "derived" };
        let setting = Setting { from, derived: derived.get(&path).filter(|d| **d != value).cloned(), of, value };
        (path, setting)
    });
    Ok(Engine { file: file.display().to_string(), settings: settings.collect() })
}

/// The numbers that settings follow from, each with its change.
fn nudges() -> [Nudge; 5] {
    [
        ("leg", |build| build.leg *= 1.0 + NUDGE),
        ("half_sole_width", |build| build.half_sole_width *= 1.0 + NUDGE),
        ("hip_load", |build| build.hip_load *= 1.0 + NUDGE),
        ("ball_radius", |build| build.ball_radius *= 1.0 + NUDGE),
        ("tick", |build| build.tick *= 1.0 + NUDGE),
    ]
}

/// How `after`, with `name` changed, follows from `before`.
fn follows(name: &str, before: &Value, after: &Value) -> Option<String> {
    let (Some(a), Some(b)) = (before.as_float(), after.as_float()) else { return None };
    if a == b {
        return None;
    }
    let power = (b / a).ln() / (1.0 + NUDGE).ln();
    let tidy = (10.0 * power).round() / 10.0;
    Some(match tidy {
        _ if !power.is_finite() || (tidy - power).abs() > 0.06 => format!("{name}, not as a power"),
        1.0 => name.to_owned(),
        tidy => format!("{name}^{tidy}"),
    })
}

/// The fields of `robot.toml` by the file that says them, where the robot has a derived one.
fn model(subject: &Subject) -> BTreeMap<String, Vec<String>> {
    let folder = subject.robot.folder();
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).ok()?.parse::<Table>().ok();
    let Some(own) = read("robot.toml") else { return BTreeMap::new() };
    let Some(derived) = own.get("derived").and_then(Value::as_str) else { return BTreeMap::new() };
    let keys = |table: &Table| {
        table
            .iter()
            .flat_map(|(key, value)| match value {
                Value::Table(inner) => inner.keys().map(|k| format!("{key}.{k}")).collect::<Vec<_>>(),
                Value::Array(items) => vec![format!("{key} ({})", items.len())],
                _ => vec![key.clone()],
            })
            .collect()
    };
    let mut model = BTreeMap::new();
    model.insert("robot.toml".to_owned(), keys(&own));
    if let Some(table) = read(derived) {
        model.insert(derived.to_owned(), keys(&table));
    }
    model
}

/// Every value that is no table by its path.
fn leaves(table: &Table) -> BTreeMap<String, Value> {
    fn walk(table: &Table, path: &str, to: &mut BTreeMap<String, Value>) {
        for (key, value) in table {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            match value {
                Value::Table(inner) => walk(inner, &path, to),
                value => {
                    to.insert(path, value.clone());
                }
            }
        }
    }
    let mut to = BTreeMap::new();
    walk(table, "", &mut to);
    to
}

fn text(answer: &Answer, paint: Paint) -> String {
    let Build { leg, half_sole_width, hip_load, ball_radius, tick } = answer.build;
    let mut lines = vec![
        paint.strong(&answer.robot),
        format!("  leg              {leg:.4} m, from the hip's pitch joint along thigh and shank to the sole"),
        format!("  half_sole_width  {half_sole_width:.4} m"),
        format!("  hip_load         {hip_load:.3} of the hip roll motor's torque carries the body on one leg"),
        format!("  ball_radius      {ball_radius:.4} m (ball.toml)"),
        format!("  tick             {tick} s"),
    ];
    for (file, keys) in &answer.model {
        lines.extend([String::new(), paint.strong(&format!("{file} says")), format!("  {}", keys.join(", "))]);
    }
    for (name, engine) in &answer.engines {
        let written = engine.settings.values().filter(|setting| setting.from == "file").count();
        let total = engine.settings.len();
        lines.extend([
            String::new(),
            paint.strong(&format!("{name}: {written} of {total} settings from {}", engine.file)),
        ]);
        let width = engine.settings.keys().map(String::len).max().unwrap_or(0);
        for (path, setting) in &engine.settings {
            let value = setting.value.to_string();
            let why = match (setting.from, &setting.derived, setting.of.as_slice()) {
                ("file", Some(derived), _) => format!("file; would be {derived}"),
                ("file", None, _) => "file; as derived".to_owned(),
                (_, _, []) => "the same for all robots".to_owned(),
                (_, _, of) => format!("from {}", of.join(", ")),
            };
            lines.push(format!("  {path:<width$}  {value:<12} {}", paint.faint(&why)));
        }
    }
    lines.join("\n")
}
