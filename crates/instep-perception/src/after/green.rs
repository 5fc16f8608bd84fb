//! Green round the ball (paper 4, section IV-A1): a ball lies on turf, so most of what is below and beside it is green.

use crate::label::Rect;
use crate::picture::Frame;

/// Share of green that a ball's surroundings have at least.
pub const LEAST: f32 = 0.35;

/// Share of green pixels in a ring around the box: half its size wide, its lower two thirds (above a far ball is wall).
/// NaN when the ring lies outside the frame.
pub fn share(frame: &Frame, rect: &Rect) -> f32 {
    let (w, h) = (rect.width().max(4.0), rect.height().max(4.0));
    let ring = Rect {
        left: rect.left - 0.5 * w,
        top: rect.top + 0.33 * h,
        right: rect.right + 0.5 * w,
        low: rect.low + 0.5 * h,
    };
    let (mut green, mut all) = (0u32, 0u32);
    for y in (ring.top.max(0.0) as usize)..(ring.low.max(0.0).ceil() as usize).min(frame.height) {
        for x in (ring.left.max(0.0) as usize)..(ring.right.max(0.0).ceil() as usize).min(frame.width) {
            let inside = (rect.left..rect.right).contains(&(x as f32)) && (rect.top..rect.low).contains(&(y as f32));
            if !inside {
                all += 1;
                green += u32::from(is_green(frame.pixel(x, y)));
            }
        }
    }
    green as f32 / all as f32
}

/// Whether a pixel is turf: green leads.
fn is_green([r, g, b]: [u8; 3]) -> bool {
    i32::from(g) > i32::from(r) + 8 && i32::from(g) > i32::from(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_on_turf_passes_and_one_on_a_board_does_not() {
        let mut frame = Frame::new(100, 100);
        for (k, pixel) in frame.rgb.chunks_exact_mut(3).enumerate() {
            pixel.copy_from_slice(if k / 100 >= 50 { &[60, 130, 50] } else { &[150, 150, 150] });
        }
        assert!(share(&frame, &Rect::around([50.0, 75.0], 12.0, 12.0)) > 0.95);
        assert!(share(&frame, &Rect::around([50.0, 20.0], 12.0, 12.0)) < 0.05);
        assert!(share(&frame, &Rect::around([-50.0, 20.0], 12.0, 12.0)).is_nan());
    }
}
