//! What a camera does to light: motion and lens blur, glare, white balance, exposure, noise, its curve, eight bits.

use super::Light;
use super::noise::Noise;
use crate::camera::Camera;
use crate::picture::Frame;
use crate::scene::Look;

/// Steps of the table that holds the camera's curve, over light from 0 to 1.
const STEPS: usize = 2048;

super::also_wide!(
    expose,
    exposed,
    (camera: &Camera, look: &Look, seed: u64, noise: &Noise, light: &mut Light, spare: &mut Light) -> Frame
);

/// Develops `light` into a frame; `spare` is a buffer of the same size.
#[inline(always)]
fn exposed(camera: &Camera, look: &Look, seed: u64, noise: &Noise, light: &mut Light, spare: &mut Light) -> Frame {
    let (width, height) = (camera.width, camera.height);
    let length = look.motion[0].hypot(look.motion[1]);
    if length > 0.7 {
        light.iter().zip(&mut *spare).for_each(|(from, to)| smear(width, look.motion, from, to));
        std::mem::swap(light, spare);
    }
    if look.blur > 0.0 {
        light.iter_mut().zip(spare).for_each(|(plane, spare)| soften(width, look.blur, plane, spare));
    }
    let mut curve = [0.0f32; STEPS + 1];
    for (k, level) in curve.iter_mut().enumerate() {
        *level = 255.0 * (k as f32 / STEPS as f32).powf(1.0 / look.gamma);
    }
    let gain = look.white.map(|w| w * look.exposure);
    let mut frame = Frame::new(width, height);
    let normals = seed as usize % (1 << 20);
    let inverse_radius = 1.0 / (look.glare[2] * look.glare[2]).max(1.0);
    let deviation = 255.0 * look.noise;
    let mut stray = vec![look.veil; width];
    let [red, green, blue] = &*light;
    for (row, out) in frame.rgb.chunks_exact_mut(3 * width).enumerate() {
        let pixels = row * width..(row + 1) * width;
        if look.glare[3] > 0.0 {
            let dy = row as f32 - look.glare[1];
            for (column, stray) in stray.iter_mut().enumerate() {
                let dx = column as f32 - look.glare[0];
                *stray = look.veil + look.glare[3] / (1.0 + (dx * dx + dy * dy) * inverse_radius);
            }
        }
        let planes = [&red[pixels.clone()], &green[pixels.clone()], &blue[pixels]];
        let (out, _) = out.as_chunks_mut::<3>();
        for (column, (out, &stray)) in out.iter_mut().zip(&stray).enumerate() {
            // Noise of the whole pixel and of the channel.
            let at = normals + 4 * (row * width + column);
            let shared = noise.normal(at);
            for c in 0..3 {
                let value = (planes[c][column] * gain[c] + stray).clamp(0.0, 1.0);
                let level = curve[((value * STEPS as f32) as usize).min(STEPS)];
                let grain = shared + 0.5 * noise.normal(at + 1 + c);
                out[c] = (level + deviation * grain + 0.5).clamp(0.0, 255.0) as u8;
            }
        }
    }
    frame
}

/// The mean along a line of `motion` pixels around each pixel, into `out`.
#[inline(always)]
fn smear(width: usize, motion: [f32; 2], plane: &[f32], out: &mut [f32]) {
    let height = plane.len() / width;
    let taps = (motion[0].hypot(motion[1]).ceil() as usize).clamp(2, 12);
    out.fill(0.0);
    for tap in 0..taps {
        let share = (tap as f32 + 0.5) / taps as f32 - 0.5;
        let (dx, dy) = ((motion[0] * share).round() as isize, (motion[1] * share).round() as isize);
        // Pixels whose source lies in the row; the others take the row's end.
        let (left, right) = ((-dx).max(0) as usize, dx.max(0) as usize);
        let (left, right) = (left.min(width), right.min(width));
        for (row, out) in out.chunks_exact_mut(width).enumerate() {
            let from = row.saturating_add_signed(dy).min(height - 1) * width;
            let line = &plane[from..from + width];
            out[..left].iter_mut().for_each(|o| *o += line[0]);
            out[width - right..].iter_mut().for_each(|o| *o += line[width - 1]);
            if left + right < width {
                let source = &line[right..width - left];
                out[left..width - right].iter_mut().zip(source).for_each(|(o, l)| *o += l);
            }
        }
    }
    let weight = 1.0 / taps as f32;
    out.iter_mut().for_each(|o| *o *= weight);
}

/// A kernel of (share, 1 - 2 share, share) along rows, then columns.
#[inline(always)]
fn soften(width: usize, share: f32, plane: &mut [f32], spare: &mut [f32]) {
    let height = plane.len() / width;
    let middle = 1.0 - 2.0 * share;
    for (from, to) in plane.chunks_exact(width).zip(spare.chunks_exact_mut(width)) {
        for (((to, a), b), c) in to[1..].iter_mut().zip(from).zip(&from[1..]).zip(&from[2..]) {
            *to = share * (a + c) + middle * b;
        }
        (to[0], to[width - 1]) = (from[0], from[width - 1]);
    }
    for (row, out) in plane.chunks_exact_mut(width).enumerate() {
        let line = |r: usize| &spare[r * width..(r + 1) * width];
        let (above, here, below) = (line(row.saturating_sub(1)), line(row), line((row + 1).min(height - 1)));
        for (((out, a), b), c) in out.iter_mut().zip(above).zip(here).zip(below) {
            *out = share * (a + c) + middle * b;
        }
    }
}
