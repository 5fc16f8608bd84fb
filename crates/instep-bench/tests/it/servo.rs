//! Kicks on real servos: positions only, late, with play, and senses as they are. Nothing here is ideal.

use instep_bench::Scenario;
use instep_bench::Subject;
use instep_bench::cell::{CellKey, run_cell};

use crate::root;

/// The first straight kicks of a robot by an engine, in its default world.
fn straight(engine: &str, robot: &str, requests: usize) -> usize {
    let scenario = Scenario::load(&root("scenarios/straight.toml")).unwrap();
    let subject = Subject::load(&root("robots"), robot).unwrap();
    let key = CellKey {
        engine: engine.into(),
        robot: robot.into(),
        scenario: "straight".into(),
        seed: 901,
        requests,
        fingerprint: 0,
    };
    let kicks: Vec<_> = run_cell(&subject, &scenario, &key).unwrap().outcomes.into_iter().flatten().collect();
    for kick in &kicks {
        assert!(kick.upright, "{engine} on {robot} fell: {kick:?}");
        assert_eq!(kick.grounded, 0, "{engine} on {robot}: the kicking foot touched the ground: {kick:?}");
    }
    kicks.len()
}

#[test]
fn small_robots_kick_and_stand_on_position_servos() {
    for (engine, robot) in [("dynamic", "nao"), ("adaptive", "nao"), ("dynamic", "wolfgang")] {
        assert_eq!(straight(engine, robot, 2), 2, "{engine} on {robot} refused");
    }
}
