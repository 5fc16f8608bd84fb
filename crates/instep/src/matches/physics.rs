//! `instep match --physics`: whole players on their own senses in one MuJoCo world, a game or paper 4's experiment.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use clap::Args;
use instep_behaviour::{KickTable, Strategy};
use instep_field::Field;
use instep_match::physics::fig12h::{self, Cause, Outcome, Seen};
use instep_match::physics::{Outfit, PhysicsMatch, Sight};
use instep_match::{EventKind, MatchSettings};
use instep_player::PlayerSettings;
use instep_robot::Robot;
use instep_sim::{NamedRate, Rate};
use rayon::prelude::*;
use serde::Serialize;

use super::{Match, page, space};
use crate::failure::Failure;
use crate::output::{self, Output, Paint};
use crate::{files, places};

/// Longest game, min.
const LONGEST: f64 = 60.0;

/// The arguments of a game in physics.
#[derive(Debug, Args)]
#[allow(clippy::struct_field_names, reason = "the names are the flags")]
pub(super) struct InPhysics {
    /// Play in MuJoCo: every robot on its own senses, its camera rendered
    #[arg(long)]
    pub(super) physics: bool,
    /// How long the game is, in minutes [default: to its end by the rules]
    #[arg(long, value_name = "MIN", requires = "physics", conflicts_with = "scene")]
    minutes: Option<f64>,
    /// An experiment in place of a game: fig12h, one robot, three opponents that stand anywhere, a ball in view
    #[arg(long, value_name = "SCENE", requires = "physics")]
    scene: Option<String>,
    /// Draw what cameras would find from the truth and its errors in place of rendering them: many times as fast
    #[arg(long, requires = "physics")]
    simulated_sight: bool,
    /// With --scene: how many set-ups
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    trials: u64,
    /// With --physics: folder for report.html and, of a game, flat.html [default: out/match]
    #[arg(long, value_name = "FOLDER", default_value = "out/match", requires = "physics")]
    out: PathBuf,
}

impl InPhysics {
    fn sight(&self) -> Sight {
        if self.simulated_sight { Sight::Simulated } else { Sight::Camera }
    }
}

/// Runs the command.
pub(super) fn run(args: &Match, output: &Output) -> Result<ExitCode, Failure> {
    let name = args.robot.as_deref().unwrap_or("artemis");
    let robot = Arc::new(places::robot(name)?);
    let kicks = KickTable::load(&places::kicks(&args.kicks)?)?;
    let player = PlayerSettings::load(&robot, Strategy::default(), &kicks).map_err(Failure::input)?;
    let folder = &args.in_physics.out;
    files::check_file(&folder.join("report.html"))?;
    match args.in_physics.scene.as_deref() {
        Some("fig12h") => scene(args, &robot, &player, output),
        Some(other) => Err(Failure::input(format!("--scene {other}: there is no such scene; expected fig12h"))),
        None => game(args, &robot, &player, output),
    }
}

/// How many players a team has.
fn players(flag: &str, given: Option<&PathBuf>) -> Result<usize, Failure> {
    let Some(given) = given else { return Ok(2) };
    let text = given.to_string_lossy();
    let most = instep_behaviour::MAX_TEAM;
    text.parse().ok().filter(|n| (1..=most).contains(n)).ok_or_else(|| {
        Failure::input(format!("{flag} {text}: expected with --physics how many play, a number from 1 to {most}"))
    })
}

/// What a game gave, for machines. SI units.
#[derive(Debug, Serialize)]
struct Played {
    robot: String,
    seed: u64,
    players: [usize; 2],
    simulated: f64,
    /// Simulated time over the time that it took.
    real_time_factor: f64,
    score: [u32; 2],
    kicks: u32,
    falls: u32,
    removals: u32,
    restarts: u32,
    /// Time for which no player moved the ball or itself in open play, the longest, s.
    stuck: f64,
    report: PathBuf,
}

fn game(args: &Match, robot: &Arc<Robot>, player: &PlayerSettings, output: &Output) -> Result<ExitCode, Failure> {
    let counts = [players("--red", args.red.first())?, players("--blue", args.blue.as_ref())?];
    let settings = Arc::new(MatchSettings::new(&args.rules, None)?);
    let minutes = args.in_physics.minutes.unwrap_or(f64::INFINITY);
    if !(minutes > 0.0 && (minutes <= LONGEST || args.in_physics.minutes.is_none())) {
        return Err(Failure::input(format!("--minutes {minutes}: expected more than 0 and at most {LONGEST}")));
    }
    let whole = settings.book.rules.half_time * settings.book.rules.halves as f64 + 600.0;
    let seconds = (60.0 * minutes).min(whole);
    let sight = args.in_physics.sight();
    let outfit = |players| Outfit { robot: Arc::clone(robot), settings: player.clone(), players, sight };
    let mut game = PhysicsMatch::new(Arc::clone(&settings), &counts.map(outfit), 0, args.seed)?;
    game.keep_motion();
    let bar = output::bar(seconds as u64, "{pos}/{len} s of the game {wide_bar} {eta}");
    let began = Instant::now();
    game.play(seconds, |time| bar.set_position(time as u64))?;
    let took = began.elapsed().as_secs_f64();
    bar.finish_and_clear();

    let tally = game.tally().clone();
    let score = game.result().score;
    let (flat, motion) = game.take_records();
    let folder = &args.in_physics.out;
    let (report, above) = (folder.join("report.html"), folder.join("flat.html"));
    let stuck = stuck(&flat);
    let played = Played {
        robot: robot.name.clone(),
        seed: args.seed,
        players: counts,
        simulated: tally.simulated,
        real_time_factor: tally.simulated / took,
        score,
        kicks: tally.kicks,
        falls: tally.falls,
        removals: tally.removals,
        restarts: tally.restarts,
        stuck,
        report: report.clone(),
    };
    let mut batch = files::Batch::default();
    let title = format!("{} : {}", score[0], score[1]);
    let subtitle = format!(
        "{} against {} {} \u{b7} {:.0} s in physics \u{b7} seed {}",
        counts[0], counts[1], robot.title, tally.simulated, args.seed
    );
    let facts = [
        ("Kicks", tally.kicks.to_string()),
        ("Falls", tally.falls.to_string()),
        ("Sent off", tally.removals.to_string()),
        ("Restarts", tally.restarts.to_string()),
        ("Longest standstill", format!("{stuck:.0} s")),
        ("Speed", format!("{:.2} x real time", tally.simulated / took)),
    ];
    let events = flat.events.iter().filter_map(|event| {
        let label = match event.kind {
            EventKind::Goal { team } => format!("goal {}", ["red", "blue"][team.min(1)]),
            EventKind::Fall { team, number } => format!("{} {number} falls", ["red", "blue"][team.min(1)]),
            EventKind::Kick { team, number } => format!("{} {number} kicks", ["red", "blue"][team.min(1)]),
            EventKind::Whistle => "whistle".into(),
            _ => return None,
        };
        Some((event.time, label))
    });
    let scene = space::Scene {
        field: &settings.field,
        robot,
        teams: (0..counts[0] + counts[1]).map(|i| usize::from(i >= counts[0])).collect(),
        motion: motion.as_ref(),
        flat: &flat,
        events: events.collect(),
    };
    space::report(title, subtitle, &facts, Vec::new(), &scene).save(batch.stage(&report)?)?;
    let flat_page = page::page(&flat, &settings.field, ["red", "blue"]).map_err(Failure::other)?;
    let staged = batch.stage(&above)?;
    std::fs::write(&staged, flat_page)
        .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", above.display())))?;
    batch.commit()?;
    output.show(&played, |paint| {
        let mut text = format!("{}\n", paint.strong(&format!("red {} : {} blue", score[0], score[1])));
        for (label, value) in &facts {
            let _ = writeln!(text, "  {} {value}", paint.faint(&format!("{label:<20}")));
        }
        text + &format!("\nwrote {} and {}", report.display(), above.display())
    })?;
    Ok(ExitCode::SUCCESS)
}

/// The longest time in open play in which nobody walked 0.3 m and the ball lay still, s.
fn stuck(flat: &instep_match::Recording) -> f64 {
    let (mut longest, mut anchor): (f64, Option<usize>) = (0.0, None);
    for (i, frame) in flat.frames.iter().enumerate() {
        let moved = |from: usize| {
            let then = &flat.frames[from];
            let far = |a: &[f32], b: &[f32]| (a[0] - b[0]).hypot(a[1] - b[1]) > 0.3;
            far(&then.ball, &frame.ball) || then.robots.iter().zip(&frame.robots).any(|(a, b)| far(&a.pose, &b.pose))
        };
        if !frame.state.starts_with("Playing") {
            anchor = None;
        } else if anchor.is_none_or(moved) {
            anchor = Some(i);
        }
        if let Some(from) = anchor {
            longest = longest.max(frame.time - flat.frames[from].time);
        }
    }
    longest
}

/// What a scene's trials gave, for machines. Keys are stable. SI units.
#[derive(Debug, Serialize)]
struct Trials<'a> {
    scene: &'static str,
    robot: &'a str,
    seed: u64,
    trials: usize,
    #[serde(flatten)]
    scored: NamedRate,
    #[serde(flatten)]
    fell: NamedRate,
    #[serde(flatten)]
    touched: NamedRate,
    /// Of those that scored, s; null when none did.
    time_median: Option<f64>,
    /// How many trials failed by each cause.
    causes: std::collections::BTreeMap<&'static str, usize>,
    real_time_factor: f64,
    outcomes: &'a [Outcome],
    report: &'a Path,
}

fn scene(args: &Match, robot: &Arc<Robot>, player: &PlayerSettings, output: &Output) -> Result<ExitCode, Failure> {
    let field = Arc::new(Field::named_or_load(&args.rules)?);
    let (count, sight) = (args.in_physics.trials, args.in_physics.sight());
    let bar = output::bar(count, "{pos}/{len} trials {wide_bar} {eta}");
    let began = Instant::now();
    let outcomes: Vec<Outcome> = (0..count)
        .into_par_iter()
        .map(|i| {
            let outcome = fig12h::play(&field, robot, player, sight, args.seed + i, None);
            bar.inc(1);
            outcome
        })
        .collect::<Result<_, _>>()?;
    bar.finish_and_clear();
    let simulated: f64 = outcomes.iter().map(|outcome| outcome.time).sum();
    let real_time_factor = simulated / began.elapsed().as_secs_f64();

    let n = outcomes.len();
    let share = |good: &dyn Fn(&Outcome) -> bool| outcomes.iter().filter(|outcome| good(outcome)).count();
    let mut times: Vec<f64> = outcomes.iter().filter_map(|outcome| outcome.scored_at).collect();
    times.sort_by(f64::total_cmp);
    let mut causes = std::collections::BTreeMap::new();
    for cause in outcomes.iter().filter_map(|outcome| outcome.cause) {
        *causes.entry(cause.name()).or_insert(0) += 1;
    }
    // The first failure is what one wants to see; of none, the first trial.
    let shown = outcomes.iter().find(|outcome| outcome.cause.is_some()).or(outcomes.first());
    let report = args.in_physics.out.join("report.html");
    let trials = Trials {
        scene: "fig12h",
        robot: &robot.name,
        seed: args.seed,
        trials: n,
        scored: NamedRate::of("scored_rate", share(&|o| o.scored_at.is_some()), n),
        fell: NamedRate::of("fell_rate", share(&|o| o.fell_at.is_some()), n),
        touched: NamedRate::of("touched_rate", share(&|o| o.touched), n),
        time_median: times.get(times.len() / 2).copied(),
        causes,
        real_time_factor,
        outcomes: &outcomes,
        report: &report,
    };
    let mut batch = files::Batch::default();
    let facts = trials.facts();
    if let Some(shown) = shown {
        let mut seen = Seen::default();
        fig12h::play(&field, robot, player, sight, shown.seed, Some(&mut seen))?;
        let mut events = Vec::new();
        events.extend(shown.scored_at.map(|time| (time, "goal".to_owned())));
        events.extend(shown.fell_at.map(|time| (time, "falls".to_owned())));
        let scene = space::Scene {
            field: &field,
            robot,
            teams: (0..=fig12h::OPPONENTS).map(|i| usize::from(i > 0)).collect(),
            motion: Some(&seen.motion),
            flat: &seen.flat,
            events,
        };
        let title = format!("{} of {n} scored", times.len());
        let subtitle = format!(
            "{} \u{b7} paper 4, figure 12 H, in physics \u{b7} seeds {} to {} \u{b7} shown: seed {}{}",
            robot.title,
            args.seed,
            args.seed + count - 1,
            shown.seed,
            shown.cause.map_or(String::new(), |cause| format!(", {}", cause.name()))
        );
        space::report(title, subtitle, &facts, vec![space::trials(&outcomes)], &scene).save(batch.stage(&report)?)?;
    }
    batch.commit()?;
    output.show(&trials, |paint| trials.text(&facts, paint))?;
    Ok(ExitCode::SUCCESS)
}

impl Trials<'_> {
    fn facts(&self) -> Vec<(&'static str, String)> {
        let rate = |named: &NamedRate| {
            named.rate.map_or("-".to_owned(), |Rate { share, low, high }| {
                format!("{:.0} % ({:.0} to {:.0})", 100.0 * share, 100.0 * low, 100.0 * high)
            })
        };
        let mut facts = vec![
            ("Scored", rate(&self.scored)),
            ("Fell", rate(&self.fell)),
            ("Touched", rate(&self.touched)),
            ("Time, median", self.time_median.map_or("-".into(), |time| format!("{time:.1} s"))),
        ];
        let causes: Vec<String> = self.causes.iter().map(|(cause, n)| format!("{cause} {n}")).collect();
        facts.push(("Causes", if causes.is_empty() { "-".into() } else { causes.join(", ") }));
        facts.push(("Speed", format!("{:.2} x real time", self.real_time_factor)));
        facts
    }

    fn text(&self, facts: &[(&str, String)], paint: Paint) -> String {
        let mut text = format!("{}\n", paint.strong(&format!("{} trials of figure 12 H, {}", self.trials, self.robot)));
        for (label, value) in facts {
            let _ = writeln!(text, "  {} {value}", paint.faint(&format!("{label:<14}")));
        }
        text + &format!("\nwrote {}", self.report.display())
    }
}

/// Every cause, for the report's words.
pub(super) fn words(cause: Cause) -> String {
    cause.name().replace('_', " ")
}
