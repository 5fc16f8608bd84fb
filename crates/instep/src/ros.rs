//! `instep ros`: the kick as a ROS 2 action, for a real robot or a simulated one, until it is interrupted.

use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use instep_bench::Subject;
use instep_ros::form::{Dynamic, Form2026};
use instep_ros::{Level, Mapping, Network, Node, Report, Settings, Simulation};

use crate::failure::Failure;
use crate::interrupt::stopped_by_the_user;
use crate::kick::point;
use crate::output::Output;
use crate::places;

/// How long a sensor of a real robot may be silent before the foot is brought down, s.
const PATIENCE: f64 = 0.1;
/// Physics step while the ball is near, s: coarser than a measurement needs, so that the world keeps up with time.
const NEAR_STEP: f64 = 0.0005;

/// The arguments of `instep ros`.
#[derive(Debug, Args)]
pub(crate) struct Ros {
    /// The robot: a name, or the path of its folder or robot.toml
    #[arg(long, value_name = "ROBOT")]
    robot: String,
    /// The engine that kicks (dynamic, dynamic-open)
    #[arg(long, value_name = "ENGINE", default_value = "dynamic")]
    engine: String,
    /// Put a simulated robot in the place of the real one
    #[arg(long)]
    simulate: bool,
    /// With --simulate: where the ball is put before each kick, in metres: x ahead of the robot, y to its left
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = point, requires = "simulate", default_value = "0.2,-0.05")]
    ball: [f64; 2],
    /// With --simulate: seed of all sensor noise
    #[arg(long, requires = "simulate", default_value_t = 1)]
    seed: u64,
    /// Layout of bitbots_msgs/action/Kick: as in paper 2's engine, or as of 2026
    #[arg(long, value_enum, default_value_t = Layout::Dynamic)]
    form: Layout,
    /// ROS domain [default: ROS_DOMAIN_ID, or 0]
    #[arg(long, value_name = "NUMBER")]
    domain: Option<u16>,
    /// The middleware of the peers [default: RMW_IMPLEMENTATION, or rmw_fastrtps_cpp]
    #[arg(long, value_name = "RMW")]
    rmw: Option<String>,
    /// Speak to every network that this machine is in; without it nothing leaves the machine
    #[arg(long)]
    lan: bool,
    /// End after so many seconds [default: when interrupted]
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,
}

/// Layout of the action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Layout {
    /// Header, ball, direction, foot speed, unstable
    Dynamic,
    /// Direction, strength, timeout
    #[value(name = "2026")]
    Of2026,
}

impl Ros {
    /// Runs the node until it is interrupted or its time is over.
    ///
    /// # Errors
    /// When something handed in cannot be used, or the network or the system refuses.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        let duration = self.duration.map(Duration::try_from_secs_f64).transpose();
        let duration = duration.map_err(|e| Failure::input(format!("--duration: {e}; expected seconds above 0")))?;
        let domain = match self.domain {
            Some(domain) => domain,
            None => from_environment("ROS_DOMAIN_ID", "0")?,
        };
        let mapping = mapping(self.rmw.clone())?;
        let subject = Subject::of(places::robot(&self.robot)?)?;
        let engines = [subject.engine(&self.engine)?, subject.engine(&self.engine)?];
        let mut world = subject.world();
        world.step.near = NEAR_STEP;
        let simulation = self.simulate.then_some(Simulation { world, ball: self.ball, seed: self.seed, paced: true });
        let network = if self.lan { Network::Lan } else { Network::Loopback };
        let settings = Settings { domain, network, mapping, simulation, patience: PATIENCE };

        let aside = *output;
        let print = Box::new(move |level: Level, line: &str| {
            aside.remark(|paint| match level {
                Level::Info => line.to_owned(),
                Level::Warn => paint.warn(line),
            });
        });
        let node = match self.form {
            Layout::Dynamic => Node::start::<Dynamic>(&subject.robot, engines, &settings, print)?,
            Layout::Of2026 => Node::start::<Form2026>(&subject.robot, engines, &settings, print)?,
        };
        let stop = stopped_by_the_user();
        output.remark(|_| {
            let whom = if self.lan { "every network of this machine" } else { "this machine only" };
            let what = if self.simulate { "simulated" } else { "real" };
            format!(
                "/dynamic_kick (bitbots_msgs/action/Kick) on domain {domain}, {whom}: {what} {}",
                subject.robot.title
            )
        });
        if let Some(why) = node.unfenced() {
            output.remark(|paint| {
                paint.warn(&format!("packets from other machines are read, though never answered: {why}"))
            });
        }
        let start = Instant::now();
        while node.is_running()
            && !stop.load(Ordering::Relaxed)
            && duration.is_none_or(|duration| start.elapsed() < duration)
        {
            std::thread::sleep(Duration::from_millis(20));
        }
        let report = node.stop()?;
        output.show(&report, |_| text(&report))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// The number that an environment variable gives.
fn from_environment(name: &str, usual: &str) -> Result<u16, Failure> {
    let text = std::env::var(name).unwrap_or_else(|_| usual.to_owned());
    text.trim().parse().map_err(|_| Failure::input(format!("{name}: \"{text}\"; expected a ROS domain, 0 to 232")))
}

/// The service mapping of a ROS middleware.
fn mapping(rmw: Option<String>) -> Result<Mapping, Failure> {
    let rmw = rmw.or_else(|| std::env::var("RMW_IMPLEMENTATION").ok()).unwrap_or_default();
    match rmw.as_str() {
        "" | "rmw_fastrtps_cpp" | "rmw_fastrtps_dynamic_cpp" => Ok(Mapping::Enhanced),
        "rmw_cyclonedds_cpp" => Ok(Mapping::Cyclone),
        other => {
            let expected = "expected rmw_fastrtps_cpp or rmw_cyclonedds_cpp (--rmw or RMW_IMPLEMENTATION)";
            Err(Failure::input(format!("{other}: this middleware is not supported; {expected}")))
        }
    }
}

/// The report for people.
fn text(report: &Report) -> String {
    let (control, wire, counts) = (&report.control, &report.wire, &report.wire.counts);
    let ms = |seconds: f64| format!("{:.2} ms", seconds * 1e3);
    let times = |q: &instep_ros::Quantiles| format!("p50 {}, p99 {}, longest {}", ms(q.p50), ms(q.p99), ms(q.max));
    format!(
        "goals: {} kicks ({} succeeded, {} canceled), {} unreachable, {} rejected\n\
         control loop: {} rounds of {}, {} overruns; jitter {}{}\n\
         commands: {}; jitter {}\n\
         goal to first command: {}\n\
         messages not sent {}, not decodable {}\n",
        counts.accepted,
        counts.succeeded,
        counts.canceled,
        counts.unreachable,
        counts.rejected,
        control.rounds,
        ms(control.period),
        control.overruns,
        times(&control.jitter),
        if control.realtime { "" } else { " (no real-time priority)" },
        counts.commands,
        times(&wire.jitter),
        times(&wire.first_command),
        counts.unsent,
        counts.undecodable,
    )
}
