//! How a standing body gets going: over to the foot that is to be lifted first, then off from there to the first support foot.
//!
//! A gait from foot to foot begins in the middle of the feet with the speed of its sway. A standing body gets that speed from the ground alone, and
//! the ground pushes only where the feet are: the centre of mass goes slowly toward the foot that will be lifted, as far as it has to, and from
//! there it falls as a pendulum on that foot. Source: own; the pendulum is that of [`crate::footsteps`]. The feet need not be side by side.

use nalgebra::Vector2;

/// Where the ground pushes the body off, as a share of the way from the middle of the feet to the foot that is lifted.
const PUSH: f64 = 0.9;
/// Most that the body goes toward that point, as a share of the way.
const FARTHEST: f64 = 0.8;

/// A way of the centre of mass from the middle of the feet, in the heading's axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Start {
    /// Where it begins, where it turns back, m.
    from: Vector2<f64>,
    turns: Vector2<f64>,
    /// Where the ground pushes it off, m from the middle.
    push: Vector2<f64>,
    /// 1/s.
    lambda: f64,
    /// Times of the two parts, s.
    parts: [f64; 2],
}

impl Start {
    /// From rest at `from` (m), over the middle of the feet toward the support foot at `foot` (m; the other one is opposite) with the speed
    /// `speed` (m/s, to the left) of a pendulum with `lambda` (1/s); the way to where it turns takes `time` (s).
    #[must_use]
    pub fn new(from: Vector2<f64>, foot: Vector2<f64>, speed: f64, lambda: f64, time: f64) -> Self {
        let push = -PUSH * foot;
        // Orbital energy: (push - turns)^2 = push^2 - (speed / lambda)^2, across.
        let rest = (push.y * push.y - (speed / lambda).powi(2)).max(0.0).sqrt();
        let share = (1.0 - rest / push.y.abs().max(1e-6)).min(FARTHEST);
        let falls = (1.0 / (1.0 - share)).acosh() / lambda;
        Self { from, turns: push * share, push, lambda, parts: [time, falls] }
    }

    /// How long it takes, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.parts[0] + self.parts[1]
    }

    /// Position (m), velocity (m/s) and acceleration (m/s^2) at `time` (s) from its beginning.
    #[must_use]
    pub fn at(&self, time: f64) -> [Vector2<f64>; 3] {
        let [shift, falls] = self.parts;
        if time < shift {
            // The quintic from rest to rest.
            let s = (time / shift).max(0.0);
            let r = 1.0 - s;
            let way = self.turns - self.from;
            [
                self.from + way * (s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)),
                way * (30.0 * s * s * r * r / shift),
                way * (60.0 * s * r * (1.0 - 2.0 * s) / (shift * shift)),
            ]
        } else {
            let angle = self.lambda * (time - shift).min(falls);
            let arm = self.turns - self.push;
            [
                self.push + arm * angle.cosh(),
                arm * (self.lambda * angle.sinh()),
                arm * (self.lambda * self.lambda * angle.cosh()),
            ]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_ends_in_the_middle_with_its_speed_and_is_a_motion() {
        let (lambda, speed) = (3.73, 0.25);
        for side in [1.0, -1.0] {
            let foot = Vector2::new(0.03 * side, 0.1 * side);
            let start = Start::new(Vector2::new(0.01, -0.005), foot, speed * side, lambda, 0.5);
            let [position, velocity, _] = start.at(start.duration());
            assert!(position.norm() < 1e-9 && (velocity.y - speed * side).abs() < 1e-9, "{position} {velocity}");
            // Velocity and acceleration are derivatives, and the ground pushes between the feet all the time.
            let h = 1e-5;
            for k in 1..80 {
                let time = start.duration() * f64::from(k) / 80.0;
                if (time - 0.5).abs() < 0.02 {
                    continue;
                }
                let [before, now, after] = [time - h, time, time + h].map(|t| start.at(t));
                assert!(((after[0] - before[0]) / (2.0 * h) - now[1]).norm() < 1e-6);
                assert!(((after[1] - before[1]) / (2.0 * h) - now[2]).norm() < 1e-4);
                let pressure = now[0] - now[2] / (lambda * lambda);
                assert!(pressure.y.abs() < 0.1, "{time}: {pressure}");
            }
        }
    }

    #[test]
    fn a_speed_that_the_feet_cannot_give_is_approached() {
        let start = Start::new(Vector2::zeros(), Vector2::new(0.0, 0.05), 2.0, 5.0, 0.5);
        assert!(start.duration().is_finite());
        let speed = start.at(start.duration())[1].y;
        assert!(speed > 0.1 && speed < 2.0, "{speed}");
    }
}
