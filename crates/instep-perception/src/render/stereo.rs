//! What a stereo camera makes of depth: disparity with noise, hence an error that grows with the square of the
//! distance; minus infinity where something is too near, infinity where it is too far (as the ZED's library tells them
//! apart); holes (NaN) where the right eye cannot look behind an edge; blind patches.

use super::noise::Noise;
use crate::camera::Camera;
use crate::picture::Depth;

super::also_wide!(depth, measured, (camera: &Camera, seed: u64, noise: &Noise, truth: &[f32]) -> Depth);

/// The depth map that the camera delivers for true depths.
#[inline(always)]
fn measured(camera: &Camera, seed: u64, noise: &Noise, truth: &[f32]) -> Depth {
    let (width, height) = (camera.width, camera.height);
    let strength = camera.focal() * camera.baseline as f32;
    let (nearest, farthest, deviation) = (camera.nearest as f32, camera.farthest as f32, camera.disparity_noise as f32);
    let mut meters = vec![f32::NAN; width * height];
    let shift = ((seed >> 8) & 0xff) as f32;
    // Matching works over windows, so its error is the same over some pixels, with a little of its own for each.
    let normals = (seed >> 20) as usize % (1 << 20);
    let blocks = width / 4 + 1;
    let own_normals = normals + blocks * (height / 4 + 1);
    let rows = truth.chunks_exact(width).zip(meters.chunks_exact_mut(width));
    for (row, (truth, meters)) in rows.enumerate() {
        let mut leftmost = f32::MAX;
        let smooth_row = row as f32 * 0.7 + 3.0 * shift;
        for (turned, (&z, found)) in truth.iter().zip(meters).rev().enumerate() {
            let column = width - 1 - turned;
            let disparity = strength / z;
            // Where this point lands in the right eye's image; something landed farther left already hides it.
            let landing = column as f32 - disparity;
            let hidden = landing > leftmost + 1.0;
            leftmost = leftmost.min(landing);
            let own = noise.normal(own_normals + row * width + turned);
            let blind = noise.smooth(column as f32 * 0.5 + shift, smooth_row) > 0.93;
            let block = noise.normal(normals + row / 4 * blocks + column / 4);
            let seen = strength / (disparity + deviation * (0.8 * block + 0.6 * own));
            if hidden || blind || z.is_nan() {
                continue;
            }
            *found = if z < nearest || seen < nearest {
                f32::NEG_INFINITY
            } else if z > farthest || seen > farthest {
                f32::INFINITY
            } else {
                seen
            };
        }
    }
    Depth { width, height, meters }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(z: f32) -> Vec<f32> {
        let camera = Camera::default();
        let map = depth(&camera, 5, &Noise::new(), &vec![z; camera.width * camera.height]);
        map.meters.into_iter().filter(|d| d.is_finite()).collect()
    }

    #[test]
    fn the_error_grows_with_the_square_of_the_distance() {
        let spread = |z: f32| {
            let d = wall(z);
            (d.iter().map(|d| (d - z).powi(2)).sum::<f32>() / d.len() as f32).sqrt()
        };
        let ratio = spread(4.0) / spread(2.0);
        assert!((3.5..4.6).contains(&ratio), "{ratio}");
        let camera = Camera::default();
        let expected = 4.0 * 0.06 / (camera.focal() * 0.12);
        assert!((spread(2.0) / expected - 1.0).abs() < 0.15, "{} {expected}", spread(2.0));
    }

    #[test]
    fn nothing_nearer_than_the_camera_can_has_a_depth() {
        assert!(wall(0.39).is_empty());
        assert!(wall(0.5).len() > 60_000);
    }

    /// A near post before a far wall hides from the right eye a strip of the wall, to the left of the post in the left
    /// eye's image, as wide as the difference of the disparities.
    #[test]
    fn there_are_holes_left_of_near_edges() {
        let camera = Camera::default();
        let (w, h) = (camera.width, camera.height);
        let truth: Vec<f32> = (0..w * h).map(|k| if (200..220).contains(&(k % w)) { 1.0 } else { 5.0 }).collect();
        let map = depth(&camera, 9, &Noise::new(), &truth);
        let holes = |columns: std::ops::Range<usize>| {
            let n = columns.len() * h;
            let holes =
                (0..h).flat_map(|r| columns.clone().map(move |c| r * w + c)).filter(|&p| map.meters[p].is_nan());
            holes.count() as f32 / n as f32
        };
        let strip = (camera.focal() * 0.12 * (1.0 - 0.2)) as usize;
        assert!(holes(200 - strip + 2..199) > 0.9);
        assert!(holes(100..140) < 0.2 && holes(240..300) < 0.2);
    }
}
