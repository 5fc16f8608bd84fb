//! The topics and their message definitions in the `ros2msg` encoding.
//!
//! Only the layout (types, names, order of fields) is stated; it must match `messages.rs`.

/// A topic, its message type and the types that one is made of.
pub(super) struct Topic {
    /// Topic name.
    pub(super) name: &'static str,
    /// Type name, such as `sensor_msgs/msg/Imu`.
    pub(super) message: &'static str,
    /// Its fields, one a line.
    fields: &'static str,
    /// Every type it needs, directly or not.
    needs: &'static [Definition],
}

/// A type: its name as in `MSG:` lines, and its fields.
type Definition = (&'static str, &'static str);

const TIME: Definition = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const HEADER: Definition = ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n");
const VECTOR3: Definition = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
const POINT: Definition = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: Definition = ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n");
const POSE: Definition = ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n");
const TRANSFORM: Definition =
    ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n");
const TRANSFORM_STAMPED: Definition = (
    "geometry_msgs/TransformStamped",
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
);

pub(super) const JOINT_STATES: Topic = Topic {
    name: "/joint_states",
    message: "sensor_msgs/msg/JointState",
    fields: "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
    needs: &[HEADER, TIME],
};

pub(super) const TF: Topic = Topic {
    name: "/tf",
    message: "tf2_msgs/msg/TFMessage",
    fields: "geometry_msgs/TransformStamped[] transforms\n",
    needs: &[TRANSFORM_STAMPED, HEADER, TIME, TRANSFORM, VECTOR3, QUATERNION],
};

pub(super) const BALL: Topic = Topic {
    name: "/ball",
    message: "geometry_msgs/msg/PoseStamped",
    fields: "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
    needs: &[HEADER, TIME, POSE, POINT, QUATERNION],
};

pub(super) const IMU: Topic = Topic {
    name: "/imu",
    message: "sensor_msgs/msg/Imu",
    fields: "std_msgs/Header header\n\
        geometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
        geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
        geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
    needs: &[HEADER, TIME, QUATERNION, VECTOR3],
};

pub(super) const IMAGE: Topic = Topic {
    name: "/camera/image/compressed",
    message: "sensor_msgs/msg/CompressedImage",
    fields: "std_msgs/Header header\nstring format\nuint8[] data\n",
    needs: &[HEADER, TIME],
};

const POINT2: Definition = ("foxglove_msgs/Point2", "float64 x\nfloat64 y\n");
const COLOR: Definition = ("foxglove_msgs/Color", "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n");
const CIRCLE: Definition = (
    "foxglove_msgs/CircleAnnotation",
    "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nfloat64 diameter\nfloat64 thickness\n\
        foxglove_msgs/Color fill_color\nfoxglove_msgs/Color outline_color\n",
);
const POINTS: Definition = (
    "foxglove_msgs/PointsAnnotation",
    "builtin_interfaces/Time timestamp\nuint8 type\nfoxglove_msgs/Point2[] points\n\
        foxglove_msgs/Color outline_color\nfoxglove_msgs/Color[] outline_colors\nfoxglove_msgs/Color fill_color\n\
        float64 thickness\n",
);
const TEXT: Definition = (
    "foxglove_msgs/TextAnnotation",
    "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nstring text\nfloat64 font_size\n\
        foxglove_msgs/Color text_color\nfoxglove_msgs/Color background_color\n",
);

pub(super) const ANNOTATIONS: Topic = Topic {
    name: "/camera/annotations",
    message: "foxglove_msgs/msg/ImageAnnotations",
    fields: "foxglove_msgs/CircleAnnotation[] circles\nfoxglove_msgs/PointsAnnotation[] points\n\
        foxglove_msgs/TextAnnotation[] texts\n",
    needs: &[CIRCLE, POINTS, TEXT, POINT2, COLOR, TIME],
};

pub(super) const EVENTS: Topic =
    Topic { name: "/events", message: "std_msgs/msg/String", fields: "string data\n", needs: &[] };

pub(super) const DESCRIPTION: Topic =
    Topic { name: "/robot_description", message: "std_msgs/msg/String", fields: "string data\n", needs: &[] };

impl Topic {
    /// The definition with everything it needs, as readers want it: parts divided by a line of 80 equals signs.
    pub(super) fn definition(&self) -> String {
        let mut text = self.fields.to_owned();
        for (name, fields) in self.needs {
            text.push_str(&"=".repeat(80));
            text.push_str("\nMSG: ");
            text.push_str(name);
            text.push('\n');
            text.push_str(fields);
        }
        text
    }
}
