//! A ball that is moved aside during the wind-up is followed by the foot, with ideal drives and senses.

use instep_bench::cell::{run_case, world};
use instep_bench::{Scenario, Subject};

use crate::root;

/// Where the kicking foot is when it meets the ball, m to the left, after the ball was moved by so much.
fn foot_at_contact(engine: &str, moved: f64) -> f64 {
    let subject = Subject::load(&root("robots"), "nao").unwrap();
    let ideal = subject.default_world().ideal();
    let subject = subject.in_world(ideal);
    let scenario = Scenario::load(&root("scenarios").join("straight.toml")).unwrap();
    let mut case = scenario.cases(&subject.size, 1, 1)[0];
    case.request.direction = 0.0;
    case.ball_moved = Some((0.7, [0.0, moved]));
    let mut world = world(&subject, &scenario, &case).unwrap();
    let (_, _, ran) = run_case(&subject, engine, &case, &mut world, &mut Vec::new()).unwrap();
    let ran = ran.unwrap();
    let contact = ran.trial.impact.unwrap().time;
    let record = &ran.trial.record;
    let sample = record.times.iter().position(|time| *time >= contact).unwrap();
    let mut data = subject.robot.data();
    data.set_position(record.row(&record.q, sample));
    data.link_position(subject.robot.leg(ran.plan.foot).foot).y
}

#[test]
fn the_foot_goes_where_the_ball_has_gone() {
    for engine in ["dynamic", "adaptive"] {
        let [left, right] = [0.015, -0.015].map(|moved| foot_at_contact(engine, moved));
        let followed = (left - right) / 0.03;
        assert!((0.5..1.5).contains(&followed), "{engine}: the foot went {:.0} % of the ball's way", 100.0 * followed);
    }
}
