//! `instep robot`: looks at a robot's own files.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Subcommand;
use instep_robot::check::{self, CheckReport, Finding, Kind};

use crate::failure::Failure;
use crate::output::{Output, Paint};
use crate::{adopt, places, reach, show};

/// The subcommands of `instep robot`.
#[derive(Debug, Subcommand)]
pub(crate) enum RobotCommand {
    /// Tell what a robot's files hold and what is missing; ends with code 1 when something is
    Check {
        /// A robot's folder, its robot.toml, or a bare model (MJCF or URDF)
        path: PathBuf,
    },
    /// Make a robot's folder of a bare model, ready to kick: legs, soles, drives, stand and engines are derived, and tried
    Adopt(adopt::Adopt),
    /// Show which of a robot's numbers stand in a file and which follow from others
    Show(show::Show),
    /// Measure which places the kicking foot can reach, by moving the simulated robot through them
    Reach(reach::Reach),
}

impl RobotCommand {
    /// Runs the command.
    ///
    /// # Errors
    /// When the files cannot be read, or are not what they should be.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        let path = match self {
            Self::Check { path } => path,
            Self::Adopt(adopt) => return adopt.run(output),
            Self::Show(show) => return show.run(output),
            Self::Reach(reach) => return reach.run(output),
        };
        let path = places::robot_files(&path)?;
        let report = check::check(&path)?;
        output.show(&report, |paint| text(&report, paint))?;
        Ok(ExitCode::from(u8::from(!report.usable)))
    }
}

/// The text on the terminal.
fn text(report: &CheckReport, paint: Paint) -> String {
    let kind = match report.kind {
        Kind::Robot => "a robot",
        Kind::Mjcf => "a bare MJCF model",
        Kind::Urdf => "a bare URDF model",
    };
    let verdict = match (report.usable, report.missing.is_empty()) {
        (true, true) => paint.good("can be used as it is"),
        (true, false) => paint.warn("can be used; worth a look:"),
        (false, _) => paint.bad("cannot be used yet; missing:"),
    };
    let width = report.found.iter().chain(&report.missing).map(|finding| finding.what.len()).max().unwrap_or(0);
    let line = |mark: String, finding: &Finding| {
        let what = paint.faint(&format!("{:<width$}", finding.what));
        format!("  {mark} {what}  {}", wrapped(&finding.detail, width + 6))
    };
    let mut lines = vec![paint.strong(&format!("{}, {kind}", report.name)), String::new()];
    lines.extend(report.found.iter().map(|finding| line(paint.good("+"), finding)));
    lines.extend([String::new(), verdict]);
    lines.extend(report.missing.iter().map(|finding| line(paint.bad("-"), finding)));
    if let Some(toml) = &report.suggested_toml {
        lines.extend([String::new(), paint.strong("A robot.toml to start from, beside the model:"), String::new()]);
        lines.push(toml.clone());
    }
    lines.join("\n")
}

/// The words of `text` in lines of at most 110 columns, those after the first indented by `indent`.
fn wrapped(text: &str, indent: usize) -> String {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.last_mut().filter(|line| line.is_empty() || indent + line.len() + word.len() < 110);
        match line {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) => line.extend([" ", word]),
            None => lines.push(word.to_owned()),
        }
    }
    lines.join(&format!("\n{}", " ".repeat(indent)))
}
