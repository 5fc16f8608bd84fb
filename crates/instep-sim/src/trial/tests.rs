//! The measures of a trial, each on a record or peaks made by hand.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use super::*;

fn wolfgang() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/wolfgang")).unwrap()
}

/// Samples of a standing robot whose base is shifted by `places` (m) and moves at `speeds` (m/s), without load.
fn record(robot: &Robot, times: &[f64], places: &[[f64; 3]], speeds: &[[f64; 2]]) -> Record {
    let mut record = Record { times: times.to_vec(), ..Record::default() };
    for (place, speed) in places.iter().zip(speeds) {
        let mut q = robot.stand.clone();
        (0..3).for_each(|k| q[k] += place[k]);
        let mut v = vec![0.0; robot.nv()];
        v[..2].copy_from_slice(speed);
        record.q.extend(q);
        record.v.extend(v);
        record.contact_forces.extend(vec![0.0; 3 * robot.contacts.len()]);
    }
    record
}

#[test]
fn the_slip_is_the_longest_way_of_a_loaded_point_of_the_support_foot() {
    let robot = wolfgang();
    let mut data = robot.data();
    let places = [[0.0, 0.0, 0.0], [0.006, 0.008, 0.1], [0.1, 0.0, 0.0], [0.103, 0.004, 0.0], [0.5, 0.0, 0.0]];
    let mut record = record(&robot, &[0.0, 1.0, 2.0, 3.0, 4.0], &places, &[[0.0; 2]; 5]);
    let of = |side| robot.contacts.iter().position(|contact| contact.leg == side).unwrap();
    let width = 3 * robot.contacts.len();
    let mut load = |contact: usize, forces: [f64; 5]| {
        (0..5).for_each(|i| record.contact_forces[i * width + 3 * contact + 2] = forces[i]);
    };
    // Loaded, loaded, unloaded, loaded, unloaded: one way of 10 mm along the ground, then none.
    load(of(Side::Left), [25.0, 25.0, LOADED - 1.0, 25.0, 0.0]);
    load(of(Side::Right), [0.0, 0.0, 25.0, 25.0, 0.0]);
    assert!((record.slip(&robot, Side::Left, &mut data) - 0.010).abs() < 1e-9);
    assert!((record.slip(&robot, Side::Right, &mut data) - 0.005).abs() < 1e-9);
}

#[test]
fn segments_have_their_fastest_moment_around_the_impact_along_the_wanted_direction() {
    let robot = wolfgang();
    let mut data = robot.data();
    let times = [0.1, 0.6, 1.0, 1.05, 1.2];
    let speeds = [[9.0, 9.0], [1.0, 4.0], [2.0, 1.0], [3.0, 2.0], [8.0, 8.0]];
    let record = record(&robot, &times, &[[0.0; 3]; 5], &speeds);
    let peaks = |direction, data: &mut RobotData| record.segment_peaks(&robot, Side::Right, 1.0, direction, data);
    let ahead = peaks(0.0, &mut data);
    let names: Vec<_> = ahead.iter().map(|peak| peak.segment).collect();
    assert_eq!(names, ["pelvis", "thigh", "shank", "foot"]);
    assert!(ahead.iter().all(|peak| (peak.speed - 3.0).abs() < 1e-9 && peak.time == 1.05), "{ahead:?}");
    let left = peaks(std::f64::consts::FRAC_PI_2, &mut data);
    assert!(left.iter().all(|peak| (peak.speed - 4.0).abs() < 1e-9 && peak.time == 0.6), "{left:?}");
}

#[test]
fn a_group_tells_its_highest_torque_and_speed_with_their_joints() {
    let robot = wolfgang();
    let mut peaks = vec![JointPeak::default(); robot.joints.len()];
    let hips: Vec<usize> = (0..robot.joints.len()).filter(|&j| robot.joints[j].group == 0).collect();
    (peaks[hips[0]].torque, peaks[hips[1]].torque, peaks[hips[2]].speed) = (4.0, 5.0, 2.0);
    let hip = group_peaks(&robot, &peaks).remove(0);
    assert_eq!((hip.torque_joint, hip.torque), (robot.joints[hips[1]].name.clone(), 5.0));
    assert_eq!((hip.speed_joint, hip.speed), (robot.joints[hips[2]].name.clone(), 2.0));
    assert_eq!((hip.torque_limit, hip.speed_limit), (robot.joints[hips[1]].torque, robot.joints[hips[2]].speed));
    assert_eq!(group_peaks(&robot, &peaks).len(), robot.groups.len());
}

#[test]
fn what_goes_beyond_a_limit_is_told_with_the_time() {
    let robot = wolfgang();
    let mut peaks = vec![JointPeak::default(); robot.joints.len()];
    let (torque, speed) = (robot.joints[3].torque, robot.joints[3].speed);
    // On the limit, and within what one step can overshoot.
    (peaks[3].torque, peaks[3].speed) = (torque, speed * 1.01);
    assert_eq!(violations(&robot, &peaks), []);
    peaks[3] = JointPeak { torque: torque * 1.001, torque_time: 0.5, speed: speed * 1.03, speed_time: 0.7 };
    let found = violations(&robot, &peaks);
    let told: Vec<_> = found.iter().map(|v| (v.joint.as_str(), v.quantity, v.limit, v.time)).collect();
    let name = robot.joints[3].name.as_str();
    assert_eq!(told, [(name, "torque", torque, 0.5), (name, "speed", speed, 0.7)]);
    assert_eq!((found[0].peak, found[1].peak), (torque * 1.001, speed * 1.03));
}

#[test]
fn the_link_that_struck_says_which_leg_kicked() {
    let robot = wolfgang();
    assert_eq!(kicking_side(&robot, "l_foot"), Some(Side::Left));
    assert_eq!(kicking_side(&robot, "r_lower_leg"), Some(Side::Right));
    assert_eq!(kicking_side(&robot, "head"), None);
}

#[test]
fn an_outcome_is_the_balls_last_velocity_beside_the_wanted_direction() {
    let touch = |ball_velocity| Impact {
        time: 0.0,
        duration: 0.01,
        link: "l_foot".into(),
        point: [0.0; 3],
        normal: [1.0, 0.0, 0.0],
        impulse: 1.0,
        depth: 0.0,
        foot_speed: 1.0,
        foot_speed_normal: 1.0,
        approach: 1.0,
        effective_mass: 1.0,
        restitution: 0.5,
        ball_velocity,
        kinetic_before: 1.0,
        kinetic_after: 1.0,
        motor_work: 0.0,
        push_work: 0.0,
        gravity_work: 0.0,
    };
    let mut course = Course {
        touches: vec![touch([9.0, 0.0, 0.0]), touch([0.0, 3.0, 4.0])],
        finished: true,
        fell_at: Some(1.0),
        peaks: vec![],
        ball_end: [0.0; 3],
    };
    let outcome = course.outcome(1.0);
    assert_eq!((outcome.ball_speed, outcome.upright), (Some(5.0), false));
    assert!((outcome.direction_error.unwrap() - (std::f64::consts::FRAC_PI_2 - 1.0)).abs() < 1e-12);
    course.touches = vec![touch([-1.0, -0.1, 0.0])];
    // Across the half turn the short way.
    let error = course.outcome(3.1).direction_error.unwrap();
    assert!((error - 0.1f64.atan() - (std::f64::consts::PI - 3.1)).abs() < 1e-12, "{error}");
    course.touches.clear();
    assert_eq!(course.outcome(0.0).ball_speed, None);
}
