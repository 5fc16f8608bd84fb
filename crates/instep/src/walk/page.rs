//! The report of a walk: replay with footsteps, momentum as planned and as measured, forces in their cones, the estimate
//! against the truth, torques against their limits.

use instep_bench::walking::Asked;
use instep_motion::phase::Side;
use instep_report::{
    Actor, Arrow, ArrowFrame, Axis, Cell, Color, Column, Event, Finish, Limit, Part, Pitch, Plot, Pose, Replay, Report,
    Series, Shape, SummaryItem, Table, Verdict,
};
use nalgebra::Vector3;

use super::Made;
use crate::figure::{self, Figure};

/// Frames of the replay at most.
const FRAMES: usize = 1800;
/// Bars that the summary is judged by: speed error, drift of the way, time to stop (s).
const BARS: [f64; 3] = [0.05, 0.03, 1.0];

pub(super) fn page(made: &Made) -> Report {
    let (walked, name) = (&made.walked, made.robot.display_name());
    let title = match (walked.fell_at, made.task.asked) {
        (Some(time), _) => format!("{name} falls after {time:.1} s"),
        (None, Asked::Goal([x, y, _])) => format!("{name} walks to ({x:.1}, {y:.1}) m"),
        (None, Asked::Velocity(_)) => format!("{name} walks at {:.2} m/s", walked.mean.x.hypot(walked.mean.y)),
    };
    Report {
        matrix: None,
        title,
        subtitle: format!("{} \u{b7} {:.0} s on its senses \u{b7} seed {}", made.robot.title, made.task.duration, made.task.seed),
        summary: items(made),
        tables: tables(made),
        replay: Some(replay(made)),
        plots: plots(made),
        notes: made.clipped().into_iter().chain([
            "Momentum about the contact is divided by m H, so that it has a speed's unit; planned is what it is to be when \
             the step ends."
                .to_owned(),
        ]).collect(),
    }
}

fn judged(good: bool) -> Verdict {
    if good { Verdict::Good } else { Verdict::Bad }
}

fn items(made: &Made) -> Vec<SummaryItem> {
    let walked = &made.walked;
    let mut items = Vec::new();
    let (state, good) =
        walked.fell_at.map_or(("upright".to_owned(), true), |time| (format!("fell at {time:.2} s"), false));
    items.push(SummaryItem::new("Balance", state, judged(good), format!("{} steps", walked.counts.steps)));
    if let Asked::Velocity(_) = made.task.asked {
        let (mean, asked) = (walked.mean, walked.asked);
        let speed = format!("{:.2}, {:.2} m/s, {:.2} rad/s", mean.x, mean.y, mean.turn);
        let note =
            format!("asked {:.2}, {:.2}, {:.2}: {:.1} % off", asked.x, asked.y, asked.turn, walked.error * 100.0);
        items.push(SummaryItem::new("Velocity", speed, judged(walked.error < BARS[0]), note));
    }
    if let Some([distance, angle]) = walked.goal_error {
        let value = format!("{:.0} mm, {:.1}\u{b0}", distance * 1e3, angle.to_degrees());
        items.push(SummaryItem::new("From the goal", value, Verdict::Neutral, "at the end".to_owned()));
    }
    let stop = walked.stop_time.map_or_else(|| "never".into(), |time| format!("{time:.2} s"));
    let stopped = walked.stop_time.is_some_and(|time| time <= BARS[2]);
    items.push(SummaryItem::new("Stop", stop, judged(stopped), "until it stands".to_owned()));
    let note = format!("velocity {:.3} m/s rms", walked.velocity_error);
    let drift = format!("{:.1} % of {:.1} m", walked.drift_share * 100.0, walked.distance);
    items.push(SummaryItem::new("Estimate's drift", drift, judged(walked.drift_share < BARS[1]), note));
    let note =
        format!("whole-body controller {:.0} us; {:.1} x real time", walked.tick_p99[0] * 1e6, walked.real_time_factor);
    items.push(SummaryItem::new("Tick, 99 %", format!("{:.0} us", walked.tick_p99[1] * 1e6), Verdict::Neutral, note));
    let counts = walked.counts;
    let note = format!("{} without joint ranges, {} late touchdowns", counts.relaxed, counts.late);
    let value = format!("{} of {}", counts.unsolved, counts.ticks);
    items.push(SummaryItem::new("Ticks without solution", value, judged(counts.unsolved == 0), note));
    items
}

fn tables(made: &Made) -> Vec<Table> {
    let rows = made.robot.groups.iter().enumerate().map(|(g, group)| {
        let members = || (0..made.robot.joints.len()).filter(|&j| made.robot.joints[j].group == g);
        let most = |k: usize| members().map(|j| made.walked.peaks[j][k]).fold(0.0, f64::max);
        let cell = |share: f64| {
            Cell::judged(format!("{:.0} %", share * 100.0), if share > 0.98 { Verdict::Bad } else { Verdict::Neutral })
        };
        vec![group.as_str().into(), cell(most(0)), cell(most(1))]
    });
    vec![Table {
        title: "Joint groups at their hardest".into(),
        columns: vec![Column::text("Group"), Column::number("Torque, of limit"), Column::number("Speed, of limit")],
        rows: rows.collect(),
    }]
}

fn replay(made: &Made) -> Replay {
    let (robot, record) = (&made.robot, &made.walked.record);
    let every = record.times.len().div_ceil(FRAMES).max(1);
    let frames: Vec<usize> = (0..record.times.len()).step_by(every).collect();
    let mut data = robot.data();
    let mut actor =
        Figure::new(robot).actor("Robot", &mut data, frames.iter().map(|&i| record.row(&record.q, i)), |c| c);
    actor.arrows = [(Side::Left, Color::GREEN), (Side::Right, Color::VIOLET)]
        .map(|(side, color)| {
            let frame = |&i: &usize| {
                data.set_position(record.row(&record.q, i));
                let forces = record.row(&record.forces, i);
                let (mut sum, mut weighted) = (Vector3::zeros(), Vector3::zeros());
                for (c, contact) in robot.contacts.iter().enumerate().filter(|(_, contact)| contact.leg == side) {
                    let force = Vector3::from_column_slice(&forces[3 * c..3 * c + 3]);
                    sum += force;
                    weighted += data.point(&contact.at) * force.z.max(0.0);
                }
                let origin = if sum.z > 1e-6 { weighted / sum.z } else { Vector3::zeros() };
                ArrowFrame {
                    origin: [origin.x as f32, origin.y as f32, 0.0],
                    vector: [sum.x as f32, sum.y as f32, sum.z as f32],
                }
            };
            let metres_per_unit = (0.5 / (robot.mass() * 9.81)) as f32;
            Arrow {
                name: format!("Ground on {side} foot"),
                color,
                metres_per_unit,
                frames: frames.iter().map(frame).collect(),
            }
        })
        .into();
    let footsteps = [(Side::Left, Color::GREEN), (Side::Right, Color::VIOLET)].map(|(side, color)| Actor {
        name: format!("Footsteps, {side}"),
        parts: made
            .walked
            .footsteps
            .iter()
            .filter(|step| step.side == side)
            .map(|step| {
                let (half, position) = (0.5 * step.heading, step.position.map(|x| x as f32));
                Part {
                    shape: Shape::Box { half_extents: [0.09, 0.03, 0.001] },
                    color: color.with_alpha(0.6),
                    finish: Finish::Plain,
                    poses: vec![Pose {
                        position: [position.x, position.y, 0.002],
                        rotation: [half.cos() as f32, 0.0, 0.0, half.sin() as f32],
                    }],
                }
            })
            .collect(),
        ..Actor::default()
    });
    let mut events = vec![Event { time: made.task.duration, label: "stop asked".into() }];
    events.extend(made.task.pushes.iter().map(|push| Event { time: push.time, label: "push".into() }));
    events.extend(made.walked.fell_at.map(|time| Event { time, label: "fall".into() }));
    events.retain(|event| record.times.last().is_some_and(|&last| event.time <= last));
    events.sort_by(|a, b| a.time.total_cmp(&b.time));
    Replay {
        times: frames.iter().map(|&i| record.times[i]).collect(),
        actors: [actor].into_iter().chain(footsteps).collect(),
        events,
        pitch: Some(Pitch::kid_size()),
        camera: None,
    }
}

fn plots(made: &Made) -> Vec<Plot> {
    let (robot, record) = (&made.robot, &made.walked.record);
    let samples = record.times.len();
    let plot = |title: &str, unit: &str, series: Vec<Series>, limits: &[(&str, f64)]| Plot {
        title: title.into(),
        y_label: unit.into(),
        x: record.times.clone(),
        series,
        limits: limits.iter().map(|&(label, value)| Limit { label: label.into(), value }).collect(),
        ..Plot::default()
    };
    let line = |name: &str, value: &dyn Fn(usize) -> f64| Series::shared(name, (0..samples).map(value).collect());
    let mut plots = Vec::new();
    for (axis, name) in ["ahead", "across"].into_iter().enumerate() {
        plots.push(plot(
            &format!("Momentum about the contact, {name}"),
            "m/s",
            vec![
                line("measured", &|i| record.momentum[i][0][axis]),
                line("planned for the step's end", &|i| record.momentum[i][1][axis]).dashed(),
            ],
            &[],
        ));
    }
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        plots.push(plot(
            &format!("Base velocity, {name}"),
            "m/s",
            vec![
                line("true", &|i| record.velocity[i][0][axis]),
                line("estimated", &|i| record.velocity[i][1][axis]).dashed(),
            ],
            &[],
        ));
    }
    plots.push(Plot {
        title: "Way over the ground".into(),
        x_label: "x / m".into(),
        y_label: "y / m".into(),
        axis: Axis::Other,
        series: vec![
            Series::points("true", record.place.iter().map(|place| place[0]).collect()),
            Series::points("estimated", record.place.iter().map(|place| place[1]).collect()).dashed(),
        ],
        ..Plot::default()
    });
    let ratio = |side: Side| {
        move |i: usize| {
            let forces = record.row(&record.forces, i);
            let sum: Vector3<f64> = (0..robot.contacts.len())
                .filter(|&c| robot.contacts[c].leg == side)
                .map(|c| Vector3::from_column_slice(&forces[3 * c..3 * c + 3]))
                .sum();
            if sum.z > 20.0 { sum.xy().norm() / sum.z } else { f64::NAN }
        }
    };
    let friction = made.task.world.pitch.friction;
    plots.push(plot(
        "Forces in their cone: across over normal",
        "1",
        vec![
            line("left foot", &ratio(Side::Left)).colored(Color::GREEN),
            line("right foot", &ratio(Side::Right)).colored(Color::VIOLET),
        ],
        &[("friction", friction)],
    ));
    let normal = |side: Side| {
        move |i: usize| {
            let forces = record.row(&record.forces, i);
            (0..robot.contacts.len()).filter(|&c| robot.contacts[c].leg == side).map(|c| forces[3 * c + 2]).sum::<f64>()
        }
    };
    plots.push(plot(
        "Ground force, vertical",
        "N",
        vec![
            line("left foot", &normal(Side::Left)).colored(Color::GREEN),
            line("right foot", &normal(Side::Right)).colored(Color::VIOLET),
        ],
        &[("weight", robot.mass() * 9.81)],
    ));
    for (g, group) in robot.groups.iter().enumerate() {
        let joints: Vec<usize> = (0..robot.joints.len()).filter(|&j| robot.joints[j].group == g).collect();
        let Some(&first) = joints.first() else { continue };
        let limit = robot.joints[first].torque;
        let lines = joints
            .iter()
            .map(|&j| line(&robot.joints[j].name.replace('_', " "), &|i| record.row(&record.torques, i)[j]));
        let title = format!("{} torque", figure::capital(&group.replace('_', " ")));
        plots.push(plot(&title, "N m", lines.collect(), &[("limit", limit), ("limit", -limit)]));
    }
    plots
}
