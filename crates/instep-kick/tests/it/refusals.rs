//! What cannot be kicked is refused before the robot moves, each thing with its own cause.

use instep_kick::{KickEngine, KickRequest, KickStatus, Refusal, Strength};
use instep_robot::control::{Controller, JointCommand};
use proptest::prelude::*;

use crate::rig::{engine, request, robot, standing};

fn refused(name: &str, request: &KickRequest) -> Refusal {
    let robot = robot(name);
    let mut engine = engine(name);
    let refusal = engine.plan(request, &standing(&robot)).expect_err("a refusal");
    // The robot goes on standing.
    assert_eq!(engine.progress().status, KickStatus::Idle);
    let mut command = JointCommand::zeros(robot.joints.len());
    for _ in 0..20 {
        engine.tick(&standing(&robot), &mut command);
        let moved = command.positions.iter().zip(&robot.stand[7..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved < 0.02, "the robot moved by {moved} rad after {refusal}");
    }
    refusal
}

#[test]
fn each_cause_has_its_own_name() {
    for name in ["nao", "wolfgang"] {
        let good = request(name);
        let with = |change: fn(&mut KickRequest)| {
            let mut request = good;
            change(&mut request);
            refused(name, &request)
        };
        assert!(matches!(with(|r| r.ball[0] = f64::NAN), Refusal::NotFinite { field: "ball" }));
        assert!(matches!(with(|r| r.direction = f64::INFINITY), Refusal::NotFinite { field: "direction" }));
        assert!(matches!(with(|r| r.strength = Strength::Distance(f64::NAN)), Refusal::NotFinite { .. }));
        assert!(matches!(with(|r| r.strength = Strength::BallSpeed(-1.0)), Refusal::NoStrength { .. }));
        assert!(matches!(with(|r| r.ball = [-0.25, 0.0]), Refusal::BallBehind { .. }));
        assert!(matches!(with(|r| r.ball = [0.02, 0.0]), Refusal::BallUnderRobot { .. }));
        assert!(matches!(with(|r| r.ball = [3.0, 0.0]), Refusal::TooFar { .. }));
        assert!(matches!(with(|r| r.strength = Strength::BallSpeed(9.0)), Refusal::TooFast { .. }));
        assert!(matches!(with(|r| r.deadline = Some(0.1)), Refusal::TooLate { .. }));
        assert!(matches!(with(|r| r.precision = Some(0.001)), Refusal::TooImprecise { .. }));
    }
}

/// A level foot on a straight way binds NAO's ankle at 1.2 m/s of ball speed: it pitches and rises before the request is refused, and
/// what is planned is at most a little slower than asked.
#[test]
fn a_foot_that_pitches_is_faster_than_a_level_one() {
    let robot = robot("nao");
    for (asked, least) in [(1.0, 1.0), (1.6, 0.9 * 1.6), (2.0, 0.8 * 2.0)] {
        let request = KickRequest::new([0.17, -0.05], 0.0, asked);
        let plan = engine("nao").plan(&request, &standing(&robot)).unwrap_or_else(|e| panic!("{}", e.explain(&robot)));
        assert!((least - 1e-9..=asked + 1e-9).contains(&plan.ball_speed), "{} of {asked} m/s", plan.ball_speed);
    }
}

#[test]
fn a_second_request_is_refused_while_the_first_runs_and_a_fallen_robot_does_not_kick() {
    let robot = robot("nao");
    let mut engine = engine("nao");
    let mut sensors = standing(&robot);
    engine.plan(&request("nao"), &sensors).unwrap();
    let another = KickRequest { direction: 0.3, ..request("nao") };
    assert_eq!(engine.plan(&another, &sensors), Err(Refusal::Busy));
    let mut other = crate::rig::engine("nao");
    sensors.joint_positions[3] += 1.0;
    assert!(matches!(other.plan(&request("nao"), &sensors), Err(Refusal::NotStanding { joint: 3, .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// No request makes the planner panic or plan something that is not finite.
    #[test]
    fn any_request_is_planned_or_refused(
        x in prop_oneof![-4.0..4.0f64, 0.1..0.4f64, Just(f64::NAN)], y in prop_oneof![-3.0..3.0f64, -0.2..0.2f64],
        vx in -1.0..1.0f64, direction in -4.0..4.0f64, speed in prop_oneof![-1.0..20.0f64, 0.3..1.2f64],
    ) {
        thread_local! {
            static ENGINE: std::cell::RefCell<(instep_kick::dynamic::DynamicKick, instep_robot::control::Sensors)> =
                std::cell::RefCell::new((engine("nao"), standing(&robot("nao"))));
        }
        ENGINE.with_borrow_mut(|(engine, sensors)| {
            let mut request = KickRequest::new([x, y], direction, speed);
            request.ball_velocity = [if vx > 0.5 { vx } else { 0.0 }, 0.0];
            match engine.plan(&request, sensors) {
                Ok(plan) => {
                    assert!(plan.contact > 0.0 && plan.duration > plan.contact && plan.duration < 20.0);
                    assert!(plan.foot_speed.is_finite() && plan.ball_speed > 0.0);
                    // Free it for the next request.
                    *engine = crate::rig::engine("nao");
                }
                Err(refusal) => assert!(!refusal.to_string().is_empty()),
            }
        });
    }
}
