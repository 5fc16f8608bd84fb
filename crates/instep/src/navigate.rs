//! `instep navigate`: a robot walks a scenario by DAVG and cf-MPC, on a point robot or on its legs in the physics world.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use instep_bench::cpu::thread_seconds;
use instep_bench::walking_body::{self, WalkingBody};
use instep_field::Field;
use instep_navigation::scenario::{DELAYS, Scenario};
use instep_navigation::trial::{self, Outcome, statistics};
use instep_navigation::{Model, PointRobot, RobotLimits, Settings, Tracker};
use instep_robot::Robot;
use rayon::prelude::*;
use serde::Serialize;

use crate::failure::Failure;
use crate::output::{self, Output, Paint};
use crate::{files, places};

mod page;

/// The field of all scenarios.
const FIELD: &str = "adult-2024";
/// Runs on a walking robot, where nobody says how many: physics is a thousand times dearer.
const WALKED: usize = 3;

/// The arguments of `instep navigate`.
#[derive(Debug, Args)]
pub(crate) struct Navigate {
    /// star, two-obstacles, three-obstacles, crossing, blocking, wall, chasing, head-on, two-chasers, sideways, round-ball,
    /// behind-ball, start-inside, goal-inside, off-field, enclosed
    #[arg(long, value_name = "NAME", default_value = "star")]
    scenario: String,
    /// Seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Number of runs; the scenario's own by default
    #[arg(long, value_name = "K")]
    runs: Option<usize>,
    /// A walking robot (artemis), by name or path; a point robot by default
    #[arg(long, value_name = "ROBOT")]
    robot: Option<String>,
    /// The walking robot is told where it is, in place of localising itself
    #[arg(long, requires = "robot")]
    true_pose: bool,
    /// Folder for report.html
    #[arg(long, value_name = "FOLDER", default_value = "out/navigate")]
    out: PathBuf,
}

/// What follows the path, by name; the first is what is shipped.
const METHODS: [(&str, Tracker, Model); 4] = [
    ("cf-MPC nonlinear", Tracker::Nonlinear, Model::Lagged),
    ("cf-MPC linearised", Tracker::Linearised, Model::Lagged),
    ("direct", Tracker::Direct, Model::Lagged),
    ("printed kinematic", Tracker::Nonlinear, Model::Printed),
];

/// One method's measures. SI units.
#[derive(Debug, Clone, Serialize)]
struct Row {
    name: &'static str,
    runs: usize,
    /// Of the distance at equal time (star), else from the path.
    mae: f64,
    mse: f64,
    std: f64,
    /// Deepest in a keep-out; 0 when never inside.
    worst_keep_out: f64,
    /// Farthest beyond the edge.
    worst_border: f64,
    contact_rate: f64,
    reached_rate: f64,
    stuck_rate: f64,
    fell_rate: f64,
    /// Changes of side in 5 s.
    flips_in_5_s: f64,
    mean_time: f64,
    /// Ends within 0.10 m and 5 degrees of the wanted pose.
    placed_rate: f64,
    solve_p99_s: f64,
    plan_p99_s: f64,
}

/// One delay of a sweep.
#[derive(Debug, Clone, Serialize)]
struct Swept {
    delay: f64,
    worst_keep_out: f64,
    mean_time: f64,
}

/// The whole result: the shipped method's measures, then all methods'.
#[derive(Debug, Serialize)]
struct Table {
    scenario: String,
    robot: String,
    seed: u64,
    #[serde(flatten)]
    shipped: Row,
    /// What stopped the robot, in words, each once.
    causes: Vec<String>,
    /// Why the goal was replaced.
    goal_replaced: Option<String>,
    /// Of `three-obstacles`.
    delays: Vec<Swept>,
    /// Why runs ended before their time.
    failures: Vec<String>,
    methods: Vec<Row>,
}

impl Navigate {
    /// Runs the command.
    ///
    /// # Errors
    /// When a name is not known, or a file cannot be used.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        let scenario = Scenario::named(&self.scenario).map_err(|e| Failure::from(e).about("--scenario"))?;
        let robot = self.robot.as_deref().map(places::robot).transpose()?.map(Arc::new);
        let runs = self.runs.unwrap_or(if robot.is_some() { scenario.runs.min(WALKED) } else { scenario.runs });
        if !(1..=10_000).contains(&runs) {
            return Err(Failure::input(format!("--runs: {runs}; expected a number from 1 to 10000")));
        }
        let report = self.out.join("report.html");
        files::check_file(&report)?;
        let field = Field::named(FIELD)?;
        let limits = robot.as_deref().map_or_else(|| Ok(RobotLimits::default()), walking_body::limits)?;
        // In physics the others are followed where paper 4 compares them, and nowhere else: each costs as much as the shipped one.
        let methods = if robot.is_some() && scenario.name != "star" { 1 } else { METHODS.len() };
        let jobs: Vec<(usize, usize)> = (0..methods).flat_map(|m| (0..runs).map(move |r| (m, r))).collect();
        let bar = output::bar(jobs.len() as u64, "{wide_bar} {pos}/{len} runs {eta}");
        let outcomes = jobs.par_iter().map(|&(method, run)| {
            let outcome = self.one(scenario, &field, robot.as_ref(), limits, method, run);
            bar.inc(1);
            outcome
        });
        let outcomes: Vec<Outcome> = outcomes.collect::<Result<_, Failure>>()?;
        bar.finish_and_clear();

        let groups: Vec<&[Outcome]> = outcomes.chunks(runs).collect();
        let methods: Vec<Row> = groups.iter().zip(METHODS).map(|(group, (name, ..))| row(name, group)).collect();
        let (shipped, group) = (methods[0].clone(), groups[0]);
        let mut causes: Vec<String> = Vec::new();
        for cause in group.iter().flat_map(|o| &o.causes).map(ToString::to_string) {
            if !causes.contains(&cause) {
                causes.push(cause);
            }
        }
        let table = Table {
            scenario: self.scenario.clone(),
            robot: robot.as_ref().map_or_else(|| "point robot".to_owned(), |r| r.name.clone()),
            seed: self.seed,
            shipped,
            causes,
            goal_replaced: group.iter().find_map(|o| o.replaced).map(|why| why.to_string()),
            delays: if scenario.name == "three-obstacles" { sweep(group) } else { Vec::new() },
            failures: group.iter().filter_map(|o| o.failed.clone()).collect(),
            methods,
        };
        let mut batch = files::Batch::default();
        page::page(&table, scenario.title, &field, &groups).save(batch.stage(&report)?)?;
        batch.commit()?;
        output.show(&table, |paint| text(&table, scenario.title, &report, paint))?;
        Ok(ExitCode::SUCCESS)
    }

    fn one(
        &self,
        scenario: &Scenario,
        field: &Field,
        robot: Option<&Arc<Robot>>,
        limits: RobotLimits,
        method: usize,
        run: usize,
    ) -> Result<Outcome, Failure> {
        let (_, tracker, model) = METHODS[method];
        let settings = Settings { tracker, model, ..Settings::default() };
        let setup = scenario.setup(self.seed, run, &limits);
        let seed = self.seed.wrapping_mul(1_000_003).wrapping_add(run as u64);
        let clock = thread_seconds as fn() -> f64;
        let outcome = match robot {
            None => {
                let limits = RobotLimits { delay: setup.delay.unwrap_or(limits.delay), ..limits };
                let mut body = PointRobot::new(limits, setup.start, 1.0, seed);
                trial::run(&setup, field, limits, settings, &mut body, seed, clock)?
            }
            Some(robot) => {
                let mut body = WalkingBody::new(robot, field, setup.start, !self.true_pose, seed)?;
                trial::run(&setup, field, limits, settings, &mut body, seed, clock)?
            }
        };
        Ok(outcome)
    }
}

fn p99(times: impl Iterator<Item = f64>) -> f64 {
    let mut times: Vec<f64> = times.collect();
    times.sort_by(f64::total_cmp);
    times.get(times.len().saturating_sub(1) * 99 / 100).copied().unwrap_or(0.0)
}

fn row(name: &'static str, group: &[Outcome]) -> Row {
    let count = group.len() as f64;
    let rate = |is: fn(&Outcome) -> bool| group.iter().filter(|o| is(o)).count() as f64 / count;
    let [mae, mse, std] = statistics(group.iter().flat_map(|o| o.errors.iter().copied()));
    let time: f64 = group.iter().map(|o| o.time).sum();
    Row {
        name,
        runs: group.len(),
        mae,
        mse,
        std,
        worst_keep_out: group.iter().fold(0.0, |most, o| o.depth.max(most)),
        worst_border: group.iter().fold(0.0, |most, o| o.beyond.max(most)),
        contact_rate: rate(|o| o.contact),
        reached_rate: rate(|o| o.reached),
        stuck_rate: rate(|o| o.stuck),
        fell_rate: rate(|o| o.failed.is_some()),
        flips_in_5_s: 5.0 * group.iter().map(|o| o.flips as f64).sum::<f64>() / time.max(1e-9),
        mean_time: time / count,
        placed_rate: rate(|o| o.reached && o.from_goal[0] <= 0.10 && o.from_goal[1] <= 5.0_f64.to_radians()),
        solve_p99_s: p99(group.iter().flat_map(|o| o.solves.iter().copied())),
        plan_p99_s: p99(group.iter().flat_map(|o| o.plans.iter().copied())),
    }
}

fn sweep(group: &[Outcome]) -> Vec<Swept> {
    let of = |k: usize| group.iter().skip(k).step_by(DELAYS.len());
    let swept = DELAYS.iter().enumerate().filter(|(k, _)| of(*k).count() > 0).map(|(k, &delay)| Swept {
        delay,
        worst_keep_out: of(k).fold(0.0, |most, o| o.depth.max(most)),
        mean_time: of(k).map(|o| o.time).sum::<f64>() / of(k).count() as f64,
    });
    swept.collect()
}

/// Column heads and cells of the table, for people.
fn cells(row: &Row) -> Vec<(&'static str, String)> {
    let per_cent = |rate: f64| format!("{:.0}", 100.0 * rate);
    vec![
        ("follows by", row.name.to_owned()),
        ("MAE m", format!("{:.3}", row.mae)),
        ("MSE m\u{b2}", format!("{:.4}", row.mse)),
        ("STD m", format!("{:.3}", row.std)),
        ("in keep-out m", format!("{:.3}", row.worst_keep_out)),
        ("beyond edge m", format!("{:.2}", row.worst_border)),
        ("contact %", per_cent(row.contact_rate)),
        ("reached %", per_cent(row.reached_rate)),
        ("stuck %", per_cent(row.stuck_rate)),
        ("fell %", per_cent(row.fell_rate)),
        ("flips/5 s", format!("{:.2}", row.flips_in_5_s)),
        ("time s", format!("{:.1}", row.mean_time)),
        ("0.1 m 5\u{b0} %", per_cent(row.placed_rate)),
        ("solve p99 ms", format!("{:.3}", 1e3 * row.solve_p99_s)),
        ("plan p99 ms", format!("{:.3}", 1e3 * row.plan_p99_s)),
    ]
}

fn text(table: &Table, title: &str, report: &std::path::Path, paint: Paint) -> String {
    let rows: Vec<_> = table.methods.iter().map(cells).collect();
    let mut text = format!(
        "{} \u{b7} {title} \u{b7} {} \u{b7} {} runs, seed {}\n",
        paint.strong(&table.scenario),
        table.robot,
        table.shipped.runs,
        table.seed
    );
    for k in 0..rows[0].len() {
        let values: Vec<String> = rows.iter().map(|row| format!("{:>18}", row[k].1)).collect();
        text += &format!("  {} {}\n", paint.faint(&format!("{:<14}", rows[0][k].0)), values.join(" "));
    }
    for swept in &table.delays {
        text += &format!(
            "  {} {:.3} m in a keep-out, {:.1} s\n",
            paint.faint(&format!("delay {:.2} s", swept.delay)),
            swept.worst_keep_out,
            swept.mean_time
        );
    }
    for cause in &table.causes {
        text += &format!("  {} {cause}\n", paint.faint("stopped       "));
    }
    if let Some(why) = &table.goal_replaced {
        text += &format!("  {} {why}\n", paint.faint("goal replaced "));
    }
    for failure in &table.failures {
        text += &format!("  {} {failure}\n", paint.bad("failed        "));
    }
    text + &paint.faint(&format!("report: {}", report.display()))
}
