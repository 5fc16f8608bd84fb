//! Whether what a kick led to may be believed.
//!
//! A simulated contact can give a ball more energy than the foot had. Every touch of robot and ball is tested
//! (facts/physics-of-the-kick.md): kinetic energy may not grow by more than the work of motors, pushes and gravity; the
//! effective restitution may not pass 0.85; ball and robot may not sink into one another by more than half the ball's
//! radius, nor stay in contact for longer than [`MAX_CONTACT`]. And the whole kick, controller and all, is run again from the
//! start at a quarter of the time steps: the robot stands or falls as before, and ball speed and direction change by 2 % and a
//! degree at most in a kick that has converged, by 5 % (or 0.03 m/s) and three degrees in one that is believed. A kick that fails a test is
//! reported as invalid.

use serde::Serialize;

use crate::impact::Impact;
use crate::settings::Step;

/// Largest effective restitution that is believed.
pub const MAX_RESTITUTION: f64 = 0.85;
/// A touch at which robot and ball approach each other more slowly, m/s, has no restitution: the foot leads the ball.
pub const LEAST_APPROACH: f64 = 0.2;
/// Energy that may appear from nowhere, as a share of the kinetic energy before: the integration error.
pub const MAX_ENERGY_GAIN: f64 = 0.01;
/// Deepest penetration that is believed, as a share of the ball's radius. A football that a player kicks hard is flattened by
/// that much; the linear law has approach x contact time / pi, 3 cm at 10 m/s.
pub const MAX_DEPTH: f64 = 0.5;
/// Longest touch that is believed to be a kick, s. Human kicks last 10 ms; a foot that goes with the ball takes longer.
pub const MAX_CONTACT: f64 = 0.030;
/// How much finer the steps of the re-run are.
pub const RERUN_FACTOR: f64 = 4.0;
/// Relative change of the ball's speed in the re-run up to which a kick has converged, and up to which it is believed at all.
pub const SPEED_CHANGE: [f64; 2] = [0.02, 0.05];
/// A change of the ball's speed by less than this, m/s, is believed even where it is more than that share: a kick of half a metre
/// per second scatters by 4 per cent from step to step, which no camera would see.
pub const SPEED_FLOOR: [f64; 2] = [0.0, 0.03];
/// The same of the ball's direction, degrees.
pub const DIRECTION_CHANGE_DEG: [f64; 2] = [1.0, 3.0];

/// Why a kick is not believed.
#[derive(Debug, Clone, PartialEq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case", tag = "fault")]
pub enum Fault {
    /// The robot did not touch the ball.
    #[error("the robot did not touch the ball")]
    NoImpact,
    /// The trial ended before the last touch did.
    #[error("the trial ended while the ball was still in contact")]
    Unfinished,
    /// Energy appeared from nowhere.
    #[error(
        "kinetic energy grew by {gain:.3} J more than motors, pushes and gravity gave at {time:.3} s (at most {limit:.3} J)"
    )]
    Energy {
        /// When the touch started, s.
        time: f64,
        /// Energy from nowhere, J.
        gain: f64,
        /// What is tolerated, J.
        limit: f64,
    },
    /// The ball left faster than a real ball could.
    #[error("effective restitution {restitution:.3} at {time:.3} s is above {MAX_RESTITUTION}")]
    Restitution {
        /// When the touch started, s.
        time: f64,
        /// Effective restitution.
        restitution: f64,
    },
    /// Ball and robot were inside one another.
    #[error("robot and ball went {depth:.3} m into one another at {time:.3} s (at most {limit:.3} m)")]
    Depth {
        /// When the touch started, s.
        time: f64,
        /// How deep, m.
        depth: f64,
        /// What is believed, m.
        limit: f64,
    },
    /// The ball was led, not kicked.
    #[error("the touch at {time:.3} s lasted {duration:.3} s (at most {MAX_CONTACT} s)")]
    Contact {
        /// When the touch started, s.
        time: f64,
        /// How long it lasted, s.
        duration: f64,
    },
    /// The ball's speed depends on the time step.
    #[error(
        "the ball leaves at {coarse:.3} m/s, but at {fine:.3} m/s with a quarter of the step (more than 5 % apart)"
    )]
    StepSpeed {
        /// Ball speed as reported, m/s.
        coarse: f64,
        /// Ball speed in the re-run, m/s; 0 when the re-run missed the ball.
        fine: f64,
    },
    /// The ball's direction depends on the time step.
    #[error("the ball's direction changes by {change_deg:.2} degrees with a quarter of the step (at most 3)")]
    StepDirection {
        /// From the trial to its re-run, degrees.
        change_deg: f64,
    },
    /// Whether the robot falls depends on the time step.
    #[error("the robot {}, but {} with a quarter of the step", stands(.coarse), stands(.fine))]
    StepBalance {
        /// Whether it stood to the end.
        coarse: bool,
        /// Whether it did in the re-run.
        fine: bool,
    },
}

fn stands(upright: &bool) -> &'static str {
    if *upright { "stands" } else { "falls" }
}

/// What a kick led to, as far as it is compared with its re-run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Ball's speed as it leaves the robot for good, m/s; `None` when it was not touched.
    pub ball_speed: Option<f64>,
    /// Signed angle from the wanted to the real direction of the ball, rad.
    pub direction_error: Option<f64>,
    /// Whether the robot stood to the end.
    pub upright: bool,
}

/// The same kick at a finer step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rerun {
    /// Its time step away from the ball, s.
    pub step: f64,
    /// Ball's speed, m/s; `None` when the re-run missed it.
    pub ball_speed: Option<f64>,
    /// Ball's direction beside the wanted one, degrees, as the trial's direction error.
    pub direction_deg: Option<f64>,
    /// Whether the robot stood to the end.
    pub upright: bool,
    /// Change of the ball's speed as a share of the trial's.
    pub ball_speed_change: Option<f64>,
    /// Change of the ball's direction, degrees.
    pub direction_change_deg: Option<f64>,
}

/// The audit of one kick.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Audit {
    /// Everything that speaks against the kick; empty for a valid one.
    pub faults: Vec<Fault>,
    /// Kinetic energy gained across the hardest touch beyond the work of motors, pushes and gravity, J; negative is lost.
    pub energy_gain: Option<f64>,
    /// The re-run; `None` without a touch.
    pub rerun: Option<Rerun>,
    /// Whether the re-run led to the same.
    pub converged: bool,
}

/// What an audit judges.
#[derive(Debug, Clone, Copy)]
pub struct Evidence<'a> {
    /// Every touch.
    pub touches: &'a [Impact],
    /// Whether the last touch was over at the trial's end.
    pub finished: bool,
    /// Radius of the ball, m.
    pub ball_radius: f64,
    /// What the kick led to.
    pub outcome: Outcome,
    /// What it led to at finer steps, and those.
    pub rerun: Option<(Outcome, Step)>,
}

/// Written so that a NaN is not at most anything.
fn at_most(value: f64, limit: f64) -> bool {
    matches!(value.partial_cmp(&limit), Some(order) if order.is_le())
}

impl Audit {
    /// Judges a kick.
    #[must_use]
    pub fn new(evidence: &Evidence) -> Self {
        let Some(hardest) = hardest(evidence.touches) else {
            return Self { faults: vec![Fault::NoImpact], energy_gain: None, rerun: None, converged: false };
        };
        let mut faults = Vec::new();
        if !evidence.finished {
            faults.push(Fault::Unfinished);
        }
        for (i, touch) in evidence.touches.iter().enumerate() {
            faults.extend(touch_faults(touch, i == hardest, evidence.ball_radius));
        }
        let own = evidence.outcome;
        let (fine, step) = evidence.rerun.map_or((None, 0.0), |(outcome, step)| (Some(outcome), step.far));
        let [tight, loose] = [0, 1].map(|strictness| rerun_faults(&own, fine.as_ref(), strictness));
        let converged = tight.is_empty();
        faults.extend(loose);
        let rerun = fine.map(|fine| Rerun {
            step,
            ball_speed: fine.ball_speed,
            direction_deg: fine.direction_error.map(f64::to_degrees),
            upright: fine.upright,
            ball_speed_change: own.ball_speed.zip(fine.ball_speed).map(|(own, fine)| fine / own - 1.0),
            direction_change_deg: direction_change(&own, &fine).map(f64::to_degrees),
        });
        Self { faults, energy_gain: Some(evidence.touches[hardest].energy_gain()), rerun, converged }
    }

    /// Whether nothing speaks against the kick.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.faults.is_empty()
    }

    /// "valid" or "invalid".
    #[must_use]
    pub fn verdict(&self) -> &'static str {
        if self.is_valid() { "valid" } else { "invalid" }
    }

    /// What speaks against the kick, in words; empty for a valid one.
    #[must_use]
    pub fn reason(&self) -> String {
        self.faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    }
}

/// Which touch gave the ball the largest impulse.
#[must_use]
pub fn hardest(touches: &[Impact]) -> Option<usize> {
    (0..touches.len()).max_by(|&a, &b| touches[a].impulse.total_cmp(&touches[b].impulse))
}

fn touch_faults(touch: &Impact, hardest: bool, ball_radius: f64) -> Vec<Fault> {
    let mut faults = Vec::new();
    let time = touch.time;
    let (gain, limit) = (touch.energy_gain(), MAX_ENERGY_GAIN * touch.kinetic_before);
    if !at_most(gain, limit) {
        faults.push(Fault::Energy { time, gain, limit });
    }
    let judged = hardest || !at_most(touch.approach, LEAST_APPROACH);
    if judged && !at_most(touch.restitution, MAX_RESTITUTION) {
        faults.push(Fault::Restitution { time, restitution: touch.restitution });
    }
    let limit = MAX_DEPTH * ball_radius;
    if !at_most(touch.depth, limit) {
        faults.push(Fault::Depth { time, depth: touch.depth, limit });
    }
    if !at_most(touch.duration, MAX_CONTACT) {
        faults.push(Fault::Contact { time, duration: touch.duration });
    }
    faults
}

/// What the re-run changed by too much to have converged (0) or to be believed (1).
fn rerun_faults(own: &Outcome, fine: Option<&Outcome>, strictness: usize) -> Vec<Fault> {
    let mut faults = Vec::new();
    let (coarse, fine_speed) = (own.ball_speed.unwrap_or(0.0), fine.and_then(|fine| fine.ball_speed).unwrap_or(0.0));
    let limit = SPEED_FLOOR[strictness].max(SPEED_CHANGE[strictness] * coarse);
    if !(coarse > 0.0 && at_most((coarse - fine_speed).abs(), limit)) {
        faults.push(Fault::StepSpeed { coarse, fine: fine_speed });
    }
    let Some(fine) = fine else { return faults };
    if let Some(change_deg) = direction_change(own, fine).map(f64::to_degrees)
        && !at_most(change_deg.abs(), DIRECTION_CHANGE_DEG[strictness])
    {
        faults.push(Fault::StepDirection { change_deg });
    }
    if own.upright != fine.upright {
        faults.push(Fault::StepBalance { coarse: own.upright, fine: fine.upright });
    }
    faults
}

/// From the trial's direction to the re-run's, rad.
fn direction_change(own: &Outcome, fine: &Outcome) -> Option<f64> {
    let change = fine.direction_error? - own.direction_error?;
    Some(change.sin().atan2(change.cos()))
}
