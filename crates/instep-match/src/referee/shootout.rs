//! The shoot-out: one shooter, one keeper, shot by shot.

use instep_behaviour::GamePhase;
use instep_field::Pose;

use super::{Court, EventKind, Penalty, Referee};
use crate::ball::Whereabouts;
use crate::robot::{CARRY_OFF, Status};

impl Referee {
    pub(crate) fn start_shootout(&mut self, court: &mut Court) {
        self.phase = GamePhase::Shootout;
        self.time_left = 0.0;
        self.next_shot(court);
    }

    fn next_shot(&mut self, court: &mut Court) {
        let team = (self.first_kick_off + self.shots as usize) % 2;
        self.penalty_kick(court, team);
        let sign = if team == 0 { 1.0 } else { -1.0 };
        let players = court.robots.len() / 2;
        // Who shoots: number 2, or 1 where there is no other.
        for robot in court.robots.iter_mut() {
            let shooter = robot.team == team && robot.number == 2;
            let alone = robot.team == team && robot.number == 1 && players == 1;
            let keeper = robot.team != team && robot.number == 1;
            if shooter || alone {
                robot.status = Status::Active;
                let heading = if sign > 0.0 { 0.0 } else { std::f64::consts::PI };
                robot.place(Pose::new(self.spot[0] - 0.8 * sign, 0.0, heading));
            } else if keeper {
                robot.status = Status::Active;
                let heading = if sign > 0.0 { std::f64::consts::PI } else { 0.0 };
                robot.place(Pose::new(sign * (court.field.length / 2.0 - 0.1), 0.0, heading));
            } else {
                let penalty = Penalty::Substitute;
                robot.status = Status::Removed { penalty, since: court.time - CARRY_OFF, until: f64::INFINITY };
            }
        }
        self.set(court);
    }

    pub(super) fn judge_shot(&mut self, court: &mut Court) {
        let shooter = (self.first_kick_off + self.shots as usize) % 2;
        let toward = if shooter == 0 { 1 } else { -1 };
        let over = match court.whereabouts {
            Whereabouts::Goal(end) => Some(end == toward),
            Whereabouts::GoalLine(_) | Whereabouts::TouchLine => Some(false),
            Whereabouts::Inside => {
                let stopped =
                    self.kicking.is_none() && court.ball.speed() < 0.02 && court.time - self.quiet_since > 1.0;
                (stopped || court.time > self.deadline).then_some(false)
            }
        };
        let Some(scored) = over else { return };
        self.shootout[shooter] += u32::from(scored);
        self.tell(court.time, EventKind::Shot { team: shooter, scored });
        self.shots += 1;
        let [a, b] = self.shootout;
        let (round_over, regular) = (self.shots.is_multiple_of(2), 2 * self.book.shots);
        let left = (regular.saturating_sub(self.shots)).div_ceil(2);
        let decided = self.shots < regular && a.abs_diff(b) > left;
        let sudden = self.shots >= regular && round_over && a != b;
        // A shoot-out that nobody wins is drawn by lot elsewhere; here it stays a draw.
        if decided || sudden || self.shots >= 2 * regular {
            return self.end(court);
        }
        self.next_shot(court);
    }
}
