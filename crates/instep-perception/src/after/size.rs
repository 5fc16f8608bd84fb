//! Size against distance (paper 4, section IV-A1): a ball of known radius is so and so wide at a measured depth.

/// A box may be narrower than the ball (cut off, hidden) or wider (blurred) by these factors.
const NARROW: f32 = 0.4;
/// See [`NARROW`]; and two pixels more.
const WIDE: f32 = 1.6;

/// Whether a box of `width` x `height` pixels can be a ball of `radius` (m) at `depth` (m); true where there is no depth.
pub fn fits(focal: f32, radius: f32, depth: f32, width: f32, height: f32) -> bool {
    if !depth.is_finite() {
        return true;
    }
    let expected = 2.0 * radius * focal / depth.max(0.05);
    let larger = width.max(height);
    larger >= NARROW * expected - 1.0 && larger <= WIDE * expected + 2.0
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_ball_fits_and_a_head_and_a_spot_do_not() {
        // 0.22 m at 4 m with 213 pixels: 11.7 pixels.
        assert!(super::fits(213.0, 0.11, 4.0, 12.0, 11.0));
        assert!(!super::fits(213.0, 0.11, 4.0, 24.0, 24.0));
        assert!(!super::fits(213.0, 0.11, 4.0, 3.0, 3.0));
        assert!(super::fits(213.0, 0.11, f32::NAN, 3.0, 3.0));
    }
}
