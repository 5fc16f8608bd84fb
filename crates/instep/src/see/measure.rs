//! `instep see eval` and `instep see proximity`: paper 4's Tables II and III.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use instep_perception::detector::{Detection, THRESHOLDS};
use instep_perception::metric::{self, Judged, Row};
use instep_perception::proximity::{self, Proximity, Run};
use instep_perception::render::Renderer;
use instep_perception::scene::random::{Split, scene};
use instep_perception::{Camera, Class, dataset, label};
use serde::Serialize;

use super::{Times, count, detector, field, look_at, median, page, track};
use crate::failure::Failure;
use crate::output::{self, Output, Paint};

#[derive(Debug, Args)]
pub(super) struct EvalArgs {
    /// Number of frames
    #[arg(long, value_name = "N", default_value_t = 350)]
    frames: u64,
    /// Seed of the first frame
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// A set in COCO's or YOLO's layout [default: frames made from the seed]
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// A detector's file [default: the one that comes with Instep]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// A page with the worst frames
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct ProximityArgs {
    /// Seed of the first walk
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// What `instep see eval --json` prints.
#[derive(Debug, Serialize)]
pub(super) struct Evaluation {
    classes: std::collections::BTreeMap<&'static str, Row>,
    overall: Row,
    frames: usize,
    render_ms: f64,
    detector_ms: f64,
    after_ms: f64,
    /// Frames of a set that could not be read.
    skipped: usize,
    /// Balls that were found and are right, within 6 m.
    ball_sights: usize,
    /// Median of their error by their distance.
    ball_error_median: f64,
    /// Frames with a ball that is none.
    ball_false_frames: usize,
    /// Errors of the ball's track after a second in which it was not seen, m.
    track_errors: Vec<f64>,
}

impl EvalArgs {
    pub(super) fn run(self, output: &Output) -> Result<(), Failure> {
        count("--frames", self.frames, 1_000_000)?;
        let (field, camera) = (field()?, Camera::default());
        let mut detector = detector(self.model.as_deref())?;
        let mut times = Times::default();
        let (mut judged, mut pictures) = (Vec::new(), Vec::new());
        let (mut errors, mut false_frames, mut skipped) = (Vec::new(), 0, 0);
        let mut track_errors = Vec::new();
        // Down to here the curve of precision over recall is followed.
        let least = &[0.02; Class::ALL.len()];
        let bar = output::bar(self.frames, "{wide_bar} {pos}/{len} frames {eta}");
        if let Some(folder) = &self.data {
            let set = dataset::Set::open(folder)?;
            for k in 0..set.len().min(usize::try_from(self.frames).unwrap_or(usize::MAX)) {
                bar.inc(1);
                let Ok((frame, labels)) = set.get(k) else {
                    skipped += 1;
                    continue;
                };
                let start = Instant::now();
                let found = detector.detect(&frame, least)?;
                times.detector.push(start.elapsed().as_secs_f64() * 1e3);
                judged.push(Judged { found, labels });
            }
        } else {
            let mut renderer = Renderer::new(camera, &field);
            for seed in self.seed..self.seed + self.frames {
                let scene = scene(&field, &camera, Split::Test, seed);
                let looked = look_at(&mut renderer, &mut detector, &field, scene, least, &mut times)?;
                let labels = label::labels(&camera, &field, &looked.scene, &looked.view);
                if let Some((sight, _)) = &looked.sights.ball {
                    let truth = labels.iter().find(|l| l.class == Class::Ball);
                    let place = truth.map(|l| looked.scene.camera.robot_from_camera(l.place.into()));
                    match place {
                        Some(place) if (place - sight.position).norm() < 0.5 + 0.1 * place.norm() => {
                            let distance = f64::from(place.norm());
                            if distance < 6.0 {
                                errors.push(f64::from((place - sight.position).norm()) / distance);
                            }
                        }
                        _ => false_frames += 1,
                    }
                }
                if self.out.is_some() {
                    let used: Vec<_> = looked.found.iter().copied().filter(Detection::is_used).collect();
                    let missed = mistakes(&used, &labels);
                    pictures.push((
                        missed,
                        page::picture(&format!("seed {seed}: {missed} mistakes"), &looked.view, &used, &labels, None),
                    ));
                    pictures.sort_by_key(|picture| std::cmp::Reverse(picture.0));
                    pictures.truncate(24);
                }
                judged.push(Judged { found: looked.found, labels });
                bar.inc(1);
            }
            let sequences = usize::try_from(self.frames / 20).unwrap_or(0).min(20);
            let first = self.seed + self.frames;
            track_errors = track::after_occlusion(&mut renderer, &mut detector, &field, first, sequences)?;
        }
        bar.finish_and_clear();
        let rows = Class::ALL.map(|class| metric::row(&judged, class, THRESHOLDS[class.index()]));
        let evaluation = Evaluation {
            classes: Class::ALL.iter().map(|c| c.name()).zip(rows).collect(),
            overall: metric::mean(&rows),
            frames: judged.len(),
            render_ms: median(&mut times.render),
            detector_ms: median(&mut times.detector),
            after_ms: median(&mut times.after),
            skipped,
            ball_sights: errors.len(),
            ball_error_median: median(&mut errors),
            ball_false_frames: false_frames,
            track_errors,
        };
        if let Some(out) = &self.out {
            let body: String = pictures.into_iter().map(|(_, html)| html).collect();
            page::save(out, "The worst frames", &body)?;
        }
        output.show(&evaluation, |paint| table(&evaluation, paint))
    }
}

/// Labels asked for without a detection, and detections without a label.
fn mistakes(found: &[Detection], labels: &[label::Label]) -> usize {
    let meets = |d: &Detection, l: &label::Label| d.class == l.class && d.rect.iou(&l.rect) >= 0.5;
    labels.iter().filter(|l| !l.ignored && !found.iter().any(|d| meets(d, l))).count()
        + found.iter().filter(|d| !labels.iter().any(|l| meets(d, l))).count()
}

fn table(e: &Evaluation, paint: Paint) -> String {
    let line = |name: &str, r: &Row| {
        format!("  {name:<10} {:>7.3} {:>7.3} {:>7.3} {:>9.3}", r.precision, r.recall, r.map50, r.map50_95)
    };
    let mut text = format!("{} frames\n{}\n", e.frames, paint.faint("             P       R    mAP50  mAP50:95"));
    for class in Class::ALL {
        let _ = writeln!(text, "{}", line(class.name(), &e.classes[class.name()]));
    }
    let _ = writeln!(text, "{}", line("overall", &e.overall));
    let _ = writeln!(
        text,
        "  render {:.1} ms, detector {:.1} ms, after {:.1} ms (medians)",
        e.render_ms, e.detector_ms, e.after_ms
    );
    let _ = writeln!(
        text,
        "  ball: {} sights within 6 m, error {:.1} % of the distance (median), {} frames with a false ball",
        e.ball_sights,
        100.0 * e.ball_error_median,
        e.ball_false_frames
    );
    if !e.track_errors.is_empty() {
        let _ = writeln!(
            text,
            "  tracks of a ball that was hidden for 1 s: {} of {} within 0.3 m",
            e.track_errors.iter().filter(|error| **error < 0.3).count(),
            e.track_errors.len()
        );
    }
    text
}

impl ProximityArgs {
    pub(super) fn run(self, output: &Output) -> Result<(), Failure> {
        let (field, camera) = (field()?, Camera::default());
        let runs: Vec<Run> =
            (0..3).map(|k| proximity::walk(&Proximity::default(), &camera, &field, self.seed + k)).collect();
        let over = |of: fn(&Run) -> f64| runs.iter().map(of).sum::<f64>() / runs.len() as f64;
        let mean = Run {
            precision: over(|r| r.precision),
            recall: over(|r| r.recall),
            f1: over(|r| r.f1),
            error_mean: over(|r| r.error_mean),
            error_std: over(|r| r.error_std),
        };
        let shown = serde_json::json!({"runs": runs, "mean": mean});
        output.show(&shown, |paint| {
            let line = |name: &str, r: &Run| {
                format!(
                    "  {name:<5} {:.3} {:.3} {:.3} {:.3} \u{b1} {:.3} m\n",
                    r.precision, r.recall, r.f1, r.error_mean, r.error_std
                )
            };
            let head = paint.faint("  walk  P     R     F1    E");
            let lines: String = runs.iter().enumerate().map(|(k, r)| line(&(k + 1).to_string(), r)).collect();
            format!("{head}\n{lines}{}", line("mean", &mean))
        })
    }
}
