//! A robot's body in the game simulator: walks within its limits, meets others, falls, kicks.

use arrayvec::ArrayVec;
use instep_behaviour::{BallMemory, Beliefs, Decision, GameState, KickRequest, OpponentMemory, OwnState, Player};
use instep_field::Pose;

use crate::referee::Penalty;
use crate::settings::BodySettings;
use crate::sight::Frame;

/// Whether a robot plays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Status {
    /// Plays.
    Active,
    /// On the ground since, s, and this many attempts to get up.
    Down {
        /// s.
        since: f64,
        /// Attempts that failed.
        tries: u32,
        /// The next attempt ends, s.
        up_at: f64,
    },
    /// Sent off.
    Removed {
        /// What for.
        penalty: Penalty,
        /// Since, s: it is carried off within a moment.
        since: f64,
        /// Until, s; infinite: for the rest of the game.
        until: f64,
    },
}

/// A kick on its way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Swing {
    pub request: KickRequest,
    /// From the robot's heading to the wanted direction, as the robot believes, rad.
    pub relative: f64,
    /// s.
    pub contact: f64,
    pub end: f64,
    pub struck: bool,
}

/// A robot.
#[derive(Debug, Clone)]
pub struct Robot {
    /// 0: Home, 1: Away.
    pub team: usize,
    /// From 1.
    pub number: u8,
    /// In the world.
    pub pose: Pose,
    /// In the robot frame, m/s, m/s, rad/s.
    pub velocity: [f64; 3],
    /// Whether it plays.
    pub status: Status,
    /// Neck, rad.
    pub gaze_yaw: f64,
    /// Sendings-off so far.
    pub removals: u32,
    pub(crate) swing: Option<Swing>,
    pub(crate) command: [f64; 3],
    /// Of a scenario: walks so, whatever it decides.
    pub(crate) scripted: Option<[f64; 3]>,
    pub(crate) head: Player,
    pub(crate) beliefs: Beliefs,
    pub(crate) opponents: OpponentMemory,
    pub(crate) decision: Option<Decision>,
    /// Error of the own pose: x, y, heading.
    pub(crate) pose_error: [f64; 3],
    /// The last frame: it is worked on while the next is taken.
    pub(crate) frame: Frame,
}

/// A robot that is sent off stands on the field this long until it is carried off, s.
pub(crate) const CARRY_OFF: f64 = 2.0;

impl Robot {
    pub(crate) fn new(team: usize, number: u8, pose: Pose, head: Player) -> Self {
        let beliefs = Beliefs {
            time: 0.0,
            number,
            own: OwnState::at(pose),
            ball: BallMemory::default(),
            mates: ArrayVec::new(),
            opponents: ArrayVec::new(),
            game: GameState::default(),
            view: Default::default(),
        };
        Self {
            team,
            number,
            pose,
            velocity: [0.0; 3],
            status: Status::Active,
            gaze_yaw: 0.0,
            removals: 0,
            swing: None,
            command: [0.0; 3],
            scripted: None,
            head,
            beliefs,
            opponents: OpponentMemory::default(),
            decision: None,
            pose_error: [0.0; 3],
            frame: Frame::default(),
        }
    }

    /// Plays and stands.
    pub fn is_active(&self) -> bool {
        self.status == Status::Active
    }

    /// Is in the way of others and of the ball.
    pub fn is_on_field(&self, time: f64) -> bool {
        match self.status {
            Status::Removed { since, .. } => time - since < CARRY_OFF,
            _ => true,
        }
    }

    /// World velocity, m/s.
    pub fn world_velocity(&self) -> [f64; 2] {
        let (s, c) = self.pose.heading.sin_cos();
        [c * self.velocity[0] - s * self.velocity[1], s * self.velocity[0] + c * self.velocity[1]]
    }

    /// Walks for `dt` toward the commanded velocity.
    pub(crate) fn walk(&mut self, dt: f64, body: &BodySettings) {
        let standing_kick = self.swing.is_some_and(|s| !s.struck && self.command == [0.0; 3]);
        let wanted = if self.is_active() && !standing_kick { limit(self.command, body) } else { [0.0; 3] };
        let most = [body.acceleration, body.acceleration, 3.0 * body.acceleration];
        for ((v, w), a) in self.velocity.iter_mut().zip(wanted).zip(most) {
            *v += (w - *v).clamp(-a * dt, a * dt);
        }
        if self.velocity != [0.0; 3] {
            let [vx, vy, turn] = self.velocity;
            // Half of the turn first: second order in dt.
            let half = Pose { heading: self.pose.heading + 0.5 * turn * dt, ..self.pose };
            let [x, y] = half.outer_from_local([vx * dt, vy * dt]);
            self.pose = Pose::new(x, y, self.pose.heading + turn * dt);
        }
    }

    pub(crate) fn fall(&mut self, time: f64, body: &BodySettings) {
        if self.is_active() {
            self.status = Status::Down { since: time, tries: 0, up_at: time + body.get_up };
            (self.velocity, self.command, self.swing) = ([0.0; 3], [0.0; 3], None);
        }
    }

    pub(crate) fn place(&mut self, pose: Pose) {
        self.pose = pose;
        (self.velocity, self.command, self.swing) = ([0.0; 3], [0.0; 3], None);
    }
}

/// Into the ellipse of walking speeds.
fn limit(command: [f64; 3], body: &BodySettings) -> [f64; 3] {
    let forward = if command[0] >= 0.0 { body.forward } else { 0.6 * body.forward };
    let share = (command[0] / forward).hypot(command[1] / body.side).max(1.0);
    [command[0] / share, command[1] / share, command[2].clamp(-body.turn, body.turn)]
}

/// Pushes two robots apart and tells the speed at which they met, m/s.
pub(crate) fn collide(a: &mut Robot, b: &mut Robot, radius: f64) -> Option<f64> {
    let off = [b.pose.x - a.pose.x, b.pose.y - a.pose.y];
    let square = off[0] * off[0] + off[1] * off[1];
    let reach = 2.0 * radius;
    if square >= reach * reach {
        return None;
    }
    let d = square.sqrt();
    let normal = if d > 1e-9 { [off[0] / d, off[1] / d] } else { [1.0, 0.0] };
    let push = 0.5 * (reach - d);
    (a.pose.x, a.pose.y) = (a.pose.x - push * normal[0], a.pose.y - push * normal[1]);
    (b.pose.x, b.pose.y) = (b.pose.x + push * normal[0], b.pose.y + push * normal[1]);
    let (va, vb) = (a.world_velocity(), b.world_velocity());
    let closing = (va[0] - vb[0]) * normal[0] + (va[1] - vb[1]) * normal[1];
    if closing > 0.0 {
        // Each loses the part of its speed that goes into the other.
        for (robot, sign) in [(a, 1.0), (b, -1.0)] {
            let [nx, ny] =
                robot.pose.local_from_outer([robot.pose.x + sign * normal[0], robot.pose.y + sign * normal[1]]);
            let into = robot.velocity[0] * nx + robot.velocity[1] * ny;
            if into > 0.0 {
                robot.velocity[0] -= into * nx;
                robot.velocity[1] -= into * ny;
            }
        }
    }
    Some(closing.max(0.0))
}
