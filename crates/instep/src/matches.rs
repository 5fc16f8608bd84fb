//! `instep match`: games in the game simulator; how two strategies compare, and one game to look at. With `--physics` a game, or
//! a scene, of whole players in MuJoCo.

mod lead;
mod page;
mod physics;
mod rules;
mod space;

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, LazyLock};
use std::time::Instant;

use clap::Args;
use instep_behaviour::{KickTable, Strategy, Which};
use instep_bench::cpu::thread_seconds;
use instep_field::Field;
use instep_match::series::{self, Clocks, NORMAL_95, NORMAL_99, Summary};
use instep_match::{BodySettings, MatchSettings, Recording, TeamSetup};

use crate::failure::Failure;
use crate::output::{self, Output, Paint};
use crate::{files, places};

/// The arguments of `instep match`.
#[derive(Debug, Args)]
pub(crate) struct Match {
    /// The league's rules and field: adult-2024, kid, hsl-s, hsl-m, hsl-l, simulation, fifa, or a field's TOML file
    #[arg(long, value_name = "RULES", default_value = "adult-2024")]
    rules: String,
    /// Red's strategy, a file [default: Instep's own]; given again, one series each; with --physics how many play [default: 2]
    #[arg(long, value_name = "FILE|N")]
    red: Vec<PathBuf>,
    /// Blue's likewise
    #[arg(long, value_name = "FILE|N")]
    blue: Option<PathBuf>,
    /// How many games
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    games: u64,
    /// Seed of the first game
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Players of a team [default: by the rules]
    #[arg(long, value_name = "N")]
    players: Option<usize>,
    /// A draw is followed by extra time and a shoot-out, as the rules have them
    #[arg(long)]
    knockout: bool,
    /// How exact each kick is: TOML, or the JSON that `instep bench` writes
    #[arg(long, value_name = "FILE", default_value = "kicks/kicks.toml")]
    kicks: PathBuf,
    /// Whose kicks and walk [default: nao for kid and hsl-s, else artemis]
    #[arg(long, value_name = "ROBOT")]
    robot: Option<String>,
    /// Only this engine's kicks
    #[arg(long, value_name = "ENGINE")]
    engine: Option<String>,
    /// Write the first game as a replay for the browser: decisions, pass circles, beliefs and roles over the field
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,
    /// The same as out/match/replay.html, opened in the browser
    #[arg(long, conflicts_with = "save")]
    watch: bool,
    /// Play a scenario of the rules (scenarios/rules/NAME.toml) in place of games: what the referee had to do, and did
    #[arg(long, value_name = "FILE", conflicts_with_all = ["physics", "gamecontroller"])]
    scenario: Option<PathBuf>,
    #[command(flatten)]
    led: lead::Led,
    #[command(flatten)]
    in_physics: physics::InPhysics,
}

/// Seconds of a clock that only differences are taken of.
fn clock() -> f64 {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed().as_secs_f64()
}

/// What a series is measured with.
pub(crate) const CLOCKS: Clocks = Clocks { decision: clock, cpu: thread_seconds };

/// The settings with a robot's walk, and its kicks from the table in `kicks`; `robot` absent: nao on small fields, else
/// artemis.
///
/// # Errors
/// When the table cannot be used.
pub(crate) fn of_robot(
    mut settings: MatchSettings,
    robot: Option<&str>,
    engine: Option<&str>,
    kicks: &Path,
) -> Result<(Arc<MatchSettings>, Arc<KickTable>), Failure> {
    let small = matches!(settings.field.name.as_str(), "kid" | "hsl-s");
    let robot = robot.unwrap_or(if small { "nao" } else { "artemis" });
    settings.body = BodySettings::for_robot(robot);
    let path = places::kicks(kicks)?;
    let table = KickTable::load(&path)?.only(Which { engine, robot }, &path.display().to_string())?;
    Ok((Arc::new(settings), Arc::new(table)))
}

impl Match {
    /// Runs the command.
    ///
    /// # Errors
    /// When a file cannot be used or written.
    pub(crate) fn run(&self, output: &Output) -> Result<ExitCode, Failure> {
        if self.in_physics.physics {
            return physics::run(self, output);
        }
        let mut settings = MatchSettings::new(&self.rules, self.players)?;
        settings.knockout = self.knockout;
        let (settings, kicks) = of_robot(settings, self.robot.as_deref(), self.engine.as_deref(), &self.kicks)?;
        let setup = |flag: &str, path: Option<&PathBuf>| -> Result<TeamSetup, Failure> {
            let strategy = match path {
                Some(path) => Strategy::load(&places::strategy(flag, path)?)?,
                None => Strategy::default(),
            };
            Ok(TeamSetup { strategy: Arc::new(strategy), kicks: kicks.clone() })
        };
        let blue = setup("--blue", self.blue.as_ref())?;
        let red = setup("--red", self.red.first())?;
        if let Some(file) = &self.scenario {
            return self.play_scenario(&places::rule(file)?, &red, output);
        }
        if let Some(address) = self.led.gamecontroller {
            return self.play_led(address, &settings, [red, blue], output);
        }
        if let Some(file) = self.replay_file()? {
            let (mut game, _) = series::game(&settings, &red, &blue, self.seed, 0)?;
            game.record();
            game.play();
            let recording = game.take_recording().unwrap_or_default();
            let names = [red.strategy.name.as_str(), blue.strategy.name.as_str()];
            self.write_replay(&file, &recording, &settings.field, names, output)?;
        }
        let mut reds = vec![red];
        for path in self.red.iter().skip(1) {
            reds.push(setup("--red", Some(path))?);
        }
        let bar = output::bar(self.games * reds.len() as u64, "{pos}/{len} games {wide_bar} {eta}");
        let mut all = Vec::new();
        for red in &reds {
            let games = series::play(&settings, red, &blue, self.games as usize, self.seed, CLOCKS, || bar.inc(1))?;
            all.push((red.strategy.name.as_str(), Summary::of(&games)));
        }
        bar.finish_and_clear();
        let blue = blue.strategy.name.as_str();
        let mut objects: Vec<_> = all.iter().map(|(red, summary)| json(summary, [red, blue], self)).collect();
        let object = match objects.len() {
            1 => objects.swap_remove(0),
            _ => serde_json::json!({ "series": objects }),
        };
        output.show(&object, |paint| {
            let texts: Vec<_> = all.iter().map(|(red, summary)| text(summary, [red, blue], &settings, paint)).collect();
            texts.join("\n")
        })?;
        Ok(ExitCode::SUCCESS)
    }

    /// Where a replay is wanted, if one is: a file that can be written.
    fn replay_file(&self) -> Result<Option<PathBuf>, Failure> {
        let file = self.save.as_deref().map(|file| files::with_ending(file, "html"));
        let file = file.or_else(|| self.watch.then(|| Path::new("out/match/replay.html").to_owned()));
        if let Some(file) = &file {
            files::check_file(file)?;
        }
        Ok(file)
    }

    /// Writes a recorded game as a page, and opens it where the user wants to watch.
    fn write_replay(
        &self,
        file: &Path,
        recording: &Recording,
        field: &Field,
        names: [&str; 2],
        output: &Output,
    ) -> Result<(), Failure> {
        let page = page::page(recording, field, names).map_err(Failure::other)?;
        let mut batch = files::Batch::default();
        let staged = batch.stage(file)?;
        std::fs::write(&staged, page)
            .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", file.display())))?;
        batch.commit()?;
        output.remark(|paint| format!("{} {}", paint.faint("replay:"), file.display()));
        if self.watch {
            page::open(file);
        }
        Ok(())
    }
}

/// What every game of a series gave, for machines.
fn json(summary: &Summary, names: [&str; 2], args: &Match) -> serde_json::Value {
    let [low, high] = summary.interval(NORMAL_95);
    let [low_99, high_99] = summary.interval(NORMAL_99);
    let tally = &summary.tally;
    let per_minute = 60.0 / tally.open_play.max(1e-9);
    let games = summary.games as f64;
    let histogram: Vec<_> = summary
        .differences
        .iter()
        .map(|(difference, games)| serde_json::json!({ "difference": difference, "games": games }))
        .collect();
    serde_json::json!({
        "games": summary.games,
        "seed": args.seed,
        "rules": args.rules,
        "red": { "strategy": names[0], "goals_mean": summary.goals_mean[0] },
        "blue": { "strategy": names[1], "goals_mean": summary.goals_mean[1] },
        "difference_mean": summary.difference_mean,
        "difference_low": low,
        "difference_high": high,
        "difference_low_99": low_99,
        "difference_high_99": high_99,
        "won": summary.outcomes[0],
        "drawn": summary.outcomes[1],
        "lost": summary.outcomes[2],
        "histogram": histogram,
        "scores": summary.scores,
        "kicks_mean": f64::from(tally.kicks) / games,
        "removals_mean": f64::from(tally.removals) / games,
        "falls_mean": f64::from(tally.falls) / games,
        "restarts_mean": f64::from(tally.restarts) / games,
        "role_changes_per_minute": f64::from(tally.role_changes) * per_minute,
        "role_flickers_per_minute": f64::from(tally.role_flickers) * per_minute,
        "decisions": tally.decisions,
        "real_time_factor": tally.simulated / summary.cpu,
        "decision_p50_s": tally.decision_quantile(0.5),
        "decision_p99_s": tally.decision_quantile(0.99),
    })
}

fn text(summary: &Summary, names: [&str; 2], settings: &MatchSettings, paint: Paint) -> String {
    let mut text = String::new();
    let [low, high] = summary.interval(NORMAL_95);
    let [red, blue] = summary.goals_mean;
    let [won, drawn, lost] = summary.outcomes;
    let n = settings.players;
    let _ = writeln!(text, "{} games of {n} against {n} on {}", summary.games, settings.field.name);
    let _ = writeln!(text, "red  {:<10} {red:.2} goals a game", names[0]);
    let _ = writeln!(text, "blue {:<10} {blue:.2} goals a game", names[1]);
    let difference = format!("{:+.3}", summary.difference_mean);
    let verdict = if low > 0.0 {
        paint.good(&difference)
    } else if high < 0.0 {
        paint.bad(&difference)
    } else {
        difference
    };
    let _ = writeln!(
        text,
        "red's goal difference {verdict}, 95 % from {low:+.3} to {high:+.3}; won {won}, drawn {drawn}, lost {lost}"
    );
    let most = summary.differences.values().copied().max().unwrap_or(1).max(1);
    for (difference, games) in &summary.differences {
        let bar = "█".repeat((40 * games).div_ceil(most));
        let bar = if *difference > 0 { paint.bad(&bar) } else { paint.faint(&bar) };
        let _ = writeln!(text, "{difference:>+4} {games:>6} {bar}");
    }
    let tally = &summary.tally;
    let _ = writeln!(
        text,
        "{:.0} x real time a core; a decision p50 {:.1} us, p99 {:.1} us; role flickers {:.3} a minute and player",
        tally.simulated / summary.cpu,
        1e6 * tally.decision_quantile(0.5),
        1e6 * tally.decision_quantile(0.99),
        f64::from(tally.role_flickers) * 60.0 / tally.open_play.max(1e-9)
    );
    text
}
