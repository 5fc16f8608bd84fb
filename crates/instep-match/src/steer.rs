//! From a wanted pose to a walking velocity, cheap enough for thousands of games: straight to the pose, round the first
//! robot in the way on the shorter side, turned to where one goes while far, and to the wanted heading when near.
//!
//! A seam: what walks in a match is asked nothing but this velocity, so that the planner of `instep-navigation` can
//! stand in its place.

use instep_behaviour::{Circle, Motion, Point};
use instep_field::{Pose, wrap};

use crate::settings::BodySettings;

/// Obstacles farther than this are not yet in the way, m.
const LOOK_AHEAD: f64 = 2.0;
/// Room beside an obstacle, m.
const CLEARANCE: f64 = 0.1;
/// Round the ball at this distance, m.
const BALL_ROOM: f64 = 0.42;
/// Nearer than this a robot turns to its final heading while it walks, m.
const NEAR: f64 = 0.9;

/// A walking velocity in the robot frame, m/s, m/s, rad/s, for a motion that is wanted at the believed pose `own`.
pub(crate) fn steer(
    own: &Pose,
    motion: &Motion,
    ball: Option<Point>,
    obstacles: &[Circle],
    body: &BodySettings,
) -> [f64; 3] {
    let (goal, avoid_ball) = match *motion {
        Motion::Stand | Motion::GetUp => return [0.0; 3],
        Motion::Velocity(velocity) => return velocity,
        Motion::Walk { pose, avoid_ball } => (pose, avoid_ball),
    };
    let here = own.position();
    let to_goal = sub(goal.position(), here);
    let far = norm(to_goal);
    let mut waypoint = goal.position();
    let mut nearest = f64::INFINITY;
    let round = ball.filter(|_| avoid_ball).map(|center| (Circle { center, radius: BALL_ROOM - CLEARANCE }, true));
    for (circle, is_ball) in obstacles.iter().map(|c| (*c, false)).chain(round) {
        let room = circle.radius + CLEARANCE + if is_ball { 0.0 } else { body.radius };
        let off = sub(circle.center, here);
        let d = norm(off);
        if d > LOOK_AHEAD || d >= nearest || far < 1e-6 {
            continue;
        }
        let ahead = (off[0] * to_goal[0] + off[1] * to_goal[1]) / far;
        let beside = (to_goal[0] * off[1] - to_goal[1] * off[0]) / far;
        // The goal lies before the obstacle, or the way passes beside it.
        if ahead < 0.0 || ahead > far + if is_ball { 0.0 } else { 0.2 } || beside.abs() >= room {
            continue;
        }
        // The obstacle lies to the left: pass on its right.
        let side = if beside > 0.0 { -1.0 } else { 1.0 };
        nearest = d;
        waypoint = if d > room {
            // Along the tangent, to as far as the tangent point.
            let turn = side * (room / d).asin();
            let along = (d * d - room * room).sqrt().max(0.3);
            let (s, c) = (off[1].atan2(off[0]) + turn).sin_cos();
            [here[0] + along * c, here[1] + along * s]
        } else {
            // Too close: along the circle and outward.
            let normal = [-off[0] / d.max(1e-6), -off[1] / d.max(1e-6)];
            let tangent = [-side * normal[1], side * normal[0]];
            let tangent =
                if tangent[0] * to_goal[0] + tangent[1] * to_goal[1] >= 0.0 { tangent } else { tangent.map(|t| -t) };
            let out = (room - d) / room + 0.1;
            [here[0] + 0.5 * (tangent[0] + out * normal[0]), here[1] + 0.5 * (tangent[1] + out * normal[1])]
        };
    }
    let way = sub(waypoint, here);
    let d = norm(way);
    // So that it can stop: braking distance within what is left, the detour's end not counted as one.
    let left = if nearest.is_finite() { far.max(d) } else { d };
    let speed = (2.0 * 0.7 * body.acceleration * left).sqrt().min(3.0 * left).min(2.0 * body.forward);
    let (s, c) = own.heading.sin_cos();
    let ahead = if d > 1e-6 { (c * way[0] + s * way[1]) / d } else { 0.0 };
    let aside = if d > 1e-6 { (-s * way[0] + c * way[1]) / d } else { 0.0 };
    let heading = if far > NEAR { way[1].atan2(way[0]) } else { goal.heading };
    let off = wrap(heading - own.heading);
    // Slower while it looks elsewhere, so that it turns first and walks then.
    let calm = if far > NEAR { (1.0 - off.abs() / 1.5).max(0.25) } else { 1.0 };
    [speed * calm * ahead, speed * calm * aside, (2.5 * off).clamp(-body.turn, body.turn)]
}

fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn norm(a: Point) -> f64 {
    a[0].hypot(a[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(start: Pose, goal: Pose, ball: Option<Point>, obstacles: &[Circle], seconds: usize) -> (Pose, f64) {
        let body = BodySettings::default();
        let mut pose = start;
        let mut least = f64::INFINITY;
        for _ in 0..seconds * 10 {
            let motion = Motion::Walk { pose: goal, avoid_ball: true };
            let v = steer(&pose, &motion, ball, obstacles, &body);
            let forward = v[0].clamp(-0.6, 0.6);
            let side = v[1].clamp(-0.3, 0.3);
            pose = pose.then(&Pose::new(forward * 0.1, side * 0.1, v[2] * 0.1));
            for o in obstacles {
                least = least.min(norm(sub(pose.position(), o.center)) - o.radius);
            }
        }
        (pose, least)
    }

    #[test]
    fn it_arrives_and_stands_as_asked() {
        let goal = Pose::new(3.0, 1.0, -2.0);
        let (end, _) = run(Pose::new(0.0, 0.0, 3.0), goal, None, &[], 30);
        assert!(end.distance(&goal) < 0.05 && wrap(end.heading - goal.heading).abs() < 0.05, "{end:?}");
    }

    #[test]
    fn it_walks_round_a_robot_and_round_the_ball() {
        let goal = Pose::new(3.0, 0.0, 0.0);
        let robot = Circle { center: [1.5, 0.02], radius: 0.25 };
        let (end, least) = run(Pose::new(0.0, 0.0, 0.0), goal, None, &[robot], 30);
        assert!(end.distance(&goal) < 0.1, "{end:?}");
        assert!(least > 0.25, "{least}");
        // From before the ball to behind it.
        let goal = Pose::new(-0.32, 0.0, 0.0);
        let (end, _) = run(Pose::new(0.5, 0.05, 3.1), goal, Some([0.0, 0.0]), &[], 30);
        assert!(end.distance(&goal) < 0.1, "{end:?}");
    }
}
