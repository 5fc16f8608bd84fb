//! A team's own MCAP recording as a stream: what it walked, what it saw, and the truth where motion capture ran.
//!
//! | schema | what it gives |
//! |---|---|
//! | `nav_msgs/msg/Odometry` | steps of odometry, from one message to the next |
//! | `soccer_vision_3d_msgs/msg/MarkingArray` | intersections by their rays (2 L, 3 T, 4 X), marks, pieces of lines |
//! | `soccer_vision_3d_msgs/msg/GoalpostArray` | goal posts |
//! | `geometry_msgs/msg/PoseStamped` on a topic with `truth`, `mocap` or `vicon` in its name | the truth, field frame |
//! | any channel in JSON | the objects of a JSON-lines stream |
//!
//! Layouts: common_interfaces and ros-sports/soccer_interfaces (also under its older name `soccer_3d_vision_msgs`). Sights
//! must be given in a frame on the ground under the robot, x ahead. Messages of one stamp are one frame. Everything else
//! in the file is passed over.

use std::path::Path;

use byteorder::LittleEndian;
use instep_field::{LandmarkClass, Pose};
use instep_localisation::stream::{Stream, Told, Truth};
use instep_localisation::{Frame, LineSight, Sight, Step};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::failure::Failure;

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Header {
    sec: i32,
    nanosec: u32,
    frame_id: String,
}

#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Vector {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Placed {
    position: Vector,
    /// x, y, z, w
    orientation: [f64; 4],
}

#[derive(Debug, Default, Serialize, Deserialize)]
struct PoseStamped {
    header: Header,
    pose: Placed,
}

/// The beginning of the message: what follows (covariance, twist) is not needed.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Odometry {
    header: Header,
    child_frame_id: String,
    pose: Placed,
}

/// `N` is the type that a version of the interfaces has for the number of rays.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Markings<N> {
    header: Header,
    ellipses: Vec<Ellipse>,
    intersections: Vec<Intersection<N>>,
    segments: Vec<Segment>,
}

#[derive(Debug, Default, Serialize, Deserialize)]
struct Ellipse {
    diameter: f64,
    center: Placed,
    confidence: f32,
}

#[derive(Debug, Default, Serialize, Deserialize)]
struct Intersection<N> {
    center: Placed,
    rays: N,
    directions: Vec<Vector>,
    confidence: f32,
}

#[derive(Debug, Default, Serialize, Deserialize)]
struct Segment {
    start: Vector,
    end: Vector,
    confidence: f32,
}

#[derive(Debug, Default, Serialize, Deserialize)]
struct Goalposts {
    header: Header,
    posts: Vec<Goalpost>,
}

#[derive(Debug, Default, Serialize, Deserialize)]
struct Goalpost {
    center: Placed,
    size: Vector,
    side: u8,
    team: u8,
    confidence: f32,
}

/// An ellipse smaller than this is a mark, a larger one the centre circle, m.
const MARK: f64 = 0.5;

/// Reads a recording.
///
/// # Errors
/// When the file is no MCAP file, a message of a known type cannot be read, or there is no sight in it.
pub(super) fn load(path: &Path) -> Result<Stream, Failure> {
    let about = |detail: String| Failure::input(format!("{}: {detail}", path.display()));
    let bytes = std::fs::read(path).map_err(|e| about(e.to_string()))?;
    let messages = mcap::MessageStream::new(&bytes).map_err(|e| about(e.to_string()))?;
    let mut messages = messages.collect::<Result<Vec<_>, _>>().map_err(|e| about(e.to_string()))?;
    // In the order of arrival.
    messages.sort_by_key(|m| m.log_time);
    let mut reader = Reader::default();
    for (number, message) in messages.iter().enumerate() {
        let place = || format!("message {} on {}", number + 1, message.channel.topic);
        reader.read(message).map_err(|detail| about(format!("{}: {detail}", place())))?;
    }
    Ok(Stream::of(reader.told, &path.display().to_string())?)
}

#[derive(Debug, Default)]
struct Reader {
    told: Vec<Told>,
    /// Whole seconds of the first stamp: times count from there, so that they keep their nanoseconds.
    begin: Option<i32>,
    odometry: Option<Pose>,
}

impl Reader {
    fn read(&mut self, message: &mcap::Message<'_>) -> Result<(), String> {
        if message.channel.message_encoding == "json" {
            self.told.push(serde_json::from_slice(&message.data).map_err(|e| e.to_string())?);
            return Ok(());
        }
        let Some(schema) = message.channel.schema.as_ref().filter(|_| message.channel.message_encoding == "cdr") else {
            return Ok(());
        };
        let topic = message.channel.topic.to_lowercase();
        let is_truth = ["truth", "mocap", "vicon"].iter().any(|word| topic.contains(word));
        match schema.name.as_str() {
            "nav_msgs/msg/Odometry" => {
                let read: Odometry = decode(&message.data)?;
                let pose = planar(&read.pose);
                let motion = self.odometry.replace(pose).map_or_else(Pose::default, |before| before.relative(&pose));
                let time = self.time(&read.header);
                self.told.push(Told::Odometry(Step { time, motion }));
            }
            "geometry_msgs/msg/PoseStamped" if is_truth => {
                let read: PoseStamped = decode(&message.data)?;
                let time = self.time(&read.header);
                self.told.push(Told::Truth(Truth { time, pose: planar(&read.pose) }));
            }
            "soccer_vision_3d_msgs/msg/MarkingArray" | "soccer_3d_vision_msgs/msg/MarkingArray" => {
                // Versions of the interfaces differ in one type; the file says which it has.
                if String::from_utf8_lossy(&schema.data).contains("uint8 num_rays") {
                    self.markings(decode::<Markings<u8>>(&message.data)?)?;
                } else {
                    self.markings(decode::<Markings<i32>>(&message.data)?)?;
                }
            }
            "soccer_vision_3d_msgs/msg/GoalpostArray" | "soccer_3d_vision_msgs/msg/GoalpostArray" => {
                let read: Goalposts = decode(&message.data)?;
                let sights = read
                    .posts
                    .iter()
                    .filter_map(|post| sight(LandmarkClass::GoalPost, post.center.position, post.confidence));
                let sights = sights.collect();
                self.frame(&read.header, sights, Vec::new());
            }
            _ => {}
        }
        Ok(())
    }

    fn markings<N: Copy + Into<i64>>(&mut self, read: Markings<N>) -> Result<(), String> {
        let mut sights = Vec::new();
        for crossing in &read.intersections {
            let class = match crossing.rays.into() {
                2 => LandmarkClass::L,
                3 => LandmarkClass::T,
                4 => LandmarkClass::X,
                other => return Err(format!("an intersection of {other} rays; expected 2 (L), 3 (T) or 4 (X)")),
            };
            sights.extend(sight(class, crossing.center.position, crossing.confidence));
        }
        for ellipse in &read.ellipses {
            // The centre circle's middle is the centre mark.
            let class = if ellipse.diameter < MARK { LandmarkClass::PenaltyMark } else { LandmarkClass::X };
            sights.extend(sight(class, ellipse.center.position, ellipse.confidence));
        }
        let lines = read.segments.iter().filter(|s| s.confidence != 0.0);
        let lines = lines.map(|s| LineSight { from: [s.start.x, s.start.y], to: [s.end.x, s.end.y] }).collect();
        self.frame(&read.header, sights, lines);
        Ok(())
    }

    /// Adds to the frame of this stamp, if it is there, or begins one.
    fn frame(&mut self, header: &Header, landmarks: Vec<Sight>, lines: Vec<LineSight>) {
        let time = self.time(header);
        let same = self.told.iter_mut().rev().take(16).find_map(|told| match told {
            Told::Frame(frame) if frame.time == time => Some(frame),
            _ => None,
        });
        match same {
            Some(frame) => {
                frame.landmarks.extend(landmarks);
                frame.lines.extend(lines);
            }
            None => self.told.push(Told::Frame(Frame { time, landmarks, lines })),
        }
    }

    fn time(&mut self, header: &Header) -> f64 {
        let begin = *self.begin.get_or_insert(header.sec);
        f64::from(header.sec) - f64::from(begin) + 1e-9 * f64::from(header.nanosec)
    }
}

/// A confidence of -1 is not known; one of 0 is no sight.
fn sight(class: LandmarkClass, at: Vector, confidence: f32) -> Option<Sight> {
    let confidence = if confidence < 0.0 { 1.0 } else { f64::from(confidence) };
    (confidence != 0.0).then_some(Sight { class, position: [at.x, at.y], confidence, covariance: None })
}

fn planar(placed: &Placed) -> Pose {
    let [x, y, z, w] = placed.orientation;
    let heading = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    Pose::new(placed.position.x, placed.position.y, heading)
}

/// CDR after its four bytes of encapsulation, which must say little endian.
fn decode<T: DeserializeOwned>(data: &[u8]) -> Result<T, String> {
    let Some(([0, 1, _, _], body)) = data.split_first_chunk::<4>() else {
        return Err("not plain little-endian CDR".to_owned());
    };
    cdr_encoding::from_bytes::<T, LittleEndian>(body).map(|(value, _)| value).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::io::Cursor;

    use instep_localisation::scenario::Scenario;

    use super::*;

    fn header(time: f64) -> Header {
        let nanoseconds = (time * 1e9).round() as i64;
        Header {
            sec: 1_700_000_000 + (nanoseconds / 1_000_000_000) as i32,
            nanosec: (nanoseconds % 1_000_000_000) as u32,
            frame_id: "base_footprint".into(),
        }
    }

    fn placed(pose: &Pose) -> Placed {
        let (s, c) = (pose.heading / 2.0).sin_cos();
        Placed { position: Vector { x: pose.x, y: pose.y, z: 0.0 }, orientation: [0.0, 0.0, s, c] }
    }

    fn at([x, y]: [f64; 2]) -> Placed {
        placed(&Pose::new(x, y, 0.0))
    }

    fn cdr(message: &impl Serialize) -> Vec<u8> {
        [vec![0, 1, 0, 0], cdr_encoding::to_vec::<_, LittleEndian>(message).unwrap()].concat()
    }

    /// A simulated stream, written as a ROS 2 recording of its messages.
    fn written(stream: &Stream) -> Vec<u8> {
        let mut writer = mcap::WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
        let channel = |writer: &mut mcap::Writer<_>, topic: &str, schema: &str, text: &str| {
            let schema = writer.add_schema(schema, "ros2msg", text.as_bytes()).unwrap();
            writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap()
        };
        let odometry = channel(&mut writer, "/odom", "nav_msgs/msg/Odometry", "");
        let markings = channel(&mut writer, "/lines", "soccer_vision_3d_msgs/msg/MarkingArray", "int32 num_rays");
        let posts = channel(&mut writer, "/posts", "soccer_vision_3d_msgs/msg/GoalpostArray", "");
        let truth = channel(&mut writer, "/vicon/robot", "geometry_msgs/msg/PoseStamped", "");
        let mut pose = Pose::default();
        for (number, told) in stream.told.iter().enumerate() {
            let mut write = |channel_id: u16, message: Vec<u8>| {
                let time = number as u64;
                let header =
                    mcap::records::MessageHeader { channel_id, sequence: 0, log_time: time, publish_time: time };
                writer.write_to_known_channel(&header, &message).unwrap();
            };
            match told {
                Told::Odometry(step) => {
                    pose = pose.then(&step.motion);
                    let mut message = cdr(&Odometry {
                        header: header(step.time),
                        child_frame_id: "base_footprint".into(),
                        pose: placed(&pose),
                    });
                    // What a real message goes on with.
                    message.extend([0; 8 * 78]);
                    write(odometry, message);
                }
                Told::Truth(t) => write(truth, cdr(&PoseStamped { header: header(t.time), pose: placed(&t.pose) })),
                Told::Frame(frame) => {
                    let rays = |class| match class {
                        LandmarkClass::L => 2,
                        LandmarkClass::T => 3,
                        _ => 4,
                    };
                    let crossings =
                        frame.landmarks.iter().filter(|s| s.class != LandmarkClass::GoalPost).map(|s| Intersection {
                            center: at(s.position),
                            rays: rays(s.class),
                            directions: vec![Vector::default(); 2],
                            confidence: -1.0,
                        });
                    let segments = frame.lines.iter().map(|l| Segment {
                        start: at(l.from).position,
                        end: at(l.to).position,
                        confidence: 0.5,
                    });
                    write(
                        markings,
                        cdr(&Markings::<i32> {
                            header: header(frame.time),
                            ellipses: Vec::new(),
                            intersections: crossings.collect(),
                            segments: segments.collect(),
                        }),
                    );
                    let seen = frame
                        .landmarks
                        .iter()
                        .filter(|s| s.class == LandmarkClass::GoalPost)
                        .map(|s| Goalpost { center: at(s.position), confidence: 0.9, ..Goalpost::default() });
                    write(posts, cdr(&Goalposts { header: header(frame.time), posts: seen.collect() }));
                }
                _ => {}
            }
        }
        writer.finish().unwrap();
        writer.into_inner().into_inner()
    }

    #[test]
    fn a_recording_gives_the_stream_that_it_was_made_of() {
        let scenario = Scenario { duration: 3.0, ..Scenario::named("lines").unwrap().clone() };
        let stream = Stream::simulate(&scenario, 5).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("team.mcap");
        std::fs::write(&file, written(&stream)).unwrap();
        let read = load(&file).unwrap();
        assert_eq!(read.told.len(), stream.told.len());
        let mut sights = 0;
        for (a, b) in read.told.iter().zip(&stream.told) {
            match (a, b) {
                (Told::Odometry(a), Told::Odometry(b)) => {
                    assert!((a.time - b.time).abs() < 1e-9 && a.motion.distance(&b.motion) < 1e-9);
                }
                (Told::Truth(a), Told::Truth(b)) => assert!(a.pose.distance(&b.pose) < 1e-9),
                (Told::Frame(a), Told::Frame(b)) => {
                    assert_eq!(a.lines, b.lines);
                    assert_eq!(a.landmarks.len(), b.landmarks.len());
                    for sight in &a.landmarks {
                        assert!(b.landmarks.iter().any(|s| s.class == sight.class && s.position == sight.position));
                        sights += 1;
                    }
                }
                other => panic!("{other:?}"),
            }
        }
        assert!(sights > 100);
    }

    #[test]
    fn what_is_no_recording_is_refused_with_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("bad.mcap");
        std::fs::write(&file, b"no such thing").unwrap();
        assert!(load(&file).unwrap_err().message().contains("bad.mcap: "));
        let mut writer = mcap::WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
        let schema = writer.add_schema("nav_msgs/msg/Odometry", "ros2msg", b"").unwrap();
        let channel = writer.add_channel(schema, "/odom", "cdr", &BTreeMap::new()).unwrap();
        let header = mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 0, publish_time: 0 };
        writer.write_to_known_channel(&header, &[0, 1, 0, 0, 7]).unwrap();
        writer.finish().unwrap();
        std::fs::write(&file, writer.into_inner().into_inner()).unwrap();
        let said = load(&file).unwrap_err();
        assert!(said.message().contains("message 1 on /odom"), "{}", said.message());
    }
}
