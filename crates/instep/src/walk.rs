//! `instep walk`: a robot walks on its senses at a velocity or to a place; what happens is measured and shown.

mod page;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use instep_bench::walking::{self, Asked, WalkTask, Walked};
use instep_robot::Robot;
use instep_sim::settings::Change;
use instep_walk::{Velocity, WalkSettings};
use serde::Serialize;

use crate::failure::Failure;
use crate::output::{self, Output, Paint};
use crate::{files, places, worlds};

/// The longest walk, s.
const LONGEST: f64 = 3600.0;
/// The farthest goal, m: nobody's pitch is larger.
const FARTHEST: f64 = 120.0;

/// The arguments of `instep walk`.
#[derive(Debug, Args)]
pub(crate) struct Walk {
    /// The robot: a name, or the path of its folder or robot.toml
    #[arg(long, value_name = "ROBOT", default_value = "artemis")]
    robot: String,
    /// Velocity: ahead and to the left in m/s, turn to the left in rad/s
    #[arg(long, value_name = "X,Y,W", allow_hyphen_values = true, value_parser = triple, conflicts_with = "to")]
    velocity: Option<[f64; 3]>,
    /// Where to walk: x and y in metres and heading, such as 3,1,90deg, from where the robot stands
    #[arg(long, value_name = "X,Y,ANGLE", allow_hyphen_values = true, value_parser = place)]
    to: Option<[f64; 3]>,
    /// How long to walk before the stop, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, allow_negative_numbers = true)]
    duration: f64,
    /// Seed of all sensor noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The world: "ideal" for perfect drives and senses, or a TOML file; what is absent in it keeps its default
    #[arg(long, value_name = "FILE")]
    world: Option<PathBuf>,
    /// Push the trunk at this time in seconds for 0.1 s with this impulse in N s: T,X,Y
    #[arg(long, value_name = "T,X,Y", allow_hyphen_values = true, value_parser = triple)]
    push: Option<[f64; 3]>,
    /// Folder for report.html
    #[arg(long, value_name = "FOLDER", default_value = "out/walk")]
    out: PathBuf,
}

/// A walk with all that the report needs.
pub(crate) struct Made {
    robot: Arc<Robot>,
    task: WalkTask,
    /// What is not as in the robot's default world.
    world_changes: Vec<Change>,
    wanted: Option<Velocity>,
    walked: Walked,
}

fn numbers(text: &str) -> Result<[f64; 3], String> {
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let [x, y, z] = parts[..] else { return Err("expected three numbers with commas, such as 1.0,0,0.2".into()) };
    let number = |text: &str| {
        text.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| format!("\"{text}\" is no finite number"))
    };
    Ok([number(x)?, number(y)?, number(z)?])
}

fn triple(text: &str) -> Result<[f64; 3], String> {
    numbers(text)
}

/// As [`numbers`], the last with an optional unit `deg` or `rad`; degrees without one.
fn place(text: &str) -> Result<[f64; 3], String> {
    let (bare, in_radians) = match text.trim() {
        t if t.ends_with("deg") => (t.trim_end_matches("deg"), false),
        t if t.ends_with("rad") => (t.trim_end_matches("rad"), true),
        t => (t, false),
    };
    let [x, y, angle] = numbers(bare)?;
    Ok([x, y, if in_radians { angle } else { angle.to_radians() }])
}

impl Walk {
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        if !(self.duration > 0.0 && self.duration <= LONGEST) {
            let message = format!("--duration {}: expected more than 0 s and at most {LONGEST} s", self.duration);
            return Err(Failure::input(message));
        }
        if let Some([x, y, _]) = self.to
            && x.hypot(y) > FARTHEST
        {
            return Err(Failure::input(format!(
                "--to {x},{y}: off the field; expected at most {FARTHEST} m from the robot"
            )));
        }
        let robot = Arc::new(places::robot(&self.robot)?);
        let settings = WalkSettings::load(&robot)?;
        let report = self.out.join("report.html");
        files::check_file(&report)?;
        let default = worlds::default(&robot)?;
        let world = worlds::asked(self.world.as_deref(), &default)?;
        let world_changes = world.changes(&default);
        let wanted = self.velocity.map(|[x, y, turn]| Velocity { x, y, turn });
        let asked = match (wanted, self.to) {
            (_, Some(goal)) => Asked::Goal(goal),
            (Some(velocity), None) => Asked::Velocity(velocity),
            (None, None) => {
                return Err(Failure::input("nothing to do: expected --velocity X,Y,W or --to X,Y,ANGLE"));
            }
        };
        let pushes = self.push.iter().map(|&[time, x, y]| {
            let duration = 0.1;
            walking::Push { time, duration, force: [x / duration, y / duration, 0.0] }
        });
        let task = WalkTask { asked, duration: self.duration, seed: self.seed, world, pushes: pushes.collect() };
        let bar = output::bar(((self.duration + walking::AFTER) * 10.0) as u64, "{bar:40} {percent} % walked");
        let walked = walking::walk(&robot, settings, &task, |time| bar.set_position((time * 10.0) as u64))?;
        bar.finish_and_clear();

        let made = Made { robot, task, world_changes, wanted, walked };
        let mut batch = files::Batch::default();
        page::page(&made).save(batch.stage(&report)?)?;
        batch.commit()?;
        output.show(&Measures::new(&made, &report), |paint| made.text(paint, &report))?;
        Ok(ExitCode::SUCCESS)
    }
}

impl Made {
    /// What of the asked velocity the robot is not allowed.
    fn clipped(&self) -> Option<String> {
        let (wanted, asked) = (self.wanted?, self.walked.asked);
        (wanted != asked).then(|| {
            format!(
                "{} can do ({:.2}, {:.2}) m/s and {:.2} rad/s of the asked ({:.2}, {:.2}) m/s and {:.2} rad/s",
                self.robot.name, asked.x, asked.y, asked.turn, wanted.x, wanted.y, wanted.turn
            )
        })
    }

    fn text(&self, paint: Paint, report: &std::path::Path) -> String {
        let walked = &self.walked;
        let mut text = format!("{}\n", paint.strong(&self.robot.title));
        let mut row =
            |label: &str, value: String| text += &format!("  {} {value}\n", paint.faint(&format!("{label:<15}")));
        for change in &self.world_changes {
            row("changed world", paint.bad(&change.to_string()));
        }
        if let Some(clipped) = self.clipped() {
            row("clipped", paint.warn(&clipped));
        }
        match walked.fell_at {
            None => {
                row("balance", paint.good(&format!("upright to the end, {:.1} s", self.task.duration + walking::AFTER)))
            }
            Some(time) => row("balance", paint.bad(&format!("fell at {time:.2} s"))),
        }
        let (mean, asked) = (walked.mean, walked.asked);
        if matches!(self.task.asked, Asked::Velocity(_)) {
            let velocity = |v: Velocity| format!("({:.3}, {:.3}) m/s, {:.3} rad/s", v.x, v.y, v.turn);
            row("asked", velocity(asked));
            row("walked", format!("{}, error {:.1} %", velocity(mean), walked.error * 100.0));
        }
        if let Some([distance, angle]) = walked.goal_error {
            row("from the goal", format!("{distance:.3} m, {:.1}\u{b0}", angle.to_degrees()));
        }
        row("way", format!("{:.2} m in {} steps", walked.distance, walked.counts.steps));
        row(
            "estimate",
            format!(
                "off by {:.1} % of the way and {:.1}\u{b0}; velocity {:.3} m/s rms",
                walked.drift_share * 100.0,
                walked.heading_error.to_degrees(),
                walked.velocity_error
            ),
        );
        row("stop", walked.stop_time.map_or_else(|| "not stopped".into(), |time| format!("after {time:.2} s")));
        row(
            "tick",
            format!(
                "whole-body controller {:.0} us, all {:.0} us (99 %); {:.1} times real time",
                walked.tick_p99[0] * 1e6,
                walked.tick_p99[1] * 1e6,
                walked.real_time_factor
            ),
        );
        let counts = walked.counts;
        if counts.relaxed + counts.unsolved > 0 {
            row(
                "fall-backs",
                paint.warn(&format!(
                    "{} ticks without joint ranges, {} without solution, of {}",
                    counts.relaxed, counts.unsolved, counts.ticks
                )),
            );
        }
        text + &format!("\nwrote {}", report.display())
    }
}

/// What `--json` prints. Keys are stable: they may be added to, never renamed. SI units.
#[derive(Debug, Serialize)]
struct Measures<'a> {
    robot: &'a str,
    duration: f64,
    seed: u64,
    /// Null when the robot did not fall.
    fell_at: Option<f64>,
    /// Within the robot's limits; null for a goal.
    speed_asked: Option<f64>,
    velocity_asked: [f64; 3],
    /// Length of the mean velocity over the ground.
    speed_mean: f64,
    velocity_mean: [f64; 3],
    speed_error: Option<f64>,
    /// What was asked beyond the limits, in words.
    clipped: Option<String>,
    distance: f64,
    drift_share: f64,
    /// Of the estimate at the end.
    heading_error_deg: f64,
    velocity_error_rms: f64,
    stop_time: Option<f64>,
    goal_error: Option<f64>,
    goal_error_deg: Option<f64>,
    steps: usize,
    late_touchdowns: usize,
    relaxed_ticks: usize,
    unsolved_ticks: usize,
    wbc_p99_s: f64,
    tick_p99_s: f64,
    real_time_factor: f64,
    world_changes: &'a [Change],
    report: &'a std::path::Path,
}

impl<'a> Measures<'a> {
    fn new(made: &'a Made, report: &'a std::path::Path) -> Self {
        let walked = &made.walked;
        let (mean, asked) = (walked.mean, walked.asked);
        let by_velocity = matches!(made.task.asked, Asked::Velocity(_));
        Self {
            robot: &made.robot.name,
            duration: made.task.duration,
            seed: made.task.seed,
            fell_at: walked.fell_at,
            speed_asked: by_velocity.then(|| asked.x.hypot(asked.y)),
            velocity_asked: [asked.x, asked.y, asked.turn],
            speed_mean: mean.x.hypot(mean.y),
            velocity_mean: [mean.x, mean.y, mean.turn],
            speed_error: by_velocity.then_some(walked.error),
            clipped: made.clipped(),
            distance: walked.distance,
            drift_share: walked.drift_share,
            heading_error_deg: walked.heading_error.to_degrees(),
            velocity_error_rms: walked.velocity_error,
            stop_time: walked.stop_time,
            goal_error: walked.goal_error.map(|error| error[0]),
            goal_error_deg: walked.goal_error.map(|error| error[1].to_degrees()),
            steps: walked.counts.steps,
            late_touchdowns: walked.counts.late,
            relaxed_ticks: walked.counts.relaxed,
            unsolved_ticks: walked.counts.unsolved,
            wbc_p99_s: walked.tick_p99[0],
            tick_p99_s: walked.tick_p99[1],
            real_time_factor: walked.real_time_factor,
            world_changes: &made.world_changes,
            report,
        }
    }
}
