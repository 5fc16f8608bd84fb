//! The planner against an enumeration of all ways, written on its own: no active region, no tangents, another test of sight.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

fn query<'a>(polygons: &'a [Polygon], start: [f64; 2], goal: [f64; 2], turn_cost: f64) -> Query<'a> {
    Query {
        start,
        start_heading: None,
        goal,
        goal_heading: None,
        polygons,
        half: [7.0, 4.5],
        turn_cost,
        inside_price: 8.0,
        keep: None,
    }
}

/// All simple ways over all corners, depth first; what is already dearer than the best is left.
struct Brute<'a> {
    query: Query<'a>,
    nodes: Vec<[f64; 2]>,
    seen: Vec<Vec<bool>>,
    best: f64,
}

/// Whether no inner point lies in a polygon: each side's line is asked on which side both ends are.
fn sees(polygons: &[Polygon], a: [f64; 2], b: [f64; 2]) -> bool {
    polygons.iter().all(|polygon| {
        // The part of the segment behind every side, by cutting it side after side.
        let (mut t0, mut t1) = (0.0_f64, 1.0_f64);
        for k in 0..SIDES {
            let (p, q) = (polygon.corner(k), polygon.corner(k + 1));
            let depth = |x: [f64; 2]| cross(sub(q, p), sub(x, p)) / sub(q, p)[0].hypot(sub(q, p)[1]) - 1e-6;
            let (da, db) = (depth(a), depth(b));
            if da <= 0.0 && db <= 0.0 {
                return true;
            }
            if da < 0.0 {
                t0 = t0.max(da / (da - db));
            } else if db < 0.0 {
                t1 = t1.min(da / (da - db));
            }
        }
        t0 >= t1
    })
}

impl Brute<'_> {
    fn best(query: Query) -> f64 {
        let mut nodes = vec![query.start, query.goal];
        for polygon in query.polygons {
            nodes.extend((0..SIDES).map(|k| polygon.corner(k)).filter(|at| {
                at[0].abs() <= query.half[0]
                    && at[1].abs() <= query.half[1]
                    && !query.polygons.iter().any(|other| other != polygon && other.contains(*at))
            }));
        }
        let seen = nodes.iter().map(|a| nodes.iter().map(|b| sees(query.polygons, *a, *b)).collect()).collect();
        let mut brute = Brute { query, nodes, seen, best: f64::INFINITY };
        brute.go(&mut vec![0], 0.0, query.start_heading.map(|h| [h.cos(), h.sin()]));
        brute.best
    }

    fn go(&mut self, way: &mut Vec<usize>, cost: f64, direction: Option<[f64; 2]>) {
        let at = way[way.len() - 1];
        let angle = |a: [f64; 2], b: [f64; 2]| {
            let cosine = (a[0] * b[0] + a[1] * b[1]) / (a[0].hypot(a[1]) * b[0].hypot(b[1]));
            cosine.clamp(-1.0, 1.0).acos()
        };
        if at == 1 {
            let last = match (self.query.goal_heading, direction) {
                (Some(h), Some(d)) => angle(d, [h.cos(), h.sin()]),
                _ => 0.0,
            };
            self.best = self.best.min(cost + self.query.turn_cost * last);
            return;
        }
        let mut next: Vec<usize> = (1..self.nodes.len()).filter(|k| !way.contains(k) && self.seen[at][*k]).collect();
        let rest = |k: &usize| sub(self.query.goal, self.nodes[*k])[0].hypot(sub(self.query.goal, self.nodes[*k])[1]);
        next.sort_by(|a, b| rest(a).total_cmp(&rest(b)));
        for k in next {
            let step = sub(self.nodes[k], self.nodes[at]);
            let turned = direction.map_or(0.0, |d| angle(d, step));
            let cost = cost + step[0].hypot(step[1]) + self.query.turn_cost * turned;
            let straight = sub(self.query.goal, self.nodes[k]);
            if cost + straight[0].hypot(straight[1]) < self.best {
                way.push(k);
                self.go(way, cost, Some(step));
                way.pop();
            }
        }
    }
}

fn world(rng: &mut ChaCha8Rng, count: usize) -> Vec<Polygon> {
    let mut even = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    (0..count).map(|_| Polygon { center: [even(-5.0, 5.0), even(-3.5, 3.5)], apothem: even(0.4, 1.2) }).collect()
}

#[test]
fn equal_to_the_enumeration_of_all_ways() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut planner = Planner::default();
    let mut bent = 0;
    for case in 0..240 {
        let polygons = world(&mut rng, 1 + case % 3);
        let mut question = query(&polygons, [-6.0, 0.3], [6.0, -0.2], [0.0, 0.5, 2.0][case / 3 % 3]);
        question.half = if case % 4 == 3 { [7.0, 2.5] } else { [7.0, 4.5] };
        if case % 2 == 1 {
            question.start_heading = Some(rng.random::<f64>() * 6.0 - 3.0);
            question.goal_heading = Some(rng.random::<f64>() * 6.0 - 3.0);
        }
        if polygons.iter().any(|p| p.contains(question.start) || p.contains(question.goal)) {
            continue;
        }
        let expected = Brute::best(question);
        let found = planner.plan(&question).map_or(f64::INFINITY, |route| route.cost);
        bent += usize::from(planner.path().len() > 2);
        assert!(
            (found.is_infinite() && expected.is_infinite()) || (found - expected).abs() < 1e-5,
            "case {case}: {found} {expected} {polygons:?}"
        );
    }
    assert!(bent > 60, "{bent}: too few cases have something in the way");
}

#[test]
fn no_segment_cuts_any_polygon_and_the_mirrored_world_has_the_mirrored_way() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let mut planner = Planner::default();
    for _ in 0..200 {
        let polygons = world(&mut rng, 12);
        let question = query(&polygons, [-6.5, 0.0], [6.5, 1.0], 0.5);
        let Some(route) = planner.plan(&question) else { continue };
        let held: Vec<bool> =
            polygons.iter().map(|p| p.contains(question.start) || p.contains(question.goal)).collect();
        if held.contains(&true) {
            continue;
        }
        for pair in planner.path().windows(2) {
            assert!(sees(&polygons, pair[0], pair[1]));
        }
        let mirrored: Vec<Polygon> =
            polygons.iter().map(|p| Polygon { center: [p.center[0], -p.center[1]], ..*p }).collect();
        let again = planner.plan(&query(&mirrored, [-6.5, 0.0], [6.5, -1.0], 0.5)).unwrap();
        assert!((again.cost - route.cost).abs() < 1e-9);
    }
}

/// A dearer turn never makes the way shorter nor lets it turn more; a far polygon changes nothing.
#[test]
fn turns_fall_and_lengths_rise_with_the_cost_of_turns() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut planner = Planner::default();
    for _ in 0..60 {
        let polygons: Vec<Polygon> =
            world(&mut rng, 8).into_iter().map(|p| Polygon { apothem: 0.7 * p.apothem, ..p }).collect();
        let measure = |planner: &mut Planner, cost: f64| {
            planner.plan(&query(&polygons, [-6.5, 0.0], [6.5, 0.0], cost)).map(|_| {
                let steps: Vec<_> = planner.path().windows(2).map(|p| sub(p[1], p[0])).collect();
                let length: f64 = steps.iter().map(|s| s[0].hypot(s[1])).sum();
                let turned: f64 = steps.windows(2).map(|s| turn(s[0], s[1]).abs()).sum();
                [length, turned]
            })
        };
        let all: Vec<_> = [0.0, 0.3, 1.0, 3.0].iter().filter_map(|c| measure(&mut planner, *c)).collect();
        for pair in all.windows(2) {
            assert!(pair[1][0] >= pair[0][0] - 1e-9 && pair[1][1] <= pair[0][1] + 1e-9, "{all:?}");
        }
    }
}

#[test]
fn from_inside_the_way_leaves_where_it_is_cheap() {
    let polygons = [Polygon { center: [0.0, 0.0], apothem: 0.75 }];
    let mut planner = Planner::default();
    let start = [-0.3, 0.1];
    let route = planner.plan(&query(&polygons, start, [4.0, 0.0], 0.5)).unwrap();
    assert!(route.cost < 12.0);
    let inside: f64 = planner
        .path()
        .windows(2)
        .map(|p| polygons[0].share_inside(p[0], p[1]) * sub(p[1], p[0])[0].hypot(sub(p[1], p[0])[1]))
        .sum();
    assert!(inside < 0.75, "{inside} m inside; straight on would be 1.05");
    assert!(planner.plan(&query(&polygons, [4.0, 0.0], start, 0.5)).is_some());
}

#[test]
fn an_enclosed_robot_has_no_way() {
    let ring: Vec<Polygon> = (0..8)
        .map(|k| {
            let (s, c) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
            Polygon { center: [1.5 * c, 1.5 * s], apothem: 0.7 }
        })
        .collect();
    assert_eq!(Planner::default().plan(&query(&ring, [0.0, 0.0], [4.0, 0.0], 0.5)), None);
    // A wall from border to border too.
    let wall: Vec<Polygon> = (-4..=4).map(|k| Polygon { center: [0.0, f64::from(k) * 1.1], apothem: 0.7 }).collect();
    assert_eq!(Planner::default().plan(&query(&wall, [-2.0, 0.0], [4.0, 0.0], 0.5)), None);
}

#[test]
fn a_side_that_is_kept_costs_more_but_is_kept() {
    let polygons = [Polygon { center: [0.0, 0.2], apothem: 1.0 }];
    let mut planner = Planner::default();
    let mut question = query(&polygons, [-4.0, 0.0], [4.0, 0.0], 0.5);
    let free = planner.plan(&question).unwrap();
    assert_eq!(free.first, Some((0, Bend::Left)), "passes below, so that the polygon lies to the left");
    question.keep = Some((0, Bend::Right));
    let kept = planner.plan(&question).unwrap();
    assert_eq!(kept.first, Some((0, Bend::Right)));
    assert!(kept.cost > free.cost && planner.path().iter().any(|p| p[1] > 1.0));
}
