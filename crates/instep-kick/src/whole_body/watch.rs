//! Where the ball is and how it rolls, from its sights: an alpha-beta filter (Kalata 1984) in the support sole's frame.
//!
//! A sight far from where the ball should be is a ball that was moved: the filter starts anew there, at rest.

use nalgebra::Vector2;

use crate::ball::BallModel;

/// Share of a surprise that moves the place.
const ALPHA: f64 = 0.25;
/// Share of a surprise that changes the speed.
const BETA: f64 = 0.01;
/// A surprise this large is a ball that was moved, m.
const JUMP: f64 = 0.03;
/// Speed under which a ball counts as resting, m/s.
const RESTING: f64 = 0.03;

/// What is known of the ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Watch {
    place: Vector2<f64>,
    velocity: Vector2<f64>,
    /// Time of the last sight, s.
    last: f64,
    /// Whether it was said to roll.
    rolls: bool,
}

impl Watch {
    /// A ball at `place` (m) with `velocity` (m/s) at `time` (s).
    pub(crate) fn new(place: Vector2<f64>, velocity: Vector2<f64>, time: f64) -> Self {
        Self { place, velocity, last: time, rolls: velocity.norm() > RESTING }
    }

    /// Takes a sight at `time` (s): the ball in the support sole's frame, m. What is not finite is left out.
    pub(crate) fn see(&mut self, time: f64, at: Vector2<f64>, model: &BallModel) {
        let dt = time - self.last;
        // Written so that a NaN is left out.
        if !(at.x + at.y).is_finite() || !(dt > 1e-6) {
            return;
        }
        (self.place, self.velocity) = self.after(dt, model);
        let off = at - self.place;
        if off.norm() > JUMP {
            (self.place, self.velocity) = (at, Vector2::zeros());
            self.rolls = false;
        } else {
            self.place += off * ALPHA;
            if self.rolls {
                self.velocity += off * (BETA / dt);
            }
        }
        self.last = time;
    }

    /// Place (m) and velocity (m/s) after `time` (s).
    fn after(&self, time: f64, model: &BallModel) -> (Vector2<f64>, Vector2<f64>) {
        let (place, velocity) = model.roll(self.place.into(), self.velocity.into(), time);
        (place.into(), velocity.into())
    }

    /// Place (m) and velocity (m/s) at `time` (s).
    pub(crate) fn at(&self, time: f64, model: &BallModel) -> (Vector2<f64>, Vector2<f64>) {
        let (place, velocity) = self.after(time - self.last, model);
        (place, if velocity.norm() > RESTING { velocity } else { Vector2::zeros() })
    }

    /// Whether it rolls.
    pub(crate) fn rolls(&self) -> bool {
        self.rolls && self.velocity.norm() > RESTING
    }
}
