//! What the user reads: results on standard output, as text or as one JSON object; errors on standard error.
//!
//! A reader that has gone (`instep kick | head -1`) is no error.

use std::io::{IsTerminal, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::failure::Failure;
use crate::mujoco_log;

/// How often work that no terminal watches tells how far it is, s.
const HEARTBEAT: Duration = Duration::from_secs(60);

/// A progress bar of `length` steps on standard error; where that is no terminal, a line a minute in its place.
pub(crate) fn bar(length: u64, template: &str) -> ProgressBar {
    let bar = ProgressBar::new(length);
    if !std::io::stderr().is_terminal() {
        let weak = bar.downgrade();
        std::thread::spawn(move || {
            loop {
                std::thread::sleep(HEARTBEAT);
                let Some(bar) = weak.upgrade().filter(|bar| !bar.is_finished()) else { return };
                // Nobody is left to be told when standard error is closed.
                let _ = writeln!(std::io::stderr().lock(), "{}", heartbeat(&bar));
            }
        });
    }
    // A template of ours that cannot be read is shown as the library's own.
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}

/// How far `bar` is, as one line.
fn heartbeat(bar: &ProgressBar) -> String {
    let (at, length, minutes) = (bar.position(), bar.length().unwrap_or(0), bar.elapsed().as_secs() / 60);
    let parts = [bar.prefix(), format!("{at} of {length} after {minutes} min"), bar.message()];
    parts.iter().filter(|part| !part.is_empty()).map(String::as_str).collect::<Vec<_>>().join(", ")
}

/// How to speak to the user.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Output {
    json: bool,
    colour: bool,
}

impl Output {
    /// `json`: one object on standard output instead of text. Text is coloured on a terminal, unless NO_COLOR is set.
    pub(crate) fn new(json: bool) -> Self {
        let colour = std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty());
        Self { json, colour }
    }

    /// Prints a result: `object` for machines (NaN becomes null) or `text` for people.
    ///
    /// # Errors
    /// When standard output cannot be written for another reason than that its reader has gone.
    pub(crate) fn show(&self, object: &impl Serialize, text: impl FnOnce(Paint) -> String) -> Result<(), Failure> {
        let text = if self.json {
            serde_json::to_string(object).map_err(Failure::other)?
        } else {
            text(Paint { on: self.colour }).trim_end().to_owned()
        };
        match writeln!(std::io::stdout().lock(), "{text}") {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                Err(Failure::other(format!("standard output: cannot be written: {error}")))
            }
            _ => Ok(()),
        }
    }

    /// Tells what goes on, on standard error, while a command runs.
    pub(crate) fn remark(&self, line: impl FnOnce(Paint) -> String) {
        let on = std::io::stderr().is_terminal() && self.colour;
        // Nobody is left to be told when standard error is closed.
        let _ = writeln!(std::io::stderr().lock(), "{}", line(Paint { on }));
    }

    /// Tells why the command did not do what was asked.
    pub(crate) fn complain(&self, failure: &Failure) {
        let on = std::io::stderr().is_terminal() && self.colour;
        let label = Paint { on }.bad("error:");
        let warnings = mujoco_log::warnings();
        let aside =
            if warnings.is_empty() { String::new() } else { format!("\n(MuJoCo warned: {})", warnings.join("; ")) };
        // Nobody is left to be told when standard error is closed.
        let _ = writeln!(std::io::stderr().lock(), "{label} {}{aside}", failure.message());
    }
}

/// Colours, where the reader sees them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Paint {
    on: bool,
}

impl Paint {
    fn with(self, code: &str, text: &str) -> String {
        if self.on { format!("\x1b[{code}m{text}\x1b[0m") } else { text.to_owned() }
    }

    /// As wanted.
    pub(crate) fn good(self, text: &str) -> String {
        self.with("32", text)
    }

    /// Close to a limit, or worth a look.
    pub(crate) fn warn(self, text: &str) -> String {
        self.with("33", text)
    }

    /// Not as wanted.
    pub(crate) fn bad(self, text: &str) -> String {
        self.with("31", text)
    }

    /// The number that matters.
    pub(crate) fn strong(self, text: &str) -> String {
        self.with("1", text)
    }

    /// Labels and details.
    pub(crate) fn faint(self, text: &str) -> String {
        self.with("2", text)
    }

    /// A bar of ten cells for `share` of a limit, and the share in per cent.
    pub(crate) fn bar(self, share: f64) -> String {
        const EIGHTHS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
        // The cast saturates; NaN gives an empty bar.
        let eighths = ((share * 80.0).round() as usize).min(80);
        let bar = format!("{}{}", "█".repeat(eighths / 8), EIGHTHS[eighths % 8]);
        let text = format!("{bar:<10} {:>3.0} %", share * 100.0);
        if share > 0.995 {
            self.bad(&text)
        } else if share > 0.8 {
            self.warn(&text)
        } else {
            self.good(&text)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heartbeat_tells_how_far_the_work_is() {
        let bar = bar(200, "{pos}");
        bar.set_position(30);
        assert_eq!(heartbeat(&bar), "30 of 200 after 0 min");
        bar.set_prefix("kinematic");
        bar.set_message("cost 3");
        assert_eq!(heartbeat(&bar), "kinematic, 30 of 200 after 0 min, cost 3");
    }
}
