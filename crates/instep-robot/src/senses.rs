//! A robot's senses as they are: how late, how coarse, how biased and how noisy each reading is, and what its camera sees.
//!
//! Deviations are drawn once a trial (offsets, biases, gains, drift) or at every reading (noise) from normal distributions
//! with the standard deviations given here. All of a robot's readings but the ball's come over its bus, once a period of its
//! drives. The drawing itself is the world's: see instep-sim. Temperature, vibration and magnetic fields are left out.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::robot::LinkPoint;

/// `[senses]` of `robot.toml`. What is absent is perfect.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SenseSettings {
    /// From the instant of a reading to the tick that has it, s.
    pub delay: f64,
    /// Smallest step of a joint's angle, rad. A joint's speed is then the difference of two readings over their time.
    pub encoder_resolution: f64,
    /// Deviation of a joint's zero, rad.
    pub encoder_offset: f64,
    /// Deviation of the gyro's zero, rad/s.
    pub gyro_bias: f64,
    /// Noise of the gyro, rad/s.
    pub gyro_noise: f64,
    /// Deviation of the accelerometer's zero, m/s^2.
    pub accelerometer_bias: f64,
    /// Noise of the accelerometer, m/s^2.
    pub accelerometer_noise: f64,
    /// Deviation of the estimated roll and pitch, rad.
    pub tilt_bias: f64,
    /// Deviation of the rate at which the estimated yaw runs away, rad/s.
    pub yaw_drift: f64,
    /// Noise of the estimated orientation about each axis, rad.
    pub orientation_noise: f64,
    /// Deviation of a foot sensor's gain from one.
    pub foot_gain: f64,
    /// Deviation of a foot sensor's zero, N.
    pub foot_offset: f64,
    /// Force up to which a foot sensor tells nothing, N.
    pub foot_dead_zone: f64,
    /// Noise of a foot sensor as a share of its force.
    pub foot_noise: f64,
    /// The camera that looks for the ball; without one the ball is seen perfectly at every reading.
    pub camera: Option<CameraSettings>,
}

/// A camera and what is known of its sights of the ball.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSettings {
    /// The link that carries it.
    pub link: String,
    /// Its centre in the link's frame, m.
    pub position: [f64; 3],
    /// How far it looks down in the link's pose of the model, rad: turned about the base's y axis.
    #[serde(default)]
    pub pitch: f64,
    /// Width and height of its field of view, rad.
    pub field_of_view: [f64; 2],
    /// Time between frames, s.
    #[serde(default = "CameraSettings::default_period")]
    pub period: f64,
    /// Least and greatest time from a frame to the sight that comes of it, s.
    #[serde(default = "CameraSettings::default_latency")]
    pub latency: [f64; 2],
    /// Deviation of the direction in which the ball is seen, rad, aside and up. On the ground the error of the distance d
    /// under a camera at height h is (d^2 + h^2) / h times it: it grows with the distance.
    #[serde(default = "CameraSettings::default_angle_error")]
    pub angle_error: f64,
    /// Time over which that error stays about the same, s.
    #[serde(default = "CameraSettings::default_correlation")]
    pub correlation: f64,
}

impl CameraSettings {
    /// 30 frames a second.
    fn default_period() -> f64 {
        1.0 / 30.0
    }

    /// Exposure, transfer and detection.
    fn default_latency() -> [f64; 2] {
        [0.030, 0.060]
    }

    /// A degree's half: pixels, lens and mounting together.
    fn default_angle_error() -> f64 {
        0.008
    }

    fn default_correlation() -> f64 {
        0.5
    }
}

/// A robot's camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Its centre.
    pub at: LinkPoint,
    /// `link_from_camera`; the camera looks along its x axis, y to the left, z up.
    pub link_from_camera: UnitQuaternion<f64>,
    /// Width and height of its field of view, rad.
    pub field_of_view: [f64; 2],
    /// Time between frames, s.
    pub period: f64,
    /// Least and greatest time from a frame to its sight, s.
    pub latency: [f64; 2],
    /// Deviation of a sight's direction, rad.
    pub angle_error: f64,
    /// Time over which that error stays about the same, s.
    pub correlation: f64,
}

impl Camera {
    /// Whether a point in the camera's frame (m) is inside the field of view.
    #[must_use]
    pub fn frames(&self, point: &Vector3<f64>) -> bool {
        let [width, height] = self.field_of_view;
        point.x > 0.0
            && point.y.abs() <= point.x * (0.5 * width).tan()
            && point.z.abs() <= point.x * (0.5 * height).tan()
    }
}

impl SenseSettings {
    /// The first field whose value cannot be: its path, what stands there, what would be right.
    #[must_use]
    pub fn fault(&self) -> Option<(String, String, &'static str)> {
        let deviations = [
            ("encoder_resolution", self.encoder_resolution, 0.1),
            ("encoder_offset", self.encoder_offset, 0.2),
            ("gyro_bias", self.gyro_bias, 1.0),
            ("gyro_noise", self.gyro_noise, 1.0),
            ("accelerometer_bias", self.accelerometer_bias, 10.0),
            ("accelerometer_noise", self.accelerometer_noise, 10.0),
            ("tilt_bias", self.tilt_bias, 0.5),
            ("yaw_drift", self.yaw_drift, 1.0),
            ("orientation_noise", self.orientation_noise, 0.5),
            ("foot_gain", self.foot_gain, 1.0),
            ("foot_offset", self.foot_offset, 1000.0),
            ("foot_dead_zone", self.foot_dead_zone, 1000.0),
            ("foot_noise", self.foot_noise, 1.0),
        ];
        let wrong = |field: &str, found: String, expected| Some((format!("senses.{field}"), found, expected));
        if !(0.0..=0.2).contains(&self.delay) {
            return wrong("delay", self.delay.to_string(), "a delay of 0 to 0.2 s");
        }
        for (field, value, most) in deviations {
            if !(0.0..=most).contains(&value) {
                return wrong(field, value.to_string(), "a deviation of at least 0, of a size that a sensor has");
            }
        }
        let camera = self.camera.as_ref()?;
        let [width, height] = camera.field_of_view;
        if !(width > 0.0 && height > 0.0 && width < 3.1 && height < 3.1) {
            return wrong("camera.field_of_view", format!("[{width}, {height}]"), "two angles above 0, below 3.1 rad");
        }
        if !(0.001..=1.0).contains(&camera.period) {
            return wrong("camera.period", camera.period.to_string(), "a period of 0.001 to 1 s");
        }
        let [least, greatest] = camera.latency;
        if !(0.0 <= least && least <= greatest && greatest <= 1.0) {
            let expected = "two times from 0 to 1 s, the lesser first";
            return wrong("camera.latency", format!("[{least}, {greatest}]"), expected);
        }
        if !(0.0..=0.5).contains(&camera.angle_error) {
            return wrong("camera.angle_error", camera.angle_error.to_string(), "a deviation of 0 to 0.5 rad");
        }
        if !(camera.correlation >= 0.0 && camera.correlation.is_finite()) {
            return wrong("camera.correlation", camera.correlation.to_string(), "a time of at least 0 s");
        }
        if !(camera.pitch.abs() <= 1.6) {
            return wrong("camera.pitch", camera.pitch.to_string(), "an angle in [-1.6, 1.6] rad");
        }
        None
    }
}
