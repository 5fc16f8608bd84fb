//! How a trial is judged: every figure of a row follows from these.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use instep_sim::audit::{Audit, Fault};
use instep_sim::impact::Impact;
use instep_sim::trial::{LimitViolation, Record};

use super::*;

const ASKED: f64 = 2.0;

fn subject() -> Subject {
    Subject::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots"), "wolfgang").unwrap()
}

fn case(subject: &Subject, side: f64) -> Case {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/straight.toml");
    let mut case = Scenario::load(&file).unwrap().cases(&subject.size, 1, 1)[0];
    case.request = KickRequest::new([0.2, 0.0], 0.0, ASKED);
    (case.side, case.turn) = (side, 0.3);
    case
}

fn impact() -> Impact {
    Impact {
        time: 1.25,
        duration: 0.01,
        link: "l_foot".into(),
        point: [0.2, 0.0, 0.05],
        normal: [1.0, 0.0, 0.0],
        impulse: 0.4,
        depth: 0.01,
        foot_speed: 1.5,
        foot_speed_normal: 1.4,
        approach: 1.4,
        effective_mass: 1.0,
        restitution: 0.6,
        ball_velocity: [2.0, 0.0, 0.0],
        kinetic_before: 10.0,
        kinetic_after: 10.0,
        motor_work: 0.0,
        push_work: 0.0,
        gravity_work: 0.0,
    }
}

/// A kick that sends the ball off at `speed` (m/s), `error` (rad) to the left, 1.2 m far and still rolling at 0.4 m/s.
fn trial(speed: f64, error: f64) -> Trial {
    let start = BallState::at_rest([0.2, 0.1, 0.07]);
    let mut last = BallState::at_rest([1.2, 0.1, 0.07]);
    last.velocity = [0.0, 0.4, 3.0];
    let violation = LimitViolation { joint: "LKnee".into(), quantity: "speed", peak: 9.0, limit: 8.0, time: 1.0 };
    Trial {
        impact: Some(impact()),
        touches: vec![impact()],
        audit: Audit { faults: vec![], energy_gain: Some(0.0), rerun: None, converged: true },
        ball_speed: Some(speed),
        direction_error: Some(error),
        launch_angle: Some(0.0),
        fell_at: None,
        support_slip: None,
        groups: vec![],
        limit_violations: vec![violation; 3],
        segments: vec![],
        ball_end: [1.2, 0.1, 0.07],
        record: Record { times: vec![0.0, 2.0], ball: vec![start, last], ..Record::default() },
    }
}

#[test]
fn a_kick_is_judged_by_the_believed_ball() {
    let subject = subject();
    let kicked = judge(&subject, &case(&subject, 1.0), &trial(1.8, 0.1));
    assert!(kicked.hit && kicked.delivered && kicked.converged && kicked.upright && !kicked.audit_invalid);
    assert_eq!((kicked.ball_speed, kicked.asked_speed), (Some(1.8), ASKED));
    assert_eq!((kicked.direction_error, kicked.turn_error), (Some(0.1), Some(-0.1)));
    assert_eq!((kicked.contact, kicked.violations, kicked.turn), (Some(1.25), 3, 0.3));
    // As far as it rolled, and on to rest from the last speed on the ground.
    let rest = 0.4 * 0.4 / (2.0 * subject.size.deceleration);
    assert!((kicked.distance - (1.0 + rest)).abs() < 1e-12, "{}", kicked.distance);
    let mirrored = judge(&subject, &case(&subject, -1.0), &trial(1.8, 0.1));
    assert_eq!(mirrored.turn_error, Some(0.1));
}

#[test]
fn a_ball_that_the_audit_does_not_believe_has_no_speed_direction_or_distance() {
    let subject = subject();
    let mut invalid = trial(1.8, 0.1);
    invalid.audit.faults.push(Fault::Unfinished);
    invalid.audit.converged = false;
    let kicked = judge(&subject, &case(&subject, 1.0), &invalid);
    assert!(kicked.audit_invalid && !kicked.hit && !kicked.delivered && !kicked.converged);
    assert_eq!((kicked.ball_speed, kicked.direction_error, kicked.turn_error), (None, None, None));
    assert_eq!(kicked.distance, 0.0);
    // A ball that was not touched is missed, not invalid.
    invalid.impact = None;
    let missed = judge(&subject, &case(&subject, 1.0), &invalid);
    assert!(!missed.audit_invalid && missed.contact.is_none());
}

#[test]
fn hit_and_delivered_have_their_bounds() {
    let subject = subject();
    let of = |speed: f64, error_deg: f64| {
        let kicked = judge(&subject, &case(&subject, 1.0), &trial(speed, error_deg.to_radians()));
        [kicked.hit, kicked.delivered]
    };
    assert_eq!(of(0.29 * ASKED, 0.0), [false, false]);
    assert_eq!(of(0.31 * ASKED, 0.0), [true, false]);
    assert_eq!(of(0.79 * ASKED, 0.0), [true, false]);
    assert_eq!(of(0.81 * ASKED, 0.0), [true, true]);
    for side in [1.0, -1.0] {
        assert_eq!(of(ASKED, side * 14.9), [true, true]);
        assert_eq!(of(ASKED, side * 15.1), [true, false]);
    }
    let mut fallen = trial(ASKED, 0.0);
    fallen.fell_at = Some(1.9);
    let kicked = judge(&subject, &case(&subject, 1.0), &fallen);
    assert_eq!((kicked.hit, kicked.upright, kicked.delivered), (true, false, false));
    // Exactly on the bound, and a ball that was missed.
    assert_eq!(of(0.3 * ASKED, 0.0), [false, false]);
    let mut missed = trial(ASKED, 0.0);
    (missed.ball_speed, missed.direction_error) = (None, None);
    assert!(!judge(&subject, &case(&subject, 1.0), &missed).hit);
}

#[test]
fn a_swinging_foot_on_the_ground_is_counted_from_the_lift_to_the_contact_or_fall() {
    let subject = subject();
    let robot = &subject.robot;
    let width = 3 * robot.contacts.len();
    let first = robot.contacts.iter().position(|contact| contact.leg == Side::Left).unwrap();
    let mut trial = trial(1.0, 0.0);
    trial.record.times = (0..10).map(f64::from).collect();
    trial.record.contact_forces = vec![0.0; 10 * width];
    for sample in 0..10 {
        trial.record.contact_forces[sample * width + 3 * first + 2] = 5.0;
        // A force along the ground is no load.
        trial.record.contact_forces[sample * width + 3 * first] = -1.0;
    }
    assert_eq!(grounded(robot, &trial, Side::Left, [2.0, 6.0]), 5);
    assert_eq!(grounded(robot, &trial, Side::Right, [2.0, 6.0]), 0);
    trial.fell_at = Some(3.5);
    assert_eq!(grounded(robot, &trial, Side::Left, [2.0, 6.0]), 2);
}
