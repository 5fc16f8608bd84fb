//! `instep see data` and `instep see train`: labelled sets, and a detector from them.

use std::path::PathBuf;

use clap::Args;
use instep_perception::scene::random::Split;
use instep_perception::train::{LANES, Plan, Rendered, Source, Training};
use instep_perception::{Camera, dataset};

use super::count;
use crate::failure::Failure;
use crate::files;
use crate::output::{self, Output};

#[derive(Debug, Args)]
pub(super) struct DataArgs {
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
pub(super) struct TrainArgs {
    /// A set in COCO's or YOLO's layout [default: rendered frames]
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
    /// The detector; its ONNX file and card are written beside it, and its checkpoint, from which a training that was stopped
    /// goes on
    #[arg(long, value_name = "FILE", default_value = "detector.safetensors")]
    out: PathBuf,
}

impl DataArgs {
    pub(super) fn run(self, output: &Output) -> Result<(), Failure> {
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
    pub(super) fn run(self, output: &Output) -> Result<(), Failure> {
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
                let set = dataset::Set::open(folder)?;
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
        let checkpoint = self.out.with_extension("checkpoint");
        let _alone = files::alone(&checkpoint)?;
        if checkpoint.exists() {
            training.resume(&checkpoint)?;
        }
        training.save(&checkpoint)?;
        let stop = crate::interrupt::stopped_by_the_user();
        let bar = output::bar(self.frames, "{wide_bar} {pos}/{len} frames, loss {msg} {eta}");
        let (mut mean, mut steps) = (f64::NAN, 0u32);
        while !training.done() && !stop.load(std::sync::atomic::Ordering::Relaxed) {
            let loss = training.step()?;
            mean = if mean.is_nan() { loss } else { 0.98 * mean + 0.02 * loss };
            steps += 1;
            bar.set_position(training.frames());
            bar.set_message(format!("{mean:.3}"));
            if steps.is_multiple_of(200) {
                training.save(&checkpoint)?;
            }
        }
        training.save(&checkpoint)?;
        bar.finish_and_clear();
        let seen = match &self.data {
            Some(set) => set.display().to_string(),
            None => "rendered frames".to_owned(),
        };
        training.export(&self.out, &seen)?;
        let shown = serde_json::json!({"frames": training.frames(), "loss": mean, "out": self.out});
        output.show(&shown, |_| format!("{} frames, loss {mean:.3}, in {}", training.frames(), self.out.display()))
    }
}
