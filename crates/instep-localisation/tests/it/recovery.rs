//! Carried away, started wrong, started with nothing but the half: the shipped filter finds back, and to the right half.

use instep_localisation::Start;
use instep_localisation::evaluate::follow;
use instep_localisation::scenario::Scenario;
use instep_localisation::stream::Stream;

use crate::{measured, method};

#[test]
fn carried_away_it_finds_back_and_not_to_the_twin() {
    let m = measured("carried", 0, 8);
    assert_eq!((m.recovered_rate, m.twin_rate), (1.0, 0.0), "{m:?}");
    assert!(m.recovery_median.unwrap() < 2.5, "{m:?}");
}

#[test]
fn a_wrong_start_is_mended() {
    let m = measured("start-error", 0, 8);
    assert!(m.recovery_worst.unwrap() < 4.0 && m.recovered_rate == 1.0, "{m:?}");
}

#[test]
fn the_game_tells_the_half() {
    let m = measured("own-half", 0, 4);
    assert!(m.recovered_rate == 1.0 && m.twin_rate == 0.0 && m.recovery_worst.unwrap() < 3.0, "{m:?}");
}

#[test]
fn knowing_nothing_it_says_that_there_are_two_answers() {
    let scenario = Scenario { duration: 6.0, ..Scenario::named("star").unwrap().clone() };
    let stream = Stream { start: Start::Anywhere, ..Stream::simulate(&scenario, 510).unwrap() };
    let track = follow(method(&stream, 0), &stream, &|| 0.0).unwrap();
    let last = track.samples.last().unwrap();
    assert!(last.is_right() || last.is_twin());
    assert!(last.ambiguous, "both halves are possible, and it does not say so");
}

/// A field looks the same from both halves: whoever starts in the twin stays in the twin, exactly.
#[test]
fn the_twin_of_a_start_gives_the_twin_of_the_track() {
    let scenario = Scenario { duration: 10.0, ..Scenario::named("star").unwrap().clone() };
    let stream = Stream::simulate(&scenario, 511).unwrap();
    let Start::Near { pose, position_sigma, heading_sigma } = stream.start else { panic!("not near") };
    let start = Start::Near { pose: pose.mirrored(), position_sigma, heading_sigma };
    let twin = Stream { start, ..stream.clone() };
    let [a, b] = [&stream, &twin].map(|s| follow(method(s, 0), s, &|| 0.0).unwrap());
    for (a, b) in a.samples.iter().zip(&b.samples) {
        assert!(a.estimate.distance(&b.estimate.mirrored()) < 1e-6);
    }
}
