//! Height (paper 4, section IV-A1): a ball is below 0.3 m.

/// Highest that a ball's middle may be, m.
pub const HIGHEST: f32 = 0.3;
/// Deepest below the ground, as a share of the distance: depth errs.
const BELOW: f32 = 0.08;

/// Whether a middle `z` above the ground (m) at `distance` (m) can be a ball's.
pub fn on_the_ground(z: f32, distance: f32) -> bool {
    z < HIGHEST && z > -0.05 - BELOW * distance
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_ball_lies_low() {
        assert!(super::on_the_ground(0.11, 3.0) && super::on_the_ground(-0.1, 3.0));
        assert!(
            !super::on_the_ground(0.31, 3.0)
                && !super::on_the_ground(-0.4, 3.0)
                && !super::on_the_ground(f32::NAN, 1.0)
        );
    }
}
