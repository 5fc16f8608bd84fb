//! A node with the Wolfgang-OP, and a ROS 2 client made with the same library as the node.

use std::net::Ipv4Addr;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use instep_kick::dynamic::DynamicKick;
use instep_robot::Robot;
use instep_ros::form::Form;
use instep_ros::msg::KickResult;
use instep_ros::{Engine, Level, Mapping, Network, Node, Settings, Simulation};
use instep_sim::settings::{Ball, WorldSettings};
use ros2_client::action::{ActionClientQosPolicies, GoalStatusEnum};
use ros2_client::dds::rustdds::DomainParticipantBuilder;
use ros2_client::dds::{ActionClient, Context, ServiceMapping};
use ros2_client::qos::{Durability, History, WhenFull};
use ros2_client::{ActionTypeName, Name, NodeName, NodeOptions, QosProfile};

/// The lines that a node has said.
pub(crate) type Lines = Arc<Mutex<Vec<String>>>;

pub(crate) fn robot() -> Arc<Robot> {
    Arc::new(
        Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/wolfgang")).unwrap().with_ideal_drives(),
    )
}

/// A simulation of small cost: the ball's impacts are not measured here.
pub(crate) fn simulation(robot: &Arc<Robot>, paced: bool) -> Simulation {
    let dynamic = DynamicKick::load(Arc::clone(robot)).unwrap();
    let ball = *dynamic.ball();
    let mut world = WorldSettings {
        ball: Ball { mass: ball.mass, radius: ball.radius, ..Ball::default() },
        ..WorldSettings::default()
    };
    world.step.near = 0.0005;
    Simulation { world, ball: [0.2, -0.05], seed: 1, paced }
}

/// A node in `domain`, and what it says.
pub(crate) fn node<F: Form>(
    robot: &Arc<Robot>,
    domain: u16,
    mapping: Mapping,
    simulation: Option<Simulation>,
) -> (Node, Lines) {
    let engine = || -> Engine { Box::new(DynamicKick::load(Arc::clone(robot)).unwrap()) };
    let lines = Lines::default();
    let said = Arc::clone(&lines);
    let print = Box::new(move |_: Level, line: &str| said.lock().unwrap().push(line.to_owned()));
    let settings = Settings { domain, network: Network::Loopback, mapping, simulation, patience: 0.1 };
    (Node::start::<F>(robot, [engine(), engine()], &settings, print).unwrap(), lines)
}

pub(crate) fn reliable(depth: usize) -> QosProfile {
    QosProfile::default()
        .reliability_reliable(WhenFull::Wait(Duration::from_millis(100)))
        .history(History::KeepLast { depth })
}

/// A ROS 2 node of a client's.
pub(crate) fn peer(domain: u16, name: &str) -> ros2_client::dds::Node {
    let participant = DomainParticipantBuilder::new(domain).with_only_networks([Ipv4Addr::LOCALHOST]).build().unwrap();
    let context = Context::from_domain_participant(participant).unwrap();
    let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
    context.new_node(NodeName::new("/", name).unwrap(), options).unwrap()
}

/// A client of the action.
pub(crate) struct Client<F: Form> {
    pub(crate) node: ros2_client::dds::Node,
    pub(crate) action: ActionClient<F::Goal, KickResult, F::Feedback>,
}

/// The first answer within `seconds`.
pub(crate) fn within<T>(seconds: f64, what: &str, mut attempt: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < seconds {
        if let Some(answer) = attempt() {
            return answer;
        }
        std::thread::sleep(Duration::from_micros(200));
    }
    panic!("{what}: nothing in {seconds} s");
}

impl<F: Form> Client<F> {
    pub(crate) fn new(domain: u16) -> Self {
        let mut node = peer(domain, "client");
        let qos = ActionClientQosPolicies {
            goal_service: reliable(16),
            result_service: reliable(16),
            cancel_service: reliable(16),
            feedback_subscription: reliable(200),
            status_subscription: reliable(1).durability(Durability::TransientLocal),
        };
        let action = node
            .create_action_client(
                ServiceMapping::Enhanced,
                &Name::new("/", "dynamic_kick").unwrap(),
                &ActionTypeName::new("bitbots_msgs", "Kick"),
                qos,
            )
            .unwrap();
        Self { node, action }
    }

    /// Sends a goal; gives its identity and whether it was accepted. The first goals of a client may be lost while
    /// both sides discover each other; then it is sent again.
    pub(crate) fn send(&self, goal: &F::Goal) -> (ros2_client::action::GoalId, bool) {
        for _ in 0..20 {
            let (request, id) = self.action.send_goal(goal.clone()).unwrap();
            let start = Instant::now();
            while start.elapsed() < Duration::from_secs(2) {
                if let Some(answer) = self.action.receive_goal_response(request).unwrap() {
                    return (id, answer.accepted);
                }
                std::thread::sleep(Duration::from_micros(200));
            }
        }
        panic!("no answer to a goal");
    }

    /// State and result of a goal at its end.
    pub(crate) fn end(&self, id: ros2_client::action::GoalId) -> (GoalStatusEnum, u8) {
        let request = self.action.request_result(id).unwrap();
        let (status, result) = within(30.0, "a result", || self.action.receive_result(request).unwrap());
        (status, result.result)
    }

    /// Cancels a goal.
    pub(crate) fn cancel(&self, id: ros2_client::action::GoalId) -> ros2_client::action::CancelGoalResponse {
        let request = self.action.cancel_goal(id).unwrap();
        within(5.0, "an answer to a cancel", || self.action.receive_cancel_response(request).unwrap())
    }
}
