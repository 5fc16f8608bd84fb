//! Standing contact points keep their place (9), (11) on the ground (12), by independent rows.
//!
//! Five points with three rows each would say the same thing several times. A link with three or more standing points
//! gets six rows, one with two gets five, one with one gets three; where the toe is held so, only the heights of the
//! heel's points are left. The place is that of the whole stance, not that of the node before: errors do not add up.
//! At the first and last node of a stance the speed is held too, so that the foot neither slips nor hits the ground.
//! Units: m; for speeds 0.1 m/s.

use instep_robot::Robot;
use nalgebra::Vector3;

use super::node::View;
use super::terms::{Family, Sink};

/// Scale of the speed rows, s.
const SPEED: f64 = 0.1;

pub(crate) fn rows(view: &View, sink: &mut Sink) {
    let plan = view.plan;
    for hold in &view.node.holds {
        let contact = &plan.robot.contacts[hold.point];
        let direction = plan.episodes[hold.episode].turn() * hold.direction;
        let at = view.s.dynamics.pose.point(&contact.at);
        let away = (at - plan.place(hold.episode, hold.point)).dot(&direction);
        sink.equal(Family::Contact, away, |row| view.point_row(contact.at.link, &at, &direction, &mut row.q));
        if hold.edge {
            let speed = view.velocity(contact.at.link, &at).dot(&direction);
            sink.equal(Family::ContactSpeed, SPEED * speed, |row| {
                view.velocity_row(contact.at.link, &at, &(direction * SPEED), row);
            });
        }
    }
}

/// The rows, point and direction in the foot's axes, that hold the points `standing` of one foot.
pub(crate) fn independent(robot: &Robot, offsets: &[Vector3<f64>], standing: &[usize]) -> Vec<(usize, Vector3<f64>)> {
    let mut links: Vec<usize> = standing.iter().map(|&p| robot.contacts[p].at.link).collect();
    links.sort_unstable();
    links.dedup();
    // The link with the most points first: it gets the whole pose.
    let on = |link: usize| standing.iter().copied().filter(move |&p| robot.contacts[p].at.link == link);
    links.sort_by_key(|&link| std::cmp::Reverse(on(link).count()));
    let mut rows = Vec::new();
    for (order, &link) in links.iter().enumerate() {
        let points: Vec<usize> = on(link).collect();
        if order > 0 {
            // Hinged to a link that is held: one more height is all that is left.
            rows.extend(points.first().map(|&p| (p, Vector3::z())));
            continue;
        }
        let Some(&first) = points.first() else { continue };
        rows.extend([Vector3::x(), Vector3::y(), Vector3::z()].map(|d| (first, d)));
        // The farthest point from it, then the one farthest from their line.
        let from = |p: usize| (offsets[p] - offsets[first]).xy();
        let Some(&second) = points[1..].iter().max_by(|a, b| from(**a).norm().total_cmp(&from(**b).norm())) else {
            continue;
        };
        let along = from(second).normalize();
        let across = Vector3::new(-along.y, along.x, 0.0);
        rows.extend([(second, across), (second, Vector3::z())]);
        let beside = |p: usize| from(p).perp(&along).abs();
        let third = points[1..].iter().copied().max_by(|a, b| beside(*a).total_cmp(&beside(*b)));
        rows.extend(third.filter(|&p| beside(p) > 1e-4).map(|p| (p, Vector3::z())));
    }
    rows
}
