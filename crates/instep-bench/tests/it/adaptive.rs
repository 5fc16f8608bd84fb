//! Paper 3's engine on NAO: few kicks of each of its scenarios, within the bounds that the whole ones must keep. What is tested
//! is the engine's mathematics, so drives and senses are ideal ones.

use std::sync::Arc;

use instep_bench::cell::{CellKey, Kicked, run_case, run_cell, world};
use instep_bench::directions::directions;
use instep_bench::{Scenario, Subject};
use instep_kick::Settings;
use instep_kick::adaptive::{AdaptiveKick, AdaptiveSettings, grid_hash, load_grid};
use instep_kick::{KickEngine, KickError, KickRequest, Refusal};
use instep_robot::Robot;

use crate::root;

fn nao() -> Subject {
    let subject = Subject::load(&root("robots"), "nao").unwrap();
    let world = subject.default_world().ideal();
    subject.in_world(world)
}

fn scenario(name: &str) -> Scenario {
    Scenario::load(&root("scenarios").join(format!("{name}.toml"))).unwrap()
}

/// The kicks of the first `requests` of a scenario; a refusal is a fault unless it is asked for.
fn kicks(engine: &str, name: &str, requests: usize) -> (Vec<Kicked>, usize) {
    let key = CellKey {
        engine: engine.into(),
        robot: "nao".into(),
        scenario: name.into(),
        seed: 1,
        requests,
        fingerprint: 0,
    };
    let outcomes = run_cell(&nao(), &scenario(name), &key).unwrap().outcomes;
    let refused = outcomes.iter().filter(|outcome| outcome.is_err()).count();
    (outcomes.into_iter().flatten().collect(), refused)
}

fn all_well(kicks: &[Kicked], name: &str) {
    for kick in kicks {
        assert!(kick.upright, "{name}: fell: {kick:?}");
        assert_eq!(kick.grounded, 0, "{name}: the kicking foot touched the ground: {kick:?}");
        assert_eq!((kick.violations, kick.audit_invalid), (0, false), "{name}: {kick:?}");
    }
}

#[test]
fn the_ball_goes_where_it_is_asked_to() {
    let (kicks, refused) = kicks("adaptive", "sweep", 10);
    assert_eq!(refused, 0);
    all_well(&kicks, "sweep");
    for kick in &kicks {
        let off = kick.turn_error.expect("a hit").to_degrees();
        assert!(off.abs() < 5.0, "{:.0} deg: {off:.1} deg off", kick.turn.to_degrees());
    }
}

#[test]
fn the_place_of_the_ball_does_not_matter() {
    let (kicks, refused) = kicks("adaptive", "random-100", 6);
    assert_eq!(refused, 0);
    all_well(&kicks, "random-100");
    assert!(kicks.iter().all(|kick| kick.hit && kick.turn_error.unwrap().to_degrees().abs() < 5.0));
}

#[test]
fn a_ball_that_is_moved_is_followed() {
    // One of them may depend on the time step so much that the audit does not believe it.
    let (kicks, _) = kicks("adaptive", "ball-moved-far", 6);
    assert!(kicks.iter().all(|kick| kick.upright && kick.grounded == 0 && kick.violations == 0), "{kicks:?}");
    let straight = |kick: &&Kicked| kick.hit && kick.turn_error.unwrap().to_degrees().abs() < 6.0;
    assert!(kicks.iter().filter(straight).count() >= 5, "{kicks:?}");
}

#[test]
fn a_ball_that_rolls_in_is_hit_or_let_go() {
    let (kicks, _) = kicks("adaptive", "rolling-in", 4);
    all_well(&kicks, "rolling-in");
    assert!(kicks.iter().all(|kick| kick.upright && (kick.hit || kick.broken_off.is_some())), "{kicks:?}");
    assert!(kicks.iter().filter(|kick| kick.hit).count() >= 3, "{kicks:?}");
}

#[test]
fn the_same_request_gives_the_same_kick() {
    let subject = nao();
    let scenario = scenario("sweep");
    let case = scenario.cases(&subject.size, 3, 3)[2];
    let run = || {
        let mut world = world(&subject, &scenario, &case).unwrap();
        run_case(&subject, "adaptive", &case, &mut world, &mut Vec::new()).unwrap().0
    };
    assert_eq!(run(), run());
}

#[test]
fn a_request_outside_the_grid_is_refused_and_can_be_kicked_from_elsewhere() {
    let subject = nao();
    let mut engine = subject.engine("adaptive").unwrap();
    let sensors = instep_robot::control::Sensors {
        joint_positions: subject.robot.stand[7..].to_vec(),
        ..instep_robot::control::Sensors::default()
    };
    let asked = KickRequest::new([0.32, -0.06], 0.1, 0.5);
    let refusal = engine.plan(&asked, &sensors).unwrap_err();
    assert!(matches!(refusal, Refusal::OutsideGrid { .. }), "{refusal:?}");
    let stand = engine.where_to_stand(&asked).unwrap();
    assert!(stand.position[0].hypot(stand.position[1]) < 0.25, "{stand:?}");
    engine.plan(&stand.seen_from(&asked), &sensors).unwrap();
}

#[test]
fn the_outlook_is_what_the_plan_finds() {
    let subject = nao();
    let mut engine = AdaptiveKick::load(Arc::clone(&subject.robot)).unwrap();
    let sensors = instep_robot::control::Sensors {
        joint_positions: subject.robot.stand[7..].to_vec(),
        ..instep_robot::control::Sensors::default()
    };
    let asked = KickRequest::new([0.16, -0.06], 0.1, 0.5);
    let outlook = engine.outlook(&asked).unwrap().unwrap();
    let plan = engine.plan(&asked, &sensors).unwrap();
    assert_eq!((outlook.foot, outlook.face, outlook.precision), (plan.foot, plan.face, plan.precision));
    assert_eq!(engine.outlook(&KickRequest::new([0.5, 0.0], 0.0, 0.5)), Ok(None));
    assert!(engine.outlook(&KickRequest::new([f64::NAN, 0.0], 0.0, 0.5)).is_err());
}

#[test]
fn a_grid_of_another_robot_or_an_older_model_is_refused() {
    let folder = root("robots").join("nao");
    let robot = Arc::new(Robot::load(&folder).unwrap());
    let settings = AdaptiveSettings::load(&folder).unwrap();
    let grid = Arc::new(load_grid(&folder).unwrap());
    assert_eq!(grid.hash(), grid_hash(&robot, &settings), "the shipped grid is stale: instep robot reach nao");
    let ball = nao().ball;
    AdaptiveKick::new(Arc::clone(&robot), ball, settings.clone(), Arc::clone(&grid)).unwrap();
    let mut older = settings.clone();
    older.stance.crouch += 0.01;
    let error = AdaptiveKick::new(Arc::clone(&robot), ball, older, Arc::clone(&grid)).unwrap_err();
    assert!(matches!(error, KickError::OtherGrid { .. }) && error.to_string().contains("instep robot reach nao"));
    let mut other = Robot::load(&folder).unwrap();
    other.joints[0].torque *= 1.01;
    assert!(AdaptiveKick::new(Arc::new(other), ball, settings, grid).is_err());
}

#[test]
fn the_report_shows_each_direction_and_the_rank_correlation() {
    let key = CellKey {
        engine: "adaptive".into(),
        robot: "nao".into(),
        scenario: "sweep".into(),
        seed: 1,
        requests: 4,
        fingerprint: 0,
    };
    let cell = run_cell(&nao(), &scenario("sweep"), &key).unwrap();
    let sweeps = directions(&[cell]);
    assert_eq!(sweeps[0].directions.iter().map(|d| d.asked_deg).collect::<Vec<_>>(), [0.0, 10.0, 20.0, 30.0]);
    let page = instep_bench::page::page(&[], &sweeps, &[], vec![]);
    page.check().unwrap();
    assert!(page.html().contains("rank correlation"));
}
