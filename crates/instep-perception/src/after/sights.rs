//! All that follows the network, in one pass: the ball's place, the best landmarks, robots.

use serde::Serialize;

use super::{ball, depth, select};
use crate::camera::{Camera, CameraPose};
use crate::class::{Class, Team};
use crate::detector::Detection;
use crate::label::LANDMARK_RANGE;
use crate::picture::{Depth, Frame};

/// Intersections nearer to each other than this are one, m.
const ONE: f32 = 0.5;

/// Something that stands on the ground, in the robot's frame (x ahead, y left), m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sight {
    /// What it is.
    pub class: Class,
    /// Confidence, 0 to 1.
    pub confidence: f32,
    /// Where, m.
    pub position: [f32; 2],
    /// Deviation of its distance, m.
    pub deviation: f32,
    /// A robot's team.
    pub team: Option<Team>,
}

/// What a frame tells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sights {
    /// The most confident ball that passes all checks, and its confidence.
    pub ball: Option<(ball::Sight, f32)>,
    /// Balls that did not pass.
    pub refused: Vec<ball::Refused>,
    /// The best landmarks, at most six, the best first.
    pub landmarks: Vec<Sight>,
    /// Robots.
    pub robots: Vec<Sight>,
}

/// What detections (the most confident first) mean on the ground. A landmark lies where its ray meets the ground: a post at
/// the lower edge of its box, an intersection at its middle. Where a post's foot is below the frame, and for robots, depth
/// tells.
pub fn sights(
    camera: &Camera,
    pose: &CameraPose,
    radius: f32,
    frame: &Frame,
    map: &Depth,
    found: &[Detection],
) -> Sights {
    let mut sights = Sights::default();
    let mut landmarks = Vec::new();
    for detection in found {
        let [u, v] = detection.rect.middle();
        let by_depth = || {
            depth::median(map, &detection.rect).map(|z| {
                let error = camera.disparity_noise as f32 * z * z / (camera.focal() * camera.baseline as f32);
                (pose.robot_from_camera(camera.ray(u, v) * z), error.max(0.02))
            })
        };
        let on_ground = |v: f32| {
            let ray = camera.ray(u, v);
            let down = -(pose.rotation * ray).z;
            (down > 1e-3).then(|| {
                let z = pose.position.z / down;
                // One pixel up or down.
                (pose.robot_from_camera(ray * z), z * z / (camera.focal() * pose.position.z))
            })
        };
        let cut_off = detection.rect.low > camera.height as f32 - 2.0;
        let place = match detection.class {
            Class::Ball => {
                if sights.ball.is_none() {
                    match ball::place(camera, pose, radius, frame, map, detection) {
                        Ok(sight) => sights.ball = Some((sight, detection.confidence)),
                        Err(why) => sights.refused.push(why),
                    }
                }
                continue;
            }
            Class::L | Class::T | Class::X => on_ground(v),
            Class::GoalPost if !cut_off => on_ground(detection.rect.low),
            Class::GoalPost | Class::Robot => by_depth(),
        };
        let Some((place, deviation)) = place else { continue };
        if detection.class.is_intersection() {
            // Farther ones nobody taught it; and a corner is not a crossing too: the more confident one is believed.
            let double = |(_, _, sight): &(f32, f32, Sight)| {
                let [x, y] = sight.position;
                sight.class.is_intersection() && (x - place.x).hypot(y - place.y) < ONE
            };
            if place.xy().norm() > LANDMARK_RANGE || landmarks.iter().any(double) {
                continue;
            }
        }
        let (class, confidence, team) = (detection.class, detection.confidence, detection.team);
        let sight = Sight { class, confidence, position: [place.x, place.y], deviation, team };
        if class == Class::Robot {
            sights.robots.push(sight);
        } else {
            landmarks.push((confidence, place.xy().norm(), sight));
        }
    }
    sights.landmarks = select::best(&landmarks);
    sights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::label::Rect;

    #[test]
    fn an_intersection_is_of_one_class_in_one_place_and_none_is_farther_than_was_taught() {
        let camera = Camera::default();
        let pose = CameraPose::looking([0.0, 0.0, 1.2], 0.0, 0.3, 0.0);
        let frame = Frame::new(camera.width, camera.height);
        let map =
            Depth { width: camera.width, height: camera.height, meters: vec![f32::NAN; camera.width * camera.height] };
        let at = |x: f32, y: f32| camera.project(pose.camera_from_world(nalgebra::Vector3::new(x, y, 0.0))).unwrap();
        let found = |class, confidence, [u, v]: [f32; 2]| Detection {
            class,
            rect: Rect::around([u, v], 20.0, 12.0),
            confidence,
            team: None,
        };
        let all = [
            found(Class::T, 0.9, at(3.0, 0.0)),
            found(Class::X, 0.8, at(3.2, 0.1)),
            found(Class::L, 0.7, at(3.0, 1.0)),
            found(Class::L, 0.7, at(LANDMARK_RANGE + 0.3, 0.0)),
        ];
        let seen = sights(&camera, &pose, 0.11, &frame, &map, &all);
        let mut classes: Vec<Class> = seen.landmarks.iter().map(|sight| sight.class).collect();
        classes.sort();
        assert_eq!(classes, [Class::L, Class::T], "{:?}", seen.landmarks);
    }
}
