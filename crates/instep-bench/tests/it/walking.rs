//! What the walking bench does to a robot and what it says of it, against the record of the same walk.

use std::sync::Arc;

use instep_bench::walking::{Asked, Push, WalkTask, Walked, walk};
use instep_robot::Robot;
use instep_sim::settings::WorldSettings;
use instep_walk::{Velocity, WalkSettings};

use crate::root;

fn walked(x: f64, duration: f64, pushes: Vec<Push>) -> Walked {
    let robot = Arc::new(Robot::load(&root("robots/artemis")).unwrap());
    let settings = WalkSettings::load(&robot).unwrap();
    let world = WorldSettings::default().as_built(&robot);
    let asked = Asked::Velocity(Velocity { x, y: 0.0, turn: 0.0 });
    walk(&robot, settings, &WalkTask { asked, duration, seed: 31, world, pushes }, |_| {}).unwrap()
}

/// The true velocity to the left at `time`.
fn sideways(walked: &Walked, time: f64) -> f64 {
    let at = walked.record.times.partition_point(|t| *t < time);
    walked.record.velocity[at][0][1]
}

#[test]
fn a_push_pushes() {
    // 10 N s on 37 kg.
    let push = Push { time: 0.3, duration: 0.1, force: [0.0, 100.0, 0.0] };
    let end = 0.4;
    let gained = sideways(&walked(0.0, 0.6, vec![push]), end) - sideways(&walked(0.0, 0.6, vec![]), end);
    assert!((0.08..0.35).contains(&gained), "{gained} m/s");
}

#[test]
fn what_is_said_of_a_walk_is_what_the_record_shows() {
    let walked = walked(0.5, 5.0, vec![]);
    let record = &walked.record;
    assert_eq!(walked.fell_at, None);
    let place = |time: f64| record.place[record.times.partition_point(|t| *t < time)][0];
    // The speed counts over the second half.
    let [from, to] = [place(2.5), place(5.0)];
    let speed = (to[0] - from[0]).hypot(to[1] - from[1]) / 2.5;
    assert!((walked.mean.x - speed).abs() < 0.03, "{} said, {speed} m/s", walked.mean.x);
    let error = (walked.mean.x - 0.5).hypot(walked.mean.y) / 0.5;
    assert!((walked.error - error).abs() < 0.01, "{} said, {error}", walked.error);
    let way: f64 = record.place.windows(2).map(|w| (w[1][0][0] - w[0][0][0]).hypot(w[1][0][1] - w[0][0][1])).sum();
    assert!((walked.distance / way - 1.0).abs() < 0.05, "{} said, {way} m", walked.distance);
    let squares = record.velocity.iter().map(|[v, e]| (v[0] - e[0]).powi(2) + (v[1] - e[1]).powi(2)).sum::<f64>();
    let rms = (squares / record.velocity.len() as f64).sqrt();
    assert!((walked.velocity_error / rms - 1.0).abs() < 0.1, "{} said, {rms} m/s", walked.velocity_error);
    let last = record.place.last().unwrap();
    let drift = (last[0][0] - last[1][0]).hypot(last[0][1] - last[1][1]) / way;
    assert!((walked.drift_share - drift).abs() < 0.2 * drift + 1e-3, "{} said, {drift}", walked.drift_share);
    assert!(walked.stop_time.is_some_and(|time| time > 0.1));
}
