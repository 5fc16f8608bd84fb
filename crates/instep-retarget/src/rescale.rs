//! From the human's landmarks to the robot's: heading, scale and link lengths (paper 1, section II-A.1, Fig 3a).
//!
//! World frame of the result: x along the kick's direction, ground at z = 0; the origin is set later, under the ball.
//!
//! Link lengths are replaced from the root outwards: each link keeps the human's direction and takes the robot's
//! length; rigid parts (hips and shoulders on their girdles, the foot) take the robot's own geometry, turned as the
//! human's. That moves the feet, and with them the contact with the ground. So the whole body is then shifted, frame by
//! frame but smoothly, to where the standing foot belongs: the human's foot scaled by the ratio of leg lengths, sole
//! on the ground. Without this, scaling makes feet float and skate, which users of other retargeters report.

use instep_motion::clip::{BonePoses, Clip};
use instep_motion::contact::ContactSchedule;
use instep_motion::landmark::{Landmark, Landmarks, Segment};
use instep_motion::phase::Side;
use instep_robot::{LinkPoint, Robot};
use nalgebra::{UnitQuaternion, Vector3};

use crate::RetargetError;

/// Width of the smoothing of the shift to the ground, s.
const SHIFT_SMOOTHING: f64 = 0.04;
/// How much a foot in the air counts beside a standing one when the shift is computed.
const AIR_WEIGHT: f64 = 0.02;

/// One thing on the robot that follows one thing on the human.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keypoint {
    /// What it follows.
    pub landmark: Landmark,
    /// The point on the robot.
    pub at: LinkPoint,
}

/// What the robot should do at one frame of the clip.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Where each keypoint should be, m; in the order of [`Targets::keypoints`].
    pub positions: Vec<Vector3<f64>>,
    /// `world_from_pelvis`.
    pub pelvis: UnitQuaternion<f64>,
    /// `world_from_chest`.
    pub chest: UnitQuaternion<f64>,
    /// `world_from_sole`, left and right: level when the foot stands flat.
    pub soles: [UnitQuaternion<f64>; 2],
    /// `world_from_toes`, left and right.
    pub toes: [UnitQuaternion<f64>; 2],
}

/// The targets of a whole clip.
#[derive(Debug, Clone, PartialEq)]
pub struct Targets {
    /// The robot's keypoints.
    pub keypoints: Vec<Keypoint>,
    /// One a frame of the clip.
    pub frames: Vec<Target>,
    /// The human's own landmarks in the same heading, ground at z = 0, unscaled; one list a frame, in the order of
    /// [`Landmark::ALL`].
    pub human: Vec<Vec<Vector3<f64>>>,
    /// The robot's leg length over the human's.
    pub scale: f64,
}

/// The name of a landmark in `robot.toml`: `pelvis`, `left_knee`.
#[must_use]
pub fn landmark_name(landmark: Landmark) -> String {
    let sided = |side: Side, name: &str| format!("{side}_{name}");
    match landmark {
        Landmark::Pelvis => "pelvis".into(),
        Landmark::Chest => "chest".into(),
        Landmark::Head => "head".into(),
        Landmark::Hip(s) => sided(s, "hip"),
        Landmark::Knee(s) => sided(s, "knee"),
        Landmark::Ankle(s) => sided(s, "ankle"),
        Landmark::ToeBase(s) => sided(s, "toe_base"),
        Landmark::ToeTip(s) => sided(s, "toe_tip"),
        Landmark::Heel(s) => sided(s, "heel"),
        Landmark::Shoulder(s) => sided(s, "shoulder"),
        Landmark::Elbow(s) => sided(s, "elbow"),
        Landmark::Wrist(s) => sided(s, "wrist"),
        Landmark::HandTip(s) => sided(s, "hand_tip"),
    }
}

/// The robot's keypoints: every landmark that its file places.
///
/// # Errors
/// When pelvis, a hip, knee, ankle or toe base is not placed.
pub fn keypoints(robot: &Robot) -> Result<Vec<Keypoint>, RetargetError> {
    let mut found = Vec::new();
    for landmark in Landmark::ALL {
        let name = landmark_name(landmark);
        match robot.landmark(&name) {
            Some(at) => found.push(Keypoint { landmark, at: *at }),
            None if is_needed(landmark) => {
                return Err(RetargetError::Landmark { robot: robot.name.clone(), landmark: name });
            }
            None => {}
        }
    }
    Ok(found)
}

fn is_needed(landmark: Landmark) -> bool {
    matches!(
        landmark,
        Landmark::Pelvis
            | Landmark::Chest
            | Landmark::Hip(_)
            | Landmark::Knee(_)
            | Landmark::Ankle(_)
            | Landmark::ToeBase(_)
    )
}

/// The robot's geometry between landmarks in its zero pose, where all link frames are level.
struct Geometry {
    zero: Vec<(Landmark, Vector3<f64>)>,
    sole: [Vector3<f64>; 2],
}

impl Geometry {
    fn new(robot: &Robot, keypoints: &[Keypoint]) -> Self {
        let mut data = robot.data();
        let mut q = vec![0.0; robot.nq()];
        q[3] = 1.0;
        data.set_position(&q);
        let zero = keypoints.iter().map(|k| (k.landmark, data.point(&k.at))).collect();
        let sole = [0, 1].map(|i| data.point(&robot.legs[i].sole));
        Self { zero, sole }
    }

    fn at(&self, landmark: Landmark) -> Option<Vector3<f64>> {
        self.zero.iter().find(|(known, _)| *known == landmark).map(|(_, at)| *at)
    }

    /// From `a` to `b` in the zero pose, m; zero where one of them is not on the robot.
    fn between(&self, a: Landmark, b: Landmark) -> Vector3<f64> {
        self.at(a).zip(self.at(b)).map_or_else(Vector3::zeros, |(a, b)| b - a)
    }
}

/// Rescales every frame of `clip` to `robot`, with the kick's `direction` (horizontal unit vector in the clip's world)
/// turned to x.
///
/// # Errors
/// When the robot's file does not place a landmark that is needed.
pub fn rescale(
    robot: &Robot,
    clip: &Clip,
    landmarks: &Landmarks,
    contacts: &ContactSchedule,
    direction: &Vector3<f64>,
) -> Result<Targets, RetargetError> {
    let keypoints = keypoints(robot)?;
    let geometry = Geometry::new(robot, &keypoints);
    let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -direction.y.atan2(direction.x));
    let down = Vector3::z() * contacts.ground;
    let scale = leg_length(&geometry) / human_leg_length(clip, landmarks);

    let mut poses = BonePoses::default();
    let mut frames = Vec::with_capacity(clip.frames.len());
    let mut human = Vec::with_capacity(clip.frames.len());
    let mut shifts = Vec::with_capacity(clip.frames.len());
    for frame in 0..clip.frames.len() {
        clip.poses_into(frame, &mut poses);
        let at = |landmark| heading * (landmarks.position(&poses, landmark) - down);
        let turn = |segment| heading * landmarks.rotation(&poses, segment);
        let sides = [Side::Left, Side::Right];
        let soles = sides.map(|side| heading * landmarks.sole_rotation(&poses, side));
        let body = Body {
            geometry: &geometry,
            at: &at,
            pelvis: turn(Segment::Pelvis),
            chest: turn(Segment::Chest),
            soles,
            toes: sides.map(|side| turn(Segment::Toes(side))),
            scale,
        };
        let positions: Vec<_> = keypoints.iter().map(|keypoint| body.place(keypoint.landmark)).collect();
        shifts.push(body.shift(contacts, frame));
        frames.push(Target { positions, pelvis: body.pelvis, chest: body.chest, soles, toes: body.toes });
        human.push(Landmark::ALL.map(&at).to_vec());
    }
    smooth(&mut shifts, SHIFT_SMOOTHING * clip.rate);
    for (frame, shift) in frames.iter_mut().zip(&shifts) {
        frame.positions.iter_mut().for_each(|position| *position += shift);
    }
    Ok(Targets { keypoints, frames, human, scale })
}

/// One frame of the human, with the robot's geometry to be laid over it.
struct Body<'a> {
    geometry: &'a Geometry,
    at: &'a dyn Fn(Landmark) -> Vector3<f64>,
    pelvis: UnitQuaternion<f64>,
    chest: UnitQuaternion<f64>,
    soles: [UnitQuaternion<f64>; 2],
    toes: [UnitQuaternion<f64>; 2],
    scale: f64,
}

impl Body<'_> {
    /// Where the human's landmark is, its middle of the hips for the pelvis, m.
    fn human(&self, landmark: Landmark) -> Vector3<f64> {
        match landmark {
            Landmark::Pelvis => ((self.at)(Landmark::Hip(Side::Left)) + (self.at)(Landmark::Hip(Side::Right))) / 2.0,
            other => (self.at)(other),
        }
    }

    /// Where the robot's landmark belongs, m: recursively from the root, link by link.
    fn place(&self, landmark: Landmark) -> Vector3<f64> {
        use Landmark::{Ankle, Chest, Elbow, HandTip, Head, Heel, Hip, Knee, Pelvis, Shoulder, ToeBase, ToeTip, Wrist};
        match landmark {
            Pelvis => self.human(Pelvis) * self.scale,
            Hip(_) => self.rigid(Pelvis, landmark, &self.pelvis),
            Knee(s) => self.along(Hip(s), landmark),
            Ankle(s) => self.along(Knee(s), landmark),
            ToeBase(s) => self.rigid(Ankle(s), landmark, &self.soles[s as usize]),
            Heel(s) => self.rigid(Ankle(s), landmark, &self.soles[s as usize]),
            ToeTip(s) => self.rigid(ToeBase(s), landmark, &self.toes[s as usize]),
            Chest => self.along(Pelvis, landmark),
            Head => self.along(Chest, landmark),
            Shoulder(_) => self.rigid(Chest, landmark, &self.chest),
            Elbow(s) => self.along(Shoulder(s), landmark),
            Wrist(s) => self.along(Elbow(s), landmark),
            HandTip(s) => self.along(Wrist(s), landmark),
        }
    }

    /// The robot's length in the human's direction.
    fn along(&self, parent: Landmark, landmark: Landmark) -> Vector3<f64> {
        let direction = self.human(landmark) - self.human(parent);
        let length = self.geometry.between(parent, landmark).norm();
        self.place(parent) + direction.try_normalize(1e-9).unwrap_or_else(Vector3::zeros) * length
    }

    /// The robot's own offset, turned as the human's part is.
    fn rigid(&self, parent: Landmark, landmark: Landmark, rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
        self.place(parent) + rotation * self.geometry.between(parent, landmark)
    }

    /// By how much the body must be shifted for its feet to be where the human's are, scaled, m.
    fn shift(&self, contacts: &ContactSchedule, frame: usize) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        let mut weights = Vector3::zeros();
        for side in [Side::Left, Side::Right] {
            let ankle = Landmark::Ankle(side);
            let placed = self.place(ankle);
            let wanted = self.human(ankle) * self.scale;
            let foot = contacts.foot(side);
            let across = if foot.stance[frame] { 1.0 } else { AIR_WEIGHT };
            let mut shift = wanted - placed;
            let mut weight = Vector3::new(across, across, AIR_WEIGHT * AIR_WEIGHT);
            if foot.stance[frame] {
                // The sole, or the toe joint where the heel is up, belongs on the ground.
                let i = side as usize;
                let under = self.geometry.sole[i] - self.geometry.at(ankle).unwrap_or_else(Vector3::zeros);
                let toe = self.geometry.between(ankle, Landmark::ToeBase(side));
                let toe_bottom = placed + self.soles[i] * Vector3::new(toe.x, toe.y, under.z);
                let heel_bottom = placed + self.soles[i] * Vector3::new(-0.3 * toe.x.abs(), 0.0, under.z);
                let lowest = if foot.toe[frame] && !foot.heel[frame] {
                    toe_bottom.z
                } else if foot.heel[frame] && !foot.toe[frame] {
                    heel_bottom.z
                } else {
                    toe_bottom.z.min(heel_bottom.z)
                };
                shift.z = -lowest;
                weight.z = 1.0;
            }
            sum += weight.component_mul(&shift);
            weights += weight;
        }
        sum.component_div(&weights)
    }
}

/// Hip to sole of the straight leg, m.
fn leg_length(geometry: &Geometry) -> f64 {
    let side = Side::Left;
    geometry.between(Landmark::Hip(side), Landmark::Knee(side)).norm()
        + geometry.between(Landmark::Knee(side), Landmark::Ankle(side)).norm()
        + geometry.at(Landmark::Ankle(side)).map_or(0.0, |ankle| (ankle - geometry.sole[side as usize]).z)
}

/// Hip to sole of the straight leg, mean of both, m.
fn human_leg_length(clip: &Clip, landmarks: &Landmarks) -> f64 {
    let zero = clip.skeleton.zero_poses();
    let at = |landmark| landmarks.position(&zero, landmark);
    let leg = |side| {
        let sole = landmarks.sole(&zero, side);
        (at(Landmark::Hip(side)) - at(Landmark::Knee(side))).norm()
            + (at(Landmark::Knee(side)) - at(Landmark::Ankle(side))).norm()
            + (at(Landmark::Ankle(side)) - sole.ball).z.abs()
    };
    0.5 * (leg(Side::Left) + leg(Side::Right))
}

/// Gaussian smoothing of a track with the standard deviation `width` (frames), ends repeated.
fn smooth(track: &mut [Vector3<f64>], width: f64) {
    let reach = (3.0 * width).ceil() as isize;
    let original = track.to_vec();
    let last = original.len() as isize - 1;
    for (i, value) in track.iter_mut().enumerate() {
        let mut sum = Vector3::zeros();
        let mut weights = 0.0;
        for offset in -reach..=reach {
            let weight = (-0.5 * (offset as f64 / width).powi(2)).exp();
            let from = (i as isize + offset).clamp(0, last) as usize;
            sum += original[from] * weight;
            weights += weight;
        }
        *value = sum / weights;
    }
}
