//! The kinematic stage: a human clip to a robot's motion that looks the same (paper 1, section II-A, Fig 3b).
//!
//! Two forms, as the paper compares them: with the contact schedule enforced, so that standing feet stand still, and
//! without, so that the clip's own foot slip stays. Neither knows of forces: speeds and torques beyond the robot's
//! limits are counted and reported, not prevented. That is the kinodynamic stage's work.

use std::collections::BTreeMap;

use instep_motion::clip::Clip;
use instep_motion::contact::{ContactSchedule, ContactSettings, detect};
use instep_motion::despike;
use instep_motion::landmark::{Landmark, Landmarks};
use instep_motion::phase::{KickPhases, KickSettings, find_kick, kick_direction};
use instep_motion::reference::{Reference, ReferenceKind, Source};
use instep_robot::Robot;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::RetargetError;
use crate::assemble;
use crate::ik::{ClipIk, State};
use crate::rescale::{Targets, landmark_name, rescale};
use crate::settle::{clearance, settle};
use crate::stance::stances;

/// Iterations in which the places of standing feet still follow the motion; then they are fixed.
const ANCHOR_SETTLING: usize = 3;

/// Whether the contact schedule is enforced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ContactForm {
    /// Standing feet stand still on the ground.
    Enforced,
    /// The clip's own foot slip is kept.
    Slip,
}

/// What each term of the cost weighs. Positions in 1/m^2, turns in 1/rad^2; only ratios matter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Weights {
    /// Q_m of (3) for pelvis and hips.
    pub pelvis: f64,
    /// Q_m for the knees.
    pub knee: f64,
    /// Q_m for the ankles.
    pub ankle: f64,
    /// Q_m for toe joints, toe tips and heels.
    pub toe: f64,
    /// Q_m for chest and head.
    pub chest: f64,
    /// Q_m for shoulders, elbows, wrists and hands.
    pub arm: f64,
    /// Turn of the pelvis away from the human's.
    pub pelvis_turn: f64,
    /// Turn of the chest.
    pub chest_turn: f64,
    /// Turn of the soles.
    pub sole_turn: f64,
    /// Turn of the toes.
    pub toe_turn: f64,
    /// Distance of a standing contact point from its place.
    pub contact: f64,
    /// Depth of other contact points below the ground. Much larger slows the solver down.
    pub penetration: f64,
    /// Overlap of capsules.
    pub collision: f64,
    /// Acceleration of joints and of the base's turning, in s^4/rad^2. Larger is smoother and blunts the kick.
    pub acceleration: f64,
    /// Acceleration of the base, in s^4/m^2.
    pub base_acceleration: f64,
    /// Pull to the standing pose, in 1/rad^2: only for joints that no keypoint sees.
    pub posture: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            pelvis: 3.0,
            knee: 1.5,
            ankle: 5.0,
            toe: 1.0,
            chest: 1.0,
            arm: 0.5,
            pelvis_turn: 0.2,
            chest_turn: 0.1,
            sole_turn: 0.05,
            toe_turn: 0.01,
            contact: 1e4,
            penetration: 1e3,
            collision: 300.0,
            acceleration: 3e-10,
            base_acceleration: 3e-9,
            posture: 1e-4,
        }
    }
}

impl Weights {
    /// Q_m of a landmark.
    #[must_use]
    pub fn of(&self, landmark: Landmark) -> f64 {
        match landmark {
            Landmark::Pelvis | Landmark::Hip(_) => self.pelvis,
            Landmark::Knee(_) => self.knee,
            Landmark::Ankle(_) => self.ankle,
            Landmark::ToeBase(_) | Landmark::ToeTip(_) | Landmark::Heel(_) => self.toe,
            Landmark::Chest | Landmark::Head => self.chest,
            Landmark::Shoulder(_) | Landmark::Elbow(_) | Landmark::Wrist(_) | Landmark::HandTip(_) => self.arm,
        }
    }
}

/// How a clip is retargeted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct KinematicSettings {
    /// Whether the contact schedule is enforced.
    pub form: ContactForm,
    /// Knots a second of the reference. The clip is solved at its own rate; the knots are taken from it, one of them
    /// at the impact. 30 in the paper.
    pub rate: f64,
    /// Weights of the cost.
    pub weights: Weights,
    /// Most Gauss-Newton iterations over the whole clip.
    pub iterations: usize,
    /// Relative fall of the cost below which, twice in a row, the solver stops.
    pub tolerance: f64,
    /// Radius of the ball that the reference is laid out for, m.
    pub ball_radius: f64,
    /// How contact with the ground is found in the clip.
    pub contact: ContactSettings,
    /// How the kick is found in the clip.
    pub kick: KickSettings,
}

impl Default for KinematicSettings {
    fn default() -> Self {
        Self {
            form: ContactForm::Enforced,
            rate: 30.0,
            weights: Weights::default(),
            iterations: 20,
            tolerance: 1e-2,
            ball_radius: 0.11,
            contact: ContactSettings::default(),
            kick: KickSettings::default(),
        }
    }
}

/// How the stage ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The cost no longer fell.
    Solved,
    /// Out of iterations; the best positions are returned.
    OutOfIterations,
}

/// How far the stage has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Iterations done; 0 once the clip is rescaled.
    pub iteration: usize,
    /// Most iterations.
    pub iterations: usize,
    /// Weighted cost after it; infinite before the first.
    pub cost: f64,
}

/// A retargeted clip.
#[derive(Debug, Clone, PartialEq)]
pub struct Retargeted {
    /// The robot's motion.
    pub reference: Reference,
    /// The kick's phases in the clip's own time.
    pub phases: KickPhases,
    /// The robot's positions at every frame of the clip (7 + n), in the reference's world.
    pub positions: Vec<Vec<f64>>,
    /// What it followed, in the reference's world.
    pub targets: Targets,
    /// When each human foot stands.
    pub contacts: ContactSchedule,
    /// Mean distance of each keypoint from its target, m.
    pub keypoint_errors: Vec<(String, f64)>,
    /// Longest way of a contact point during one of its stances, m.
    pub max_stance_slip: f64,
    /// How it ended.
    pub status: Status,
    /// Iterations over the whole clip.
    pub iterations: usize,
    /// Worst violation by family: `joint_limit` (rad), `joint_speed` (share of the limit beyond it), `penetration`
    /// (m), `stance_height` (m), `stance_slip` (m), `self_collision` (m).
    pub violations: BTreeMap<&'static str, f64>,
}

impl Retargeted {
    /// Mean over all keypoints, m.
    #[must_use]
    pub fn keypoint_error_mean(&self) -> f64 {
        self.keypoint_errors.iter().map(|(_, error)| error).sum::<f64>() / self.keypoint_errors.len().max(1) as f64
    }
}

/// Retargets `clip` to `robot`. `source` goes into the reference; its `clip_start` is filled in here.
///
/// # Errors
/// When the clip has no kick or no stance, its bones are not known, or the robot's file lacks a landmark.
pub fn retarget(
    robot: &Robot,
    clip: &Clip,
    source: Source,
    settings: &KinematicSettings,
    progress: &mut dyn FnMut(Progress),
) -> Result<Retargeted, RetargetError> {
    settings.validate()?;
    clip.validate()?;
    let (clip, _) = despike::despike(clip, despike::POSITION, despike::ANGLE);
    let landmarks = Landmarks::find(&clip.skeleton)?.calibrated(&clip);
    let contacts = detect(&clip, &landmarks, &settings.contact)?;
    let phases = find_kick(&clip, &landmarks, &contacts, &settings.kick)?;
    let direction = kick_direction(&clip, &landmarks, &phases)?;
    let mut targets = rescale(robot, &clip, &landmarks, &contacts, &direction)?;
    if settings.form == ContactForm::Enforced {
        settle(robot, &mut targets, &contacts);
    }

    progress(Progress { iteration: 0, iterations: settings.iterations, cost: f64::INFINITY });

    let stances = stances(robot, &contacts);
    let anchors = match settings.form {
        ContactForm::Enforced => stances.clone(),
        ContactForm::Slip => Vec::new(),
    };
    let clearance = match settings.form {
        ContactForm::Enforced => clearance(&contacts),
        ContactForm::Slip => vec![[0.0; 2]; targets.frames.len()],
    };
    let mut ik = ClipIk::new(robot, &targets, &settings.weights, anchors, clearance);
    let mut positions = ik.guess()?;
    let mut status = Status::OutOfIterations;
    let mut iterations = 0;
    let mut was_small = false;
    let mut state = State::new(positions.len(), robot.nv());
    let mut total = f64::INFINITY;
    while iterations < settings.iterations {
        if iterations < ANCHOR_SETTLING {
            ik.settle_anchors(&positions);
        }
        let mut fall = 0.0;
        for window in ClipIk::windows(&state.moved) {
            let (fallen, left) = ik.iterate(&mut positions, &window, clip.rate, iterations, &mut state)?;
            fall += fallen;
            if window.len() == positions.len() {
                total = fallen + left;
            }
        }
        total -= fall;
        iterations += 1;
        progress(Progress { iteration: iterations, iterations: settings.iterations, cost: total });
        // One small step may only mean that a few frames are still being damped; two in a row mean the end.
        let small = fall < settings.tolerance * total;
        if small && was_small {
            status = Status::Solved;
            break;
        }
        was_small = small;
    }

    let mut errors = vec![0.0; targets.keypoints.len()];
    for (q, target) in positions.iter().zip(&targets.frames) {
        for ((error, at), wanted) in errors.iter_mut().zip(ik.keypoints_at(q)).zip(&target.positions) {
            *error += (at - wanted).norm() / positions.len() as f64;
        }
    }
    drop(ik);
    let keypoint_errors = targets.keypoints.iter().map(|k| landmark_name(k.landmark)).zip(errors).collect();
    let kind = match settings.form {
        ContactForm::Enforced => ReferenceKind::Kinematic,
        ContactForm::Slip => ReferenceKind::KinematicSlip,
    };
    let motion = assemble::Motion { robot, positions, stances: &stances, rate: clip.rate, phases };
    let violations = motion.violations();
    let (reference, positions, origin) = motion.reference(kind, source, settings.rate, settings.ball_radius);
    Ok(Retargeted {
        reference,
        phases,
        positions,
        targets: moved(targets, &origin),
        contacts,
        keypoint_errors,
        max_stance_slip: violations.get("stance_slip").copied().unwrap_or(0.0),
        status,
        iterations,
        violations,
    })
}

impl KinematicSettings {
    fn validate(&self) -> Result<(), RetargetError> {
        let wrong = |field: &str, found: String, expected: &str| {
            Err(RetargetError::Setting { field: field.into(), found, expected: expected.into() })
        };
        if !(1.0..=1000.0).contains(&self.rate) {
            return wrong("rate", self.rate.to_string(), "1 to 1000 knots a second");
        }
        if !(0.02..=0.5).contains(&self.ball_radius) {
            return wrong("ball_radius", self.ball_radius.to_string(), "0.02 to 0.5 m");
        }
        if self.iterations == 0 {
            return wrong("iterations", "0".into(), "at least 1");
        }
        Ok(())
    }
}

/// The targets with the world's origin moved to `origin`.
fn moved(mut targets: Targets, origin: &Vector3<f64>) -> Targets {
    for frame in &mut targets.frames {
        frame.positions.iter_mut().for_each(|position| *position -= origin);
    }
    // The human keeps its own size; its place is that of the robot's at the origin.
    let scaled = origin / targets.scale;
    targets.human.iter_mut().flatten().for_each(|position| *position -= scaled);
    targets
}
