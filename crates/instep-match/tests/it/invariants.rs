//! Random games break no invariant: random books, teams, strategies and lengths. A short version runs always, ten thousand
//! games by `cargo test -p instep-match --test it -- --ignored ten_thousand`.

use std::sync::Arc;

use instep_behaviour::Strategy;
use instep_field::FIELD_NAMES;
use instep_match::{Match, MatchSettings, TeamSetup};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::rules::team;

/// A strategy of random numbers, each within what its file may say.
fn strategy(rng: &mut ChaCha8Rng) -> Strategy {
    let mut s = Strategy::default();
    for weight in [
        &mut s.weights.area,
        &mut s.weights.goal_angle,
        &mut s.weights.goal_distance,
        &mut s.weights.own_distance,
        &mut s.weights.team_distance,
        &mut s.weights.opponent_distance,
        &mut s.weights.block,
    ] {
        *weight = 5.0 * rng.random::<f64>();
    }
    s.shot.least_chance = rng.random();
    s.shot.most_turn = 4.0 * rng.random::<f64>();
    s.roles.keeper = rng.random();
    s.roles.hysteresis = 3.0 * rng.random::<f64>();
    s.roles.dwell = 3.0 * rng.random::<f64>();
    s.roles.defender_first = rng.random();
    s.roles.keeper_clears = 10.0 * rng.random::<f64>();
    s.positions.keeper_out = 0.1 + 5.0 * rng.random::<f64>();
    s.positions.defender_share = rng.random();
    s.positions.support_ahead = -5.0 + 10.0 * rng.random::<f64>();
    s.positions.support_beside = 5.0 * rng.random::<f64>();
    s.validate("random").unwrap();
    s
}

/// Plays game `seed` and tells what it broke, and whether extra time and a shoot-out were in it.
fn game(seed: u64, longest_half: f64) -> (Option<String>, bool, bool) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let rules = FIELD_NAMES[rng.random_range(0..FIELD_NAMES.len())];
    let players = rng.random_range(1..=5);
    let mut settings = MatchSettings::new(rules, Some(players)).unwrap();
    settings.knockout = rng.random();
    settings.book.rules.half_time = longest_half * rng.random::<f64>();
    settings.book.extra_half = settings.book.extra_half.map(|half| half.min(longest_half / 2.0));
    let kicks = team().kicks;
    let mut setup = || TeamSetup { strategy: Arc::new(strategy(&mut rng)), kicks: kicks.clone() };
    let teams = [setup(), setup()];
    let mut game = Match::new(Arc::new(settings), teams, rng.random_range(0..2), rng.random()).unwrap();
    game.play();
    let broken = game.breach().map(|(time, breach)| format!("game {seed} on {rules}, {time:.2} s: {breach}"));
    (broken, game.referee().half > 2, game.referee().phase == instep_behaviour::GamePhase::Shootout)
}

fn play(games: u64, longest_half: f64) {
    let results: Vec<_> = (0..games).into_par_iter().map(|i| game(7_000_000 + i, longest_half)).collect();
    let broken: Vec<&String> = results.iter().filter_map(|(broken, ..)| broken.as_ref()).collect();
    assert!(broken.is_empty(), "{} of {games}: {:#?}", broken.len(), &broken[..broken.len().min(10)]);
    let (extra, shootouts) = (results.iter().filter(|r| r.1).count(), results.iter().filter(|r| r.2).count());
    assert!(extra > 0 && shootouts > 0, "no game had extra time ({extra}) or a shoot-out ({shootouts})");
}

#[test]
fn random_games_break_no_invariant() {
    play(40, 60.0);
}

#[test]
#[ignore = "minutes of both cores"]
fn ten_thousand_random_games_break_no_invariant() {
    play(10_000, 120.0);
}
