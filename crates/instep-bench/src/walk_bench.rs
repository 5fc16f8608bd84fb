//! The walking bench: robots x scenarios x seeds of [`crate::walking::walk`], one row a robot and scenario.
//!
//! A scenario is what is asked, what disturbs and where; its speeds are absolute, and a robot that may not walk so fast is not asked. A
//! push has the impulse of 20 (30) N s on ARTEMIS; on other robots it is scaled with m sqrt(g H), so that it is the same
//! disturbance of the pendulum. All chance (senses, directions, times, mixed velocities) comes from the seed.

use std::f64::consts::TAU;
use std::sync::Arc;

use instep_robot::Robot;
use instep_sim::NamedRate;
use instep_sim::settings::WorldSettings;
use instep_walk::{Velocity, WalkSettings};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

use crate::BenchError;
use crate::walking::{Asked, Push, WalkTask, walk};

/// How long a robot walks, s, and how long in a long walk.
const DURATION: [f64; 2] = [12.0, 60.0];
/// How long a push lasts, s.
const PUSH: f64 = 0.1;
/// m sqrt(g H) of the robot that the pushes are stated for, kg m/s: ARTEMIS.
const MOMENTUM: f64 = 37.5 * 2.63;
/// Speeds ahead, m/s.
const AHEAD: [f64; 5] = [0.1, 0.2, 0.5, 0.8, 1.2];
/// Those of the long walks, m/s.
const LONG: [f64; 4] = [0.2, 0.25, 0.8, 1.2];

/// One scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct WalkScenario {
    /// Its name, like `ahead-0.5`.
    pub name: String,
    what: What,
    /// s.
    duration: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum What {
    /// This velocity.
    Steady(Velocity),
    /// A velocity within the limits, from the seed.
    Mix,
    /// Walks at half of what it can and is pushed once with this impulse (N s, for ARTEMIS).
    Push(f64),
    /// Half of what it can on a ground with this time constant, s.
    Turf(f64),
}

/// One row: a robot in a scenario. Speeds, errors and times are of the walks that stayed upright.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WalkRow {
    /// Robot.
    pub robot: String,
    /// Scenario.
    pub scenario: String,
    /// Walks.
    pub trials: usize,
    /// Share that stayed upright, with its 95 % interval.
    #[serde(flatten)]
    pub upright: NamedRate,
    /// Mean speed over the ground, m/s (rad/s where only a turn is asked).
    pub speed_mean: Option<f64>,
    /// Mean error of a walk's mean velocity, as a share of what was asked; least and greatest.
    pub speed_error: Option<f64>,
    /// See `speed_error`.
    pub speed_error_low: Option<f64>,
    /// See `speed_error`.
    pub speed_error_high: Option<f64>,
    /// Median time of the stop, s.
    pub stop_time: Option<f64>,
    /// Greatest time of the stop, s.
    pub stop_time_high: Option<f64>,
    /// Median drift of the estimate as a share of the way.
    pub drift_share: Option<f64>,
    /// Root mean square error of the estimated velocity over all walks, m/s.
    pub velocity_error_rms: Option<f64>,
    /// Greatest of the walks' times that 99 of 100 ticks keep, s: whole-body controller and all.
    pub wbc_p99_s: Option<f64>,
    /// See `wbc_p99_s`.
    pub tick_p99_s: Option<f64>,
    /// Impulse of the push, N s.
    pub impulse: Option<f64>,
}

/// What one walk came to.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    fell: bool,
    speed: f64,
    error: f64,
    stop: Option<f64>,
    drift: f64,
    velocity_error: f64,
    ticks: [f64; 2],
}

/// All scenarios.
#[must_use]
pub fn scenarios() -> Vec<WalkScenario> {
    let scenario = |name: String, what| WalkScenario { name, what, duration: DURATION[0] };
    let steady = |name: String, x: f64, y: f64, turn: f64| scenario(name, What::Steady(Velocity { x, y, turn }));
    let mut all: Vec<_> = AHEAD.iter().map(|&x| steady(format!("ahead-{x}"), x, 0.0, 0.0)).collect();
    all.extend(LONG.iter().map(|&x| {
        let long = steady(format!("ahead-{x}-long"), x, 0.0, 0.0);
        WalkScenario { duration: DURATION[1], ..long }
    }));
    all.push(steady("sideways-0.4".into(), 0.0, 0.4, 0.0));
    all.push(steady("turn-1".into(), 0.0, 0.0, 1.0));
    all.push(scenario("mix".into(), What::Mix));
    all.push(scenario("push-20".into(), What::Push(20.0)));
    all.push(scenario("push-30".into(), What::Push(30.0)));
    all.push(scenario("soft-turf".into(), What::Turf(0.03)));
    all
}

impl WalkScenario {
    /// The walk of `robot` with `seed` in `world`; `None` when the robot cannot be asked that.
    #[must_use]
    pub fn task(&self, robot: &Robot, settings: &WalkSettings, world: &WorldSettings, seed: u64) -> Option<WalkTask> {
        let limits = &settings.limits;
        // A stream of its own: the sensors draw from the seed itself.
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(11);
        let mut world = *world;
        let mut pushes = Vec::new();
        let half = Velocity { x: 0.5 * limits.forward, y: 0.0, turn: 0.0 };
        let velocity = match self.what {
            What::Steady(velocity) => {
                if limits.clip(velocity) != velocity {
                    return None;
                }
                velocity
            }
            What::Mix => limits.clip(Velocity {
                x: rng.random_range(-limits.backward..limits.forward),
                y: rng.random_range(-limits.sideways..limits.sideways),
                turn: rng.random_range(-1.0..1.0) * limits.turn.min(1.0),
            }),
            What::Push(_) => {
                let (time, angle) = (rng.random_range(4.0..8.0), rng.random_range(0.0..TAU));
                let force = self.impulse(robot, settings)? / PUSH;
                pushes.push(Push { time, duration: PUSH, force: [force * angle.cos(), force * angle.sin(), 0.0] });
                half
            }
            What::Turf(softness) => {
                world.pitch.softness = softness;
                half
            }
        };
        Some(WalkTask { asked: Asked::Velocity(velocity), duration: self.duration, seed, world, pushes })
    }

    /// Impulse of its push on `robot`, N s.
    fn impulse(&self, robot: &Robot, settings: &WalkSettings) -> Option<f64> {
        let What::Push(impulse) = self.what else { return None };
        Some(impulse * robot.mass() * (9.81 * settings.gait.height).sqrt() / MOMENTUM)
    }
}

/// Runs every robot in every scenario with every seed; rows in this order, whatever the number of threads. `progress` is told of
/// each walk that has ended.
///
/// # Errors
/// When a robot cannot walk at all, or a simulation diverges.
pub fn run(
    robots: &[Arc<Robot>],
    scenarios: &[WalkScenario],
    seeds: &[u64],
    world: &WorldSettings,
    progress: &(dyn Fn(&str, &str) + Sync),
) -> Result<Vec<WalkRow>, BenchError> {
    let mut rows = Vec::new();
    for robot in robots {
        let settings = WalkSettings::load(robot)?;
        for scenario in scenarios {
            let outcomes = seeds
                .par_iter()
                .filter_map(|&seed| scenario.task(robot, &settings, world, seed))
                .map(|task| {
                    let walked = walk(robot, settings.clone(), &task, |_| ())?;
                    progress(&robot.name, &scenario.name);
                    let (mean, asked) = (walked.mean, walked.asked);
                    let turns = asked.x == 0.0 && asked.y == 0.0;
                    Ok(Outcome {
                        fell: walked.fell_at.is_some(),
                        speed: if turns { mean.turn.abs() } else { mean.x.hypot(mean.y) },
                        error: walked.error,
                        stop: walked.stop_time,
                        drift: walked.drift_share,
                        velocity_error: walked.velocity_error,
                        ticks: walked.tick_p99,
                    })
                })
                .collect::<Result<Vec<_>, BenchError>>()?;
            if !outcomes.is_empty() {
                let impulse = scenario.impulse(robot, &settings);
                rows.push(row(&robot.name, &scenario.name, impulse, &outcomes));
            }
        }
    }
    Ok(rows)
}

fn row(robot: &str, scenario: &str, impulse: Option<f64>, outcomes: &[Outcome]) -> WalkRow {
    let upright: Vec<&Outcome> = outcomes.iter().filter(|outcome| !outcome.fell).collect();
    let sorted = |of: &dyn Fn(&Outcome) -> Option<f64>| {
        let mut values: Vec<f64> = upright.iter().filter_map(|outcome| of(outcome)).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let mean = |values: &[f64]| (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64);
    let median = |values: &[f64]| (!values.is_empty()).then(|| values[values.len() / 2]);
    let errors = sorted(&|o| Some(o.error));
    let stops = sorted(&|o| o.stop);
    WalkRow {
        robot: robot.into(),
        scenario: scenario.into(),
        trials: outcomes.len(),
        upright: NamedRate::of("upright_rate", upright.len(), outcomes.len()),
        speed_mean: mean(&sorted(&|o| Some(o.speed))),
        speed_error: mean(&errors),
        speed_error_low: errors.first().copied(),
        speed_error_high: errors.last().copied(),
        stop_time: median(&stops),
        stop_time_high: stops.last().copied(),
        drift_share: median(&sorted(&|o| Some(o.drift))),
        velocity_error_rms: mean(&sorted(&|o| Some(o.velocity_error * o.velocity_error))).map(f64::sqrt),
        wbc_p99_s: sorted(&|o| Some(o.ticks[0])).last().copied(),
        tick_p99_s: sorted(&|o| Some(o.ticks[1])).last().copied(),
        impulse,
    }
}

/// Headings and cells of the table for people.
#[must_use]
pub fn text_table(rows: &[WalkRow]) -> (Vec<&'static str>, Vec<Vec<String>>) {
    let head = vec![
        "robot",
        "scenario",
        "walks",
        "upright %",
        "speed",
        "error % (least to greatest)",
        "stop s (median, most)",
        "drift %",
        "velocity rms m/s",
        "WBC, tick p99 us",
    ];
    let number = |value: Option<f64>, factor: f64, digits: usize| {
        value.map_or_else(|| "-".to_owned(), |value| format!("{:.digits$}", value * factor))
    };
    let body = rows.iter().map(|row| {
        let upright = row.upright.rate.map_or_else(String::new, |rate| {
            format!("{:.0} ({:.0} to {:.0})", 100.0 * rate.share, 100.0 * rate.low, 100.0 * rate.high)
        });
        let [error, low, high] =
            [row.speed_error, row.speed_error_low, row.speed_error_high].map(|error| number(error, 100.0, 1));
        vec![
            row.robot.clone(),
            row.scenario.clone(),
            row.trials.to_string(),
            upright,
            number(row.speed_mean, 1.0, 3),
            format!("{error} ({low} to {high})"),
            format!("{}, {}", number(row.stop_time, 1.0, 2), number(row.stop_time_high, 1.0, 2)),
            number(row.drift_share, 100.0, 1),
            number(row.velocity_error_rms, 1.0, 3),
            format!("{}, {}", number(row.wbc_p99_s, 1e6, 0), number(row.tick_p99_s, 1e6, 0)),
        ]
    });
    (head, body.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(fell: bool, error: f64) -> Outcome {
        Outcome {
            fell,
            speed: 0.5,
            error,
            stop: (!fell).then_some(0.8),
            drift: 0.01,
            velocity_error: 0.02,
            ticks: [1e-4; 2],
        }
    }

    #[test]
    fn a_fall_counts_against_upright_and_in_nothing_else() {
        let row = row("r", "s", None, &[outcome(false, 0.02), outcome(true, 9.0), outcome(false, 0.04)]);
        assert_eq!(row.trials, 3);
        assert!((row.upright.share().unwrap() - 2.0 / 3.0).abs() < 1e-12);
        assert!((row.speed_error.unwrap() - 0.03).abs() < 1e-12);
        assert_eq!(row.speed_error_high, Some(0.04));
        let json = serde_json::to_value(&row).unwrap();
        for key in ["robot", "scenario", "trials", "upright_rate", "upright_rate_low", "speed_mean", "speed_error"] {
            assert!(json.get(key).is_some(), "{key}");
        }
    }

    #[test]
    fn names_are_unique_and_pushes_go_all_ways() {
        let all = scenarios();
        let names: std::collections::BTreeSet<_> = all.iter().map(|scenario| &scenario.name).collect();
        assert_eq!(names.len(), all.len());
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/artemis");
        let robot = Robot::load(std::path::Path::new(folder)).unwrap();
        let settings = WalkSettings::of(&robot).unwrap();
        let scenario = all.iter().find(|scenario| scenario.name == "push-20").unwrap();
        let mut quadrants = [0; 4];
        for seed in 0..40 {
            let task = scenario.task(&robot, &settings, &WorldSettings::default(), seed).unwrap();
            let [x, y, _] = task.pushes[0].force;
            assert!((x.hypot(y) * PUSH - 20.0).abs() < 1.0, "{x} {y}");
            quadrants[usize::from(x > 0.0) + 2 * usize::from(y > 0.0)] += 1;
        }
        assert!(quadrants.iter().all(|&count| count > 3), "{quadrants:?}");
    }
}
