//! What an adopted robot must show before its folder is kept: that the world stays up in its stand, and how its engines kick.

use std::collections::BTreeMap;

use instep_robot::control::JointCommand;
use instep_sim::trial::has_fallen;
use instep_sim::{BallState, World};
use nalgebra::Vector3;
use serde::Serialize;

use crate::BenchError;
use crate::cell::CellResult;
use crate::engines::Subject;
use crate::run::Bench;
use crate::scenario::Scenario;

/// Requests of one cell: small, so that all cores have work.
const REQUESTS: usize = 5;
/// An engine kicks when this share of the kicks that it does not refuse ends upright,
const UPRIGHT: f64 = 0.9;
/// and this share of all that is asked hits the ball.
const HITS: f64 = 0.5;
/// Farthest that a stand may lean after the test, rad.
const LEAN: f64 = 0.1;

/// How an engine did.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Kicks {
    /// Kicks that were asked.
    pub trials: usize,
    /// Of these, those that the engine refused.
    pub refused: usize,
    /// Share of the trials that were kicked and ended upright.
    pub upright_rate: f64,
    /// Share of the trials in which the ball was hit.
    pub hit_rate: f64,
    /// Median speed of the balls that were hit, m/s; `None` where none was.
    pub ball_speed_median: Option<f64>,
}

impl Kicks {
    /// Whether the engine can be said to kick with this robot.
    #[must_use]
    pub fn kicks(&self) -> bool {
        let kicked = self.trials.saturating_sub(self.refused) as f64;
        self.upright_rate * self.trials as f64 >= UPRIGHT * kicked - 1e-9 && self.hit_rate >= HITS
    }

    /// What engines are ranked by: kicks that hit and end upright, then the speed.
    #[must_use]
    pub fn rank(&self) -> f64 {
        self.upright_rate + self.hit_rate + 0.01 * self.ball_speed_median.unwrap_or(0.0)
    }

    fn of(results: &[CellResult]) -> Self {
        let outcomes: Vec<_> = results.iter().flat_map(|cell| &cell.outcomes).collect();
        let kicked: Vec<_> = outcomes.iter().filter_map(|outcome| outcome.as_ref().ok()).collect();
        let trials = outcomes.len();
        let share = |count: usize| count as f64 / trials.max(1) as f64;
        let mut speeds: Vec<f64> = kicked.iter().filter(|k| k.hit).filter_map(|k| k.ball_speed).collect();
        speeds.sort_by(f64::total_cmp);
        Self {
            trials,
            refused: trials - kicked.len(),
            upright_rate: share(kicked.iter().filter(|k| k.upright).count()),
            hit_rate: share(kicked.iter().filter(|k| k.hit).count()),
            ball_speed_median: speeds.get(speeds.len() / 2).copied(),
        }
    }
}

/// Whether the robot stays up for `seconds` in its stand, held by its drives with the torques that its weight asks for.
///
/// # Errors
/// When the world cannot be made or diverges.
pub fn stands(subject: &Subject, seconds: f64) -> Result<bool, BenchError> {
    let robot = &subject.robot;
    let mut world = World::new(robot.clone(), &subject.world())?;
    let still = vec![0.0; robot.nv()];
    world.reset(&robot.stand, &still, &BallState::at_rest([5.0, 0.0, 0.2]))?;
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&robot.stand[7..]);
    let mut data = robot.data();
    data.set_state(&robot.stand, &still);
    let each = Vector3::z() * (robot.mass() * 9.81 / robot.contacts.len() as f64);
    let forces: Vec<_> = robot.contacts.iter().map(|contact| (contact.at, each)).collect();
    let mut torques = vec![0.0; robot.nv()];
    data.inverse_dynamics_into(&still, &forces, &mut torques);
    command.torques.copy_from_slice(&torques[6..]);
    while world.time() < seconds {
        world.advance(&command, None)?;
        if has_fallen(&world) {
            return Ok(false);
        }
    }
    let (x, y) = (world.q()[4], world.q()[5]);
    Ok(2.0 * x.hypot(y) < LEAN)
}

/// Kicks `trials` times in `scenario` with each of `engines`, on all cores; `progress` is told the number of finished cells and of all.
///
/// # Errors
/// When an engine cannot be made, or a simulation diverges.
pub fn kicks(
    subject: &Subject,
    engines: &[&str],
    scenario: &Scenario,
    trials: usize,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<BTreeMap<String, Kicks>, BenchError> {
    let cells = trials.div_ceil(REQUESTS);
    let bench = Bench {
        engines: engines.iter().map(|&engine| engine.to_owned()).collect(),
        subjects: vec![subject.clone()],
        scenarios: vec![scenario.clone()],
        seeds: (0..cells as u64).map(|i| 500 + i).collect(),
        requests: REQUESTS.min(trials.max(1)),
    };
    let results = bench.run(None, &|done, all, _| progress(done, all))?;
    let mut by_engine: BTreeMap<String, Vec<CellResult>> = BTreeMap::new();
    for result in results {
        by_engine.entry(result.key.engine.clone()).or_default().push(result);
    }
    Ok(by_engine.into_iter().map(|(engine, results)| (engine, Kicks::of(&results))).collect())
}
