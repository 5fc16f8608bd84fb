//! The report of a retargeted clip: human and robot side by side, and how well the one follows the other.

use instep_motion::landmark::Landmark;
use instep_motion::phase::Side;
use instep_report::{
    Axis, Cell, Color, Column, Event, Limit, Pitch, Plot, Region, Replay, Report, Series, SummaryItem, Table, Verdict,
};
use instep_retarget::kinematic::Status;
use instep_robot::{Robot, RobotData};
use nalgebra::Vector3;

use super::summary::kinematic_violation as violation;
use super::{Done, effort};
use crate::figure::{self, Figure};

/// Stance slip that is still good, m (the project's bar for the enforced form).
const GOOD_SLIP: f64 = 0.005;
/// How far to the left of the robot the human stands, m.
pub(super) const APART: f32 = 1.2;

/// The page of the last stage.
pub(super) fn page(done: &Done) -> Report {
    match &done.kinodynamic {
        Some(k) => effort::page(done, k),
        None => kinematic(done),
    }
}

/// The kinematic stage's page.
fn kinematic(done: &Done) -> Report {
    let r = &done.retargeted;
    let clip = done.clip_file.file_name().unwrap_or_default().to_string_lossy();
    let mut data = done.robot.data();
    let times: Vec<f64> = (0..r.positions.len()).map(|frame| done.clip.time(frame)).collect();
    Report {
        matrix: None,
        title: format!("{clip} on {}", done.robot.display_name()),
        subtitle: format!("{} \u{b7} {}", done.stage(), done.robot.title),
        summary: items(done),
        tables: tables(done, &mut data),
        plots: plots(done, &mut data, &times),
        replay: Some(replay(done, &mut data, times)),
        notes: vec![
            "Times are the clip's own. The human is shown at its own size, the robot at its own; green dots are the \
             human's keypoints at the robot's size, which the robot follows."
                .into(),
            "This stage knows positions only: joint limits hold, but speeds and torques beyond the motors' are counted, \
             not prevented, and nothing says that the robot could keep its balance."
                .into(),
            format!("Motion data: {}", r.reference.source.acknowledgement),
        ],
    }
}

fn items(done: &Done) -> Vec<SummaryItem> {
    let r = &done.retargeted;
    let judged = |good: bool| if good { Verdict::Good } else { Verdict::Bad };
    let status = match r.status {
        Status::Solved => "solved",
        Status::OutOfIterations => "out of iterations",
    };
    let slip = match done.form {
        super::Form::Slip => Verdict::Neutral,
        super::Form::Enforced => judged(r.max_stance_slip < GOOD_SLIP),
    };
    let limit = r.violations.get("joint_limit").copied().unwrap_or(0.0);
    let speed = r.violations.get("joint_speed").copied().unwrap_or(0.0);
    vec![
        SummaryItem::new("Status", status, judged(r.status == Status::Solved), format!("{} iterations", r.iterations)),
        SummaryItem::new(
            "Kick",
            format!("{} foot", r.phases.kick_foot),
            Verdict::Neutral,
            format!("impact at {:.3} s", r.phases.t_impact),
        ),
        SummaryItem::new(
            "Keypoint error",
            format!("{:.1} mm", r.keypoint_error_mean() * 1e3),
            Verdict::Neutral,
            "mean over links and frames",
        ),
        SummaryItem::new(
            "Stance slip",
            format!("{:.1} mm", r.max_stance_slip * 1e3),
            slip,
            "longest way of a standing point",
        ),
        SummaryItem::new(
            "Joint limits",
            if limit > 0.0 { "exceeded" } else { "kept" },
            judged(limit <= 0.0),
            violation("joint_limit", limit),
        ),
        SummaryItem::new(
            "Joint speeds",
            if speed > 0.0 { "too fast" } else { "kept" },
            judged(speed <= 0.0),
            violation("joint_speed", speed.max(0.0)),
        ),
    ]
}

/// Distance of each keypoint from its target at each frame, m: one list a keypoint.
fn errors(done: &Done, data: &mut RobotData) -> Vec<Vec<f64>> {
    let targets = &done.retargeted.targets;
    let mut errors = vec![Vec::with_capacity(targets.frames.len()); targets.keypoints.len()];
    for (q, target) in done.retargeted.positions.iter().zip(&targets.frames) {
        data.set_position(q);
        for ((errors, keypoint), wanted) in errors.iter_mut().zip(&targets.keypoints).zip(&target.positions) {
            errors.push((data.point(&keypoint.at) - wanted).norm());
        }
    }
    errors
}

fn tables(done: &Done, data: &mut RobotData) -> Vec<Table> {
    let r = &done.retargeted;
    let largest = errors(done, data).into_iter().map(|errors| errors.into_iter().fold(0.0, f64::max));
    let rows = r.keypoint_errors.iter().zip(largest).map(|((name, mean), largest)| {
        let millimetres = |x: f64| Cell::from(format!("{:.1}", x * 1e3));
        vec![name.replace('_', " ").into(), millimetres(*mean), millimetres(largest)]
    });
    let families = r.violations.iter().map(|(family, worst)| {
        let verdict = if *worst > 0.0 { Verdict::Neutral } else { Verdict::Good };
        vec![family.replace('_', " ").into(), Cell::judged(violation(family, *worst), verdict)]
    });
    vec![
        Table {
            title: "Distance from the scaled human".into(),
            columns: vec![Column::text("Link"), Column::number("Mean / mm"), Column::number("Largest / mm")],
            rows: rows.collect(),
        },
        Table {
            title: "Violations".into(),
            columns: vec![Column::text("Family"), Column::number("Worst")],
            rows: families.collect(),
        },
    ]
}

fn replay(done: &Done, data: &mut RobotData, times: Vec<f64>) -> Replay {
    let r = &done.retargeted;
    let robot = Figure::new(&done.robot).actor("Robot", data, r.positions.iter().map(Vec::as_slice), |color| color);
    let targets: Vec<&[Vector3<f64>]> = r.targets.frames.iter().map(|target| target.positions.as_slice()).collect();
    let targets = figure::markers("Scaled human", Color::GREEN, &targets);
    let mut human = figure::human("Human", &r.targets.human, r.phases.kick_foot);
    human.offset = [0.0, APART, 0.0];
    let ball = figure::ball(r.reference.ball[2], std::iter::once((r.reference.ball, [1.0, 0.0, 0.0, 0.0])));
    let p = &r.phases;
    let events = [(p.t_plant, "plant"), (p.t_swing, "swing"), (p.t_lock, "lock"), (p.t_impact, "impact")];
    let mut events: Vec<Event> = events.map(|(time, label)| Event { time, label: label.into() }).into();
    events.sort_by(|a, b| a.time.total_cmp(&b.time));
    Replay { times, actors: vec![robot, human, targets, ball], events, pitch: Some(Pitch::kid_size()), camera: None }
}

fn plot(title: impl Into<String>, unit: &str, series: Vec<Series>, limits: &[(&str, f64)]) -> Plot {
    Plot {
        title: title.into(),
        y_label: unit.into(),
        axis: Axis::Time,
        series,
        limits: limits.iter().map(|&(label, value)| Limit { label: label.into(), value }).collect(),
        ..Plot::default()
    }
}

fn plots(done: &Done, data: &mut RobotData, times: &[f64]) -> Vec<Plot> {
    let mut plots = keypoint_plots(done, data);
    for side in [Side::Left, Side::Right] {
        plots.push(foot_plot(done, data, side));
    }
    plots.push(slip_plot(done, data));
    plots.push(speed_plot(done, data, times));
    let robot = &done.robot;
    for (g, group) in robot.groups.iter().enumerate() {
        // Joints that no keypoint moves, such as wrists, would be a flat line.
        let moves = |j: usize| {
            let first = done.retargeted.positions.first().map_or(0.0, |q| q[7 + j]);
            done.retargeted.positions.iter().any(|q| (q[7 + j] - first).abs() > 1e-3)
        };
        let joints = robot.joints.iter().enumerate().filter(|(j, joint)| joint.group == g && moves(*j));
        let lines = joints.map(|(j, joint)| {
            let [least, most] = joint.range;
            let share = |q: &Vec<f64>| (q[7 + j] - least) / (most - least) * 100.0;
            Series::shared(joint.name.replace('_', " "), done.retargeted.positions.iter().map(share).collect())
        });
        let title = format!("{} angles in their range", figure::capital(group));
        let lines: Vec<Series> = lines.collect();
        if !lines.is_empty() {
            plots.push(plot(title, "%", lines, &[("least", 0.0), ("greatest", 100.0)]));
        }
    }
    plots
}

/// Error per link: kicking leg, support leg, the rest.
fn keypoint_plots(done: &Done, data: &mut RobotData) -> Vec<Plot> {
    let kick = done.retargeted.phases.kick_foot;
    let mut plots = vec![
        plot("Error, kicking leg", "mm", Vec::new(), &[]),
        plot("Error, support leg", "mm", Vec::new(), &[]),
        plot("Error, trunk and arms", "mm", Vec::new(), &[]),
    ];
    let keypoints = &done.retargeted.targets.keypoints;
    for (keypoint, errors) in keypoints.iter().zip(errors(done, data)) {
        let (place, name) = match keypoint.landmark {
            Landmark::Hip(side) => (usize::from(side != kick), "hip".to_owned()),
            Landmark::Knee(side) => (usize::from(side != kick), "knee".to_owned()),
            Landmark::Ankle(side) => (usize::from(side != kick), "ankle".to_owned()),
            Landmark::ToeBase(side) => (usize::from(side != kick), "toe base".to_owned()),
            Landmark::ToeTip(side) => (usize::from(side != kick), "toe tip".to_owned()),
            Landmark::Heel(side) => (usize::from(side != kick), "heel".to_owned()),
            other => (2, instep_retarget::rescale::landmark_name(other).replace('_', " ")),
        };
        plots[place].series.push(Series::shared(name, errors.iter().map(|error| error * 1e3).collect()));
    }
    plots
}

/// Heights of a foot's contact points above the ground, with the human's stances shaded.
fn foot_plot(done: &Done, data: &mut RobotData, side: Side) -> Plot {
    let r = &done.retargeted;
    let robot = &done.robot;
    let is_toe = |at: usize| robot.leg(side).toe_link.is_some_and(|toe| toe == at);
    let mut lowest = [Vec::new(), Vec::new()];
    for q in &r.positions {
        data.set_position(q);
        let height = |toe: bool, data: &RobotData| {
            let points = robot.contacts.iter().filter(|c| c.leg == side && is_toe(c.at.link) == toe);
            points.map(|c| data.point(&c.at).z - c.radius).fold(f64::INFINITY, f64::min) * 1e3
        };
        lowest[0].push(height(false, data));
        lowest[1].push(height(true, data));
    }
    let human = Landmark::ALL.iter().position(|landmark| *landmark == Landmark::Ankle(side));
    let human: Vec<f64> =
        r.targets.human.iter().map(|f| human.and_then(|i| f.get(i)).map_or(f64::NAN, |p| p.z * 1e3)).collect();
    let [heel, toe] = lowest;
    let toe_name = if robot.leg(side).toe_link.is_some() { "toe" } else { "no toe" };
    let mut series = vec![Series::shared("heel", heel)];
    if toe.iter().all(|height| height.is_finite()) {
        series.push(Series::shared(toe_name, toe));
    }
    series.push(Series::shared("human's ankle", human).colored(Color::rgb(0x8a96a6)).dashed());
    let mut plot = plot(format!("Height of the {side} foot"), "mm", series, &[]);
    let stances = &r.contacts.foot(side).stances;
    plot.regions = stances
        .iter()
        .map(|s| Region { label: "stands".into(), from: done.clip.time(s.start), to: done.clip.time(s.end) })
        .collect();
    plot
}

/// How far each contact point has moved over the ground since its stance began, at the knots.
fn slip_plot(done: &Done, data: &mut RobotData) -> Plot {
    let (robot, reference) = (&done.robot, &done.retargeted.reference);
    let order: Vec<Option<usize>> = robot.joints.iter().map(|joint| reference.joint_index(&joint.name)).collect();
    let mut since: Vec<Option<Vector3<f64>>> = vec![None; robot.contacts.len()];
    let mut slips: [Vec<[f64; 2]>; 2] = Default::default();
    for (k, knot) in reference.knots.iter().enumerate() {
        let mut q = [&knot.base_position[..], &knot.base_orientation].concat();
        q.extend(order.iter().map(|place| place.and_then(|i| knot.joints.get(i)).copied().unwrap_or(0.0)));
        data.set_position(&q);
        let mut worst = [f64::NAN; 2];
        for (c, contact) in robot.contacts.iter().enumerate() {
            if !knot.contacts.get(c).copied().unwrap_or(false) {
                since[c] = None;
                continue;
            }
            let now = data.point(&contact.at);
            let slip = (now - *since[c].get_or_insert(now)).xy().norm() * 1e3;
            let worst = &mut worst[contact.leg as usize];
            *worst = worst.max(slip);
        }
        let time = reference.source.clip_start + k as f64 / reference.rate;
        for (slips, worst) in slips.iter_mut().zip(worst) {
            slips.push([time, worst]);
        }
    }
    let [left, right] = slips;
    let series = vec![
        Series::points("left foot", left).colored(Color::GREEN),
        Series::points("right foot", right).colored(Color::VIOLET),
    ];
    plot("Slip since the stance began", "mm", series, &[("bar", GOOD_SLIP * 1e3)])
}

/// The fastest joint of each group against its limit.
fn speed_plot(done: &Done, data: &mut RobotData, times: &[f64]) -> Plot {
    let (robot, positions) = (&done.robot, &done.retargeted.positions);
    let mut shares = vec![Vec::with_capacity(positions.len()); robot.groups.len()];
    let mut v = vec![0.0; robot.nv()];
    for i in 0..positions.len() {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(positions.len() - 1));
        if b > a {
            data.difference_into(&positions[a], &positions[b], times[b] - times[a], &mut v);
        }
        for (g, shares) in shares.iter_mut().enumerate() {
            shares.push(fastest(robot, g, &v) * 100.0);
        }
    }
    let series = robot.groups.iter().zip(shares).map(|(group, shares)| Series::shared(group.clone(), shares));
    plot("Fastest joint of a group", "% of limit", series.collect(), &[("limit", 100.0)])
}

/// The largest share of its speed limit among a group's joints.
fn fastest(robot: &Robot, group: usize, v: &[f64]) -> f64 {
    let joints = robot.joints.iter().zip(&v[6..]).filter(|(joint, _)| joint.group == group);
    joints.map(|(joint, v)| v.abs() / joint.speed).fold(0.0, f64::max)
}
