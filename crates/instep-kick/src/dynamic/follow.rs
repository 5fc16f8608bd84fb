//! A ball that moves while the foot goes to the wind-up point: seen or told, judged, and followed.
//!
//! The sights of the ball are filtered ([`Watch`]); what counts is where the ball will be at the contact. When that has left the place
//! for which the stroke was planned by more than [`MOVED`], the stroke is shifted with it and its three places are checked, one a
//! tick, so that no tick takes long; if all are within reach, the kick goes on to the new place. If not, it goes on to the old one.

use nalgebra::Vector2;

use crate::ball::BallModel;
use crate::dynamic::motion::Stroke;
use crate::whole_body::watch::Watch;

/// Distance from the planned place at which a ball counts as moved, m.
const MOVED: f64 = 0.006;
/// Most new strokes in one kick, of a ball at rest and of one that rolls.
const MOST: [usize; 2] = [3, 8];

/// What is known of the ball.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Follow {
    /// The ball in the support sole's frame.
    watch: Watch,
    /// Whether something was seen or told since the plan.
    news: bool,
    /// The place for which the present stroke was planned, m.
    target: Vector2<f64>,
    /// A stroke under test, its ball, and how many of its places are good.
    pub(crate) candidate: Option<(Stroke, Vector2<f64>, usize)>,
    tried: usize,
}

impl Follow {
    /// Of a ball that the plan wants at `target` (m) at the contact.
    pub(crate) fn new(target: Vector2<f64>, watch: Watch) -> Self {
        Self { watch, news: false, target, candidate: None, tried: 0 }
    }

    /// Takes one sight: the ball in the support sole's frame, m.
    pub(crate) fn see(&mut self, time: f64, at: Vector2<f64>, model: &BallModel) {
        self.watch.see(time, at, model);
        self.news = true;
    }

    /// Takes somebody's word for where the ball is.
    pub(crate) fn told(&mut self, watch: Watch) {
        (self.watch, self.news, self.candidate, self.tried) = (watch, true, None, 0);
    }

    /// Proposes a new stroke when the ball will be elsewhere at the contact, at `contact` (s, the sensors' time), and none is under
    /// test.
    pub(crate) fn propose(&mut self, stroke: &Stroke, contact: f64, model: &BallModel) {
        let most = MOST[usize::from(self.watch.rolls())];
        if !self.news || self.candidate.is_some() || self.tried >= most {
            return;
        }
        let (ball, _) = self.watch.at(contact, model);
        let by = ball - self.target;
        if by.norm() > MOVED {
            let mut shifted = *stroke;
            shifted.contact.x += by.x;
            shifted.contact.y += by.y;
            shifted.ball += by;
            self.candidate = Some((shifted, ball, 0));
            self.tried += 1;
        }
    }

    /// The stroke under test has passed.
    pub(crate) fn accept(&mut self, ball: Vector2<f64>) {
        self.target = ball;
        self.candidate = None;
    }
}
