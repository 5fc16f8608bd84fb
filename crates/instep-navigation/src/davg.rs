//! DAVG, the dynamic augmented visibility graph (paper 4, IV-D-1): a way round polygons that counts its turns.
//!
//! The shortest way by length plus `turn_cost` times the sum of all turns, the first from the robot's heading, the last to
//! the goal's where they matter. A turn belongs to two segments, so the search runs over *directed edges*, not over nodes:
//! the cheapest way to a corner need not be the start of the cheapest way through it.
//!
//! What keeps it fast loses nothing:
//! - *Active region*: polygons that cut start-goal seed it; a box in the start-goal frame about start, goal and the corners of
//!   all active polygons takes in every polygon that it meets, until none is left. An optimal way round the active ones lies in
//!   their hull with start and goal, the hull in the box, so no other polygon is touched.
//! - *Taut corners*: an optimal way bends only round the polygon whose corner it is at. A corner that bends away from it, or an
//!   edge that is not tangent, can be cut off: that shortens the way and, as an inscribed polygon turns no more than
//!   the one about it (Milnor 1950), adds no turn.
//!
//! Start or goal inside a polygon: edges that leave or reach it may cross that polygon at a price on each metre inside, so the
//! way out is the cheapest and no special case is needed (the paper's "nearest vertex in the heading direction" walks 1.7 times
//! as far inside). There corners of that polygon need not be taut. Allocates nothing once the sizes have been seen.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use instep_field::wrap;

use crate::polygon::{Polygon, SIDES};

/// Polygons that a planner takes at most; the nearest to start-goal count.
pub const MOST_POLYGONS: usize = 40;
const NO_PARENT: u32 = u32::MAX;

/// On which side a way passes a polygon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bend {
    /// It bends left: the polygon lies to its left.
    Left,
    /// It bends right.
    Right,
}

/// A question to the planner.
#[derive(Debug, Clone, Copy)]
pub struct Query<'a> {
    /// m
    pub start: [f64; 2],
    /// The robot's heading, where the first turn counts, rad.
    pub start_heading: Option<f64>,
    /// m
    pub goal: [f64; 2],
    /// Where the last turn counts, rad.
    pub goal_heading: Option<f64>,
    /// Keep-outs.
    pub polygons: &'a [Polygon],
    /// Half length and half width of where corners may lie, m.
    pub half: [f64; 2],
    /// m/rad
    pub turn_cost: f64,
    /// What a metre inside counts more.
    pub inside_price: f64,
    /// A polygon that must not be bent round the other way.
    pub keep: Option<(usize, Bend)>,
}

/// What a way costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Route {
    /// Length plus price of turns and of metres inside, m.
    pub cost: f64,
    /// The first polygon that is bent round, and how.
    pub first: Option<(usize, Bend)>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    at: [f64; 2],
    /// Polygon and its neighbours on it; start and goal have none.
    corner: Option<Corner>,
}

#[derive(Debug, Clone, Copy)]
struct Corner {
    polygon: usize,
    neighbours: [[f64; 2]; 2],
    /// Of a polygon that holds start or goal.
    loose: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Open {
    bound: f64,
    edge: u32,
}

impl Eq for Open {}
impl Ord for Open {
    /// The heap gives the greatest first: that is the least bound, then the least number, so that ties have one order.
    fn cmp(&self, other: &Self) -> Ordering {
        other.bound.total_cmp(&self.bound).then(other.edge.cmp(&self.edge))
    }
}
impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The planner with its memory; one for each robot.
#[derive(Debug, Clone)]
pub struct Planner {
    active: Vec<bool>,
    nodes: Vec<Node>,
    /// Cost of each pair of nodes without turns: NaN not yet looked at, infinite when blocked.
    lengths: Vec<f64>,
    /// Least cost to the end of each directed edge `from * n + to`.
    costs: Vec<f64>,
    parents: Vec<u32>,
    open: BinaryHeap<Open>,
    path: Vec<[f64; 2]>,
}

impl Default for Planner {
    fn default() -> Self {
        let nodes = 2 + SIDES * MOST_POLYGONS;
        Self {
            active: Vec::with_capacity(MOST_POLYGONS),
            nodes: Vec::with_capacity(nodes),
            lengths: Vec::with_capacity(nodes * nodes),
            costs: Vec::with_capacity(nodes * nodes),
            parents: Vec::with_capacity(nodes * nodes),
            open: BinaryHeap::with_capacity(1 << 16),
            path: Vec::with_capacity(nodes),
        }
    }
}

fn sub(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn turn(from: [f64; 2], to: [f64; 2]) -> f64 {
    cross(from, to).atan2(from[0] * to[0] + from[1] * to[1])
}

impl Planner {
    /// The corners of the last way, start and goal included, m.
    #[must_use]
    pub fn path(&self) -> &[[f64; 2]] {
        &self.path
    }

    /// How many polygons the last question needed.
    #[must_use]
    pub fn active(&self) -> usize {
        self.active.iter().filter(|a| **a).count()
    }

    /// The cheapest way; `None` when the polygons enclose start or goal.
    pub fn plan(&mut self, query: &Query) -> Option<Route> {
        let polygons = &query.polygons[..query.polygons.len().min(MOST_POLYGONS)];
        self.activate(query, polygons);
        self.place_nodes(query, polygons);
        let n = self.nodes.len();
        for (vector, value) in [(&mut self.lengths, f64::NAN), (&mut self.costs, f64::INFINITY)] {
            vector.clear();
            vector.resize(n * n, value);
        }
        self.parents.clear();
        self.parents.resize(n * n, NO_PARENT);
        self.open.clear();
        self.path.clear();

        for to in 1..n {
            let length = self.length(query, polygons, 0, to);
            if length.is_finite() {
                let way = sub(self.nodes[to].at, query.start);
                let first = query.start_heading.map_or(0.0, |h| wrap(way[1].atan2(way[0]) - h).abs());
                let first = if way == [0.0; 2] { 0.0 } else { first };
                self.offer(query, NO_PARENT, 0, to, length + query.turn_cost * first);
            }
        }
        while let Some(Open { bound, edge }) = self.open.pop() {
            let (from, to) = (edge as usize / n, edge as usize % n);
            let cost = self.costs[edge as usize];
            if bound > cost + self.to_go(query, from, to) + 1e-12 {
                continue; // a cheaper way to it came later
            }
            if to == 1 {
                return Some(self.trace(edge, cost, n));
            }
            self.expand(query, polygons, edge, cost);
        }
        None
    }

    /// Chooses the polygons that can matter.
    fn activate(&mut self, query: &Query, polygons: &[Polygon]) {
        let way = sub(query.goal, query.start);
        let length = way[0].hypot(way[1]);
        let axis = if length > 1e-9 { [way[0] / length, way[1] / length] } else { [1.0, 0.0] };
        let local = |p: [f64; 2]| {
            let d = sub(p, query.start);
            [d[0] * axis[0] + d[1] * axis[1], cross(axis, d)]
        };
        let (mut low, mut high) = ([0.0, 0.0], [length, 0.0]);
        self.active.clear();
        self.active.resize(polygons.len(), false);
        let mut seeding = true;
        loop {
            let mut grew = false;
            for (polygon, active) in polygons.iter().zip(&mut self.active).filter(|(_, active)| !**active) {
                let (center, r) = (local(polygon.center), polygon.circumradius());
                let meets = if seeding {
                    polygon.share_inside(query.start, query.goal) > 0.0
                        || polygon.contains(query.start)
                        || polygon.contains(query.goal)
                } else {
                    // Its circle about meets the box.
                    let gap = |i: usize| (low[i] - center[i]).max(center[i] - high[i]).max(0.0);
                    gap(0).hypot(gap(1)) < r
                };
                if meets {
                    *active = true;
                    grew = true;
                    for i in 0..2 {
                        low[i] = f64::min(low[i], center[i] - r);
                        high[i] = f64::max(high[i], center[i] + r);
                    }
                }
            }
            if !grew {
                return;
            }
            seeding = false;
        }
    }

    fn place_nodes(&mut self, query: &Query, polygons: &[Polygon]) {
        self.nodes.clear();
        self.nodes.push(Node { at: query.start, corner: None });
        self.nodes.push(Node { at: query.goal, corner: None });
        for (i, polygon) in polygons.iter().enumerate().filter(|(i, _)| self.active[*i]) {
            let loose = polygon.contains(query.start) || polygon.contains(query.goal);
            for k in 0..SIDES {
                let at = polygon.corner(k);
                let free = at[0].abs() <= query.half[0]
                    && at[1].abs() <= query.half[1]
                    && !polygons.iter().enumerate().any(|(j, other)| j != i && self.active[j] && other.contains(at));
                if free {
                    let neighbours = [polygon.corner(k + SIDES - 1), polygon.corner(k + 1)];
                    self.nodes.push(Node { at, corner: Some(Corner { polygon: i, neighbours, loose }) });
                }
            }
        }
    }

    /// Length of the segment between two nodes with the price of what lies inside; infinite where it is blocked.
    fn length(&mut self, query: &Query, polygons: &[Polygon], from: usize, to: usize) -> f64 {
        let n = self.nodes.len();
        let known = self.lengths[from * n + to];
        if !known.is_nan() {
            return known;
        }
        let (a, b) = (self.nodes[from], self.nodes[to]);
        let length = if tangent(&a, b.at) && tangent(&b, a.at) {
            let way = sub(b.at, a.at);
            let mut price = 1.0;
            for polygon in polygons.iter().zip(&self.active).filter(|(_, active)| **active).map(|(p, _)| p) {
                let share = polygon.share_inside(a.at, b.at);
                if share > 0.0 {
                    let held = |node: usize| node < 2 && polygon.contains(self.nodes[node].at);
                    if held(from) || held(to) {
                        price += share * query.inside_price;
                    } else {
                        price = f64::INFINITY;
                        break;
                    }
                }
            }
            price * way[0].hypot(way[1])
        } else {
            f64::INFINITY
        };
        let length = if length.is_nan() { 0.0 } else { length };
        self.lengths[from * n + to] = length;
        self.lengths[to * n + from] = length;
        length
    }

    /// What the rest costs at least.
    fn to_go(&self, query: &Query, from: usize, to: usize) -> f64 {
        let rest = sub(query.goal, self.nodes[to].at);
        let straight = rest[0].hypot(rest[1]);
        if to == 1 || straight < 1e-9 {
            return straight;
        }
        let way = sub(self.nodes[to].at, self.nodes[from].at);
        // One turn there is no cheaper than several.
        straight + query.turn_cost * if way == [0.0; 2] { 0.0 } else { turn(way, rest).abs() }
    }

    fn offer(&mut self, query: &Query, parent: u32, from: usize, to: usize, cost: f64) {
        let n = self.nodes.len();
        let edge = from * n + to;
        let mut cost = cost;
        if to == 1
            && let Some(heading) = query.goal_heading
        {
            let way = sub(query.goal, self.nodes[from].at);
            if way != [0.0; 2] {
                cost += query.turn_cost * wrap(heading - way[1].atan2(way[0])).abs();
            }
        }
        if cost < self.costs[edge] - 1e-12 {
            self.costs[edge] = cost;
            self.parents[edge] = parent;
            self.open.push(Open { bound: cost + self.to_go(query, from, to), edge: edge as u32 });
        }
    }

    fn expand(&mut self, query: &Query, polygons: &[Polygon], edge: u32, cost: f64) {
        let n = self.nodes.len();
        let (from, at) = (edge as usize / n, edge as usize % n);
        let Some(corner) = self.nodes[at].corner else { return };
        let arriving = sub(self.nodes[at].at, self.nodes[from].at);
        let inward = sub(polygons[corner.polygon].center, self.nodes[at].at);
        for to in 1..n {
            if to == at || to == from {
                continue;
            }
            let leaving = sub(self.nodes[to].at, self.nodes[at].at);
            let angle = turn(arriving, leaving);
            if !corner.loose && angle.abs() > 1e-9 && (angle > 0.0) != (cross(arriving, inward) > 0.0) {
                continue; // bends away: not taut
            }
            if let Some((polygon, bend)) = query.keep
                && polygon == corner.polygon
                && !corner.loose
                && (cross(arriving, inward) > 0.0) != (bend == Bend::Left)
            {
                continue;
            }
            let next = cost + query.turn_cost * angle.abs();
            // Before the polygons are asked: can it improve anything?
            if next + leaving[0].hypot(leaving[1]) >= self.costs[at * n + to] {
                continue;
            }
            let length = self.length(query, polygons, at, to);
            if length.is_finite() {
                self.offer(query, edge, at, to, next + length);
            }
        }
    }

    fn trace(&mut self, edge: u32, cost: f64, n: usize) -> Route {
        let mut first = None;
        let mut at = edge;
        self.path.push(self.nodes[at as usize % n].at);
        loop {
            let (from, to) = (at as usize / n, at as usize % n);
            self.path.push(self.nodes[from].at);
            if let Some(corner) = self.nodes[to].corner {
                let way = sub(self.nodes[to].at, self.nodes[from].at);
                // The polygon's middle is on the side to which a taut way bends.
                let neighbours = corner.neighbours;
                let middle = [0.5 * (neighbours[0][0] + neighbours[1][0]), 0.5 * (neighbours[0][1] + neighbours[1][1])];
                let left = cross(way, sub(middle, self.nodes[to].at)) > 0.0;
                first = Some((corner.polygon, if left { Bend::Left } else { Bend::Right }));
            }
            match self.parents[at as usize] {
                NO_PARENT => break,
                parent => at = parent,
            }
        }
        self.path.reverse();
        Route { cost, first }
    }
}

/// Whether the line to `to` touches a node's polygon only at the node.
fn tangent(node: &Node, to: [f64; 2]) -> bool {
    let Some(corner) = node.corner.filter(|corner| !corner.loose) else { return true };
    let way = sub(to, node.at);
    let [a, b] = corner.neighbours.map(|neighbour| cross(way, sub(neighbour, node.at)));
    let scale = 1e-9 * way[0].hypot(way[1]);
    !((a > scale && b < -scale) || (a < -scale && b > scale))
}

#[cfg(test)]
mod tests;
