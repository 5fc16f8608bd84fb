//! `instep rcss`: players for a running RCSSServerMJ, the simulation league's MuJoCo server.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use instep_behaviour::{KickTable, Strategy};
use instep_field::Field;
use instep_rcss::{RcssError, Roster, Setup, Tally};
use serde_json::json;

use crate::failure::Failure;
use crate::output::Output;
use crate::{files, interrupt, places};

/// Most players that a team has on any of the server's fields.
const MOST_PLAYERS: u8 = 11;

/// The arguments of `instep rcss`.
#[derive(Debug, Args)]
pub(crate) struct Rcss {
    /// The robot that plays: t1 or k1
    #[arg(long, value_name = "ROBOT", default_value = "t1")]
    robot: String,
    /// The team's name: letters, digits, '_' and '-'
    #[arg(long, value_name = "NAME", default_value = "Instep")]
    team: String,
    /// One player, with this number
    #[arg(long, value_name = "NUMBER", conflicts_with = "players")]
    player: Option<u8>,
    /// A whole team of this many, with the numbers from 1 on
    #[arg(long, value_name = "COUNT")]
    players: Option<u8>,
    /// The server's host
    #[arg(long, default_value = "127.0.0.1")]
    host: String,
    /// The server's port for players
    #[arg(long, default_value_t = 60000)]
    port: u16,
    /// The field that the server plays on: simulation (7 against 7), fifa, or a TOML file
    #[arg(long, value_name = "FIELD", default_value = "simulation")]
    field: String,
    /// How the team plays, a TOML file
    #[arg(long, value_name = "FILE")]
    strategy: Option<PathBuf>,
    /// Leave after this much of the server's time in seconds; without it, on Ctrl-C
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,
    /// How long to look for a server in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0)]
    patience: f64,
    /// Write what the players believed and did ten times a second, as JSON
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
}

impl Rcss {
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        let numbers: Vec<u8> = match (self.player, self.players) {
            (Some(number), _) => vec![number],
            (None, Some(count)) if (1..=MOST_PLAYERS).contains(&count) => (1..=count).collect(),
            (None, Some(count)) => {
                return Err(Failure::input(format!("--players {count}: expected 1 to {MOST_PLAYERS}")));
            }
            (None, None) => return Err(Failure::input("nobody to play: expected --player NUMBER or --players COUNT")),
        };
        for (flag, value) in [("--duration", self.duration), ("--patience", Some(self.patience))] {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && *value <= 1e6)) {
                return Err(Failure::input(format!("{flag} {value}: expected more than 0 s")));
            }
        }
        let robot = places::robot(&self.robot)?;
        let field = Field::named_or_load(&self.field).map_err(|e| Failure::input(e.to_string()))?;
        let strategy = match &self.strategy {
            Some(path) => Strategy::load(&places::existing_file("--strategy", path, "a strategy (TOML)")?)
                .map_err(|e| Failure::input(e.to_string()))?,
            None => Strategy::default(),
        };
        let kicks = KickTable::load(&places::kicks(&PathBuf::from("kicks/kicks.toml"))?)
            .map_err(|e| Failure::input(e.to_string()))?;
        let settings = instep_rcss::settings(&robot, strategy, &kicks).map_err(failure)?;
        if let Some(log) = &self.log {
            files::check_file(log)?;
        }
        let setup = Setup {
            host: self.host,
            port: self.port,
            duration: self.duration,
            patience: self.patience,
            record: self.log.as_ref().map(|_| 0.1),
        };
        let stop = interrupt::stopped_by_the_user();
        let roster = Roster { team: &self.team, numbers: &numbers };
        let say = |line: String| output.remark(|_| line);
        let tallies =
            instep_rcss::play(&setup, &robot, &Arc::new(field), roster, &settings, &stop, &say).map_err(failure)?;
        if let Some(log) = &self.log {
            let whole: Vec<_> =
                tallies.iter().map(|tally| json!({ "number": tally.number, "records": tally.records })).collect();
            let mut batch = files::Batch::default();
            let staged = batch.stage(log)?;
            let bytes = serde_json::to_vec(&whole).map_err(Failure::other)?;
            std::fs::write(&staged, bytes).map_err(|e| Failure::other(format!("{}: {e}", staged.display())))?;
            batch.commit()?;
        }
        output.show(&summary(&tallies), |_| text(&tallies))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// What the user can mend and what not.
fn failure(error: RcssError) -> Failure {
    Failure::input(error.to_string())
}

fn summary(tallies: &[Tally]) -> serde_json::Value {
    let sum = |of: fn(&Tally) -> u64| tallies.iter().map(of).sum::<u64>();
    json!({
        "cycles": sum(|t| t.cycles),
        "late_cycles": sum(|t| t.late_cycles),
        "goals": tallies.iter().map(|t| t.goals).max(),
        "goals_against": tallies.iter().map(|t| t.goals_against).max(),
        "fell": sum(|t| t.fell),
        "reconnects": sum(|t| t.reconnects),
        "malformed": sum(|t| t.malformed),
        "players": tallies,
    })
}

fn text(tallies: &[Tally]) -> String {
    let mut text = String::from("player   cycles    late  fell  reconnects  mean ms  longest ms\n");
    for t in tallies {
        text += &format!(
            "{:>6} {:>8} {:>7} {:>5} {:>11} {:>8.2} {:>11.1}\n",
            t.number, t.cycles, t.late_cycles, t.fell, t.reconnects, t.mean_ms, t.longest_ms
        );
    }
    let goals = |of: fn(&Tally) -> u32| tallies.iter().map(of).max().unwrap_or(0);
    text += &format!("goals {} : {}\n", goals(|t| t.goals), goals(|t| t.goals_against));
    text
}
