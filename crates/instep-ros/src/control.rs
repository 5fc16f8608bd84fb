//! The control loop: its own thread, at its rate whatever the network does.
//!
//! Engines are ticked at the period they ask for, 8 ms for a Wolfgang-OP; commands go out at least every 2 ms, as paper
//! 2's node sent them. Between two ticks the target moves on along the planned speeds: an engine's target is meant for
//! the middle of its period.
//!
//! It meets the rest of the node through bounded queues and nothing else: orders come in, frames go out, and it never
//! waits for either. A frame that finds no room is dropped and counted. Engines are planned elsewhere and handed over
//! ready; the old one is handed back. Nothing here allocates in a tick. The watchdog is here: when sensors stop during
//! a kick, the engine gives the kick up, which brings the foot down, and goes on as though the robot were level.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use instep_kick::{KickEngine, KickStatus, Phase, Progress};
use instep_robot::control::{JointCommand, Sensors};
use serde::Serialize;

use crate::body::{Body, Freshness, Whereabouts, copy, fallen};
use crate::histogram::{Histogram, Quantiles};
use crate::priority::Priority;

/// Commands go out at least this often, s.
const COMMANDS: f64 = 0.002;
/// How long the loop goes on after a stop to bring the foot down, s.
const LAST: f64 = 5.0;

/// An engine that can be handed from thread to thread.
pub type Engine = Box<dyn KickEngine + Send>;

/// What the loop is told.
pub(crate) enum Order {
    /// Carry out what this engine has planned, as kick `number`.
    Start { number: u64, engine: Engine },
    /// Give kick `number` up.
    Cancel { number: u64 },
}

/// What went wrong in a kick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trouble {
    /// This sensor went silent.
    Silent(&'static str),
    /// The robot fell.
    Fell,
}

/// What the loop tells after each tick.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    /// The kick that is or was under way; 0 before the first.
    pub(crate) number: u64,
    /// When the command was ready.
    pub(crate) at: Instant,
    /// The same, ns since 1970.
    pub(crate) stamp: i64,
    /// Joint targets, rad.
    pub(crate) positions: Vec<f64>,
    /// How far the kick is.
    pub(crate) progress: Progress,
    /// What the engine saw.
    pub(crate) sensors: Sensors,
    /// Whether that can be used.
    pub(crate) freshness: Freshness,
    /// The first thing that went wrong in this kick.
    pub(crate) trouble: Option<Trouble>,
    /// Where everything is, if simulated.
    pub(crate) whereabouts: Option<Whereabouts>,
}

impl Frame {
    pub(crate) fn new(joints: usize) -> Self {
        let progress =
            Progress { status: KickStatus::Idle, phase: Phase::Stand, done: 0.0, to_contact: None, foot: None };
        Self {
            number: 0,
            at: Instant::now(),
            stamp: 0,
            positions: vec![0.0; joints],
            progress,
            sensors: Sensors::default(),
            freshness: Freshness::Silent("any sensor"),
            trouble: None,
            whereabouts: None,
        }
    }

    /// Whether a kick is under way.
    pub(crate) fn running(&self) -> bool {
        running(self.progress.status)
    }
}

fn running(status: KickStatus) -> bool {
    matches!(status, KickStatus::Running | KickStatus::Holding | KickStatus::Cancelling)
}

/// The loop's ends of the queues. The wire ends when they are dropped.
pub(crate) struct Links {
    pub(crate) orders: Receiver<Order>,
    pub(crate) returned: SyncSender<Engine>,
    pub(crate) full: SyncSender<Box<Frame>>,
    pub(crate) empty: Receiver<Box<Frame>>,
    /// Tells the wire's thread that there is a frame.
    pub(crate) wake: Box<dyn Fn() + Send>,
    pub(crate) stop: Arc<AtomicBool>,
}

/// What the loop measured of itself.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct LoopReport {
    /// Rounds, each with a command.
    pub rounds: u64,
    /// Time from round to round as planned, s.
    pub period: f64,
    /// How late each round began, s.
    pub lateness: Quantiles,
    /// How far the time between rounds was from the period, s.
    pub jitter: Quantiles,
    /// Rounds that came a whole period or more too late; the plan goes on from there, later.
    pub overruns: u64,
    /// Frames that found no room.
    pub dropped: u64,
    /// Whether the system gave the thread real-time priority.
    pub realtime: bool,
}

/// In how many rounds an engine's period (s) is divided.
pub(crate) fn rounds_per_tick(period: f64) -> u32 {
    // The cast saturates; a rounding error must not cost a round.
    ((period / COMMANDS - 1e-6).ceil() as u32).max(1)
}

/// Runs until told to stop, and then until the robot stands. `paced`: in real time; otherwise as fast as frames are
/// taken away.
pub(crate) fn run(
    mut engine: Engine,
    mut body: Box<dyn Body>,
    joints: usize,
    links: &Links,
    paced: bool,
) -> LoopReport {
    let realtime = paced && crate::priority::raise(Priority::Control);
    let rounds = rounds_per_tick(engine.control_period());
    let dt = engine.control_period() / f64::from(rounds);
    let period = Duration::from_secs_f64(dt);
    // The next round of the engine's period.
    let mut round = 0;
    let (mut lateness, mut jitter) = (Histogram::new(), Histogram::new());
    let mut report = LoopReport { realtime, period: dt, ..LoopReport::default() };
    let mut sensors = Sensors::default();
    let mut command = JointCommand::zeros(joints);
    let (mut number, mut trouble, mut stop_at) = (0, None, None);
    let (mut next, mut last) = (Instant::now(), None);
    loop {
        if paced {
            let now = Instant::now();
            if next > now {
                std::thread::sleep(next - now);
            }
            let now = Instant::now();
            let late = now.saturating_duration_since(next);
            lateness.record(late.as_secs_f64());
            if let Some(last) = last.replace(now) {
                jitter.record((now.saturating_duration_since(last).as_secs_f64() - dt).abs());
            }
            next += period;
            if late >= period {
                report.overruns += 1;
                next = now + period;
            }
        }
        loop {
            match links.orders.try_recv() {
                Ok(Order::Start { number: new, engine: planned }) => {
                    body.prepare();
                    let old = std::mem::replace(&mut engine, planned);
                    (number, trouble, round) = (new, None, 0);
                    // There is room for both engines.
                    let _ = links.returned.try_send(old);
                }
                Ok(Order::Cancel { number: which }) if which == number => engine.cancel(),
                Ok(Order::Cancel { .. }) => {}
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => break,
            }
        }
        if stop_at.is_none() && links.stop.load(Ordering::Relaxed) {
            stop_at = Some(report.rounds);
            engine.cancel();
        }

        let freshness = body.sense(&mut sensors);
        sensors.time = report.rounds as f64 * dt;
        let under_way = running(engine.progress().status);
        let wrong = match freshness {
            Freshness::Silent(sensor) => Some(Trouble::Silent(sensor)),
            Freshness::Fresh if fallen(sensors.orientation) => Some(Trouble::Fell),
            Freshness::Fresh => None,
        };
        if under_way && trouble.is_none() && wrong.is_some() {
            trouble = wrong;
            engine.cancel();
        }
        if freshness != Freshness::Fresh {
            // Old readings would be fed back forever; the plan alone is better.
            sensors.orientation = [1.0, 0.0, 0.0, 0.0];
            sensors.gyro = [0.0; 3];
            sensors.centre_of_pressure = [None; 2];
            sensors.contact_forces.fill(0.0);
            sensors.ball = None;
        }
        if round == 0 {
            engine.tick(&sensors, &mut command);
        }
        // The middle of this round, from the middle of the engine's period.
        let ahead = (f64::from(round) + 0.5 - 0.5 * f64::from(rounds)) * dt;
        round = (round + 1) % rounds;
        report.rounds += 1;

        let progress = engine.progress();
        let free = if paced { links.empty.try_recv().ok() } else { links.empty.recv().ok() };
        match free {
            Some(mut frame) => {
                frame.number = number;
                frame.at = Instant::now();
                frame.stamp = wall_clock();
                for ((to, position), speed) in
                    frame.positions.iter_mut().zip(&command.positions).zip(&command.velocities)
                {
                    *to = position + ahead * speed;
                }
                frame.progress = progress;
                copy(&sensors, &mut frame.sensors);
                frame.freshness = freshness;
                frame.trouble = trouble;
                frame.whereabouts = body.whereabouts();
                // As many places as frames: there is always room.
                let _ = links.full.try_send(frame);
                (links.wake)();
            }
            None => report.dropped += 1,
        }
        body.act(&command);
        let overtime = stop_at.is_some_and(|at| (report.rounds - at) as f64 * dt > LAST);
        if stop_at.is_some() && (overtime || !running(progress.status)) {
            break;
        }
    }
    report.lateness = lateness.quantiles();
    report.jitter = jitter.quantiles();
    report
}

/// ns since 1970.
pub(crate) fn wall_clock() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}
