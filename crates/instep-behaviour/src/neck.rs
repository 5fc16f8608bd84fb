//! The neck tree, parallel to the body tree (paper 4, Fig 7 C): track, predict, search, re-localise.

use instep_field::wrap;

use crate::belief::Beliefs;
use crate::decision::{Gaze, GazeMode};
use crate::geometry::distance;
use crate::memory::BallState;

/// Landmarks are looked for this often, s, for this long, s.
const RELOCALISE_EVERY: f64 = 6.0;
const RELOCALISE_FOR: f64 = 0.6;
/// And at once when the own position is worse than this, m.
const POOR_POSITION: f64 = 0.5;
/// Nearer to the ball than this the eyes stay on it, m.
const EYES_ON_BALL: f64 = 1.2;
/// Of a sweep, s.
const SWEEP_PERIOD: f64 = 4.0;
/// Height of the camera that pitch is counted from, m.
const CAMERA_HEIGHT: f64 = 1.1;

/// The neck's state.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Neck {
    relocalised: f64,
    search_since: Option<f64>,
}

impl Neck {
    pub(crate) fn update(&mut self, beliefs: &Beliefs) -> Gaze {
        let limit = beliefs.view.neck_limit;
        let own = &beliefs.own.pose;
        let time = beliefs.time;
        if !beliefs.ball.is_known() {
            let since = *self.search_since.get_or_insert(time);
            let phase = (time - since) / SWEEP_PERIOD * std::f64::consts::TAU;
            return Gaze { mode: GazeMode::Search, yaw: limit * phase.sin(), pitch: 0.35 };
        }
        self.search_since = None;
        let ball = beliefs.ball.position;
        let d = distance(own.position(), ball);
        let since = time - self.relocalised;
        let poor = beliefs.own.position_std() > POOR_POSITION;
        if since > RELOCALISE_EVERY && d < EYES_ON_BALL && !poor {
            // Not now; as soon as the ball is far again.
        } else if since > RELOCALISE_EVERY || (poor && since > 2.0 * RELOCALISE_FOR) {
            self.relocalised = time;
        }
        let since = time - self.relocalised;
        let yaw = wrap(own.bearing_to(ball) - own.heading).clamp(-limit, limit);
        if since < RELOCALISE_FOR && time > RELOCALISE_FOR {
            // Along the field's length there are most landmarks.
            let goal = if own.heading.cos() >= 0.0 { 0.0 } else { std::f64::consts::PI };
            return Gaze { mode: GazeMode::Relocalise, yaw: wrap(goal - own.heading).clamp(-limit, limit), pitch: 0.2 };
        }
        let mode = if beliefs.ball.state == BallState::InView { GazeMode::Track } else { GazeMode::Predict };
        Gaze { mode, yaw, pitch: CAMERA_HEIGHT.atan2(d) }
    }
}
