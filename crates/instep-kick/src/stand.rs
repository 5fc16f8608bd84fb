//! Where a robot could stand to kick a ball that it cannot kick from where it stands: what goes with a refusal, for a caller that can
//! walk there.
//!
//! The places are those from which the kick is easy: the ball a hand's breadth before either foot, the kick straight ahead of the
//! robot or up to half a right angle aside. They are tried with the engine's own plan, the least way first.

use serde::Serialize;

use crate::request::KickRequest;
use crate::whole_body::body::Body;
use crate::whole_body::foot::wrap;

/// Directions of the kick as seen from the place, rad.
const TURNS: [f64; 5] = [0.0, 0.35, -0.35, 0.7, -0.7];
/// Gaps between toes and ball, in units of the leg's length.
const GAPS: [f64; 2] = [0.12, 0.3];
/// What a turn by 1 rad counts as, m.
const TURN: f64 = 0.2;
/// Speed below which a ball counts as resting, m/s.
const RESTS: f64 = 0.02;

/// A place to stand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Standing {
    /// The ground point midway between the soles, in the present footprint frame, m.
    pub position: [f64; 2],
    /// Mean heading of the soles there, rad from the present one to the left.
    pub heading: f64,
}

impl Standing {
    /// `request` as it is asked of a robot that stands there.
    #[must_use]
    pub fn seen_from(&self, request: &KickRequest) -> KickRequest {
        let (sin, cos) = self.heading.sin_cos();
        let turned = |[x, y]: [f64; 2]| [x * cos + y * sin, y * cos - x * sin];
        let ball = [0, 1].map(|k| request.ball[k] - self.position[k]);
        KickRequest {
            ball: turned(ball),
            ball_velocity: turned(request.ball_velocity),
            direction: wrap(request.direction - self.heading),
            ..*request
        }
    }

    /// The place in words.
    #[must_use]
    pub fn text(&self) -> String {
        let [x, y] = self.position;
        let way =
            |far: f64, plus: &str, minus: &str| format!("{:.2} m {}", far.abs(), if far < 0.0 { minus } else { plus });
        format!(
            "from {}, {}, turned {:.0} degrees to the {}, it could",
            way(x, "ahead", "back"),
            way(y, "to the left", "to the right"),
            self.heading.to_degrees().abs(),
            if self.heading < 0.0 { "right" } else { "left" }
        )
    }
}

/// The nearest of the easy places from which the engine `can`; `None` where there is none, or the ball rolls and would be elsewhere.
pub(crate) fn nearest(
    body: &Body,
    request: &KickRequest,
    mut can: impl FnMut(&KickRequest) -> bool,
) -> Option<Standing> {
    let rolls = request.ball_velocity[0].hypot(request.ball_velocity[1]) > RESTS;
    if rolls || request.check().is_err() {
        return None;
    }
    let mut places = Vec::with_capacity(4 * TURNS.len());
    for turn in TURNS {
        let heading = wrap(request.direction - turn);
        let (sin, cos) = heading.sin_cos();
        for side in [1.0, -1.0] {
            for gap in GAPS {
                let x = body.feet[0].outline_x[1] + body.ball.radius + gap * body.leg_length;
                let y = side * body.half_width;
                let position = [request.ball[0] - x * cos + y * sin, request.ball[1] - x * sin - y * cos];
                places.push(Standing { position, heading });
            }
        }
    }
    let way = |place: &Standing| place.position[0].hypot(place.position[1]) + TURN * place.heading.abs();
    places.sort_by(|a, b| way(a).total_cmp(&way(b)));
    places.into_iter().find(|place| can(&place.seen_from(request)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_turned_and_moved_with_the_place() {
        let asked = KickRequest::new([0.3, 0.4], 1.0, 0.8);
        let place = Standing { position: [0.3, 0.1], heading: std::f64::consts::FRAC_PI_2 };
        let seen = place.seen_from(&asked);
        assert!((seen.ball[0] - 0.3).abs() < 1e-12 && seen.ball[1].abs() < 1e-12, "{seen:?}");
        assert!((seen.direction - (1.0 - std::f64::consts::FRAC_PI_2)).abs() < 1e-12);
        assert_eq!(place.text(), "from 0.30 m ahead, 0.10 m to the left, turned 90 degrees to the left, it could");
    }
}
