//! ASF with AMC, and BVH, of one motion give that motion.

use instep_motion::clip::{self, BonePoses, Clip, LoadOptions};
use instep_motion::landmark::{Landmark, Landmarks};
use instep_motion::{asf, bvh};

use crate::synthetic::{self, RATE, data};

fn asf_clip() -> Clip {
    asf::load_clip(&data("kick.asf"), &data("kick_01.amc"), RATE).unwrap()
}

fn bvh_clip() -> Clip {
    bvh::load_clip(&data("kick.bvh"), bvh::CENTIMETRE).unwrap()
}

/// Largest distance between the landmarks of two clips of the same motion, m.
fn apart(a: &Clip, b: &Clip) -> f64 {
    let (la, lb) = (Landmarks::find(&a.skeleton).unwrap(), Landmarks::find(&b.skeleton).unwrap());
    assert_eq!(a.frames.len(), b.frames.len());
    let (mut pa, mut pb) = (BonePoses::default(), BonePoses::default());
    let mut most: f64 = 0.0;
    for frame in 0..a.frames.len() {
        a.poses_into(frame, &mut pa);
        b.poses_into(frame, &mut pb);
        for landmark in Landmark::ALL {
            most = most.max((la.position(&pa, landmark) - lb.position(&pb, landmark)).norm());
        }
    }
    most
}

#[test]
fn asf_and_bvh_agree_with_each_other_and_with_the_formulas() {
    let truth = synthetic::clip();
    let (asf, bvh) = (asf_clip(), bvh_clip());
    for clip in [&asf, &bvh] {
        clip.validate().unwrap();
        assert_eq!(clip.rate, 60.0);
        assert!(apart(clip, &truth) < 1e-6, "{}", apart(clip, &truth));
    }
    assert!(apart(&asf, &bvh) < 1e-6);
}

#[test]
fn files_in_data_are_what_the_generator_writes() {
    let clip = synthetic::clip();
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str, text: String| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let fresh = asf::load_clip(&at("a.asf", synthetic::asf()), &at("a.amc", synthetic::amc(&clip)), RATE).unwrap();
    assert!(apart(&fresh, &asf_clip()) < 1e-9);
    let fresh = bvh::load_clip(&at("a.bvh", synthetic::bvh(&clip)), bvh::CENTIMETRE).unwrap();
    assert!(apart(&fresh, &bvh_clip()) < 1e-9);
}

#[test]
fn the_dispatcher_reads_by_extension_and_never_guesses_a_unit() {
    let options = LoadOptions { amc_rate: RATE, ..LoadOptions::default() };
    assert_eq!(clip::load(&data("kick_01.amc"), &options).unwrap(), asf_clip());
    let with_unit = LoadOptions { bvh_metres_per_unit: Some(bvh::CENTIMETRE), ..LoadOptions::default() };
    assert_eq!(clip::load(&data("kick.bvh"), &with_unit).unwrap(), bvh_clip());
    let error = clip::load(&data("kick.bvh"), &options).unwrap_err().to_string();
    assert!(error.contains("unit of length: not given; the figure is 166.0 units tall"), "{error}");
    let error = clip::load(&data("kick.fbx"), &options).unwrap_err().to_string();
    assert!(error.contains("kick.fbx: extension: \"fbx\"; expected .amc or .bvh"), "{error}");
}

#[test]
fn resampling_keeps_the_motion() {
    let clip = asf_clip();
    assert!(apart(&clip.resampled(RATE).unwrap(), &clip) < 1e-9);
    let fine = clip.resampled(240.0).unwrap();
    assert_eq!(fine.frames.len(), 4 * (clip.frames.len() - 1) + 1);
    assert!((fine.duration() - clip.duration()).abs() < 1e-12);
    assert!(apart(&fine.resampled(RATE).unwrap(), &clip) < 1e-9);
    assert!(clip.resampled(0.0).is_err() && clip.resampled(f64::NAN).is_err() && clip.resampled(1e300).is_err());
}

#[test]
fn forward_kinematics_of_a_pose_done_by_hand() {
    // Frame 0: looking 0.4 rad to the left, left thigh raised by 0.9 rad, knee bent by 1.3 rad.
    let clip = asf_clip();
    let (poses, landmarks) = (clip.poses(0), Landmarks::find(&clip.skeleton).unwrap());
    let left = instep_motion::phase::Side::Left;
    let (ahead, aside) = ((0.4_f64.cos(), 0.4_f64.sin()), (-(0.4_f64.sin()), 0.4_f64.cos()));
    let (forward, down) =
        (0.42 * 0.9_f64.sin() - 0.41 * 0.4_f64.sin(), 0.08 + 0.42 * 0.9_f64.cos() + 0.41 * 0.4_f64.cos());
    let root = clip.frames[0].root;
    let want =
        [root.x + ahead.0 * forward + aside.0 * 0.09, root.y + ahead.1 * forward + aside.1 * 0.09, root.z - down];
    let got = landmarks.position(&poses, Landmark::Ankle(left));
    assert!((got - nalgebra::Vector3::from(want)).norm() < 1e-7, "{got} {want:?}");
    assert!((landmarks.knee_flexion(&poses, left) - 1.3).abs() < 1e-7);
    assert!((landmarks.elbow_flexion(&poses, left) - 0.5).abs() < 1e-7);
}

#[test]
fn a_missing_bone_is_named() {
    let mut skeleton = synthetic::skeleton();
    for bone in &mut skeleton.bones {
        if bone.name == "rtibia" {
            bone.name = "shin".to_owned();
        }
    }
    let error = Landmarks::find(&skeleton).unwrap_err().to_string();
    assert!(error.contains("no bone for right shank") && error.contains("rtibia"), "{error}");
}

#[test]
fn toes_without_length_are_missing() {
    let mut skeleton = synthetic::skeleton();
    for bone in skeleton.bones.iter_mut().filter(|bone| bone.name == "ltoes") {
        bone.tip = nalgebra::Vector3::zeros();
    }
    let error = Landmarks::find(&skeleton).unwrap_err().to_string();
    assert!(error.contains("left toe tip"), "{error}");
}
