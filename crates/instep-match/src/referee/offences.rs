//! What somebody is sent off for, and how they come back.

use instep_behaviour::{PlayState, SetPlay};
use instep_field::Pose;

use super::{Court, EventKind, Penalty, Referee, SLACK, Team, distance, in_penalty_area};
use crate::ball::Ball;
use crate::robot::{CARRY_OFF, Robot, Status};

/// The ball has not moved while within this of where it was, m.
const PROGRESS: f64 = 0.5;
/// Near the ball, for a local stuck, m.
const NEAR_BALL: f64 = 1.0;
/// Both nearer to the ball than this: a fight for the ball, no pushing, m.
const FIGHT: f64 = 0.7;
/// Slower is no motion in SET, m/s; and a moment to stop, s.
const QUIET: f64 = 0.15;
const QUIET_AFTER: f64 = 1.0;
/// A touch is held on over gaps up to this, s.
const HOLD_GAP: f64 = 0.2;

impl Referee {
    pub(super) fn judge_motion_in_set(&mut self, court: &mut Court) {
        if court.time - self.since < QUIET_AFTER || self.book.rules.removal.is_none() {
            return;
        }
        for i in 0..court.robots.len() {
            let robot = &court.robots[i];
            if robot.is_active() && robot.velocity[0].hypot(robot.velocity[1]) > QUIET {
                self.send_off(court, i, Penalty::MotionInSet);
            }
        }
    }

    /// Opponents too near to a restart.
    pub(super) fn judge_positions(&mut self, court: &mut Court) {
        let Some(taker) = self.kicking else { return };
        let field = court.field;
        let kick_off = self.set_play == SetPlay::None;
        let grace = if kick_off { 2.0 } else { self.book.clear };
        for i in 0..court.robots.len() {
            let robot = &court.robots[i];
            if robot.team == taker || !robot.is_active() {
                continue;
            }
            let place = robot.pose.position();
            let keeper_at_penalty = self.set_play == SetPlay::PenaltyKick
                && (place[0] - self.spot[0].signum() * field.length / 2.0).abs() < 1.0;
            let near = distance(place, self.spot) < field.circle_radius - SLACK && !keeper_at_penalty;
            let inside = self.set_play == SetPlay::GoalKick && in_penalty_area(field, place, self.spot[0] > 0.0);
            self.encroaching[i] = if near || inside { self.encroaching[i] + court.dt } else { 0.0 };
            if self.encroaching[i] > grace {
                self.encroaching[i] = 0.0;
                self.send_off(court, i, Penalty::IllegalPositioning);
            }
        }
    }

    pub(super) fn judge_holding(&mut self, court: &mut Court) {
        let time = court.time;
        self.holding = match (self.holding, court.touches.first()) {
            (Some((holder, since, _)), Some(_)) if court.touches.contains(&holder) => Some((holder, since, time)),
            (Some((holder, since, last)), _) if time - last < HOLD_GAP => Some((holder, since, last)),
            (_, Some(&i)) => Some((i, time, time)),
            (_, None) => None,
        };
        let Some((holder, since, _)) = self.holding else { return };
        let robot = &court.robots[holder];
        let keeper = robot.number == 1 && in_penalty_area(court.field, robot.pose.position(), robot.team == 1);
        if robot.is_active() && time - since > self.book.holding[usize::from(keeper)] {
            self.holding = None;
            self.send_off(court, holder, Penalty::BallHolding);
        }
    }

    pub(super) fn judge_pushing(&mut self, court: &mut Court) {
        for push in &mut self.pushing {
            *push = (*push - 0.5 * court.dt).max(0.0);
        }
        for &(i, j) in court.contacts {
            let (a, b) = (&court.robots[i], &court.robots[j]);
            let fight = distance(a.pose.position(), court.ball.position) < FIGHT
                && distance(b.pose.position(), court.ball.position) < FIGHT;
            if a.team == b.team || !a.is_active() || !b.is_active() || fight {
                continue;
            }
            let (into_b, into_a) = (wants_into(a, b), wants_into(b, a));
            let (pusher, victim) = match (into_b > 0.2, into_a > 0.2) {
                (true, false) if into_a < 0.05 => (i, j),
                (false, true) if into_b < 0.05 => (j, i),
                _ => continue,
            };
            self.pushing[pusher] += 1.5 * court.dt;
            if self.pushing[pusher] > self.book.pushing {
                self.pushing[pusher] = 0.0;
                return self.punish_push(court, pusher, victim);
            }
        }
    }

    fn punish_push(&mut self, court: &mut Court, pusher: usize, victim: usize) {
        let team = court.robots[victim].team;
        let place = court.robots[victim].pose.position();
        self.send_off(court, pusher, Penalty::Pushing);
        if self.kicking.is_some() {
            // The restart goes on.
            return;
        }
        let own_area = in_penalty_area(court.field, place, team == 0);
        if own_area {
            return self.penalty_kick(court, team);
        }
        let (x, y) = (court.field.length / 2.0 - 0.5, court.field.width / 2.0 - 0.5);
        let spot = [place[0].clamp(-x, x), place[1].clamp(-y, y)];
        self.set_play(court, SetPlay::DirectFreeKick, team, spot);
    }

    pub(super) fn judge_stuck(&mut self, court: &mut Court) {
        let time = court.time;
        if distance(court.ball.position, self.anchor) > PROGRESS || self.kicking.is_some() {
            (self.anchor, self.anchor_since) = (court.ball.position, time);
        }
        let near = |team: Team| {
            court
                .robots
                .iter()
                .enumerate()
                .filter(|(_, r)| r.is_active() && r.team == team)
                .map(|(i, r)| (distance(r.pose.position(), court.ball.position), i))
                .filter(|(d, _)| *d < NEAR_BALL)
                .min_by(|a, b| a.0.total_cmp(&b.0))
        };
        if time - self.anchor_since > self.book.stuck_local
            && let (Some(a), Some(b)) = (near(0), near(1))
        {
            self.anchor_since = time;
            let nearer = if a.0 <= b.0 { a.1 } else { b.1 };
            self.send_off(court, nearer, Penalty::LocalGameStuck);
        }
        if time - self.quiet_since > self.book.stuck_global && self.kicking.is_none() {
            *court.ball = Ball::default();
            (self.quiet_since, self.last_touch, self.indirect) = (time, None, None);
            (self.anchor, self.anchor_since) = ([0.0; 2], time);
            self.tell(time, EventKind::DroppedBall);
        }
    }

    /// Who left the field or does not get up.
    pub(super) fn judge_absent(&mut self, court: &mut Court) {
        for i in 0..court.robots.len() {
            let robot = &court.robots[i];
            match robot.status {
                Status::Active => {
                    if !court.field.contains(robot.pose.position(), court.field.border) {
                        self.send_off(court, i, Penalty::LeavingTheField);
                    }
                }
                Status::Down { since, tries, .. } => {
                    let most = self.book.rules.get_up_tries.unwrap_or(usize::MAX);
                    if court.time - since > self.book.incapable || tries as usize >= most {
                        self.send_off(court, i, Penalty::IncapableRobot);
                    }
                }
                Status::Removed { .. } => {}
            }
        }
    }

    pub(crate) fn send_off(&mut self, court: &mut Court, i: usize, penalty: Penalty) {
        let robot = &mut court.robots[i];
        if matches!(robot.status, Status::Removed { .. }) {
            return;
        }
        let until = court.time + self.book.sent_off + self.book.repeat * f64::from(robot.removals);
        robot.removals += 1;
        robot.status = Status::Removed { penalty, since: court.time, until };
        (robot.velocity, robot.command, robot.swing) = ([0.0; 3], [0.0; 3], None);
        let (team, number) = (robot.team, robot.number);
        self.tell(court.time, EventKind::SentOff { team, number, penalty });
    }

    /// Those whose time is over come back at their half's touch line, away from the ball; carried-off ones wait outside.
    pub(super) fn let_return(&mut self, court: &mut Court) {
        for i in 0..court.robots.len() {
            let Status::Removed { since, until, .. } = court.robots[i].status else { continue };
            let field = court.field;
            let side = if court.ball.position[1] > 0.0 { -1.0 } else { 1.0 };
            let robot = &mut court.robots[i];
            let x = -0.25 * field.length * if robot.team == 0 { 1.0 } else { -1.0 };
            if court.time >= until && self.state != PlayState::Set {
                let y = side * (field.width / 2.0 + 0.2);
                // Nobody appears in another robot.
                let place = (0..8)
                    .map(|k| [x + 0.7 * f64::from(k % 4) * x.signum(), y + 0.5 * side * f64::from(k / 4)])
                    .find(|p| {
                        !court.robots.iter().enumerate().any(|(j, r)| j != i && distance(r.pose.position(), *p) < 0.6)
                    });
                let Some([x, y]) = place else { continue };
                let robot = &mut court.robots[i];
                robot.place(Pose::new(x, y, -side * std::f64::consts::FRAC_PI_2));
                robot.status = Status::Active;
                let (team, number) = (robot.team, robot.number);
                self.tell(court.time, EventKind::Returned { team, number });
            } else if court.time - since >= CARRY_OFF {
                // Benches: beside the field, one place each.
                let y = -(field.width / 2.0 + field.border + 1.0);
                let place = x.signum() * (1.0 + 0.6 * f64::from(robot.number));
                robot.place(Pose::new(place, y, std::f64::consts::FRAC_PI_2));
            }
        }
    }
}

/// How fast `a` wants to walk into `b`, m/s.
fn wants_into(a: &Robot, b: &Robot) -> f64 {
    let [x, y] = a.pose.local_from_outer(b.pose.position());
    let d = x.hypot(y).max(1e-9);
    (a.command[0] * x + a.command[1] * y) / d
}
