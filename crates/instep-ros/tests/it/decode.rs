//! Bytes of any content as a payload: decoding gives a message or an error, and what is decoded gives a request or a
//! cause, never a panic.

use byteorder::{BigEndian, LittleEndian};
use instep_ros::form::{Dynamic, Form, Form2026};
use instep_ros::msg::{
    Header, Imu, JointCommand, JointState, Kick2026Goal, KickGoal, PointStamped, Quaternion, TfMessage, Time,
    Transform, TransformStamped, Vector3,
};
use instep_ros::tf::TfBuffer;
use proptest::prelude::*;
use serde::de::DeserializeOwned;

fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Option<T> {
    let _ = cdr_encoding::from_bytes::<T, BigEndian>(bytes);
    cdr_encoding::from_bytes::<T, LittleEndian>(bytes).ok().map(|(message, _)| message)
}

fn frame() -> impl Strategy<Value = String> {
    prop_oneof![Just(String::new()), Just("base_footprint".into()), Just("odom".into()), Just("/a".into()), ".{0,8}"]
}

fn header() -> impl Strategy<Value = Header> {
    (any::<i32>(), any::<u32>(), frame())
        .prop_map(|(sec, nanosec, frame_id)| Header { stamp: Time { sec, nanosec }, frame_id })
}

prop_compose! {
    fn vector()(x in any::<f64>(), y in any::<f64>(), z in any::<f64>()) -> Vector3 { Vector3 { x, y, z } }
}

/// Often a rotation, often not.
fn turn() -> impl Strategy<Value = Quaternion> {
    prop_oneof![
        (-4.0..4.0_f64).prop_map(|a| Quaternion { x: 0.0, y: 0.0, z: a.sin(), w: a.cos() }),
        (any::<f64>(), any::<f64>(), any::<f64>(), any::<f64>()).prop_map(|(x, y, z, w)| Quaternion { x, y, z, w }),
    ]
}

fn transforms() -> impl Strategy<Value = Vec<(TransformStamped, bool)>> {
    let one = (header(), frame(), vector(), turn(), any::<bool>(), any::<bool>()).prop_map(
        |(header, child, at, rotation, fixed, near)| {
            let translation = if near { Vector3::new([0.1, 0.2, 0.3]) } else { at };
            (TransformStamped { header, child_frame_id: child, transform: Transform { translation, rotation } }, fixed)
        },
    );
    proptest::collection::vec(one, 0..12)
}

proptest! {
    #[test]
    fn bytes_of_any_content_are_a_message_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        decode::<KickGoal>(&bytes);
        decode::<Kick2026Goal>(&bytes);
        decode::<JointState>(&bytes);
        decode::<Imu>(&bytes);
        decode::<PointStamped>(&bytes);
        decode::<JointCommand>(&bytes);
        decode::<TfMessage>(&bytes);
    }

    #[test]
    fn a_valid_message_with_one_byte_changed_is_no_trap(
        goal in (header(), vector(), turn(), any::<f64>()), list in transforms(), at in any::<prop::sample::Index>(), byte in any::<u8>()
    ) {
        let (header, ball_position, kick_direction, kick_speed) = goal;
        let goal = KickGoal { header, ball_position, kick_direction, kick_speed, unstable: false };
        let mut bytes = cdr_encoding::to_vec::<_, LittleEndian>(&goal).unwrap();
        prop_assert_eq!(format!("{:?}", decode::<KickGoal>(&bytes)), format!("{:?}", Some(goal)));
        let i = at.index(bytes.len());
        bytes[i] = byte;
        decode::<KickGoal>(&bytes);
        let message = TfMessage { transforms: list.into_iter().map(|(t, _)| t).collect() };
        let mut bytes = cdr_encoding::to_vec::<_, LittleEndian>(&message).unwrap();
        let i = at.index(bytes.len());
        bytes[i] = byte;
        decode::<TfMessage>(&bytes);
    }

    #[test]
    fn a_goal_of_any_content_is_a_finite_request_or_a_cause(
        header in header(), ball_position in vector(), kick_direction in turn(), kick_speed in any::<f64>(),
        list in transforms(), b in (any::<f64>(), any::<f64>(), any::<f64>(), any::<f64>()),
    ) {
        let mut tf = TfBuffer::default();
        for (transform, fixed) in &list {
            let _ = tf.insert(transform, *fixed);
        }
        let goal = KickGoal { header, ball_position, kick_direction, kick_speed, unstable: true };
        if let Ok(request) = Dynamic::request(&goal, &tf) {
            prop_assert!(request.ball.iter().all(|v| v.is_finite()) && request.direction.is_finite());
        }
        let (x, y, strength, timeout) = b;
        let _ = Form2026::request(&Kick2026Goal { x, y, strength, timeout }, &tf);
    }
}
