//! What a camera does to light: motion and lens blur, glare, white balance, exposure, noise, its curve, eight bits.

use super::noise::Noise;
use crate::camera::Camera;
use crate::picture::Frame;
use crate::scene::Look;

/// Steps of the table that holds the camera's curve, over light from 0 to 1.
const STEPS: usize = 2048;

/// Develops `light` into a frame; `spare` is a buffer of the same size.
pub(super) fn expose(
    camera: &Camera,
    look: &Look,
    seed: u64,
    noise: &Noise,
    light: &mut Vec<[f32; 3]>,
    spare: &mut Vec<[f32; 3]>,
) -> Frame {
    let (width, height) = (camera.width, camera.height);
    let length = look.motion[0].hypot(look.motion[1]);
    if length > 0.7 {
        smear(width, height, look.motion, light, spare);
        std::mem::swap(light, spare);
    }
    if look.blur > 0.0 {
        soften(width, height, look.blur, light, spare);
    }
    let curve: Vec<f32> = (0..=STEPS).map(|k| 255.0 * (k as f32 / STEPS as f32).powf(1.0 / look.gamma)).collect();
    let gain = look.white.map(|w| w * look.exposure);
    let mut frame = Frame::new(width, height);
    let mut normals = noise.normals(seed as usize);
    let inverse_radius = 1.0 / (look.glare[2] * look.glare[2]).max(1.0);
    let deviation = 255.0 * look.noise;
    for (row, (pixels, out)) in light.chunks_exact(width).zip(frame.rgb.chunks_exact_mut(3 * width)).enumerate() {
        let dy = row as f32 - look.glare[1];
        for (column, (pixel, out)) in pixels.iter().zip(out.chunks_exact_mut(3)).enumerate() {
            let mut stray = look.veil;
            if look.glare[3] > 0.0 {
                let dx = column as f32 - look.glare[0];
                stray += look.glare[3] / (1.0 + (dx * dx + dy * dy) * inverse_radius);
            }
            // Noise of the whole pixel and of the channel.
            let shared = normals.next().unwrap_or(0.0);
            for c in 0..3 {
                let value = (pixel[c] * gain[c] + stray).clamp(0.0, 1.0);
                let level = curve[(value * STEPS as f32) as usize];
                let grain = shared + 0.5 * normals.next().unwrap_or(0.0);
                out[c] = (level + deviation * grain + 0.5).clamp(0.0, 255.0) as u8;
            }
        }
    }
    frame
}

/// The mean along a line of `motion` pixels around each pixel, into `out`.
fn smear(width: usize, height: usize, motion: [f32; 2], light: &[[f32; 3]], out: &mut [[f32; 3]]) {
    let taps = (motion[0].hypot(motion[1]).ceil() as usize).clamp(2, 12);
    out.fill([0.0; 3]);
    for tap in 0..taps {
        let share = (tap as f32 + 0.5) / taps as f32 - 0.5;
        let (dx, dy) = ((motion[0] * share).round() as isize, (motion[1] * share).round() as isize);
        for row in 0..height {
            let from = row.saturating_add_signed(dy).min(height - 1) * width;
            let line = &light[from..from + width];
            for (column, pixel) in out[row * width..(row + 1) * width].iter_mut().enumerate() {
                let source = line[column.saturating_add_signed(dx).min(width - 1)];
                for c in 0..3 {
                    pixel[c] += source[c];
                }
            }
        }
    }
    let weight = 1.0 / taps as f32;
    out.iter_mut().for_each(|pixel| *pixel = pixel.map(|c| c * weight));
}

/// A kernel of (share, 1 - 2 share, share) along rows, then columns.
fn soften(width: usize, height: usize, share: f32, light: &mut [[f32; 3]], spare: &mut [[f32; 3]]) {
    let middle = 1.0 - 2.0 * share;
    let mix = |a: [f32; 3], b: [f32; 3], c: [f32; 3]| std::array::from_fn(|k| share * (a[k] + c[k]) + middle * b[k]);
    for (from, to) in light.chunks_exact(width).zip(spare.chunks_exact_mut(width)) {
        for (column, window) in from.windows(3).enumerate() {
            to[column + 1] = mix(window[0], window[1], window[2]);
        }
        (to[0], to[width - 1]) = (from[0], from[width - 1]);
    }
    for row in 0..height {
        let line = |r: usize| &spare[r * width..(r + 1) * width];
        let (above, here, below) = (line(row.saturating_sub(1)), line(row), line((row + 1).min(height - 1)));
        for (((out, a), b), c) in light[row * width..(row + 1) * width].iter_mut().zip(above).zip(here).zip(below) {
            *out = mix(*a, *b, *c);
        }
    }
}
