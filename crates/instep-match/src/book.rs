//! A rule book: the numbers of `instep-field` and what the simulator's referee needs beside them.
//!
//! Where a book gives no number, the referee takes the one named here, and the rule is marked as ours.

use instep_field::Rules;

/// The numbers that a referee judges by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RuleBook {
    /// The league's.
    pub rules: Rules,
    /// READY, s. Simulation league: players are placed; ours.
    pub ready: f64,
    /// SET, s; ours: the referee whistles when all is quiet.
    pub set: f64,
    /// A restart must be taken within, s. HL: 30 s positioning.
    pub set_play: f64,
    /// Opponents have this long to leave the ball's circle, s. HL guarantees 15 s; HSL names none: ours.
    pub clear: f64,
    /// A player that is sent off stays out, s. Simulation league: moved; ours.
    pub sent_off: f64,
    /// Longer for each repeat, s.
    pub repeat: f64,
    /// A half of extra time, s; `None`: straight to the shoot-out.
    pub extra_half: Option<f64>,
    /// Shots of a shoot-out, before sudden death.
    pub shots: u32,
    /// A shot of the shoot-out must be taken within, s.
    pub shot_time: f64,
    /// Two opponents near the ball without progress: the nearer one of them goes, s.
    pub stuck_local: f64,
    /// Nobody touches the ball: dropped at the centre, s. HL has none: ours.
    pub stuck_global: f64,
    /// On the ground or outside for longer: sent off, s.
    pub incapable: f64,
    /// Holding the ball, s: field player, keeper.
    pub holding: [f64; 2],
    /// Walking into an opponent that does not come, s; ours.
    pub pushing: f64,
    /// Lead that ends a game.
    pub mercy: Option<u32>,
}

impl RuleBook {
    /// The book that the field of this name is played under.
    pub fn for_field(name: &str) -> Self {
        let rules = Rules::for_field(name);
        let humanoid_2025 = !name.starts_with("hsl-") && rules.removal.is_some();
        let simulation = rules.removal.is_none();
        Self {
            rules,
            ready: rules.ready.unwrap_or(15.0),
            set: 3.0,
            set_play: rules.set_play.unwrap_or(30.0),
            clear: if humanoid_2025 { 15.0 } else { 10.0 },
            sent_off: rules.removal.unwrap_or(10.0),
            repeat: rules.removal_repeat.unwrap_or(0.0),
            extra_half: if simulation {
                Some(180.0)
            } else if humanoid_2025 {
                Some(300.0)
            } else {
                None
            },
            shots: if humanoid_2025 { 5 } else { 3 },
            shot_time: rules.penalty_kick.unwrap_or(60.0),
            stuck_local: rules.stuck_local.unwrap_or(20.0),
            stuck_global: rules.stuck_global.unwrap_or(45.0),
            incapable: rules.get_up.unwrap_or(20.0),
            holding: [rules.ball_holding.unwrap_or(5.0), rules.keeper_holding.unwrap_or(10.0)],
            pushing: 1.0,
            mercy: rules.mercy_goals.map(|goals| goals as u32),
        }
    }
}
