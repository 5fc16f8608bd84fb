//! The node from outside: its clients, its robot and its enemies. Everything runs over the loopback interface, each
//! test in a ROS domain of its own.

mod client;
mod cyclone;
mod decode;
mod interfaces;
mod soak;
mod support;
mod watchdog;
