//! What a robot allows: an upper bound of what its engine plans, nothing where no foot comes, twice as much with joints twice as fast.

use std::sync::Arc;

use instep_kick::bound::{Bound, Bounds};
use instep_kick::{KickEngine, KickRequest};
use instep_motion::phase::Side;
use instep_robot::Robot;

use crate::rig::{engine, request, robot, standing};

fn of(robot: Arc<Robot>, name: &str, request: &KickRequest, enough: f64) -> Option<Bound> {
    let engine = engine(name);
    Bounds::new(robot, *engine.ball(), engine.settings().clone()).unwrap().of(request, enough)
}

#[test]
fn no_plan_is_faster_and_the_ball_gets_what_the_foot_and_its_mass_give() {
    for name in ["nao", "wolfgang"] {
        let asked = request(name);
        let bound = of(robot(name), name, &asked, f64::INFINITY).unwrap();
        let given = bound.foot_speed * engine(name).ball().gain(bound.mass);
        assert!((bound.ball_speed - given).abs() < 1e-9 && given > 1.0, "{name}: {bound:?}");
        for speed in [0.7, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0] {
            let asked = KickRequest::new(asked.ball, asked.direction, speed);
            if let Ok(plan) = engine(name).plan(&asked, &standing(&robot(name))) {
                assert!(plan.ball_speed <= bound.ball_speed, "{name}: {} of {speed}, {bound:?}", plan.ball_speed);
            }
        }
    }
}

#[test]
fn joints_twice_as_fast_allow_twice_the_speed() {
    let mut fast = Robot::load(robot("nao").folder()).unwrap();
    fast.joints.iter_mut().for_each(|joint| joint.speed *= 2.0);
    let asked = request("nao");
    let [one, two] =
        [robot("nao"), Arc::new(fast)].map(|robot| of(robot, "nao", &asked, f64::INFINITY).unwrap().foot_speed);
    assert!((two - 2.0 * one).abs() < 1e-6 * two, "{one} {two}");
}

#[test]
fn out_of_reach_nothing_is_allowed_and_a_foot_that_is_asked_for_is_taken() {
    let asked = request("nao");
    assert_eq!(of(robot("nao"), "nao", &KickRequest { ball: [0.8, 0.0], ..asked }, f64::INFINITY), None);
    for (foot, y) in [(Side::Left, 0.05), (Side::Right, -0.05)] {
        let before = |foot| KickRequest { ball: [0.17, y], foot, ..asked };
        assert_eq!(of(robot("nao"), "nao", &before(Some(foot)), f64::INFINITY).unwrap().foot, foot);
        let other = of(robot("nao"), "nao", &before(Some(foot.other())), f64::INFINITY);
        assert!(other.is_none_or(|bound| bound.foot == foot.other()), "{other:?}");
    }
    let full = of(robot("nao"), "nao", &asked, f64::INFINITY).unwrap().ball_speed;
    let enough = of(robot("nao"), "nao", &asked, 0.3).unwrap().ball_speed;
    assert!((0.3..=full).contains(&enough), "{enough} {full}");
}

/// A ball that rolls in comes within reach by itself; one that rolls off does not.
#[test]
fn a_rolling_ball_is_met_where_it_comes_by() {
    let asked = request("nao");
    let rolls = |x: f64, speed: f64| KickRequest { ball: [x, -0.05], ball_velocity: [speed, 0.0], ..asked };
    assert!(of(robot("nao"), "nao", &rolls(0.9, -0.8), 0.1).is_some());
    assert_eq!(of(robot("nao"), "nao", &rolls(0.9, 0.8), 0.1), None);
}
