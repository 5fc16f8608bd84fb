//! Quantiles of many short times in fixed memory, for a loop that must not allocate.

use serde::Serialize;

/// Width of a bucket, s.
const WIDTH: f64 = 10e-6;
/// Number of buckets: up to 40 ms; what is longer counts in the last.
const BUCKETS: usize = 4000;

/// A histogram of times.
#[derive(Debug, Clone)]
pub(crate) struct Histogram {
    buckets: Box<[u32]>,
    count: u64,
    max: f64,
}

/// What is told of a histogram, s.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Quantiles {
    /// How many times were measured.
    pub count: u64,
    /// Median, rounded up to 10 us.
    pub p50: f64,
    /// 99th percentile, rounded up to 10 us.
    pub p99: f64,
    /// The longest.
    pub max: f64,
}

impl Histogram {
    pub(crate) fn new() -> Self {
        Self { buckets: vec![0; BUCKETS].into_boxed_slice(), count: 0, max: 0.0 }
    }

    /// Counts one time (s).
    pub(crate) fn record(&mut self, time: f64) {
        // The cast saturates: a negative time counts as zero, a long one in the last bucket.
        let bucket = ((time / WIDTH) as usize).min(BUCKETS - 1);
        self.buckets[bucket] = self.buckets[bucket].saturating_add(1);
        self.count += 1;
        self.max = self.max.max(time);
    }

    /// What it holds.
    pub(crate) fn quantiles(&self) -> Quantiles {
        let at = |share: f64| {
            let wanted = (share * self.count as f64).ceil() as u64;
            let mut seen = 0;
            let bucket = self.buckets.iter().position(|&n| {
                seen += u64::from(n);
                seen >= wanted
            });
            // Never above the longest, and the last bucket has no upper end but that.
            bucket.map_or(0.0, |b| if b + 1 == BUCKETS { self.max } else { ((b + 1) as f64 * WIDTH).min(self.max) })
        };
        if self.count == 0 {
            return Quantiles::default();
        }
        Quantiles { count: self.count, p50: at(0.5), p99: at(0.99), max: self.max }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_times() {
        let mut histogram = Histogram::new();
        assert_eq!(histogram.quantiles(), Quantiles::default());
        for i in 0..1000 {
            histogram.record(f64::from(i) * 1e-6);
        }
        histogram.record(0.5);
        histogram.record(-1.0);
        let q = histogram.quantiles();
        assert_eq!((q.count, q.max), (1002, 0.5));
        assert!((q.p50 - 0.5e-3).abs() < 2.0 * WIDTH && (q.p99 - 0.99e-3).abs() < 2.0 * WIDTH, "{q:?}");
    }
}
