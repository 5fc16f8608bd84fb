//! The table of bone names: what the usual skeletons call each segment.
//!
//! Sources: CMU's ASF files; the BVH conversions of CMU's database by B. Hahne (cgspeed.com), Mixamo's and LAFAN1's
//! skeletons; the names of the early BVH files. Conventions are whole: one name can mean two things in two of them.

use super::Segment;
use crate::clip::Skeleton;
use crate::phase::Side;

/// Bone names of one convention: candidates for each segment, the first that a skeleton has wins. Compared without
/// case, after dropping a prefix up to a colon ("mixamorig:", "Character1:"). `#` stands for the side.
pub(super) struct Names {
    pub(super) convention: &'static str,
    left_right: [&'static str; 2],
    pelvis: &'static [&'static str],
    chest: &'static [&'static str],
    head: &'static [&'static str],
    /// Thigh, shank, foot, toes, upper arm, forearm, hand.
    limbs: [&'static [&'static str]; 7],
    /// The bone whose tip is the finger tip; the hand's own tip where the skeleton has none of them.
    finger: &'static [&'static str],
}

pub(super) const CONVENTIONS: [Names; 3] = [
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
    /// Names that `segment` may have.
    pub(super) fn candidates(&self, segment: Segment) -> Vec<String> {
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

    /// The bone that ends at the finger tips.
    pub(super) fn finger(&self, skeleton: &Skeleton, side: Side) -> Option<usize> {
        let word = self.left_right[usize::from(side == Side::Right)];
        let names: Vec<String> = self.finger.iter().map(|name| name.replace('#', word)).collect();
        find_bone(skeleton, &names)
    }
}

/// The first of `candidates` that the skeleton has.
pub(super) fn find_bone(skeleton: &Skeleton, candidates: &[String]) -> Option<usize> {
    let plain = |name: &str| name.rsplit(':').next().unwrap_or_default().to_ascii_lowercase();
    candidates.iter().find_map(|wanted| skeleton.bones.iter().position(|bone| plain(&bone.name) == *wanted))
}

#[cfg(test)]
mod tests {
    use crate::clip::{Bone, Skeleton};
    use crate::landmark::{Landmarks, Segment};
    use nalgebra::Vector3;

    /// A skeleton with these bones, all on the first one.
    fn skeleton(names: &[&str]) -> Skeleton {
        let bone = |(i, name): (usize, &&str)| Bone {
            name: (*name).to_owned(),
            parent: (i > 0).then_some(0),
            origin: Vector3::zeros(),
            tip: Vector3::x() * 0.1,
        };
        Skeleton { bones: names.iter().enumerate().map(bone).collect() }
    }

    /// `middle` and, for both sides, `limbs` with `#` replaced.
    fn names(middle: &[&str], limbs: &[&str], sides: [&str; 2]) -> Vec<String> {
        let both = sides.iter().flat_map(|side| limbs.iter().map(|limb| limb.replace('#', side)));
        middle.iter().map(|name| (*name).to_owned()).chain(both).collect()
    }

    #[test]
    fn usual_skeletons_are_known() {
        let cmu = ["#HipJoint", "#UpLeg", "#Leg", "#Foot", "#ToeBase", "#Shoulder", "#Arm", "#ForeArm", "#Hand"];
        let lafan = ["#UpLeg", "#Leg", "#Foot", "#Toe", "#Shoulder", "#Arm", "#ForeArm", "#Hand"];
        let mixamo = cmu.map(|name| format!("mixamorig:{name}"));
        let mixamo: Vec<&str> = mixamo.iter().map(String::as_str).collect();
        let early = ["#Hip", "#Knee", "#Ankle", "#Toe", "#Collar", "#Shoulder", "#Elbow", "#Wrist"];
        let sides = ["Left", "Right"];
        for (names, chest) in [
            (names(&["Hips", "LowerBack", "Spine", "Spine1", "Neck", "Neck1", "Head"], &cmu, sides), "Spine1"),
            (names(&["Hips", "Spine", "Spine1", "Spine2", "Neck", "Head"], &lafan, sides), "Spine2"),
            (names(&["mixamorig:Hips", "mixamorig:Spine2", "mixamorig:Head"], &mixamo, sides), "mixamorig:Spine2"),
            (names(&["Hips", "Chest", "Neck", "Head"], &early, sides), "Chest"),
        ] {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let landmarks = Landmarks::find(&skeleton(&names)).unwrap();
            assert_eq!(names[landmarks.bone(Segment::Chest)], chest);
            // No two segments are the same bone.
            let mut bones = Segment::ALL.map(|segment| landmarks.bone(segment));
            bones.sort_unstable();
            assert!(bones.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
        }
    }
}
