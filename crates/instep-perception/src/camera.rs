//! A rectified stereo camera: pinhole geometry of its left eye, where it is, and what its numbers may be.
//!
//! Camera frame (ROS optical): x right, y down, z ahead. A pixel's ray is not of unit length: its z is 1, so a ray's
//! parameter is the depth that a stereo camera reports, the distance along the optical axis.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::PerceptionError;

/// What a stereo camera can do. Lengths in m, angles in rad, times in s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Horizontal field of view, rad, above 0 and below pi.
    pub field_of_view: f64,
    /// Pixels in a row.
    pub width: usize,
    /// Pixels in a column.
    pub height: usize,
    /// Frames a second, Hz.
    pub rate: f64,
    /// Time that the shutter is open, s.
    pub exposure: f64,
    /// Between the two eyes, m.
    pub baseline: f64,
    /// Standard deviation of the disparity, in pixels of this image.
    pub disparity_noise: f64,
    /// Nothing nearer has a depth, m.
    pub nearest: f64,
    /// Nothing farther has a depth, m.
    pub farthest: f64,
}

impl Default for Camera {
    /// A ZED 2 in its 1920 x 1080 mode, whose left image is reduced by five and cut to the network's size.
    fn default() -> Self {
        Camera {
            field_of_view: 1.466,
            width: 384,
            height: 224,
            rate: 60.0,
            exposure: 0.008,
            baseline: 0.12,
            disparity_noise: 0.06,
            nearest: 0.4,
            farthest: 20.0,
        }
    }
}

impl Camera {
    /// Focal length in pixels.
    pub fn focal(&self) -> f32 {
        (self.width as f64 / 2.0 / (self.field_of_view / 2.0).tan()) as f32
    }

    /// Vertical field of view, rad.
    pub fn vertical_field_of_view(&self) -> f64 {
        2.0 * (self.height as f64 / 2.0 / f64::from(self.focal())).atan()
    }

    /// Checks every number; `place` is what an error names in front of the field.
    ///
    /// # Errors
    /// [`PerceptionError::Value`] for the first number that cannot be.
    pub fn validate(&self, place: &str) -> Result<(), PerceptionError> {
        let within = |field: &str, found: f64, low: f64, high: f64| {
            if found >= low && found <= high {
                Ok(())
            } else {
                Err(PerceptionError::Value {
                    field: format!("{place}.{field}"),
                    found: found.to_string(),
                    expected: format!("{low} to {high}"),
                })
            }
        };
        within("field_of_view", self.field_of_view, 0.1, 2.8)?;
        within("width", self.width as f64, 32.0, 4096.0)?;
        within("height", self.height as f64, 32.0, 4096.0)?;
        within("rate", self.rate, 0.1, 1000.0)?;
        within("exposure", self.exposure, 0.0, 0.1)?;
        within("baseline", self.baseline, 0.01, 1.0)?;
        within("disparity_noise", self.disparity_noise, 0.0, 5.0)?;
        within("nearest", self.nearest, 0.01, 5.0)?;
        within("farthest", self.farthest, self.nearest, 100.0)
    }

    /// The ray through the middle of pixel (u, v), camera frame, z = 1. Pixel (0, 0) spans [0, 1] x [0, 1].
    pub fn ray(&self, u: f32, v: f32) -> Vector3<f32> {
        let f = self.focal();
        Vector3::new((u - self.width as f32 / 2.0) / f, (v - self.height as f32 / 2.0) / f, 1.0)
    }

    /// Where a point of the camera frame falls in the image; `None` when it is not ahead of the camera.
    pub fn project(&self, point: Vector3<f32>) -> Option<[f32; 2]> {
        let f = self.focal();
        (point.z > 0.02).then(|| {
            [f * point.x / point.z + self.width as f32 / 2.0, f * point.y / point.z + self.height as f32 / 2.0]
        })
    }
}

/// Where the left eye is: world_from_camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraPose {
    /// World frame, m.
    pub position: Vector3<f32>,
    /// World from camera (optical axes).
    pub rotation: Matrix3<f32>,
}

impl CameraPose {
    /// A camera that looks along `yaw` (rad, from +x toward +y), `pitch` down (rad), turned by `roll` about its axis
    /// (rad, to the right).
    pub fn looking(position: [f32; 3], yaw: f32, pitch: f32, roll: f32) -> Self {
        let ((sy, cy), (sp, cp), (sr, cr)) = (yaw.sin_cos(), pitch.sin_cos(), roll.sin_cos());
        let ahead = Vector3::new(cp * cy, cp * sy, -sp);
        let right = Vector3::new(sy, -cy, 0.0);
        let down = ahead.cross(&right);
        let rotation = Matrix3::from_columns(&[right * cr + down * sr, down * cr - right * sr, ahead]);
        CameraPose { position: Vector3::from(position), rotation }
    }

    /// A point of the world in the camera frame, m.
    pub fn camera_from_world(&self, point: Vector3<f32>) -> Vector3<f32> {
        self.rotation.tr_mul(&(point - self.position))
    }

    /// A point of the camera frame in the world, m.
    pub fn world_from_camera(&self, point: Vector3<f32>) -> Vector3<f32> {
        self.position + self.rotation * point
    }

    /// How far the optical axis points below the horizon, rad.
    pub fn pitch(&self) -> f32 {
        (-self.rotation[(2, 2)]).clamp(-1.0, 1.0).asin()
    }

    /// The direction in which the optical axis points over the ground, rad.
    pub fn yaw(&self) -> f32 {
        self.rotation[(1, 2)].atan2(self.rotation[(0, 2)])
    }

    /// A point of the camera frame in the robot's own: origin on the ground under the camera, x ahead, y left, z up.
    pub fn robot_from_camera(&self, point: Vector3<f32>) -> Vector3<f32> {
        let (s, c) = self.yaw().sin_cos();
        let p = self.rotation * point;
        Vector3::new(c * p.x + s * p.y, -s * p.x + c * p.y, p.z + self.position.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_and_its_depth_give_the_point_again() {
        let camera = Camera::default();
        let pose = CameraPose::looking([1.0, -2.0, 1.3], 0.7, 0.3, 0.05);
        for point in [[4.0f32, 0.5, 0.0], [3.0, -0.5, 0.9]] {
            let point = Vector3::from(point);
            let local = pose.camera_from_world(point);
            let [u, v] = camera.project(local).unwrap();
            let back = pose.world_from_camera(camera.ray(u, v) * local.z);
            assert!((back - point).norm() < 1e-5);
        }
        assert!((pose.pitch() - 0.3).abs() < 1e-6 && (pose.yaw() - 0.7).abs() < 1e-6);
    }

    #[test]
    fn left_of_the_robot_is_left_in_the_image() {
        let pose = CameraPose::looking([0.0, 0.0, 1.0], 0.0, 0.0, 0.0);
        let [u, v] = Camera::default().project(pose.camera_from_world(Vector3::new(3.0, 1.0, 0.0))).unwrap();
        assert!(u < 192.0 && v > 112.0);
        let robot = pose.robot_from_camera(pose.camera_from_world(Vector3::new(3.0, 1.0, 0.2)));
        assert!((robot - Vector3::new(3.0, 1.0, 0.2)).norm() < 1e-6);
    }

    #[test]
    fn a_camera_without_a_field_of_view_is_named() {
        let camera = Camera { field_of_view: 0.0, ..Camera::default() };
        let said = camera.validate("robot.toml: camera").unwrap_err().to_string();
        assert_eq!(said, "robot.toml: camera.field_of_view: 0; expected 0.1 to 2.8");
        assert!(Camera { rate: f64::NAN, ..Camera::default() }.validate("camera").is_err());
    }
}
