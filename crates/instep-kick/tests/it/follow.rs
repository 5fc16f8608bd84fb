//! A ball that is moved while the foot goes to the wind-up point is struck where it lies then.

use instep_kick::KickEngine;
use instep_kick::dynamic::DynamicKick;
use instep_sim::BallState;

use crate::rig::{Rig, request, robot};

/// How fast (m/s) and where (rad) the ball goes that is put `by` (m) from its place 0.2 s after the start.
fn kicked(follows: bool, by: [f64; 2]) -> [f64; 2] {
    let request = request("wolfgang");
    let mut rig = Rig::new("wolfgang", request.ball);
    let mut settings = rig.engine.settings().clone();
    settings.feedback.follow_ball = follows;
    rig.engine = DynamicKick::new(robot("wolfgang"), *rig.engine.ball(), settings).unwrap();
    let plan = rig.engine.plan(&request, &rig.sensors).unwrap();
    let mut moved = false;
    while rig.world.time() < plan.contact + 0.2 {
        if !moved && rig.world.time() > 0.2 {
            let ball = rig.world.ball().position;
            rig.world.place_ball(&BallState::at_rest([ball[0] + by[0], ball[1] + by[1], ball[2]]));
            moved = true;
        }
        rig.tick();
    }
    let [x, y, _] = rig.world.ball().velocity;
    [x.hypot(y), y.atan2(x)]
}

#[test]
fn a_moved_ball_is_followed() {
    // Farther ahead the foot is slowing down already, and a stroke that is moved there is near the end of its reach.
    let ([follows, _], [stays, _]) = (kicked(true, [0.05, 0.0]), kicked(false, [0.05, 0.0]));
    assert!(follows > 1.1 * stays, "{follows} m/s, {stays} without following");
    // Aside the end of the toe would strike it askew.
    let ([_, follows], [_, stays]) = (kicked(true, [0.0, -0.045]), kicked(false, [0.0, -0.045]));
    assert!(follows.abs() < 0.5 * stays.abs(), "{follows} rad off, {stays} without following");
}
