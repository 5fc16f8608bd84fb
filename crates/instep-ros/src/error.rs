//! Why the node cannot be started.

use instep_sim::SimError;

/// What keeps the node from running.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// A domain that DDS has no ports for.
    #[error("ROS domain {found}; expected 0 to {most} (ROS_DOMAIN_ID or --domain)")]
    Domain {
        /// As asked.
        found: u16,
        /// The greatest one.
        most: u16,
    },
    /// The network refused the node.
    #[error("ROS domain {domain}: the node cannot be joined to the network: {detail}")]
    Network {
        /// The domain.
        domain: u16,
        /// What DDS said.
        detail: String,
    },
    /// One of the node's topics or services cannot be made.
    #[error("{name}: this topic or service cannot be made: {detail}")]
    Endpoint {
        /// Its ROS name.
        name: &'static str,
        /// What DDS said.
        detail: String,
    },
    /// The simulated robot cannot be made.
    #[error(transparent)]
    World(#[from] SimError),
    /// The system gave no thread or no event queue.
    #[error("the system refused a thread or an event queue: {0}")]
    System(#[from] std::io::Error),
}
