//! The network's side of the node, one thread: answers the action's clients, takes in sensors and TF, plans goals, and
//! publishes what the control loop hands out. It may be slow or blocked without the control loop's noticing.
//!
//! The action server is polled on raw services: the library's own does not answer for goals that are over
//! (facts/ros2-without-ros.md, section 1). Which refusals end how is said in [`crate`].

use std::collections::HashMap;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use instep_kick::{KickPlan, KickStatus, Phase, Refusal};
use instep_motion::phase::Side;
use instep_robot::Robot;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use ros2_client::action::{GetResultResponse, GoalStatusEnum, SendGoalResponse};
use ros2_client::action_msgs::{CancelGoalResponse, CancelGoalResponseEnum, GoalStatus, GoalStatusArray};
use ros2_client::builtin_interfaces::Time as RosTime;
use ros2_client::dds::Subscription;
use ros2_client::dds::rustdds::mio1::{Events, Interest, Poll, Token};
use ros2_client::{ReadError, RmwRequestId};

use crate::answers::{CancelAsked, cancel_asked, ros_id, ros_info, ros_state};
use crate::body::{Freshness, Inbox, fallen};
use crate::control::{Engine, Frame, Order, Trouble, wall_clock};
use crate::endpoints::Endpoints;
use crate::form::{BALL, FOOTPRINT, Form, percent};
use crate::goals::{CancelCode, Goal, GoalId, GoalState, Goals, ResultAnswer};
use crate::histogram::Histogram;
use crate::log::Log;
use crate::msg::{
    Header, JointCommand, JointState, KickResult, PointStamped, Quaternion as RosQuaternion, SupportState, TfMessage,
    Time, Transform, TransformStamped, Vector3 as RosVector3,
};
use crate::node::{Counts, WireReport};
use crate::tf::TfBuffer;

/// Messages of one topic that are taken in a turn, so that a flood of one kind does not starve the others.
const TURN: usize = 64;
/// The thread looks around at least this often.
const IDLE: Duration = Duration::from_millis(10);
/// What the simulated robot tells is told once in so many frames.
const SHOWN: u64 = 10;
/// The base link's frame in TF (REP 105).
const BASE: &str = "base_link";
/// The simulated world's frame.
const WORLD: &str = "odom";

/// The kick that is under way for the action's client.
struct Kick {
    number: u64,
    plan: KickPlan,
    /// When its goal was read, until its first command is out.
    asked: Option<Instant>,
    last_command: Option<Instant>,
    percent: Option<u8>,
}

/// The wire's ends of the queues, and what it is made of.
pub(crate) struct Wire<F: Form> {
    pub(crate) ends: Endpoints<F>,
    pub(crate) robot: Arc<Robot>,
    pub(crate) log: Log,
    pub(crate) orders: SyncSender<Order>,
    pub(crate) returned: Receiver<Engine>,
    pub(crate) full: Receiver<Box<Frame>>,
    pub(crate) empty: SyncSender<Box<Frame>>,
    pub(crate) inbox: Arc<Mutex<Inbox>>,
    /// The engine that plans while the other controls.
    pub(crate) planner: Option<Engine>,
    /// s
    pub(crate) period: f64,
    pub(crate) state: State,
}

/// What the wire keeps in mind.
pub(crate) struct State {
    tf: TfBuffer,
    goals: Goals<RmwRequestId>,
    kick: Option<Kick>,
    number: u64,
    /// The newest frame.
    frame: Option<Box<Frame>>,
    frames: u64,
    joint_of: HashMap<String, usize>,
    first_command: Histogram,
    jitter: Histogram,
    counts: Counts,
}

impl State {
    pub(crate) fn new(robot: &Robot) -> Self {
        Self {
            tf: TfBuffer::default(),
            goals: Goals::default(),
            kick: None,
            number: 0,
            frame: None,
            frames: 0,
            joint_of: robot.joints.iter().enumerate().map(|(i, joint)| (joint.name.clone(), i)).collect(),
            first_command: Histogram::new(),
            jitter: Histogram::new(),
            counts: Counts::default(),
        }
    }
}

impl<F: Form> Wire<F> {
    /// Runs until the control loop has ended.
    ///
    /// # Errors
    /// When the system's event queue fails.
    pub(crate) fn run(mut self, mut poll: Poll) -> std::io::Result<WireReport> {
        self.register(&poll)?;
        self.publish_status();
        let mut events = Events::with_capacity(64);
        let mut more = false;
        loop {
            let wait = if more { Duration::ZERO } else { IDLE };
            match poll.poll(&mut events, Some(wait)) {
                Err(error) if error.kind() != std::io::ErrorKind::Interrupted => return Err(error),
                _ => {}
            }
            if let Ok(engine) = self.returned.try_recv() {
                self.planner = Some(engine);
            }
            let ended = self.take_frames();
            more = self.take_transforms();
            more |= self.take_sensors();
            self.answer_cancels();
            self.answer_goals();
            self.answer_results();
            if ended {
                break;
            }
        }
        self.end(GoalState::Aborted, KickResult::ABORTED);
        Ok(WireReport {
            first_command: self.state.first_command.quantiles(),
            jitter: self.state.jitter.quantiles(),
            counts: self.state.counts,
        })
    }

    /// Asks for a wake-up by everything that may come in.
    fn register(&mut self, poll: &Poll) -> std::io::Result<()> {
        let mut token = 0;
        let mut add = |source: &mut dyn ros2_client::dds::rustdds::mio1::event::Source| {
            token += 1;
            poll.registry().register(source, Token(token), Interest::READABLE)
        };
        add(self.ends.action.goal_server())?;
        add(self.ends.action.cancel_server())?;
        add(self.ends.action.result_server())?;
        add(&mut self.ends.tf)?;
        add(&mut self.ends.tf_static)?;
        if let Some(sensors) = &mut self.ends.sensors {
            add(&mut sensors.joints)?;
            add(&mut sensors.imu)?;
            for pressure in &mut sensors.pressure {
                add(pressure)?;
            }
        }
        Ok(())
    }

    // From the control loop.

    /// Gives whether the control loop has ended.
    fn take_frames(&mut self) -> bool {
        let mut newest = None;
        // Of a backlog only the newest matters: a late command is a wrong one.
        let ended = loop {
            match self.full.try_recv() {
                Ok(frame) => {
                    self.state.frames += 1;
                    self.give_back(newest.replace(frame));
                }
                Err(TryRecvError::Empty) => break false,
                Err(TryRecvError::Disconnected) => break true,
            }
        };
        let Some(frame) = newest else { return ended };
        self.carry_out(&frame);
        if self.state.frames.is_multiple_of(SHOWN) {
            self.show(&frame);
        }
        let old = self.state.frame.replace(frame);
        self.give_back(old);
        ended
    }

    fn give_back(&self, frame: Option<Box<Frame>>) {
        // As many places as frames.
        let _ = frame.map(|frame| self.empty.try_send(frame));
    }

    /// Follows the kick of a frame: its command, what the client wants to know, and its end.
    fn carry_out(&mut self, frame: &Frame) {
        let Some(kick) = self.state.kick.as_mut().filter(|kick| kick.number == frame.number) else { return };
        if frame.trouble == Some(Trouble::Fell) {
            self.log.warn("the robot fell: the kick is given up, and no more commands are sent");
            self.end(GoalState::Aborted, KickResult::ABORTED);
            return;
        }
        send_command(&self.ends, &self.robot, frame, &mut self.state.counts);
        let now = Instant::now();
        if let Some(asked) = kick.asked.take() {
            self.state.first_command.record((now - asked).as_secs_f64());
        }
        if let Some(last) = kick.last_command.replace(now) {
            self.state.jitter.record(((now - last).as_secs_f64() - self.period).abs());
        }
        let done = percent(&frame.progress);
        let tells = frame.running() || frame.progress.status == KickStatus::Finished;
        if tells && kick.percent.replace(done) != Some(done) {
            let feedback = F::feedback(&kick.plan, &frame.progress);
            if let Some(goal) = self.state.goals.active() {
                let sent = self.ends.action.send_feedback(ros_id(&goal.id), feedback);
                self.state.counts.unsent += u64::from(sent.is_err());
            }
        }
        if frame.running() {
            return;
        }
        let asked = self.state.goals.active().is_some_and(|goal| goal.state == GoalState::Canceling);
        match (frame.trouble, frame.progress.status) {
            (Some(Trouble::Silent(sensor)), _) => {
                self.log.warn(&format!("{sensor} went silent during the kick: the foot was brought down"));
                self.end(GoalState::Aborted, KickResult::ABORTED);
            }
            (_, KickStatus::Finished) => self.end(GoalState::Succeeded, KickResult::SUCCESS),
            _ if asked => self.end(GoalState::Canceled, KickResult::ABORTED),
            _ => self.end(GoalState::Aborted, KickResult::ABORTED),
        }
    }

    /// Shows the simulated robot and its ball, on the network and in our own TF.
    fn show(&mut self, frame: &Frame) {
        let (Some(topics), Some(at)) = (&self.ends.simulated, &frame.whereabouts) else { return };
        let header = |frame_id: &str| Header { stamp: Time::from_nanoseconds(frame.stamp), frame_id: frame_id.into() };
        let [x, y, yaw] = at.footprint;
        let footprint = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw);
        let [bx, by, bz, w, i, j, k] = at.base;
        let base = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        let base_at = footprint.inverse() * Vector3::new(bx - x, by - y, bz);
        let transform = |parent: &str, child: &str, at: [f64; 3], turn: UnitQuaternion<f64>| TransformStamped {
            header: header(parent),
            child_frame_id: child.into(),
            transform: Transform {
                translation: RosVector3::new(at),
                rotation: RosQuaternion { x: turn.i, y: turn.j, z: turn.k, w: turn.w },
            },
        };
        let transforms = vec![
            transform(WORLD, FOOTPRINT, [x, y, 0.0], footprint),
            transform(FOOTPRINT, BASE, base_at.into(), footprint.inverse() * base),
            transform(WORLD, BALL, at.ball, UnitQuaternion::identity()),
        ];
        for transform in &transforms {
            let _ = self.state.tf.insert(transform, false);
        }
        let joints = JointState {
            header: header(""),
            name: self.robot.joints.iter().map(|joint| joint.name.clone()).collect(),
            position: frame.sensors.joint_positions.clone(),
            velocity: frame.sensors.joint_velocities.clone(),
            effort: Vec::new(),
        };
        let unsent = [topics.tf.publish(TfMessage { transforms }).is_err(), topics.joints.publish(joints).is_err()];
        self.state.counts.unsent += unsent.into_iter().map(u64::from).sum::<u64>();
    }

    // To the control loop.

    fn answer_goals(&mut self) {
        for _ in 0..TURN {
            match self.ends.action.receive_goal() {
                Ok(None) => break,
                Err(error) => self.undecodable("a goal", &error),
                Ok(Some((request, asked))) => {
                    let now = wall_clock();
                    let id: GoalId = *asked.goal_id.uuid.as_bytes();
                    let taken = self.consider(id, &asked.goal, now);
                    let accepted = match &taken {
                        Ok(()) => true,
                        Err(why) => {
                            self.state.counts.rejected += 1;
                            self.log.warn(&format!("goal {} rejected: {why}", short(&id)));
                            false
                        }
                    };
                    let answer = SendGoalResponse { accepted, stamp: RosTime::from_nanos(now) };
                    self.state.counts.unsent +=
                        u64::from(self.ends.action.send_goal_response(request, answer).is_err());
                    self.publish_status();
                }
            }
        }
    }

    /// Takes a goal, or says why not. A goal that no foot can reach is taken and ended at once, so that its client
    /// learns the cause.
    fn consider(&mut self, id: GoalId, goal: &F::Goal, now: i64) -> Result<(), String> {
        let asked = Instant::now();
        if self.state.goals.knows(&id) {
            return Err("its identity was used before".into());
        }
        let Some(frame) = self.state.frame.as_ref() else { return Err("the control loop has not started".into()) };
        if self.state.goals.active().is_some() || frame.running() {
            return Err("a kick is under way".into());
        }
        if let Freshness::Silent(sensor) = frame.freshness {
            return Err(format!("{sensor} is silent"));
        }
        if fallen(frame.sensors.orientation) {
            return Err("the robot does not stand".into());
        }
        let request = F::request(goal, &self.state.tf).map_err(|e| e.to_string())?;
        let Some(planner) = self.planner.as_mut() else { return Err("a kick is about to begin".into()) };
        match planner.plan(&request, &frame.sensors) {
            Ok(plan) => {
                let Some(engine) = self.planner.take() else { return Err("there is no engine".into()) };
                let number = self.state.number + 1;
                if self.orders.try_send(Order::Start { number, engine }).is_err() {
                    return Err("the control loop does not answer".into());
                }
                self.state.number = number;
                self.state.goals.accept(id, now);
                self.state.counts.accepted += 1;
                self.state.kick = Some(Kick { number, plan, asked: Some(asked), last_command: None, percent: None });
                let [x, y] = request.ball;
                let (foot, angle) = (plan.foot, request.direction.to_degrees());
                self.log.info(&format!(
                    "goal {}: {foot} foot, ball at ({x:.3}, {y:.3}) m, {angle:.0} deg, contact in {:.2} s",
                    short(&id),
                    plan.contact
                ));
                Ok(())
            }
            Err(refusal) if is_reach(&refusal) => {
                self.state.counts.unreachable += 1;
                self.log.warn(&format!("goal {} unreachable: {}", short(&id), refusal.explain(&self.robot)));
                self.state.goals.accept(id, now);
                self.end(GoalState::Aborted, KickResult::UNREACHABLE);
                Ok(())
            }
            Err(refusal) => Err(refusal.explain(&self.robot)),
        }
    }

    fn answer_cancels(&mut self) {
        for _ in 0..TURN {
            match self.ends.action.receive_cancel_request() {
                Ok(None) => break,
                Err(error) => self.undecodable("a cancel", &error),
                Ok(Some((request, asked))) => {
                    let Some(CancelAsked { goal_id, stamp }) = cancel_asked(&asked) else { continue };
                    let (code, goals) = self.state.goals.cancel(&goal_id, stamp.nanoseconds());
                    if let (false, Some(kick)) = (goals.is_empty(), &self.state.kick) {
                        // Orders are read every tick: there is room unless the loop has died.
                        let _ = self.orders.try_send(Order::Cancel { number: kick.number });
                        self.state.counts.cancelled += 1;
                    }
                    for goal in &goals {
                        self.log.info(&format!("goal {}: cancel", short(&goal.id)));
                    }
                    let answer = CancelGoalResponse {
                        return_code: match code {
                            CancelCode::None => CancelGoalResponseEnum::None,
                            CancelCode::UnknownGoal => CancelGoalResponseEnum::UnknownGoal,
                            CancelCode::Terminated => CancelGoalResponseEnum::GoalTerminated,
                        },
                        goals_canceling: goals.iter().map(ros_info).collect(),
                    };
                    self.state.counts.unsent +=
                        u64::from(self.ends.action.send_cancel_response(request, answer).is_err());
                    self.publish_status();
                }
            }
        }
    }

    fn answer_results(&mut self) {
        for _ in 0..TURN {
            match self.ends.action.receive_result_request() {
                Ok(None) => break,
                Err(error) => self.undecodable("a request for a result", &error),
                Ok(Some((request, asked))) => {
                    if let ResultAnswer::Now(request, known) =
                        self.state.goals.result(asked.goal_id.uuid.as_bytes(), request)
                    {
                        self.tell_result(request, known);
                    }
                }
            }
        }
    }

    fn tell_result(&mut self, request: RmwRequestId, known: Option<(GoalState, u8)>) {
        let answer = match known {
            Some((state, result)) => GetResultResponse { status: ros_state(state), result: KickResult { result } },
            None => GetResultResponse {
                status: GoalStatusEnum::Unknown,
                result: KickResult { result: KickResult::REJECTED },
            },
        };
        self.state.counts.unsent += u64::from(self.ends.action.send_result(request, answer).is_err());
    }

    /// Ends the goal under way, if there is one, and tells everybody.
    fn end(&mut self, state: GoalState, result: u8) {
        self.state.kick = None;
        let Some(goal) = self.state.goals.active().copied() else { return };
        for request in self.state.goals.finish(state, result) {
            self.tell_result(request, Some((state, result)));
        }
        match state {
            GoalState::Succeeded => self.state.counts.succeeded += 1,
            GoalState::Canceled => self.state.counts.canceled += 1,
            _ => self.state.counts.aborted += 1,
        }
        self.log.info(&format!("goal {}: {}", short(&goal.id), format!("{state:?}").to_lowercase()));
        self.publish_status();
    }

    fn publish_status(&mut self) {
        let status = |goal: &Goal| GoalStatus { goal_info: ros_info(goal), status: ros_state(goal.state) };
        let status_list = self.state.goals.all().map(status).collect();
        let sent = self.ends.action.send_goal_statuses(GoalStatusArray { status_list });
        self.state.counts.unsent += u64::from(sent.is_err());
    }

    fn undecodable(&mut self, what: &str, error: &ReadError) {
        self.state.counts.undecodable += 1;
        self.log.warn(&format!("{what} cannot be decoded, and is not answered: {error}"));
    }

    // From the robot.

    /// Gives whether there may be more.
    fn take_transforms(&mut self) -> bool {
        let mut more = false;
        for fixed in [true, false] {
            let topic = if fixed { &self.ends.tf_static } else { &self.ends.tf };
            let (messages, left, broken) = drain(topic);
            more |= left;
            self.state.counts.undecodable += broken;
            for transform in messages.iter().flat_map(|message| &message.transforms) {
                if let Err(why) = self.state.tf.insert(transform, fixed) {
                    let (parent, child) = (&transform.header.frame_id, &transform.child_frame_id);
                    let name = |name: &str| name.chars().take(64).collect::<String>();
                    self.log.warn(&format!("TF from \"{}\" to \"{}\": {why}", name(parent), name(child)));
                }
            }
        }
        more
    }

    /// Gives whether there may be more.
    fn take_sensors(&mut self) -> bool {
        let Some(topics) = &self.ends.sensors else { return false };
        let now = Some(Instant::now());
        let (joints, mut more, mut broken) = drain(&topics.joints);
        let (imu, left, bad) = drain(&topics.imu);
        (more, broken) = (more | left, broken + bad);
        let mut pressure = [None, None];
        for (side, topic) in topics.pressure.iter().enumerate() {
            let (points, left, bad) = drain(topic);
            (more, broken) = (more | left, broken + bad);
            pressure[side] = points.into_iter().next_back();
        }
        self.state.counts.undecodable += broken;
        let Ok(mut inbox) = self.inbox.lock() else { return more };
        for message in joints {
            if take_joints(&message, &self.state.joint_of, &mut inbox) {
                inbox.joints_at = now;
            }
        }
        if let Some(imu) = imu.into_iter().next_back() {
            // An unknown frame is taken to be the base link's.
            let base_from_imu = self.state.tf.lookup(BASE, &imu.header.frame_id, None).unwrap_or_default().rotation;
            let turn = &imu.orientation;
            let turn = Quaternion::new(turn.w, turn.x, turn.y, turn.z);
            let rate = Vector3::from(imu.angular_velocity.array());
            let force = Vector3::from(imu.linear_acceleration.array());
            let finite = rate.iter().chain(force.iter()).all(|v| v.is_finite());
            // Written so that a NaN fails.
            if finite && (turn.norm() - 1.0).abs() < 0.05 {
                let world_from_base = UnitQuaternion::new_normalize(turn) * base_from_imu.inverse();
                let q = world_from_base;
                inbox.sensors.orientation = [q.w, q.i, q.j, q.k];
                inbox.sensors.gyro = (base_from_imu * rate).into();
                inbox.sensors.accelerometer = (base_from_imu * force).into();
                inbox.imu_at = now;
            }
        }
        for (side, point) in pressure.into_iter().enumerate() {
            let Some(PointStamped { point, .. }) = point else { continue };
            let on = point.x.is_finite() && point.y.is_finite();
            inbox.sensors.centre_of_pressure[side] = on.then_some([point.x, point.y]);
            inbox.pressure_at[side] = now;
        }
        more
    }
}

/// Publishes the command of a frame, and which foot carries the robot.
fn send_command<F: Form>(ends: &Endpoints<F>, robot: &Robot, frame: &Frame, counts: &mut Counts) {
    let header = Header { stamp: Time::from_nanoseconds(frame.stamp), frame_id: String::new() };
    let free = vec![-1.0; frame.positions.len()];
    let command = JointCommand {
        header: header.clone(),
        from_hcm: false,
        joint_names: robot.joints.iter().map(|joint| joint.name.clone()).collect(),
        positions: frame.positions.clone(),
        velocities: free.clone(),
        accelerations: free.clone(),
        max_currents: free,
    };
    counts.unsent += u64::from(ends.commands.publish(command).is_err());
    counts.unsent += u64::from(ends.support.publish(SupportState { header, phase: support(frame) }).is_err());
    counts.commands += 1;
}

/// Takes in the joints that a message names; tells whether every joint of the robot has been named by it.
fn take_joints(message: &JointState, joint_of: &HashMap<String, usize>, inbox: &mut Inbox) -> bool {
    let mut known = 0;
    for (i, (name, position)) in message.name.iter().zip(&message.position).enumerate() {
        let Some(&joint) = joint_of.get(name) else { continue };
        let velocity = message.velocity.get(i).copied().unwrap_or(0.0);
        if position.is_finite() && velocity.is_finite() {
            inbox.sensors.joint_positions[joint] = *position;
            inbox.sensors.joint_velocities[joint] = velocity;
            known += 1;
        }
    }
    known >= joint_of.len()
}

/// Up to [`TURN`] messages of a topic, whether there may be more, and how many could not be decoded.
fn drain<M: ros2_client::Message + 'static>(topic: &Subscription<M>) -> (Vec<M>, bool, u64) {
    let (mut messages, mut broken) = (Vec::new(), 0);
    for _ in 0..TURN {
        match topic.take() {
            Ok(Some((message, _))) => messages.push(message),
            Ok(None) => return (messages, false, broken),
            Err(_) => broken += 1,
        }
    }
    (messages, true, broken)
}

/// biped_interfaces/msg/Phase: the foot that carries the robot.
fn support(frame: &Frame) -> u8 {
    let both = matches!(frame.progress.phase, Phase::Stand | Phase::Shift | Phase::ShiftBack);
    match frame.progress.foot {
        Some(Side::Right) if !both => 0,
        Some(Side::Left) if !both => 1,
        _ => 2,
    }
}

/// Whether a refusal says that no foot can do the kick, whatever the robot's state.
fn is_reach(refusal: &Refusal) -> bool {
    match refusal {
        Refusal::BallBehind { .. }
        | Refusal::BallUnderRobot { .. }
        | Refusal::TooFar { .. }
        | Refusal::BallRolls { .. }
        | Refusal::Unreachable { .. }
        | Refusal::SelfCollision { .. }
        | Refusal::TooFast { .. }
        | Refusal::TooStrong { .. }
        | Refusal::TooHeavy { .. }
        | Refusal::HitsGround { .. }
        | Refusal::OutsideGrid { .. }
        | Refusal::OtherKick { .. }
        | Refusal::OtherFoot { .. }
        | Refusal::BrushesBall { .. }
        | Refusal::OffBalance { .. } => true,
        Refusal::NotFinite { .. }
        | Refusal::NoStrength { .. }
        | Refusal::TooLate { .. }
        | Refusal::TooImprecise { .. }
        | Refusal::Busy
        | Refusal::NoKick
        | Refusal::Struck
        | Refusal::NotStanding { .. }
        | Refusal::NotAtStart { .. }
        | Refusal::CannotHold => false,
    }
}

/// The start of an identity, for people.
fn short(id: &GoalId) -> String {
    id[..4].iter().map(|byte| format!("{byte:02x}")).collect()
}
