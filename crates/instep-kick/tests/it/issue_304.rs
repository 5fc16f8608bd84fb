//! bitbots_main#304: for a ball at (0.198, -0.148) m and a direction of -0.70 rad, paper 2's rule (equation 1) chose the
//! left foot, which cannot reach the ball behind the right one. Here both feet are forecast, and the right one kicks.

use instep_kick::whole_body::foot::paper_choice;
use instep_kick::{KickEngine, KickRequest, Refusal, Strength};
use instep_motion::phase::Side;

use crate::rig::{Rig, engine, robot, standing};

fn request() -> KickRequest {
    KickRequest { strength: Strength::FootSpeed(1.0), ..KickRequest::new([0.198, -0.148], -0.70, 1.0) }
}

#[test]
fn issue_304_the_wrong_foot_was_chosen() {
    let request = request();
    // The story: the rule says left, and the left foot cannot.
    assert_eq!(paper_choice(request.ball, request.direction, 0.4), Side::Left);
    let left = KickRequest { foot: Some(Side::Left), ..request };
    let sensors = standing(&robot("wolfgang"));
    let refusal = engine("wolfgang").plan(&left, &sensors).unwrap_err();
    assert!(matches!(refusal, Refusal::SelfCollision { .. } | Refusal::Unreachable { .. }), "{refusal}");
    // What happens now.
    let mut rig = Rig::new("wolfgang", request.ball);
    let start = rig.world.ball().position;
    let plan = rig.engine.plan(&request, &rig.sensors).unwrap();
    assert_eq!(plan.foot, Side::Right);
    while rig.world.time() < plan.duration + 0.5 {
        rig.tick();
    }
    let end = rig.world.ball().position;
    let direction = (end[1] - start[1]).atan2(end[0] - start[0]);
    assert!((direction - request.direction).abs() < 0.15, "the ball went toward {direction} rad");
    assert!(rig.stands());
}

#[test]
fn where_both_feet_can_the_better_forecast_wins() {
    // A ball before the left foot, nearly straight: left has the shorter way, on both sides of the mirror.
    let sensors = standing(&robot("wolfgang"));
    for (y, foot) in [(0.08, Side::Left), (-0.08, Side::Right)] {
        let plan = engine("wolfgang").plan(&KickRequest::new([0.25, y], 0.0, 0.8), &sensors).unwrap();
        assert_eq!(plan.foot, foot);
    }
}
