//! The kinematic stage on the project's own clip, and on CMU's where they are beside the repository.

use std::path::{Path, PathBuf};

use instep_motion::MotionError;
use instep_motion::asf;
use instep_motion::clip::Clip;
use instep_motion::phase::Side;
use instep_motion::reference::Source;
use instep_retarget::RetargetError;
use instep_retarget::kinematic::{ContactForm, KinematicSettings, Retargeted, Status, retarget};
use instep_robot::Robot;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn robot(name: &str) -> Robot {
    Robot::load(&root().join("robots").join(name)).unwrap()
}

fn own_clip() -> Clip {
    let data = root().join("crates/instep-motion/tests/data");
    asf::load_clip(&data.join("kick.asf"), &data.join("kick_01.amc"), asf::CMU_RATE).unwrap()
}

fn source(clip: &str) -> Source {
    Source { clip: clip.into(), skeleton: None, clip_start: 0.0, acknowledgement: String::new() }
}

fn run(robot: &Robot, clip: &Clip, settings: &KinematicSettings) -> Retargeted {
    retarget(robot, clip, source("test"), settings, &mut |_| {}).unwrap()
}

/// What must hold for every retargeted clip in the enforced form.
fn check(robot: &Robot, done: &Retargeted) {
    assert_eq!(done.status, Status::Solved);
    assert!(done.max_stance_slip < 0.005, "slip {} m", done.max_stance_slip);
    assert!(done.violations["joint_limit"] <= 0.0, "{:?}", done.violations);
    assert!(done.violations["stance_height"] < 0.005, "feet float: {:?}", done.violations);
    assert!(done.violations["penetration"] < 0.005, "{:?}", done.violations);
    done.reference.validate().unwrap();
    for (knot, k) in done.reference.knots.iter().zip(0..) {
        for (joint, angle) in robot.joints.iter().zip(&knot.joints) {
            assert!((joint.range[0]..=joint.range[1]).contains(angle), "knot {k}: {} at {angle}", joint.name);
        }
    }
}

#[test]
fn the_projects_own_clip_becomes_a_reference() {
    let (robot, clip) = (robot("prestoe"), own_clip());
    let done = run(&robot, &clip, &KinematicSettings::default());
    check(&robot, &done);
    let reference = &done.reference;
    assert_eq!(reference.robot, "prestoe");
    assert_eq!(reference.rate, 30.0);
    // One knot stands at the impact, whatever the rate.
    let knot = reference.phases.t_impact * reference.rate;
    assert!((knot - knot.round()).abs() < 1e-6, "{knot}");
    let faster = run(&robot, &clip, &KinematicSettings { rate: 77.0, ..KinematicSettings::default() });
    let knot = faster.reference.phases.t_impact * 77.0;
    assert!((knot - knot.round()).abs() < 1e-6, "{knot}");
}

/// The ball is where the foot is at the impact: just touching it, in front of it.
#[test]
fn the_ball_lies_where_the_foot_meets_it() {
    let (robot, clip) = (robot("prestoe"), own_clip());
    let done = run(&robot, &clip, &KinematicSettings::default());
    let frame = (done.phases.t_impact * clip.rate).round() as usize;
    let mut data = robot.data();
    data.set_position(&done.positions[frame]);
    let leg = robot.leg(done.phases.kick_foot);
    let ball = nalgebra::Vector3::from(done.reference.ball);
    let gap = leg
        .strike
        .iter()
        .map(|&geom| {
            let (axis, radius) = data.capsule(geom);
            instep_robot::closest_points(axis, [ball; 2]).distance() - radius - 0.11
        })
        .fold(f64::INFINITY, f64::min);
    assert!(gap.abs() < 0.002, "gap {gap} m");
}

#[test]
fn the_same_clip_gives_the_same_bytes() {
    let (robot, clip) = (robot("prestoe"), own_clip());
    let settings = KinematicSettings::default();
    assert_eq!(run(&robot, &clip, &settings), run(&robot, &clip, &settings));
}

#[test]
fn a_clip_without_a_kick_is_refused_by_name() {
    let mut clip = own_clip();
    let first = clip.frames[0].clone();
    clip.frames.fill(first);
    let refused = retarget(&robot("prestoe"), &clip, source("test"), &KinematicSettings::default(), &mut |_| {});
    assert!(matches!(refused, Err(RetargetError::Motion(MotionError::NoKick { .. }))), "{refused:?}");
}

#[test]
fn cmu_kicks_keep_the_bars() {
    let clips = root().join("../shared/data/cmu_mocap");
    if !clips.exists() {
        println!("skipped: CMU's clips are not at ../shared/data/cmu_mocap");
        return;
    }
    let robot = robot("prestoe");
    for name in ["10_01", "10_02", "10_03", "10_05", "10_06"] {
        let clip = asf::load_clip(&clips.join("10.asf"), &clips.join(format!("{name}.amc")), asf::CMU_RATE).unwrap();
        let done = run(&robot, &clip, &KinematicSettings::default());
        check(&robot, &done);
        assert_eq!(done.phases.kick_foot, Side::Right, "{name}");
        assert!(done.keypoint_error_mean() < 0.02, "{name}: {} m", done.keypoint_error_mean());
        let slip = run(&robot, &clip, &KinematicSettings { form: ContactForm::Slip, ..KinematicSettings::default() });
        assert!(slip.max_stance_slip > done.max_stance_slip, "{name} keeps its own slip");
    }
}
