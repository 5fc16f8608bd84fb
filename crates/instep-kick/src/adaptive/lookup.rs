//! From a ball and a direction to a stroke by the grid alone: foot target, retraction point, way between; well under a
//! millisecond for all parts of both feet, a few microseconds for one part in a tick.

use instep_motion::phase::Side;
use nalgebra::{Vector2, Vector3};

use crate::adaptive::geometry::{PARTS, Part, measured, possible, sphere, target, throw};
use crate::adaptive::grid::{CELL, Grid};
use crate::adaptive::motion::{CORNERS, Stroke};
use crate::adaptive::retraction::{Wanted, forecast};
use crate::adaptive::settings::AdaptiveSettings;
use crate::engine::Face;
use crate::whole_body::body::Body;
use crate::whole_body::foot::wrap;

/// Rounds in which target and retraction settle on each other.
const ROUNDS: usize = 2;

/// Shares of the way after the contact that are tried.
const FOLLOW: [f64; 3] = [1.0, 0.6, 0.3];
/// Distance of the foot from its own place up to which a stroke costs nothing, m.
const EASY: f64 = 0.1;

/// What a stroke is wanted for, in the support sole's frame of `swing`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Query {
    pub(crate) swing: Side,
    /// The ball at the contact, m.
    pub(crate) ball: Vector2<f64>,
    /// Direction of the push that the ball needs, rad.
    pub(crate) direction: f64,
    /// Foot speed, m/s.
    pub(crate) speed: f64,
    /// Way after the contact, m.
    pub(crate) follow: f64,
    /// Largest distance of the retraction point, m.
    pub(crate) retraction: f64,
}

/// A stroke and what it costs: lower is better.
pub(crate) type Found = (Stroke, f64);

/// The stroke with one part of the foot; `corners`: a way that is not straight may be looked for, which allocates.
pub(crate) fn look_up(
    body: &Body,
    settings: &AdaptiveSettings,
    grid: &Grid,
    query: &Query,
    part: &Part,
    corners: bool,
) -> Option<Found> {
    let (k, radius) = (&settings.kick, body.ball.radius);
    if !possible(query.direction) {
        return None;
    }
    let foot = &body.feet[query.swing as usize];
    let wanted_way = Vector3::new(query.direction.cos(), query.direction.sin(), 0.0);
    let mirror = |p: &Vector3<f64>| measured(query.swing, p);
    let mut normal = query.direction;
    let mut found = None;
    for _ in 0..if k.true_shape { ROUNDS } else { 1 } {
        let (yaw, point) = if k.true_shape { part.meet(foot, normal, k.yaw)? } else { (0.0, sphere(foot)) };
        let contact = target(query.ball, normal, (yaw, &point), radius, [k.height, k.sole_least]);
        if !grid.contains(&mirror(&contact)) {
            return None;
        }
        let range = [k.retraction[0], query.retraction];
        let wanted = Wanted { target: contact, direction: wanted_way, delta: k.delta, range, floor: k.sole_least };
        let best = wanted.search(grid, mirror)?;
        // The cell's centre is up to half a cell off the wanted line: drawn onto it where that is in reach.
        let on_line = contact - wanted_way * (contact - best.point).dot(&wanted_way).max(k.retraction[0]);
        let near = (on_line - best.point).norm() < CELL && grid.clear(&mirror(&on_line), &mirror(&contact));
        let retraction = if near { on_line } else { best.point };
        let way = contact - retraction;
        let off = wrap(way.y.atan2(way.x) - normal);
        let stroke = Stroke {
            swing: query.swing,
            face: if k.true_shape { part.face } else { Face::Front },
            part: *part,
            yaw,
            retraction,
            corners: [None; CORNERS],
            contact,
            follow: query.follow,
            speed: query.speed,
            forecast: forecast(&retraction, &contact, &wanted_way),
            ball: query.ball,
            normal,
            pace: 1.0,
            at: 0.0,
        };
        found = Some(stroke);
        normal = query.direction - throw(off, body.ball.restitution, k.friction);
    }
    let mut stroke = found?;
    let (from, to) = (mirror(&stroke.retraction), mirror(&stroke.contact));
    if !grid.clear(&from, &to) {
        let way = if corners { grid.way(&from, &to)? } else { return None };
        if way.len() > CORNERS + 2 {
            return None;
        }
        for (corner, point) in stroke.corners.iter_mut().zip(&way[1..way.len() - 1]) {
            *corner = Some(mirror(point));
        }
        stroke.forecast = stroke.direction().dot(&wanted_way);
    }
    let face = match stroke.face {
        Face::Front => 0.0,
        Face::Inner | Face::Outer | Face::Back => 0.1,
        Face::Corner => 0.35,
    };
    let short = 1.0 - stroke.run() / k.retraction[1];
    // The foot comes to rest where it was measured to hold.
    let rests = |stroke: &mut Stroke, share: f64| {
        stroke.follow = share * query.follow;
        grid.clear(&to, &mirror(&stroke.rest()))
    };
    if !FOLLOW.iter().any(|share| rests(&mut stroke, *share)) {
        return None;
    }
    // The farther the leg is out, the deeper the robot squats.
    let home = body.stand(query.swing).home;
    let out = ((stroke.retraction - home).norm().max((stroke.contact - home).norm()) - EASY).max(0.0);
    let cost = 4.0 * (1.0 - stroke.forecast)
        + 8.0 * out
        + face
        + 0.3 * stroke.yaw.abs() / k.yaw.max(0.1)
        + 0.05 * part.slide.abs()
        + 0.2 * short;
    Some((stroke, cost))
}

/// The best strokes with any part, best first.
pub(crate) fn look_up_all(
    body: &Body,
    settings: &AdaptiveSettings,
    grid: &Grid,
    query: &Query,
    found: &mut Vec<Found>,
) {
    let parts = if settings.kick.true_shape { PARTS } else { 1 };
    let [least, most] = settings.kick.retraction;
    for part in (0..parts).map(Part::of) {
        let mut last = f64::INFINITY;
        // A point that is less far back is easier on the joints.
        for share in [1.0, 0.5, 0.0] {
            let query = Query { retraction: least + CELL + share * (most - least - CELL).max(0.0), ..*query };
            // The best of all points that is among the nearer ones is the best of these.
            if last <= query.retraction {
                continue;
            }
            if let Some(next) = look_up(body, settings, grid, &query, &part, true) {
                last = next.0.run();
                found.push(next);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adaptive::{load_grid, parts};
    use crate::ball::BallModel;
    use crate::settings::Settings;

    #[test]
    fn the_foot_goes_no_farther_back_than_it_may() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/nao");
        let robot = std::sync::Arc::new(instep_robot::Robot::load(&folder).unwrap());
        let settings = AdaptiveSettings::load(&folder).unwrap();
        let (body, _) = parts(robot, BallModel::load(&folder).unwrap(), &settings).unwrap();
        let grid = load_grid(&folder).unwrap();
        let swing = Side::Right;
        let runs: Vec<f64> = [0.03, 0.05, 0.08]
            .iter()
            .map(|&retraction| {
                let ball = body.support_from_footprint(swing, [0.16, -0.05]).into();
                let query = Query { swing, ball, direction: 0.0, speed: 1.0, follow: 0.04, retraction };
                let (stroke, _) = look_up(&body, &settings, &grid, &query, &Part::of(0), false).unwrap();
                assert!(stroke.run() <= retraction, "{} m of {retraction}", stroke.run());
                stroke.run()
            })
            .collect();
        assert!(runs[0] < runs[1] && runs[1] < runs[2], "{runs:?}");
    }
}
