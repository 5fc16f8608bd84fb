//! A ball that moves while the foot goes to the wind-up point: seen, judged, and followed.
//!
//! The sights of the ball are averaged (time constant [`SMOOTH`]). When the average has left the place for which the
//! stroke was planned by more than [`MOVED`], the stroke is shifted with it and its three places are checked, one a
//! tick, so that no tick takes long; if all are within reach, the kick goes on to the new place. If not, it goes on to
//! the old one. Only balls that were planned as resting are followed; a rolling one was forecast by the plan.

use nalgebra::Vector2;

use crate::dynamic::motion::Stroke;

/// Time constant of the average of the ball's sights, s.
const SMOOTH: f64 = 0.08;
/// Distance from the planned place at which a ball counts as moved, m.
const MOVED: f64 = 0.006;
/// Most new strokes in one kick.
const MOST: usize = 3;

/// What is known of the ball.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Follow {
    /// Average of the sights in the support sole's frame, m.
    seen: Option<Vector2<f64>>,
    /// Time of the last sight, s.
    last: f64,
    /// The place for which the present stroke was planned, m.
    target: Vector2<f64>,
    /// A stroke under test, its ball, and how many of its places are good.
    pub(crate) candidate: Option<(Stroke, Vector2<f64>, usize)>,
    tried: usize,
}

impl Follow {
    pub(crate) fn new(target: Vector2<f64>) -> Self {
        Self { seen: None, last: f64::NEG_INFINITY, target, candidate: None, tried: 0 }
    }

    /// Takes one sight: the ball in the support sole's frame, m.
    pub(crate) fn see(&mut self, time: f64, at: Vector2<f64>) {
        // NaN and sights seen before are left out.
        if !(at.x + at.y).is_finite() || !matches!(time.partial_cmp(&self.last), Some(o) if o.is_gt()) {
            return;
        }
        let share = ((time - self.last) / SMOOTH).min(1.0);
        self.seen = Some(self.seen.map_or(at, |old| old + (at - old) * (1.0 - (-share).exp())));
        self.last = time;
    }

    /// Proposes a new stroke when the ball has moved and none is under test.
    pub(crate) fn propose(&mut self, stroke: &Stroke) {
        let Some(seen) = self.seen.filter(|_| self.candidate.is_none() && self.tried < MOST) else { return };
        let by = seen - self.target;
        if by.norm() > MOVED {
            let mut shifted = *stroke;
            shifted.contact.x += by.x;
            shifted.contact.y += by.y;
            self.candidate = Some((shifted, seen, 0));
            self.tried += 1;
        }
    }

    /// The stroke under test has passed.
    pub(crate) fn accept(&mut self, ball: Vector2<f64>) {
        self.target = ball;
        self.candidate = None;
    }
}
