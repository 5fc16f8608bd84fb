//! The report of a localisation: the field from above with the truth, what two methods make of it, the sights and the
//! clusters; errors over time; the table.

use instep_field::{Field, Line, Pose};
use instep_localisation::evaluate::Track;
use instep_localisation::stream::{Stream, Told};
use instep_report::{
    Actor, Arrow, ArrowFrame, Camera, Cell, Color, Column, Event, Finish, Limit, Marking, Part, Pitch, Plot, Replay,
    Report, Series, Shape, SummaryItem, Table as PageTable, Verdict,
};

use super::{Table, cells};

/// Frames of the replay are at least this far apart, s.
const FRAME: f64 = 0.1;
/// Arrows to sights: as many as a frame may show.
const SIGHTS: usize = 7;
/// Clusters that are shown.
const CLUSTERS: usize = 8;
/// Points of a drawn track are this far apart, m.
const TRAIL: f64 = 0.12;
/// Paper 4's errors of CLAP (V-A-3).
const PAPER_MAE: f64 = 0.1651;

pub(super) fn page(table: &Table, stream: &Stream, groups: &[(&'static str, Vec<Track>)]) -> Report {
    let row = &table.methods[0];
    let recovered = row.recovered_rate.map(|rate| {
        let median = row.recovery_median_s.map_or(String::new(), |m| format!("median {m:.2} s, "));
        let note = format!("{median}{:.0} % in the twin", 100.0 * row.twin_rate.unwrap_or(0.0));
        SummaryItem::new("Right within 6 s", format!("{:.0} %", 100.0 * rate), good(rate >= 0.95), note)
    });
    let mut summary = vec![
        SummaryItem::new(
            "Mean error",
            format!("{:.3} m", row.mae),
            good(row.mae <= 0.05 || row.recovered_rate.is_some()),
            format!("{}; paper 4's CLAP {PAPER_MAE:.3} m", row.name),
        ),
        SummaryItem::new(
            "Heading",
            format!("{:.2}\u{b0}", row.heading_mae_deg),
            good(row.heading_mae_deg <= 0.5 || row.recovered_rate.is_some()),
            "mean error",
        ),
        SummaryItem::new(
            "Wrong half",
            format!("{:.1} %", 100.0 * row.wrong_half_rate),
            good(row.wrong_half_rate == 0.0),
            "of the time",
        ),
        SummaryItem::new("False resets", row.false_resets.to_string(), good(row.false_resets == 0), "in all runs"),
        SummaryItem::new(
            "Update",
            format!("{:.3} ms", 1e3 * row.update_p99_s),
            good(row.update_p99_s < 2e-4),
            format!("99th percentile; the check {:.2} ms", 1e3 * row.check_p99_s),
        ),
    ];
    summary.extend(recovered);
    let columns = cells(row)
        .into_iter()
        .enumerate()
        .map(|(k, (head, _))| if k == 0 { Column::text(head) } else { Column::number(head) });
    let rows = table.methods.iter().map(|row| cells(row).into_iter().map(|(_, text)| Cell::from(text)).collect());
    Report {
        matrix: None,
        title: format!("Where am I: {}", table.scenario),
        subtitle: format!(
            "field {} \u{b7} {} seeds from {} \u{b7} the replay shows the first",
            stream.field.name, table.seeds, table.seed
        ),
        summary,
        tables: vec![PageTable { title: "All methods, same data".into(), columns: columns.collect(), rows: rows.collect() }],
        replay: Some(replay(stream, groups)),
        plots: plots(groups),
        notes: vec![
            "White: the truth. Blue: the shipped landmark filter, with arrows to what it sees, drawn from where it believes \
             to be: an arrow's tip should lie on a landmark. Orange: CLAP as printed. Violet columns: the clusters that the \
             last check found."
                .into(),
            "Errors are distances on the ground at equal time; the standard deviation is that of the distances, so that \
             MSE = MAE\u{b2} + STD\u{b2}. A reset is false when it makes the pose worse. \
             Times are those of one core."
                .into(),
        ],
    }
}

fn good(is: bool) -> Verdict {
    if is { Verdict::Good } else { Verdict::Bad }
}

/// The grass with its lines.
pub(crate) fn pitch(field: &Field) -> Pitch {
    let f = |p: [f64; 2]| p.map(|v| v as f32);
    let lines = field.lines();
    let markings = lines.iter().map(|line| match *line {
        Line::Segment { from, to } => Marking::Line { from: f(from), to: f(to) },
        Line::Circle { center, radius } => Marking::Circle { center: f(center), radius: radius as f32 },
    });
    let mark = (field.length / 2.0 - field.penalty_mark) as f32;
    let spots = [[0.0; 2], [mark, 0.0], [-mark, 0.0]].map(|center| Marking::Spot { center });
    Pitch {
        center: [0.0; 2],
        length: field.length as f32,
        width: field.width as f32,
        border: field.border as f32,
        line_width: field.line_width as f32,
        markings: markings.chain(spots).collect(),
    }
}

/// What is shown of a track, at the replay's times.
struct Shown {
    name: &'static str,
    color: Color,
    poses: Vec<Pose>,
}

fn replay(stream: &Stream, groups: &[(&'static str, Vec<Track>)]) -> Replay {
    let track = |k: usize| groups.get(k).and_then(|(name, tracks)| Some((*name, tracks.first()?)));
    let Some((name, first)) = track(0) else { return Replay::default() };
    let mut last = f64::NEG_INFINITY;
    let kept: Vec<usize> = (0..first.samples.len())
        .filter(|&i| {
            let keep = first.samples[i].time >= last + FRAME - 1e-9;
            if keep {
                last = first.samples[i].time;
            }
            keep
        })
        .collect();
    let start = first.samples.first().map_or(0.0, |s| s.time);
    let times: Vec<f64> = kept.iter().map(|&i| first.samples[i].time - start).collect();
    let mut shown = vec![
        Shown {
            name: "truth",
            color: Color::rgb(0xf4f6fa),
            poses: kept.iter().map(|&i| first.samples[i].truth).collect(),
        },
        Shown { name, color: Color::BLUE, poses: kept.iter().map(|&i| first.samples[i].estimate).collect() },
    ];
    if let Some((name, track)) = track(1) {
        let poses = kept.iter().map(|&i| track.samples[i].estimate).collect();
        shown.push(Shown { name, color: Color::ORANGE, poses });
    }
    // The goals come first: the view follows the first actor, and they stay.
    let mut actors = vec![goals(&stream.field)];
    actors.extend(shown.iter().enumerate().map(|(k, s)| robot(s, 0.02 * k as f32)));
    if let Some(filter) = actors.get_mut(2) {
        filter.arrows = sights(stream, &times, start, &shown[1].poses);
    }
    actors.push(clusters(first, &times, start));
    let half = stream.field.width.max(stream.field.length) as f32;
    let events = first.carried_at.map(|t| Event { time: t - start, label: "carried away".into() });
    Replay {
        times,
        actors,
        events: events.into_iter().collect(),
        pitch: Some(pitch(&stream.field)),
        camera: Some(Camera {
            target: [0.0, 0.0, 0.0],
            distance: 1.25 * half,
            azimuth: -std::f32::consts::FRAC_PI_2,
            elevation: 1.45,
        }),
    }
}

/// Both goals: posts and bars.
fn goals(field: &Field) -> Actor {
    let radius = field.line_width as f32;
    let part = |shape, pose| Part { shape, color: Color::SHELL, finish: Finish::Plain, poses: vec![pose] };
    let mut parts = Vec::new();
    for goal in [field.own_goal(), field.opponent_goal()] {
        let height = goal.height as f32;
        for [x, y] in goal.posts {
            let shape = Shape::Cylinder { radius, half_length: height / 2.0 };
            parts.push(part(shape, instep_report::Pose::at([x as f32, y as f32, height / 2.0])));
        }
        let half = field.goal.width as f32 / 2.0;
        let bar = Shape::Box { half_extents: [radius, half, radius] };
        parts.push(part(bar, instep_report::Pose::at([goal.center[0] as f32, 0.0, height])));
    }
    Actor { name: "goals".into(), parts, ..Actor::default() }
}

/// Where a pose stands in the replay.
fn stand(pose: &Pose, height: f32) -> instep_report::Pose {
    let (s, c) = (0.5 * pose.heading as f32).sin_cos();
    instep_report::Pose { position: [pose.x as f32, pose.y as f32, height], rotation: [c, 0.0, 0.0, s] }
}

/// A disc with a nose, and the way behind it.
fn robot(shown: &Shown, height: f32) -> Actor {
    let part = |shape, color, poses| Part { shape, color, finish: Finish::Plain, poses };
    let disc = Shape::Cylinder { radius: 0.16, half_length: 0.05 };
    let nose = Shape::Box { half_extents: [0.11, 0.035, 0.055] };
    let ahead = |p: &Pose| p.then(&Pose::new(0.18, 0.0, 0.0));
    let mut parts = vec![
        part(disc, shown.color, shown.poses.iter().map(|p| stand(p, 0.1 + height)).collect()),
        part(nose, shown.color, shown.poses.iter().map(|p| stand(&ahead(p), 0.1 + height)).collect()),
    ];
    let mut from: Option<Pose> = None;
    for pose in &shown.poses {
        let Some(begin) = from else {
            from = Some(*pose);
            continue;
        };
        let far = begin.distance(pose);
        if far < TRAIL {
            continue;
        }
        from = Some(*pose);
        // A leap is no way.
        if far < 1.0 {
            let middle =
                Pose::new((begin.x + pose.x) / 2.0, (begin.y + pose.y) / 2.0, begin.bearing_to(pose.position()));
            let shape = Shape::Box { half_extents: [far as f32 / 2.0, 0.012, 0.004] };
            parts.push(part(shape, shown.color, vec![stand(&middle, 0.01 + height)]));
        }
    }
    Actor { name: shown.name.into(), parts, ..Actor::default() }
}

/// Arrows from the estimated pose to what the frame before showed.
fn sights(stream: &Stream, times: &[f64], start: f64, poses: &[Pose]) -> Vec<Arrow> {
    let mut frames = vec![vec![ArrowFrame::default(); times.len()]; SIGHTS];
    let mut seen = stream.told.iter().filter_map(|t| match t {
        Told::Frame(frame) => Some(frame),
        _ => None,
    });
    let mut next = seen.next();
    let mut now = None;
    for (i, (time, pose)) in times.iter().zip(poses).enumerate() {
        while let Some(frame) = next.filter(|f| f.time - start <= time + 1e-9) {
            now = Some(frame);
            next = seen.next();
        }
        let Some(frame) = now.filter(|f| time - (f.time - start) < 0.3) else { continue };
        for (arrow, sight) in frames.iter_mut().zip(&frame.landmarks) {
            let at = pose.outer_from_local(sight.position);
            arrow[i] = ArrowFrame {
                origin: [pose.x as f32, pose.y as f32, 0.12],
                vector: [(at[0] - pose.x) as f32, (at[1] - pose.y) as f32, -0.11],
            };
        }
    }
    let arrow = |(k, frames)| Arrow {
        name: format!("sight {}", k + 1),
        color: Color::BLUE.with_alpha(0.6),
        metres_per_unit: 1.0,
        frames,
    };
    frames.into_iter().enumerate().map(arrow).collect()
}

/// The clusters of the last check, as columns; what is not there waits under the grass.
fn clusters(track: &Track, times: &[f64], start: f64) -> Actor {
    let hidden = instep_report::Pose::at([0.0, 0.0, -5.0]);
    let mut poses = vec![vec![hidden; times.len()]; CLUSTERS];
    let mut next = 0;
    for (i, time) in times.iter().enumerate() {
        while track.candidates.get(next).is_some_and(|c| c.0 - start <= time + 1e-9) {
            next += 1;
        }
        let Some((_, candidates)) = next.checked_sub(1).and_then(|k| track.candidates.get(k)) else { continue };
        for (poses, candidate) in poses.iter_mut().zip(candidates) {
            poses[i] = stand(&candidate.pose, 0.05);
        }
    }
    let part = |(k, poses): (usize, Vec<_>)| Part {
        // The better, the wider.
        shape: Shape::Cylinder { radius: 0.2 - 0.015 * k as f32, half_length: 0.05 },
        color: Color::VIOLET.with_alpha(0.55),
        finish: Finish::Plain,
        poses,
    };
    Actor { name: "clusters".into(), parts: poses.into_iter().enumerate().map(part).collect(), ..Actor::default() }
}

fn plots(groups: &[(&'static str, Vec<Track>)]) -> Vec<Plot> {
    let series = |value: fn(&instep_localisation::evaluate::Sample) -> f64, most: f64| -> Vec<Series> {
        let points = |track: &Track| {
            let start = track.samples.first().map_or(0.0, |s| s.time);
            let thin = track.samples.iter().step_by(2);
            thin.map(|s| [s.time - start, if s.lost { f64::NAN } else { value(s).min(most) }]).collect::<Vec<_>>()
        };
        groups.iter().filter_map(|(name, tracks)| Some(Series::points(*name, points(tracks.first()?)))).collect()
    };
    vec![
        Plot {
            title: "Error (drawn up to 0.8 m)".into(),
            y_label: "m".into(),
            series: series(|s| s.error(), 0.8),
            limits: vec![Limit { label: "paper's mean".into(), value: PAPER_MAE }],
            ..Plot::default()
        },
        Plot {
            title: "Heading error (drawn up to 10\u{b0})".into(),
            y_label: "\u{b0}".into(),
            series: series(|s| s.heading_error().to_degrees(), 10.0),
            ..Plot::default()
        },
    ]
}
