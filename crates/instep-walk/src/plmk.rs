//! Perception-locked mid-swing kicking: when a kick is locked onto a step, with which foot, and where the foot is led.
//!
//! Source: paper 4, algorithm 1 and equations 13 and 14. A state machine and one formula; the swing's polynomial
//! ([`crate::swing`]) does the rest. The foothold after the kick stays the planner's.

use instep_motion::phase::Side;
use nalgebra::{Rotation2, Vector2};
use serde::{Deserialize, Serialize};

/// Touchdowns between one kick and the next (algorithm 1, line 1).
const REARM: usize = 3;
/// Speed ahead below which nothing is kicked, m/s (line 1).
const SLOWEST: f64 = -0.1;

/// Where a kick may be and how it strikes; lengths in m, in the axes of the kicking foot, from the support foot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Strike {
    /// Zone of the ball from the robot (the paper's Z): least and greatest x, and greatest distance across.
    pub zone: [f64; 3],
    /// Ball's x from the support foot at lift-off, least and greatest: nearer the swing has no room, farther it does not reach.
    pub window: [f64; 2],
    /// From the foot's reference point to the striking face, ahead.
    pub face: f64,
    /// How far the middle of the striking face lies outward of the foot's line (the paper's delta y).
    pub outward: f64,
    /// Height of the foot over the ground at the strike.
    pub height: f64,
    /// Box that the strike point is clipped to (the paper's B): least and greatest x, least and greatest distance across.
    pub reach: [f64; 4],
}

/// What algorithm 1 looks at in a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// Whether the robot is doing something else than walking.
    pub balancing: bool,
    /// A fresh sight of the ball from the robot, in its heading, m.
    pub ball: Option<[f64; 2]>,
    /// Speed ahead, m/s.
    pub speed: f64,
}

/// The KickCommander of algorithm 1.
#[derive(Debug, Clone, PartialEq)]
pub struct KickCommander {
    strike: Strike,
    /// r: a kick is wanted of the left, the right foot.
    requested: [bool; 2],
    /// p: a kick is under way.
    kicking: [bool; 2],
    touchdowns: usize,
}

impl KickCommander {
    /// Ready to kick.
    #[must_use]
    pub fn new(strike: Strike) -> Self {
        Self { strike, requested: [false; 2], kicking: [false; 2], touchdowns: REARM }
    }

    /// Lines 1 to 4: whether a kick is wanted, and of which foot. `foot` takes the choice of line 4 away.
    pub fn look(&mut self, sight: &Sight, foot: Option<Side>) {
        let Some([x, y]) = sight.ball else { return };
        let [least, greatest, across] = self.strike.zone;
        let inside = (least..=greatest).contains(&x) && y.abs() <= across;
        if sight.balancing || self.kicking != [false; 2] || sight.speed < SLOWEST || !inside || self.touchdowns < REARM
        {
            return;
        }
        let striker = foot.unwrap_or(if y > 0.0 { Side::Left } else { Side::Right });
        self.requested = [striker == Side::Left, striker == Side::Right];
    }

    /// Lines 5 and 6, on lift-off of `foot`: the strike point p* of equation 13 from the support foot in the odometry's
    /// axes, m, when a kick was requested and the ball is in the window. `ball` is the ball from the support foot in those
    /// axes, `heading` the kicking foot's, `power` how far the foot is led beyond the ball's surface (part of delta x).
    pub fn lift_off(
        &mut self,
        foot: Side,
        ball: Vector2<f64>,
        heading: f64,
        radius: f64,
        power: f64,
    ) -> Option<Vector2<f64>> {
        if !self.requested[foot as usize] {
            return None;
        }
        let strike = &self.strike;
        let ball = Rotation2::new(-heading) * ball;
        if !(strike.window[0]..=strike.window[1]).contains(&ball.x) {
            return None;
        }
        let left = if foot == Side::Left { 1.0 } else { -1.0 };
        let [near, far, inner, outer] = strike.reach;
        let x = (ball.x - radius - strike.face + power).clamp(near, far);
        let y = left * (left * ball.y - strike.outward).clamp(inner, outer);
        self.kicking[foot as usize] = true;
        Some(Rotation2::new(heading) * Vector2::new(x, y))
    }

    /// Line 7, on touchdown of `foot`.
    pub fn touch_down(&mut self, foot: Side) {
        if self.kicking[foot as usize] {
            self.requested = [false; 2];
            self.kicking[foot as usize] = false;
            self.touchdowns = 0;
        } else {
            self.touchdowns = (self.touchdowns + 1).min(REARM);
        }
    }

    /// Takes back what was requested and has not begun.
    pub fn cancel(&mut self) {
        self.requested = [false; 2];
    }

    /// The foot that kicks.
    #[must_use]
    pub fn kicking(&self) -> Option<Side> {
        [Side::Left, Side::Right].into_iter().find(|&side| self.kicking[side as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn commander() -> KickCommander {
        KickCommander::new(Strike {
            zone: [0.0, 0.8, 0.3],
            window: [0.1, 0.5],
            face: 0.13,
            outward: 0.0,
            height: 0.08,
            reach: [-0.15, 0.45, 0.05, 0.4],
        })
    }

    fn sight() -> Sight {
        Sight { balancing: false, ball: Some([0.3, 0.1]), speed: 0.6 }
    }

    fn lift(commander: &mut KickCommander, foot: Side) -> Option<Vector2<f64>> {
        commander.lift_off(foot, Vector2::new(0.3, 0.2), 0.0, 0.11, 0.1)
    }

    #[test]
    fn each_condition_of_line_one_alone_locks_the_kick() {
        for bad in [
            Sight { balancing: true, ..sight() },
            Sight { ball: None, ..sight() },
            Sight { ball: Some([0.9, 0.1]), ..sight() },
            Sight { ball: Some([0.3, 0.31]), ..sight() },
            Sight { speed: -0.11, ..sight() },
        ] {
            let mut commander = commander();
            commander.look(&bad, None);
            assert_eq!(lift(&mut commander, Side::Left), None, "{bad:?}");
        }
        let mut commander = commander();
        commander.look(&sight(), None);
        assert!(lift(&mut commander, Side::Left).is_some());
    }

    #[test]
    fn the_ball_on_the_right_arms_the_right_foot() {
        let mut commander = commander();
        commander.look(&Sight { ball: Some([0.3, -0.1]), ..sight() }, None);
        assert_eq!(lift(&mut commander, Side::Left), None);
        let strike = commander.lift_off(Side::Right, Vector2::new(0.3, -0.2), 0.0, 0.11, 0.1).unwrap();
        assert!((strike - Vector2::new(0.16, -0.2)).norm() < 1e-12);
    }

    #[test]
    fn three_touchdowns_re_arm() {
        let mut commander = commander();
        commander.look(&sight(), None);
        assert!(lift(&mut commander, Side::Left).is_some());
        commander.touch_down(Side::Left);
        for (touchdowns, foot) in [(0, Side::Right), (1, Side::Left), (2, Side::Right)] {
            commander.look(&sight(), None);
            assert_eq!(lift(&mut commander, Side::Left), None, "after {touchdowns}");
            commander.touch_down(foot);
        }
        commander.look(&sight(), None);
        assert!(lift(&mut commander, Side::Left).is_some());
    }

    #[test]
    fn the_strike_point_turns_with_the_foot_and_is_clipped() {
        let mut commander = commander();
        commander.look(&sight(), None);
        let turn = Rotation2::new(0.4);
        let strike = commander.lift_off(Side::Left, turn * Vector2::new(0.45, 0.02), 0.4, 0.11, 0.5).unwrap();
        assert!((turn.inverse() * strike - Vector2::new(0.45, 0.05)).norm() < 1e-12);
    }
}
