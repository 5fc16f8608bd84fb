//! The best landmarks for localisation: confident and near (paper 4, section IV-A1: a cost of confidence and distance).

/// How many localisation gets.
pub const BEST: usize = 6;
/// What a metre costs against confidence.
const PER_METER: f32 = 0.05;

/// The at most [`BEST`] landmarks of (confidence, distance in m, landmark) with the lowest cost, the best first: cost =
/// 1 - confidence + 0.05 a metre. What has no finite distance is left out.
pub fn best<T: Copy>(landmarks: &[(f32, f32, T)]) -> Vec<T> {
    let mut ranked: Vec<(f32, T)> = landmarks
        .iter()
        .map(|(confidence, distance, landmark)| (1.0 - confidence + PER_METER * distance, *landmark))
        .filter(|(cost, _)| cost.is_finite())
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.into_iter().take(BEST).map(|(_, landmark)| landmark).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn near_and_confident_first_and_never_more_than_six() {
        let all: Vec<(f32, f32, usize)> = (0..9).map(|k| (0.9, 9.0 - k as f32, k)).collect();
        assert_eq!(super::best(&all), [8, 7, 6, 5, 4, 3]);
        assert_eq!(super::best(&[(0.5, 2.0, 'a'), (0.95, 4.0, 'b'), (0.9, f32::NAN, 'c')]), ['b', 'a']);
    }
}
