//! The report of a kinodynamic reference: what the motion asks of motors and ground, the six phases of the kick, and the
//! order in which the links of the kicking leg are fastest (paper 1, Fig 6).

use instep_motion::phase::Side;
use instep_motion::reference::{Knot, Reference};
use instep_report::{
    Arrow, ArrowFrame, Cell, Color, Column, Event, Limit, Pitch, Plot, Region, Replay, Report, Series, SummaryItem,
    Table, Verdict,
};
use instep_retarget::kinodynamic::Kinodynamic;
use instep_retarget::kinodynamic::verify::{MAX_ROOT_WRENCH, MAX_SLIP};
use instep_robot::control::torque_range;
use instep_robot::{LinkPoint, Robot, RobotData};
use nalgebra::Vector3;

use super::page::APART;
use super::{Done, summary};
use crate::figure::{self, Figure};

/// How long a ball stays on a foot, about, s.
const BALL_CONTACT: f64 = 0.01;
/// Joints whose effort never passes this share of a limit are left out of the plots.
const VISIBLE: f64 = 0.05;
/// A force whose friction is worth a line, as a share of m g.
const LOADED: f64 = 0.02;

/// The reference as the page shows it: every other knot, which is where the optimisation has its nodes.
struct Shown<'a> {
    reference: &'a Reference,
    knots: Vec<&'a Knot>,
    times: Vec<f64>,
    /// 7 + n and 6 + n, in the robot's order.
    states: Vec<(Vec<f64>, Vec<f64>)>,
    regions: Vec<Region>,
}

impl<'a> Shown<'a> {
    fn new(robot: &Robot, reference: &'a Reference) -> Self {
        let (times, knots): (Vec<f64>, Vec<&Knot>) =
            reference.knots.iter().enumerate().step_by(2).map(|(k, knot)| (k as f64 / reference.rate, knot)).unzip();
        let state = |knot: &&Knot| {
            let q = [&knot.base_position[..], &knot.base_orientation, &knot.joints].concat();
            (q, [&knot.base_velocity[..], &knot.base_angular_velocity, &knot.joint_velocities].concat())
        };
        let states = knots.iter().map(state).collect();
        let mut regions: Vec<Region> = phases(robot, reference)
            .into_iter()
            .filter(|(name, ..)| *name != "support")
            .map(|(name, from, to)| Region { label: name.into(), from, to })
            .collect();
        regions.retain(|region| region.to > region.from);
        Self { reference, knots, times, states, regions }
    }

    fn plot(&self, title: impl Into<String>, unit: &str, series: Vec<Series>, limits: &[(&str, f64)]) -> Plot {
        Plot {
            title: title.into(),
            y_label: unit.into(),
            x: self.times.clone(),
            series,
            limits: limits.iter().map(|&(label, value)| Limit { label: label.into(), value }).collect(),
            regions: self.regions.clone(),
            ..Plot::default()
        }
    }
}

/// The six phases of an instep kick: name, from, to, s. They overlap: the support foot stands through most of them.
fn phases(robot: &Robot, reference: &Reference) -> Vec<(&'static str, f64, f64)> {
    let p = &reference.phases;
    let end = reference.duration();
    let touches = |side: Side, knot: &Knot| {
        robot.contacts.iter().zip(&knot.contacts).any(|(contact, on)| *on && contact.leg == side)
    };
    let time = |k: usize| k as f64 / reference.rate;
    let impact = ((p.t_impact * reference.rate) as usize).min(reference.knots.len() - 1);
    let (kicks, supports) = (p.kick_foot, p.kick_foot.other());
    let before = &reference.knots[..=impact];
    let toe_off = before.iter().rposition(|knot| touches(kicks, knot)).map_or(0.0, time);
    let after = &reference.knots[impact..];
    let lifts = after.iter().position(|knot| !touches(supports, knot)).map_or(end, |k| time(impact + k));
    let down = after.iter().position(|knot| touches(kicks, knot)).map_or(end, |k| time(impact + k));
    let ball = (p.t_impact + BALL_CONTACT).min(end);
    vec![
        ("approach", 0.0, toe_off.min(p.t_swing)),
        ("support", p.t_plant, lifts),
        ("wind-up", toe_off.min(p.t_swing), p.t_swing),
        ("leg swing", p.t_swing, p.t_impact),
        ("ball contact", p.t_impact, ball),
        ("follow-through", ball, down.max(ball)),
    ]
}

/// The whole page.
pub(super) fn page(done: &Done, k: &Kinodynamic) -> Report {
    let clip = done.clip_file.file_name().unwrap_or_default().to_string_lossy();
    let shown = Shown::new(&done.robot, &k.reference);
    let mut data = done.robot.data();
    let speeds = link_speeds(done, &shown, &mut data);
    let mut notes = vec![
        "Times are the reference's own, with the time scale in it. The human beside the robot has its own size. \
         Torques, wrench and momentum are those of the whole body, by full inverse dynamics."
            .into(),
        "The motion ends at the ball as if there were none: its impact is not in it. Nothing here corrects errors; played \
         open loop it drifts."
            .into(),
    ];
    if !k.status.feasible() {
        notes.insert(0, format!("NOT FEASIBLE: {}. The best motion found is shown.", summary::ending(&k.status)));
    }
    notes.extend(summary::advice(k));
    notes.push(format!("Motion data: {}", k.reference.source.acknowledgement));
    Report {
        matrix: None,
        title: match k.status.feasible() {
            true => format!("{clip} as {} can do it", done.robot.display_name()),
            false => format!("{clip}: not what {} can do", done.robot.display_name()),
        },
        subtitle: format!("{} \u{b7} {} \u{b7} time scale {}", done.stage(), done.robot.title, k.time_scale),
        summary: items(k),
        tables: tables(done, k, &shown, &speeds),
        plots: plots(done, &shown, &speeds, &mut data),
        replay: Some(replay(done, k, &shown, &mut data)),
        notes,
    }
}

fn judged(good: bool) -> Verdict {
    if good { Verdict::Good } else { Verdict::Bad }
}

fn items(k: &Kinodynamic) -> Vec<SummaryItem> {
    let v = &k.verification;
    let beyond = v.torque_violations + v.speed_violations + v.joint_violations;
    let status = if k.status.feasible() { "feasible" } else { "not feasible" };
    let least = k.violations.values().fold(0.0_f64, |most, v| most.max(*v));
    vec![
        SummaryItem::new("Status", status, judged(k.status.feasible()), summary::ending(&k.status)),
        SummaryItem::new(
            "Foot speed at impact",
            format!("{:.2} m/s", k.foot_speed_at_impact),
            judged(k.foot_speed_at_impact >= k.kinematic_foot_speed),
            format!("kinematic stage {:.2} m/s", k.kinematic_foot_speed),
        ),
        SummaryItem::new(
            "Motor limits",
            if beyond == 0 { "kept".to_owned() } else { format!("{beyond} times broken") },
            judged(beyond == 0),
            format!("torque, speed and angle at {} instants", v.samples),
        ),
        SummaryItem::new(
            "Wrench on the base",
            format!("{:.2} %", v.root_wrench_residual * 100.0),
            judged(v.root_wrench_residual <= MAX_ROOT_WRENCH),
            "of m g, which neither ground nor gravity gives",
        ),
        SummaryItem::new(
            "Stance slip",
            format!("{:.2} mm", v.stance_slip * 1e3),
            judged(v.stance_slip <= MAX_SLIP && v.stance_lift <= MAX_SLIP),
            format!("lift {:.2} mm, deepest point {:.2} mm", v.stance_lift * 1e3, v.penetration * 1e3),
        ),
        SummaryItem::new(
            "Worst violation",
            format!("{least:.1e}"),
            judged(least <= 1e-4),
            format!("{} steps of the solver", k.iterations),
        ),
        SummaryItem::new(
            "Approach angle",
            format!("{:.1}\u{b0}", k.approach_angle.to_degrees()),
            judged(k.violations.get("approach_angle").is_none_or(|v| *v <= 1e-4)),
            format!("ball met {:.0} mm from its place", k.ball_miss * 1e3),
        ),
    ]
}

fn tables(done: &Done, k: &Kinodynamic, shown: &Shown, speeds: &[(&str, Vec<f64>)]) -> Vec<Table> {
    let impact = k.reference.phases.t_impact;
    let phases = phases(&done.robot, &k.reference).into_iter().map(|(name, from, to)| {
        vec![name.into(), format!("{from:.3}").into(), format!("{to:.3}").into(), format!("{:.3}", to - from).into()]
    });
    // The peak before the leg comes down again: around the impact, not in the run-up.
    let near = |time: &f64| (*time - impact).abs() < 0.3;
    let order = speeds.iter().map(|(name, speeds)| {
        let peak = speeds.iter().zip(&shown.times).filter(|(_, time)| near(time)).max_by(|a, b| a.0.total_cmp(b.0));
        let (speed, time) = peak.map_or((f64::NAN, f64::NAN), |(speed, time)| (*speed, *time));
        vec![(*name).into(), format!("{speed:.2}").into(), format!("{:+.0}", (time - impact) * 1e3).into()]
    });
    let share = |uses: &std::collections::BTreeMap<String, f64>, name: &str| {
        let share = uses.get(name).copied().unwrap_or(f64::NAN);
        let verdict = if share > 1.0 { Verdict::Bad } else { Verdict::Neutral };
        Cell::judged(format!("{:.0} %", share * 100.0), verdict)
    };
    let v = &k.verification;
    let joints = done.robot.joints.iter().map(|joint| {
        let name = joint.name.as_str();
        vec![
            name.replace('_', " ").into(),
            share(&v.torque_use, name),
            share(&v.speed_use, name),
            share(&v.swing_torque_use, name),
            share(&v.swing_speed_use, name),
        ]
    });
    let families = k.violations.iter().map(|(family, worst)| {
        let verdict = if *worst > 1e-4 { Verdict::Bad } else { Verdict::Good };
        vec![family.replace('_', " ").into(), Cell::judged(summary::amount(family, *worst), verdict)]
    });
    let seconds = done.seconds.iter().map(|(stage, s)| vec![(*stage).into(), format!("{s:.2}").into()]);
    let table = |title: &str, columns: Vec<Column>, rows: Vec<Vec<Cell>>| Table { title: title.into(), columns, rows };
    vec![
        table(
            "The six phases",
            vec![
                Column::text("Phase"),
                Column::number("From / s"),
                Column::number("To / s"),
                Column::number("Length / s"),
            ],
            phases.collect(),
        ),
        table(
            "Peak forward speeds, pelvis to toe",
            vec![Column::text("Link"), Column::number("Speed / m/s"), Column::number("From impact / ms")],
            order.collect(),
        ),
        table(
            "What limits the foot's speed",
            vec![Column::text("Limit"), Column::text("Joint"), Column::number("Used")],
            k.swing_binding
                .iter()
                .map(|b| {
                    vec![b.limit.into(), b.joint.replace('_', " ").into(), format!("{:.0} %", b.share * 100.0).into()]
                })
                .collect(),
        ),
        table(
            "Motors at their hardest",
            vec![
                Column::text("Joint"),
                Column::number("Torque"),
                Column::number("Speed"),
                Column::number("Torque, swing"),
                Column::number("Speed, swing"),
            ],
            joints.collect(),
        ),
        table("Violations at the nodes", vec![Column::text("Family"), Column::text("Worst")], families.collect()),
        table("Time", vec![Column::text("Stage"), Column::number("s")], seconds.collect()),
    ]
    .into_iter()
    .filter(|table: &Table| !table.rows.is_empty())
    .collect()
}

fn replay(done: &Done, k: &Kinodynamic, shown: &Shown, data: &mut RobotData) -> Replay {
    let r = &done.retargeted;
    let mut robot = Figure::new(&done.robot).actor("Robot", data, shown.states.iter().map(|s| s.0.as_slice()), |c| c);
    robot.arrows = arrows(done, shown, data);
    let source = &k.reference.source;
    let frame = |t: &f64| done.clip.frame_at(source.clip_start + t / k.time_scale).min(r.targets.human.len() - 1);
    let human: Vec<Vec<Vector3<f64>>> = shown.times.iter().map(|t| r.targets.human[frame(t)].clone()).collect();
    let mut human = figure::human("Human", &human, r.phases.kick_foot);
    human.offset = [0.0, APART, 0.0];
    let ball = figure::ball(k.reference.ball[2], std::iter::once((k.reference.ball, [1.0, 0.0, 0.0, 0.0])));
    let p = &k.reference.phases;
    let events = [(p.t_plant, "plant"), (p.t_swing, "swing"), (p.t_lock, "lock"), (p.t_impact, "impact")];
    let mut events: Vec<Event> = events.map(|(time, label)| Event { time, label: label.into() }).into();
    events.sort_by(|a, b| a.time.total_cmp(&b.time));
    let times = shown.times.clone();
    Replay { times, actors: vec![robot, human, ball], events, pitch: Some(Pitch::kid_size()), camera: None }
}

/// Force of the ground at every contact point.
fn arrows(done: &Done, shown: &Shown, data: &mut RobotData) -> Vec<Arrow> {
    let robot = &done.robot;
    let mut arrows: Vec<Arrow> = robot
        .contacts
        .iter()
        .map(|contact| Arrow {
            name: contact.name.replace('_', " "),
            color: if contact.leg == Side::Left { Color::GREEN } else { Color::VIOLET },
            metres_per_unit: (0.7 / (robot.mass() * 9.81)) as f32,
            frames: Vec::with_capacity(shown.times.len()),
        })
        .collect();
    for (knot, (q, _)) in shown.knots.iter().zip(&shown.states) {
        data.set_position(q);
        for ((contact, arrow), force) in robot.contacts.iter().zip(&mut arrows).zip(&knot.forces) {
            let at = data.point(&contact.at);
            arrow.frames.push(ArrowFrame {
                origin: [at.x as f32, at.y as f32, (at.z - contact.radius) as f32],
                vector: force.map(|f| f as f32),
            });
        }
    }
    arrows
}

/// Forward speed of each link of the kicking leg at its centre of mass, m/s, at the times shown.
fn link_speeds<'a>(done: &'a Done, shown: &Shown, data: &mut RobotData) -> Vec<(&'a str, Vec<f64>)> {
    let robot = &done.robot;
    let leg = robot.leg(shown.reference.phases.kick_foot);
    let mut links = vec![("pelvis", robot.base), ("thigh", leg.thigh), ("shank", leg.shank), ("foot", leg.foot)];
    links.extend(leg.toe_link.map(|toe| ("toe", toe)));
    let mut speeds: Vec<(&str, Vec<f64>)> = links.iter().map(|(name, _)| (*name, Vec::new())).collect();
    for (q, v) in &shown.states {
        data.set_state(q, v);
        for ((_, speeds), (_, link)) in speeds.iter_mut().zip(&links) {
            let centre = LinkPoint { link: *link, point: robot.model().body_ipos()[*link].into() };
            speeds.push(data.point_velocity(&centre).x);
        }
    }
    speeds
}

/// The steepest of a foot's contact forces as a share of its cone about the ground's normal, %. A foot without a loaded
/// point has no share: NaN, a gap in the line.
fn cone_shares(done: &Done, shown: &Shown, side: Side, data: &mut RobotData) -> Vec<f64> {
    let robot = &done.robot;
    let loaded = LOADED * robot.mass() * 9.81;
    let steepest = |(knot, (q, _)): (&&Knot, &(Vec<f64>, Vec<f64>))| {
        data.set_position(q);
        let own = robot.contacts.iter().zip(&knot.forces).filter(|(contact, _)| contact.leg == side);
        let shares = own.map(|(contact, force)| {
            let (at, force) = (data.point(&contact.at), Vector3::from(*force));
            let normal = done.limits.ground.normal(at.x, at.y);
            let up = force.dot(&normal);
            let across = (force - normal * up).norm();
            if up > loaded { across / (done.limits.friction * up) * 100.0 } else { f64::NAN }
        });
        shares.fold(f64::NAN, f64::max)
    };
    shown.knots.iter().zip(&shown.states).map(steepest).collect()
}

fn plots(done: &Done, shown: &Shown, speeds: &[(&str, Vec<f64>)], data: &mut RobotData) -> Vec<Plot> {
    let robot = &done.robot;
    let weight = robot.mass() * 9.81;
    let lines = speeds.iter().map(|(name, speeds)| Series::shared(*name, speeds.clone())).collect();
    let mut plots = vec![shown.plot("Forward speed, pelvis to toe", "m/s", lines, &[])];
    let vertical = |side: Side| {
        let forces = |knot: &&Knot| {
            robot.contacts.iter().zip(&knot.forces).filter(|(c, _)| c.leg == side).map(|(_, f)| f[2]).sum()
        };
        shown.knots.iter().map(forces).collect::<Vec<f64>>()
    };
    let both = |[left, right]: [Vec<f64>; 2]| {
        vec![
            Series::shared("left foot", left).colored(Color::GREEN),
            Series::shared("right foot", right).colored(Color::VIOLET),
        ]
    };
    let sums = both([Side::Left, Side::Right].map(vertical));
    plots.push(shown.plot("Ground force, vertical", "N", sums, &[("weight", weight)]));
    let most = both([Side::Left, Side::Right].map(|side| cone_shares(done, shown, side, data)));
    plots.push(shown.plot("Forces in their cones, the steepest point", "% of the cone", most, &[("cone", 100.0)]));
    let momentum = |axes: [(&str, usize); 3]| {
        let line = |(name, axis): (&str, usize)| {
            Series::shared(name, shown.knots.iter().map(|knot| knot.momentum[axis]).collect())
        };
        axes.map(line).into()
    };
    let linear = momentum([("x, the kick", 0), ("y, left", 1), ("z, up", 2)]);
    plots.push(shown.plot("Linear momentum", "kg m/s", linear, &[]));
    let angular = momentum([("about x", 3), ("about y", 4), ("about z", 5)]);
    plots.push(shown.plot("Angular momentum about the centre of mass", "kg m\u{b2}/s", angular, &[]));
    plots.push(heights(done, shown, data));
    for (g, group) in robot.groups.iter().enumerate() {
        let joints = |share: &dyn Fn(usize, &Knot) -> f64| {
            (0..robot.joints.len())
                .filter(|&j| robot.joints[j].group == g)
                .filter_map(|j| {
                    let values: Vec<f64> = shown.knots.iter().map(|knot| share(j, knot) * 100.0).collect();
                    let visible = values.iter().any(|value| value.abs() > VISIBLE * 100.0);
                    visible.then(|| Series::shared(robot.joints[j].name.replace('_', " "), values))
                })
                .collect::<Vec<_>>()
        };
        let torque = joints(&|j, knot| {
            let (torque, [least, most]) = (knot.torques[j], torque_range(&robot.joints[j], knot.joint_velocities[j]));
            torque / if torque < 0.0 { -least } else { most }.max(0.01 * robot.joints[j].torque)
        });
        let speed = joints(&|j, knot| knot.joint_velocities[j] / robot.joints[j].speed);
        let name = figure::capital(group);
        let limits = [("limit", 100.0), ("limit", -100.0)];
        for (what, lines) in [("torque", torque), ("speed", speed)] {
            if !lines.is_empty() {
                plots.push(shown.plot(format!("{name} {what}"), "% of what the drive gives", lines, &limits));
            }
        }
    }
    plots
}

/// Heights of centre of mass, base and the lowest point of each foot.
fn heights(done: &Done, shown: &Shown, data: &mut RobotData) -> Plot {
    let robot = &done.robot;
    let mut feet = [Vec::new(), Vec::new()];
    for (q, _) in &shown.states {
        data.set_position(q);
        for (side, heights) in [Side::Left, Side::Right].into_iter().zip(&mut feet) {
            let points = robot.contacts.iter().filter(|c| c.leg == side);
            heights.push(points.map(|c| data.point(&c.at).z - c.radius).fold(f64::INFINITY, f64::min));
        }
    }
    let [left, right] = feet;
    let series = vec![
        Series::shared("centre of mass", shown.knots.iter().map(|knot| knot.com[2]).collect()),
        Series::shared("base", shown.knots.iter().map(|knot| knot.base_position[2]).collect()),
        Series::shared("left foot's lowest point", left).colored(Color::GREEN),
        Series::shared("right foot's lowest point", right).colored(Color::VIOLET),
    ];
    shown.plot("Heights", "m", series, &[])
}
