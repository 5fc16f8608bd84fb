//! From a stand two metres off to a kicked ball, on real servos and senses.

use std::sync::Arc;

use instep_bench::cell::{CellKey, run_cell};
use instep_bench::{BenchError, Scenario, Subject};
use instep_kick::{KickRequest, KickStatus, Refusal};
use instep_robot::control::{JointCommand, Sensors};
use instep_sim::sensors::SensorSuite;
use instep_sim::{BallState, World};

use crate::root;

#[test]
fn small_robots_walk_up_to_a_ball_and_kick_it() {
    let scenario = Scenario::load(&root("scenarios/walk-up.toml")).unwrap();
    for robot in ["nao", "wolfgang"] {
        let subject = Subject::load(&root("robots"), robot).unwrap();
        let key = CellKey {
            engine: "walk-up".into(),
            robot: robot.into(),
            scenario: "walk-up".into(),
            seed: 905,
            requests: 2,
            fingerprint: 0,
        };
        let kicks: Vec<_> = run_cell(&subject, &scenario, &key).unwrap().outcomes.into_iter().flatten().collect();
        assert_eq!(kicks.len(), 2, "{robot} refused");
        for kick in &kicks {
            // Whether the audit believes its speed is another question: a finer step walks another way.
            assert!(
                kick.upright && kick.foot_speed.is_some_and(|speed| speed > 0.15) && kick.broken_off.is_none(),
                "{robot}: {kick:?}"
            );
        }
    }
}

/// What a cancel at `at` (s) leads to: the engine's end, how far the ball went (m), the robot's greatest tilt (rad).
fn cancelled(at: f64) -> (KickStatus, f64, f64) {
    let subject = Subject::load(&root("robots"), "nao").unwrap();
    let robot = Arc::clone(&subject.robot);
    let mut engine = subject.engine("walk-up").unwrap();
    let mut world = World::new(Arc::clone(&robot), &subject.world()).unwrap();
    let [x, y] = [subject.footprint[0] + 0.7, subject.footprint[1]];
    world.reset(&robot.stand, &vec![0.0; robot.nv()], &BallState::at_rest([x, y, subject.ball.radius])).unwrap();
    let mut suite = SensorSuite::new(&mut world, 41);
    suite.sense(&world);
    let (mut sensors, mut command) = (Sensors::default(), JointCommand::zeros(robot.joints.len()));
    suite.read_into(world.time(), &mut sensors);
    engine.plan(&KickRequest::new([0.7, 0.0], 0.0, 0.6), &sensors).unwrap();
    let period = world.settings().step.tick;
    let every = (engine.control_period() / period).round() as usize;
    let mut tilt = 0.0_f64;
    for step in 0..(14.0 / period) as usize {
        if step == (at / period) as usize {
            engine.cancel();
        }
        if step % every == 0 {
            suite.read_into(world.time(), &mut sensors);
            engine.tick(&sensors, &mut command);
        }
        world.advance(&command, None).unwrap();
        suite.sense(&world);
        let q = world.q();
        tilt = tilt.max((1.0 - 2.0 * (q[4] * q[4] + q[5] * q[5])).acos());
    }
    let ball = world.ball().position;
    (engine.progress().status, (ball[0] - x).hypot(ball[1] - y), tilt)
}

#[test]
fn a_walk_that_is_cancelled_ends_in_a_stand_without_a_kick() {
    // In the middle of a step; while the robot goes over into the engine's stand.
    for at in [3.0, 6.0] {
        let (status, way, tilt) = cancelled(at);
        assert_eq!(status, KickStatus::Cancelled, "{at}");
        assert!(way < 0.02 && tilt < 0.4, "{at}: {way} {tilt}");
    }
}

#[test]
fn what_it_cannot_is_refused_before_it_walks() {
    let subject = Subject::load(&root("robots"), "nao").unwrap();
    let mut engine = subject.engine("walk-up").unwrap();
    let joints = subject.robot.joints.len();
    let sensors = Sensors {
        joint_positions: subject.robot.stand[7..].to_vec(),
        joint_velocities: vec![0.0; joints],
        orientation: [1.0, 0.0, 0.0, 0.0],
        contact_forces: vec![6.0; subject.robot.contacts.len()],
        ..Sensors::default()
    };
    let far = engine.plan(&KickRequest::new([30.0, 0.0], 0.0, 0.6), &sensors);
    assert!(matches!(far, Err(Refusal::TooFar { .. })), "{far:?}");
    let rolling = KickRequest { ball_velocity: [0.5, 0.0], ..KickRequest::new([2.0, 0.0], 0.0, 0.6) };
    assert!(matches!(engine.plan(&rolling, &sensors), Err(Refusal::BallRolls { .. })));
    // Not "walk to it first": that is what it is for.
    let hard = engine.plan(&KickRequest::new([2.0, 0.0], 0.0, 9.0), &sensors);
    assert!(matches!(hard, Err(Refusal::TooFast { .. })), "{hard:?}");
    let nothing = engine.plan(&KickRequest::new([f64::NAN, 0.0], 0.0, 0.6), &sensors);
    assert!(nothing.is_err());
    engine.plan(&KickRequest::new([1.0, 0.0], 0.0, 0.6), &sensors).unwrap();
    assert_eq!(engine.plan(&KickRequest::new([1.0, 0.0], 0.0, 0.6), &sensors), Err(Refusal::Busy));
}

#[test]
fn settings_that_cannot_be_are_named() {
    let good = std::fs::read_to_string(root("robots/nao/walk-up.toml")).unwrap();
    for (from, to, field) in [
        ("\"dynamic\"", "\"walk-up\"", "engine"),
        ("\"dynamic\"", "\"policy\"", "engine"),
        ("speed = 0.8", "speed = -1.0", "speed"),
        ("[2.0, 0.1]", "[nan, 0.1]", "ball"),
    ] {
        let text = good.replace(from, to);
        assert_ne!(text, good);
        let subject = Subject::load(&root("robots"), "nao").unwrap().with_settings("walk-up", text).unwrap();
        let error = subject.engine("walk-up").err().unwrap();
        assert!(matches!(&error, BenchError::Field { field: named, .. } if named == field), "{error}");
    }
    let text = good.replace("speed", "sped");
    let subject = Subject::load(&root("robots"), "nao").unwrap().with_settings("walk-up", text).unwrap();
    assert!(matches!(subject.engine("walk-up").err(), Some(BenchError::File { .. })));
}
