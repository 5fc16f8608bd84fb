//! `instep match --scenario`: a scenario of the rules, what the referee did in it, and the replay of it.

use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

use instep_field::Field;
use instep_match::TeamSetup;
use instep_match::scenario::{Check, Scenario};

use super::Match;
use crate::failure::Failure;
use crate::output::{Output, Paint};

impl Match {
    /// Plays the scenario in `file`; the exit code tells whether all came as it says.
    pub(super) fn play_scenario(&self, file: &Path, team: &TeamSetup, output: &Output) -> Result<ExitCode, Failure> {
        let scenario = Scenario::load(file)?;
        let (checks, recording) = scenario.play(team)?;
        if let Some(replay) = self.replay_file()? {
            let field = Field::named_or_load(&scenario.rules)?;
            self.write_replay(&replay, &recording, &field, ["red", "blue"], output)?;
        }
        let checked: Vec<_> =
            checks.iter().map(|c| serde_json::json!({ "what": c.what, "time": c.at, "fault": c.fault })).collect();
        let holds = checks.iter().all(|c| c.fault.is_none());
        let object = serde_json::json!({ "title": scenario.title, "holds": holds, "checks": checked, "events": recording.events });
        output.show(&object, |paint| text(&scenario.title, &checks, paint))?;
        Ok(if holds { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

fn text(title: &str, checks: &[Check], paint: Paint) -> String {
    let mut text = format!("{title}\n");
    for Check { what, at, fault } in checks {
        let at = at.map_or_else(|| "never".to_owned(), |at| format!("{at:.2} s"));
        let _ = match fault {
            None => writeln!(text, "{at:>9}  {}", paint.good(what)),
            Some(fault) => writeln!(text, "{at:>9}  {}: {fault}", paint.bad(what)),
        };
    }
    text
}
