//! `instep see`: what the head camera sees and what is made of it; labelled sets, training, measuring.

mod learn;
mod look;
mod measure;
mod page;
mod track;

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use clap::{Args, Subcommand};
use instep_field::Field;
use instep_perception::after::sights::{Sights, sights};
use instep_perception::detector::{Detection, Detector};
use instep_perception::proximity::{self, Obstacle, Proximity};
use instep_perception::render::{Renderer, View};
use instep_perception::scene::Scene;
use instep_perception::{Class, PerceptionError};

use crate::failure::Failure;
use crate::output::Output;

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
    look: look::LookArgs,
}

#[derive(Debug, Subcommand)]
enum SeeCommand {
    /// Make a labelled set in COCO's and YOLO's layout
    Data(learn::DataArgs),
    /// Train a detector on rendered frames, or on a set in COCO's or YOLO's layout
    Train(learn::TrainArgs),
    /// Measure a detector: precision, recall, mAP by class (paper 4, Table II)
    Eval(measure::EvalArgs),
    /// Measure the finding of near obstacles over three walks (paper 4, Table III)
    Proximity(measure::ProximityArgs),
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

fn look_at(
    renderer: &mut Renderer,
    detector: &mut Detector,
    field: &Field,
    scene: Scene,
    thresholds: &[f32; Class::ALL.len()],
    times: &mut Times,
) -> Result<Looked, Failure> {
    let camera = *renderer.camera();
    let ms = |start: Instant| start.elapsed().as_secs_f64() * 1e3;
    let start = Instant::now();
    let view = renderer.render(&scene);
    times.render.push(ms(start));
    let start = Instant::now();
    let found = detector.detect(&view.frame, thresholds)?;
    times.detector.push(ms(start));
    let start = Instant::now();
    let used: Vec<Detection> = found.iter().copied().filter(Detection::is_used).collect();
    let radius = field.ball.radius as f32;
    let sights = sights(&camera, &scene.camera, radius, &view.frame, &view.depth, &used);
    let obstacles = proximity::nearest(&Proximity::default(), &camera, &scene.camera, &view.depth, Some(&view.frame));
    times.after.push(ms(start));
    Ok(Looked { scene, view, found, sights, obstacles })
}
