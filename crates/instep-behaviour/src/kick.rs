//! The kick manager: what kicks there are and how exact each is, which one serves a target, and when its moment has come
//! (paper 4, section IV-E: power by distance, shots at full power, kicks timed between strides by predicted motion).
//!
//! Exactness is read from rows of KickBench's table. A row gives quantiles of the absolute direction error; the model
//! is a normal distribution with the wider of the two standard deviations that median and 90th percentile ask for.

use std::path::Path;

use instep_field::{Pose, wrap};
use serde::{Deserialize, Serialize};

use crate::error::{read, within};
use crate::geometry::{Point, distance};
use crate::memory::{BallMemory, ROLLING_DECELERATION};
use crate::targets::{Target, TargetKind};
use crate::{BehaviourError, OwnState};

/// Quantiles of the absolute value of a standard normal variable.
const NORMAL_P50: f64 = 0.6745;
const NORMAL_P90: f64 = 1.6449;
/// A pass shall arrive with this speed, m/s.
const ARRIVAL_SPEED: f64 = 0.4;
/// Time from the order to the next support exchange, on average, s: half a stride.
const HALF_STRIDE: f64 = 0.2;
/// How far beside its place before the foot a ball may lie, m.
const ZONE_BESIDE: f64 = 0.17;
/// How far nearer or farther than its place, m.
const ZONE_AHEAD: f64 = 0.12;
/// A standing kick starts only slower than this, m/s.
const STANDS: f64 = 0.12;

/// One kick of one engine on one robot. The names down to `contact_median_s` are KickBench's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KickModel {
    /// Engine.
    pub engine: String,
    /// Robot.
    pub robot: String,
    /// Scenario that it was measured in.
    pub scenario: String,
    /// How many kicks were asked.
    pub requests: usize,
    /// Share of balls that were hit.
    pub hit_rate: f64,
    /// Share of kicks that ended standing.
    pub upright_rate: f64,
    /// Fastest ball that it is asked for, m/s.
    pub ball_speed_median: f64,
    /// Ball speed over the asked one.
    pub speed_ratio_median: f64,
    /// Median of the absolute direction error, deg.
    pub direction_error_median_deg: f64,
    /// Its 90th percentile, deg.
    pub direction_error_p90_deg: f64,
    /// From the request to the contact, s.
    pub contact_median_s: f64,
    /// Standard deviation of the ball speed, of the speed. KickBench's table does not give it.
    #[serde(default = "KickModel::speed_spread")]
    pub speed_spread: f64,
    /// From the contact until the robot walks again, s.
    #[serde(default = "KickModel::recovery")]
    pub recovery: f64,
    /// Where the ball lies before the robot at the contact, m.
    #[serde(default = "KickModel::ball_ahead")]
    pub ball_ahead: f64,
    /// Part of a walk, not from the stand.
    #[serde(default)]
    pub in_gait: bool,
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
}

impl KickModel {
    fn speed_spread() -> f64 {
        0.1
    }

    fn recovery() -> f64 {
        0.8
    }

    fn ball_ahead() -> f64 {
        0.32
    }

    /// Standard deviation of the direction, rad.
    pub fn direction_spread(&self) -> f64 {
        let median = self.direction_error_median_deg / NORMAL_P50;
        median.max(self.direction_error_p90_deg / NORMAL_P90).to_radians()
    }

    /// How far its fastest ball rolls, m.
    pub fn reach(&self) -> f64 {
        self.ball_speed_median.powi(2) / (2.0 * ROLLING_DECELERATION)
    }
}

/// The kicks that a robot has.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KickTable {
    /// At least one.
    pub kick: Vec<KickModel>,
}

/// KickBench's JSON: the rows are what counts here.
#[derive(Debug, Deserialize)]
struct BenchTable {
    rows: Vec<serde_json::Value>,
}

/// Which rows of a table a robot uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Which<'a> {
    /// Engine, or all.
    pub engine: Option<&'a str>,
    /// Robot.
    pub robot: &'a str,
}

impl KickTable {
    /// Reads a table: TOML with `[[kick]]` rows, or the JSON that `instep bench` writes, whose rows without a hit count
    /// for nothing.
    ///
    /// # Errors
    /// [`BehaviourError`] with file and place.
    pub fn load(path: &Path) -> Result<Self, BehaviourError> {
        let text = read(path)?;
        let table = if path.extension().is_some_and(|e| e == "json") {
            let bench: BenchTable = serde_json::from_str(&text).map_err(|e| BehaviourError::file(path, e))?;
            Self { kick: bench.rows.into_iter().filter_map(|row| serde_json::from_value(row).ok()).collect() }
        } else {
            toml::from_str(&text).map_err(|e| BehaviourError::file(path, e))?
        };
        table.validate(&path.display().to_string())?;
        Ok(table)
    }

    /// Checks every number; `file` is what an error names.
    ///
    /// # Errors
    /// [`BehaviourError::Value`] for the first that cannot be.
    pub fn validate(&self, file: &str) -> Result<(), BehaviourError> {
        if self.kick.is_empty() {
            return Err(none(file, "no kick at all", "at least one row with a hit"));
        }
        for (i, kick) in self.kick.iter().enumerate() {
            let check = |name: &str, found, low, high| within(file, &format!("kick[{i}].{name}"), found, low, high);
            check("hit_rate", kick.hit_rate, 0.0, 1.0)?;
            check("upright_rate", kick.upright_rate, 0.0, 1.0)?;
            check("ball_speed_median", kick.ball_speed_median, 0.05, 40.0)?;
            check("speed_ratio_median", kick.speed_ratio_median, 0.1, 3.0)?;
            check("direction_error_median_deg", kick.direction_error_median_deg, 0.0, 180.0)?;
            check("direction_error_p90_deg", kick.direction_error_p90_deg, 0.0, 180.0)?;
            check("contact_median_s", kick.contact_median_s, 0.0, 30.0)?;
            check("speed_spread", kick.speed_spread, 0.0, 1.0)?;
            check("recovery", kick.recovery, 0.0, 30.0)?;
            check("ball_ahead", kick.ball_ahead, 0.05, 1.0)?;
        }
        Ok(())
    }

    /// The rows of one robot, all or those of one engine.
    ///
    /// # Errors
    /// [`BehaviourError::Value`] where there is none; `file` is what the error names.
    pub fn only(mut self, which: Which<'_>, file: &str) -> Result<Self, BehaviourError> {
        let names: Vec<String> = self.kick.iter().map(|k| format!("{} {}", k.robot, k.engine)).collect();
        self.kick.retain(|k| k.robot == which.robot && which.engine.is_none_or(|engine| k.engine == engine));
        if self.kick.is_empty() {
            return Err(none(file, &format!("no kick of {}", which.robot), &format!("one of {}", names.join(", "))));
        }
        Ok(self)
    }
}

fn none(file: &str, found: &str, expected: &str) -> BehaviourError {
    BehaviourError::Value {
        file: file.to_owned(),
        field: "kick".to_owned(),
        found: found.to_owned(),
        expected: expected.to_owned(),
    }
}

/// A kick that is asked of the body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct KickRequest {
    /// Which row of the table.
    pub kick: usize,
    /// Where the ball shall go, rad in the field frame.
    pub direction: f64,
    /// Ball speed, m/s.
    pub speed: f64,
    /// Half of the cone that still serves, rad.
    pub precision: f64,
}

/// The kick that serves `target` best: little time, few falls, and exact enough.
pub(crate) fn choose(kicks: &[KickModel], ball: Point, target: &Target) -> Option<KickRequest> {
    let way = distance(ball, target.point);
    let wanted = match target.kind {
        TargetKind::Shot => f64::INFINITY,
        TargetKind::Pass => (2.0 * ROLLING_DECELERATION * way + ARRIVAL_SPEED * ARRIVAL_SPEED).sqrt(),
    };
    let cost = |kick: &KickModel| {
        let short = (way / kick.reach() - 1.0).max(0.0);
        let inexact = (kick.direction_spread() / target.tolerance.max(0.02)).min(5.0);
        kick.contact_median_s + kick.recovery + 20.0 * (1.0 - kick.upright_rate) + 3.0 * short + inexact
    };
    let (kick, model) = kicks.iter().enumerate().min_by(|a, b| cost(a.1).total_cmp(&cost(b.1)))?;
    Some(KickRequest {
        kick,
        direction: target.direction,
        speed: wanted.min(model.ball_speed_median),
        precision: target.tolerance,
    })
}

/// Where to stand for a kick in `direction`, field frame.
pub(crate) fn stance(kick: &KickModel, ball: Point, direction: f64) -> Pose {
    let (s, c) = direction.sin_cos();
    Pose::new(ball[0] - kick.ball_ahead * c, ball[1] - kick.ball_ahead * s, direction)
}

/// How far the robot's heading may be off for this request, rad.
pub(crate) fn heading_tolerance(kick: &KickModel, request: &KickRequest) -> f64 {
    (request.precision - kick.direction_spread()).clamp(0.1, 0.3)
}

/// Whether the kick may start now: at the next support exchange the ball will lie before the foot and the robot look
/// the right way.
pub(crate) fn is_time(kick: &KickModel, request: &KickRequest, own: &OwnState, ball: &BallMemory) -> bool {
    let [vx, vy, turn] = own.velocity;
    let lead = if kick.in_gait { HALF_STRIDE } else { 0.0 };
    let then = own.pose.then(&Pose::new(vx * lead, vy * lead, turn * lead));
    let [x, y] =
        then.local_from_outer([ball.position[0] + ball.velocity[0] * lead, ball.position[1] + ball.velocity[1] * lead]);
    let stands = kick.in_gait || vx.hypot(vy) < STANDS;
    stands
        && (x - kick.ball_ahead).abs() < ZONE_AHEAD
        && y.abs() < ZONE_BESIDE
        && wrap(request.direction - then.heading).abs() < heading_tolerance(kick, request)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::memory::BallState;

    pub(crate) fn in_gait() -> KickModel {
        KickModel {
            engine: "plmk".into(),
            robot: "artemis".into(),
            scenario: "goal".into(),
            requests: 50,
            hit_rate: 1.0,
            upright_rate: 1.0,
            ball_speed_median: 4.0,
            speed_ratio_median: 1.0,
            direction_error_median_deg: 5.8,
            direction_error_p90_deg: 14.1,
            contact_median_s: 0.3,
            speed_spread: 0.1,
            recovery: 0.1,
            ball_ahead: 0.32,
            in_gait: true,
            source: String::new(),
        }
    }

    fn target(kind: TargetKind, x: f64, tolerance: f64) -> Target {
        Target { kind, point: [x, 0.0], radius: 0.5, direction: 0.0, tolerance, cost: 0.0 }
    }

    #[test]
    fn a_shot_is_at_full_power_and_a_pass_rolls_as_far_as_its_target() {
        let kicks = [in_gait()];
        assert_eq!(choose(&kicks, [0.0; 2], &target(TargetKind::Shot, 6.0, 0.2)).unwrap().speed, 4.0);
        let pass = choose(&kicks, [0.0; 2], &target(TargetKind::Pass, 6.0, 0.2)).unwrap();
        let arrives = (pass.speed * pass.speed - 2.0 * ROLLING_DECELERATION * 6.0).sqrt();
        assert!((arrives - ARRIVAL_SPEED).abs() < 1e-9);
    }

    #[test]
    fn an_exact_kick_is_taken_where_the_cone_is_narrow_and_a_quick_one_where_it_is_wide() {
        let exact = KickModel {
            direction_error_median_deg: 0.4,
            direction_error_p90_deg: 1.0,
            contact_median_s: 1.9,
            in_gait: false,
            ..in_gait()
        };
        let kicks = [in_gait(), exact];
        assert_eq!(choose(&kicks, [0.0; 2], &target(TargetKind::Pass, 3.0, 0.6)).unwrap().kick, 0);
        assert_eq!(choose(&kicks, [0.0; 2], &target(TargetKind::Pass, 3.0, 0.04)).unwrap().kick, 1);
    }

    #[test]
    fn the_moment_is_when_the_ball_lies_before_the_foot_at_the_next_step() {
        let kick = in_gait();
        let request = KickRequest { kick: 0, direction: 0.0, speed: 4.0, precision: 0.3 };
        let ball = BallMemory::known(0.0, [0.5, 0.0], [0.0; 2], BallState::InView);
        let walking = |x: f64, heading: f64, speed: f64| OwnState {
            velocity: [speed, 0.0, 0.0],
            ..OwnState::at(Pose::new(x, 0.0, heading))
        };
        // In half a stride 0.5 m/s brings 0.1 m.
        assert!(is_time(&kick, &request, &walking(0.05, 0.0, 0.5), &ball));
        assert!(!is_time(&kick, &request, &walking(-0.15, 0.0, 0.5), &ball));
        assert!(!is_time(&kick, &request, &walking(0.05, 0.5, 0.5), &ball));
        let standing = KickModel { in_gait: false, ..kick };
        assert!(!is_time(&standing, &request, &walking(0.18, 0.0, 0.5), &ball));
        assert!(is_time(&standing, &request, &walking(0.18, 0.0, 0.0), &ball));
    }

    #[test]
    fn quantiles_of_a_normal_error_give_its_standard_deviation() {
        let kick = in_gait();
        assert!((kick.direction_spread().to_degrees() - 8.6).abs() < 0.1);
    }
}
