//! Torques that go from limit to limit faster than a motor's use can be.

/// Share of its limit beyond which a torque counts.
const HIGH: f64 = 0.8;
/// Time within which it has come from as far on the other side, s.
const WITHIN: f64 = 0.04;

/// Share of the moments at `times` (s, rising) in which some joint's torque is beyond 0.8 of its limit and was so on the other
/// side within the 40 ms before. `torques` has a row of as many as `limits` (N m) for each moment.
pub(super) fn share(times: &[f64], torques: &[f64], limits: &[f64]) -> f64 {
    let never = f64::NEG_INFINITY;
    let mut last = vec![[never; 2]; limits.len()];
    let mut count = 0usize;
    for (&time, row) in times.iter().zip(torques.chunks_exact(limits.len().max(1))) {
        let mut turned = false;
        for ((torque, limit), [above, below]) in row.iter().zip(limits).zip(&mut last) {
            if *torque > HIGH * limit {
                turned |= time - *below <= WITHIN + 1e-9;
                *above = time;
            } else if *torque < -HIGH * limit {
                turned |= time - *above <= WITHIN + 1e-9;
                *below = time;
            }
        }
        count += usize::from(turned);
    }
    count as f64 / times.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::share;

    #[test]
    fn only_from_one_limit_to_the_other_within_the_time_counts() {
        let times: Vec<f64> = (0..10).map(|k| 0.01 * f64::from(k)).collect();
        let of = |row: [f64; 10]| share(&times, &row, &[10.0]);
        assert_eq!(of([9.0, 9.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.0);
        // Back at 0.02, for two moments; at 0.07 the last on the other side is 40 ms ago, at 0.08 no longer.
        assert!((of([9.0, 0.0, -9.0, -9.0, 0.0, 0.0, 0.0, 9.0, 9.0, 0.0]) - 0.3).abs() < 1e-12);
        assert_eq!(of([7.0, -7.0, 7.0, -7.0, 7.0, -7.0, 7.0, -7.0, 7.0, -7.0]), 0.0);
        // Two joints, each on its own side.
        assert_eq!(share(&times[..2], &[9.0, -9.0, 9.0, -9.0], &[10.0, 10.0]), 0.0);
    }
}
