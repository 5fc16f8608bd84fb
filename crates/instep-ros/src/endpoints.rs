//! The node's topics and its action on the network: names, types and qualities of service as ROS 2 has them.
//!
//! Names of topics and action are those of paper 2's node (facts/kick-interfaces.md, A).

use std::net::Ipv4Addr;

use ros2_client::action::ActionServerQosPolicies;
use ros2_client::dds::rustdds::DomainParticipantBuilder;
use ros2_client::dds::{ActionServer, Context, Node, Publisher, ServiceMapping, Subscription};
use ros2_client::qos::{Durability, History, WhenFull};
use ros2_client::{ActionTypeName, Message, MessageTypeName, Name, NodeName, NodeOptions, QosProfile};

use crate::error::RosError;
use crate::form::Form;
use crate::msg::{Imu, JointCommand, JointState, KickResult, PointStamped, SupportState, TfMessage};
use crate::node::{Mapping, Network};

/// The greatest domain: above it the ports would end (RTPS 2.5, section 9.6.2.3).
const LAST_DOMAIN: u16 = 232;
/// Name of the action.
const ACTION: &str = "dynamic_kick";
/// Samples that a service or a feedback keeps for a slow peer.
const DEPTH: usize = 16;

/// Everything that the node offers and listens to.
pub(crate) struct Endpoints<F: Form> {
    pub(crate) node: Node,
    pub(crate) action: ActionServer<F::Goal, KickResult, F::Feedback>,
    pub(crate) commands: Publisher<JointCommand>,
    pub(crate) support: Publisher<SupportState>,
    pub(crate) tf: Subscription<TfMessage>,
    pub(crate) tf_static: Subscription<TfMessage>,
    /// Of a real robot.
    pub(crate) sensors: Option<SensorTopics>,
    /// Of a simulated one.
    pub(crate) simulated: Option<SimulatedTopics>,
}

/// What a real robot tells.
pub(crate) struct SensorTopics {
    pub(crate) joints: Subscription<JointState>,
    pub(crate) imu: Subscription<Imu>,
    /// Left and right.
    pub(crate) pressure: [Subscription<PointStamped>; 2],
}

/// What the simulated robot tells, for viewers.
pub(crate) struct SimulatedTopics {
    pub(crate) joints: Publisher<JointState>,
    pub(crate) tf: Publisher<TfMessage>,
}

/// Delivered for sure, but never waiting for a slow reader.
fn reliable(depth: usize) -> QosProfile {
    QosProfile::default().reliability_reliable(WhenFull::Fail).history(History::KeepLast { depth })
}

/// Whatever comes; matches publishers of either kind.
fn sensor() -> QosProfile {
    QosProfile::default().reliability_best_effort().history(History::KeepLast { depth: 5 })
}

/// Kept for those who come later.
fn latched(depth: usize) -> QosProfile {
    reliable(depth).durability(Durability::TransientLocal)
}

impl<F: Form> Endpoints<F> {
    /// Joins the domain.
    ///
    /// # Errors
    /// When the domain cannot be joined, or an endpoint is refused.
    pub(crate) fn new(domain: u16, network: Network, mapping: Mapping, simulated: bool) -> Result<Self, RosError> {
        if domain > LAST_DOMAIN {
            return Err(RosError::Domain { found: domain, most: LAST_DOMAIN });
        }
        let refused = |detail: String| RosError::Network { domain, detail };
        let builder = DomainParticipantBuilder::new(domain);
        let builder = match network {
            Network::Loopback => builder.with_only_networks([Ipv4Addr::LOCALHOST]),
            Network::Lan => builder,
        };
        let participant = builder.build().map_err(|e| refused(e.to_string()))?;
        let context = Context::from_domain_participant(participant).map_err(|e| refused(e.to_string()))?;
        let name = NodeName::new("/", "instep").map_err(|e| refused(e.to_string()))?;
        let options = NodeOptions::new().start_parameter_services(false);
        let mut node = context.new_node(name, options).map_err(|e| refused(format!("{e:?}")))?;

        let action = ros_name(ACTION)?;
        let services = reliable(DEPTH).reliability_reliable(WhenFull::Wait(std::time::Duration::from_millis(20)));
        let action = node
            .create_action_server(
                match mapping {
                    Mapping::Enhanced => ServiceMapping::Enhanced,
                    Mapping::Cyclone => ServiceMapping::Cyclone,
                },
                &action,
                &ActionTypeName::new("bitbots_msgs", "Kick"),
                ActionServerQosPolicies {
                    goal_service: services.clone(),
                    result_service: services.clone(),
                    cancel_service: services,
                    feedback_publisher: reliable(DEPTH),
                    status_publisher: latched(1),
                },
            )
            .map_err(|e| RosError::Endpoint { name: ACTION, detail: e.to_string() })?;
        let mut make = Maker { node: &mut node };
        Ok(Self {
            action,
            commands: make.publisher("kick_motor_goals", "bitbots_msgs", "JointCommand", reliable(10))?,
            support: make.publisher("dynamic_kick_support_state", "biped_interfaces", "Phase", reliable(10))?,
            tf: make.subscription("tf", "tf2_msgs", "TFMessage", reliable(100))?,
            tf_static: make.subscription("tf_static", "tf2_msgs", "TFMessage", latched(100))?,
            sensors: match simulated {
                true => None,
                false => Some(SensorTopics {
                    joints: make.subscription("joint_states", "sensor_msgs", "JointState", sensor())?,
                    imu: make.subscription("imu/data", "sensor_msgs", "Imu", sensor())?,
                    pressure: [
                        make.subscription("cop_l", "geometry_msgs", "PointStamped", sensor())?,
                        make.subscription("cop_r", "geometry_msgs", "PointStamped", sensor())?,
                    ],
                }),
            },
            simulated: match simulated {
                false => None,
                true => Some(SimulatedTopics {
                    joints: make.publisher("joint_states", "sensor_msgs", "JointState", reliable(10))?,
                    tf: make.publisher("tf", "tf2_msgs", "TFMessage", reliable(DEPTH))?,
                }),
            },
            node,
        })
    }
}

fn ros_name(name: &'static str) -> Result<Name, RosError> {
    Name::parse(&format!("/{name}")).map_err(|e| RosError::Endpoint { name, detail: e.to_string() })
}

/// Makes topics in one node.
struct Maker<'a> {
    node: &'a mut Node,
}

impl Maker<'_> {
    fn publisher<M: Message>(
        &mut self,
        name: &'static str,
        package: &str,
        kind: &str,
        qos: QosProfile,
    ) -> Result<Publisher<M>, RosError> {
        let refused = |e: ros2_client::CreateError| RosError::Endpoint { name, detail: e.to_string() };
        let topic =
            self.node.create_topic(&ros_name(name)?, MessageTypeName::new(package, kind), &qos).map_err(refused)?;
        self.node.create_publisher(&topic, Some(qos)).map_err(refused)
    }

    fn subscription<M: Message + 'static>(
        &mut self,
        name: &'static str,
        package: &str,
        kind: &str,
        qos: QosProfile,
    ) -> Result<Subscription<M>, RosError> {
        let refused = |e: ros2_client::CreateError| RosError::Endpoint { name, detail: e.to_string() };
        let topic =
            self.node.create_topic(&ros_name(name)?, MessageTypeName::new(package, kind), &qos).map_err(refused)?;
        self.node.create_subscription(&topic, Some(qos)).map_err(refused)
    }
}
