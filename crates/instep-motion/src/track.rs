//! The path of one landmark through a clip, and its speed without the recording's spikes.
//!
//! Speeds come from the steps between frames. A running median over five steps drops a jump of one or two steps
//! (a single bad frame makes two), then a mean over the wanted window smooths. Edges of longer lasting changes, such
//! as a foot that is planted, survive the median.

use nalgebra::Vector3;

use crate::clip::{BonePoses, Clip};

/// Steps that the running median looks at.
const MEDIAN: usize = 5;

/// `point` of the poses of each frame, m.
pub(crate) fn path(clip: &Clip, point: impl Fn(&BonePoses) -> Vector3<f64>) -> Vec<Vector3<f64>> {
    let mut poses = BonePoses::default();
    (0..clip.frames.len())
        .map(|frame| {
            clip.poses_into(frame, &mut poses);
            point(&poses)
        })
        .collect()
}

/// Speed at each frame, m/s: mean over `window` seconds around it (at least one step to each side).
pub(crate) fn speeds(path: &[Vector3<f64>], rate: f64, window: f64) -> Vec<f64> {
    if path.len() < 2 {
        return vec![0.0; path.len()];
    }
    let raw: Vec<f64> = path.windows(2).map(|p| (p[1] - p[0]).norm() * rate).collect();
    let steps: Vec<f64> = (0..raw.len()).map(|i| median(around(&raw, i, MEDIAN / 2))).collect();
    // A window of more steps than there are is the whole path.
    let half = ((window * rate / 2.0) as usize).clamp(1, path.len());
    (0..path.len())
        .map(|frame| {
            let part = &steps[frame.saturating_sub(half)..(frame + half).min(steps.len())];
            part.iter().sum::<f64>() / part.len() as f64
        })
        .collect()
}

/// Up to `half` values on each side of `i`, fewer at the ends but the same number on both sides, and itself.
fn around(values: &[f64], i: usize, half: usize) -> Vec<f64> {
    let half = half.min(i).min(values.len() - 1 - i);
    values[i - half..=i + half].to_vec()
}

/// The middle value; 0 for none.
pub(crate) fn median(values: Vec<f64>) -> f64 {
    quantile(values, 0.5)
}

/// The value below which the fraction `q` lies (nearest rank); 0 for none.
pub(crate) fn quantile(mut values: Vec<f64>, q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get((q * last as f64).round() as usize).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_of_one_frame_leaves_the_speed_alone() {
        let mut path: Vec<_> = (0..40).map(|i| Vector3::new(f64::from(i) * 0.01, 0.0, 0.0)).collect();
        path[20].z += 0.5;
        for speed in speeds(&path, 100.0, 0.05) {
            assert!((speed - 1.0).abs() < 1e-9, "{speed}");
        }
    }

    #[test]
    fn short_paths_have_speeds_too() {
        assert_eq!(speeds(&[], 100.0, 0.05), Vec::<f64>::new());
        assert_eq!(speeds(&[Vector3::x()], 100.0, 0.05), [0.0]);
        assert_eq!(speeds(&[Vector3::zeros(), Vector3::x()], 100.0, 0.05), [100.0, 100.0]);
    }

    #[test]
    fn quantiles_of_ranks() {
        let values = vec![3.0, 1.0, 2.0, 5.0, 4.0];
        assert_eq!(median(values.clone()), 3.0);
        assert_eq!(quantile(values.clone(), 0.0), 1.0);
        assert_eq!(quantile(values, 1.0), 5.0);
        assert_eq!(median(vec![]), 0.0);
    }
}
