//! Who does what: the player with the least time to the ball strikes, number 1 keeps the goal, the others take the
//! nearest free place. Each player decides for itself by what all said last, and comes to the same result.
//!
//! Against flicker: who has the role is some seconds better than it is (hysteresis), and a role lasts at least its
//! dwell time. Ties go to the lower number.

use serde::{Deserialize, Serialize};

use crate::belief::Beliefs;
use crate::body::time_to_ball;
use crate::geometry::distance;
use crate::positions;
use crate::situation::Pitch;

/// What a player does for its team.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Keeps the goal.
    Keeper,
    /// Goes to the ball.
    Striker,
    /// Stands between the ball and the own goal.
    Defender,
    /// Waits where the ball may be played to.
    #[default]
    Supporter,
}

impl Role {
    /// Its name in tables and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Keeper => "keeper",
            Self::Striker => "striker",
            Self::Defender => "defender",
            Self::Supporter => "supporter",
        }
    }
}

/// The present role and since when.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RoleState {
    pub role: Role,
    since: f64,
    set: bool,
}

impl RoleState {
    /// Chooses the role for this tick.
    pub(crate) fn update(&mut self, pitch: &Pitch, beliefs: &Beliefs) -> Role {
        let settings = &pitch.strategy.roles;
        let wanted = wanted(pitch, beliefs, self.role);
        let lasts = beliefs.time - self.since < settings.dwell;
        // A keeper is one for the whole game; nobody waits for the dwell time to become or stop being one.
        let fixed = wanted == Role::Keeper || self.role == Role::Keeper;
        if !self.set || (wanted != self.role && (fixed || !lasts)) {
            *self = Self { role: wanted, since: beliefs.time, set: true };
        }
        self.role
    }
}

fn wanted(pitch: &Pitch, beliefs: &Beliefs, present: Role) -> Role {
    let settings = &pitch.strategy.roles;
    if settings.keeper && beliefs.number == 1 {
        return Role::Keeper;
    }
    let plays = |number: u8| !(settings.keeper && number == 1);
    let bonus = |role: Role| if role == Role::Striker { settings.hysteresis } else { 0.0 };
    let able = |m: &&crate::Mate| plays(m.number) && m.able && !m.penalised;
    let mine = time_to_ball(&beliefs.own.pose, beliefs.ball.position) - bonus(present);
    let lost = !beliefs.ball.is_known();
    let nearer = beliefs.mates.iter().filter(able).any(|m| {
        let theirs = m.time_to_ball - bonus(m.role);
        theirs < mine || (theirs == mine && m.number < beliefs.number)
    });
    let taken = beliefs.mates.iter().filter(able).any(|m| m.role == Role::Striker);
    if (!nearer && !lost) || (lost && !taken) {
        return Role::Striker;
    }
    // Places in order; each goes to the nearest of those that are left, the striker left out.
    let best_mate = beliefs.mates.iter().filter(able).min_by(|a, b| {
        (a.time_to_ball - bonus(a.role)).total_cmp(&(b.time_to_ball - bonus(b.role))).then(a.number.cmp(&b.number))
    });
    let striker = best_mate.map_or(0, |m| m.number);
    let mut left: arrayvec::ArrayVec<(u8, crate::Point, Role), 12> = arrayvec::ArrayVec::new();
    left.push((beliefs.number, beliefs.own.pose.position(), present));
    for mate in beliefs.mates.iter().filter(able).filter(|m| m.number != striker).take(11) {
        left.push((mate.number, mate.pose.position(), mate.role));
    }
    for slot in 0..left.len() {
        let role = if slot.is_multiple_of(2) == settings.defender_first { Role::Defender } else { Role::Supporter };
        let place = positions::place(pitch, beliefs, role, slot / 2).position();
        let cost =
            |(_, at, has): &(u8, crate::Point, Role)| distance(*at, place) - if *has == role { 1.0 } else { 0.0 };
        let Some(index) =
            (0..left.len()).min_by(|&a, &b| cost(&left[a]).total_cmp(&cost(&left[b])).then(left[a].0.cmp(&left[b].0)))
        else {
            break;
        };
        if left.swap_remove(index).0 == beliefs.number {
            return role;
        }
        if left.is_empty() {
            break;
        }
    }
    Role::Supporter
}
