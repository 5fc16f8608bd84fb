//! What is kept of a physics match for its report: the flat record that the game simulator's page draws, and every robot's
//! joints for the replay in space.

use instep_behaviour::{BallState as Known, Reason};
use instep_field::Side;
use instep_sim::World;

use super::seat::{Seat, pose};
use crate::record::{Frame, RobotFrame, round};
use crate::robot::{Robot, Status};

/// Positions of a whole world, one row a moment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Motion {
    /// s.
    pub times: Vec<f64>,
    /// For each robot its positions, 7 + n a row.
    pub q: Vec<Vec<f64>>,
    /// The ball's centre, m, and its `world_from_ball`.
    pub ball: Vec<([f64; 3], [f64; 4])>,
}

impl Motion {
    pub(super) fn push(&mut self, world: &World) {
        self.times.push(world.time());
        self.q.resize(world.robots().len(), Vec::new());
        for (rows, view) in self.q.iter_mut().zip(world.robots()) {
            rows.extend_from_slice(view.q());
        }
        let ball = world.ball();
        self.ball.push((ball.position, ball.orientation));
    }
}

/// One robot at the present moment: truth of its body, beliefs of its player where it has one.
pub(super) fn robot_frame(world: &World, index: usize, seat: Option<&Seat>, robot: Option<&Robot>) -> RobotFrame {
    let view = world.on(index);
    let truth = pose(&view);
    let known = seat.map(|seat| (seat.team, seat.player.record(), seat.player.beliefs()));
    let status = robot.map_or(if view.has_fallen() { 1 } else { 0 }, |robot| match robot.status {
        Status::Active => 0,
        Status::Down { .. } => 1,
        Status::Removed { .. } => 2,
    });
    let of = |side: Side, point: [f64; 2]| side.point(point).map(round);
    let reason = |r: &Reason| (r.option, round(r.cost.min(1e6)), r.rejected, r.why);
    RobotFrame {
        pose: [round(truth.x), round(truth.y), round(truth.heading)],
        believed: known.as_ref().map_or([round(truth.x), round(truth.y)], |(side, r, _)| of(*side, r.pose.position())),
        gaze: known.as_ref().map_or(0.0, |(_, _, beliefs)| round(beliefs.own.gaze_yaw)),
        status,
        role: known.as_ref().map(|(_, r, _)| r.role),
        action: known.as_ref().map(|(_, r, _)| r.action),
        ball: known
            .as_ref()
            .filter(|(_, _, beliefs)| beliefs.ball.is_known())
            .map(|(side, r, _)| of(*side, r.ball_position)),
        ball_state: known.as_ref().map_or(Known::Lost, |(_, r, _)| r.ball),
        target: known.as_ref().and_then(|(side, ..)| {
            let target = seat?.player.decision()?.target?;
            let [x, y] = of(*side, target.point);
            Some([x, y, round(target.radius)])
        }),
        reasons: known.as_ref().map(|(_, r, _)| r.reasons.iter().map(reason).collect()).unwrap_or_default(),
    }
}

/// A frame of the flat record.
pub(super) fn frame(world: &World, robots: Vec<RobotFrame>, left: f64, state: String, score: [u32; 2]) -> Frame {
    let [x, y, _] = world.ball().position;
    Frame {
        time: (world.time() * 100.0).round() / 100.0,
        left: left.round(),
        state,
        score,
        ball: [round(x), round(y)],
        robots,
    }
}
