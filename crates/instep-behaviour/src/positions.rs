//! Where players stand that do not have the ball.

use instep_field::Pose;

use crate::belief::{Beliefs, Kicking};
use crate::geometry::{Point, along, bearing, distance, norm, sub};
use crate::roles::Role;
use crate::situation::Pitch;

/// A keeper goes to where a ball that is faster than this will cross, m/s.
const COMES: f64 = 0.5;

/// Where a player of `role` stands in open play, looking at the ball; `nth` of several with the same role.
pub(crate) fn place(pitch: &Pitch, beliefs: &Beliefs, role: Role, nth: usize) -> Pose {
    let field = pitch.field;
    let settings = &pitch.strategy.positions;
    let ball = beliefs.ball.position;
    let own_goal = field.own_goal().center;
    let point = match role {
        Role::Keeper => keeper(pitch, beliefs),
        Role::Striker => ball,
        Role::Defender => {
            let way = sub(ball, own_goal);
            let share = settings.defender_share * (1.0 - 0.3 * nth as f64).max(0.2);
            // Never into the own goal area, where the keeper stands.
            let share = share.max((field.goal_area.length + 0.5) / norm(way).max(0.1)).min(0.9);
            along(own_goal, way, share)
        }
        Role::Supporter => {
            // On the side with more room, further ahead for each further one.
            let side = if ball[1] > 0.0 { -1.0 } else { 1.0 } * if nth.is_multiple_of(2) { 1.0 } else { -1.0 };
            let ahead = settings.support_ahead * (1.0 - 0.5 * nth as f64);
            [ball[0] + ahead, ball[1] + side * settings.support_beside]
        }
    };
    let (x, y) = (field.length / 2.0 - 0.6, field.width / 2.0 - 0.4);
    let point = [point[0].clamp(-x - 0.3, x), point[1].clamp(-y, y)];
    Pose::new(point[0], point[1], bearing(point, ball))
}

fn keeper(pitch: &Pitch, beliefs: &Beliefs) -> Point {
    let goal = pitch.field.own_goal();
    let out = pitch.strategy.positions.keeper_out;
    let (ball, velocity) = (beliefs.ball.position, beliefs.ball.velocity);
    let line = goal.center[0] + out;
    let half = pitch.field.goal.width / 2.0;
    if velocity[0] < -COMES && ball[0] > line {
        let y = ball[1] + velocity[1] * (line - ball[0]) / velocity[0];
        if y.abs() < half + 0.5 {
            return [line, y.clamp(-half, half)];
        }
    }
    let way = sub(ball, goal.center);
    let length = norm(way).max(out);
    let point = along(goal.center, way, out / length);
    [point[0].max(goal.center[0] + 0.2), point[1]]
}

/// Where a player stands at a kick-off, in its own half; outside the circle where the other team kicks off.
pub(crate) fn kick_off(pitch: &Pitch, beliefs: &Beliefs) -> Pose {
    let field = pitch.field;
    let ours = beliefs.game.kicking == Kicking::Us;
    let radius = field.circle_radius + pitch.strategy.positions.restart_margin;
    let keeper = pitch.strategy.roles.keeper;
    if keeper && beliefs.number == 1 {
        return Pose::new(field.own_goal().center[0] + pitch.strategy.positions.keeper_out, 0.0, 0.0);
    }
    // Field players by number: the first at the ball, the others beside and behind it.
    let index = usize::from(beliefs.number) - usize::from(keeper) - 1;
    let point = match index {
        0 if ours => [-0.6, 0.0],
        0 => [-radius - 0.1, 0.0],
        n => {
            let side = if n.is_multiple_of(2) { -1.0 } else { 1.0 };
            let row = (n - 1) / 2;
            let beside = (0.25 * field.width + 0.6 * row as f64).min(field.width / 2.0 - 0.6);
            let back = if ours && row == 0 { 0.8 } else { radius + 0.6 + row as f64 };
            [-back, side * beside.max(if ours { 0.0 } else { 0.5 * radius })]
        }
    };
    Pose::new(point[0], point[1], bearing(point, [0.0, 0.0]))
}

/// Away from a ball that the other team is to kick, between it and the own goal where that is allowed.
pub(crate) fn at_their_restart(pitch: &Pitch, beliefs: &Beliefs, wish: Pose) -> Pose {
    let ball = beliefs.ball.position;
    let radius = pitch.field.circle_radius + pitch.strategy.positions.restart_margin;
    let mut point = wish.position();
    let d = distance(point, ball);
    if d < radius {
        let away = if d > 0.05 { sub(point, ball) } else { sub(pitch.field.own_goal().center, ball) };
        point = along(ball, away, radius / norm(away).max(1e-6));
    }
    Pose::new(point[0], point[1], bearing(point, ball))
}
