//! Where to kick: candidate circles in the free room about the ball, and the open part of the goal
//! (paper 4, section IV-E, eqs 9-12).
//!
//! Rays leave the ball through the goal posts and the field's corners and tangentially to each opponent; the goal lines
//! and the touch lines (drawn in by a margin) close them. Every three that make a triangle give a candidate: its
//! incircle, by weighted centroid (9) and Heron's formula (10). Since all rays meet in the ball and borders are parallel
//! in pairs, a triangle has one or two rays, and nothing else need be tried; a test tries all triples of lines.
//!
//! Seven costs, each from 0 to 1 without unit, are weighted and summed (11). The paper then takes the *maximum* of what
//! (11) calls a cost (12), while its text "penalizes" with each of them and "favors" what makes them small. Shipped is
//! the minimum; with the maximum, every sentence of the paper about the costs would be wrong.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use instep_field::{Field, Pose, wrap};
use serde::Serialize;

use crate::geometry::{Circle, Point, along, bearing, cross, distance, dot, norm, sub, unit};
use crate::strategy::Weights;

/// Touch lines are drawn in by this, m: "borders offset from the sidelines".
const TOUCH_MARGIN: f64 = 0.4;
/// A circle of this radius costs half, m.
const HALF_RADIUS: f64 = 0.5;
/// A target at this distance from an opponent costs half, m.
const HALF_OPPONENT: f64 = 1.0;
/// Smallest circle worth a kick, m.
const LEAST_RADIUS: f64 = 0.1;
/// Nearest target worth a kick, m.
const LEAST_WAY: f64 = 0.5;
/// Opponents whose tangents make candidates: the nearest to the ball.
const MOST_TANGENTS: usize = 4;

/// What a target depends on, in the own team's field frame.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// The field.
    pub field: &'a Field,
    /// The ball, m.
    pub ball: Point,
    /// Oneself.
    pub own: Pose,
    /// Mates that can take the ball, m.
    pub mates: &'a [Point],
    /// Opponents.
    pub opponents: &'a [Circle],
    /// Standard deviation of the kick's direction, rad.
    pub spread: f64,
    /// How far the kick carries the ball, m.
    pub reach: f64,
}

/// A circle that the ball may be kicked into.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Candidate {
    /// Its middle, m.
    pub center: Point,
    /// Its radius, m.
    pub radius: f64,
}

/// The seven costs of eq. (11), before their weights; from 0 (good) to 1, without unit.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Costs {
    /// Small circle.
    pub area: f64,
    /// Turn from where the robot looks to the kick's direction, of half a turn.
    pub goal_angle: f64,
    /// Distance from the opponents' goal, of the field's length.
    pub goal_distance: f64,
    /// Distance from oneself, of the field's length.
    pub own_distance: f64,
    /// Distance of the nearest mate, of the field's length; 0 where there is no mate.
    pub team_distance: f64,
    /// Nearness of the nearest opponent.
    pub opponent_distance: f64,
    /// An opponent in or near the ball's way.
    pub block: f64,
}

impl Costs {
    /// J(c) of eq. (11).
    pub fn total(&self, w: &Weights) -> f64 {
        w.area * self.area
            + w.goal_angle * self.goal_angle
            + w.goal_distance * self.goal_distance
            + w.own_distance * self.own_distance
            + w.team_distance * self.team_distance
            + w.opponent_distance * self.opponent_distance
            + w.block * self.block
    }
}

/// What a kick is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TargetKind {
    /// Into the goal.
    Shot,
    /// Into free room, for a mate or for oneself.
    Pass,
}

/// A place to kick the ball to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Target {
    /// What for.
    pub kind: TargetKind,
    /// Its middle, m.
    pub point: Point,
    /// Its radius, m.
    pub radius: f64,
    /// From the ball, rad in the field frame.
    pub direction: f64,
    /// Half of the cone that still reaches the target, rad: the kick request's `precision`.
    pub tolerance: f64,
    /// J(c) of a pass; 1 - chance of a goal for a shot.
    pub cost: f64,
}

/// Incircle of a triangle by eqs (9) and (10); `None` where the corners lie on a line.
pub fn incircle(p1: Point, p2: Point, p3: Point) -> Option<Candidate> {
    let (a, b, c) = (distance(p2, p3), distance(p3, p1), distance(p1, p2));
    let around = a + b + c;
    let s = around / 2.0;
    let square = (s - a) * (s - b) * (s - c) / s;
    if !(square > 1e-9) {
        return None;
    }
    let center = [(a * p1[0] + b * p2[0] + c * p3[0]) / around, (a * p1[1] + b * p2[1] + c * p3[1]) / around];
    Some(Candidate { center, radius: square.sqrt() })
}

/// A border: `axis` 0 (x = at) or 1 (y = at).
#[derive(Debug, Clone, Copy)]
struct Border {
    axis: usize,
    at: f64,
}

impl Border {
    /// Where a ray from `from` meets it.
    fn hit(&self, from: Point, ray: Point) -> Option<Point> {
        let t = (self.at - from[self.axis]) / ray[self.axis];
        (t > 1e-6 && t < 1e4).then(|| along(from, ray, t))
    }
}

fn borders(field: &Field) -> [Border; 4] {
    let (x, y) = (field.length / 2.0, (field.width / 2.0 - TOUCH_MARGIN).max(0.1));
    [Border { axis: 0, at: x }, Border { axis: 0, at: -x }, Border { axis: 1, at: y }, Border { axis: 1, at: -y }]
}

/// Unit directions of all rays from the ball; `rays` keeps its memory.
fn cast_rays(scene: &Scene, rays: &mut Vec<Point>) {
    rays.clear();
    let (x, y) = (scene.field.length / 2.0, scene.field.width / 2.0);
    let mut add = |direction: Point| {
        let length = norm(direction);
        if length > 1e-6 {
            rays.push([direction[0] / length, direction[1] / length]);
        }
    };
    for post in scene.field.opponent_goal().posts {
        add(sub(post, scene.ball));
    }
    for corner in [[x, y], [x, -y], [-x, y], [-x, -y]] {
        add(sub(corner, scene.ball));
    }
    // Opponents behind others add nothing but time; a small selection sort needs no memory.
    let mut used = [false; 64];
    for _ in 0..MOST_TANGENTS.min(scene.opponents.len()) {
        let mut best: Option<(usize, f64)> = None;
        for (i, opponent) in scene.opponents.iter().enumerate().take(used.len()) {
            let d = distance(opponent.center, scene.ball);
            if !used[i] && best.is_none_or(|(_, least)| d < least) {
                best = Some((i, d));
            }
        }
        let Some((i, d)) = best else { break };
        used[i] = true;
        let radius = scene.opponents[i].radius;
        if d > radius {
            let (direction, half) = (bearing(scene.ball, scene.opponents[i].center), (radius / d).asin());
            add(unit(direction + half));
            add(unit(direction - half));
        }
    }
}

/// All candidates of a scene, into `out`; `rays` and `out` keep their memory.
pub fn candidates(scene: &Scene, rays: &mut Vec<Point>, out: &mut Vec<Candidate>) {
    cast_rays(scene, rays);
    out.clear();
    let borders = borders(scene.field);
    let mut offer = |circle: Option<Candidate>| {
        let Some(circle) = circle else { return };
        let way = distance(circle.center, scene.ball);
        if circle.radius >= LEAST_RADIUS && way >= LEAST_WAY && scene.field.contains(circle.center, -TOUCH_MARGIN) {
            out.push(circle);
        }
    };
    for (i, ray) in rays.iter().enumerate() {
        for other in &rays[i + 1..] {
            for border in &borders {
                if let (Some(p), Some(q)) = (border.hit(scene.ball, *ray), border.hit(scene.ball, *other)) {
                    offer(incircle(scene.ball, p, q));
                }
            }
        }
        for goal_line in &borders[..2] {
            for touch_line in &borders[2..] {
                if let (Some(p), Some(q)) = (goal_line.hit(scene.ball, *ray), touch_line.hit(scene.ball, *ray)) {
                    offer(incircle(p, q, [goal_line.at, touch_line.at]));
                }
            }
        }
    }
}

/// The seven costs of a candidate.
pub fn costs(scene: &Scene, circle: &Candidate) -> Costs {
    let length = scene.field.length;
    let goal = scene.field.opponent_goal().center;
    let c = circle.center;
    let nearest = |points: &mut dyn Iterator<Item = Point>| points.map(|p| distance(p, c)).reduce(f64::min);
    let opponent = nearest(&mut scene.opponents.iter().map(|o| o.center));
    Costs {
        area: HALF_RADIUS / (HALF_RADIUS + circle.radius),
        goal_angle: wrap(bearing(scene.ball, c) - scene.own.heading).abs() / PI,
        goal_distance: (distance(c, goal) / length).min(1.0),
        own_distance: (distance(c, scene.own.position()) / length).min(1.0),
        team_distance: nearest(&mut scene.mates.iter().copied()).map_or(0.0, |d| (d / length).min(1.0)),
        opponent_distance: opponent.map_or(0.0, |d| HALF_OPPONENT / (HALF_OPPONENT + d)),
        block: blocked(scene, c),
    }
}

/// How far opponents stand in the way from the ball to `to`: 1 where one's body does, falling to 0 at a standard
/// deviation of the kick beside it.
fn blocked(scene: &Scene, to: Point) -> f64 {
    let way = sub(to, scene.ball);
    let length = norm(way);
    let ray = [way[0] / length.max(1e-9), way[1] / length.max(1e-9)];
    let mut worst: f64 = 0.0;
    for opponent in scene.opponents {
        let off = sub(opponent.center, scene.ball);
        let ahead = dot(off, ray);
        if ahead <= 0.0 || ahead >= length {
            continue;
        }
        let free = cross(ray, off).abs() - opponent.radius - scene.field.ball.radius;
        worst = worst.max((1.0 - free / (ahead * scene.spread + 0.05)).clamp(0.0, 1.0));
    }
    worst
}

/// The best circle by (11), the minimum in the place of (12)'s maximum, of those that the kick can reach. `rays` and
/// `circles` keep their memory.
pub fn best_pass(
    scene: &Scene,
    weights: &Weights,
    rays: &mut Vec<Point>,
    circles: &mut Vec<Candidate>,
) -> Option<Target> {
    candidates(scene, rays, circles);
    let mut best: Option<(Candidate, f64)> = None;
    for circle in circles.iter().filter(|c| distance(c.center, scene.ball) <= scene.reach + c.radius) {
        let cost = costs(scene, circle).total(weights);
        if best.is_none_or(|(_, least)| cost < least) {
            best = Some((*circle, cost));
        }
    }
    let (circle, cost) = best?;
    let way = distance(circle.center, scene.ball);
    Some(Target {
        kind: TargetKind::Pass,
        point: circle.center,
        radius: circle.radius,
        direction: bearing(scene.ball, circle.center),
        // Two tangents from the ball to the circle.
        tolerance: (circle.radius / way).min(1.0).asin(),
        cost,
    })
}

/// The widest gap between the posts and the opponents, each wider by `opponent_reach` (m), and the chance that a kick at
/// its middle with `spread` (rad) goes through. With `whole`, the goal's middle whether blocked or not. `None` only
/// where the ball lies on or behind the goal line.
pub fn open_goal(scene: &Scene, opponent_reach: f64, spread: f64, whole: bool) -> Option<Target> {
    let goal = scene.field.opponent_goal();
    let ball = scene.ball;
    let ahead = goal.center[0] - ball[0];
    if ahead < 0.05 {
        return None;
    }
    let radius = scene.field.ball.radius;
    // Directions to posts and opponents, all within a quarter turn of straight ahead: no wrap.
    let angle = |y: f64| (y - ball[1]).atan2(ahead);
    let (low, high) = (angle(goal.posts[1][1] + radius), angle(goal.posts[0][1] - radius));
    let shadow = |o: &Circle| {
        let d = distance(o.center, ball);
        let wide = o.radius + radius + opponent_reach;
        // Whoever stands beside the goal casts a shadow beside it, which no gap meets.
        let before = o.center[0] > ball[0] && o.center[0] < goal.center[0] + o.radius;
        let half = (wide / d.max(1e-9)).min(1.0).asin();
        before.then(|| (bearing(ball, o.center) - half, bearing(ball, o.center) + half))
    };
    // A gap starts at the right post or where a shadow ends, and runs to the next shadow or the left post.
    let mut gap = (0.0, 0.0);
    let starts = std::iter::once(low).chain(scene.opponents.iter().filter_map(|o| shadow(o).map(|s| s.1)));
    for start in starts.filter(|s| *s >= low && *s < high) {
        let mut end = high;
        for (from, to) in scene.opponents.iter().filter_map(shadow) {
            if from <= start && to > start {
                end = start;
            } else if from > start {
                end = end.min(from);
            }
        }
        if end - start > gap.1 - gap.0 {
            gap = (start, end);
        }
    }
    let (from, to) = if whole { (low, high) } else { gap };
    let half = (to - from).max(0.0) / 2.0;
    let direction = (from + to) / 2.0;
    let reaches = scene.reach >= ahead / direction.cos().max(1e-3);
    // A normal direction error within the half gap.
    let chance = if reaches { libm::erf(half / spread.max(1e-6) * FRAC_1_SQRT_2) } else { 0.0 };
    if half == 0.0 {
        return None;
    }
    let point = [goal.center[0], ball[1] + ahead * direction.tan()];
    let radius = distance(point, ball) * half.sin();
    Some(Target { kind: TargetKind::Shot, point, radius, direction, tolerance: half, cost: 1.0 - chance })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn scene<'a>(field: &'a Field, ball: Point, opponents: &'a [Circle]) -> Scene<'a> {
        Scene {
            field,
            ball,
            own: Pose::new(ball[0] - 0.4, ball[1], 0.0),
            mates: &[],
            opponents,
            spread: 0.1,
            reach: 20.0,
        }
    }

    fn line_distance(p: Point, a: Point, b: Point) -> f64 {
        (cross(sub(b, a), sub(p, a)) / distance(a, b)).abs()
    }

    proptest! {
        /// The oracle is the definition: the same distance to all three sides.
        #[test]
        fn an_incircle_touches_all_sides(p in prop::array::uniform6(-10.0..10.0f64)) {
            let (a, b, c) = ([p[0], p[1]], [p[2], p[3]], [p[4], p[5]]);
            prop_assume!(cross(sub(b, a), sub(c, a)).abs() > 0.5);
            let circle = incircle(a, b, c).unwrap();
            for (u, v) in [(a, b), (b, c), (c, a)] {
                prop_assert!((line_distance(circle.center, u, v) - circle.radius).abs() < 1e-6);
            }
        }

        /// Brute force: all triples of all lines, met by Cramer's rule, ray or not.
        #[test]
        fn no_triangle_is_forgotten(ball in (-6.0..6.0f64, -3.8..3.8f64), o in prop::array::uniform4(-4.0..4.0f64)) {
            let field = Field::named("adult-2024").unwrap();
            let opponents = [Circle { center: [o[0], o[1]], radius: 0.3 }, Circle { center: [o[2], o[3]], radius: 0.3 }];
            let ball = [ball.0, ball.1];
            prop_assume!(opponents.iter().all(|o| distance(o.center, ball) > 0.4));
            let scene = scene(&field, ball, &opponents);
            let (mut rays, mut found) = (Vec::new(), Vec::new());
            candidates(&scene, &mut rays, &mut found);
            // A line is a point and a direction; a ray lives only ahead of its point.
            let mut lines: Vec<(Point, Point, bool)> = rays.iter().map(|r| (ball, *r, true)).collect();
            let (x, y) = (field.length / 2.0, field.width / 2.0 - TOUCH_MARGIN);
            lines.extend([([x, 0.0], [0.0, 1.0], false), ([-x, 0.0], [0.0, 1.0], false)]);
            lines.extend([([0.0, y], [1.0, 0.0], false), ([0.0, -y], [1.0, 0.0], false)]);
            let meet = |a: &(Point, Point, bool), b: &(Point, Point, bool)| {
                let det = cross(a.1, b.1);
                if det.abs() < 1e-9 { return None; }
                let t = cross(sub(b.0, a.0), b.1) / det;
                let s = cross(sub(b.0, a.0), a.1) / det;
                if (a.2 && !(-1e-9..1e4).contains(&t)) || (b.2 && !(-1e-9..1e4).contains(&s)) { return None; }
                Some(along(a.0, a.1, t))
            };
            let mut brute = 0;
            for i in 0..lines.len() {
                for j in i + 1..lines.len() {
                    for k in j + 1..lines.len() {
                        let corners = (meet(&lines[i], &lines[j]), meet(&lines[j], &lines[k]), meet(&lines[k], &lines[i]));
                        let (Some(p), Some(q), Some(r)) = corners else { continue };
                        let Some(c) = incircle(p, q, r) else { continue };
                        if c.radius < LEAST_RADIUS || distance(c.center, ball) < LEAST_WAY
                            || !field.contains(c.center, -TOUCH_MARGIN) { continue; }
                        brute += 1;
                        prop_assert!(found.iter().any(|f| distance(f.center, c.center) < 1e-6), "{c:?} is missing");
                    }
                }
            }
            prop_assert_eq!(brute, found.len());
        }

        /// The chance of a shot against a Monte Carlo of straight balls that opponents stop.
        #[test]
        fn the_open_goal_is_open(ball in (-2.0..6.0f64, -3.0..3.0f64), o in prop::array::uniform4(-0.9..0.9f64)) {
            let field = Field::named("adult-2024").unwrap();
            let ball = [ball.0, ball.1];
            let opponents = [Circle { center: [6.0 + o[0], 2.0 * o[1]], radius: 0.25 },
                Circle { center: [5.0 + o[2], 2.0 * o[3]], radius: 0.25 }];
            prop_assume!(opponents.iter().all(|o| distance(o.center, ball) > 0.6));
            let scene = scene(&field, ball, &opponents);
            let stopped = |direction: f64| {
                let ray = unit(direction);
                let end = along(ball, ray, (7.0 - ball[0]) / ray[0]);
                let post = 1.3 - field.ball.radius;
                end[1].abs() > post || opponents.iter().any(|o| {
                    let off = sub(o.center, ball);
                    let ahead = dot(off, ray);
                    ahead > 0.0 && o.center[0] > ball[0] && cross(ray, off).abs() < o.radius + field.ball.radius
                })
            };
            let mut widest: f64 = 0.0;
            let mut open = 0.0;
            let steps = 20_000;
            for i in 0..steps {
                let direction = -1.5 + 3.0 * f64::from(i) / f64::from(steps);
                open = if stopped(direction) { 0.0 } else { open + 3.0 / f64::from(steps) };
                widest = widest.max(open);
            }
            let found = open_goal(&scene, 0.0, 0.1, false).map_or(0.0, |t| 2.0 * t.tolerance);
            prop_assert!((found - widest).abs() < 2e-3, "found {found}, swept {widest}");
        }
    }

    /// Found by the sweep above: from the corner an opponent in front of the far post is farther than the goal and blocks all the same.
    #[test]
    fn an_opponent_before_the_far_post_blocks_from_the_corner() {
        let field = Field::named("adult-2024").unwrap();
        let opponents = [Circle { center: [6.87, 1.56], radius: 0.25 }];
        let open = |opponents: &[Circle]| {
            open_goal(&scene(&field, [5.76, -2.82], opponents), 0.0, 0.1, false).map_or(0.0, |target| target.tolerance)
        };
        assert!(open(&opponents) < open(&[]) - 0.01, "{} {}", open(&opponents), open(&[]));
    }

    #[test]
    fn each_cost_rises_with_what_it_is_for() {
        let field = Field::named("adult-2024").unwrap();
        let opponents = [Circle { center: [3.0, 0.0], radius: 0.3 }];
        let mates = [[2.0, 3.0]];
        let scene = Scene { mates: &mates, ..scene(&field, [0.0, 0.0], &opponents) };
        let at = |x: f64, y: f64, radius: f64| costs(&scene, &Candidate { center: [x, y], radius });
        assert!(at(4.0, 2.0, 0.2).area > at(4.0, 2.0, 0.8).area);
        assert!(at(-4.0, 0.0, 0.5).goal_angle > at(4.0, 0.0, 0.5).goal_angle);
        assert!((at(-4.0, 0.0, 0.5).goal_angle - 1.0).abs() < 1e-12);
        assert!(at(-4.0, 0.0, 0.5).goal_distance > at(4.0, 0.0, 0.5).goal_distance);
        assert!(at(5.0, 0.0, 0.5).own_distance > at(1.0, 0.0, 0.5).own_distance);
        assert!(at(2.0, -3.0, 0.5).team_distance > at(2.0, 3.0, 0.5).team_distance);
        assert!(at(3.0, 0.5, 0.5).opponent_distance > at(-3.0, 0.5, 0.5).opponent_distance);
        assert_eq!(at(5.0, 0.0, 0.5).block, 1.0);
        assert_eq!(at(0.0, 4.0, 0.5).block, 0.0);
        assert!(at(5.0, 0.9, 0.5).block > 0.0 && at(5.0, 0.9, 0.5).block < 1.0);
    }

    #[test]
    fn the_best_pass_is_the_cheapest_and_its_cone_touches_its_circle() {
        let field = Field::named("adult-2024").unwrap();
        let opponents = [Circle { center: [2.0, 0.5], radius: 0.3 }, Circle { center: [5.0, -1.0], radius: 0.3 }];
        let scene = scene(&field, [0.5, 0.0], &opponents);
        let (mut rays, mut circles) = (Vec::new(), Vec::new());
        let weights = Weights::default();
        let best = best_pass(&scene, &weights, &mut rays, &mut circles).unwrap();
        for circle in circles.iter().filter(|c| distance(c.center, scene.ball) <= scene.reach + c.radius) {
            assert!(costs(&scene, circle).total(&weights) >= best.cost);
        }
        let tangent = unit(best.direction + best.tolerance);
        assert!((cross(tangent, sub(best.point, scene.ball)).abs() - best.radius).abs() < 1e-9);
    }
}
