//! A kick's own way: from the beginning of its run-up past the ball, wide enough for the robot that kicks.
//!
//! The target knows where the ball may go; the body needs more room than a ball. Where an opponent stands in its way, the kick is
//! turned as little as it takes, and then it is a soft one, since it goes where nothing was aimed at.

use instep_behaviour::Point;
use instep_field::Pose;

/// How far past the ball the body goes before it has slowed down, m.
const PAST: f64 = 0.7;
/// Room on each side of the body's middle to an opponent's, m.
const ROOM: f64 = 0.6;
/// How far a kick is turned at most, rad, and by which steps.
const MOST: f64 = 1.3;
const STEP: f64 = 0.13;
/// What leaving the turn that was chosen before costs, rad.
const STAY: f64 = 0.2;

/// By how much (rad) a kick of the ball at `ball` in `direction` (rad) is to be turned, so that nobody of `others` stands in the
/// way of a run-up of `run_up` m; `before` is the turn chosen last. 0 where no turn helps.
pub(crate) fn turn(
    ball: Point,
    direction: f64,
    run_up: f64,
    others: impl Iterator<Item = Point> + Clone,
    before: f64,
) -> f64 {
    let steps = (MOST / STEP) as i32;
    let cost = |turn: f64| turn.abs() + STAY.min((turn - before).abs());
    let free = |turn: &f64| room(ball, direction + turn, run_up, others.clone()) > ROOM;
    let turns = (-steps..=steps).map(|k| f64::from(k) * STEP).filter(free);
    turns.min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or(0.0)
}

/// Least distance of `others` from the way of a body, m.
fn room(ball: Point, direction: f64, run_up: f64, others: impl Iterator<Item = Point>) -> f64 {
    let line = Pose::new(ball[0], ball[1], direction);
    let distance = |other| {
        let [along, beside] = line.local_from_outer(other);
        (along - PAST).max(-run_up - along).max(0.0).hypot(beside)
    };
    others.map(distance).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(others: &[Point], before: f64) -> f64 {
        turn([1.0, 1.0], 0.0, 2.0, others.iter().copied(), before)
    }

    #[test]
    fn a_kick_past_nobody_is_not_turned_and_one_into_somebody_is() {
        assert_eq!(turned(&[], 0.0), 0.0);
        // Far ahead the ball alone passes.
        assert_eq!(turned(&[[3.2, 1.0], [1.0, 2.0]], 0.0), 0.0);
        let past = turned(&[[1.6, 0.6]], 0.0);
        assert!(past > 0.2, "away from the one on the right: {past}");
        // In the way of the run-up: the robot begins on the other side of its line.
        let behind = turned(&[[-0.5, 1.3]], 0.0);
        assert!(behind.abs() > 0.1, "{behind}");
        assert!(turned(&[[-0.5, 0.7]], 0.0) * behind < 0.0);
    }

    #[test]
    fn what_was_chosen_is_kept_while_it_is_as_good_and_where_nothing_helps_nothing_is_done() {
        let ahead = [[1.65, 1.0]];
        let (left, right) = (turned(&ahead, 1.3), turned(&ahead, -1.3));
        assert!(left > 0.0 && right < 0.0, "{left} {right}");
        assert_eq!(turned(&[[1.3, 1.1]], 0.4), 0.0, "nobody passes one so near to the ball");
    }
}
