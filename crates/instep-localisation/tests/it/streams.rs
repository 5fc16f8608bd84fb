//! Streams: the same seed gives the same bytes, a file gives the same stream, and the noise is what the scenario says.

use instep_localisation::Start;
use instep_localisation::evaluate::follow;
use instep_localisation::scenario::Scenario;
use instep_localisation::stream::{Stream, Told};

use crate::method;

fn short(name: &str, duration: f64) -> Scenario {
    Scenario { duration, ..Scenario::named(name).unwrap().clone() }
}

fn bytes(stream: &Stream) -> Vec<u8> {
    let mut bytes = Vec::new();
    stream.write(&mut bytes).unwrap();
    bytes
}

#[test]
fn same_seed_same_bytes_and_same_track() {
    let [a, b] = [0, 1].map(|_| Stream::simulate(&short("lines", 5.0), 7).unwrap());
    assert_eq!(bytes(&a), bytes(&b));
    assert_ne!(bytes(&a), bytes(&Stream::simulate(&short("lines", 5.0), 8).unwrap()));
    for k in 0..5 {
        let [a, b] = [&a, &b].map(|s| follow(method(s, k), s, &|| 0.0).unwrap());
        assert_eq!(a, b);
    }
}

#[test]
fn a_file_gives_the_same_stream() {
    let stream = Stream::simulate(&short("lines", 5.0), 7).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("stream.jsonl");
    std::fs::write(&file, bytes(&stream)).unwrap();
    let read = Stream::load(&file).unwrap();
    assert_eq!(read.told, stream.told);
    assert_eq!(read.field, stream.field);
    let (Start::Near { pose: a, .. }, Start::Near { pose: b, .. }) = (read.start, stream.start) else {
        panic!("not near")
    };
    assert_eq!(a, b);
}

/// Range errors by distance, misses and false detections against what the scenario says, over a long run.
#[test]
fn the_noise_is_what_the_scenario_says() {
    let scenario = Scenario { duration: 400.0, confused: 0.0, false_share: 0.0, ..short("star-white", 0.0) };
    let stream = Stream::simulate(&scenario, 3).unwrap();
    let mut errors = vec![Vec::new(); 3];
    let mut bearings = Vec::new();
    let (mut now, mut count, mut frames) = (None, 0, 0);
    for told in &stream.told {
        match told {
            Told::Truth(truth) => now = Some(truth.pose),
            Told::Frame(frame) => {
                frames += 1;
                count += frame.landmarks.len();
                for sight in &frame.landmarks {
                    let seen = sight.position[0].hypot(sight.position[1]);
                    let at = now.unwrap().outer_from_local(sight.position);
                    let of_class = stream.field.landmarks();
                    let nearest = of_class
                        .iter()
                        .map(|l| l.position())
                        .min_by(|a, b| {
                            let d = |p: &[f64; 2]| (p[0] - at[0]).hypot(p[1] - at[1]);
                            d(a).total_cmp(&d(b))
                        })
                        .unwrap();
                    let local = now.unwrap().local_from_outer(nearest);
                    let range = local[0].hypot(local[1]);
                    let class = if range < 2.0 {
                        0
                    } else if range < 4.0 {
                        1
                    } else {
                        2
                    };
                    if range < 6.0 {
                        bearings.push(sight.position[1].atan2(sight.position[0]) - local[1].atan2(local[0]));
                        errors[class].push(seen / range - 1.0);
                    }
                }
            }
            _ => {}
        }
    }
    let rms = |v: &[f64]| (v.iter().map(|e| e * e).sum::<f64>() / v.len() as f64).sqrt();
    for (k, expected) in [0.01, 0.03, 0.05].into_iter().enumerate() {
        let found = rms(&errors[k]);
        assert!((found / expected - 1.0).abs() < 0.1, "class {k}: {found} from {} sights", errors[k].len());
    }
    let bearings: Vec<f64> = bearings.into_iter().map(instep_field::wrap).collect();
    assert!((rms(&bearings).to_degrees() - 1.0).abs() < 0.1, "{}", rms(&bearings).to_degrees());
    let mean = count as f64 / f64::from(frames);
    assert!((5.0..=7.0).contains(&mean), "{mean} sights a frame");
}

/// Without errors the odometry is the truth; with three times the errors it drifts three times as far.
#[test]
fn the_odometry_drifts_as_the_scenario_says() {
    let drift = |factor: f64| -> f64 {
        let runs = 40;
        let sum: f64 = (0..runs)
            .map(|seed| {
                let scenario = Scenario { odometry: factor, duration: 20.0, ..short("star", 0.0) };
                let stream = Stream::simulate(&scenario, seed).unwrap();
                let (mut pose, mut truth) = (scenario.star(0.0), scenario.star(0.0));
                for told in &stream.told {
                    match told {
                        Told::Truth(t) => truth = t.pose,
                        Told::Odometry(step) => pose = pose.then(&step.motion),
                        _ => {}
                    }
                }
                pose.distance(&truth)
            })
            .sum();
        sum / runs as f64
    };
    assert!(drift(0.0) < 1e-6);
    let one = drift(1.0);
    assert!((0.1..0.6).contains(&one), "{one} m in 20 s");
    assert!((2.2..3.8).contains(&(drift(3.0) / one)));
}
