//! CMU's clips, read from beside the project: the kick's instant, foot and speeds against the table of their README,
//! and forward kinematics against a chain of matrices written out by hand. Skipped where the files are absent.

use std::path::PathBuf;

use instep_motion::asf;
use instep_motion::clip::Clip;
use instep_motion::contact::{self, ContactSettings};
use instep_motion::landmark::{Landmark, Landmarks, Segment};
use instep_motion::phase::{KickSettings, SMOOTHING, Side, find_kick, kick_direction, peak_speeds, strike_time};
use nalgebra::{Matrix3, Vector3};

/// The folder of the clips, or a message and `None`.
pub(crate) fn folder() -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/cmu_mocap");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: CMU's clips are not at {}", folder.display());
    None
}

fn load(name: &str) -> Option<Clip> {
    let folder = folder()?;
    Some(asf::load_clip(&folder.join("10.asf"), &folder.join(name), asf::CMU_RATE).unwrap())
}

/// Trial, kick instant (s), ankle, ball and toe tip peak speeds (m/s), frames, support foot settles before (s).
const TABLE: [(&str, f64, [f64; 3], usize, f64); 5] = [
    ("10_01.amc", 4.97, [9.9, 10.9, 11.8], 801, 0.18),
    ("10_02.amc", 2.91, [11.1, 12.2, 13.3], 590, 0.13),
    ("10_03.amc", 1.13, [11.5, 12.6, 13.6], 362, 0.12),
    ("10_05.amc", 2.48, [10.9, 11.3, 12.0], 436, 0.15),
    ("10_06.amc", 3.40, [11.5, 12.6, 13.5], 572, 0.13),
];

#[test]
fn kicks_are_those_of_the_table() {
    for (name, instant, speeds, frames, settled) in TABLE {
        let Some(clip) = load(name) else { return };
        clip.validate().unwrap();
        assert_eq!(clip.frames.len(), frames, "{name}");
        let landmarks = Landmarks::find(&clip.skeleton).unwrap().calibrated(&clip);
        let contacts = contact::detect(&clip, &landmarks, &ContactSettings::default()).unwrap();
        let phases = find_kick(&clip, &landmarks, &contacts, &KickSettings::default()).unwrap();
        phases.validate().unwrap();
        let peak = peak_speeds(&clip, &landmarks, &phases, SMOOTHING);
        let direction = kick_direction(&clip, &landmarks, &phases).unwrap();
        println!(
            "{name}: {phases:?} {peak:?} ground {:.3} m, direction {:.1} deg",
            contacts.ground,
            direction.y.atan2(direction.x).to_degrees()
        );
        assert_eq!(phases.kick_foot, Side::Right, "{name}");
        assert!((phases.t_impact - instant).abs() <= 1.0 / 60.0, "{name}: {} {instant}", phases.t_impact);
        let before = phases.t_impact - phases.t_plant;
        assert!((before - settled).abs() <= 0.06, "{name}: planted {before} before, not {settled}");
        assert!(phases.t_swing < phases.t_lock && phases.t_impact - phases.t_swing < 0.3, "{name}: {phases:?}");
        for (got, want) in [peak.ankle, peak.ball, peak.toe_tip].into_iter().zip(speeds) {
            assert!((got - want).abs() < 0.05 * want, "{name}: {got} {want}");
        }
        // The run-up comes from behind and the left of the shot's line.
        let pelvis = |t: f64| clip.frames[clip.frame_at(t)].root;
        // The ball is met a little after the foot is fastest, at about the same heading in all trials.
        let strike = strike_time(&clip, &landmarks, &phases).unwrap();
        assert!((0.01..0.05).contains(&(strike - phases.t_impact)), "{name}: met at {strike}");
        assert!(direction.y.atan2(direction.x).to_degrees().abs() < 10.0, "{name}: {direction}");
        let run_up = pelvis(phases.t_impact) - pelvis(phases.t_impact - 0.6);
        let approach = direction.cross(&run_up).z.atan2(direction.dot(&run_up)).to_degrees();
        println!("   approach {approach:.1} deg, {before:.3} s from plant to impact, ball met at {strike:.3} s");
        assert!((-60.0..-5.0).contains(&approach), "{name}: approach {approach}");
    }
}

#[test]
fn stance_feet_stand_near_the_ground_and_the_lower_foot_is_down_most_of_the_time() {
    for (name, ..) in TABLE {
        let Some(clip) = load(name) else { return };
        let landmarks = Landmarks::find(&clip.skeleton).unwrap().calibrated(&clip);
        let contacts = contact::detect(&clip, &landmarks, &ContactSettings::default()).unwrap();
        assert!(contacts.ground.abs() < 0.05, "{name}: ground at {}", contacts.ground);
        let count = clip.frames.len();
        let down = (0..count).filter(|i| contacts.feet.iter().any(|foot| foot.stance[*i])).count();
        assert!(down as f64 > 0.6 * count as f64, "{name}: only {down} of {count} frames in contact");
    }
}

#[test]
fn zero_pose_is_a_person_facing_x() {
    let Some(folder) = folder() else { return };
    let skeleton = asf::load_skeleton(&folder.join("10.asf")).unwrap();
    skeleton.validate().unwrap();
    assert_eq!(skeleton.bones.len(), 31);
    let (zero, landmarks) = (skeleton.zero_poses(), Landmarks::find(&skeleton).unwrap());
    assert_eq!(landmarks.convention(), "CMU ASF");
    let at = |landmark| landmarks.position(&zero, landmark);
    let pairs: [fn(Side) -> Landmark; 10] = [
        Landmark::Hip,
        Landmark::Knee,
        Landmark::Ankle,
        Landmark::ToeBase,
        Landmark::ToeTip,
        Landmark::Heel,
        Landmark::Shoulder,
        Landmark::Elbow,
        Landmark::Wrist,
        Landmark::HandTip,
    ];
    for pair in pairs {
        let (left, right) = (at(pair(Side::Left)), at(pair(Side::Right)));
        assert!(left.y > 0.0 && right.y < 0.0, "{left} {right}");
        // A person's two sides are alike but not equal: 4 cm at the end of the arm.
        assert!((left - Vector3::new(right.x, -right.y, right.z)).norm() < 0.04, "{left} {right}");
    }
    assert!(at(Landmark::Head).z - at(Landmark::ToeTip(Side::Left)).z > 1.5);
    assert!(at(Landmark::ToeTip(Side::Left)).x > at(Landmark::Ankle(Side::Left)).x + 0.1);
    // A length by the formula of CMU's FAQ.
    let femur = &skeleton.bones[skeleton.index("lfemur").unwrap()];
    assert!((femur.tip.norm() - 7.14567 * (1.0 / 0.45) * 2.54 / 100.0).abs() < 1e-6);
}

#[test]
fn a_knee_bends_by_the_angle_in_the_file() {
    let Some(clip) = load("10_05.amc") else { return };
    let landmarks = Landmarks::find(&clip.skeleton).unwrap();
    let poses = clip.poses(0);
    // Frame 1 of the file: rtibia 40.1301, ltibia 37.9039 degrees, about an axis square to thigh and shank.
    assert!((landmarks.knee_flexion(&poses, Side::Right).to_degrees() - 40.1301).abs() < 1e-3);
    assert!((landmarks.knee_flexion(&poses, Side::Left).to_degrees() - 37.9039).abs() < 1e-3);
    // Right elbow likewise: rradius 29.6924 degrees.
    let elbow = landmarks.elbow_flexion(&poses, Side::Right).to_degrees();
    assert!((elbow - 29.6924).abs() < 0.1, "{elbow}");
}

/// Rotation about a file axis, in file axes.
fn turn(axis: usize, degrees: f64) -> Matrix3<f64> {
    let (s, c) = degrees.to_radians().sin_cos();
    match axis {
        0 => Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c),
        1 => Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c),
        _ => Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
    }
}

fn xyz([x, y, z]: [f64; 3]) -> Matrix3<f64> {
    turn(2, z) * turn(1, y) * turn(0, x)
}

/// The right leg of 10_05's first frame, in file axes and units, with the numbers copied from the files.
#[test]
fn right_leg_by_a_chain_of_matrices() {
    let Some(clip) = load("10_05.amc") else { return };
    let bone = |axis: [f64; 3], angles: [f64; 3]| xyz(axis) * xyz(angles) * xyz(axis).transpose();
    let root = xyz([7.01194, -18.4281, -0.411305]);
    let femur = root * bone([0.0, 0.0, -20.0], [-17.5006, 3.51161, 23.8673]);
    let tibia = femur * bone([0.0, 0.0, -20.0], [40.1301, 0.0, 0.0]);
    let foot = tibia * bone([-90.0, 0.0, -20.0], [-25.7245, 0.0, -12.4239]);
    let toes = foot * bone([-90.0, 0.0, -20.0], [18.5047, 0.0, 0.0]);
    let hip = Vector3::new(11.8616, 17.8214, -38.4744) + root * Vector3::new(-0.496392, -0.78327, 0.374276) * 2.31584;
    let knee = hip + femur * Vector3::new(-0.34202, -0.939693, 0.0) * 7.47417;
    let ankle = knee + tibia * Vector3::new(-0.34202, -0.939693, 0.0) * 7.69071;
    let ball = ankle + foot * Vector3::new(-0.103069, -0.28318, 0.953512) * 2.16135;
    let tip = ball + toes * Vector3::new(-1.53581e-11, -4.21904e-11, 1.0) * 1.07867;
    let (poses, landmarks) = (clip.poses(0), Landmarks::find(&clip.skeleton).unwrap());
    let right = Side::Right;
    for (landmark, file) in [
        (Landmark::Hip(right), hip),
        (Landmark::Knee(right), knee),
        (Landmark::Ankle(right), ankle),
        (Landmark::ToeBase(right), ball),
        (Landmark::ToeTip(right), tip),
    ] {
        let want = Vector3::new(file.z, file.x, file.y) * (2.54 / 100.0 / 0.45);
        let got = landmarks.position(&poses, landmark);
        assert!((got - want).norm() < 1e-9, "{landmark:?}: {got} {want}");
    }
    // Rotations too: a direction of the foot, taken to our axes.
    let up = foot * Vector3::y();
    let got = landmarks.rotation(&poses, Segment::Foot(right)) * Vector3::z();
    assert!((got - Vector3::new(up.z, up.x, up.y)).norm() < 1e-9);
}
