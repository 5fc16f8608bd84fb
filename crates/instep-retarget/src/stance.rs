//! When each of the robot's contact points stands: the human's heel and toe, carried over to the robot's points.

use instep_motion::contact::ContactSchedule;
use instep_robot::{ContactPoint, Robot};
use nalgebra::Vector3;

/// One stretch in which a contact point stands, frames `start..end` of the clip, at the place `place` (m).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stance {
    /// Index of the contact point.
    pub point: usize,
    /// First frame.
    pub start: usize,
    /// One past the last frame.
    pub end: usize,
    /// Where the sphere's centre stands.
    pub place: Vector3<f64>,
}

/// The stances of every contact point; their places are zero until the motion is known.
pub(crate) fn stances(robot: &Robot, contacts: &ContactSchedule) -> Vec<Stance> {
    let mut stances = Vec::new();
    for (point, contact) in robot.contacts.iter().enumerate() {
        let foot = contacts.foot(contact.leg);
        let stands = if is_toe(robot, contact) { &foot.toe } else { &foot.heel };
        let mut start = None;
        for frame in 0..=stands.len() {
            let standing = stands.get(frame).copied().unwrap_or(false);
            match (start, standing) {
                (None, true) => start = Some(frame),
                (Some(first), false) => {
                    stances.push(Stance { point, start: first, end: frame, place: Vector3::zeros() });
                    start = None;
                }
                _ => {}
            }
        }
    }
    stances
}

/// Whether a contact point follows the human's toe: it is on the toe, or on the front half of a foot without one.
pub(crate) fn is_toe(robot: &Robot, contact: &ContactPoint) -> bool {
    let leg = robot.leg(contact.leg);
    match leg.toe_link {
        Some(toe) => contact.at.link == toe,
        None => contact.at.point.x > leg.sole.point.x,
    }
}
