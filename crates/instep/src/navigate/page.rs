//! The report of a navigation: the field from above with robot, path, prediction and keep-outs; errors over time; the table.

use instep_field::Field;
use instep_navigation::trial::Outcome;
use instep_report::{
    Actor, Camera, Cell, Color, Column, Finish, Part, Plot, Pose, Replay, Report, Series, Shape, SummaryItem,
    Table as PageTable, Verdict,
};

use super::{Table, cells};
use crate::locate::page::pitch;

/// Balls that mark path and prediction in each frame.
const MARKS: usize = 20;

pub(super) fn page(table: &Table, title: &str, field: &Field, groups: &[&[Outcome]]) -> Report {
    let row = &table.shipped;
    let good = |is: bool| if is { Verdict::Good } else { Verdict::Bad };
    let summary = vec![
        SummaryItem::new(
            "Reached",
            format!("{:.0} %", 100.0 * row.reached_rate),
            good(row.reached_rate >= 1.0),
            format!("of {} runs", row.runs),
        ),
        SummaryItem::new(
            "Contact",
            format!("{:.0} %", 100.0 * row.contact_rate),
            good(row.contact_rate < 0.03),
            "runs that touched somebody",
        ),
        SummaryItem::new(
            "In a keep-out",
            format!("{:.3} m", row.worst_keep_out),
            good(row.worst_keep_out < 0.01),
            "deepest in all runs",
        ),
        SummaryItem::new(
            "Mean error",
            format!("{:.3} m", row.mae),
            good(row.mae < 0.0945),
            "at equal time for the star (paper 4: 0.0945 m), else from the path",
        ),
        SummaryItem::new(
            "Solve",
            format!("{:.3} ms", 1e3 * row.solve_p99_s),
            good(row.solve_p99_s < 3e-4),
            format!("99th percentile; plan {:.3} ms", 1e3 * row.plan_p99_s),
        ),
    ];
    let columns = cells(row)
        .into_iter()
        .enumerate()
        .map(|(k, (head, _))| if k == 0 { Column::text(head) } else { Column::number(head) });
    let rows = table.methods.iter().map(|row| cells(row).into_iter().map(|(_, text)| Cell::from(text)).collect());
    let series = groups.iter().zip(&table.methods).filter_map(|(group, row)| {
        let errors = &group.first()?.errors;
        let points =
            errors.iter().enumerate().step_by(2).map(|(k, e)| [k as f64 * instep_navigation::trial::PERIOD, *e]);
        Some(Series::points(row.name, points.collect()))
    });
    Report {
        matrix: None,
        title: format!("How do I get there: {}", table.scenario),
        subtitle: format!("{title} \u{b7} {} \u{b7} {} runs, seed {} \u{b7} the replay shows the first run of {}", table.robot, row.runs, table.seed, row.name),
        summary,
        tables: vec![PageTable { title: "The same runs, followed in four ways".into(), columns: columns.collect(), rows: rows.collect() }],
        replay: groups.first().and_then(|group| group.first()).map(|outcome| replay(outcome, field)),
        plots: vec![Plot { title: "Error of the first run".into(), y_label: "m".into(), series: series.collect(), ..Plot::default() }],
        notes: vec![
            "White: the robot. Red discs: keep-outs of its middle. Blue: the path, orange: where the controller predicts the robot within the next 2 s."
                .into(),
            "The printed kinematic model is eq 6 without lag and delay, with effort counted from standstill as in eq 7. Direct is the path's \
             own velocity: cheap enough for thousands of games at once. Times are those of one core."
                .into(),
        ],
    }
}

fn replay(outcome: &Outcome, field: &Field) -> Replay {
    let samples = &outcome.samples;
    let hidden = Pose::at([0.0, 0.0, -5.0]);
    let part = |shape, color, poses| Part { shape, color, finish: Finish::Plain, poses };
    let turned = |p: &instep_field::Pose, height: f32| {
        let (s, c) = (0.5 * p.heading as f32).sin_cos();
        Pose { position: [p.x as f32, p.y as f32, height], rotation: [c, 0.0, 0.0, s] }
    };
    let white = Color::rgb(0xf4f6fa);
    let mut robot = vec![
        part(
            Shape::Cylinder { radius: 0.16, half_length: 0.05 },
            white,
            samples.iter().map(|s| turned(&s.pose, 0.12)).collect(),
        ),
        part(
            Shape::Box { half_extents: [0.11, 0.035, 0.055] },
            white,
            samples.iter().map(|s| turned(&s.pose.then(&instep_field::Pose::new(0.18, 0.0, 0.0)), 0.12)).collect(),
        ),
    ];
    for sample in samples.iter().step_by(2) {
        robot.push(part(Shape::Sphere { radius: 0.025 }, white, vec![turned(&sample.pose, 0.02)]));
    }
    let others = samples.first().map_or(0, |s| s.obstacles.len());
    let discs = (0..others).map(|k| {
        let radius = samples[0].obstacles[k].radius as f32 + outcome.radius as f32;
        let poses = samples
            .iter()
            .map(|s| Pose::at([s.obstacles[k].position[0] as f32, s.obstacles[k].position[1] as f32, 0.02]));
        part(Shape::Cylinder { radius, half_length: 0.02 }, Color::RED.with_alpha(0.45), poses.collect())
    });
    let marks = |radius: f32, color: Color, height: f32, points: &dyn Fn(usize) -> Vec<[f64; 2]>| -> Vec<Part> {
        let all: Vec<Vec<[f64; 2]>> = (0..samples.len()).map(points).collect();
        (0..MARKS)
            .map(|k| {
                let poses = all
                    .iter()
                    .map(|points| points.get(k).map_or(hidden, |p| Pose::at([p[0] as f32, p[1] as f32, height])));
                part(Shape::Sphere { radius }, color, poses.collect())
            })
            .collect()
    };
    let path = marks(0.05, Color::BLUE, 0.05, &|i| even(&samples[i].path));
    let prediction = marks(0.035, Color::ORANGE, 0.09, &|i| samples[i].prediction.clone());
    let actor = |name: &str, parts: Vec<Part>| Actor { name: name.into(), parts, ..Actor::default() };
    let ground = part(Shape::Sphere { radius: 0.01 }, white, vec![Pose::at([0.0, 0.0, 0.0])]);
    Replay {
        times: samples.iter().map(|s| s.time).collect(),
        actors: vec![
            // The view follows the first actor, and this one stays.
            actor("centre mark", vec![ground]),
            actor("robot", robot),
            actor("keep-outs", discs.collect()),
            actor("path", path),
            actor("prediction", prediction),
        ],
        pitch: Some(pitch(field)),
        camera: Some(Camera {
            target: [0.0, 0.0, 0.0],
            distance: 1.25 * field.length as f32,
            azimuth: -std::f32::consts::FRAC_PI_2,
            elevation: 1.45,
        }),
        ..Replay::default()
    }
}

/// [`MARKS`] points along a path.
fn even(path: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let lengths: Vec<f64> = path.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).collect();
    let total: f64 = lengths.iter().sum();
    if path.len() < 2 || total < 1e-9 {
        return Vec::new();
    }
    (0..MARKS)
        .map(|k| {
            let mut left = total * k as f64 / (MARKS - 1) as f64;
            for (i, length) in lengths.iter().enumerate() {
                if left <= *length || i + 1 == lengths.len() {
                    let share = if *length > 0.0 { (left / length).min(1.0) } else { 0.0 };
                    return [0, 1].map(|j| path[i][j] + share * (path[i + 1][j] - path[i][j]));
                }
                left -= length;
            }
            path[0]
        })
        .collect()
}
