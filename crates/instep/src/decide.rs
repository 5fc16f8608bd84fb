//! `instep decide`: what a player would do in a situation, and why.

use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use instep_behaviour::{KickTable, Player, Situation, Strategy, Which};
use instep_field::Field;

use crate::failure::Failure;
use crate::output::{Output, Paint};
use crate::places;

/// The arguments of `instep decide`.
#[derive(Debug, Args)]
pub(crate) struct Decide {
    /// What the player believes (TOML, or JSON where the name ends in .json)
    #[arg(long, value_name = "FILE")]
    state: PathBuf,
    /// The strategy [default: Instep's own]
    #[arg(long, value_name = "FILE")]
    strategy: Option<PathBuf>,
    /// How exact each kick is: TOML, or the JSON that `instep bench` writes
    #[arg(long, value_name = "FILE", default_value = "kicks/kicks.toml")]
    kicks: PathBuf,
    /// Whose kicks
    #[arg(long, value_name = "ROBOT", default_value = "artemis")]
    robot: String,
}

impl Decide {
    /// Runs the command.
    ///
    /// # Errors
    /// When a file cannot be used.
    pub(crate) fn run(&self, output: &Output) -> Result<ExitCode, Failure> {
        let state = places::existing_file("--state", &self.state, "a situation (TOML or JSON)")?;
        let situation = Situation::load(&state)?;
        let field = Field::named_or_load(&situation.field).map_err(Failure::input)?;
        let strategy = match &self.strategy {
            Some(path) => Strategy::load(&places::strategy("--strategy", path)?)?,
            None => Strategy::default(),
        };
        let path = places::kicks(&self.kicks)?;
        let which = Which { engine: None, robot: &self.robot };
        let kicks = KickTable::load(&path)?.only(which, &path.display().to_string())?;
        let mut player = Player::new(Arc::new(field), Arc::new(strategy), Arc::new(kicks))?;
        let decision = player.decide(&situation.beliefs());
        output.show(&decision, |paint| text(&decision, paint))?;
        Ok(ExitCode::SUCCESS)
    }
}

fn text(decision: &instep_behaviour::Decision, paint: Paint) -> String {
    let mut text = format!("{:?} as {}", decision.action, decision.role.name());
    let _ = writeln!(text, ", ball {:?}, neck {:?} at {:.2} rad", decision.ball, decision.gaze.mode, decision.gaze.yaw);
    if let Some(target) = decision.target {
        let [x, y] = target.point;
        let _ = writeln!(
            text,
            "{:?} to ({x:.2}, {y:.2}) m, radius {:.2} m, within {:.1} deg",
            target.kind,
            target.radius,
            target.tolerance.to_degrees()
        );
    }
    for reason in &decision.reasons {
        let mark = if reason.rejected { paint.faint("  no ") } else { paint.good(" yes ") };
        let _ = writeln!(text, "{mark} {:<18} {:>7.3}  {}", reason.option, reason.cost, reason.why);
    }
    text
}
