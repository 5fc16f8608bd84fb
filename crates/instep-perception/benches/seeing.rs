//! Times of the stages of seeing, one core: `cargo bench -p instep-perception --bench seeing`.
#![allow(clippy::expect_used, clippy::print_stdout, reason = "a benchmark prints, and stops at the first surprise")]

use std::time::Instant;

use instep_field::Field;
use instep_perception::after::sights::sights;
use instep_perception::camera::Camera;
use instep_perception::detector::{Detector, THRESHOLDS};
use instep_perception::net::shape;
use instep_perception::proximity::{self, Proximity};
use instep_perception::render::Renderer;
use instep_perception::scene::random::{Split, scene};
use instep_perception::train::loss;

fn main() {
    let field = Field::named("adult-2024").expect("a field of the table");
    let camera = Camera::default();
    let mut renderer = Renderer::new(camera, &field);
    let mut detector = Detector::shipped().expect("the file in the program");
    let weights = detector.weights().to_vec();
    let mut tape = shape::Tape::new();
    let (mut slope, mut gradient, mut planes) = (Vec::new(), vec![0.0; shape::parameters()], Vec::new());
    let stages = ["scene", "render", "detector", "after", "forward", "loss", "backward"];
    let mut times: [Vec<f64>; 7] = Default::default();
    for seed in 0..100 {
        let mut clock = Instant::now();
        let mut lap = |k: usize| {
            times[k].push(clock.elapsed().as_secs_f64() * 1e3);
            clock = Instant::now();
        };
        let scene = scene(&field, &camera, Split::Test, seed);
        lap(0);
        let view = renderer.render(&scene);
        lap(1);
        let found = detector.detect(&view.frame, &THRESHOLDS).expect("a frame of the network's size");
        lap(2);
        let radius = field.ball.radius as f32;
        std::hint::black_box(sights(&camera, &scene.camera, radius, &view.frame, &view.depth, &found));
        let near = proximity::nearest(&Proximity::default(), &camera, &scene.camera, &view.depth, Some(&view.frame));
        std::hint::black_box(near);
        lap(3);
        shape::image(&view.frame.rgb, &mut planes);
        shape::forward(&weights, &planes, &mut tape);
        lap(4);
        let labels = instep_perception::label::labels(&camera, &field, &scene, &view);
        loss::loss(tape.output(), &labels, &mut slope);
        lap(5);
        shape::backward(&weights, &mut tape, &slope, &mut gradient);
        lap(6);
    }
    for (name, times) in stages.iter().zip(&mut times) {
        times.sort_by(f64::total_cmp);
        println!("{name:<9} median {:6.2} ms, best {:6.2} ms, worst of 100 {:6.2} ms", times[50], times[0], times[99]);
    }
}
