//! What players of a team tell each other. How it is put into bytes is the adapter's: each league has its own limits.

use instep_behaviour::Mate;

/// What a player says to its team.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Message {
    /// Oneself: number, pose, role, time to the ball, whether one can play.
    pub mate: Mate,
    /// The ball, where one knows it.
    pub ball: Option<HeardBall>,
}

/// The ball by what a mate says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeardBall {
    /// In the team's field frame, m.
    pub position: [f64; 2],
    /// m/s.
    pub velocity: [f64; 2],
    /// Since the mate saw it, s.
    pub age: f64,
}

impl Message {
    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let ball = self.ball.is_none_or(|ball| {
            ball.position.iter().chain(&ball.velocity).all(|x| x.is_finite()) && ball.age.is_finite()
        });
        ball && self.mate.pose.is_finite() && self.mate.time_to_ball.is_finite()
    }
}
