//! From a stand two metres off to a kicked ball, on real servos and senses.

use instep_bench::Scenario;
use instep_bench::Subject;
use instep_bench::cell::{CellKey, run_cell};
use instep_kick::{KickRequest, Refusal};
use instep_robot::control::Sensors;

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
    let hard = engine.plan(&KickRequest::new([2.0, 0.0], 0.0, 9.0), &sensors);
    assert!(hard.is_err(), "{hard:?}");
    let nothing = engine.plan(&KickRequest::new([f64::NAN, 0.0], 0.0, 0.6), &sensors);
    assert!(nothing.is_err());
    engine.plan(&KickRequest::new([1.0, 0.0], 0.0, 0.6), &sensors).unwrap();
    assert_eq!(engine.plan(&KickRequest::new([1.0, 0.0], 0.0, 0.6), &sensors), Err(Refusal::Busy));
}
