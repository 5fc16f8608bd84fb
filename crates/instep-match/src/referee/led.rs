//! A game that the official GameController leads: what the referee still does.

use instep_behaviour::SetPlay;

use super::{Court, Referee, Team};
use crate::ball::{Ball, Whereabouts};

impl Referee {
    /// Led by the official program: a ball that is out stays where it went out.
    pub(super) fn stop_outside(&mut self, court: &mut Court) {
        for &i in court.touches {
            self.last_touch = Some(i);
        }
        if court.whereabouts != Whereabouts::Inside {
            court.ball.velocity = [0.0; 2];
            let (x, y) = (court.field.length / 2.0, court.field.width / 2.0);
            let p = court.ball.position;
            self.spot = [p[0].clamp(-x, x), p[1].clamp(-y, y)];
        }
    }

    /// The official program has changed the state.
    pub(crate) fn mark(&mut self, time: f64) {
        self.since = time;
    }

    /// The official program begins a restart: the ball to its spot.
    pub(crate) fn place_for(&mut self, court: &mut Court, set_play: SetPlay, team: Option<Team>) {
        let field = court.field;
        let sign = |team: Team| if team == 0 { 1.0 } else { -1.0 };
        let side = if self.spot[1] >= 0.0 { 1.0 } else { -1.0 };
        let spot = match (set_play, team) {
            (SetPlay::None, _) => [0.0; 2],
            (SetPlay::PenaltyKick, Some(t)) => [sign(t) * (field.length / 2.0 - field.penalty_mark), 0.0],
            (SetPlay::CornerKick, Some(t)) => [sign(t) * field.length / 2.0, side * field.width / 2.0],
            (SetPlay::GoalKick, Some(t)) => {
                [-sign(t) * (field.length / 2.0 - field.goal_area.length), side * field.goal_area.width / 2.0]
            }
            (SetPlay::ThrowIn, _) => [self.spot[0], side * field.width / 2.0],
            _ => court.ball.position,
        };
        self.spot = spot;
        *court.ball = Ball { position: spot, velocity: [0.0; 2] };
    }
}
