//! The report of a kick: the replay, with the reference as a ghost where one was followed, the measures, and plots of everything recorded.

use instep_motion::phase::Side;
use instep_motion::reference::Knot;
use instep_report::{
    Arrow, ArrowFrame, Cell, Color, Column, Event, Limit, Picture, Pitch, Plot, Region, Replay, Report, Series,
    SummaryItem, Table, Verdict,
};
use instep_robot::{LinkPoint, Robot};
use nalgebra::Vector3;

use super::{Followed, Source, Tried, summary};
use crate::figure::{self, Figure};

/// Frames of the replay are this far apart, s; around the impact every sample is shown.
const FRAME: f64 = 0.006;
/// How far around the impact that is, s.
const CLOSE: f64 = 0.03;

/// The whole page.
pub(crate) fn page(tried: &Tried) -> Report {
    let (trial, name) = (&tried.trial, tried.robot.display_name());
    let title = match &trial.impact {
        Some(_) if trial.audit.is_valid() => format!("{name} kicks at {:.2} m/s", trial.ball_speed.unwrap_or(0.0)),
        Some(_) => format!("{name} kicks, but it is not to be believed"),
        None => format!("{name} misses the ball"),
    };
    let ball = tried.settings.ball.position;
    Report {
        title,
        subtitle: format!(
            "{} \u{b7} {} \u{b7} ball at ({:.3}, {:.3}) m \u{b7} seed {}",
            tried.robot.title,
            tried.steered(),
            ball[0],
            ball[1],
            tried.settings.seed,
        ),
        summary: items(tried),
        tables: tables(tried),
        replay: Some(replay(tried)),
        plots: plots(tried),
        notes: notes(tried),
        ..Report::default()
    }
}

fn verdict(good: bool) -> Verdict {
    if good { Verdict::Good } else { Verdict::Bad }
}

fn items(tried: &Tried) -> Vec<SummaryItem> {
    let trial = &tried.trial;
    let valid = trial.audit.faults.is_empty();
    let mut items = Vec::new();
    match &trial.impact {
        None => items.push(SummaryItem::new("Ball", "not touched", Verdict::Bad, "no impact, no ball speed")),
        Some(impact) => {
            let speed = format!("{:.2} m/s", trial.ball_speed.unwrap_or(0.0));
            let note = trial.launch_angle.map(|a| format!("{:.1}\u{b0} above the ground", a.to_degrees()));
            items.push(SummaryItem::new(
                "Ball speed",
                speed,
                if valid { Verdict::Neutral } else { Verdict::Bad },
                note.unwrap_or_default(),
            ));
            let direction = trial.direction_error.map(summary::direction).unwrap_or_default();
            let from = if tried.followed().is_some() { "straight ahead" } else { "what was asked" };
            items.push(SummaryItem::new("Direction", direction, Verdict::Neutral, format!("away from {from}")));
            let speed = format!("{:.2} m/s", impact.foot_speed);
            items.push(SummaryItem::new("Foot speed", speed, Verdict::Neutral, impact.link.clone()));
            let mass = format!("{:.2} kg", impact.effective_mass);
            let note = format!("restitution {:.2}, {:.1} ms", impact.restitution, impact.duration * 1e3);
            items.push(SummaryItem::new("Effective mass", mass, Verdict::Neutral, note));
        }
    }
    let reason = if valid {
        "every touch, and the whole kick at a quarter of the step".to_owned()
    } else {
        trial.audit.reason()
    };
    items.push(SummaryItem::new("Audit", trial.audit.verdict(), verdict(valid), reason));
    let (state, note) = match trial.fell_at {
        None => ("upright".to_owned(), format!("to the end, {:.2} s", tried.settings.duration)),
        Some(_) => ("fell".to_owned(), summary::balance(tried)),
    };
    items.push(SummaryItem::new("Balance", state, verdict(trial.upright()), note));
    let beyond = trial.limit_violations.len();
    let limits = if beyond == 0 { "kept".to_owned() } else { format!("{beyond} broken") };
    items.push(SummaryItem::new("Joint limits", limits, verdict(beyond == 0), "torque and speed of every motor"));
    if !tried.world_changes.is_empty() {
        let changes: Vec<String> = tried.world_changes.iter().map(ToString::to_string).collect();
        items.push(SummaryItem::new("World", "changed", Verdict::Bad, changes.join("; ")));
    }
    items
}

fn tables(tried: &Tried) -> Vec<Table> {
    let trial = &tried.trial;
    let share = |peak: f64, limit: f64| {
        let share = peak / limit;
        Cell::judged(format!("{:.0} %", share * 100.0), if share > 1.02 { Verdict::Bad } else { Verdict::Neutral })
    };
    let groups = trial.groups.iter().map(|g| {
        vec![
            g.group.as_str().into(),
            format!("{:.1}", g.torque).into(),
            share(g.torque, g.torque_limit),
            g.torque_joint.as_str().into(),
            format!("{:.1}", g.speed).into(),
            share(g.speed, g.speed_limit),
            g.speed_joint.as_str().into(),
        ]
    });
    let mut tables = vec![Table {
        title: "Joint groups at their hardest".into(),
        columns: vec![
            Column::text("Group"),
            Column::number("Torque / N m"),
            Column::number("Of limit"),
            Column::text("Joint"),
            Column::number("Speed / rad/s"),
            Column::number("Of limit"),
            Column::text("Joint"),
        ],
        rows: groups.collect(),
    }];
    if let Some(impact) = &trial.impact {
        let segments = trial.segments.iter().map(|s| {
            let when = format!("{:+.0}", (s.time - impact.time) * 1e3);
            vec![s.segment.into(), format!("{:.2}", s.speed).into(), when.into()]
        });
        tables.push(Table {
            title: "Peak forward speeds, pelvis to toe".into(),
            columns: vec![Column::text("Segment"), Column::number("Speed / m/s"), Column::number("From impact / ms")],
            rows: segments.collect(),
        });
        let row = |what: &str, value: String, how: &str| vec![what.into(), value.into(), how.into()];
        let optional =
            |value: Option<f64>, unit: &str| value.map_or_else(|| "none".into(), |v| format!("{v:.2} {unit}"));
        tables.push(Table {
            title: "Impact".into(),
            columns: vec![Column::text("Measure"), Column::number("Value"), Column::text("How")],
            rows: vec![
                row(
                    "Re-run",
                    trial.audit.rerun.as_ref().map_or_else(|| "none".into(), summary::rerun),
                    "the whole kick at a quarter of the step",
                ),
                row(
                    "Energy gained",
                    optional(trial.audit.energy_gain, "J"),
                    "beyond the work of motors, pushes and gravity",
                ),
                row("Penetration", format!("{:.1} mm", impact.depth * 1e3), "the deepest of the hardest touch"),
                row("Motors' work", format!("{:.2} J", impact.motor_work), "during contact"),
                row("Touches", trial.touches.len().to_string(), "contacts with pauses between, whole trial"),
                row(
                    "Support slip",
                    optional(trial.support_slip.map(|s| s * 1e3), "mm"),
                    "longest way of a loaded point",
                ),
            ],
        });
    }
    tables
}

/// Samples shown in the replay.
fn frames(tried: &Tried) -> Vec<usize> {
    let times = &tried.trial.record.times;
    let impact = tried.trial.impact.as_ref().map(|impact| impact.time + impact.duration / 2.0);
    let mut last = f64::NEG_INFINITY;
    let shown = |i: &usize| {
        let close = impact.is_some_and(|impact| (times[*i] - impact).abs() < CLOSE);
        let wanted = close || times[*i] - last > FRAME - 1e-9 || i + 1 == times.len();
        if wanted {
            last = times[*i];
        }
        wanted
    };
    (0..times.len()).filter(shown).collect()
}

/// Seconds before and after the impact that the small picture shows.
const SHOWN: [f64; 2] = [1.0, 0.35];

/// The kick as a small picture that moves.
pub(super) fn picture(tried: &Tried) -> String {
    let times = &tried.trial.record.times;
    let end = times.last().copied().unwrap_or(0.0);
    let middle = tried.trial.impact.as_ref().map_or(end, |impact| impact.time);
    let span = [(middle - SHOWN[0]).max(0.0), (middle + SHOWN[1]).min(end)];
    let azimuth = -std::f64::consts::FRAC_PI_2 + 0.5;
    Picture { azimuth, elevation: 0.12, size: [420.0, 320.0], rate: 20.0, span }.svg(&replay(tried))
}

fn replay(tried: &Tried) -> Replay {
    let (robot, record) = (&tried.robot, &tried.trial.record);
    let frames = frames(tried);
    let mut data = robot.data();
    let body = Figure::new(robot);
    let positions = frames.iter().map(|&i| record.row(&record.q, i));
    let mut actor = body.actor("Robot", &mut data, positions, |color| color);
    actor.arrows = arrows(tried, &frames);
    let mut actors = vec![actor];
    if let Some(followed) = tried.followed() {
        let position = |&i: &usize| reference_position(&tried.robot, followed, record.times[i]);
        let reference: Vec<Vec<f64>> = frames.iter().map(position).collect();
        let ghost = |_| Color::rgb(0x7f8ea3).with_alpha(0.25);
        actors.push(body.actor("Reference", &mut data, reference.iter().map(Vec::as_slice), ghost));
    }
    let ball = frames.iter().map(|&i| (record.ball[i].position, record.ball[i].orientation));
    actors.push(figure::ball(tried.settings.world.ball.radius, ball));
    let event = |(time, label): (f64, &str)| Event { time, label: label.into() };
    Replay {
        times: frames.iter().map(|&i| record.times[i]).collect(),
        actors,
        events: summary::events(&tried.trial).into_iter().map(event).collect(),
        pitch: Some(Pitch::kid_size()),
        camera: None,
    }
}

/// The reference's position at the trial's time `time`, in the robot's order.
fn reference_position(robot: &Robot, followed: &Followed, time: f64) -> Vec<f64> {
    let mut knot = Knot::default();
    followed.reference.sample_into(followed.start + time, &mut knot);
    let mut q = [&knot.base_position[..], &knot.base_orientation].concat();
    let place = |name: &str| followed.reference.joint_index(name).map_or(0.0, |i| knot.joints[i]);
    q.extend(robot.joints.iter().map(|joint| place(&joint.name)));
    q
}

/// Force of the ground on each foot, drawn at its centre of pressure.
fn arrows(tried: &Tried, frames: &[usize]) -> Vec<Arrow> {
    let (robot, record) = (&tried.robot, &tried.trial.record);
    let mut data = robot.data();
    let mut arrows = [(Side::Left, Color::GREEN), (Side::Right, Color::VIOLET)].map(|(side, color)| Arrow {
        name: format!("Ground on {side} foot"),
        color,
        metres_per_unit: (0.7 / (robot.mass() * 9.81)) as f32,
        frames: Vec::with_capacity(frames.len()),
    });
    for &i in frames {
        data.set_position(record.row(&record.q, i));
        let forces = record.row(&record.contact_forces, i);
        for (side, arrow) in [Side::Left, Side::Right].into_iter().zip(&mut arrows) {
            let (mut sum, mut weighted) = (Vector3::zeros(), Vector3::zeros());
            for (c, contact) in robot.contacts.iter().enumerate().filter(|(_, contact)| contact.leg == side) {
                let force = Vector3::new(forces[3 * c], forces[3 * c + 1], forces[3 * c + 2]);
                sum += force;
                weighted += data.point(&contact.at) * force.z.max(0.0);
            }
            let origin = if sum.z > 1e-6 { weighted / sum.z } else { Vector3::zeros() };
            arrow.frames.push(ArrowFrame {
                origin: [origin.x as f32, origin.y as f32, 0.0],
                vector: [sum.x as f32, sum.y as f32, sum.z as f32],
            });
        }
    }
    arrows.into()
}

fn plots(tried: &Tried) -> Vec<Plot> {
    let (robot, record) = (&tried.robot, &tried.trial.record);
    let regions = regions(tried);
    let plot = |title: &str, unit: &str, series: Vec<Series>, limits: &[(&str, f64)]| Plot {
        title: title.into(),
        y_label: unit.into(),
        x: record.times.clone(),
        series,
        limits: limits.iter().map(|&(label, value)| Limit { label: label.into(), value }).collect(),
        regions: regions.clone(),
        ..Plot::default()
    };
    let ball = record.ball.iter().map(|ball| Vector3::from(ball.velocity).norm());
    let mut plots = vec![plot("Ball speed", "m/s", vec![Series::shared("ball", ball.collect())], &[])];
    let motion = motion(tried);
    plots.push(plot("Forward speed, pelvis to toe", "m/s", motion.segments, &[]));
    plots.push(plot("Height", "m", motion.heights, &[]));
    let side_force = |side: Side| {
        let points: Vec<usize> = (0..robot.contacts.len()).filter(|&c| robot.contacts[c].leg == side).collect();
        let force = |i: usize| points.iter().map(|c| record.row(&record.contact_forces, i)[3 * c + 2]).sum::<f64>();
        (0..record.len()).map(force).collect::<Vec<f64>>()
    };
    let forces = vec![
        Series::shared("left foot", side_force(Side::Left)).colored(Color::GREEN),
        Series::shared("right foot", side_force(Side::Right)).colored(Color::VIOLET),
    ];
    plots.push(plot("Ground force, vertical", "N", forces, &[("weight", robot.mass() * 9.81)]));
    let column = |values: &[f64], first: usize, joint: usize| {
        (0..record.len()).map(|i| record.row(values, i)[first + joint]).collect::<Vec<f64>>()
    };
    for (g, group) in robot.groups.iter().enumerate() {
        let joints: Vec<usize> = (0..robot.joints.len()).filter(|&j| robot.joints[j].group == g).collect();
        let Some(&first) = joints.first() else { continue };
        let (torque, speed) = (robot.joints[first].torque, robot.joints[first].speed);
        let lines = |values: &[f64], offset: usize| {
            let line = |&j: &usize| Series::shared(robot.joints[j].name.replace('_', " "), column(values, offset, j));
            joints.iter().map(line).collect::<Vec<_>>()
        };
        let name = figure::capital(group);
        let both = |limit: f64| [("limit", limit), ("limit", -limit)];
        plots.push(plot(&format!("{name} torque"), "N m", lines(&record.torques, 0), &both(torque)));
        plots.push(plot(&format!("{name} speed"), "rad/s", lines(&record.v, 6), &both(speed)));
    }
    plots
}

/// The reference's phases in the trial's time.
fn regions(tried: &Tried) -> Vec<Region> {
    let Some(followed) = tried.followed() else { return Vec::new() };
    let phases = &followed.reference.phases;
    let end = tried.settings.duration;
    let at = |time: f64| (time - followed.start).clamp(0.0, end);
    let region = |label: &str, from: f64, to: f64| Region { label: label.into(), from: at(from), to: at(to) };
    let mut regions = vec![region("swing", phases.t_swing, phases.t_impact)];
    regions.retain(|region| region.to > region.from);
    regions
}

struct Motion {
    segments: Vec<Series>,
    heights: Vec<Series>,
}

/// Forward speeds of the kicking leg's parts, and how high the robot stands.
fn motion(tried: &Tried) -> Motion {
    let (robot, record) = (&tried.robot, &tried.trial.record);
    let leg = robot.leg(tried.foot());
    let mut links = vec![("pelvis", robot.base), ("thigh", leg.thigh), ("shank", leg.shank), ("foot", leg.foot)];
    links.extend(leg.toe_link.map(|toe| ("toe", toe)));
    let forward = Vector3::new(tried.settings.direction.cos(), tried.settings.direction.sin(), 0.0);
    let mut speeds = vec![Vec::with_capacity(record.len()); links.len()];
    let (mut base, mut com) = (Vec::with_capacity(record.len()), Vec::with_capacity(record.len()));
    let mut data = robot.data();
    for i in 0..record.len() {
        data.set_state(record.row(&record.q, i), record.row(&record.v, i));
        for (speeds, (_, link)) in speeds.iter_mut().zip(&links) {
            let centre = LinkPoint { link: *link, point: robot.model().body_ipos()[*link].into() };
            speeds.push(data.point_velocity(&centre).dot(&forward));
        }
        base.push(record.row(&record.q, i)[2]);
        com.push(data.com().z);
    }
    let mut heights = vec![Series::shared("centre of mass", com), Series::shared("base", base)];
    if let Some(followed) = tried.followed() {
        let mut knot = Knot::default();
        let planned = record.times.iter().map(|time| {
            followed.reference.sample_into(followed.start + time, &mut knot);
            knot.base_position[2]
        });
        let planned = Series::shared("base, reference", planned.collect());
        heights.push(planned.colored(Color::rgb(0x8a96a6)).dashed());
    }
    Motion {
        segments: links.iter().zip(speeds).map(|((name, _), speeds)| Series::shared(*name, speeds)).collect(),
        heights,
    }
}

fn notes(tried: &Tried) -> Vec<String> {
    let step = &tried.settings.world.step;
    let from = match &tried.source {
        Source::Followed(_) => format!("The reference was {}.", summary::start(tried)),
        Source::Asked { .. } => format!("The kick started {}.", summary::start(tried)),
    };
    let how = match &tried.source {
        Source::Followed(followed) if followed.policy.is_none() => {
            "The reference is played open loop: joint angles and speeds go to the drives as they stand in it. Nothing \
             keeps the robot in balance, and what a motor cannot give is lost."
        }
        Source::Followed(_) => {
            "The policy corrects the reference's joint angles 50 times a second from what its sensors tell: encoders, \
             inertial sensor, foot pressure and a sight of the ball."
        }
        Source::Asked { .. } => "The engine planned the kick when it was asked, and sees only the robot's sensors.",
    };
    let mut notes = vec![
        from,
        how.into(),
        format!(
            "Time step {} ms, {} ms while the ball is near the robot. Ball speed and direction are those after the last touch. The \
             audit: at every touch kinetic energy may not grow by more than motors, pushes and gravity gave, effective restitution \
             is at most {}, ball and robot are at most half a ball's radius and {} ms in one another; and the whole kick, run again \
             at a quarter of the step, may change the ball's speed by {} % and its direction by {}\u{b0} at most.",
            step.far * 1e3,
            step.near * 1e3,
            instep_sim::audit::MAX_RESTITUTION,
            instep_sim::audit::MAX_CONTACT * 1e3,
            instep_sim::audit::SPEED_CHANGE[1] * 100.0,
            instep_sim::audit::DIRECTION_CHANGE_DEG[1],
        ),
        "A fall is a base tilted by more than 60\u{b0} or at less than half its standing height, or any part but a \
         foot on the ground."
            .into(),
    ];
    if let Some(followed) = tried.followed() {
        notes.push(format!("Motion data: {}", followed.reference.source.acknowledgement));
    }
    notes
}
