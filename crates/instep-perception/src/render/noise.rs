//! Noise from tables: smooth noise for textures, normal noise for sensors. The tables come from a fixed seed.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

const SIDE: usize = 256;
const NORMALS: usize = 1 << 15;

/// The tables.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    grain: Box<[f32; SIDE * SIDE]>,
    smooth: Box<[f32; SIDE * SIDE]>,
    normal: Box<[f32; NORMALS]>,
}

impl Noise {
    pub(super) fn new() -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(0x006e_6f69_7365);
        let grain: Vec<f32> = (0..SIDE * SIDE).map(|_| rng.random_range(-1.0..1.0)).collect();
        // Two octaves of bilinear noise.
        let at = |x: usize, y: usize| grain[(y % SIDE) * SIDE + x % SIDE];
        let octave = |x: usize, y: usize, cell: usize, shift: usize| {
            let (i, j) = (x / cell, y / cell);
            let (fx, fy) = ((x % cell) as f32 / cell as f32, (y % cell) as f32 / cell as f32);
            let n = SIDE / cell;
            let p = |a: usize, b: usize| at((a % n) + shift, (b % n) + shift);
            let top = p(i, j) * (1.0 - fx) + p(i + 1, j) * fx;
            let low = p(i, j + 1) * (1.0 - fx) + p(i + 1, j + 1) * fx;
            top * (1.0 - fy) + low * fy
        };
        let smooth: Vec<f32> = (0..SIDE * SIDE)
            .map(|k| (k % SIDE, k / SIDE))
            .map(|(x, y)| 0.7 * octave(x, y, 16, 0) + 0.4 * octave(x, y, 4, 100))
            .collect();
        // The sum of twelve uniform numbers less six: no logarithm, the same everywhere.
        let normal: Vec<f32> = (0..NORMALS).map(|_| (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0).collect();
        Noise { grain: table(grain), smooth: table(smooth), normal: table(normal) }
    }

    /// White noise in [-1, 1] at a whole place.
    #[inline(always)]
    pub(super) fn grain(&self, x: i32, y: i32) -> f32 {
        self.grain[place(x, y)]
    }

    /// Smooth noise, about [-1, 1], one hill every 16 units; period 256.
    #[inline(always)]
    pub(super) fn smooth(&self, x: f32, y: f32) -> f32 {
        self.smooth[place(x.floor() as i32, y.floor() as i32)]
    }

    /// The normal number, deviation 1, at place `at` of the table, which begins anew at its end.
    #[inline(always)]
    pub(super) fn normal(&self, at: usize) -> f32 {
        self.normal[at % NORMALS]
    }
}

/// Where a place lies in a table that repeats itself.
#[inline(always)]
fn place(x: i32, y: i32) -> usize {
    (y as usize % SIDE) * SIDE + x as usize % SIDE
}

/// A vector of `N` numbers as a table of known length; zeros where there are fewer.
fn table<const N: usize>(values: Vec<f32>) -> Box<[f32; N]> {
    values.into_boxed_slice().try_into().unwrap_or_else(|_| Box::new([0.0; N]))
}

/// A hash of whole numbers (Jenkins' and Wang's mixing steps have no patent; constants of MurmurHash3's finaliser).
#[inline(always)]
pub(super) fn hash(x: i32, y: i32, z: i32) -> u32 {
    let mut h = (x as u32).wrapping_mul(0x9e37_79b1)
        ^ (y as u32).wrapping_mul(0x85eb_ca77)
        ^ (z as u32).wrapping_mul(0xc2b2_ae3d);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}
