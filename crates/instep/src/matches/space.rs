//! The report of a game in physics: the replay in space, where everybody believes to be, the trials of a scene.

use instep_field::{Field, Line};
use instep_match::Recording;
use instep_match::physics::Motion;
use instep_match::physics::fig12h::Outcome;
use instep_report::{
    Actor, Camera, Cell, Color, Column, Event, Finish, Marking, Part, Pitch, Pose, Replay, Report, Shape, SummaryItem,
    Table, Verdict,
};
use instep_robot::Robot;

use super::physics::words;
use crate::figure::{self, Figure};

/// Frames of the replay at most.
const FRAMES: usize = 1500;
/// The view at the start: most of the field.
const FROM_THE_SIDE: Camera =
    Camera { target: [0.0, 0.0, 0.4], distance: 9.0, azimuth: -std::f32::consts::FRAC_PI_2, elevation: 0.5 };
/// Radius of goal posts, m.
const POST: f32 = instep_sim::goal::POST_RADIUS as f32;
const TEAMS: [&str; 2] = ["Red", "Blue"];
const COLORS: [Color; 2] = [Color::rgb(0xd23b3b), Color::rgb(0x2f6fd0)];

/// What the replay shows.
pub(super) struct Scene<'a> {
    pub(super) field: &'a Field,
    pub(super) robot: &'a Robot,
    /// Of each robot.
    pub(super) teams: Vec<usize>,
    pub(super) motion: Option<&'a Motion>,
    pub(super) flat: &'a Recording,
    /// s, and what happened.
    pub(super) events: Vec<(f64, String)>,
}

pub(super) fn report(
    title: String,
    subtitle: String,
    facts: &[(&str, String)],
    tables: Vec<Table>,
    scene: &Scene<'_>,
) -> Report {
    let summary = facts
        .iter()
        .map(|(label, value)| SummaryItem::new(*label, value.clone(), Verdict::Neutral, String::new()))
        .collect();
    Report {
        title,
        subtitle,
        summary,
        tables,
        replay: scene.motion.map(|motion| replay(scene, motion)),
        notes: vec![
            "Discs on the ground: where each player believes to be. Small balls in a team's colour: where it believes the \
             ball. Both come from its own senses; detections of the camera are simulated, with misses, false ones, errors \
             that last and delay."
                .to_owned(),
        ],
        ..Report::default()
    }
}

fn replay(scene: &Scene<'_>, motion: &Motion) -> Replay {
    let every = motion.times.len().div_ceil(FRAMES).max(1);
    let frames: Vec<usize> = (0..motion.times.len()).step_by(every).collect();
    let times: Vec<f64> = frames.iter().map(|&i| motion.times[i]).collect();
    let figure = Figure::new(scene.robot);
    let mut data = scene.robot.data();
    let nq = scene.robot.nq();
    let radius = scene.field.ball.radius;
    let mut actors = Vec::new();
    let mut numbers = [0; 2];
    for (rows, &team) in motion.q.iter().zip(&scene.teams) {
        numbers[team] += 1;
        let name = format!("{} {}", TEAMS[team], numbers[team]);
        let positions = frames.iter().map(|&i| &rows[i * nq..(i + 1) * nq]);
        actors.push(figure.actor(&name, &mut data, positions, |color| mix(color, COLORS[team])));
    }
    actors.push(figure::ball(radius, frames.iter().map(|&i| motion.ball[i])));
    actors.push(beliefs(scene, &times));
    actors.push(goals(scene.field));
    let last = times.last().copied().unwrap_or(0.0);
    let mut events: Vec<Event> =
        scene.events.iter().map(|(time, label)| Event { time: *time, label: label.clone() }).collect();
    events.retain(|event| event.time <= last);
    events.sort_by(|a, b| a.time.total_cmp(&b.time));
    Replay { times, actors, events, pitch: Some(pitch(scene.field)), camera: Some(FROM_THE_SIDE) }
}

/// Half of the robot's own colour, half of its team's.
fn mix(own: Color, team: Color) -> Color {
    let half = |a: u8, b: u8| u8::midpoint(a, b);
    Color { r: half(own.r, team.r), g: half(own.g, team.g), b: half(own.b, team.b), a: own.a }
}

/// Discs where players believe to be, balls where they believe the ball.
fn beliefs(scene: &Scene<'_>, times: &[f64]) -> Actor {
    let nowhere = Pose::at([0.0, 0.0, -10.0]);
    let mut parts = Vec::new();
    for (i, &team) in scene.teams.iter().enumerate() {
        let at = |time: f64| {
            let next = scene.flat.frames.partition_point(|frame| frame.time <= time + 1e-6);
            scene.flat.frames.get(next.saturating_sub(1)).and_then(|frame| frame.robots.get(i))
        };
        // Who never decided anything has no beliefs.
        if scene.flat.frames.iter().all(|frame| frame.robots.get(i).is_none_or(|robot| robot.action.is_none())) {
            continue;
        }
        let color = COLORS[team].with_alpha(0.5);
        let disc =
            |&time: &f64| at(time).map_or(nowhere, |robot| Pose::at([robot.believed[0], robot.believed[1], 0.01]));
        let ball = |&time: &f64| {
            at(time)
                .and_then(|robot| robot.ball)
                .map_or(nowhere, |[x, y]| Pose::at([x, y, scene.field.ball.radius as f32]))
        };
        let shapes = [
            (Shape::Cylinder { radius: 0.22, half_length: 0.004 }, times.iter().map(disc).collect()),
            (Shape::Sphere { radius: 0.6 * scene.field.ball.radius as f32 }, times.iter().map(ball).collect()),
        ];
        parts.extend(shapes.map(|(shape, poses)| Part { shape, color, finish: Finish::Plain, poses }));
    }
    Actor { name: "Beliefs".into(), parts, ..Actor::default() }
}

fn goals(field: &Field) -> Actor {
    let mut parts = Vec::new();
    let upright = [1.0, 0.0, 0.0, 0.0];
    // Turned about x by a quarter: the long axis lies along y.
    let across = [std::f32::consts::FRAC_1_SQRT_2, std::f32::consts::FRAC_1_SQRT_2, 0.0, 0.0];
    let (half, height) = (0.5 * field.goal.width as f32, field.goal.height as f32);
    for goal in [field.own_goal(), field.opponent_goal()] {
        let line = goal.center[0] as f32;
        let mut rod = |length: f32, position: [f32; 3], rotation| {
            parts.push(Part {
                shape: Shape::Cylinder { radius: POST, half_length: 0.5 * length },
                color: Color::rgb(0xffffff),
                finish: Finish::Plain,
                poses: vec![Pose { position, rotation }],
            });
        };
        for y in [half, -half] {
            rod(height, [line, y, 0.5 * height], upright);
        }
        rod(2.0 * half, [line, 0.0, height], across);
        let depth = 0.5 * field.goal.depth as f32;
        parts.push(Part {
            shape: Shape::Box { half_extents: [0.005, half, 0.5 * height] },
            color: Color::rgb(0xffffff).with_alpha(0.25),
            finish: Finish::Plain,
            poses: vec![Pose::at([line + line.signum() * 2.0 * depth, 0.0, 0.5 * height])],
        });
    }
    Actor { name: "Goals".into(), parts, ..Actor::default() }
}

/// The field's own lines.
fn pitch(field: &Field) -> Pitch {
    let point = |p: [f64; 2]| p.map(|x| x as f32);
    let mut markings: Vec<Marking> = field
        .lines()
        .into_iter()
        .map(|line| match line {
            Line::Segment { from, to } => Marking::Line { from: point(from), to: point(to) },
            Line::Circle { center, radius } => Marking::Circle { center: point(center), radius: radius as f32 },
        })
        .collect();
    let mark = (0.5 * field.length - field.penalty_mark) as f32;
    markings.extend([[0.0, 0.0], [mark, 0.0], [-mark, 0.0]].map(|center| Marking::Spot { center }));
    Pitch {
        center: [0.0; 2],
        length: field.length as f32,
        width: field.width as f32,
        border: field.border as f32,
        line_width: field.line_width as f32,
        markings,
    }
}

/// The trials of a scene.
pub(super) fn trials(outcomes: &[Outcome]) -> Table {
    let rows = outcomes.iter().map(|outcome| {
        let verdict = if outcome.scored_at.is_some() { Verdict::Good } else { Verdict::Bad };
        let came = match (outcome.scored_at, outcome.cause) {
            (Some(time), _) => format!("scored after {time:.1} s"),
            (None, Some(cause)) => words(cause),
            (None, None) => String::new(),
        };
        vec![
            outcome.seed.to_string().into(),
            Cell::judged(came, verdict),
            format!("{:.1}", outcome.time).into(),
            outcome.kicks.to_string().into(),
            if outcome.touched { Cell::judged("yes", Verdict::Bad) } else { "no".into() },
            format!("{:.2}", outcome.pose_error).into(),
            format!("{:.0} %", 100.0 * outcome.ball_lost).into(),
        ]
    });
    Table {
        title: "Trials".into(),
        columns: vec![
            Column::number("Seed"),
            Column::text("What came of it"),
            Column::number("Time, s"),
            Column::number("Kicks"),
            Column::text("Touched"),
            Column::number("Largest error of the pose, m"),
            Column::number("Ball unknown"),
        ],
        rows: rows.collect(),
    }
}
