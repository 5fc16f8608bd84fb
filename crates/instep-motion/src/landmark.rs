//! Which bone of a skeleton is the pelvis, a knee, a toe; where these are at each frame.
//!
//! Problem: skeletons name their bones as they like. A table of the usual naming conventions (CMU's ASF, CMU's BVH,
//! Mixamo and LAFAN, the older "LeftHip/LeftKnee" one) finds the bones; everything after that is by [`Landmark`] and
//! [`Segment`]. Conventions are tried as a whole, since "LeftHip" is a joint in one and a hip bone in another.
//!
//! The heel and the sole are derived, no file has them. They rest on one assumption: **in the zero pose the feet
//! stand flat**, true of CMU's skeletons and of T-poses. The sole is then the horizontal plane [`SOLE_DEPTH`] below
//! the ball of the foot, and the heel lies [`HEEL_FRACTION`] of the distance from ankle to toe tip behind the ankle.
//! A zero pose with pointed feet would put the heel elsewhere; nothing here detects that.

use nalgebra::{UnitQuaternion, Vector3};

use crate::MotionError;
use crate::clip::{BonePoses, Skeleton};
use crate::phase::Side;

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

/// Bone names of one convention: candidates for each segment, the first that a skeleton has wins. Compared without
/// case, after dropping a prefix up to a colon ("mixamorig:", "Character1:"). `#` stands for the side.
struct Names {
    convention: &'static str,
    left_right: [&'static str; 2],
    pelvis: &'static [&'static str],
    chest: &'static [&'static str],
    head: &'static [&'static str],
    /// Thigh, shank, foot, toes, upper arm, forearm, hand.
    limbs: [&'static [&'static str]; 7],
    /// The bone whose tip is the finger tip; the hand's own tip where the skeleton has none of them.
    finger: &'static [&'static str],
}

const CONVENTIONS: [Names; 3] = [
    Names {
        convention: "CMU ASF",
        left_right: ["l", "r"],
        pelvis: &["root"],
        chest: &["thorax"],
        head: &["head"],
        limbs: [&["#femur"], &["#tibia"], &["#foot"], &["#toes"], &["#humerus"], &["#radius"], &["#hand"]],
        finger: &["#fingers"],
    },
    Names {
        convention: "CMU BVH, Mixamo and LAFAN",
        left_right: ["left", "right"],
        pelvis: &["hips", "hip", "pelvis"],
        chest: &["spine3", "spine2", "spine1", "spine", "chest"],
        head: &["head"],
        limbs: [&["#upleg"], &["#leg"], &["#foot"], &["#toebase", "#toe"], &["#arm"], &["#forearm"], &["#hand"]],
        finger: &["#handmiddle4", "#handmiddle3", "#handindex4", "#handindex1", "#fingerbase"],
    },
    Names {
        convention: "BVH with joint names (LeftHip, LeftKnee)",
        left_right: ["left", "right"],
        pelvis: &["hips", "pelvis", "root"],
        chest: &["chest4", "chest3", "chest2", "chest", "upperchest"],
        head: &["head"],
        limbs: [&["#hip"], &["#knee"], &["#ankle"], &["#toe"], &["#shoulder"], &["#elbow"], &["#wrist"]],
        finger: &["#hand", "#finger"],
    },
];

impl Names {
    fn candidates(&self, segment: Segment) -> Vec<String> {
        let limb = |limb: usize, side: Side| {
            let word = self.left_right[usize::from(side == Side::Right)];
            self.limbs[limb].iter().map(|name| name.replace('#', word)).collect()
        };
        let plain = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        match segment {
            Segment::Pelvis => plain(self.pelvis),
            Segment::Chest => plain(self.chest),
            Segment::Head => plain(self.head),
            Segment::Thigh(s) => limb(0, s),
            Segment::Shank(s) => limb(1, s),
            Segment::Foot(s) => limb(2, s),
            Segment::Toes(s) => limb(3, s),
            Segment::UpperArm(s) => limb(4, s),
            Segment::Forearm(s) => limb(5, s),
            Segment::Hand(s) => limb(6, s),
        }
    }

    fn finger(&self, skeleton: &Skeleton, side: Side) -> Option<usize> {
        let word = self.left_right[usize::from(side == Side::Right)];
        let names: Vec<String> = self.finger.iter().map(|name| name.replace('#', word)).collect();
        find_bone(skeleton, &names)
    }
}

fn find_bone(skeleton: &Skeleton, candidates: &[String]) -> Option<usize> {
    let plain = |name: &str| name.rsplit(':').next().unwrap_or_default().to_ascii_lowercase();
    candidates.iter().find_map(|wanted| skeleton.bones.iter().position(|bone| plain(&bone.name) == *wanted))
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
            sole(&zero, bones[Segment::Foot(side).slot()], bones[Segment::Toes(side).slot()], &toe_tips[slot(side)])
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

/// The sole of one foot, from the zero pose (see the module's assumption).
fn sole(zero: &BonePoses, foot: usize, toes: usize, toe_tip: &Point) -> Sole {
    let (ankle, ball, tip) = (zero.origins[foot], zero.origins[toes], toe_tip.at(zero));
    let plane = ball.z - SOLE_DEPTH;
    let forward = Vector3::new(tip.x - ankle.x, tip.y - ankle.y, 0.0);
    let heel = ankle - forward * HEEL_FRACTION;
    let on_sole =
        |bone: usize, p: Vector3<f64>| Point { bone, local: Vector3::new(p.x, p.y, plane) - zero.origins[bone] };
    Sole { heel: on_sole(foot, heel), ball: on_sole(foot, ball), toe_tip: on_sole(toes, tip) }
}
