//! Makes the targets of standing feet stand still: removes foot slip from what is to be followed (paper 1,
//! section II-A.1: the contact schedule "enables the imposition of constraints that prevent foot skating").
//!
//! During a stance the foot keeps one place and one heading, its mean over the stance; flat while heel and toe stand,
//! rolling over the toe or the heel while only that one stands, never sideways. Before and after, the correction fades
//! out, so that the target does not jump at touch-down and lift-off, where it would ask for impossible joint speeds.
//!
//! A foot in the air is kept at least a little above the ground. The human's shoe grazes it, and scaled to another foot
//! that becomes a stumble.

use instep_motion::contact::{ContactSchedule, FootContact, Stance};
use instep_motion::landmark::Landmark;
use instep_motion::phase::Side;
use instep_robot::Robot;
use nalgebra::{UnitQuaternion, Vector3};

use crate::rescale::{Target, Targets};
use crate::stance::is_toe;

/// Time over which a correction fades out beside a stance, s.
const FADE: f64 = 0.12;

/// Least height of a swinging sole above the ground, m; reached over the same time beside a stance.
const CLEARANCE: f64 = 0.03;

/// Where the foot is: its toe joint and its rotation.
#[derive(Debug, Clone, Copy)]
struct FootPose {
    toe: Vector3<f64>,
    sole: UnitQuaternion<f64>,
    toes: UnitQuaternion<f64>,
}

/// The robot's foot, in the sole's axes, m.
struct FootShape {
    /// From the toe joint to the lowest point of the heel.
    heel: Vector3<f64>,
    /// Height of the toe joint above the ground when the foot stands flat.
    height: f64,
}

/// Settles both feet of `targets`.
pub(crate) fn settle(robot: &Robot, targets: &mut Targets, contacts: &ContactSchedule) {
    for side in [Side::Left, Side::Right] {
        let Some(shape) = foot_shape(robot, targets, side) else { continue };
        let foot = contacts.foot(side);
        let original: Vec<FootPose> = targets.frames.iter().map(|frame| pose(targets, frame, side)).collect();
        for &stance in &foot.stances {
            let locked = lock(&original, foot, stance, &shape);
            let fade = (FADE * contacts.rate).round().max(1.0) as isize;
            let reach = stance.start as isize - fade..=stance.end as isize + fade;
            for frame in 0..original.len() {
                if !reach.contains(&(frame as isize)) || (foot.stance[frame] && !contains(stance, frame)) {
                    continue;
                }
                let nearest = frame.clamp(stance.start, stance.end);
                let away = (frame as f64 - nearest as f64).abs() / fade as f64;
                let share = 1.0 - away * away * (3.0 - 2.0 * away);
                correct(targets, frame, side, &original[nearest], &locked[nearest - stance.start], share);
            }
        }
    }
}

/// Height above the ground that each foot's points should keep at each frame while they do not stand, m: left, right.
/// Zero in a stance, rising to the full clearance as the foot is away from it.
pub(crate) fn clearance(contacts: &ContactSchedule) -> Vec<[f64; 2]> {
    let fade = FADE * contacts.rate;
    (0..contacts.feet[0].stance.len())
        .map(|frame| {
            [Side::Left, Side::Right].map(|side| {
                let gap = |s: &Stance| s.start.saturating_sub(frame).max(frame.saturating_sub(s.end));
                let away = contacts.foot(side).stances.iter().map(gap).min().unwrap_or(usize::MAX);
                let share = (away as f64 / fade).min(1.0);
                CLEARANCE * share * share * (3.0 - 2.0 * share)
            })
        })
        .collect()
}

fn contains(stance: Stance, frame: usize) -> bool {
    (stance.start..=stance.end).contains(&frame)
}

fn place(targets: &Targets, frame: &Target, landmark: Landmark) -> Option<Vector3<f64>> {
    targets.keypoints.iter().position(|k| k.landmark == landmark).map(|i| frame.positions[i])
}

fn pose(targets: &Targets, frame: &Target, side: Side) -> FootPose {
    FootPose {
        toe: place(targets, frame, Landmark::ToeBase(side)).unwrap_or_else(Vector3::zeros),
        sole: frame.soles[side as usize],
        toes: frame.toes[side as usize],
    }
}

fn foot_shape(robot: &Robot, targets: &Targets, side: Side) -> Option<FootShape> {
    let mut data = robot.data();
    let mut q = vec![0.0; robot.nq()];
    q[3] = 1.0;
    data.set_position(&q);
    let toe = targets.keypoints.iter().find(|k| k.landmark == Landmark::ToeBase(side)).map(|k| data.point(&k.at))?;
    let ground = data.point(&robot.leg(side).sole).z;
    let heels: Vec<Vector3<f64>> = robot
        .contacts
        .iter()
        .filter(|contact| contact.leg == side && !is_toe(robot, contact))
        .map(|contact| data.point(&contact.at) - Vector3::z() * contact.radius)
        .collect();
    let heel = heels.iter().sum::<Vector3<f64>>() / heels.len().max(1) as f64;
    Some(FootShape { heel: heel - toe, height: toe.z - ground })
}

/// The foot's pose at each frame of a stance.
fn lock(original: &[FootPose], foot: &FootContact, stance: Stance, shape: &FootShape) -> Vec<FootPose> {
    let frames = stance.start..=stance.end;
    let count = frames.clone().count() as f64;
    let mean = frames.clone().map(|f| original[f].toe).sum::<Vector3<f64>>() / count;
    let ahead = frames.clone().map(|f| original[f].sole * Vector3::x()).sum::<Vector3<f64>>();
    let yaw = ahead.y.atan2(ahead.x);
    let flat = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
    let toe = Vector3::new(mean.x, mean.y, shape.height);
    frames
        .map(|f| {
            let (_, pitch, _) = original[f].sole.euler_angles();
            let tilted = UnitQuaternion::from_euler_angles(0.0, pitch, yaw);
            match (foot.heel[f], foot.toe[f]) {
                // Rolling over the heel: the heel's point stays where it is when the foot is flat.
                (true, false) => {
                    let sole = UnitQuaternion::from_euler_angles(0.0, pitch.min(0.0), yaw);
                    FootPose { toe: toe + flat * shape.heel - sole * shape.heel, sole, toes: sole }
                }
                // Rolling over the toe: toe down, heel up.
                (false, true) => {
                    let sole = UnitQuaternion::from_euler_angles(0.0, pitch.max(0.0), yaw);
                    FootPose { toe, sole, toes: flat }
                }
                (true, true) => FootPose { toe, sole: flat, toes: flat },
                (false, false) => FootPose { toe, sole: tilted, toes: flat },
            }
        })
        .collect()
}

/// Moves and turns the foot of one frame by `share` of what leads from `from` to `to`.
fn correct(targets: &mut Targets, frame: usize, side: Side, from: &FootPose, to: &FootPose, share: f64) {
    let identity = UnitQuaternion::identity();
    let part = |rotation: UnitQuaternion<f64>| identity.try_slerp(&rotation, share, 1e-9).unwrap_or(identity);
    let turn = part(to.sole * from.sole.inverse());
    let turn_toes = part(to.toes * from.toes.inverse());
    let shift = (to.toe - from.toe) * share;
    let Targets { keypoints, frames, .. } = targets;
    let target = &mut frames[frame];
    let Some(joint) = keypoints.iter().position(|k| k.landmark == Landmark::ToeBase(side)).map(|i| target.positions[i])
    else {
        return;
    };
    for (keypoint, position) in keypoints.iter().zip(&mut target.positions) {
        let about = match keypoint.landmark {
            Landmark::Ankle(s) | Landmark::Heel(s) | Landmark::ToeBase(s) if s == side => turn,
            Landmark::ToeTip(s) if s == side => turn_toes,
            _ => continue,
        };
        *position = joint + shift + about * (*position - joint);
    }
    let i = side as usize;
    target.soles[i] = turn * target.soles[i];
    target.toes[i] = turn_toes * target.toes[i];
}
