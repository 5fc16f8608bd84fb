//! Distance from the ball's diameter where depth fails (paper 4, section IV-A2).

/// Depth of the middle of a ball of `radius` (m) whose box is `width` x `height` pixels, m. The larger side counts: a
/// ball that is cut off loses only one of them.
pub fn depth(focal: f32, radius: f32, width: f32, height: f32) -> f32 {
    2.0 * radius * focal / width.max(height).max(1.0)
}

#[cfg(test)]
mod tests {
    #[test]
    fn twice_as_far_is_half_as_wide() {
        assert!((super::depth(200.0, 0.1, 10.0, 10.0) - 4.0).abs() < 1e-6);
        assert!((super::depth(200.0, 0.1, 2.0, 5.0) - 8.0).abs() < 1e-6);
    }
}
