//! A second look at a frame: left and right exchanged, in other light.
//!
//! Every class stays what it is in a mirror, so a frame that was costly to make teaches twice.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::label::Label;
use crate::picture::Frame;

/// Mirrors a frame and its labels and changes its brightness by up to a third and each colour by up to a tenth, as
/// `number` says.
pub(super) fn mirror(frame: &mut Frame, labels: &mut [Label], number: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(number);
    let light: f32 = rng.random_range(0.75..1.33);
    let tables: [[u8; 256]; 3] = std::array::from_fn(|_| {
        let gain = light * rng.random_range(0.9..1.1f32);
        std::array::from_fn(|level| (level as f32 * gain + 0.5).min(255.0) as u8)
    });
    for row in frame.rgb.chunks_exact_mut(3 * frame.width) {
        let (pixels, _) = row.as_chunks_mut::<3>();
        pixels.reverse();
        for pixel in pixels {
            for (value, table) in pixel.iter_mut().zip(&tables) {
                *value = table[usize::from(*value)];
            }
        }
    }
    let width = frame.width as f32;
    for label in labels {
        (label.rect.left, label.rect.right) = (width - label.rect.right, width - label.rect.left);
        label.place[0] = -label.place[0];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::class::Class;
    use crate::label::Rect;

    #[test]
    fn a_box_stays_around_what_it_is_around() {
        let mut frame = Frame::new(8, 2);
        for x in 1..3 {
            frame.rgb[3 * (8 + x)..][..3].fill(100);
        }
        let rect = Rect { left: 1.0, top: 1.0, right: 3.0, low: 2.0 };
        let mut labels = [Label { class: Class::Ball, rect, team: None, ignored: false, place: [0.5, 0.2, 3.0] }];
        mirror(&mut frame, &mut labels, 3);
        let lit: Vec<usize> = (0..16).filter(|&k| frame.rgb[3 * k] > 50).collect();
        assert_eq!(lit, [8 + 5, 8 + 6]);
        assert_eq!((labels[0].rect.left, labels[0].rect.right, labels[0].place), (5.0, 7.0, [-0.5, 0.2, 3.0]));
    }
}
