//! What is counted in a game.

use serde::Serialize;

/// What came of a game.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Result {
    /// Goals, Home first.
    pub score: [u32; 2],
    /// Goals of the shoot-out.
    pub shootout: [u32; 2],
}

/// What is counted beside it. All numbers but the decisions' times are the same for the same seed.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Tally {
    /// Simulated time, s.
    pub simulated: f64,
    /// Time of open play summed over players, s.
    pub open_play: f64,
    /// Role changes in open play.
    pub role_changes: u32,
    /// Of these, changes back to the role of less than 3 s before.
    pub role_flickers: u32,
    /// Kicks.
    pub kicks: u32,
    /// Sendings-off.
    pub removals: u32,
    /// Falls.
    pub falls: u32,
    /// Restarts of all kinds.
    pub restarts: u32,
    /// Decisions.
    pub decisions: u64,
    /// Decisions by time: the k-th holds those under 2^(k/4) * 100 ns.
    pub decision_times: Vec<u64>,
}

/// Buckets of [`Tally::decision_times`]: up to 100 ns * 2^16.
const BUCKETS: usize = 65;

impl Tally {
    pub(crate) fn decided(&mut self, seconds: f64) {
        self.decision_times.resize(BUCKETS, 0);
        let bucket = (4.0 * (seconds / 1e-7).max(1.0).log2()).ceil() as usize;
        self.decision_times[bucket.min(BUCKETS - 1)] += 1;
    }

    /// Adds another game's.
    pub fn add(&mut self, other: &Tally) {
        self.simulated += other.simulated;
        self.open_play += other.open_play;
        self.role_changes += other.role_changes;
        self.role_flickers += other.role_flickers;
        self.kicks += other.kicks;
        self.removals += other.removals;
        self.falls += other.falls;
        self.restarts += other.restarts;
        self.decisions += other.decisions;
        if !other.decision_times.is_empty() {
            self.decision_times.resize(BUCKETS, 0);
            for (sum, n) in self.decision_times.iter_mut().zip(&other.decision_times) {
                *sum += n;
            }
        }
    }

    /// Upper edge of the bucket that holds this quantile of the decisions' times, s; NaN where none was measured.
    pub fn decision_quantile(&self, share: f64) -> f64 {
        let total: u64 = self.decision_times.iter().sum();
        let mut sum = 0;
        for (k, n) in self.decision_times.iter().enumerate() {
            sum += n;
            if total > 0 && sum as f64 >= share * total as f64 {
                return 1e-7 * 2f64.powf(k as f64 / 4.0);
            }
        }
        f64::NAN
    }
}
