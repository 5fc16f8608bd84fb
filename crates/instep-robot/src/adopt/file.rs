//! The two files of an adopted robot: `robot.toml`, which a person must read, and `derived.toml`, which nobody has to.

use std::fmt::Write;

use crate::settings::RobotFile;

/// `robot.toml`: what could not be known.
pub(super) fn asked(file: &RobotFile, asked: &[String], source: &str) -> String {
    let mut text = format!(
        "# Adopted by `instep robot adopt` from {source}. Look at these lines; all else is in {}, derived from the\n",
        super::DERIVED
    );
    let _ = writeln!(
        text,
        "# model, and what stands here goes before it. Units: m, rad, N m, rad/s, kg, s. To be looked at:"
    );
    for item in asked {
        let _ = writeln!(text, "# - {item}");
    }
    let quote = |s: &str| toml::Value::from(s).to_string();
    let _ =
        writeln!(text, "name = {}\ntitle = {}\nmodel = {}", quote(&file.name), quote(&file.title), quote(&file.model));
    let _ = writeln!(text, "derived = {}", quote(super::DERIVED));
    if let Some(engine) = &file.engine {
        let _ = writeln!(
            text,
            "# The engine that kicks where none is named: the best of those that were tried.\nengine = {}",
            quote(engine)
        );
    }
    text.push_str("\n# Largest torque and speed of every group of joints, from each motor's data sheet.\ngroup = [\n");
    let width = file.group.iter().map(|group| group.name.len()).max().unwrap_or(0) + 2;
    for group in &file.group {
        let (name, torque, speed) = super::asked_of(group);
        let name = quote(name);
        let torque = torque.map_or_else(String::new, |torque| format!("torque = {torque:?}, "));
        let _ = writeln!(text, "  {{ name = {name:<width$}, {torque}speed = {speed:?} }},");
    }
    text.push_str("]\n\n# What the drives take (\"torque\" or \"position_servo\"), how often and how late.\n");
    let kind = toml::Value::try_from(file.drives.kind).map_or_else(|_| String::new(), |kind| kind.to_string());
    let _ =
        writeln!(text, "[drives]\nkind = {kind}\nperiod = {:?}\ndelay = {:?}", file.drives.period, file.drives.delay);
    text
}

/// `derived.toml`: everything else.
pub(super) fn derived(file: &RobotFile, notes: &[String], source: &str) -> String {
    let mut text = format!(
        "# Derived from {source} by `instep robot adopt`: nobody has to read this. What robot.toml says goes before it;\n"
    );
    text.push_str("# `instep robot show` tells what follows from what.\n");
    for note in notes {
        let _ = writeln!(text, "# - {note}");
    }
    let mut table = toml::Table::try_from(file).unwrap_or_default();
    for key in ["name", "title", "model", "engine"] {
        table.remove(key);
    }
    if let Some(drives) = table.get_mut("drives").and_then(toml::Value::as_table_mut) {
        for key in ["kind", "period", "delay"] {
            drives.remove(key);
        }
    }
    for group in table.get_mut("group").and_then(toml::Value::as_array_mut).into_iter().flatten() {
        if let Some(group) = group.as_table_mut() {
            group.remove("torque");
            group.remove("speed");
        }
    }
    text.push('\n');
    text + &table.to_string()
}
