//! The server's play modes as states of the game.
//!
//! Before a kick-off and after a goal players are put to their places (beam): that is READY. Every restart gives one team the ball
//! alone for some seconds and keeps the other away from it.

use instep_behaviour::{GamePhase, GameState, Kicking, PlayState, SetPlay};

use crate::perception::GameNews;

/// Length of a half of the simulation league, s.
const HALF: f64 = 300.0;

/// Whether players may be put to their places.
#[must_use]
pub fn may_beam(mode: &str) -> bool {
    matches!(mode, "BeforeKickOff" | "Goal_Left" | "Goal_Right")
}

/// The game as a team sees it that plays from the left or the `right` side. A mode that nobody knows is a game that stands.
#[must_use]
pub fn state(news: &GameNews, right: bool) -> GameState {
    let lower = news.mode.to_ascii_lowercase();
    let (kind, side) = match (lower.strip_suffix("_left"), lower.strip_suffix("_right")) {
        (Some(kind), _) => (kind, Some(false)),
        (_, Some(kind)) => (kind, Some(true)),
        _ => (lower.as_str(), None),
    };
    let ours = side.map(|side| if side == right { Kicking::Us } else { Kicking::Them });
    let other = |kicking: Option<Kicking>| match kicking {
        Some(Kicking::Us) => Some(Kicking::Them),
        Some(Kicking::Them) => Some(Kicking::Us),
        kicking => kicking,
    };
    let first = Some(if right { Kicking::Them } else { Kicking::Us });
    let playing = PlayState::Playing;
    let (state, set_play, kicking) = match kind {
        // The left team has the first kick-off; after a goal the one that got it.
        "beforekickoff" => (PlayState::Ready, SetPlay::None, first),
        "goal" => (PlayState::Ready, SetPlay::None, other(ours)),
        "kickoff" => (playing, SetPlay::None, ours),
        "playon" => (playing, SetPlay::None, None),
        "kickin" => (playing, SetPlay::ThrowIn, ours),
        "corner_kick" => (playing, SetPlay::CornerKick, ours),
        "goal_kick" => (playing, SetPlay::GoalKick, ours),
        "free_kick" => (playing, SetPlay::IndirectFreeKick, ours),
        "direct_free_kick" => (playing, SetPlay::DirectFreeKick, ours),
        "penalty_kick" | "penalty_shoot" => (playing, SetPlay::PenaltyKick, ours),
        // Named for the team that was offside.
        "offside" => (playing, SetPlay::IndirectFreeKick, other(ours)),
        "gameover" => (PlayState::Finished, SetPlay::None, None),
        _ => (PlayState::Set, SetPlay::None, None),
    };
    let [left_goals, right_goals] = news.score;
    GameState {
        phase: if kind == "penalty_shoot" { GamePhase::Shootout } else { GamePhase::Normal },
        state,
        set_play,
        kicking: kicking.unwrap_or(Kicking::Nobody),
        time_left: HALF - news.time.rem_euclid(HALF),
        score: if right { [right_goals, left_goals] } else { [left_goals, right_goals] },
        penalised: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(mode: &str, right: bool) -> (PlayState, SetPlay, Kicking) {
        let game = state(&GameNews { mode: mode.into(), score: [2, 1], ..GameNews::default() }, right);
        assert_eq!(game.score, if right { [1, 2] } else { [2, 1] });
        (game.state, game.set_play, game.kicking)
    }

    #[test]
    fn each_mode_is_ours_or_theirs() {
        let playing = PlayState::Playing;
        for (mode, set_play) in [
            ("KickOff", SetPlay::None),
            ("KickIn", SetPlay::ThrowIn),
            ("corner_kick", SetPlay::CornerKick),
            ("goal_kick", SetPlay::GoalKick),
            ("free_kick", SetPlay::IndirectFreeKick),
            ("direct_free_kick", SetPlay::DirectFreeKick),
            ("penalty_kick", SetPlay::PenaltyKick),
        ] {
            let [left, right] = if mode.starts_with('K') { ["_Left", "_Right"] } else { ["_left", "_right"] }
                .map(|s| format!("{mode}{s}"));
            assert_eq!(seen(&left, false), (playing, set_play, Kicking::Us), "{left}");
            assert_eq!(seen(&left, true), (playing, set_play, Kicking::Them), "{left}");
            assert_eq!(seen(&right, true), (playing, set_play, Kicking::Us), "{right}");
        }
        assert_eq!(seen("PlayOn", true), (playing, SetPlay::None, Kicking::Nobody));
        assert_eq!(seen("offside_left", true).2, Kicking::Us);
        assert_eq!(seen("Goal_Left", true), (PlayState::Ready, SetPlay::None, Kicking::Us));
        assert_eq!(seen("GameOver", true).0, PlayState::Finished);
        assert_eq!(seen("intermission", true).0, PlayState::Set);
        assert!(may_beam("BeforeKickOff") && may_beam("Goal_Right") && !may_beam("PlayOn"));
    }
}
