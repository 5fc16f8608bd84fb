//! A real robot over ROS, played by this test: it goes where it is told and tells its joints and its inertial sensor,
//! until they stop in the middle of a kick.

use std::time::{Duration, Instant};

use instep_ros::Mapping;
use instep_ros::form::Dynamic;
use instep_ros::msg::{Header, Imu, JointCommand, JointState, KickResult, Quaternion};
use ros2_client::action::GoalStatusEnum;
use ros2_client::{MessageTypeName, Name};

use crate::client::goal;
use crate::support::{self, Client};

#[test]
fn the_foot_comes_down_when_sensors_stop() {
    let domain = 65;
    let robot = support::robot();
    let (node, lines) = support::node::<Dynamic>(&robot, domain, Mapping::Enhanced, None);
    let client = Client::<Dynamic>::new(domain);
    // Without sensors there is no kick.
    let (_, accepted) = client.send(&goal());
    assert!(!accepted && lines.lock().unwrap().iter().any(|line| line.ends_with("rejected: joint_states is silent")));

    let mut peer = support::peer(domain, "robot");
    let qos = support::reliable(200);
    let topic = |name: &str, package: &str, kind: &str| {
        peer.create_topic(&Name::parse(name).unwrap(), MessageTypeName::new(package, kind), &qos).unwrap()
    };
    let (joints, imu, goals) = (
        topic("/joint_states", "sensor_msgs", "JointState"),
        topic("/imu/data", "sensor_msgs", "Imu"),
        topic("/kick_motor_goals", "bitbots_msgs", "JointCommand"),
    );
    let joints = peer.create_publisher::<JointState>(&joints, None).unwrap();
    let imu = peer.create_publisher::<Imu>(&imu, None).unwrap();
    let commands = peer.create_subscription::<JointCommand>(&goals, Some(support::reliable(200))).unwrap();

    let name: Vec<String> = robot.joints.iter().map(|joint| joint.name.clone()).collect();
    let stand = robot.stand[7..].to_vec();
    let mut position = stand.clone();
    let mut received = 0_usize;
    let mut farthest = 0.0_f64;
    let mut live = |sensing: bool| {
        while let Some((command, _)) = commands.take().unwrap() {
            position = command.positions;
            received += 1;
            let off = position.iter().zip(&stand).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            farthest = farthest.max(off);
        }
        if sensing {
            let joint_state = JointState { name: name.clone(), position: position.clone(), ..JointState::default() };
            joints.publish(joint_state).unwrap();
            let orientation = Quaternion { w: 1.0, ..Quaternion::default() };
            imu.publish(Imu { header: Header::default(), orientation, ..Imu::default() }).unwrap();
        }
        std::thread::sleep(Duration::from_millis(4));
        let off = position.iter().zip(&stand).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        (received, farthest, off)
    };
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(1500) {
        live(true);
    }
    let (request, id) = client.action.send_goal(goal()).unwrap();
    let mut accepted = None;
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(1600) {
        live(true);
        accepted = accepted.or(client.action.receive_goal_response(request).unwrap().map(|answer| answer.accepted));
    }
    assert_eq!(accepted, Some(true), "{:?}", lines.lock().unwrap());
    let (before, raised, off) = live(true);
    assert!(before > 100 && raised > 0.1 && off > 0.1, "{before} commands, {raised} rad, now {off} rad from the stand");
    // Now the robot falls silent, but still listens.
    let silence = Instant::now();
    let request = client.action.request_result(id).unwrap();
    let mut ended = None;
    while ended.is_none() && silence.elapsed() < Duration::from_secs(10) {
        live(false);
        ended = client.action.receive_result(request).unwrap();
    }
    let took = silence.elapsed().as_secs_f64();
    std::thread::sleep(Duration::from_millis(50));
    let (after, _, off) = live(false);
    let (status, result) = ended.expect("no result after the sensors stopped");
    assert_eq!((status, result.result), (GoalStatusEnum::Aborted, KickResult::ABORTED));
    assert!(after > before + 50, "commands must go on while the foot comes down: {before}, then {after}");
    assert!(off < 0.05, "{off} rad from the stand {took} s after the sensors stopped");
    let lines = lines.lock().unwrap();
    assert!(lines.iter().any(|line| line.contains("went silent during the kick")), "{lines:?}");
    println!(
        "the foot was down {took:.2} s after the sensors stopped; {} commands; {:#?}",
        after,
        node.stop().unwrap()
    );
}
