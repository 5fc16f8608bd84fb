//! The ball played with the walk itself: to a place behind it, then straight through it, on and on.
//!
//! For robots without a kick within the gait, and for a dribble. Knows no opponents: the way behind the ball is navigation's.

use instep_field::{Pose, wrap};

use crate::settings::PushSettings;

/// What the push wants of the legs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// To this pose (field frame), round the ball.
    Behind(Pose),
    /// With this velocity (robot frame, m/s, m/s, rad/s), through the ball.
    Through([f64; 3]),
}

/// Remembers whether it is on its way through the ball, and by which foot.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Push {
    through: bool,
    /// +1: the left foot, -1: the right one; chosen anew once the ball is far.
    foot: Option<f64>,
}

impl Push {
    /// Whether it is on its way through the ball.
    #[must_use]
    pub fn is_through(&self) -> bool {
        self.through
    }

    /// Something else is done.
    pub fn stop(&mut self) {
        *self = Self::default();
    }

    /// What to do at `pose` with a ball at `ball` (field frame, m) that is to go in `direction` (rad).
    pub fn way(&mut self, settings: &PushSettings, pose: &Pose, ball: [f64; 2], direction: f64) -> Way {
        let line = Pose::new(ball[0], ball[1], direction);
        // The robot from the ball, along and beside the wanted direction.
        let [along, beside] = line.local_from_outer(pose.position());
        if along.hypot(beside) > 2.0 * settings.start {
            self.foot = None;
        }
        // Where the robot is already, the ball lies before the nearer foot.
        let foot = *self.foot.get_or_insert(if beside > 0.0 { -1.0 } else { 1.0 });
        let own = -foot * settings.outward;
        let turned = wrap(direction - pose.heading);
        let off = beside - own;
        let within = |errors: [f64; 2]| off.abs() < errors[0] && turned.abs() < errors[1];
        self.through = if self.through {
            within(settings.end) && along < 0.15
        } else {
            within(settings.begin) && along < -0.1 && along > -2.0 * settings.start
        };
        if !self.through {
            let [x, y] = line.outer_from_local([-settings.start, own]);
            return Way::Behind(Pose::new(x, y, direction));
        }
        // Across the line, in the robot's own axes: its heading is nearly the line's.
        let across = -settings.steer[0] * off;
        let speed = settings.speed * (1.0 - 0.5 * (off.abs() / settings.end[0]).min(1.0));
        let (s, c) = turned.sin_cos();
        Way::Through([c * speed - s * across, s * speed + c * across, settings.steer[1] * turned])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot that does what it is told, a ball that is shoved ahead by the foot behind it.
    fn dribble(mut pose: Pose, mut ball: [f64; 2], goal: [f64; 2], seconds: u32) -> [f64; 2] {
        let (settings, mut push) = (PushSettings::default(), Push::default());
        for _ in 0..seconds * 50 {
            let direction = (goal[1] - ball[1]).atan2(goal[0] - ball[0]);
            let velocity = match push.way(&settings, &pose, ball, direction) {
                Way::Through(velocity) => velocity,
                Way::Behind(to) => {
                    let [x, y] = pose.local_from_outer(to.position());
                    let far = x.hypot(y).max(0.3);
                    [0.5 * x / far, 0.5 * y / far, 1.5 * wrap(to.heading - pose.heading)]
                }
            };
            pose = pose.then(&Pose::new(velocity[0] * 0.02, velocity[1] * 0.02, velocity[2] * 0.02));
            let [ahead, beside] = pose.local_from_outer(ball);
            if (0.0..0.2).contains(&ahead) && (beside.abs() - settings.outward).abs() < 0.08 {
                ball = pose.outer_from_local([0.35, beside]);
            }
        }
        ball
    }

    #[test]
    fn it_brings_the_ball_to_the_goal_from_behind_it() {
        for y in [-0.3, 0.0, 0.4] {
            let ball = dribble(Pose::new(-1.0, y, 0.2), [0.0, 0.0], [5.0, 1.0], 20);
            assert!(ball[0] > 4.0, "{ball:?}");
        }
    }

    #[test]
    fn before_the_ball_or_turned_away_it_goes_behind_it_first() {
        let settings = PushSettings::default();
        for pose in [Pose::new(1.0, 0.0, 0.0), Pose::new(-0.5, 0.0, 1.0), Pose::new(-0.5, 0.4, 0.0)] {
            let Way::Behind(to) = Push::default().way(&settings, &pose, [0.0, 0.0], 0.0) else {
                panic!("{pose:?} walks through the ball");
            };
            assert!((to.x + settings.start).abs() < 1e-12 && (to.y.abs() - settings.outward).abs() < 1e-12);
        }
    }
}
