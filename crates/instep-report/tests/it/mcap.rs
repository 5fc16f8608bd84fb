//! Recordings read back with the `mcap` crate.

use byteorder::LittleEndian;
use instep_report::ReportError;
use instep_report::mcap::{Imu, Joints, LinkPose, Recording};
use serde::Deserialize;

#[derive(Deserialize, Debug, PartialEq)]
struct Header {
    sec: i32,
    nanosec: u32,
    frame_id: String,
}

#[derive(Deserialize, Debug, PartialEq)]
struct JointState {
    header: Header,
    name: Vec<String>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
}

#[derive(Deserialize, Debug, PartialEq)]
struct TransformStamped {
    header: Header,
    child_frame_id: String,
    translation: [f64; 3],
    rotation_xyzw: [f64; 4],
}

fn recording() -> Recording {
    let names = vec!["knee".to_owned(), "ankle".to_owned()];
    let mut recording = Recording::new().unwrap();
    for frame in 0..50 {
        let time = f64::from(frame) * 0.01;
        let joints = Joints {
            frame: "torso",
            names: &names,
            position: &[time, -time],
            velocity: &[1.0, -1.0],
            effort: &[12.5, f64::from(frame)],
        };
        recording.joints(time, &joints).unwrap();
        let links = [
            LinkPose { name: "pelvis", position: [time, 0.0, 0.9], rotation: [1.0, 0.0, 0.0, 0.0] },
            LinkPose { name: "foot", position: [time, 0.1, 0.0], rotation: [0.5, 0.1, 0.2, 0.3] },
        ];
        recording.links(time, &links).unwrap();
        recording.ball(time, [0.4, 0.0, 0.07], [1.0, 0.0, 0.0, 0.0]).unwrap();
        let imu = Imu {
            frame: "pelvis",
            rotation: None,
            angular_velocity: [0.1, 0.2, 0.3],
            linear_acceleration: [0.0, 0.0, 9.81],
        };
        recording.imu(time, &imu).unwrap();
    }
    recording.event(0.25, "impact").unwrap();
    recording.description("<robot name=\"r\"/>").unwrap();
    recording
}

#[test]
fn messages_read_back() {
    let bytes = recording().finish().unwrap();
    let messages: Vec<_> = ::mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    assert_eq!(messages.len(), 4 * 50 + 2);
    for message in &messages {
        assert_eq!(message.channel.message_encoding, "cdr");
        assert_eq!(message.channel.schema.as_ref().unwrap().encoding, "ros2msg");
        assert_eq!(message.data[..4], [0, 1, 0, 0]);
    }
    fn on<'a, 'b>(messages: &'b [::mcap::Message<'a>], topic: &str) -> Vec<&'b ::mcap::Message<'a>> {
        messages.iter().filter(|message| message.channel.topic == topic).collect()
    }
    fn decode<'de, T: Deserialize<'de>>(message: &'de ::mcap::Message<'_>) -> T {
        cdr_encoding::from_bytes::<T, LittleEndian>(&message.data[4..]).unwrap().0
    }

    let description = on(&messages, "/robot_description");
    assert_eq!((description.len(), description[0].log_time), (1, 0));
    assert_eq!(decode::<String>(description[0]), "<robot name=\"r\"/>");
    let joints = on(&messages, "/joint_states");
    assert_eq!(joints[7].log_time, 70_000_000);
    assert_eq!(joints[7].sequence, 7);
    let wanted = JointState {
        header: Header { sec: 0, nanosec: 70_000_000, frame_id: "torso".into() },
        name: vec!["knee".into(), "ankle".into()],
        position: vec![0.07, -0.07],
        velocity: vec![1.0, -1.0],
        effort: vec![12.5, 7.0],
    };
    assert_eq!(decode::<JointState>(joints[7]), wanted);

    let transforms: Vec<TransformStamped> = decode(on(&messages, "/tf")[3]);
    assert_eq!(transforms.len(), 2);
    assert_eq!(transforms[1].header.frame_id, "world");
    assert_eq!(transforms[1].child_frame_id, "foot");
    assert_eq!(transforms[1].rotation_xyzw, [0.1, 0.2, 0.3, 0.5]);
    assert_eq!(transforms[1].translation, [0.03, 0.1, 0.0]);

    let events = on(&messages, "/events");
    assert_eq!(decode::<String>(events[0]), "impact");
    assert_eq!(events[0].log_time, 250_000_000);

    let summary = ::mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, 202);
}

#[test]
fn same_input_gives_same_bytes() {
    assert_eq!(recording().finish().unwrap(), recording().finish().unwrap());
}

#[test]
fn refused_messages_say_why() {
    let mut recording = Recording::new().unwrap();
    let names = vec!["knee".to_owned()];
    let error = recording
        .joints(0.5, &Joints { frame: "torso", names: &names, position: &[], velocity: &[], effort: &[] })
        .unwrap_err();
    assert_eq!(error.to_string(), "/joint_states at 0.5 s: position has 0 values; wanted 1, one for each joint");
    let error = recording.event(f64::NAN, "never").unwrap_err();
    assert!(matches!(error, ReportError::Time { topic: "/events", .. }), "{error}");
}

#[test]
fn a_folder_that_is_missing_is_named_and_nothing_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing").join("trial.mcap");
    let error = recording().save(&path).unwrap_err();
    assert!(error.to_string().contains("trial.mcap"), "{error}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);

    let path = folder.path().join("trial.mcap");
    recording().save(&path).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), recording().finish().unwrap());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}
