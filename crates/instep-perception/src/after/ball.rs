//! From a ball's box to a ball's place: all checks, then depth by median, else by diameter.

use nalgebra::Vector3;

use super::{depth, diameter, green, height, size};
use crate::camera::{Camera, CameraPose};
use crate::detector::Detection;
use crate::picture::{Depth, Frame};

/// Why a ball was thrown out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// Too little green round it.
    Green,
    /// Too large or too small for its depth.
    Size,
    /// Too high, or below the ground.
    Height,
}

/// A ball's place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// Middle of the ball in the robot's frame (origin on the ground below the camera, x ahead, y left, z up), m.
    pub position: Vector3<f32>,
    /// Deviation along the line of sight, m.
    pub deviation: f32,
    /// Whether depth failed and the diameter was used.
    pub by_diameter: bool,
}

/// Checks a ball's detection and tells where it is.
///
/// # Errors
/// The first check that it does not pass.
pub fn place(
    camera: &Camera,
    pose: &CameraPose,
    radius: f32,
    frame: &Frame,
    map: &Depth,
    ball: &Detection,
) -> Result<Sight, Refused> {
    let rect = &ball.rect;
    if green::share(frame, rect) < green::LEAST {
        return Err(Refused::Green);
    }
    let focal = camera.focal();
    // The depth in the box's middle is that of the ball's front; over its middle half some 0.87 of a radius nearer.
    let measured = depth::median(map, rect).map(|z| z + 0.87 * radius);
    let by_size = diameter::depth(focal, radius, rect.width(), rect.height());
    if !size::fits(focal, radius, measured.unwrap_or(f32::NAN), rect.width(), rect.height()) {
        return Err(Refused::Size);
    }
    let (z, deviation, by_diameter) = match measured {
        Some(z) => (z, (camera.disparity_noise as f32 * z * z / (focal * camera.baseline as f32)).max(0.01), false),
        None => (by_size, 0.12 * by_size, true),
    };
    let [u, v] = rect.middle();
    let position = pose.robot_from_camera(camera.ray(u, v) * z);
    if !height::on_the_ground(position.z, position.xy().norm()) {
        return Err(Refused::Height);
    }
    Ok(Sight { position, deviation, by_diameter })
}
