//! The node: what it is told, its two threads, and its report.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use instep_robot::Robot;
use instep_sim::settings::WorldSettings;
use ros2_client::dds::rustdds::mio1::{Poll, Token, Waker};
use serde::Serialize;

use crate::body::{Body, Inbox, RosBody};
use crate::control::{self, Engine, Frame, Links, LoopReport};
use crate::endpoints::Endpoints;
use crate::error::RosError;
use crate::fence;
use crate::form::Form;
use crate::histogram::Quantiles;
use crate::log::{Log, Print};
use crate::priority::{self, Priority};
use crate::simulated::SimBody;
use crate::wire::{State, Wire};

/// Frames between the threads: 128 ms at 500 Hz.
const FRAMES: usize = 64;
/// Orders that may be under way; the control loop reads them every tick.
const ORDERS: usize = 16;
/// Token of the control loop's wake-up; the endpoints' count from 1.
const WAKE: Token = Token(0);

/// Whom the node speaks to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Network {
    /// This machine alone: nothing leaves it, nothing from outside is read.
    Loopback,
    /// Every network that the machine is in.
    Lan,
}

/// How services are put into DDS; the ROS middlewares do not agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mapping {
    /// As rmw_fastrtps, the default of every ROS 2 distribution so far.
    Enhanced,
    /// As rmw_cyclonedds.
    Cyclone,
}

/// A simulated robot in place of a real one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Simulation {
    /// The world's constants.
    pub world: WorldSettings,
    /// Where the ball is put before each kick, m, in the footprint.
    pub ball: [f64; 2],
    /// Seed of sensor noise.
    pub seed: u64,
    /// In real time; otherwise as fast as the machine can, for tests.
    pub paced: bool,
}

/// What a node is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// ROS domain, 0 to 232.
    pub domain: u16,
    /// Whom it speaks to.
    pub network: Network,
    /// How services are put into DDS.
    pub mapping: Mapping,
    /// The simulated robot; `None`: a real one, over ROS.
    pub simulation: Option<Simulation>,
    /// How long a sensor may be silent, s, above 0.
    pub patience: f64,
}

/// What happened to goals and messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Counts {
    /// Goals that became kicks.
    pub accepted: u64,
    /// Goals that were rejected.
    pub rejected: u64,
    /// Goals that no foot can do.
    pub unreachable: u64,
    /// Cancels that were accepted.
    pub cancelled: u64,
    /// Goals that ended so.
    pub succeeded: u64,
    /// Goals that ended so.
    pub canceled: u64,
    /// Goals that ended so, unreachable ones included.
    pub aborted: u64,
    /// Joint commands published.
    pub commands: u64,
    /// Messages that the network did not take.
    pub unsent: u64,
    /// Messages that could not be decoded.
    pub undecodable: u64,
}

/// What the network's side measured.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct WireReport {
    /// From a goal's being read to its first joint command's being sent, s.
    pub first_command: Quantiles,
    /// How far the time between two commands of a kick was from the period, s.
    pub jitter: Quantiles,
    /// Goals and messages.
    pub counts: Counts,
}

/// What a node did, told when it ends.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Report {
    /// The control loop.
    pub control: LoopReport,
    /// The network's side.
    pub wire: WireReport,
}

/// A running node. Dropping it stops it.
pub struct Node {
    stop: Arc<AtomicBool>,
    control: Option<JoinHandle<LoopReport>>,
    wire: Option<JoinHandle<std::io::Result<WireReport>>>,
    /// Why sockets listen beyond the loopback device, if they do.
    unfenced: Option<String>,
}

impl std::fmt::Debug for Node {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Node").field("running", &self.is_running()).finish_non_exhaustive()
    }
}

impl Node {
    /// Starts a node for `robot` that offers the action in the layout `F`. Of the two `engines`, which must be alike, one
    /// controls while the other plans.
    ///
    /// # Errors
    /// When the network, the simulated world or the system refuses.
    pub fn start<F: Form>(
        robot: &Arc<Robot>,
        engines: [Engine; 2],
        settings: &Settings,
        print: Print,
    ) -> Result<Self, RosError> {
        let [controller, planner] = engines;
        let joints = robot.joints.len();
        let period = controller.control_period() / f64::from(control::rounds_per_tick(controller.control_period()));
        let inbox = Arc::new(Mutex::new(Inbox::new(robot)));
        let body: Box<dyn Body> = match &settings.simulation {
            Some(sim) => Box::new(SimBody::new(Arc::clone(robot), &sim.world, sim.ball, period, sim.seed)?),
            None => {
                let patience = Duration::try_from_secs_f64(settings.patience).unwrap_or(Duration::from_millis(100));
                Box::new(RosBody::new(Arc::clone(robot), Arc::clone(&inbox), patience))
            }
        };
        let paced = settings.simulation.as_ref().is_none_or(|sim| sim.paced);
        // The DDS library's own threads inherit what starts them.
        let raised = paced && priority::raise(Priority::Network);
        let ends =
            Endpoints::<F>::new(settings.domain, settings.network, settings.mapping, settings.simulation.is_some());
        if raised {
            priority::lower();
        }
        let ends = ends?;
        let unfenced = match settings.network {
            Network::Loopback => fence::raise(settings.domain).err().map(|e| e.to_string()),
            Network::Lan => None,
        };

        let poll = Poll::new()?;
        let waker = Arc::new(Waker::new(poll.registry(), WAKE)?);
        let (order_in, orders) = sync_channel(ORDERS);
        let (returned_in, returned) = sync_channel(2);
        let (full_in, full) = sync_channel(FRAMES);
        let (empty_in, empty) = sync_channel(FRAMES);
        for _ in 0..FRAMES {
            let _ = empty_in.try_send(Box::new(Frame::new(joints)));
        }
        let stop = Arc::new(AtomicBool::new(false));
        let links = Links {
            orders,
            returned: returned_in,
            full: full_in,
            empty,
            wake: Box::new(move || {
                // The wire looks around without it too, only later.
                let _ = waker.wake();
            }),
            stop: Arc::clone(&stop),
        };
        let log = Log::new(print, ends.node.logging_handle());
        let wire = Wire {
            log,
            ends,
            robot: Arc::clone(robot),
            orders: order_in,
            returned,
            full,
            empty: empty_in,
            inbox,
            planner: Some(planner),
            period,
            state: State::new(robot),
        };
        let thread = |name: &str| std::thread::Builder::new().name(name.into());
        let control = thread("instep-control").spawn(move || control::run(controller, body, joints, &links, paced))?;
        let wire = thread("instep-wire").spawn(move || {
            if paced {
                priority::raise(Priority::Network);
            }
            wire.run(poll)
        })?;
        Ok(Self { stop, control: Some(control), wire: Some(wire), unfenced })
    }

    /// Why packets from the network can be read in spite of [`Network::Loopback`], if they can.
    #[must_use]
    pub fn unfenced(&self) -> Option<&str> {
        self.unfenced.as_deref()
    }

    /// Whether both threads are at work.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.control.as_ref().is_some_and(|thread| !thread.is_finished())
            && self.wire.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Gives up a kick that is under way, waits until the robot stands, ends the node and reports.
    ///
    /// # Errors
    /// When one of the threads failed.
    pub fn stop(mut self) -> Result<Report, RosError> {
        self.stop.store(true, Ordering::Relaxed);
        let failed = |name: &str| RosError::System(std::io::Error::other(format!("the {name} thread failed")));
        let control = self.control.take().map(JoinHandle::join);
        let wire = self.wire.take().map(JoinHandle::join);
        let control = control.and_then(Result::ok).ok_or_else(|| failed("control"))?;
        let wire = wire.and_then(Result::ok).ok_or_else(|| failed("network"))??;
        Ok(Report { control, wire })
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in [self.control.take().map(|t| t.join().is_ok()), self.wire.take().map(|t| t.join().is_ok())] {
            let _ = thread;
        }
    }
}
