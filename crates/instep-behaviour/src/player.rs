//! One robot's head: body tree and neck tree side by side.

use std::sync::Arc;

use arrayvec::ArrayVec;
use instep_field::Field;

use crate::BehaviourError;
use crate::belief::{Beliefs, GameState};
use crate::body::Body;
use crate::decision::{Action, Decision, Motion};
use crate::kick::KickTable;
use crate::neck::Neck;
use crate::roles::RoleState;
use crate::situation::Pitch;
use crate::strategy::Strategy;

/// One robot's head. What it remembers: its role, its target, where its neck is in a sweep.
#[derive(Debug, Clone)]
pub struct Player {
    field: Arc<Field>,
    strategy: Arc<Strategy>,
    kicks: Arc<KickTable>,
    role: RoleState,
    body: Body,
    neck: Neck,
    game: Option<GameState>,
}

impl Player {
    /// A player that has just been switched on.
    ///
    /// # Errors
    /// [`BehaviourError::Value`] where the table has no kick or a number cannot be.
    pub fn new(field: Arc<Field>, strategy: Arc<Strategy>, kicks: Arc<KickTable>) -> Result<Self, BehaviourError> {
        strategy.validate(&strategy.name)?;
        kicks.validate("kicks")?;
        Ok(Self {
            field,
            strategy,
            kicks,
            role: RoleState::default(),
            body: Body::default(),
            neck: Neck::default(),
            game: None,
        })
    }

    /// What to do now. Call it at 5 to 20 Hz with rising times.
    pub fn decide(&mut self, beliefs: &Beliefs) -> Decision {
        let pitch = Pitch { field: &self.field, strategy: &self.strategy, kicks: &self.kicks.kick };
        let changed = |g: GameState| {
            (g.state, g.set_play, g.kicking) != (beliefs.game.state, beliefs.game.set_play, beliefs.game.kicking)
        };
        if self.game.is_none_or(changed) {
            self.body.forget();
        }
        self.game = Some(beliefs.game);
        let role = self.role.update(&pitch, beliefs);
        let mut decision = Decision {
            action: Action::Stand,
            role,
            motion: Motion::Stand,
            kick: None,
            prepared: None,
            target: None,
            gaze: self.neck.update(beliefs),
            ball: beliefs.ball.state,
            reasons: ArrayVec::new(),
        };
        self.body.update(&pitch, beliefs, &mut decision);
        decision
    }
}
