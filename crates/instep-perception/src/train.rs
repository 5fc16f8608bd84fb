//! Training from scratch: Adam on rendered or stored frames, resumable, the same on any number of threads.
//!
//! A frame's number alone decides what it shows, so that going on from a checkpoint is going on where it stopped. A
//! batch is split into [`LANES`] parts whose gradients are added in their order, whoever computed them.

pub mod loss;
mod mirror;

use std::collections::HashMap;
use std::path::Path;

use instep_field::Field;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use crate::PerceptionError;
use crate::camera::Camera;
use crate::label::{Label, labels};
use crate::net::{file, onnx, shape};
use crate::picture::Frame;
use crate::render::Renderer;
use crate::scene::random::{Split, scene};

/// Parts of a batch, each computed by one thread.
pub const LANES: usize = 2;

/// What a training is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Frames that it sees altogether.
    pub frames: u64,
    /// Frames in a batch, a multiple of [`LANES`].
    pub batch: usize,
    /// Highest step size.
    pub rate: f32,
    /// Threads, 1 or more.
    pub threads: usize,
    /// Seed of the first weights and of the frames.
    pub seed: u64,
}

impl Default for Plan {
    fn default() -> Self {
        Plan { frames: 60_000, batch: 8, rate: 1.2e-3, threads: 1, seed: 1 }
    }
}

/// Where frames come from: the frame of a number, with its labels.
pub trait Source: Send {
    /// Fills the next example.
    ///
    /// # Errors
    /// When a stored frame cannot be read.
    fn frame(&mut self, number: u64) -> Result<(Frame, Vec<Label>), PerceptionError>;
}

/// Frames rendered as they are needed, from all of some fields in turn.
#[derive(Debug, Clone)]
pub struct Rendered {
    fields: Vec<Field>,
    renderers: Vec<Renderer>,
    split: Split,
}

impl Rendered {
    /// Frames of `split` on `fields`.
    pub fn new(camera: Camera, fields: Vec<Field>, split: Split) -> Self {
        let renderers = fields.iter().map(|field| Renderer::new(camera, field)).collect();
        Rendered { fields, renderers, split }
    }

    /// The fields that a training sees, and the one of the test among fields that it does not know.
    ///
    /// # Errors
    /// When a field is not known.
    pub fn fields(split: Split) -> Result<Vec<Field>, PerceptionError> {
        let names: &[&str] = match split {
            Split::Train => &["hsl-m", "adult-2024", "kid"],
            Split::Test => &["adult-2024"],
        };
        names.iter().map(|name| Field::named(name).map_err(|e| PerceptionError::file(Path::new("field"), e))).collect()
    }
}

impl Source for Rendered {
    fn frame(&mut self, number: u64) -> Result<(Frame, Vec<Label>), PerceptionError> {
        let k = (number % self.fields.len() as u64) as usize;
        let renderer = &mut self.renderers[k];
        let scene = scene(&self.fields[k], renderer.camera(), self.split, number);
        let view = renderer.render(&scene);
        let labels = labels(renderer.camera(), &self.fields[k], &scene, &view);
        Ok((view.frame, labels))
    }
}

/// One thread's tools.
struct Lane<S> {
    source: S,
    /// The examples of the batch before, to be seen once more, mirrored.
    kept: Vec<(u64, Frame, Vec<Label>)>,
    tape: shape::Tape,
    planes: Vec<f32>,
    slope: Vec<f32>,
    gradient: Vec<f32>,
    loss: f64,
    failed: Option<PerceptionError>,
}

/// A training under way.
pub struct Training<S> {
    plan: Plan,
    weights: Vec<f32>,
    /// Running mean of the weights, what is used in the end.
    mean: Vec<f32>,
    m: Vec<f32>,
    v: Vec<f32>,
    step: u64,
    lanes: Vec<Lane<S>>,
}

/// Adam's decays (Kingma and Ba, 2015, algorithm 1), the running mean's, and the largest norm of a batch's gradient.
const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.99;
const MEAN: f32 = 0.998;
const LARGEST: f32 = 10.0;
const WARM_UP: u64 = 100;

impl<S: Source> Training<S> {
    /// From random weights; one source a lane.
    pub fn new(plan: Plan, sources: [S; LANES]) -> Self {
        let weights = shape::initial(&mut ChaCha8Rng::seed_from_u64(plan.seed));
        Self::with(plan, sources, weights)
    }

    /// From given weights: a network that learns further, on a team's own frames.
    pub fn with(plan: Plan, sources: [S; LANES], weights: Vec<f32>) -> Self {
        let n = weights.len();
        let lanes = sources
            .into_iter()
            .map(|source| Lane {
                source,
                kept: Vec::new(),
                tape: shape::Tape::new(),
                planes: Vec::new(),
                slope: Vec::new(),
                gradient: vec![0.0; n],
                loss: 0.0,
                failed: None,
            })
            .collect();
        Training { plan, mean: weights.clone(), m: vec![0.0; n], v: vec![0.0; n], weights, step: 0, lanes }
    }

    /// Frames seen so far.
    pub fn frames(&self) -> u64 {
        self.step * self.plan.batch as u64
    }

    /// Whether all frames are seen.
    pub fn done(&self) -> bool {
        self.frames() >= self.plan.frames
    }

    /// The weights to use.
    pub fn result(&self) -> &[f32] {
        &self.mean
    }

    /// One batch; its mean loss.
    ///
    /// # Errors
    /// When a stored frame cannot be read.
    pub fn step(&mut self) -> Result<f64, PerceptionError> {
        // Every second batch is the one before in a mirror: a frame costs more to make than to learn from.
        let (first, mirrored) = (self.step / 2 * self.plan.batch as u64, self.step % 2 == 1);
        let first = first.wrapping_add(self.plan.seed << 40);
        let share = (self.plan.batch / LANES).max(1);
        let weights = &self.weights;
        let work = |(l, lane): (usize, &mut Lane<S>)| {
            let from = first + (l * share) as u64;
            lane.run(weights, from..from + share as u64, mirrored);
        };
        if self.plan.threads > 1 {
            std::thread::scope(|scope| {
                for pair in self.lanes.iter_mut().enumerate() {
                    scope.spawn(move || work(pair));
                }
            });
        } else {
            self.lanes.iter_mut().enumerate().for_each(work);
        }
        let mut loss = 0.0;
        let (sum, rest) = self.lanes.split_at_mut(1);
        for lane in rest {
            sum[0].gradient.iter_mut().zip(&lane.gradient).for_each(|(a, b)| *a += b);
            loss += lane.loss;
        }
        loss += sum[0].loss;
        if let Some(error) = self.lanes.iter_mut().find_map(|lane| lane.failed.take()) {
            return Err(error);
        }
        self.adam();
        Ok(loss / self.plan.batch as f64)
    }

    /// Constant step size after a short warm-up, falling to nothing over the last two fifths (half a cosine).
    fn rate(&self) -> f32 {
        let share = self.frames() as f32 / self.plan.frames.max(1) as f32;
        let fall = ((share - 0.6) / 0.4).clamp(0.0, 1.0);
        let warm = ((self.step + 1) as f32 / WARM_UP as f32).min(1.0);
        self.plan.rate * warm * (0.02 + 0.98 * 0.5 * (1.0 + (std::f32::consts::PI * fall).cos()))
    }

    fn adam(&mut self) {
        let rate = self.rate();
        self.step += 1;
        let gradient = &self.lanes[0].gradient;
        let scale = 1.0 / self.plan.batch as f32;
        let norm = scale * gradient.iter().map(|g| g * g).sum::<f32>().sqrt();
        let scale = scale * (LARGEST / norm.max(1e-12)).min(1.0);
        let t = i32::try_from(self.step).unwrap_or(i32::MAX);
        let (c1, c2) = (1.0 - BETA_1.powi(t), 1.0 - BETA_2.powi(t));
        let keep = MEAN.min(1.0 - 1.0 / self.step as f32);
        let moments = self.m.iter_mut().zip(&mut self.v);
        for (((w, mean), (m, v)), g) in self.weights.iter_mut().zip(&mut self.mean).zip(moments).zip(gradient) {
            let g = g * scale;
            *m = BETA_1 * *m + (1.0 - BETA_1) * g;
            *v = BETA_2 * *v + (1.0 - BETA_2) * g * g;
            *w -= rate * (*m / c1) / ((*v / c2).sqrt() + 1e-8);
            *mean += (1.0 - keep) * (*w - *mean);
        }
    }

    /// All that it needs to go on, as a file that is a detector's too.
    ///
    /// # Errors
    /// [`PerceptionError::File`] when the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), PerceptionError> {
        let step = [(self.step >> 16) as f32, (self.step & 0xffff) as f32];
        let more: [(&str, &[f32]); 4] = [
            ("training.weights", &self.weights),
            ("training.m", &self.m),
            ("training.v", &self.v),
            ("training.step", &step),
        ];
        write(path, &file::bytes(&self.mean, &more, HashMap::new())?)
    }

    /// What it gave: the detector (safetensors), the same as ONNX, and its card beside it. `seen` says on what it learnt.
    ///
    /// # Errors
    /// [`PerceptionError::File`] when a file cannot be written.
    pub fn export(&self, path: &Path, seen: &str) -> Result<(), PerceptionError> {
        let card = format!(
            "# Detector\n- What: {} convolutions, {} parameters, {:.0} MFLOP (multiply and add counted apart) a frame of {} x {}, heat maps at stride {}.\n- Trained: {} frames ({seen}) in batches of {}, each made or read frame also in a mirror; Adam, highest step size {}, seed {}; mean of the last weights.\n- Measure it: `instep see eval --model {}`.\n",
            shape::LAYERS.len(),
            self.mean.len(),
            shape::operations() as f64 / 1e6,
            shape::INPUT[0],
            shape::INPUT[1],
            shape::CELL,
            self.frames(),
            self.plan.batch,
            self.plan.rate,
            self.plan.seed,
            path.file_name().unwrap_or_default().display(),
        );
        let notes = HashMap::from([("card".to_owned(), card.clone())]);
        write(path, &file::bytes(&self.mean, &[], notes)?)?;
        write(&path.with_extension("onnx"), &onnx::bytes(&self.mean, &card))?;
        write(&path.with_extension("md"), card.as_bytes())
    }

    /// Goes on from a checkpoint.
    ///
    /// # Errors
    /// [`PerceptionError::File`] when it is none.
    pub fn resume(&mut self, path: &Path) -> Result<(), PerceptionError> {
        let names = ["training.weights", "training.m", "training.v", "training.step"];
        let (mean, mut more) = file::read(path, &names)?;
        let wrong = || {
            PerceptionError::file(path, "training.*: of another length; expected a checkpoint of `instep see train`")
        };
        let step = more.pop().filter(|s| s.len() == 2).ok_or_else(wrong)?;
        if more.iter().any(|part| part.len() != mean.len()) {
            return Err(wrong());
        }
        self.step = ((step[0] as u64) << 16) + step[1] as u64;
        self.mean = mean;
        for to in [&mut self.v, &mut self.m, &mut self.weights] {
            *to = more.pop().ok_or_else(wrong)?;
        }
        Ok(())
    }
}

impl<S: Source> Lane<S> {
    fn run(&mut self, weights: &[f32], numbers: std::ops::Range<u64>, mirrored: bool) {
        self.gradient.fill(0.0);
        self.loss = 0.0;
        if !self.kept.iter().map(|(number, ..)| *number).eq(numbers.clone()) {
            self.kept.clear();
            for number in numbers {
                match self.source.frame(number) {
                    Ok((frame, labels)) => self.kept.push((number, frame, labels)),
                    Err(error) => {
                        self.failed = Some(error);
                        return;
                    }
                }
            }
        }
        for (number, frame, labels) in &mut self.kept {
            if mirrored {
                mirror::mirror(frame, labels, *number);
            }
            shape::image(&frame.rgb, &mut self.planes);
            shape::forward(weights, &self.planes, &mut self.tape);
            self.loss += loss::loss(self.tape.output(), labels, &mut self.slope);
            shape::backward(weights, &mut self.tape, &self.slope, &mut self.gradient);
        }
    }
}

/// Writes a file whole or not at all.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), PerceptionError> {
    let part = path.with_extension("part");
    let written = std::fs::write(&part, bytes).and_then(|()| std::fs::rename(&part, path));
    written.map_err(|e| {
        // Nothing more can be done about a temporary file that cannot be removed either.
        let _ = std::fs::remove_file(&part);
        PerceptionError::file(path, e)
    })
}
