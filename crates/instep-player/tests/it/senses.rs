//! Senses that are bad, late or missing: the player goes on, or stands down; it never gives a command that is no number.

use instep_behaviour::{Action, BallState, GameState, Mate, PlayState, Role};
use instep_field::Pose;
use instep_localisation::Start;
use instep_player::legs::Stage;
use instep_player::{BallSight, Fix, HeardBall, Message, Output, Player, RobotSight, Senses, Sights};
use proptest::prelude::*;

use crate::support::{artemis, player, player_of, robot, standing, standing_of};

fn is_finite(output: &Output) -> bool {
    let command = &output.command;
    command.positions.iter().chain(&command.velocities).chain(&command.torques).all(|x| x.is_finite())
}

fn seen(time: f64, ball: [f64; 2]) -> Senses {
    let mut senses = standing(time);
    let ball = Some(BallSight { position: ball, height: 0.11, std: 0.05 });
    senses.sights = Some(Sights { time, ball, ..Sights::default() });
    senses
}

fn run(player: &mut Player, from: f64, to: f64, mut senses: impl FnMut(f64) -> Senses) {
    let steps = ((to - from) / 0.01).round() as usize;
    for i in 0..steps {
        let output = player.tick(&senses(from + 0.01 * i as f64));
        assert!(is_finite(output));
    }
}

#[test]
fn without_sights_it_searches_and_looks_round() {
    let mut player = player(Pose::new(-2.0, 0.0, 0.0));
    let head = robot().joint_index("AAHead_yaw").unwrap();
    let mut widest = 0.0_f64;
    for i in 0..300 {
        let output = player.tick(&standing(0.01 * f64::from(i)));
        widest = widest.max(output.command.positions[head].abs());
    }
    assert_eq!(player.decision().unwrap().action, Action::Search);
    assert!(widest > 1.0, "the head turned by {widest} rad only");
}

#[test]
fn a_ball_that_is_seen_is_walked_to_and_stays_where_it_lies_on_the_field() {
    let mut player = player(Pose::new(-2.0, 1.0, 0.5));
    run(&mut player, 0.0, 2.0, |time| seen(time, [1.5, 0.0]));
    let ball = player.beliefs().ball;
    let wanted = Pose::new(-2.0, 1.0, 0.5).outer_from_local([1.5, 0.0]);
    assert_eq!(ball.state, BallState::InView);
    assert!((ball.position[0] - wanted[0]).hypot(ball.position[1] - wanted[1]) < 0.3, "{ball:?}");
    assert_eq!(player.decision().unwrap().action, Action::Approach);
    assert!(player.record().velocity[0] > 0.1, "{:?}", player.record());
}

#[test]
fn a_kick_begins_on_its_line_and_not_into_somebody_beside_the_ball() {
    let begins = |others: &[[f64; 2]]| {
        let robot = artemis();
        let mut player = player_of(artemis(), Pose::new(1.0, 0.0, 0.0));
        let robots =
            others.iter().map(|&position| RobotSight { position, mate: Some(false), number: None, fallen: false });
        let ball = Some(BallSight { position: [1.5, 0.0], height: 0.11, std: 0.02 });
        let sights = Sights { ball, robots: robots.collect(), ..Sights::default() };
        (0..100).any(|i| {
            let time = 0.01 * f64::from(i);
            let sights = Some(Sights { time, ..sights.clone() });
            player.tick(&Senses { sights, ..standing_of(&robot, time) });
            player.legs().stage() == Stage::RunUp
        })
    };
    assert!(begins(&[]));
    // Far enough beside the ball's way to the goal, but not beside the body's: another line is wanted, to which it walks first.
    assert!(!begins(&[[2.05, 0.45]]));
    assert!(begins(&[[2.05, 1.2]]), "farther off nobody is in the way");
}

#[test]
fn outside_the_game_it_stands() {
    let mut player = player(Pose::new(-2.0, 0.0, 0.0));
    for state in [PlayState::Initial, PlayState::Set, PlayState::Finished] {
        let mut last = 0.0;
        run(&mut player, 10.0 * f64::from(state as u8 + 1), 10.0 * f64::from(state as u8 + 1) + 1.0, |time| {
            last = time;
            Senses { game: GameState { state, ..GameState::default() }, ..seen(time, [1.0, 0.0]) }
        });
        assert_eq!(player.decision().unwrap().action, Action::Stand);
        assert_eq!(player.record().velocity, [0.0; 3]);
    }
}

#[test]
fn a_fix_of_the_league_is_where_it_is() {
    let mut player = player(Pose::new(-2.0, 0.0, 0.0));
    let fix = Pose::new(-5.0, 3.0, 1.0);
    run(&mut player, 0.0, 1.0, |time| Senses {
        fix: Some(Fix { time, pose: fix, std: [0.01, 0.01] }),
        ..seen(time, [1.0, 0.0])
    });
    assert!(player.place().pose().distance(&fix) < 0.1);
    // Without it the landmarks' pose counts again, which knows nothing of it.
    run(&mut player, 1.0, 3.0, |time| seen(time, [1.0, 0.0]));
    assert!(player.place().pose().distance(&Pose::new(-2.0, 0.0, 0.0)) < 0.3, "{:?}", player.place().pose());
}

#[test]
fn a_camera_that_stops_makes_the_ball_a_memory_and_then_lost() {
    let mut player = player(Pose::new(-2.0, 0.0, 0.0));
    run(&mut player, 0.0, 1.0, |time| seen(time, [2.0, 0.0]));
    run(&mut player, 1.0, 4.0, standing);
    assert_eq!(player.beliefs().ball.state, BallState::Remembered);
    run(&mut player, 4.0, 20.0, standing);
    assert_eq!(player.beliefs().ball.state, BallState::Lost);
}

#[test]
fn mates_are_heard_and_forgotten_and_their_ball_is_taken() {
    let mut player = player(Pose::new(-2.0, 0.0, 0.0));
    let mate = Mate {
        number: 3,
        pose: Pose::new(1.0, 1.0, 0.0),
        role: Role::Striker,
        time_to_ball: 0.1,
        able: true,
        penalised: false,
    };
    let ball = Some(HeardBall { position: [1.5, 1.0], velocity: [0.0; 2], age: 0.1 });
    run(&mut player, 0.0, 1.0, |time| {
        let mut senses = standing(time);
        senses.heard.push(Message { mate, ball });
        // What is no number, and what is said in one's own name, does not count.
        senses.heard.push(Message { mate: Mate { number: 4, time_to_ball: f64::NAN, ..mate }, ball });
        senses.heard.push(Message { mate: Mate { number: 2, ..mate }, ball });
        senses
    });
    assert_eq!(player.beliefs().mates.len(), 1);
    assert_eq!(player.beliefs().ball.position, [1.5, 1.0]);
    assert_ne!(player.decision().unwrap().role, Role::Striker);
    run(&mut player, 1.0, 7.0, standing);
    assert!(player.beliefs().mates.is_empty());
    assert_eq!(player.decision().unwrap().role, Role::Striker);
}

#[test]
fn it_speaks_twice_a_second() {
    let mut player = player(Pose::new(-2.0, 0.0, 0.0));
    let said = (0..1000).filter(|i| player.tick(&seen(0.01 * f64::from(*i), [1.0, 0.0])).say.is_some()).count();
    assert_eq!(said, 20);
}

#[test]
fn bad_senses_are_repeated_over_and_then_it_stands_down_until_they_are_good() {
    let mut player = player(Pose::new(-2.0, 0.0, 0.0));
    run(&mut player, 0.0, 1.0, |time| seen(time, [2.0, 0.0]));
    let before = player.tick(&seen(1.0, [2.0, 0.0])).clone();
    let mut bad = standing(1.01);
    bad.body.joint_positions[3] = f64::NAN;
    let after = player.tick(&bad).clone();
    assert_eq!(before.command, after.command);
    for _ in 0..20 {
        player.tick(&bad);
    }
    let output = player.tick(&bad);
    assert!(output.command.torques.iter().chain(&output.command.velocities).all(|x| *x == 0.0));
    assert_eq!(player.legs().stage(), Stage::Safe);
    run(&mut player, 1.5, 2.0, |time| seen(time, [2.0, 0.0]));
    assert_ne!(player.legs().stage(), Stage::Safe);
    assert!(player.place().pose().distance(&Pose::new(-2.0, 0.0, 0.0)) < 0.6);
}

#[test]
fn on_the_ground_the_joints_rest_where_they_are_and_it_walks_again_once_it_was_put_up() {
    let mut player = player(Pose::new(-2.0, 0.0, 0.0));
    run(&mut player, 0.0, 1.0, |time| seen(time, [2.0, 0.0]));
    let lying = |time: f64| {
        let mut senses = standing(time);
        senses.body.orientation = [0.6, 0.0, 0.8, 0.0];
        senses
    };
    run(&mut player, 1.0, 2.0, lying);
    assert_eq!((player.legs().stage(), player.legs().falls()), (Stage::Down, 1));
    assert_eq!(player.decision().unwrap().action, Action::GetUp);
    let output = player.tick(&lying(2.0));
    assert!(output.command.torques.iter().all(|x| *x == 0.0));
    run(&mut player, 2.1, 5.0, |time| seen(time, [2.0, 0.0]));
    assert_ne!(player.legs().stage(), Stage::Down);
}

#[test]
fn a_player_that_was_put_somewhere_is_there() {
    let mut player = player(Pose::new(-2.0, 0.0, 0.0));
    run(&mut player, 0.0, 1.0, standing);
    let pose = Pose::new(-4.0, -2.0, 1.0);
    player.restart(Start::Near { pose, position_sigma: 0.05, heading_sigma: 0.02 });
    run(&mut player, 1.0, 1.5, standing);
    assert!(player.place().pose().distance(&pose) < 0.05);
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -3.0..3.0_f64,
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(-1e300),
        1 => Just(1e-300)
    ]
}

fn place() -> impl Strategy<Value = [f64; 2]> {
    [number(), number()]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn whatever_is_sensed_the_command_is_a_number(
        ticks in prop::collection::vec(
            (number(), number(), place(), place(), 0_usize..23, number(), prop::option::of(place()), any::<bool>()), 1..60
        )
    ) {
        let mut player = player(Pose::new(-2.0, 0.0, 0.0));
        let mut time = 0.0;
        for (step, joint, ball, robot, index, other, fix, short) in ticks {
            time += 0.005 + if step.abs() < 1e-3 { step } else { 0.005 };
            let mut senses = seen(if step > 2.5 { step } else { time }, ball);
            senses.body.joint_positions[index] += if joint.abs() < 3.0 { 0.05 * joint } else { joint };
            senses.body.gyro[index % 3] = other;
            if let Some(sights) = &mut senses.sights {
                sights.time = if other > 2.0 { other } else { time };
                sights.gaze_yaw = joint;
                sights.robots.push(RobotSight { position: robot, mate: None, number: None, fallen: short });
                sights.robots.push(RobotSight { position: robot, mate: Some(true), number: None, fallen: short });
            }
            senses.fix = fix.map(|[x, y]| Fix { time: other, pose: Pose { x, y, heading: joint }, std: [other, joint] });
            if short && index == 7 {
                senses.body.joint_velocities.pop();
            }
            prop_assert!(is_finite(player.tick(&senses)));
        }
    }
}
