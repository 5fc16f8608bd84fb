//! The whole way: scenes to frames, frames to weights, weights to boxes.
#![allow(clippy::unwrap_used, reason = "clippy.toml allows it in test functions; here the helpers are tests too")]

use instep_field::Field;
use instep_perception::detector::Detector;
use instep_perception::label::{Label, labels};
use instep_perception::metric::{self, Judged};
use instep_perception::render::Renderer;
use instep_perception::scene::random::{Split, scene};
use instep_perception::train::{Plan, Rendered, Source, Training};
use instep_perception::{Camera, Class, Frame, PerceptionError};

fn rendered() -> Rendered {
    Rendered::new(Camera::default(), Rendered::fields(Split::Train).unwrap(), Split::Train)
}

#[test]
fn the_same_seed_gives_the_same_bytes_whatever_was_rendered_before() {
    let field = Field::named("adult-2024").unwrap();
    let camera = Camera::default();
    let of = |seed| scene(&field, &camera, Split::Test, seed);
    let mut used = Renderer::new(camera, &field);
    used.render(&of(5));
    let (again, fresh) = (used.render(&of(3)), Renderer::new(camera, &field).render(&of(3)));
    assert_eq!(again.frame, fresh.frame);
    let bits = |depth: &[f32]| depth.iter().map(|z| z.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&again.depth.meters), bits(&fresh.depth.meters));
    assert_ne!(again.frame, used.render(&of(4)).frame);
}

#[test]
fn training_and_test_share_no_scene() {
    let field = Field::named("adult-2024").unwrap();
    let camera = Camera::default();
    for seed in 0..20 {
        let [a, b] = [Split::Train, Split::Test].map(|split| scene(&field, &camera, split, seed));
        assert_ne!(a.look.texture >> 24, b.look.texture >> 24);
        assert_ne!(a.look.light.y > 0.0, b.look.light.y > 0.0, "lights come from other sides");
    }
}

#[test]
fn a_training_goes_on_where_it_stopped_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let plan = |threads| Plan { frames: 6, batch: 2, threads, ..Plan::default() };
    let mut whole = Training::new(plan(1), [rendered(), rendered()]);
    while !whole.done() {
        whole.step().unwrap();
    }
    let path = folder.path().join("half");
    let mut half = Training::new(plan(2), [rendered(), rendered()]);
    half.step().unwrap();
    half.save(&path).unwrap();
    let mut rest = Training::new(plan(2), [rendered(), rendered()]);
    rest.resume(&path).unwrap();
    assert_eq!(rest.frames(), 2);
    while !rest.done() {
        rest.step().unwrap();
    }
    assert!(whole.result() == rest.result(), "the same weights to the last bit");
    // What is exported is a detector.
    let out = folder.path().join("own.safetensors");
    rest.export(&out, "rendered frames").unwrap();
    assert!(Detector::load(&out).unwrap().weights() == rest.result());
    let onnx = std::fs::read(out.with_extension("onnx")).unwrap();
    assert!(onnx.len() > 4 * rest.result().len());
    assert!(std::fs::read_to_string(out.with_extension("md")).unwrap().contains("6 frames"));
}

/// One frame, again and again.
#[derive(Clone)]
struct One(Frame, Vec<Label>);

impl Source for One {
    fn frame(&mut self, _: u64) -> Result<(Frame, Vec<Label>), PerceptionError> {
        Ok((self.0.clone(), self.1.clone()))
    }
}

#[test]
fn the_network_learns() {
    let (frame, labels) = rendered().frame(6).unwrap();
    let one = One(frame, labels);
    let plan = Plan { frames: 1000, batch: 2, threads: 2, rate: 1e-3, seed: 1 };
    let mut training = Training::new(plan, [one.clone(), one]);
    let first: f64 = (0..4).map(|_| training.step().unwrap()).sum();
    for _ in 0..100 {
        training.step().unwrap();
    }
    let last: f64 = (0..4).map(|_| training.step().unwrap()).sum();
    assert!(last < 0.7 * first, "{first} {last}");
}

#[test]
fn the_shipped_detector_finds_what_is_there() {
    let field = Field::named("adult-2024").unwrap();
    let camera = Camera::default();
    let (mut renderer, mut detector) = (Renderer::new(camera, &field), Detector::shipped().unwrap());
    let judged: Vec<Judged> = (7_000..7_030)
        .map(|seed| {
            let scene = scene(&field, &camera, Split::Test, seed);
            let view = renderer.render(&scene);
            let found = detector.detect(&view.frame, &[0.02; 6]).unwrap();
            Judged { found, labels: labels(&camera, &field, &scene, &view) }
        })
        .collect();
    let of = |class| metric::row(&judged, class, 0.5).map50;
    // Its card says 0.86 to 0.96, over more frames.
    for class in Class::ALL {
        assert!(of(class) > 0.75, "{class:?}: {}", of(class));
    }
}
