//! Many games on all cores, and what they say together.
//!
//! Red plays from both sides and kicks off first in half of the games, so that neither side nor the first kick-off can
//! favour a team. Games are independent and collected in order: any number of threads gives the same result.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;

use crate::game::{Match, TeamSetup};
use crate::tally::{Result, Tally};
use crate::{MatchError, MatchSettings};

/// Of a standard normal variable: both sides of 95 % and of 99 %.
pub const NORMAL_95: f64 = 1.959_964;
/// See [`NORMAL_95`].
pub const NORMAL_99: f64 = 2.575_829;

/// The clocks that a series is measured with, s; they change nothing in its games.
#[derive(Debug, Clone, Copy)]
pub struct Clocks {
    /// For one decision: any fine clock.
    pub decision: fn() -> f64,
    /// For a whole game: the present thread's time on a core.
    pub cpu: fn() -> f64,
}

/// One game of a series, seen from red.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Game {
    /// Goals of red and of blue.
    pub goals: [u32; 2],
    /// Goals of the shoot-out.
    pub shootout: [u32; 2],
    /// Time on a core, s.
    #[serde(skip)]
    pub cpu: f64,
    /// What was counted.
    #[serde(skip)]
    pub tally: Tally,
}

/// Which side and which kick-off a game of a series has, and its seed.
fn assignment(seed: u64, index: usize) -> (bool, usize, u64) {
    // Mixes the two numbers so that neighbouring seeds share no game.
    let mixed = (seed ^ 0x9E37_79B9_7F4A_7C15).wrapping_mul(0xBF58_476D_1CE4_E5B9).wrapping_add(index as u64);
    (index % 2 == 1, (index / 2) % 2, mixed)
}

/// Sets up game `index` of a series; the flag tells that red plays Away.
///
/// # Errors
/// As [`Match::new`].
pub fn game(
    settings: &Arc<MatchSettings>,
    red: &TeamSetup,
    blue: &TeamSetup,
    seed: u64,
    index: usize,
) -> std::result::Result<(Match, bool), MatchError> {
    let (swapped, first, seed) = assignment(seed, index);
    let teams = if swapped { [blue.clone(), red.clone()] } else { [red.clone(), blue.clone()] };
    Ok((Match::new(settings.clone(), teams, first, seed)?, swapped))
}

/// Plays `games` games; `done` is told after each, from any thread.
///
/// # Errors
/// As [`Match::new`].
pub fn play(
    settings: &Arc<MatchSettings>,
    red: &TeamSetup,
    blue: &TeamSetup,
    games: usize,
    seed: u64,
    clocks: Clocks,
    done: impl Fn() + Sync,
) -> std::result::Result<Vec<Game>, MatchError> {
    (0..games)
        .into_par_iter()
        .map(|index| {
            let (mut game, swapped) = game(settings, red, blue, seed, index)?;
            game.measure(clocks.decision);
            let began = (clocks.cpu)();
            let Result { score, shootout } = game.play();
            let cpu = (clocks.cpu)() - began;
            if let Some((time, breach)) = game.breach() {
                return Err(MatchError::Breach { game: index, seed, time, breach });
            }
            done();
            let order = |[home, away]: [u32; 2]| if swapped { [away, home] } else { [home, away] };
            Ok(Game { goals: order(score), shootout: order(shootout), cpu, tally: game.tally().clone() })
        })
        .collect()
}

/// What a series says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// How many.
    pub games: usize,
    /// Mean goals of red and of blue.
    pub goals_mean: [f64; 2],
    /// Mean of red's goals less blue's.
    pub difference_mean: f64,
    /// Standard error of it.
    pub difference_error: f64,
    /// Games won, drawn and lost by red.
    pub outcomes: [usize; 3],
    /// Games by goal difference.
    pub differences: BTreeMap<i64, usize>,
    /// Games by score "red-blue".
    pub scores: BTreeMap<String, usize>,
    /// Time on a core, s.
    #[serde(skip)]
    pub cpu: f64,
    /// Sums over all games.
    #[serde(skip)]
    pub tally: Tally,
}

impl Summary {
    /// Of these games.
    pub fn of(games: &[Game]) -> Self {
        let n = games.len() as f64;
        let mean = |value: &dyn Fn(&Game) -> f64| games.iter().map(value).sum::<f64>() / n;
        let difference = |g: &Game| f64::from(g.goals[0]) - f64::from(g.goals[1]);
        let difference_mean = mean(&difference);
        let squares: f64 = games.iter().map(|g| (difference(g) - difference_mean).powi(2)).sum();
        let mut summary = Self {
            games: games.len(),
            goals_mean: [mean(&|g| f64::from(g.goals[0])), mean(&|g| f64::from(g.goals[1]))],
            difference_mean,
            difference_error: if games.len() > 1 { (squares / (n - 1.0) / n).sqrt() } else { f64::NAN },
            outcomes: [0; 3],
            differences: BTreeMap::new(),
            scores: BTreeMap::new(),
            cpu: games.iter().map(|g| g.cpu).sum(),
            tally: Tally::default(),
        };
        for game in games {
            let d = i64::from(game.goals[0]) - i64::from(game.goals[1]);
            summary.outcomes[if d > 0 {
                0
            } else if d == 0 {
                1
            } else {
                2
            }] += 1;
            *summary.differences.entry(d).or_default() += 1;
            *summary.scores.entry(format!("{}-{}", game.goals[0], game.goals[1])).or_default() += 1;
            summary.tally.add(&game.tally);
        }
        summary
    }

    /// Interval of the mean difference: `z` standard errors to both sides.
    pub fn interval(&self, z: f64) -> [f64; 2] {
        [self.difference_mean - z * self.difference_error, self.difference_mean + z * self.difference_error]
    }
}
