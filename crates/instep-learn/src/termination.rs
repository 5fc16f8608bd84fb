//! Reference-guided early termination (paper 1, equations (39) and (40)), and a count of why episodes end.

use std::collections::BTreeMap;

use instep_robot::Robot;
use serde::{Deserialize, Serialize};

use crate::settings::TerminationSettings;

/// The threshold d of (39), m, at `time` of (40) as a share of the budget.
///
/// Equation (40) as it stands: a staircase of n sigmoids between t_start and t_end. Its i-th stair is centred at
/// t_start + i dt, so that half of the last one is missing at t_end, where the second case takes over.
#[must_use]
pub fn threshold(settings: &TerminationSettings, time: f64) -> f64 {
    let TerminationSettings { d_max, d_min, t_start, t_end, n, gamma, .. } = *settings;
    if time < t_start {
        return d_max;
    }
    if time >= t_end {
        return d_min;
    }
    let (dh, dt) = ((d_max - d_min) / n as f64, (t_end - t_start) / n as f64);
    let stairs = (1..=n).map(|i| {
        let x = gamma * (time - (t_start + i as f64 * dt)) / dt;
        1.0 / (1.0 + (-x).exp())
    });
    d_max - dh * stairs.sum::<f64>()
}

/// Why an episode ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "cause", content = "link")]
pub enum End {
    /// The clip and the stand after it are over.
    Completed,
    /// This link (a body index) was too far from the reference: (39).
    Link(usize),
    /// The body touched the ground, or the base was too low or tilted too far.
    Fell,
    /// The simulation diverged.
    Diverged,
}

/// How often episodes ended why and where in the clip.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EndTable {
    counts: BTreeMap<(End, usize), u64>,
}

impl EndTable {
    /// Counts one.
    pub fn add(&mut self, end: End, part: usize) {
        *self.counts.entry((end, part)).or_default() += 1;
    }

    /// Adds another table.
    pub fn merge(&mut self, other: &Self) {
        for (key, count) in &other.counts {
            *self.counts.entry(*key).or_default() += count;
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.counts.clear();
    }

    /// Number of episodes.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.counts.values().sum()
    }

    /// Share of episodes that were completed; 1 when there was none.
    #[must_use]
    pub fn survival(&self) -> f64 {
        let completed: u64 = self.counts.iter().filter(|((end, _), _)| *end == End::Completed).map(|(_, n)| n).sum();
        if self.total() == 0 { 1.0 } else { completed as f64 / self.total() as f64 }
    }

    /// One row for each cause, link and phase: what, where, how many; the most frequent first.
    #[must_use]
    pub fn rows(&self, robot: &Robot) -> Vec<EndRow> {
        let mut rows: Vec<EndRow> = self
            .counts
            .iter()
            .map(|(&(end, part), &count)| {
                let (cause, link) = match end {
                    End::Completed => ("completed", None),
                    End::Link(link) => ("link too far", Some(robot.link_name(link).to_owned())),
                    End::Fell => ("fell", None),
                    End::Diverged => ("diverged", None),
                };
                EndRow { cause, link, phase: PARTS[part.min(PARTS.len() - 1)], count }
            })
            .collect();
        rows.sort_by_key(|row| std::cmp::Reverse(row.count));
        rows
    }
}

/// A row of the table of ends.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EndRow {
    /// Why.
    pub cause: &'static str,
    /// Which link, for those too far from the reference.
    pub link: Option<String>,
    /// Where in the kick.
    pub phase: &'static str,
    /// How many.
    pub count: u64,
}

/// The parts of a kick that ends are counted by: paper 1's six phases, and the stand after them.
pub const PARTS: [&str; 7] =
    ["approach", "support", "leg swing", "lock and contact", "follow-through", "recovery", "stand"];

/// The part of the kick at `time` (s after the window's start).
#[must_use]
pub fn part(phases: &instep_motion::phase::KickPhases, window: [f64; 2], time: f64) -> usize {
    let at = window[0] + time;
    if at >= window[1] {
        return 6;
    }
    let bounds = [
        phases.t_swing.min(phases.t_plant),
        phases.t_swing.max(phases.t_plant),
        phases.t_lock,
        phases.t_impact + 0.03,
        phases.t_impact + 0.4,
    ];
    bounds.iter().take_while(|&&bound| at >= bound).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_staircase_falls_from_d_max_to_d_min() {
        let settings = TerminationSettings { d_max: 0.3, d_min: 0.1, ..TerminationSettings::default() };
        assert_eq!(threshold(&settings, 0.0), 0.3);
        assert_eq!(threshold(&settings, 1.0), 0.1);
        let mut last = 0.3;
        for i in 0..=100 {
            let d = threshold(&settings, f64::from(i) / 100.0);
            assert!(d <= last + 1e-12 && (0.1..=0.3).contains(&d), "{d} at {i}");
            last = d;
        }
        // Half-way between two stairs an even share of them has been gone down: i = 1, 2 of 4.
        let (t_start, t_end) = (settings.t_start, settings.t_end);
        let middle = t_start + (t_end - t_start) * 2.5 / 4.0;
        assert!((threshold(&settings, middle) - 0.2).abs() < 2e-3);
    }

    #[test]
    fn a_fixed_threshold_stays() {
        let settings = TerminationSettings { d_max: 0.3, d_min: 0.3, ..TerminationSettings::default() };
        assert!((0..=10).all(|i| threshold(&settings, f64::from(i) / 10.0) == 0.3));
    }
}
