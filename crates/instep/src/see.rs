//! `instep see`: what the head camera sees and what is made of it; labelled sets, training, measuring.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use base64::Engine as _;
use clap::{Args, Subcommand};
use instep_field::Field;
use instep_perception::after::sights::{Sights, sights};
use instep_perception::detector::{Detection, Detector, THRESHOLD};
use instep_perception::metric::{self, Judged, Row};
use instep_perception::proximity::{self, Obstacle, Proximity, Run};
use instep_perception::render::{Renderer, View};
use instep_perception::scene::Scene;
use instep_perception::scene::random::{Split, scene};
use instep_perception::train::{LANES, Plan, Rendered, Source, Training};
use instep_perception::{Camera, Class, PerceptionError, dataset, label};
use serde::Serialize;

use crate::failure::Failure;
use crate::output::{self, Output, Paint};

impl From<PerceptionError> for Failure {
    fn from(error: PerceptionError) -> Self {
        Self::input(error)
    }
}

/// The arguments of `instep see`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct See {
    #[command(subcommand)]
    command: Option<SeeCommand>,
    #[command(flatten)]
    look: LookArgs,
}

#[derive(Debug, Args)]
struct LookArgs {
    /// The robot whose camera looks
    #[arg(long, default_value = "artemis")]
    robot: String,
    /// What it looks at; only `random` so far
    #[arg(long, default_value = "random")]
    scene: String,
    /// Seed of the first frame
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of frames in the report
    #[arg(long, value_name = "N", default_value_t = 8)]
    frames: u64,
    /// Where the report goes
    #[arg(long, value_name = "FILE", default_value = "see.html")]
    out: PathBuf,
    /// A detector's file [default: the one that comes with Instep]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum SeeCommand {
    /// Make a labelled set in COCO's and YOLO's layout
    Data(DataArgs),
    /// Train a detector on rendered frames, or on a folder in YOLO's layout
    Train(TrainArgs),
    /// Measure a detector: precision, recall, mAP by class (paper 4, Table II)
    Eval(EvalArgs),
    /// Measure the finding of near obstacles over three walks (paper 4, Table III)
    Proximity(ProximityArgs),
}

#[derive(Debug, Args)]
struct DataArgs {
    /// Number of frames
    #[arg(long, value_name = "N", default_value_t = 1000)]
    frames: u64,
    /// Seed of the first frame
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The folder to make
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

#[derive(Debug, Args)]
struct TrainArgs {
    /// A set in YOLO's layout [default: rendered frames]
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Start from a detector's weights
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    /// Number of frames to see
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    frames: u64,
    /// Seed of the first weights and of the frames
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Highest step size
    #[arg(long, default_value_t = 1.5e-3)]
    rate: f32,
    /// 1 or 2; the result does not depend on it
    #[arg(long, value_name = "N", default_value_t = 2)]
    threads: usize,
    /// The checkpoint, which is also the detector; where it exists the training goes on from it
    #[arg(long, value_name = "FILE", default_value = "detector.safetensors")]
    out: PathBuf,
}

#[derive(Debug, Args)]
struct EvalArgs {
    /// Number of frames
    #[arg(long, value_name = "N", default_value_t = 350)]
    frames: u64,
    /// Seed of the first frame
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// A set in YOLO's layout [default: frames made from the seed]
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
struct ProximityArgs {
    /// Seed of the first walk
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl See {
    /// Runs the command.
    ///
    /// # Errors
    /// When something handed in cannot be used.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        match self.command {
            None => self.look.run(output)?,
            Some(SeeCommand::Data(args)) => args.run(output)?,
            Some(SeeCommand::Train(args)) => args.run(output)?,
            Some(SeeCommand::Eval(args)) => args.run(output)?,
            Some(SeeCommand::Proximity(args)) => args.run(output)?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn field() -> Result<Field, Failure> {
    Field::named("adult-2024").map_err(Failure::input)
}

fn detector(model: Option<&Path>) -> Result<Detector, Failure> {
    Ok(model.map_or_else(Detector::shipped, Detector::load)?)
}

fn count(flag: &str, value: u64, most: u64) -> Result<(), Failure> {
    if (1..=most).contains(&value) {
        Ok(())
    } else {
        Err(Failure::input(format!("{flag}: {value}; expected 1 to {most}")))
    }
}

/// Times of the stages, ms.
#[derive(Debug, Default)]
struct Times {
    render: Vec<f64>,
    detector: Vec<f64>,
    after: Vec<f64>,
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// One frame with all that was made of it.
struct Looked {
    scene: Scene,
    view: View,
    found: Vec<Detection>,
    sights: Sights,
    obstacles: [Obstacle; 2],
}

fn look(
    renderer: &mut Renderer,
    detector: &mut Detector,
    field: &Field,
    seed: u64,
    threshold: f32,
    times: &mut Times,
) -> Result<Looked, Failure> {
    let camera = *renderer.camera();
    let scene = scene(field, &camera, Split::Test, seed);
    let ms = |start: Instant| start.elapsed().as_secs_f64() * 1e3;
    let start = Instant::now();
    let view = renderer.render(&scene);
    times.render.push(ms(start));
    let start = Instant::now();
    let found = detector.detect(&view.frame, threshold)?;
    times.detector.push(ms(start));
    let start = Instant::now();
    let used: Vec<Detection> = found.iter().copied().filter(|d| d.confidence >= THRESHOLD).collect();
    let radius = field.ball.radius as f32;
    let sights = sights(&camera, &scene.camera, radius, &view.frame, &view.depth, &used);
    let obstacles = proximity::nearest(&Proximity::default(), &camera, &scene.camera, &view.depth, Some(&view.frame));
    times.after.push(ms(start));
    Ok(Looked { scene, view, found, sights, obstacles })
}

impl LookArgs {
    fn run(self, output: &Output) -> Result<(), Failure> {
        count("--frames", self.frames, 200)?;
        if self.robot != "artemis" {
            return Err(Failure::input(format!("--robot: {} has no camera; expected artemis", self.robot)));
        }
        if self.scene != "random" {
            return Err(Failure::input(format!("--scene: {}; expected random", self.scene)));
        }
        let (field, camera) = (field()?, Camera::default());
        camera.validate("camera")?;
        let mut detector = detector(self.model.as_deref())?;
        let mut renderer = Renderer::new(camera, &field);
        let mut times = Times::default();
        let mut body = String::new();
        for seed in self.seed..self.seed + self.frames {
            let looked = look(&mut renderer, &mut detector, &field, seed, THRESHOLD, &mut times)?;
            let labels = label::labels(&camera, &field, &looked.scene, &looked.view);
            body += &picture(&format!("seed {seed}"), &looked.view, &looked.found, &labels, Some(&looked));
        }
        save(&self.out, "What the robot sees", &body)?;
        let shown = serde_json::json!({
            "frames": self.frames, "out": self.out,
            "render_ms": median(&mut times.render), "detector_ms": median(&mut times.detector),
            "after_ms": median(&mut times.after),
        });
        output.show(&shown, |_| format!("{} frames in {}", self.frames, self.out.display()))
    }
}

impl DataArgs {
    fn run(self, output: &Output) -> Result<(), Failure> {
        count("--frames", self.frames, 10_000_000)?;
        let mut source = Rendered::new(Camera::default(), Rendered::fields(Split::Train)?, Split::Train);
        let mut writer = dataset::Writer::new(&self.out)?;
        let bar = output::bar(self.frames, "{wide_bar} {pos}/{len} frames {eta}");
        for number in self.seed..self.seed + self.frames {
            let (frame, labels) = source.frame(number)?;
            writer.add(&frame, &labels)?;
            bar.inc(1);
        }
        writer.finish()?;
        bar.finish_and_clear();
        let shown = serde_json::json!({"frames": self.frames, "out": self.out});
        output.show(&shown, |_| format!("{} frames in {}", self.frames, self.out.display()))
    }
}

impl TrainArgs {
    fn run(self, output: &Output) -> Result<(), Failure> {
        count("--frames", self.frames, 1_000_000_000)?;
        count("--threads", self.threads as u64, 64)?;
        if !(self.rate > 0.0 && self.rate <= 0.1) {
            return Err(Failure::input(format!("--rate: {}; expected above 0, at most 0.1", self.rate)));
        }
        let plan =
            Plan { frames: self.frames, rate: self.rate, threads: self.threads, seed: self.seed, ..Plan::default() };
        let weights = self.from.as_deref().map(|path| instep_perception::net::file::read(path, &[])).transpose()?;
        match &self.data {
            Some(folder) => {
                let set = dataset::Folder::open(folder)?;
                self.fit(output, plan, [set.clone(), set], weights.map(|w| w.0))
            }
            None => {
                let fields = Rendered::fields(Split::Train)?;
                let source = Rendered::new(Camera::default(), fields, Split::Train);
                self.fit(output, plan, [source.clone(), source], weights.map(|w| w.0))
            }
        }
    }

    fn fit<S: Source>(
        &self,
        output: &Output,
        plan: Plan,
        sources: [S; LANES],
        weights: Option<Vec<f32>>,
    ) -> Result<(), Failure> {
        let mut training = match weights {
            Some(weights) => Training::with(plan, sources, weights),
            None => Training::new(plan, sources),
        };
        if self.out.exists() {
            training.resume(&self.out)?;
        }
        training.save(&self.out)?;
        let stop = crate::interrupt::stopped_by_the_user();
        let bar = output::bar(self.frames, "{wide_bar} {pos}/{len} frames, loss {msg} {eta}");
        let (mut mean, mut steps) = (f64::NAN, 0u32);
        while !training.done() && !stop.load(std::sync::atomic::Ordering::Relaxed) {
            let loss = training.step()?;
            mean = if mean.is_nan() { loss } else { 0.98 * mean + 0.02 * loss };
            steps += 1;
            bar.set_position(training.frames());
            bar.set_message(format!("{mean:.3}"));
            if steps.is_multiple_of(50) {
                training.save(&self.out)?;
            }
        }
        training.save(&self.out)?;
        bar.finish_and_clear();
        let shown = serde_json::json!({"frames": training.frames(), "loss": mean, "out": self.out});
        output.show(&shown, |_| format!("{} frames, loss {mean:.3}, in {}", training.frames(), self.out.display()))
    }
}

/// What `instep see eval --json` prints.
#[derive(Debug, Serialize)]
struct Evaluation {
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
}

impl EvalArgs {
    fn run(self, output: &Output) -> Result<(), Failure> {
        count("--frames", self.frames, 1_000_000)?;
        let (field, camera) = (field()?, Camera::default());
        let mut detector = detector(self.model.as_deref())?;
        let mut times = Times::default();
        let (mut judged, mut pictures) = (Vec::new(), Vec::new());
        let (mut errors, mut false_frames, mut skipped) = (Vec::new(), 0, 0);
        // Down to here the curve of precision over recall is followed.
        let least = 0.02;
        let bar = output::bar(self.frames, "{wide_bar} {pos}/{len} frames {eta}");
        if let Some(folder) = &self.data {
            let set = dataset::Folder::open(folder)?;
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
                let looked = look(&mut renderer, &mut detector, &field, seed, least, &mut times)?;
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
                    let used: Vec<_> = looked.found.iter().copied().filter(|d| d.confidence >= THRESHOLD).collect();
                    let missed = mistakes(&used, &labels);
                    pictures.push((
                        missed,
                        picture(&format!("seed {seed}: {missed} mistakes"), &looked.view, &used, &labels, None),
                    ));
                    pictures.sort_by_key(|picture| std::cmp::Reverse(picture.0));
                    pictures.truncate(24);
                }
                judged.push(Judged { found: looked.found, labels });
                bar.inc(1);
            }
        }
        bar.finish_and_clear();
        let rows = Class::ALL.map(|class| metric::row(&judged, class, THRESHOLD));
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
        };
        if let Some(out) = &self.out {
            let body: String = pictures.into_iter().map(|(_, html)| html).collect();
            save(out, "The worst frames", &body)?;
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
    text
}

impl ProximityArgs {
    fn run(self, output: &Output) -> Result<(), Failure> {
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

/// A frame and its depth side by side, with boxes over them.
fn picture(title: &str, view: &View, found: &[Detection], labels: &[label::Label], looked: Option<&Looked>) -> String {
    let code = |png: Vec<u8>| base64::engine::general_purpose::STANDARD.encode(png);
    let colour = |class: Class| ["#ff8000", "#ffee00", "#ff40ff", "#ff3030", "#20e0ff", "#6080ff"][class.index()];
    let (w, h) = (view.frame.width, view.frame.height);
    let mut boxes = String::new();
    for l in labels.iter().filter(|l| !l.ignored) {
        let r = l.rect;
        let _ = write!(
            boxes,
            "<rect x='{}' y='{}' width='{}' height='{}' stroke='{}' stroke-dasharray='2 2'/>",
            r.left,
            r.top,
            r.width(),
            r.height(),
            colour(l.class)
        );
    }
    for d in found {
        let r = d.rect;
        let team = d.team.map_or("", |t| t.name());
        let _ = write!(
            boxes,
            "<rect x='{:.1}' y='{:.1}' width='{:.1}' height='{:.1}' stroke='{c}'/><text x='{:.1}' y='{:.1}' fill='{c}'>{} {:.2} {team}</text>",
            r.left,
            r.top,
            r.width(),
            r.height(),
            r.left,
            (r.top - 2.0).max(8.0),
            d.class.name(),
            d.confidence,
            c = colour(d.class)
        );
    }
    let mut near = String::new();
    let mut said = String::new();
    if let Some(looked) = looked {
        for o in looked.obstacles.iter().filter(|o| !o.dummy) {
            let r = o.rect;
            let _ = write!(
                near,
                "<rect x='{}' y='{}' width='{}' height='{}' stroke='#fff'/><text x='{}' y='{}' fill='#fff'>{:.2} m</text>",
                r.left,
                r.top,
                r.width(),
                r.height(),
                r.left + 2.0,
                r.top + 10.0,
                o.depth
            );
        }
        if let Some((ball, confidence)) = &looked.sights.ball {
            let how = if ball.by_diameter { "diameter" } else { "depth" };
            let [x, y] = [ball.position.x, ball.position.y];
            let _ = write!(said, "ball {x:.2} m ahead, {y:.2} m left, by {how}, confidence {confidence:.2}; ");
        }
        for why in &looked.sights.refused {
            let _ = write!(said, "ball thrown out: {why:?}; ");
        }
        let _ = write!(said, "{} landmarks, {} robots", looked.sights.landmarks.len(), looked.sights.robots.len());
    }
    let one = |png: String, over: &str| {
        format!(
            "<svg viewBox='0 0 {w} {h}'><image href='data:image/png;base64,{png}' width='{w}' height='{h}'/>{over}</svg>"
        )
    };
    let frame = one(code(view.frame.png()), &boxes);
    let depth = one(code(view.depth.picture(10.0).png()), &near);
    format!("<section><h2>{title}</h2><div>{frame}{depth}</div><p>{said}</p></section>")
}

fn save(path: &Path, title: &str, body: &str) -> Result<(), Failure> {
    let page = format!(
        "<!doctype html><html lang='en'><meta charset='utf-8'><title>{title}</title><style>body{{background:#181a1e;color:#ddd;font:15px system-ui;margin:24px}}svg{{width:49%;margin-right:1%;background:#000}}svg rect{{fill:none;stroke-width:1}}svg text{{font:8px sans-serif}}h2{{font-size:15px;margin:18px 0 6px}}</style><h1>{title}</h1><p>Left: the frame, what was found (whole lines, with confidence) and what is there (dashed). Right: depth, black where the camera has none, with near obstacles.</p>{body}</html>"
    );
    std::fs::write(path, page).map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))
}
