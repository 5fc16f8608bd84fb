//! Writes an example report and recording, `demo.html` and `demo.mcap`, into the folder given (or the current one).
//!
//! A made-up figure of capsules walks up to a ball and kicks it. Nothing is simulated: the motion is drawn with sines,
//! to show every part of a page and to have one for the tests that look at pixels.

use instep_report::mcap::{Imu, Joints, LinkPose, Recording};
use instep_report::*;

/// Frames per second of the demo.
const RATE: f64 = 100.0;
/// When the foot meets the ball, s.
const IMPACT: f64 = 1.4;
const BALL_RADIUS: f64 = 0.11;
const THIGH: f64 = 0.30;
const SHANK: f64 = 0.30;

fn main() -> Result<(), ReportError> {
    let folder = std::path::PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    report().save(folder.join("demo.html"))?;
    recording()?.save(folder.join("demo.mcap"))
}

type V3 = [f64; 3];

fn add(a: V3, b: V3) -> V3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn smooth(t: f64, from: f64, to: f64) -> f64 {
    let s = ((t - from) / (to - from)).clamp(0.0, 1.0);
    s * s * (3.0 - 2.0 * s)
}

fn bump(t: f64, middle: f64, width: f64) -> f64 {
    (-((t - middle) / width).powi(2)).exp()
}

/// Joint angles at a time, rad.
struct Stance {
    hip: [f64; 2],
    knee: [f64; 2],
    shoulder: [f64; 2],
    lean: f64,
    forward: f64,
    height: f64,
}

fn stance(t: f64) -> Stance {
    // Two steps, then the right leg (index 1) winds up and swings through.
    let walk = 1.0 - smooth(t, 0.75, 1.05);
    let wave = (t * std::f64::consts::TAU / 0.9).sin() * walk;
    let wind_up = bump(t, IMPACT - 0.24, 0.14);
    let follow = bump(t, IMPACT + 0.10, 0.17);
    Stance {
        hip: [0.38 * wave + 0.16 * wind_up - 0.12 * follow, -0.38 * wave - 0.75 * wind_up + 1.05 * follow],
        knee: [
            0.18 + 0.55 * (-wave).max(0.0) + 0.22 * wind_up,
            0.18 + 0.55 * wave.max(0.0) + 1.25 * wind_up - 0.10 * follow,
        ],
        shoulder: [-0.5 * wave - 0.6 * wind_up + 0.7 * follow, 0.5 * wave + 0.5 * wind_up - 0.6 * follow],
        lean: 0.06 + 0.10 * wind_up - 0.16 * follow,
        forward: 0.62 * smooth(t, -0.25, 1.25),
        height: 0.615 - 0.012 * wind_up,
    }
}

/// A capsule's middle and turn about y, from its two ends: the motion is planar.
fn between(from: V3, to: V3) -> Pose {
    let angle = (to[0] - from[0]).atan2(to[2] - from[2]);
    let middle = [0, 1, 2].map(|k| ((from[k] + to[k]) / 2.0) as f32);
    Pose { position: middle, rotation: [(angle / 2.0).cos() as f32, 0.0, (angle / 2.0).sin() as f32, 0.0] }
}

/// Turned so that the long axis lies along y.
fn across(position: V3) -> Pose {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    Pose { position: position.map(|x| x as f32), rotation: [half, half, 0.0, 0.0] }
}

/// Poses of the figure's parts at a time, in the order of `figure`.
fn poses(t: f64) -> Vec<Pose> {
    let s = stance(t);
    let down = |angle: f64, length: f64| [angle.sin() * length, 0.0, -angle.cos() * length];
    let pelvis = [s.forward, 0.0, s.height + 0.05];
    let neck = add(pelvis, [0.42 * s.lean.sin(), 0.0, 0.42 * s.lean.cos()]);
    let mut poses = vec![
        between(pelvis, add(neck, [0.0, 0.0, -0.12])),
        across(add(neck, [0.0, 0.0, -0.07])),
        across(pelvis),
        between(neck, add(neck, [0.0, 0.0, 0.1])),
        between(add(neck, [0.01, 0.0, 0.12]), add(neck, [0.015, 0.0, 0.18])),
    ];
    for side in 0..2 {
        let y = if side == 0 { 1.0 } else { -1.0 };
        let hip = add(pelvis, [0.0, 0.085 * y, -0.03]);
        let knee = add(hip, down(s.hip[side], THIGH));
        let shank_angle = s.hip[side] - s.knee[side];
        let ankle = add(knee, down(shank_angle, SHANK));
        let toe = add(ankle, [0.06 * shank_angle.cos(), 0.0, -0.025 + 0.06 * shank_angle.sin()]);
        let shoulder = add(neck, [0.0, 0.17 * y, -0.03]);
        let elbow = add(shoulder, down(s.shoulder[side], 0.22));
        let hand = add(elbow, down(s.shoulder[side] + 0.5, 0.2));
        poses.push(between(knee, hip));
        poses.push(between(ankle, knee));
        let pitch = (shank_angle * 0.6) as f32;
        poses.push(Pose {
            position: toe.map(|x| x as f32),
            rotation: [(pitch / 2.0).cos(), 0.0, -(pitch / 2.0).sin(), 0.0],
        });
        poses.push(between(elbow, shoulder));
        poses.push(between(hand, elbow));
    }
    poses
}

fn figure(name: &str, times: &[f64], tint: impl Fn(Color) -> Color, delay: f64) -> Actor {
    let capsule = |radius: f32, length: f64| Shape::Capsule { radius, half_length: (length / 2.0) as f32 };
    let mut looks = vec![
        (Shape::Ellipsoid { radii: [0.085, 0.125, 0.2] }, Color::SHELL),
        (Shape::Capsule { radius: 0.075, half_length: 0.09 }, Color::SHELL),
        (Shape::Capsule { radius: 0.062, half_length: 0.06 }, Color::JOINT),
        (Shape::Cylinder { radius: 0.035, half_length: 0.05 }, Color::JOINT),
        (Shape::Capsule { radius: 0.072, half_length: 0.03 }, Color::SHELL),
    ];
    for leg in [Color::BLUE, Color::ORANGE] {
        looks.push((capsule(0.055, THIGH), leg));
        looks.push((capsule(0.045, SHANK), leg));
        looks.push((Shape::Box { half_extents: [0.11, 0.05, 0.022] }, Color::JOINT));
        looks.push((capsule(0.038, 0.22), Color::SHELL));
        looks.push((capsule(0.032, 0.2), Color::SHELL));
    }
    let frames: Vec<Vec<Pose>> = times.iter().map(|t| poses(t - delay)).collect();
    let parts = looks.into_iter().enumerate().map(|(index, (shape, color))| Part {
        shape,
        color: tint(color),
        finish: Finish::Plain,
        poses: frames.iter().map(|frame| frame[index]).collect(),
    });
    Actor { name: name.into(), parts: parts.collect(), ..Actor::default() }
}

/// The ball's middle and turn about y.
fn ball(t: f64) -> (V3, f64) {
    let flight = (t - IMPACT).max(0.0);
    let x = 1.02 + 4.2 * flight;
    let z = BALL_RADIUS + (1.6 * flight - 4.905 * flight * flight).max(0.0);
    ([x, -0.085, z], 24.0 * flight)
}

fn ball_actor(times: &[f64]) -> Actor {
    let pose = |t: &f64| {
        let (position, spin) = ball(*t);
        let rotation = [(spin / 2.0).cos() as f32, 0.0, (spin / 2.0).sin() as f32, 0.0];
        Pose { position: position.map(|x| x as f32), rotation }
    };
    let shape = Shape::Sphere { radius: BALL_RADIUS as f32 };
    let part =
        Part { shape, color: Color::rgb(0xf4f5f7), finish: Finish::Football, poses: times.iter().map(pose).collect() };
    Actor { name: "Ball".into(), parts: vec![part], ..Actor::default() }
}

fn goal() -> Actor {
    let post = |position, rotation, half_length| Part {
        shape: Shape::Cylinder { radius: 0.05, half_length },
        color: Color::rgb(0xf4f5f7),
        finish: Finish::Plain,
        poses: vec![Pose { position, rotation }],
    };
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let upright = [1.0, 0.0, 0.0, 0.0];
    Actor {
        name: String::new(),
        offset: [4.5, 0.0, 0.0],
        parts: vec![
            post([0.0, 1.3, 0.6], upright, 0.6),
            post([0.0, -1.3, 0.6], upright, 0.6),
            post([0.0, 0.0, 1.2], [half, half, 0.0, 0.0], 1.35),
        ],
        arrows: Vec::new(),
    }
}

fn ground_force(t: f64) -> [f64; 2] {
    let wave = (t * std::f64::consts::TAU / 0.9).sin() * (1.0 - smooth(t, 0.75, 1.05));
    let left = 0.5 + 0.5 * (-4.0 * wave).tanh();
    let left = left.max(smooth(t, 0.9, 1.05) * (1.0 - 0.5 * smooth(t, 1.85, 2.1)));
    [160.0 * left * (1.0 + 0.18 * bump(t, IMPACT, 0.05)), 160.0 * (1.0 - left)]
}

fn report() -> Report {
    let times: Vec<f64> = (0..=240).map(|frame| f64::from(frame) / RATE).collect();
    let over = |f: &dyn Fn(f64) -> f64| times.iter().map(|&t| f(t)).collect::<Vec<_>>();
    let rate = |f: fn(f64) -> f64| move |t: f64| (f(t + 1e-4) - f(t - 1e-4)) / 2e-4;

    let mut robot = figure("Robot", &times, |color| color, 0.0);
    for (side, name, color) in [(0, "Left sole force", Color::GREEN), (1, "Right sole force", Color::VIOLET)] {
        let frames = times.iter().map(|&t| {
            let foot = poses(t)[7 + 5 * side].position;
            let force = ground_force(t)[side] as f32;
            ArrowFrame { origin: [foot[0], foot[1], 0.0], vector: [-0.06 * force, 0.0, force] }
        });
        let frames = frames.collect();
        robot.arrows.push(Arrow { name: name.into(), color, metres_per_unit: 0.0022, frames });
    }
    let reference = figure("Reference", &times, |_| Color::rgb(0x7f8ea3).with_alpha(0.35), 0.04);

    let knee = |t: f64| 14.0 * (t * 9.0).sin() * 0.5 + 42.5 * bump(t, IMPACT - 0.08, 0.05) + 6.0;
    let mut ground = Plot {
        title: "Ground force".into(),
        y_label: "N".into(),
        series: vec![
            Series::shared("left", over(&|t| ground_force(t)[0])).colored(Color::GREEN),
            Series::shared("right", over(&|t| ground_force(t)[1])).colored(Color::VIOLET),
        ],
        ..Plot::default()
    };
    ground.limits.push(Limit { label: "weight".into(), value: 160.0 });
    let phases = vec![
        Region { label: "wind-up".into(), from: 1.0, to: 1.22 },
        Region { label: "swing".into(), from: 1.22, to: 1.62 },
    ];
    let plot = |title: &str, unit: &str, series: Vec<Series>, limits: &[(&str, f64)]| Plot {
        title: title.into(),
        y_label: unit.into(),
        series,
        limits: limits.iter().map(|&(label, value)| Limit { label: label.into(), value }).collect(),
        regions: phases.clone(),
        ..Plot::default()
    };
    let plots = vec![
        plot(
            "Right hip pitch",
            "rad",
            vec![
                Series::shared("measured", over(&|t| stance(t).hip[1])),
                Series::shared("reference", over(&|t| stance(t - 0.04).hip[1])).colored(Color::rgb(0x8a96a6)).dashed(),
            ],
            &[],
        ),
        plot(
            "Right knee torque",
            "N m",
            vec![Series::shared("torque", over(&knee)).colored(Color::ORANGE)],
            &[("limit", 42.0), ("limit", -42.0)],
        ),
        plot(
            "Right knee speed",
            "rad/s",
            vec![Series::shared("speed", over(&rate(|t| stance(t).knee[1])))],
            &[("limit", 60.0)],
        ),
        ground,
        plot(
            "Ball speed",
            "m/s",
            vec![Series::shared("speed", over(&|t| if t > IMPACT { 4.37 } else { 0.0 }))],
            &[("wanted", 4.0)],
        ),
        Plot {
            title: "Success over ball position".into(),
            y_label: "share".into(),
            x_label: "ball ahead of foot / m".into(),
            axis: Axis::Other,
            series: vec![Series::points(
                "50 trials each",
                (0..9)
                    .map(|i| (f64::from(i), 0.08 + 0.03 * f64::from(i)))
                    .map(|(i, x)| [x, 1.0 / (1.0 + (i - 6.2).exp())])
                    .collect(),
            )],
            ..Plot::default()
        },
    ];
    let row = |joint: &str, torque: &str, share: &str, speed: &str, verdict| {
        vec![joint.into(), torque.into(), Cell::judged(share, verdict), speed.into()]
    };
    Report {
        matrix: None,
        title: "Kick at 4 m/s, straight ahead".into(),
        subtitle: "Demo figure \u{b7} drawn, not simulated \u{b7} ball 0.20 m ahead of the right foot \u{b7} seed 7"
            .into(),
        summary: vec![
            SummaryItem::new("Ball speed", "4.37 m/s", Verdict::Good, "wanted 4.00 m/s"),
            SummaryItem::new("Direction", "+1.8\u{b0}", Verdict::Good, "tolerance \u{b1}5\u{b0}"),
            SummaryItem::new("Balance", "upright", Verdict::Good, "margin 31 mm at worst"),
            SummaryItem::new("Peak knee torque", "44.1 N m", Verdict::Bad, "limit 42.0 N m, for 18 ms"),
            SummaryItem::new("Impact audit", "passed", Verdict::Good, "energy error 0.4 %"),
            SummaryItem::new("Kick time", "0.62 s", Verdict::Neutral, "first motion to impact"),
        ],
        tables: vec![
            Table {
                title: "Joints at their hardest".into(),
                columns: vec![
                    Column::text("Joint"),
                    Column::number("Torque / N m"),
                    Column::number("Of limit"),
                    Column::number("Speed / rad/s"),
                ],
                rows: vec![
                    row("right hip pitch", "36.2", "86 %", "11.4", Verdict::Neutral),
                    row("right knee", "44.1", "105 %", "14.9", Verdict::Bad),
                    row("right ankle pitch", "8.7", "41 %", "6.0", Verdict::Neutral),
                    row("left hip roll", "21.0", "50 %", "2.2", Verdict::Neutral),
                ],
            },
            Table {
                title: "Impact".into(),
                columns: vec![Column::text("Measure"), Column::number("Value"), Column::text("How")],
                rows: vec![
                    vec!["Foot speed before".into(), "3.12 m/s".into(), "mean of 5 steps".into()],
                    vec!["Contact time".into(), "9.4 ms".into(), "normal force > 0".into()],
                    vec!["Impulse".into(), "1.88 N s".into(), "integral of the force".into()],
                ],
            },
        ],
        replay: Some(Replay {
            actors: vec![robot, reference, ball_actor(&times), goal()],
            events: [(0.45, "step"), (1.0, "wind-up"), (1.22, "swing"), (IMPACT, "impact"), (1.95, "touchdown")]
                .map(|(time, label)| Event { time, label: label.into() })
                .to_vec(),
            pitch: Some(Pitch::kid_size()),
            camera: None,
            times,
        }),
        plots,
        notes: vec![
            "All numbers on this page are made up: it shows what a report looks like.".into(),
            "Ball speed is measured 50 ms after the ball has left the foot.".into(),
        ],
    }
}

fn recording() -> Result<Recording, ReportError> {
    let names: Vec<String> = ["left_hip", "left_knee", "right_hip", "right_knee"].map(String::from).to_vec();
    let links = ["torso", "pelvis", "head", "left_thigh", "left_shank", "left_foot"];
    let mut recording = Recording::new()?;
    for frame in 0..=240 {
        let t = f64::from(frame) / RATE;
        let s = stance(t);
        let position = [s.hip[0], s.knee[0], s.hip[1], s.knee[1]];
        recording
            .joints(t, &Joints { frame: "base", names: &names, position: &position, velocity: &[], effort: &[] })?;
        let poses: Vec<LinkPose<'_>> = links
            .iter()
            .zip(poses(t))
            .map(|(name, pose)| LinkPose {
                name,
                position: pose.position.map(f64::from),
                rotation: pose.rotation.map(f64::from),
            })
            .collect();
        recording.links(t, &poses)?;
        let (position, spin) = ball(t);
        recording.ball(t, position, [(spin / 2.0).cos(), 0.0, (spin / 2.0).sin(), 0.0])?;
        let imu = Imu {
            frame: "torso",
            rotation: Some([(s.lean / 2.0).cos(), 0.0, (s.lean / 2.0).sin(), 0.0]),
            angular_velocity: [0.0; 3],
            linear_acceleration: [-9.81 * s.lean.sin(), 0.0, 9.81 * s.lean.cos()],
        };
        recording.imu(t, &imu)?;
    }
    recording.event(IMPACT, "impact")?;
    Ok(recording)
}
