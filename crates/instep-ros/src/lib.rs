//! The kick as a ROS 2 action, spoken over DDS without a ROS installation. The only crate that names ROS.
//!
//! - [`msg`]: the messages as they lie in CDR; [`form`]: the two layouts of the action, and what a goal means.
//! - [`tf`]: where the goal's frame is; [`goals`]: the goals as their clients see them.
//! - [`Node`]: two threads. One controls: it ticks the engine at its rate, whatever the network does, and meets the
//!   other through bounded queues. The other speaks to the network: it plans goals with a second engine, so that a plan
//!   costs the control loop nothing, and publishes.
//!
//! How a goal ends:
//!
//! | cause | answer to the goal | state of the goal | result |
//! |---|---|---|---|
//! | malformed, frame unknown, a kick is under way, sensors silent, robot not standing | rejected, log line | none (0) | REJECTED |
//! | no foot can do it | accepted | aborted (6) | UNREACHABLE |
//! | done, the robot stands | accepted | succeeded (4) | SUCCESS |
//! | cancelled by a client | accepted | canceled (5) | ABORTED |
//! | the robot fell, sensors stopped, node ended | accepted | aborted (6) | ABORTED |
//!
//! By default nothing leaves the machine and nothing comes in from outside ([`Network::Loopback`]).

mod answers;
mod body;
mod control;
mod endpoints;
mod error;
mod fence;
pub mod form;
pub mod goals;
mod histogram;
mod log;
pub mod msg;
mod node;
mod priority;
mod simulated;
pub mod tf;
mod wire;

pub use control::{Engine, LoopReport};
pub use error::RosError;
pub use histogram::Quantiles;
pub use log::{Level, Print};
pub use node::{Counts, Mapping, Network, Node, Report, Settings, Simulation, WireReport};
