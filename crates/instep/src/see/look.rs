//! `instep see`: a robot's camera looks at a moving scene; frames, depth, boxes, the ball's track and obstacles on a page.

use std::path::PathBuf;

use clap::Args;
use instep_perception::Camera;
use instep_perception::detector::THRESHOLDS;
use instep_perception::label::{self, Rect};
use instep_perception::render::Renderer;
use instep_perception::scene::moving::Moving;
use instep_perception::scene::random::{Mount, Split, scene_from};
use instep_report::mcap::{ImageBox, Recording};
use nalgebra::Vector3;

use super::track::{BallTrack, RATE};
use super::{Looked, Times, count, detector, field, look_at, median, page};
use crate::failure::Failure;
use crate::output::Output;
use crate::{files, places};

/// Frames on the page at most; a recording has all of them.
const SHOWN: usize = 12;

#[derive(Debug, Args)]
pub(super) struct LookArgs {
    /// The robot whose camera looks: a name, or the path of its folder or robot.toml
    #[arg(long, value_name = "ROBOT", default_value = "artemis")]
    robot: String,
    /// What it looks at; only `random` so far
    #[arg(long, default_value = "random")]
    scene: String,
    /// Seed of the scene
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of frames, 15 a second
    #[arg(long, value_name = "N", default_value_t = 24)]
    frames: u64,
    /// Where the report goes
    #[arg(long, value_name = "FILE", default_value = "see.html")]
    out: PathBuf,
    /// A recording of all frames with what was found, for Foxglove and Rerun
    #[arg(long, value_name = "FILE.mcap")]
    record: Option<PathBuf>,
    /// A detector's file [default: the one that comes with Instep]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
}

/// The camera of a robot as its robot.toml has it, at the network's size, and how its head carries it.
fn camera_of(name: &str) -> Result<(Camera, Mount), Failure> {
    let robot = places::robot(name)?;
    let Some(eye) = &robot.camera else {
        return Err(Failure::input(format!(
            "{}: no camera; expected a table [senses.camera]",
            robot.folder().join("robot.toml").display()
        )));
    };
    let camera = Camera { field_of_view: eye.field_of_view[0], rate: 1.0 / eye.period, ..Camera::default() };
    camera.validate(&format!("{}: senses.camera", robot.folder().join("robot.toml").display()))?;
    let mut data = robot.data();
    data.set_position(&robot.stand);
    let height = data.point(&eye.at).z as f32;
    let ahead = data.link_rotation(eye.at.link) * eye.link_from_camera * Vector3::x();
    let pitch = (-ahead.z).clamp(-1.0, 1.0).asin() as f32;
    let mount = Mount { height: [0.97 * height, 1.01 * height], pitch: [pitch - 0.2, pitch + 0.25] };
    Ok((camera, mount))
}

impl LookArgs {
    pub(super) fn run(self, output: &Output) -> Result<(), Failure> {
        count("--frames", self.frames, 3000)?;
        if self.scene != "random" {
            return Err(Failure::input(format!("--scene: {}; expected random", self.scene)));
        }
        for file in std::iter::once(&self.out).chain(&self.record) {
            files::check_file(file)?;
        }
        let field = field()?;
        let (camera, mount) = camera_of(&self.robot)?;
        let mut detector = detector(self.model.as_deref())?;
        let mut renderer = Renderer::new(camera, &field);
        let moving = Moving::new(scene_from(&mount, &field, &camera, Split::Test, self.seed), self.seed);
        let mut recording = self.record.as_ref().map(|_| Recording::new()).transpose()?;
        let (mut times, mut ball) = (Times::default(), BallTrack::default());
        let (mut body, mut errors) = (String::new(), Vec::new());
        let every = (self.frames as usize).div_ceil(SHOWN);
        for k in 0..self.frames {
            let t = k as f64 / RATE;
            let looked = look_at(&mut renderer, &mut detector, &field, moving.at(t as f32), &THRESHOLDS, &mut times)?;
            let pose = &looked.scene.camera;
            ball.step(1.0 / RATE, pose, looked.sights.ball.as_ref().map(|(sight, _)| sight));
            let tracked = ball.track.as_ref().map(|track| track.position());
            if let (Some(found), Some(truth)) = (tracked, moving.ball(t as f32)) {
                errors.push((found - truth.cast::<f64>()).xy().norm());
            }
            let spot = tracked.and_then(|place| {
                let local = pose.camera_from_world(place.cast::<f32>());
                let side = 2.0 * camera.focal() * field.ball.radius as f32 / local.z;
                camera.project(local).map(|middle| Rect::around(middle, side, side))
            });
            if let Some(recording) = &mut recording {
                record(recording, t, &looked, spot)?;
            }
            if (k as usize).is_multiple_of(every) {
                let labels = label::labels(&camera, &field, &looked.scene, &looked.view);
                let title = format!("{t:.2} s");
                body += &page::picture(&title, &looked.view, &looked.found, &labels, Some((&looked, spot)));
            }
        }
        let title = format!("What {} sees: scene {}", self.robot, self.seed);
        page::save(&self.out, &title, &body)?;
        if let (Some(recording), Some(path)) = (recording, &self.record) {
            recording.save(path)?;
        }
        let shown = serde_json::json!({
            "frames": self.frames, "out": self.out, "record": self.record,
            "render_ms": median(&mut times.render), "detector_ms": median(&mut times.detector),
            "after_ms": median(&mut times.after), "track_error_median": median(&mut errors),
        });
        output.show(&shown, |_| {
            let recorded =
                self.record.as_ref().map_or(String::new(), |path| format!(", all of them in {}", path.display()));
            format!("{} frames, shown in {}{recorded}", self.frames, self.out.display())
        })
    }
}

/// A frame and what was found in it; the ball's track is a box of its own.
fn record(recording: &mut Recording, t: f64, looked: &Looked, spot: Option<Rect>) -> Result<(), Failure> {
    let edges = |r: &Rect| [r.left, r.top, r.right, r.low].map(f64::from);
    let color = |text: &str| {
        let channel = |at: usize| u8::from_str_radix(text.get(at..at + 2).unwrap_or("ff"), 16).unwrap_or(255);
        [1, 3, 5].map(|at| f64::from(channel(at)) / 255.0)
    };
    let found: Vec<([f64; 4], [f64; 3], String)> = looked
        .found
        .iter()
        .map(|d| {
            let team = d.team.map_or("", |team| team.name());
            let text = format!("{} {:.2} {team}", d.class.name(), d.confidence);
            (edges(&d.rect), color(page::colour(d.class)), text.trim_end().to_owned())
        })
        .chain(spot.map(|spot| (edges(&spot), [1.0; 3], "track".to_owned())))
        .chain(
            looked
                .obstacles
                .iter()
                .filter(|o| !o.dummy)
                .map(|o| (edges(&o.rect), [0.7, 0.7, 0.7], format!("near {:.2} m", o.depth))),
        )
        .collect();
    let boxes: Vec<ImageBox<'_>> =
        found.iter().map(|(edges, color, text)| ImageBox { edges: *edges, color: *color, text }).collect();
    recording.image(t, &looked.view.frame.png())?;
    recording.annotations(t, &boxes)?;
    Ok(())
}
