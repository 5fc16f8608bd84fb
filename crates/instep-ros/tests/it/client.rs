//! A client made with the same library as the node: both forms of the action, and how soon the first command comes.

use std::time::{Duration, Instant};

use instep_ros::Mapping;
use instep_ros::form::{Dynamic, Form2026};
use instep_ros::msg::{Header, JointCommand, Kick2026Goal, KickGoal, KickResult, Quaternion, Vector3};
use ros2_client::action::GoalStatusEnum;
use ros2_client::action_msgs::CancelGoalResponseEnum;
use ros2_client::{MessageTypeName, Name};

use crate::support::{self, Client};

pub(crate) fn goal() -> KickGoal {
    KickGoal {
        header: Header { frame_id: "base_footprint".into(), ..Header::default() },
        ball_position: Vector3 { x: 0.2, y: -0.05, z: 0.0 },
        kick_direction: Quaternion { w: 1.0, ..Quaternion::default() },
        kick_speed: 0.7,
        unstable: false,
    }
}

/// Not a bar, which is for an idle machine, but what a loaded one must reach as well: a goal is answered with a command
/// before a person would notice.
#[test]
fn the_first_command_follows_the_goal_and_a_cancel_is_honoured() {
    let domain = 63;
    let robot = support::robot();
    let simulation = support::simulation(&robot, true);
    let (node, _) = support::node::<Dynamic>(&robot, domain, Mapping::Enhanced, Some(simulation));
    let mut client = Client::<Dynamic>::new(domain);
    let kind = MessageTypeName::new("bitbots_msgs", "JointCommand");
    let qos = support::reliable(1000);
    let topic = client.node.create_topic(&Name::new("/", "kick_motor_goals").unwrap(), kind, &qos).unwrap();
    let commands = client.node.create_subscription::<JointCommand>(&topic, Some(qos)).unwrap();
    let mut first = Vec::new();
    for i in 0..8 {
        let start = Instant::now();
        let (id, accepted) = client.send(&goal());
        assert!(accepted, "kick {i}");
        support::within(5.0, "a command", || commands.take().unwrap());
        first.push(start.elapsed().as_secs_f64());
        let answer = client.cancel(id);
        assert_eq!((answer.return_code, answer.goals_canceling.len()), (CancelGoalResponseEnum::None, 1));
        assert_eq!(client.end(id), (GoalStatusEnum::Canceled, KickResult::ABORTED));
        std::thread::sleep(Duration::from_millis(20));
        while commands.take().unwrap().is_some() {}
    }
    let report = node.stop().unwrap();
    println!("goal to first command at the client, s: {first:?}\n{report:#?}");
    assert_eq!((report.wire.counts.accepted, report.wire.counts.canceled), (8, 8));
    // The first of a client's goals waits for discovery.
    assert!(first[1..].iter().all(|&time| time < 0.5), "{first:?}");
}

#[test]
fn the_form_of_2026_kicks_the_ball_that_tf_knows() {
    let domain = 64;
    let robot = support::robot();
    let (node, lines) =
        support::node::<Form2026>(&robot, domain, Mapping::Enhanced, Some(support::simulation(&robot, false)));
    let client = Client::<Form2026>::new(domain);
    let goal = Kick2026Goal { x: 1.0, y: 0.0, strength: 2.0, timeout: -1.0 };
    let (id, accepted) = client.send(&goal);
    assert!(accepted, "{:?}", lines.lock().unwrap());
    assert_eq!(client.end(id), (GoalStatusEnum::Succeeded, KickResult::SUCCESS), "{:?}", lines.lock().unwrap());
    let mut remaining = Vec::new();
    while let Ok(Some(feedback)) = client.action.receive_feedback(id) {
        remaining.push(feedback.time_remaining);
    }
    assert!(remaining.len() > 10 && remaining.is_sorted_by(|a, b| a >= b), "{remaining:?}");
    let (_, accepted) = client.send(&Kick2026Goal { strength: 9.0, ..goal });
    assert!(!accepted);
    assert!(lines.lock().unwrap().iter().any(|line| line.contains("expected a number from 1 to 5")));
    node.stop().unwrap();
}
