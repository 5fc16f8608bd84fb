//! A share of trials with its 95 % interval: Wilson's score interval (Wilson, Probable inference, the law of succession, and
//! statistical inference, Journal of the American Statistical Association 22, 1927), which keeps within [0, 1] and is right
//! for shares near 0 and 1, where the normal interval is not.

use serde::{Serialize, Serializer};

/// The two-sided 95 % point of the normal distribution.
const Z: f64 = 1.959_963_984_540_054;

/// A share with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rate {
    /// Successes over trials.
    pub share: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Rate {
    /// Of `good` in `all`; `None` when there is no trial.
    #[must_use]
    pub fn of(good: usize, all: usize) -> Option<Self> {
        if all == 0 {
            return None;
        }
        let (n, share) = (all as f64, good as f64 / all as f64);
        let middle = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
        let half = Z / (1.0 + Z * Z / n) * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
        // Rounding must not put the share itself outside.
        Some(Self { share, low: (middle - half).clamp(0.0, share), high: (middle + half).clamp(share, 1.0) })
    }
}

/// A rate under its name, for tables and JSON.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedRate {
    name: &'static str,
    /// `None` when there was no trial.
    pub rate: Option<Rate>,
}

impl NamedRate {
    /// `name` for `good` in `all`.
    #[must_use]
    pub fn of(name: &'static str, good: usize, all: usize) -> Self {
        Self { name, rate: Rate::of(good, all) }
    }

    /// The share alone.
    #[must_use]
    pub fn share(&self) -> Option<f64> {
        self.rate.map(|rate| rate.share)
    }
}

/// As the keys `name`, `name_low` and `name_high`, null when there was no trial: to be flattened into a struct.
impl Serialize for NamedRate {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let of = |part: fn(&Rate) -> f64| self.rate.as_ref().map(part);
        let parts = [("", of(|rate| rate.share)), ("_low", of(|rate| rate.low)), ("_high", of(|rate| rate.high))];
        serializer.collect_map(parts.map(|(end, value)| (format!("{}{end}", self.name), value)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wilson's interval is where the observed share is just 1.96 of the standard errors that the end itself would have away.
    #[test]
    fn the_interval_is_wilsons() {
        for (good, all) in [(57, 60), (3, 200), (1, 2), (199, 200)] {
            let rate = Rate::of(good, all).unwrap();
            assert_eq!(rate.share, good as f64 / all as f64);
            for end in [rate.low, rate.high] {
                let error = (end * (1.0 - end) / all as f64).sqrt();
                assert!(((rate.share - end).abs() / error - Z).abs() < 1e-9, "{good}/{all}: {rate:?}");
            }
            assert!(rate.low < rate.share && rate.share < rate.high);
        }
        // None and all of 20: z^2 / (n + z^2) = 0.1611.
        let (none, every) = (Rate::of(0, 20).unwrap(), Rate::of(20, 20).unwrap());
        assert!(none.low == 0.0 && (none.high - 0.161_125).abs() < 1e-6);
        assert!(every.high == 1.0 && (every.low - 0.838_875).abs() < 1e-6);
        assert_eq!(Rate::of(0, 0), None);
    }

    #[test]
    fn a_named_rate_becomes_three_keys() {
        let keys = serde_json::to_value(NamedRate::of("hit_rate", 1, 2)).unwrap();
        assert_eq!(keys["hit_rate"], 0.5);
        assert!(keys["hit_rate_low"].as_f64().unwrap() < 0.5 && keys["hit_rate_high"].as_f64().unwrap() > 0.5);
        assert!(serde_json::to_value(NamedRate::of("hit_rate", 0, 0)).unwrap()["hit_rate_high"].is_null());
    }
}
