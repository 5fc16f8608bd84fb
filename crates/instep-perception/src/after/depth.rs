//! Depth of a detection: the median in its box (paper 4, section IV-A2).

use crate::label::Rect;
use crate::picture::Depth;

/// Share of the box's pixels that must have a depth.
const LEAST: f32 = 0.25;

/// The median depth in the middle of the box (half its sides), m; `None` when fewer than a quarter of its pixels have one.
pub fn median(depth: &Depth, rect: &Rect) -> Option<f32> {
    let inner = Rect::around(rect.middle(), (0.5 * rect.width()).max(2.0), (0.5 * rect.height()).max(2.0));
    let range =
        |low: f32, high: f32, most: usize| (low.max(0.0).floor() as usize)..(high.max(0.0).ceil() as usize).min(most);
    let (rows, columns) = (range(inner.top, inner.low, depth.height), range(inner.left, inner.right, depth.width));
    let all = rows.len() * columns.len();
    let mut values: Vec<f32> = rows
        .flat_map(|y| columns.clone().map(move |x| y * depth.width + x))
        .filter_map(|i| depth.meters.get(i).copied())
        .filter(|z| z.is_finite() && *z > 0.0)
        .collect();
    if values.is_empty() || (values.len() as f32) < LEAST * all as f32 {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_and_a_background_do_not_move_the_median() {
        let mut depth = Depth { width: 40, height: 40, meters: vec![9.0; 1600] };
        for y in 10..30 {
            for x in 10..30 {
                depth.meters[y * 40 + x] = if (x + y) % 3 == 0 { f32::NAN } else { 2.0 };
            }
        }
        assert_eq!(median(&depth, &Rect::around([20.0, 20.0], 20.0, 20.0)), Some(2.0));
        depth.meters.fill(f32::NAN);
        assert_eq!(median(&depth, &Rect::around([20.0, 20.0], 20.0, 20.0)), None);
        assert_eq!(median(&depth, &Rect::around([-200.0, 20.0], 20.0, 20.0)), None);
    }
}
