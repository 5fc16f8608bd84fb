//! MCAP recordings in the ROS 2 profile: CDR messages of standard types, readable without a ROS installation.
//!
//! | topic | type | frame |
//! |---|---|---|
//! | `/joint_states` | `sensor_msgs/msg/JointState` | the base link |
//! | `/tf` | `tf2_msgs/msg/TFMessage` | `world` to each link |
//! | `/ball` | `geometry_msgs/msg/PoseStamped` | `world` |
//! | `/imu` | `sensor_msgs/msg/Imu` | the sensor's link |
//! | `/events` | `std_msgs/msg/String` | – |
//! | `/robot_description` | `std_msgs/msg/String`: a URDF, once | its links are the frames of `/tf` |
//! | `/camera/image/compressed` | `sensor_msgs/msg/CompressedImage` | `camera` |
//! | `/camera/annotations` | `foxglove_msgs/msg/ImageAnnotations` | pixels of that image |
//!
//! Every stamp is the time of the trial, never the clock of this machine: the same trial gives the same bytes. The file
//! is built in memory (a few hundred bytes a frame) and written in one step.

mod messages;
mod schemas;

use std::io::Cursor;
use std::path::Path;

use byteorder::LittleEndian;
use serde::Serialize;

use crate::{ReportError, file};
use messages as msg;
use schemas::{ANNOTATIONS, BALL, DESCRIPTION, EVENTS, IMAGE, IMU, JOINT_STATES, TF, Topic};

/// The frame that `/tf` and `/ball` are given in.
pub const WORLD: &str = "world";

/// CDR encapsulation header: plain CDR, little endian, no options.
const CDR_LITTLE_ENDIAN: [u8; 4] = [0x00, 0x01, 0x00, 0x00];

/// The joints at one instant. The four lists run side by side; `velocity` and `effort` may be empty (unknown).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joints<'a> {
    /// The frame that the joints hang on: the base link.
    pub frame: &'a str,
    /// Joint names.
    pub names: &'a [String],
    /// Angles, rad.
    pub position: &'a [f64],
    /// Speeds, rad/s.
    pub velocity: &'a [f64],
    /// Torques, N m.
    pub effort: &'a [f64],
}

/// A link's pose in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkPose<'a> {
    /// Name of the link's frame.
    pub name: &'a str,
    /// World frame, metres.
    pub position: [f64; 3],
    /// World from link, unit quaternion `[w, x, y, z]`.
    pub rotation: [f64; 4],
}

/// An inertial measurement. Covariances are written as zero (unknown).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imu<'a> {
    /// The link the sensor sits on; its axes are the sensor's.
    pub frame: &'a str,
    /// World from sensor as estimated, unit quaternion `[w, x, y, z]`; `None` if there is no estimate.
    pub rotation: Option<[f64; 4]>,
    /// Angular velocity, sensor frame, rad/s.
    pub angular_velocity: [f64; 3],
    /// Specific force, sensor frame, m/s^2 (at rest: +9.81 upwards).
    pub linear_acceleration: [f64; 3],
}

/// A box in an image, with what is written at it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageBox<'a> {
    /// Left, upper, right and lower edge, pixels.
    pub edges: [f64; 4],
    /// Red, green and blue, 0 to 1.
    pub color: [f64; 3],
    /// What is written at it.
    pub text: &'a str,
}

/// A recording under construction.
pub struct Recording {
    writer: ::mcap::Writer<Cursor<Vec<u8>>>,
    channels: Vec<(&'static str, Channel)>,
}

/// A topic's number in the file and how many messages it has had.
#[derive(Clone, Copy)]
struct Channel {
    id: u16,
    messages: u32,
}

impl Recording {
    /// An empty recording.
    ///
    /// # Errors
    /// [`ReportError::Mcap`] if the writer refuses to start.
    pub fn new() -> Result<Self, ReportError> {
        let writer = ::mcap::WriteOptions::new()
            .profile("ros2")
            .library(concat!("instep ", env!("CARGO_PKG_VERSION")))
            .compression(Some(::mcap::Compression::Lz4))
            .create(Cursor::new(Vec::new()))?;
        Ok(Self { writer, channels: Vec::new() })
    }

    /// Adds the joints' state at `time` (s).
    ///
    /// # Errors
    /// [`ReportError::Inconsistent`] if a list has another length than `names`, [`ReportError::Time`] for an impossible
    /// time.
    pub fn joints(&mut self, time: f64, joints: &Joints<'_>) -> Result<(), ReportError> {
        let n = joints.names.len();
        for (what, length, may_be_empty) in [
            ("position", joints.position.len(), false),
            ("velocity", joints.velocity.len(), true),
            ("effort", joints.effort.len(), true),
        ] {
            if length != n && !(may_be_empty && length == 0) {
                return Err(ReportError::Inconsistent {
                    place: format!("{} at {time} s", JOINT_STATES.name),
                    wrong: format!("{what} has {length} values"),
                    wanted: format!("{n}, one for each joint"),
                });
            }
        }
        let message = msg::JointState {
            header: msg::Header::new(&JOINT_STATES, time, joints.frame)?,
            name: joints.names,
            position: joints.position,
            velocity: joints.velocity,
            effort: joints.effort,
        };
        self.write(&JOINT_STATES, time, &message)
    }

    /// Adds the links' poses at `time` (s), world to each link.
    ///
    /// # Errors
    /// [`ReportError::Time`] for an impossible time.
    pub fn links(&mut self, time: f64, links: &[LinkPose<'_>]) -> Result<(), ReportError> {
        let header = msg::Header::new(&TF, time, WORLD)?;
        let transforms = links
            .iter()
            .map(|link| msg::TransformStamped {
                header,
                child_frame_id: link.name,
                transform: msg::Transform { translation: link.position.into(), rotation: link.rotation.into() },
            })
            .collect();
        self.write(&TF, time, &msg::TfMessage { transforms })
    }

    /// Adds the ball's pose at `time` (s): position in the world frame (m), world from ball as `[w, x, y, z]`.
    ///
    /// # Errors
    /// [`ReportError::Time`] for an impossible time.
    pub fn ball(&mut self, time: f64, position: [f64; 3], rotation: [f64; 4]) -> Result<(), ReportError> {
        let message = msg::PoseStamped {
            header: msg::Header::new(&BALL, time, WORLD)?,
            pose: msg::Pose { position: position.into(), orientation: rotation.into() },
        };
        self.write(&BALL, time, &message)
    }

    /// Adds an inertial measurement at `time` (s).
    ///
    /// # Errors
    /// [`ReportError::Time`] for an impossible time.
    pub fn imu(&mut self, time: f64, imu: &Imu<'_>) -> Result<(), ReportError> {
        // By the message's rule a covariance that begins with -1 says "no estimate".
        let mut orientation_covariance = [0.0; 9];
        if imu.rotation.is_none() {
            orientation_covariance[0] = -1.0;
        }
        let message = msg::Imu {
            header: msg::Header::new(&IMU, time, imu.frame)?,
            orientation: imu.rotation.unwrap_or([1.0, 0.0, 0.0, 0.0]).into(),
            orientation_covariance,
            angular_velocity: imu.angular_velocity.into(),
            angular_velocity_covariance: [0.0; 9],
            linear_acceleration: imu.linear_acceleration.into(),
            linear_acceleration_covariance: [0.0; 9],
        };
        self.write(&IMU, time, &message)
    }

    /// Adds a frame of the camera at `time` (s): the bytes of a PNG file.
    ///
    /// # Errors
    /// [`ReportError::Time`] for an impossible time.
    pub fn image(&mut self, time: f64, png: &[u8]) -> Result<(), ReportError> {
        let header = msg::Header::new(&IMAGE, time, "camera")?;
        self.write(&IMAGE, time, &msg::CompressedImage { header, format: "png", data: png })
    }

    /// Adds boxes over the frame of the same time (s).
    ///
    /// # Errors
    /// [`ReportError::Time`] for an impossible time.
    pub fn annotations(&mut self, time: f64, boxes: &[ImageBox<'_>]) -> Result<(), ReportError> {
        let timestamp = msg::Time::new(&ANNOTATIONS, time)?;
        let color = |[r, g, b]: [f64; 3], a: f64| msg::Color { r, g, b, a };
        let points = boxes.iter().map(|b| {
            let [left, top, right, low] = b.edges;
            let corners = [[left, top], [right, top], [right, low], [left, low]];
            msg::PointsAnnotation {
                timestamp,
                kind: msg::PointsAnnotation::LINE_LOOP,
                points: corners.map(|[x, y]| msg::Point2 { x, y }).into(),
                outline_color: color(b.color, 1.0),
                outline_colors: Vec::new(),
                fill_color: color([0.0; 3], 0.0),
                thickness: 1.0,
            }
        });
        let texts = boxes.iter().map(|b| msg::TextAnnotation {
            timestamp,
            position: msg::Point2 { x: b.edges[0], y: b.edges[1] },
            text: b.text,
            font_size: 8.0,
            text_color: color(b.color, 1.0),
            background_color: color([0.0; 3], 0.5),
        });
        let message = msg::ImageAnnotations { circles: Vec::new(), points: points.collect(), texts: texts.collect() };
        self.write(&ANNOTATIONS, time, &message)
    }

    /// Adds an event at `time` (s).
    ///
    /// # Errors
    /// [`ReportError::Time`] for an impossible time.
    pub fn event(&mut self, time: f64, label: &str) -> Result<(), ReportError> {
        self.write(&EVENTS, time, &msg::StringMessage { data: label })
    }

    /// Says what the robot looks like, as a URDF: at time 0, for a viewer to draw at the frames of `/tf`.
    ///
    /// # Errors
    /// [`ReportError::Encode`] where it cannot be written as a message.
    pub fn description(&mut self, urdf: &str) -> Result<(), ReportError> {
        self.write(&DESCRIPTION, 0.0, &msg::StringMessage { data: urdf })
    }

    /// The whole file.
    ///
    /// # Errors
    /// [`ReportError::Mcap`] if the writer cannot finish.
    pub fn finish(mut self) -> Result<Vec<u8>, ReportError> {
        self.writer.finish()?;
        Ok(self.writer.into_inner().into_inner())
    }

    /// Writes the file to `path` in one step.
    ///
    /// # Errors
    /// [`ReportError::Write`] if the file cannot be written; then nothing is left behind. [`ReportError::Mcap`] as for
    /// [`Recording::finish`].
    pub fn save(self, path: impl AsRef<Path>) -> Result<(), ReportError> {
        let bytes = self.finish()?;
        file::write_atomically(path.as_ref(), &bytes)
    }

    fn write(&mut self, topic: &Topic, time: f64, message: &impl Serialize) -> Result<(), ReportError> {
        let log_time = msg::Time::new(topic, time)?.nanoseconds();
        let payload = cdr_encoding::to_vec::<_, LittleEndian>(message)
            .map_err(|source| ReportError::Encode { topic: topic.name, source })?;
        let mut data = CDR_LITTLE_ENDIAN.to_vec();
        data.extend_from_slice(&payload);

        let channel = self.channel(topic)?;
        let header = ::mcap::records::MessageHeader {
            channel_id: channel.id,
            sequence: channel.messages,
            log_time,
            publish_time: log_time,
        };
        Ok(self.writer.write_to_known_channel(&header, &data)?)
    }

    /// The topic's channel, made on first use, with this message counted.
    fn channel(&mut self, topic: &Topic) -> Result<Channel, ReportError> {
        if let Some((_, channel)) = self.channels.iter_mut().find(|(name, _)| *name == topic.name) {
            channel.messages = channel.messages.wrapping_add(1);
            return Ok(*channel);
        }
        let schema = self.writer.add_schema(topic.message, "ros2msg", topic.definition().as_bytes())?;
        let id = self.writer.add_channel(schema, topic.name, "cdr", &Default::default())?;
        let channel = Channel { id, messages: 0 };
        self.channels.push((topic.name, channel));
        Ok(channel)
    }
}
