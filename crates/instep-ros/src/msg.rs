//! The messages as they lie in CDR: fields in the order of the ROS 2 definitions, which are shipped in `interfaces/`.
//!
//! Layouts: common_interfaces (std_msgs, geometry_msgs, sensor_msgs, tf2_msgs); bitbots_msgs and biped_interfaces as
//! collected in facts/kick-interfaces.md, A and B. Nothing here checks a value: NaN and nonsense can be decoded, and
//! are refused where they are used.

use ros2_client::Message;
use serde::{Deserialize, Serialize};

macro_rules! messages {
    ($($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $type:ty,)* })*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
        pub struct $name { $($(#[$field_doc])* pub $field: $type,)* }
        impl Message for $name {}
    )*};
}

messages! {
    /// builtin_interfaces/msg/Time.
    Time {
        /// Whole seconds since 1970.
        sec: i32,
        /// Below 10^9.
        nanosec: u32,
    }
    /// std_msgs/msg/Header.
    Header {
        /// When; zero stands for "the newest there is".
        stamp: Time,
        /// TF frame.
        frame_id: String,
    }
    /// geometry_msgs/msg/Point and Vector3: the same layout. m, m/s^2 or rad/s.
    Vector3 {
        /// Forward.
        x: f64,
        /// Left.
        y: f64,
        /// Up.
        z: f64,
    }
    /// geometry_msgs/msg/Quaternion: w last, unlike everywhere else in Instep.
    Quaternion {
        /// i.
        x: f64,
        /// j.
        y: f64,
        /// k.
        z: f64,
        /// Scalar part.
        w: f64,
    }
    /// geometry_msgs/msg/PointStamped.
    PointStamped {
        /// When and in which frame.
        header: Header,
        /// m.
        point: Vector3,
    }
    /// geometry_msgs/msg/Transform: `header.frame_id` from `child_frame_id`.
    Transform {
        /// m.
        translation: Vector3,
        /// Rotation.
        rotation: Quaternion,
    }
    /// geometry_msgs/msg/TransformStamped.
    TransformStamped {
        /// When, and the parent frame.
        header: Header,
        /// The child frame.
        child_frame_id: String,
        /// Parent from child.
        transform: Transform,
    }
    /// tf2_msgs/msg/TFMessage.
    TfMessage {
        /// Any number of transforms.
        transforms: Vec<TransformStamped>,
    }
    /// sensor_msgs/msg/JointState.
    JointState {
        /// When.
        header: Header,
        /// Joint names.
        name: Vec<String>,
        /// rad.
        position: Vec<f64>,
        /// rad/s; may be empty.
        velocity: Vec<f64>,
        /// N m; may be empty.
        effort: Vec<f64>,
    }
    /// sensor_msgs/msg/Imu.
    Imu {
        /// When, and the sensor's frame.
        header: Header,
        /// World from sensor.
        orientation: Quaternion,
        /// Unused.
        orientation_covariance: [f64; 9],
        /// rad/s.
        angular_velocity: Vector3,
        /// Unused.
        angular_velocity_covariance: [f64; 9],
        /// m/s^2.
        linear_acceleration: Vector3,
        /// Unused.
        linear_acceleration_covariance: [f64; 9],
    }
    /// bitbots_msgs/msg/JointCommand.
    JointCommand {
        /// When.
        header: Header,
        /// Whether it is a safety layer's; never ours.
        from_hcm: bool,
        /// Joint names.
        joint_names: Vec<String>,
        /// rad.
        positions: Vec<f64>,
        /// rad/s; -1 is the greatest.
        velocities: Vec<f64>,
        /// rad/s^2; -1 is the greatest.
        accelerations: Vec<f64>,
        /// A; -1 is the greatest.
        max_currents: Vec<f64>,
    }
    /// biped_interfaces/msg/Phase.
    SupportState {
        /// When.
        header: Header,
        /// 0 the left, 1 the right foot, 2 both feet.
        phase: u8,
    }
    /// Goal of bitbots_msgs/action/Kick, the form of paper 2 (A).
    KickGoal {
        /// When and in which frame the other fields are given.
        header: Header,
        /// Ball's centre, m.
        ball_position: Vector3,
        /// Its x axis is the wanted direction.
        kick_direction: Quaternion,
        /// Speed of the foot at contact, m/s.
        kick_speed: f64,
        /// Asked for another parameter set of its first engine; ours has one, and ignores it.
        unstable: bool,
    }
    /// Result of either form.
    KickResult {
        /// One of [`KickResult::SUCCESS`] and the other constants.
        result: u8,
    }
    /// Feedback of form A.
    KickFeedback {
        /// 0 the left, 1 the right foot.
        chosen_foot: u8,
        /// 0 to 100.
        percent_done: u8,
    }
    /// Goal of bitbots_msgs/action/Kick, the form of 2026 (B).
    Kick2026Goal {
        /// Direction forward.
        x: f64,
        /// Direction to the left.
        y: f64,
        /// 1 to 5.
        strength: f64,
        /// Latest instant of contact, s; -1: the engine's own.
        timeout: f64,
    }
    /// Feedback of form B.
    Kick2026Feedback {
        /// s.
        time_remaining: f64,
    }
}

impl KickResult {
    /// The kick is done and the robot stands again.
    pub const SUCCESS: u8 = 0;
    /// No foot can do that kick.
    pub const UNREACHABLE: u8 = 1;
    /// Given up on the way: cancelled, fell, or the sensors stopped.
    pub const ABORTED: u8 = 2;
    /// Never begun.
    pub const REJECTED: u8 = 3;
}

impl Time {
    /// From nanoseconds since 1970; what does not fit is held at the nearest that does.
    #[must_use]
    pub fn from_nanoseconds(nanoseconds: i64) -> Self {
        let sec = nanoseconds.div_euclid(1_000_000_000).clamp(i64::from(i32::MIN), i64::from(i32::MAX));
        // Both casts are of numbers just brought within range.
        Self { sec: sec as i32, nanosec: nanoseconds.rem_euclid(1_000_000_000) as u32 }
    }

    /// Nanoseconds since 1970.
    #[must_use]
    pub fn nanoseconds(&self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }
}

impl Vector3 {
    /// From x, y, z.
    #[must_use]
    pub fn new([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }

    /// As x, y, z.
    #[must_use]
    pub fn array(&self) -> [f64; 3] {
        [self.x, self.y, self.z]
    }
}
