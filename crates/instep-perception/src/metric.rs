//! Precision, recall, mAP@50 and mAP@50:95 (paper 4, section V-A1; COCO's protocol).
//!
//! A detection is matched to the label of its class that it overlaps most and that is not taken yet, the most confident
//! first. One whose best match is an ignored label counts neither way. The area under precision over recall is taken at
//! COCO's 101 recalls, precision made falling first.

use serde::Serialize;

use crate::class::Class;
use crate::detector::Detection;
use crate::label::Label;

/// A class's row of the table. NaN (null in JSON) where there was no label.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Row {
    /// At the threshold.
    pub precision: f64,
    /// At the threshold.
    pub recall: f64,
    /// Average precision where boxes overlap by half.
    pub map50: f64,
    /// The mean of average precisions at overlaps 0.50, 0.55 to 0.95.
    pub map50_95: f64,
}

/// One frame: what was found in it and what is there.
#[derive(Debug, Clone, Default)]
pub struct Judged {
    /// Found, the most confident first.
    pub found: Vec<Detection>,
    /// There.
    pub labels: Vec<Label>,
}

/// Confidence and right or wrong of each detection of `class` that counts, and the number of labels asked for.
fn matches(frames: &[Judged], class: Class, overlap: f32) -> (Vec<(f32, bool)>, usize) {
    let (mut verdicts, mut asked) = (Vec::new(), 0);
    for frame in frames {
        let labels: Vec<&Label> = frame.labels.iter().filter(|l| l.class == class).collect();
        asked += labels.iter().filter(|l| !l.ignored).count();
        let mut taken = vec![false; labels.len()];
        for detection in frame.found.iter().filter(|d| d.class == class) {
            let best = |ignored: bool| {
                (0..labels.len())
                    .filter(|&i| labels[i].ignored == ignored && (ignored || !taken[i]))
                    .map(|i| (i, labels[i].rect.iou(&detection.rect)))
                    .filter(|(_, iou)| *iou >= overlap)
                    .max_by(|a, b| a.1.total_cmp(&b.1))
            };
            if let Some((i, _)) = best(false) {
                taken[i] = true;
                verdicts.push((detection.confidence, true));
            } else if best(true).is_none() {
                verdicts.push((detection.confidence, false));
            }
        }
    }
    verdicts.sort_by(|a, b| b.0.total_cmp(&a.0));
    (verdicts, asked)
}

/// Average precision of sorted verdicts.
fn average_precision(verdicts: &[(f32, bool)], asked: usize) -> f64 {
    if asked == 0 {
        return f64::NAN;
    }
    let mut right = 0usize;
    let mut curve: Vec<(f64, f64)> = verdicts
        .iter()
        .enumerate()
        .map(|(i, (_, good))| {
            right += usize::from(*good);
            (right as f64 / asked as f64, right as f64 / (i + 1) as f64)
        })
        .collect();
    for i in (1..curve.len()).rev() {
        curve[i - 1].1 = curve[i - 1].1.max(curve[i].1);
    }
    let at = |recall: f64| curve.iter().find(|(r, _)| *r >= recall - 1e-12).map_or(0.0, |(_, p)| *p);
    (0..=100).map(|k| at(f64::from(k) / 100.0)).sum::<f64>() / 101.0
}

/// The row of one class; precision and recall at confidence `threshold`.
pub fn row(frames: &[Judged], class: Class, threshold: f32) -> Row {
    let (verdicts, asked) = matches(frames, class, 0.5);
    let told: Vec<bool> = verdicts.iter().filter(|(c, _)| *c >= threshold).map(|(_, good)| *good).collect();
    let right = told.iter().filter(|good| **good).count() as f64;
    let overlaps = (0..10).map(|k| 0.5 + 0.05 * k as f32);
    let all = overlaps.map(|overlap| {
        let (verdicts, asked) = matches(frames, class, overlap);
        average_precision(&verdicts, asked)
    });
    Row {
        precision: right / told.len() as f64,
        recall: right / asked as f64,
        map50: average_precision(&verdicts, asked),
        map50_95: all.sum::<f64>() / 10.0,
    }
}

/// The mean of the rows that have labels.
pub fn mean(rows: &[Row]) -> Row {
    let over = |of: fn(&Row) -> f64| {
        let values: Vec<f64> = rows.iter().map(of).filter(|v| v.is_finite()).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    Row {
        precision: over(|r| r.precision),
        recall: over(|r| r.recall),
        map50: over(|r| r.map50),
        map50_95: over(|r| r.map50_95),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::label::Rect;

    fn label(x: f32, ignored: bool) -> Label {
        Label { class: Class::Ball, rect: Rect::around([x, 50.0], 10.0, 10.0), team: None, ignored, place: [0.0; 3] }
    }

    fn found(x: f32, confidence: f32) -> Detection {
        Detection { class: Class::Ball, rect: Rect::around([x, 50.0], 10.0, 10.0), confidence, team: None }
    }

    #[test]
    fn all_found_is_one_and_a_false_one_first_costs() {
        let perfect = Judged {
            found: vec![found(20.0, 0.9), found(60.0, 0.8)],
            labels: vec![label(20.0, false), label(60.0, false)],
        };
        let r = row(std::slice::from_ref(&perfect), Class::Ball, 0.5);
        assert_eq!((r.precision, r.recall, r.map50, r.map50_95), (1.0, 1.0, 1.0, 1.0));
        let mut worse = perfect;
        worse.found.insert(0, found(200.0, 0.95));
        // Precision is 1/2, then 2/3: made falling it is 2/3 everywhere.
        let r = row(&[worse], Class::Ball, 0.5);
        assert!((r.map50 - 2.0 / 3.0).abs() < 1e-9 && (r.precision - 2.0 / 3.0).abs() < 1e-9);
    }

    #[test]
    fn ignored_labels_count_neither_way_and_a_second_hit_is_wrong() {
        let ignored = Judged { found: vec![found(20.0, 0.9)], labels: vec![label(20.0, true), label(60.0, false)] };
        let r = row(&[ignored], Class::Ball, 0.5);
        assert!(r.precision.is_nan() && r.recall == 0.0 && r.map50 == 0.0);
        let twice = Judged { found: vec![found(20.0, 0.9), found(21.0, 0.8)], labels: vec![label(20.0, false)] };
        assert!((row(&[twice], Class::Ball, 0.5).precision - 0.5).abs() < 1e-9);
    }

    /// Moved by 2 of 10 pixels a box overlaps by 8 of 12: right up to 0.65.
    #[test]
    fn a_moved_box_loses_the_strict_overlaps() {
        let moved = Judged { found: vec![found(22.0, 0.9)], labels: vec![label(20.0, false)] };
        let r = row(&[moved], Class::Ball, 0.5);
        assert!((r.map50_95 - 0.4).abs() < 1e-9 && r.map50 == 1.0, "{r:?}");
    }
}
