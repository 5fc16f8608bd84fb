//! What settings are worth: cases of a KickBench scenario, tried in the world by KickBench's own judge.
//!
//! A kick counts when the engine accepts it, the ball is hit, the impact passes the audit and the robot stands to the end.
//! Everything else costs a penalty that is several times what a good kick can win, so that no optimum rests on a share of
//! falls or on an impact that cannot be believed. Distance and speed are asked of the engine at the greatest ball speed
//! that it accepts in each case; accuracy and time at the speed that the scenario asks.

use instep_bench::cell::{Kicked, run_case, world};
use instep_bench::scenario::Case;
use instep_bench::{BenchError, Scenario, Subject};
use instep_kick::{KickEngine, Refusal, Strength};
use instep_robot::control::Sensors;
use instep_sim::sensors::SensorSuite;
use instep_sim::{BallState, World};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::TuneError;

/// The ball speed that is asked first where the greatest is looked for, m/s.
const GREATEST: f64 = 8.0;
/// Where the search for the greatest speed gives up, m/s.
const LEAST: f64 = 0.2;

/// What is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Objective {
    /// How far the ball rolls, m: more.
    Distance,
    /// The ball's speed, m/s: more.
    Speed,
    /// The ball's direction error, degrees: less.
    Accuracy,
    /// From the request to the contact, s: less.
    Time,
}

impl Objective {
    /// The objective of a kick that counts, lower is better; not a number where the kick has none.
    #[must_use]
    pub fn cost(self, kicked: &Kicked) -> f64 {
        match self {
            Self::Distance => -kicked.distance,
            Self::Speed => -kicked.ball_speed.unwrap_or(f64::NAN),
            Self::Accuracy => kicked.direction_error.map_or(f64::NAN, |error| error.to_degrees().abs()),
            Self::Time => kicked.contact.unwrap_or(f64::NAN),
        }
    }

    /// What a kick that does not count costs at least: well above any that does.
    fn penalty(self) -> f64 {
        match self {
            Self::Distance | Self::Speed | Self::Time => 10.0,
            Self::Accuracy => 45.0,
        }
    }

    /// Whether each case is asked at the greatest speed that the engine accepts.
    fn asks_the_greatest(self) -> bool {
        matches!(self, Self::Distance | Self::Speed)
    }

    /// Its name and unit for tables.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::Distance => "ball distance / m",
            Self::Speed => "ball speed / (m/s)",
            Self::Accuracy => "direction error / deg",
            Self::Time => "time to contact / s",
        }
    }

    /// A cost as people read it: what is to be more has its sign back.
    #[must_use]
    pub fn shown(self, cost: f64) -> f64 {
        if self.asks_the_greatest() { -cost } else { cost }
    }
}

/// What came of one case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tried {
    /// The kick, or the refusal's name.
    pub outcome: Result<Kicked, String>,
    /// Its share in the cost.
    pub cost: f64,
}

/// What came of one set of settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// How many cases.
    pub cases: usize,
    /// Mean cost, penalties included.
    pub cost: f64,
    /// Mean objective of the kicks that count, as people read it.
    pub objective: Option<f64>,
    /// Median objective of the kicks that count.
    pub median: Option<f64>,
    /// Kicks that count.
    pub good: usize,
    /// Requests refused.
    pub refused: usize,
    /// Kicks that missed, or hardly moved the ball.
    pub missed: usize,
    /// Kicks that fell.
    pub fell: usize,
    /// Impacts that failed the audit.
    pub invalid: usize,
}

impl Summary {
    /// Of one set of settings.
    #[must_use]
    pub fn new(objective: Objective, tried: &[Tried]) -> Self {
        let kicked = || tried.iter().filter_map(|t| t.outcome.as_ref().ok());
        let good: Vec<f64> = kicked().filter(|k| counts(k)).map(|k| objective.shown(objective.cost(k))).collect();
        let cases = tried.len();
        Self {
            cases,
            cost: tried.iter().map(|t| t.cost).sum::<f64>() / cases as f64,
            objective: (!good.is_empty()).then(|| good.iter().sum::<f64>() / good.len() as f64),
            median: instep_bench::table::quantile(good.clone(), 0.5),
            good: good.len(),
            refused: cases - kicked().count(),
            missed: kicked().filter(|k| !k.hit && !k.audit_invalid).count(),
            fell: kicked().filter(|k| !k.upright).count(),
            invalid: kicked().filter(|k| k.audit_invalid).count(),
        }
    }

    /// Share of the accepted kicks that ended standing.
    #[must_use]
    pub fn upright(&self) -> Option<f64> {
        let accepted = self.cases - self.refused;
        (accepted > 0).then(|| (accepted - self.fell) as f64 / accepted as f64)
    }

    /// What did not count, in words.
    #[must_use]
    pub fn causes(&self) -> String {
        format!(
            "{} refused, {} missed, {} fell, {} failed the audit",
            self.refused, self.missed, self.fell, self.invalid
        )
    }
}

/// Whether a kick counts: a hit has passed the audit.
fn counts(kicked: &Kicked) -> bool {
    kicked.hit && kicked.upright
}

/// What settings are measured on.
#[derive(Debug, Clone)]
pub struct Judge<'a> {
    /// The robot, with its own settings.
    pub subject: &'a Subject,
    /// The engine's name.
    pub engine: &'a str,
    /// Where the cases come from.
    pub scenario: &'a Scenario,
    /// What is wanted.
    pub objective: Objective,
}

impl Judge<'_> {
    /// Tries each of the `settings` (texts) on the same `cases` drawn from `seed`, on all cores; the results stand in order.
    /// `each` is called after every trial. Settings that the engine refuses count as refused in every case.
    ///
    /// # Errors
    /// When a world cannot be built or a simulation diverges.
    pub fn measure(
        &self,
        settings: &[String],
        seed: u64,
        cases: usize,
        each: &(dyn Fn() + Sync),
    ) -> Result<Vec<Vec<Tried>>, TuneError> {
        let cases = self.scenario.cases(&self.subject.size, seed, cases);
        let subjects: Vec<Subject> = settings
            .iter()
            .map(|text| self.subject.clone().with_settings(self.engine, text.clone()))
            .collect::<Result<_, _>>()?;
        let jobs: Vec<(&Subject, &Case)> =
            subjects.iter().flat_map(|subject| cases.iter().map(move |case| (subject, case))).collect();
        let tried: Vec<Tried> = jobs
            .par_iter()
            .map_init(
                || None,
                |shared: &mut Option<World>, (subject, case)| {
                    let world = match shared {
                        Some(world) if !self.scenario.varies_world() => world,
                        slot => slot.insert(world(subject, self.scenario, case)?),
                    };
                    let tried = self.one(subject, case, world)?;
                    each();
                    Ok(tried)
                },
            )
            .collect::<Result<_, BenchError>>()?;
        Ok(tried.chunks(cases.len().max(1)).map(<[Tried]>::to_vec).collect())
    }

    fn one(&self, subject: &Subject, case: &Case, world: &mut World) -> Result<Tried, BenchError> {
        let penalty = self.objective.penalty();
        let refused = |name: &str| Tried { outcome: Err(name.to_owned()), cost: 1.5 * penalty };
        let mut case = *case;
        let mut engine = match subject.engine(self.engine) {
            Ok(engine) => engine,
            Err(BenchError::Kick(_)) => return Ok(refused("settings")),
            Err(other) => return Err(other),
        };
        if self.objective.asks_the_greatest() {
            match greatest(subject, &case, engine.as_mut(), world)? {
                Ok(speed) => case.request.strength = Strength::BallSpeed(speed),
                Err(refusal) => return Ok(refused(refusal.name())),
            }
        }
        let (outcome, _, ran) = run_case(subject, self.engine, &case, world, &mut Vec::new())?;
        Ok(match outcome {
            Err(refusal) => refused(refusal.name()),
            Ok(kicked) if counts(&kicked) => Tried { cost: self.objective.cost(&kicked), outcome: Ok(kicked) },
            Ok(kicked) => {
                // A later fall is a better one: the search has a slope even where nothing counts yet.
                let (fell, end) = ran.map_or((None, 1.0), |ran| {
                    (ran.trial.fell_at, ran.trial.record.times.last().copied().unwrap_or(1.0))
                });
                let early = fell.map_or(0.0, |time| 0.5 * (1.0 - time / end));
                Tried { outcome: Ok(kicked), cost: penalty * (1.0 + early) }
            }
        })
    }
}

/// The greatest ball speed (m/s) that `engine` accepts for the ball and direction of `case`, within about 4 %; or why it
/// accepts none. An engine's refusal says how far off a speed was, which takes most of the steps away.
fn greatest(
    subject: &Subject,
    case: &Case,
    engine: &mut dyn KickEngine,
    world: &mut World,
) -> Result<Result<f64, Refusal>, BenchError> {
    let [x, y] = case.ball;
    let ball = BallState::at_rest([x + subject.footprint[0], y + subject.footprint[1], subject.size.ball]);
    world.reset(&subject.robot.stand, &vec![0.0; subject.robot.nv()], &ball)?;
    let mut suite = SensorSuite::new(world, case.seed);
    suite.sense(world);
    let mut sensors = Sensors::default();
    suite.read_into(0.0, &mut sensors);
    let mut request = case.request;
    let mut speed = GREATEST;
    loop {
        request.strength = Strength::BallSpeed(speed);
        let refusal = match engine.plan(&request, &sensors) {
            Ok(_) => return Ok(Ok(speed)),
            Err(refusal) => refusal,
        };
        speed *= match refusal {
            Refusal::TooStrong { asked, most, .. } => (0.999 * most / asked).clamp(0.02, 0.999),
            Refusal::TooFast { share, .. } => (0.97 / share).clamp(0.3, 0.96),
            Refusal::TooHeavy { .. } | Refusal::OffBalance { .. } => 0.94,
            other => return Ok(Err(other)),
        };
        if !(speed > LEAST) {
            return Ok(Err(refusal));
        }
    }
}

#[cfg(test)]
mod tests;
