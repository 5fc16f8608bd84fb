//! Self-collision (14): pairs of capsules keep apart, C_ij(q) >= r_i + r_j.
//!
//! The distance's gradient is the line between the closest points, whose own motion along the axes drops out
//! (envelope theorem). Where two axes touch there is no such line; the y axis stands in for it. Unit: m.

use instep_robot::{LinkPoint, Robot, RobotData, closest_points};
use nalgebra::Vector3;

use super::node::View;
use super::terms::{Family, Sink};

/// A capsule fixed to a link.
#[derive(Debug, Clone, Copy)]
struct Capsule {
    ends: [LinkPoint; 2],
    radius: f64,
}

/// All pairs that must not touch.
#[derive(Debug, Clone)]
pub(crate) struct Capsules {
    pairs: Vec<[Capsule; 2]>,
}

impl Capsules {
    pub(crate) fn new(robot: &Robot, data: &RobotData) -> Self {
        let capsule = |geom: usize| {
            let link = data.geom_link(geom);
            let (axis, radius) = data.capsule(geom);
            let own = |p: Vector3<f64>| data.link_matrix(link).transpose() * (p - data.link_position(link));
            Capsule { ends: axis.map(|p| LinkPoint { link, point: own(p) }), radius }
        };
        Self { pairs: robot.self_collision.iter().map(|pair| pair.map(capsule)).collect() }
    }
}

pub(crate) fn rows(view: &View, sink: &mut Sink) {
    let pose = &view.s.dynamics.pose;
    for [a, b] in &view.plan.capsules.pairs {
        let points = closest_points(a.ends.map(|p| pose.point(&p)), b.ends.map(|p| pose.point(&p)));
        let gap = points.distance() - a.radius - b.radius;
        sink.at_most(Family::SelfCollision, view.plan.settings.clearance - gap, |row| {
            let normal = (points.second - points.first).try_normalize(1e-9).unwrap_or_else(Vector3::y);
            view.point_row(a.ends[0].link, &points.first, &normal, &mut row.q);
            view.point_row(b.ends[0].link, &points.second, &-normal, &mut row.q);
        });
    }
}
