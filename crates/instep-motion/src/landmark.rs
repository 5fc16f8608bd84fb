//! Which bone of a skeleton is the pelvis, a knee, a toe; where these are at each frame.
//!
//! Problem: skeletons name their bones as they like. A table of the usual naming conventions (CMU's ASF, CMU's BVH,
//! Mixamo and LAFAN, the older "LeftHip/LeftKnee" one) finds the bones; everything after that is by [`Landmark`] and
//! [`Segment`]. Conventions are tried as a whole, since "LeftHip" is a joint in one and a hip bone in another.
//!
//! The heel and the sole are derived, no file has them: the sole is a plane [`SOLE_DEPTH`] below the ball of the foot,
//! and the heel lies [`HEEL_FRACTION`] of the distance from ankle to toe tip behind the ankle. Before
//! [`Landmarks::calibrated`] takes the plane's slope from a clip in which the feet stand, it comes from the zero pose:
//! level along the toes, and sideways at a right angle to the shank. So it suits a T-pose as well as CMU's zero pose,
//! whose legs are spread by 20 degrees and whose feet are tilted with them.

mod names;

use nalgebra::{UnitQuaternion, Vector3};

use crate::MotionError;
use crate::clip::{BonePoses, Clip, Skeleton};
use crate::phase::Side;
use crate::track::{median, path, quantile, speeds};
use names::{CONVENTIONS, Names, find_bone};

/// How far the sole lies below the joint at the ball of the foot, m.
pub const SOLE_DEPTH: f64 = 0.02;

/// How far the heel lies behind the ankle, as a fraction of the horizontal distance from the ankle to the toe tip.
/// About a quarter of a foot's length lies behind the ankle, so a third of what lies before it.
pub const HEEL_FRACTION: f64 = 1.0 / 3.0;

/// A point of the body. "Joint" is the point where the bone below it starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Landmark {
    /// Origin of the root bone: between the hips, a hand's breadth above them in CMU's skeletons.
    Pelvis,
    /// Shoulder centre: midway between the two shoulder joints.
    Chest,
    /// Top end of the head bone.
    Head,
    /// Hip joint.
    Hip(Side),
    /// Knee joint.
    Knee(Side),
    /// Ankle joint.
    Ankle(Side),
    /// Ball of the foot: the joint of the toes.
    ToeBase(Side),
    /// End of the toes.
    ToeTip(Side),
    /// Lowest rear point of the heel, derived; at sole height.
    Heel(Side),
    /// Shoulder joint.
    Shoulder(Side),
    /// Elbow joint.
    Elbow(Side),
    /// Wrist joint: where the hand starts.
    Wrist(Side),
    /// Finger tips where the skeleton has fingers, else the end of the hand.
    HandTip(Side),
}

/// A rigid part of the body, for its rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Segment {
    /// The root bone.
    Pelvis,
    /// The topmost spine bone below neck and shoulders.
    Chest,
    /// The head.
    Head,
    /// Hip to knee.
    Thigh(Side),
    /// Knee to ankle.
    Shank(Side),
    /// Ankle to ball of the foot.
    Foot(Side),
    /// Ball of the foot to toe tip.
    Toes(Side),
    /// Shoulder to elbow.
    UpperArm(Side),
    /// Elbow to wrist; the last bone of it where there are two.
    Forearm(Side),
    /// Wrist to fingers.
    Hand(Side),
}

/// Points under a human foot, in the world, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolePoints {
    /// Rear end, turns with the foot.
    pub heel: Vector3<f64>,
    /// Under the ball of the foot, turns with the foot.
    pub ball: Vector3<f64>,
    /// Under the toe tip, turns with the toes.
    pub toe_tip: Vector3<f64>,
}

impl Landmark {
    /// Every landmark, middle ones first, then left and right of each.
    pub const ALL: [Self; 23] = {
        use Side::{Left, Right};
        [
            Self::Pelvis,
            Self::Chest,
            Self::Head,
            Self::Hip(Left),
            Self::Hip(Right),
            Self::Knee(Left),
            Self::Knee(Right),
            Self::Ankle(Left),
            Self::Ankle(Right),
            Self::ToeBase(Left),
            Self::ToeBase(Right),
            Self::ToeTip(Left),
            Self::ToeTip(Right),
            Self::Heel(Left),
            Self::Heel(Right),
            Self::Shoulder(Left),
            Self::Shoulder(Right),
            Self::Elbow(Left),
            Self::Elbow(Right),
            Self::Wrist(Left),
            Self::Wrist(Right),
            Self::HandTip(Left),
            Self::HandTip(Right),
        ]
    };
}

impl Segment {
    /// Every segment, middle ones first, then left and right of each.
    pub const ALL: [Self; 17] = {
        use Side::{Left, Right};
        [
            Self::Pelvis,
            Self::Chest,
            Self::Head,
            Self::Thigh(Left),
            Self::Thigh(Right),
            Self::Shank(Left),
            Self::Shank(Right),
            Self::Foot(Left),
            Self::Foot(Right),
            Self::Toes(Left),
            Self::Toes(Right),
            Self::UpperArm(Left),
            Self::UpperArm(Right),
            Self::Forearm(Left),
            Self::Forearm(Right),
            Self::Hand(Left),
            Self::Hand(Right),
        ]
    };

    /// Position in [`Self::ALL`].
    fn slot(self) -> usize {
        let side = |first: usize, side: Side| first + usize::from(side == Side::Right);
        match self {
            Self::Pelvis => 0,
            Self::Chest => 1,
            Self::Head => 2,
            Self::Thigh(s) => side(3, s),
            Self::Shank(s) => side(5, s),
            Self::Foot(s) => side(7, s),
            Self::Toes(s) => side(9, s),
            Self::UpperArm(s) => side(11, s),
            Self::Forearm(s) => side(13, s),
            Self::Hand(s) => side(15, s),
        }
    }

    /// What it is called in a message.
    fn label(self) -> String {
        match self {
            Self::Pelvis => "pelvis".to_owned(),
            Self::Chest => "chest".to_owned(),
            Self::Head => "head".to_owned(),
            Self::Thigh(s) => format!("{s} thigh"),
            Self::Shank(s) => format!("{s} shank"),
            Self::Foot(s) => format!("{s} foot"),
            Self::Toes(s) => format!("{s} toes"),
            Self::UpperArm(s) => format!("{s} upper arm"),
            Self::Forearm(s) => format!("{s} forearm"),
            Self::Hand(s) => format!("{s} hand"),
        }
    }
}

/// A point fixed to a bone.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    bone: usize,
    local: Vector3<f64>,
}

impl Point {
    fn at(&self, poses: &BonePoses) -> Vector3<f64> {
        poses.point(self.bone, &self.local)
    }
}

/// The sole's points of one foot.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sole {
    heel: Point,
    ball: Point,
    toe_tip: Point,
    /// Turns z into the sole's normal, the short way.
    foot_from_sole: UnitQuaternion<f64>,
}

/// The landmarks of one skeleton. Bone indices inside: use it only with poses of that skeleton.
#[derive(Debug, Clone, PartialEq)]
pub struct Landmarks {
    /// The naming convention that fitted, for reports.
    convention: &'static str,
    /// Bone of each segment, in the order of [`Segment::ALL`].
    bones: [usize; 17],
    head: Point,
    toe_tips: [Point; 2],
    hand_tips: [Point; 2],
    soles: [Sole; 2],
}

fn slot(side: Side) -> usize {
    usize::from(side == Side::Right)
}

impl Landmarks {
    /// Finds every landmark by the names of the bones, with the naming convention that finds most of them.
    ///
    /// # Errors
    ///
    /// [`MotionError::Landmarks`] with all that is missing in the convention that fits best; toes without a length
    /// (no toe tip) count as missing.
    pub fn find(skeleton: &Skeleton) -> Result<Self, MotionError> {
        let mut best: Option<(usize, MotionError)> = None;
        for names in &CONVENTIONS {
            match Self::with_names(skeleton, names) {
                Ok(found) => return Ok(found),
                Err((count, error)) if best.as_ref().is_none_or(|(fewest, _)| count < *fewest) => {
                    best = Some((count, error));
                }
                Err(_) => {}
            }
        }
        let nothing = || MotionError::argument("skeleton", "no naming convention", "one of the table");
        Err(best.map_or_else(nothing, |(_, error)| error))
    }

    fn with_names(skeleton: &Skeleton, names: &Names) -> Result<Self, (usize, MotionError)> {
        let (mut missing, mut wanted) = (Vec::new(), Vec::new());
        let bones = Segment::ALL.map(|segment| {
            let candidates = names.candidates(segment);
            let found = find_bone(skeleton, &candidates);
            if found.is_none() {
                missing.push(segment.label());
                wanted.push(candidates.join(" or "));
            }
            found.unwrap_or(0)
        });
        let tip = |bone: usize| Point { bone, local: skeleton.bones[bone].tip };
        for side in [Side::Left, Side::Right] {
            let toes = bones[Segment::Toes(side).slot()];
            let label = Segment::Toes(side).label();
            if !missing.contains(&label) && skeleton.bones[toes].tip.norm() < 1e-3 {
                missing.push(format!("{side} toe tip"));
                wanted.push(format!("an end of {:?} away from its start", skeleton.bones[toes].name));
            }
        }
        if !missing.is_empty() {
            let set = names.convention.to_owned();
            return Err((missing.len(), MotionError::Landmarks { missing, set, wanted }));
        }
        let zero = skeleton.zero_poses();
        let both = |f: &dyn Fn(Side) -> Point| [f(Side::Left), f(Side::Right)];
        let toe_tips = both(&|side| tip(bones[Segment::Toes(side).slot()]));
        let hand_tips =
            both(&|side| tip(names.finger(skeleton, side).unwrap_or_else(|| bones[Segment::Hand(side).slot()])));
        let soles = [Side::Left, Side::Right].map(|side| {
            let [foot, toes] = [Segment::Foot(side), Segment::Toes(side)].map(|segment| bones[segment.slot()]);
            let up = zero_pose_normal(&zero, [bones[Segment::Shank(side).slot()], foot, toes], &toe_tips[slot(side)]);
            Sole::new(&zero, [foot, toes], &toe_tips[slot(side)], up)
        });
        let head = tip(bones[Segment::Head.slot()]);
        Ok(Self { convention: names.convention, bones, head, toe_tips, hand_tips, soles })
    }

    /// The naming convention that fitted.
    #[must_use]
    pub fn convention(&self) -> &'static str {
        self.convention
    }

    /// Index of the bone that is `segment`.
    #[must_use]
    pub fn bone(&self, segment: Segment) -> usize {
        self.bones[segment.slot()]
    }

    /// `world_from_segment`, which is the segment's rotation away from the zero pose. No allocation.
    #[must_use]
    pub fn rotation(&self, poses: &BonePoses, segment: Segment) -> UnitQuaternion<f64> {
        poses.rotations[self.bone(segment)]
    }

    /// Where `landmark` is in the world, m. No allocation.
    #[must_use]
    pub fn position(&self, poses: &BonePoses, landmark: Landmark) -> Vector3<f64> {
        let joint = |segment| poses.origins[self.bone(segment)];
        match landmark {
            Landmark::Pelvis => joint(Segment::Pelvis),
            Landmark::Chest => (joint(Segment::UpperArm(Side::Left)) + joint(Segment::UpperArm(Side::Right))) / 2.0,
            Landmark::Head => self.head.at(poses),
            Landmark::Hip(s) => joint(Segment::Thigh(s)),
            Landmark::Knee(s) => joint(Segment::Shank(s)),
            Landmark::Ankle(s) => joint(Segment::Foot(s)),
            Landmark::ToeBase(s) => joint(Segment::Toes(s)),
            Landmark::ToeTip(s) => self.toe_tips[slot(s)].at(poses),
            Landmark::Heel(s) => self.soles[slot(s)].heel.at(poses),
            Landmark::Shoulder(s) => joint(Segment::UpperArm(s)),
            Landmark::Elbow(s) => joint(Segment::Forearm(s)),
            Landmark::Wrist(s) => joint(Segment::Hand(s)),
            Landmark::HandTip(s) => self.hand_tips[slot(s)].at(poses),
        }
    }

    /// The points under the foot on `side`, in the world. No allocation.
    #[must_use]
    pub fn sole(&self, poses: &BonePoses, side: Side) -> SolePoints {
        let sole = &self.soles[slot(side)];
        SolePoints { heel: sole.heel.at(poses), ball: sole.ball.at(poses), toe_tip: sole.toe_tip.at(poses) }
    }

    /// `world_from_sole`: the foot's rotation as it would be, had the foot stood flat in the zero pose. While the foot
    /// stands flat, this is a turn about z and nothing else. No allocation.
    #[must_use]
    pub fn sole_rotation(&self, poses: &BonePoses, side: Side) -> UnitQuaternion<f64> {
        self.rotation(poses, Segment::Foot(side)) * self.soles[slot(side)].foot_from_sole
    }

    /// The same landmarks with each sole's slope taken from the frames of `clip` in which that foot stands: its ball
    /// is slower than 0.2 m/s and the ankle is within 1 cm of its lowest decile among these. A foot that stands for
    /// less than 0.1 s altogether, or by more than 25 degrees off its zero pose's normal, keeps its sole.
    ///
    /// # Panics
    ///
    /// If `clip` fails [`Clip::validate`] or is not of this skeleton.
    #[must_use]
    pub fn calibrated(mut self, clip: &Clip) -> Self {
        const SLOW: f64 = 0.2;
        const NEAR: f64 = 0.01;
        let zero = clip.skeleton.zero_poses();
        for side in [Side::Left, Side::Right] {
            let balls = path(clip, |poses| self.position(poses, Landmark::ToeBase(side)));
            let ankles = path(clip, |poses| self.position(poses, Landmark::Ankle(side)));
            let slow: Vec<bool> = speeds(&balls, clip.rate, 0.05).iter().map(|speed| *speed < SLOW).collect();
            let resting = ankles.iter().zip(&slow).filter(|(_, slow)| **slow).map(|(ankle, _)| ankle.z).collect();
            let low = quantile(resting, 0.1) + NEAR;
            let ups = path(clip, |poses| self.rotation(poses, Segment::Foot(side)).inverse() * Vector3::z());
            let flat = |i: &usize| slow[*i] && ankles[*i].z <= low;
            let flat: Vec<Vector3<f64>> = (0..ups.len()).filter(flat).map(|i| ups[i]).collect();
            let up = Vector3::from_fn(|axis, _| median(flat.iter().map(|up| up[axis]).collect()));
            let expected = self.soles[slot(side)].foot_from_sole * Vector3::z();
            let up = up.try_normalize(1e-6).filter(|up| up.angle(&expected) < 25.0_f64.to_radians());
            if let (Some(up), true) = (up, flat.len() as f64 >= 0.1 * clip.rate) {
                let bones = [Segment::Foot(side), Segment::Toes(side)].map(|segment| self.bone(segment));
                self.soles[slot(side)] = Sole::new(&zero, bones, &self.toe_tips[slot(side)], up);
            }
        }
        self
    }

    /// Knee flexion on `side`, rad: 0 with thigh and shank in line, in `0..=pi`.
    #[must_use]
    pub fn knee_flexion(&self, poses: &BonePoses, side: Side) -> f64 {
        self.bend(poses, [Landmark::Hip(side), Landmark::Knee(side), Landmark::Ankle(side)])
    }

    /// Elbow flexion on `side`, rad: 0 with upper arm and forearm in line, in `0..=pi`.
    #[must_use]
    pub fn elbow_flexion(&self, poses: &BonePoses, side: Side) -> f64 {
        self.bend(poses, [Landmark::Shoulder(side), Landmark::Elbow(side), Landmark::Wrist(side)])
    }

    fn bend(&self, poses: &BonePoses, [from, joint, to]: [Landmark; 3]) -> f64 {
        let joint = self.position(poses, joint);
        (joint - self.position(poses, from)).angle(&(self.position(poses, to) - joint))
    }
}

/// The sole's unit normal as the zero pose has it (see the module's text).
fn zero_pose_normal(zero: &BonePoses, [shank, foot, toes]: [usize; 3], toe_tip: &Point) -> Vector3<f64> {
    let toes = toe_tip.at(zero) - zero.origins[toes];
    let forward = Vector3::new(toes.x, toes.y, 0.0).try_normalize(1e-6).unwrap_or_else(Vector3::x);
    let shank = zero.origins[shank] - zero.origins[foot];
    (shank - forward * forward.dot(&shank)).try_normalize(1e-6).unwrap_or_else(Vector3::z)
}

impl Sole {
    /// The sole of one foot whose plane has the unit normal `up` in the foot's frame.
    fn new(zero: &BonePoses, [foot, toes]: [usize; 2], toe_tip: &Point, up: Vector3<f64>) -> Self {
        let (ankle, ball, tip) = (zero.origins[foot], zero.origins[toes], toe_tip.at(zero));
        // In the zero pose every frame is the world's, so a vector there is a vector in the bone's frame.
        let level = |v: Vector3<f64>| v - up * up.dot(&v);
        let heel = ankle - level(tip - ankle) * HEEL_FRACTION;
        let on_sole = |bone: usize, p: Vector3<f64>| {
            let height = up.dot(&(p - ball)) + SOLE_DEPTH;
            Point { bone, local: p - up * height - zero.origins[bone] }
        };
        Self {
            heel: on_sole(foot, heel),
            ball: on_sole(foot, ball),
            toe_tip: on_sole(toes, tip),
            foot_from_sole: UnitQuaternion::rotation_between(&Vector3::z(), &up).unwrap_or_default(),
        }
    }
}
