//! The messages as they lie in CDR: fields in the order of the ROS 2 definitions.

use serde::Serialize;

use super::schemas::Topic;
use crate::ReportError;

/// builtin_interfaces/msg/Time.
#[derive(Serialize, Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Time {
    sec: i32,
    nanosec: u32,
}

impl Time {
    /// From seconds of the trial, rounded to the nanosecond.
    pub(super) fn new(topic: &Topic, time: f64) -> Result<Self, ReportError> {
        let refuse = || ReportError::Time { topic: topic.name, time };
        if !(0.0..=f64::from(i32::MAX)).contains(&time) {
            return Err(refuse());
        }
        let nanoseconds = (time * 1e9).round() as u64;
        let sec = i32::try_from(nanoseconds / 1_000_000_000).map_err(|_| refuse())?;
        Ok(Self { sec, nanosec: (nanoseconds % 1_000_000_000) as u32 })
    }

    pub(super) fn nanoseconds(self) -> u64 {
        u64::from(self.sec.unsigned_abs()) * 1_000_000_000 + u64::from(self.nanosec)
    }
}

/// std_msgs/msg/Header.
#[derive(Serialize, Clone, Copy)]
pub(super) struct Header<'a> {
    stamp: Time,
    frame_id: &'a str,
}

impl<'a> Header<'a> {
    pub(super) fn new(topic: &Topic, time: f64, frame_id: &'a str) -> Result<Self, ReportError> {
        Ok(Self { stamp: Time::new(topic, time)?, frame_id })
    }
}

/// geometry_msgs/msg/Vector3 and Point: the same layout.
#[derive(Serialize)]
pub(super) struct Vector3 {
    x: f64,
    y: f64,
    z: f64,
}

impl From<[f64; 3]> for Vector3 {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

/// geometry_msgs/msg/Quaternion: ROS puts w last, we put it first.
#[derive(Serialize)]
pub(super) struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

impl From<[f64; 4]> for Quaternion {
    fn from([w, x, y, z]: [f64; 4]) -> Self {
        Self { x, y, z, w }
    }
}

/// sensor_msgs/msg/JointState.
#[derive(Serialize)]
pub(super) struct JointState<'a> {
    pub(super) header: Header<'a>,
    pub(super) name: &'a [String],
    pub(super) position: &'a [f64],
    pub(super) velocity: &'a [f64],
    pub(super) effort: &'a [f64],
}

/// tf2_msgs/msg/TFMessage.
#[derive(Serialize)]
pub(super) struct TfMessage<'a> {
    pub(super) transforms: Vec<TransformStamped<'a>>,
}

/// geometry_msgs/msg/TransformStamped.
#[derive(Serialize)]
pub(super) struct TransformStamped<'a> {
    pub(super) header: Header<'a>,
    pub(super) child_frame_id: &'a str,
    pub(super) transform: Transform,
}

/// geometry_msgs/msg/Transform.
#[derive(Serialize)]
pub(super) struct Transform {
    pub(super) translation: Vector3,
    pub(super) rotation: Quaternion,
}

/// geometry_msgs/msg/PoseStamped.
#[derive(Serialize)]
pub(super) struct PoseStamped<'a> {
    pub(super) header: Header<'a>,
    pub(super) pose: Pose,
}

/// geometry_msgs/msg/Pose.
#[derive(Serialize)]
pub(super) struct Pose {
    pub(super) position: Vector3,
    pub(super) orientation: Quaternion,
}

/// sensor_msgs/msg/Imu.
#[derive(Serialize)]
pub(super) struct Imu<'a> {
    pub(super) header: Header<'a>,
    pub(super) orientation: Quaternion,
    pub(super) orientation_covariance: [f64; 9],
    pub(super) angular_velocity: Vector3,
    pub(super) angular_velocity_covariance: [f64; 9],
    pub(super) linear_acceleration: Vector3,
    pub(super) linear_acceleration_covariance: [f64; 9],
}

/// std_msgs/msg/String.
#[derive(Serialize)]
pub(super) struct StringMessage<'a> {
    pub(super) data: &'a str,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mcap::schemas::BALL;

    #[test]
    fn time_rounds_to_the_nanosecond_and_refuses_the_impossible() {
        assert_eq!(Time::new(&BALL, 1.999_999_999_9).unwrap(), Time { sec: 2, nanosec: 0 });
        assert_eq!(Time::new(&BALL, 0.1).unwrap().nanoseconds(), 100_000_000);
        for bad in [-0.001, f64::NAN, f64::INFINITY, 3e9] {
            assert!(matches!(Time::new(&BALL, bad), Err(ReportError::Time { topic: "/ball", .. })), "{bad}");
        }
    }
}

/// sensor_msgs/msg/CompressedImage.
#[derive(Serialize)]
pub(super) struct CompressedImage<'a> {
    pub(super) header: Header<'a>,
    pub(super) format: &'a str,
    pub(super) data: &'a [u8],
}

/// foxglove_msgs/msg/Point2.
#[derive(Serialize)]
pub(super) struct Point2 {
    pub(super) x: f64,
    pub(super) y: f64,
}

/// foxglove_msgs/msg/Color.
#[derive(Serialize, Clone, Copy)]
pub(super) struct Color {
    pub(super) r: f64,
    pub(super) g: f64,
    pub(super) b: f64,
    pub(super) a: f64,
}

/// foxglove_msgs/msg/PointsAnnotation.
#[derive(Serialize)]
pub(super) struct PointsAnnotation {
    pub(super) timestamp: Time,
    pub(super) kind: u8,
    pub(super) points: Vec<Point2>,
    pub(super) outline_color: Color,
    pub(super) outline_colors: Vec<Color>,
    pub(super) fill_color: Color,
    pub(super) thickness: f64,
}

impl PointsAnnotation {
    /// A closed line.
    pub(super) const LINE_LOOP: u8 = 2;
}

/// foxglove_msgs/msg/TextAnnotation.
#[derive(Serialize)]
pub(super) struct TextAnnotation<'a> {
    pub(super) timestamp: Time,
    pub(super) position: Point2,
    pub(super) text: &'a str,
    pub(super) font_size: f64,
    pub(super) text_color: Color,
    pub(super) background_color: Color,
}

/// foxglove_msgs/msg/ImageAnnotations; there are never circles.
#[derive(Serialize)]
pub(super) struct ImageAnnotations<'a> {
    pub(super) circles: Vec<Point2>,
    pub(super) points: Vec<PointsAnnotation>,
    pub(super) texts: Vec<TextAnnotation<'a>>,
}
