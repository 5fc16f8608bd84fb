//! The gait on the robot's true state: what planner and whole-body controller can do without an estimator's help or harm.

use instep_walk::{Velocity, WalkSettings};

use crate::rig::{robot, walk, world};

#[test]
fn artemis_walks_ahead_and_turns() {
    let robot = robot("artemis");
    let settings = WalkSettings::of(&robot).unwrap();
    let height = settings.gait.height;
    let mut world = world(&robot);
    let asked = Velocity { x: 1.0, y: 0.0, turn: 0.3 };
    let walked = walk(
        &mut world,
        settings,
        9.0,
        |_| asked,
        |_| [0.0; 3],
        |_, gait, _| {
            assert_eq!(gait.counts().unsolved, 0);
        },
    );
    println!("{walked:?}");
    assert_eq!(walked.fell_at, None);
    assert!((walked.speed[0] - asked.x).abs() < 0.08 && walked.speed[1].abs() < 0.08, "{:?}", walked.speed);
    assert!((walked.speed[2] - asked.turn).abs() < 0.02, "{:?}", walked.speed);
    // The pendulum's one assumption.
    assert!(walked.height[0] > height - 0.02 && walked.height[1] < height + 0.03, "{:?}", walked.height);
}

#[test]
fn artemis_starts_stops_stands_and_walks_again() {
    let robot = robot("artemis");
    let mut world = world(&robot);
    let settings = WalkSettings::of(&robot).unwrap();
    let ahead = Velocity { x: 0.6, y: 0.0, turn: 0.0 };
    let asked = |time: f64| if (3.0..6.0).contains(&time) { Velocity::default() } else { ahead };
    let (mut stood, mut way) = (0.0, [0.0; 2]);
    let walked = walk(
        &mut world,
        settings,
        8.0,
        asked,
        |_| [0.0; 3],
        |time, gait, world| {
            if (4.5..6.0).contains(&time) {
                assert_eq!(gait.view().mode, instep_walk::gait::Mode::Stand, "at {time}");
                stood = world.v()[..6].iter().fold(stood, |most: f64, v| most.max(v.abs()));
            }
            if time < 6.0 {
                way[0] = world.q()[0];
            }
            way[1] = world.q()[0];
        },
    );
    assert_eq!(walked.fell_at, None);
    assert!(stood < 0.15, "moves at {stood} while it stands");
    assert!(way[0] > 1.0 && way[1] > way[0] + 0.2, "{way:?}");
}
