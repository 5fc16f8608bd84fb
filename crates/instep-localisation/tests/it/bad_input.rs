//! What cannot be is refused with its cause, and changes nothing.

use std::sync::Arc;

use instep_field::{Field, LandmarkClass, Pose};
use instep_localisation::{
    Frame, LandmarkFilter, LineSight, LocalisationError, Localiser, Map, Settings, Sight, Start, Status, Step,
};

fn localiser() -> Localiser<LandmarkFilter> {
    let map = Arc::new(Map::new(&Field::named("kid").unwrap(), false).unwrap());
    let start = Start::Near { pose: Pose::new(1.0, 0.5, 0.2), position_sigma: 0.1, heading_sigma: 0.1 };
    let mut localiser = Localiser::new(LandmarkFilter::new(map, Settings::default()), start);
    localiser.step(&Step { time: 0.0, motion: Pose::default() }).unwrap();
    localiser.step(&Step { time: 1.0, motion: Pose::new(0.1, 0.0, 0.0) }).unwrap();
    localiser
}

fn sight(x: f64, y: f64) -> Sight {
    Sight { class: LandmarkClass::T, position: [x, y], confidence: 1.0, covariance: None }
}

fn frame(time: f64, sight: Sight) -> Frame {
    Frame { time, landmarks: vec![sight], lines: Vec::new() }
}

#[test]
fn sights_that_cannot_be_are_refused_and_change_nothing() {
    let mut localiser = localiser();
    let before = (localiser.pose(), localiser.covariance());
    let bad = [
        (frame(1.0, sight(f64::NAN, 1.0)), "landmarks[0]: position [NaN, 1] m"),
        (frame(1.0, sight(f64::INFINITY, 1.0)), "position [inf, 1] m"),
        (frame(1.0, sight(0.0, 0.0)), "a finite position with a range above zero"),
        (frame(f64::NAN, sight(1.0, 0.0)), "time NaN s"),
        (frame(1.0, Sight { confidence: 0.0, ..sight(1.0, 0.0) }), "confidence 0"),
        (frame(1.0, Sight { covariance: Some([1.0, 2.0, 1.0]), ..sight(1.0, 0.0) }), "positive definite"),
        (
            Frame { time: 1.0, landmarks: vec![], lines: vec![LineSight { from: [1.0, 0.0], to: [1.0, 0.0] }] },
            "lines[0]",
        ),
    ];
    for (frame, expected) in bad {
        let said = localiser.see(&frame).unwrap_err().to_string();
        assert!(said.contains(expected), "{said}");
    }
    let step = Step { time: 2.0, motion: Pose { x: f64::NAN, y: 0.0, heading: 0.0 } };
    assert!(localiser.step(&step).unwrap_err().to_string().contains("odometry of 2 s: motion (NaN"));
    assert_eq!((localiser.pose(), localiser.covariance()), before);
}

#[test]
fn time_must_not_run_backwards() {
    let mut localiser = localiser();
    let said = localiser.step(&Step { time: 0.5, motion: Pose::default() }).unwrap_err();
    assert_eq!(said, LocalisationError::Backwards { place: "odometry", found: 0.5, before: 1.0 });
    localiser.see(&frame(0.8, sight(2.0, 0.1))).unwrap();
    let said = localiser.see(&frame(0.7, sight(2.0, 0.1))).unwrap_err();
    assert!(matches!(said, LocalisationError::Backwards { place: "frame", .. }), "{said}");
    for k in 0..100 {
        localiser.step(&Step { time: 1.0 + 0.1 * f64::from(k), motion: Pose::default() }).unwrap();
    }
    let said = localiser.see(&frame(1.0, sight(2.0, 0.1))).unwrap_err();
    assert!(matches!(said, LocalisationError::TooOld { .. }), "{said}");
}

#[test]
fn a_map_needs_landmarks() {
    let landmark = instep_field::Landmark { class: LandmarkClass::L, x: 1.0, y: 1.0 };
    for own in [vec![], vec![landmark]] {
        let field = Field { own_landmarks: Some(own), ..Field::named("kid").unwrap() };
        assert!(matches!(Map::new(&field, false), Err(LocalisationError::NoLandmarks { .. })));
    }
}

#[test]
fn settings_are_named_by_their_path() {
    let mut settings = Settings::default();
    settings.global.drop = 1.0;
    assert!(settings.validate().unwrap_err().to_string().starts_with("global.drop: 1"));
    settings = Settings::default();
    settings.filter.iterations = 0;
    assert!(settings.validate().unwrap_err().to_string().starts_with("filter.iterations: 0"));
    Settings::default().validate().unwrap();
}

/// Whoever knows nothing and sees nothing is lost, and says so.
#[test]
fn without_sights_there_is_no_pose() {
    let map = Arc::new(Map::new(&Field::named("kid").unwrap(), false).unwrap());
    let mut localiser = Localiser::new(LandmarkFilter::new(map, Settings::default()), Start::OwnHalf);
    for k in 0..100 {
        let time = 0.05 * f64::from(k);
        localiser.step(&Step { time, motion: Pose::default() }).unwrap();
        localiser.see(&Frame { time, ..Frame::default() }).unwrap();
        localiser.check_if_due();
    }
    assert_eq!(localiser.status(), Status::Lost);
    assert!(localiser.pose().is_finite());
}

/// Sights of nothing but nonsense, for long: finite numbers and no panic.
#[test]
fn nonsense_does_no_harm() {
    let mut localiser = localiser();
    for k in 0..400 {
        let time = 1.0 + 0.05 * f64::from(k);
        let far = 10_f64.powi(k % 9 - 3);
        localiser.step(&Step { time, motion: Pose::new(0.0, 0.0, f64::from(k % 7) - 3.0) }).unwrap();
        localiser.see(&frame(time, sight(far, -far * 0.3))).unwrap();
        localiser.check_if_due();
    }
    assert!(localiser.pose().is_finite());
    assert!(localiser.covariance().unwrap().iter().all(|v| v.is_finite()));
}
