//! The ball on the ground: rolls, slows down, rebounds from players and goal posts.

use instep_field::Field;

/// Deceleration of a ball that rolls on turf, m/s^2 (B-Human's planner: 0.30).
pub(crate) const ROLLING_DECELERATION: f64 = 0.30;
/// Speed kept at a rebound from a robot and from a post.
const REBOUND_ROBOT: f64 = 0.3;
const REBOUND_POST: f64 = 0.6;
/// Radius of a goal post, m.
const POST: f64 = 0.05;
/// Longest way of one sub-step, m.
const SUB_STEP: f64 = 0.08;

/// The ball.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Ball {
    /// m.
    pub position: [f64; 2],
    /// m/s.
    pub velocity: [f64; 2],
}

/// A robot's feet, or a robot on the ground.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Obstacle {
    pub center: [f64; 2],
    pub velocity: [f64; 2],
    pub radius: f64,
}

/// Where the ball is after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Whereabouts {
    Inside,
    /// Over a goal line between the posts: +1 at +x.
    Goal(i8),
    /// Over a goal line beside the goal: +1 at +x.
    GoalLine(i8),
    TouchLine,
}

impl Ball {
    /// m/s.
    pub fn speed(&self) -> f64 {
        self.velocity[0].hypot(self.velocity[1])
    }

    /// Rolls on for `dt`; `touched` is told the index of each obstacle that it meets. Stops at the first line crossed.
    pub(crate) fn step(
        &mut self,
        dt: f64,
        field: &Field,
        obstacles: &[Obstacle],
        mut touched: impl FnMut(usize),
    ) -> Whereabouts {
        let speed = self.speed();
        let parts = (speed * dt / SUB_STEP).ceil().max(1.0);
        let h = dt / parts;
        for _ in 0..parts as usize {
            let speed = self.speed();
            if speed > 0.0 {
                let kept = (speed - ROLLING_DECELERATION * h).max(0.0) / speed;
                self.velocity = self.velocity.map(|v| v * kept);
                self.position[0] += self.velocity[0] * h;
                self.position[1] += self.velocity[1] * h;
            }
            for (i, obstacle) in obstacles.iter().enumerate() {
                if self.rebound(obstacle, field.ball.radius, REBOUND_ROBOT) {
                    touched(i);
                }
            }
            for sign in [-1.0, 1.0] {
                for y in [-field.goal.width / 2.0, field.goal.width / 2.0] {
                    let post = Obstacle { center: [sign * field.length / 2.0, y], velocity: [0.0; 2], radius: POST };
                    self.rebound(&post, field.ball.radius, REBOUND_POST);
                }
            }
            let whereabouts = self.whereabouts(field);
            if whereabouts != Whereabouts::Inside {
                return whereabouts;
            }
        }
        Whereabouts::Inside
    }

    /// The whole ball must be over a line.
    pub(crate) fn whereabouts(&self, field: &Field) -> Whereabouts {
        let [x, y] = self.position;
        let r = field.ball.radius;
        if x.abs() > field.length / 2.0 + r {
            let end = if x > 0.0 { 1 } else { -1 };
            return if y.abs() < field.goal.width / 2.0 { Whereabouts::Goal(end) } else { Whereabouts::GoalLine(end) };
        }
        if y.abs() > field.width / 2.0 + r { Whereabouts::TouchLine } else { Whereabouts::Inside }
    }

    /// Out of the obstacle and away from it, if they meet.
    fn rebound(&mut self, obstacle: &Obstacle, radius: f64, kept: f64) -> bool {
        let off = [self.position[0] - obstacle.center[0], self.position[1] - obstacle.center[1]];
        let (square, reach) = (off[0] * off[0] + off[1] * off[1], obstacle.radius + radius);
        if square >= reach * reach {
            return false;
        }
        let d = square.sqrt();
        let normal = if d > 1e-9 { [off[0] / d, off[1] / d] } else { [1.0, 0.0] };
        self.position = [obstacle.center[0] + reach * normal[0], obstacle.center[1] + reach * normal[1]];
        let relative = [self.velocity[0] - obstacle.velocity[0], self.velocity[1] - obstacle.velocity[1]];
        let closing = relative[0] * normal[0] + relative[1] * normal[1];
        if closing < 0.0 {
            for (v, n) in self.velocity.iter_mut().zip(normal) {
                *v -= (1.0 + kept) * closing * n;
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_rolls_as_far_as_its_speed_says() {
        let field = Field::named("fifa").unwrap();
        let mut ball = Ball { position: [0.0; 2], velocity: [3.0, 0.0] };
        for _ in 0..2000 {
            ball.step(0.02, &field, &[], |_| ());
        }
        assert_eq!(ball.speed(), 0.0);
        assert!((ball.position[0] - 9.0 / 0.6).abs() < 0.05, "{:?}", ball.position);
    }

    #[test]
    fn a_fast_ball_does_not_pass_through_a_player() {
        let field = Field::named("adult-2024").unwrap();
        let player = Obstacle { center: [1.0, 0.05], velocity: [0.0; 2], radius: 0.14 };
        let mut ball = Ball { position: [0.0; 2], velocity: [12.0, 0.0] };
        let mut touches = 0;
        for _ in 0..20 {
            ball.step(0.02, &field, &[player], |_| touches += 1);
        }
        assert!(touches > 0 && ball.velocity[0] < 0.0, "{ball:?}");
        // A rebound loses energy.
        assert!(ball.speed() < 0.5 * 12.0);
    }

    #[test]
    fn goals_count_between_the_posts_when_the_whole_ball_is_over() {
        let field = Field::named("adult-2024").unwrap();
        let at = |x: f64, y: f64| Ball { position: [x, y], velocity: [0.0; 2] }.whereabouts(&field);
        assert_eq!(at(7.05, 0.0), Whereabouts::Inside);
        assert_eq!(at(7.12, 0.0), Whereabouts::Goal(1));
        assert_eq!(at(-7.12, 1.2), Whereabouts::Goal(-1));
        assert_eq!(at(-7.12, 1.5), Whereabouts::GoalLine(-1));
        assert_eq!(at(0.0, 4.62), Whereabouts::TouchLine);
        assert_eq!(at(0.0, 4.6), Whereabouts::Inside);
    }
}
