//! What `retarget --json` prints. Keys are stable: they may be added to, never renamed. SI units.

use std::collections::BTreeMap;
use std::path::Path;

use instep_motion::phase::Side;
use instep_motion::reference::ReferenceKind;
use instep_retarget::kinodynamic::Binding;
use instep_retarget::kinodynamic::verify::Verification;
use serde::Serialize;

use super::{Done, summary};

#[derive(Debug, Serialize)]
pub(super) struct Measures<'a> {
    /// Frames of the clip without its jumps; times are counted from the first of them.
    frames: usize,
    /// Frames that were left out or bridged because the figure jumps there, in words.
    jumps: Vec<String>,
    kick_foot: Side,
    t_plant: f64,
    t_swing: f64,
    t_lock: f64,
    /// These times are the clip's own.
    t_impact: f64,
    /// Time that rescaling and kinematic stage took.
    seconds: f64,
    /// Of the clip, a second of those two.
    frames_per_second: f64,
    /// Time that each stage took.
    stage_seconds: &'a BTreeMap<&'static str, f64>,
    /// Of the result.
    max_stance_slip: f64,
    /// Of the kinematic stage.
    keypoint_error_mean: f64,
    /// How the last stage ended.
    status: &'static str,
    /// Why the result is not feasible; null where it is.
    failure: Option<FailureOf>,
    /// Worst by family, of the last stage. Kinematic: joint_limit (rad), joint_speed (share of the limit beyond it), the
    /// others metres. Kinodynamic: see `instep_retarget::kinodynamic::Kinodynamic::violations`.
    violations: &'a BTreeMap<&'static str, f64>,
    keypoint_errors: BTreeMap<&'a str, f64>,
    /// Of the last stage.
    iterations: usize,
    robot: &'a str,
    kind: ReferenceKind,
    knots: usize,
    rate: f64,
    reference: &'a Path,
    report: &'a Path,
    #[serde(flatten)]
    kinodynamic: Option<Kinodynamic<'a>>,
}

/// What the kinodynamic stage adds.
#[derive(Debug, Serialize)]
struct Kinodynamic<'a> {
    /// Joints and instants of the check at 200 Hz with a torque beyond the drive's.
    torque_violations: usize,
    speed_violations: usize,
    joint_violations: usize,
    /// Largest wrench on the base that nothing gives, as a share of m g.
    root_wrench_residual: f64,
    foot_speed_at_impact: f64,
    /// The kinematic stage's.
    kinematic_foot_speed: f64,
    /// What limits it.
    foot_speed_limits: &'a [Binding],
    /// Limits used up at any time.
    binding: &'a [Binding],
    time_scale: f64,
    /// rad.
    approach_angle: f64,
    /// rad, by which the motion was turned for it.
    aim_turn: f64,
    /// Distance of the striking point from its place behind the ball.
    ball_miss: f64,
    verification: &'a Verification,
}

/// Which stage and family failed.
#[derive(Debug, Serialize)]
pub(super) struct FailureOf {
    pub stage: &'static str,
    pub family: Option<&'static str>,
    /// First knots at which it did, at most ten.
    pub knots: Vec<usize>,
    /// By how much.
    pub by: Option<f64>,
    /// In words.
    pub message: String,
}

impl<'a> Measures<'a> {
    pub(super) fn new(done: &'a Done) -> Self {
        let r = &done.retargeted;
        let k = done.kinodynamic.as_ref();
        let result = done.result();
        Self {
            frames: done.clip.frames.len(),
            jumps: done.mended.iter().map(ToString::to_string).collect(),
            kick_foot: r.phases.kick_foot,
            t_plant: r.phases.t_plant,
            t_swing: r.phases.t_swing,
            t_lock: r.phases.t_lock,
            t_impact: r.phases.t_impact,
            seconds: done.kinematic_seconds(),
            frames_per_second: done.frames_per_second(),
            stage_seconds: &done.seconds,
            max_stance_slip: k.map_or(r.max_stance_slip, |k| k.verification.stance_slip),
            keypoint_error_mean: r.keypoint_error_mean(),
            status: summary::status(done),
            failure: k.and_then(|k| summary::failure(&k.status)),
            violations: k.map_or(&r.violations, |k| &k.violations),
            keypoint_errors: r.keypoint_errors.iter().map(|(name, error)| (name.as_str(), *error)).collect(),
            iterations: k.map_or(r.iterations, |k| k.iterations),
            robot: &done.robot.name,
            kind: result.kind,
            knots: result.knots.len(),
            rate: result.rate,
            reference: &done.reference,
            report: &done.report,
            kinodynamic: k.map(|k| Kinodynamic {
                torque_violations: k.verification.torque_violations,
                speed_violations: k.verification.speed_violations,
                joint_violations: k.verification.joint_violations,
                root_wrench_residual: k.verification.root_wrench_residual,
                foot_speed_at_impact: k.foot_speed_at_impact,
                kinematic_foot_speed: k.kinematic_foot_speed,
                foot_speed_limits: &k.swing_binding,
                binding: &k.binding,
                time_scale: k.time_scale,
                approach_angle: k.approach_angle,
                aim_turn: k.aim_turn,
                ball_miss: k.ball_miss,
                verification: &k.verification,
            }),
        }
    }
}
