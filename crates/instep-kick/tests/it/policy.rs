//! The policy engine's parts against the simulator: where the base is believed to be, what is seen, what is commanded.

use std::path::Path;
use std::sync::Arc;

use instep_kick::Playback;
use instep_kick::policy::odometry::Odometry;
use instep_kick::policy::{Activation, Follower, FollowerSettings, Layer, Network, Normalizer, Policy, PolicyHeader};
use instep_kick::track::{Track, TrackState};
use instep_motion::reference::Reference;
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_sim::sensors::SensorSuite;
use instep_sim::settings::WorldSettings;
use instep_sim::{BallState, World};
use nalgebra::Vector3;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

pub(crate) fn prestoe() -> (Arc<Robot>, Arc<Reference>) {
    let robot = Robot::load(&root().join("robots/prestoe")).unwrap();
    let reference = Reference::load(&root().join("references/prestoe/10_03_kinodynamic.json")).unwrap();
    (Arc::new(robot), Arc::new(reference))
}

#[test]
fn odometry_follows_a_kick_through_its_impact_within_three_centimetres() {
    let (robot, reference) = prestoe();
    let start = reference.phases.t_plant;
    let mut playback = Playback::new(&robot, Arc::clone(&reference), start).unwrap();
    let (q, v) = playback.initial_state();
    let settings = WorldSettings::default();
    let mut world = World::new(Arc::clone(&robot), &settings).unwrap();
    world.reset(&q, &v, &BallState::at_rest(reference.ball)).unwrap();
    let mut suite = SensorSuite::new(&mut world, 1);
    suite.sense(&world);
    let mut sensors = Sensors::default();
    let mut command = JointCommand::zeros(robot.joints.len());
    let mut odometry = Odometry::new(&robot);
    odometry.start(0.0, Vector3::new(q[0], q[1], q[2]), Vector3::new(v[0], v[1], v[2]));
    let (mut place, mut speed) = (0.0f64, 0.0f64);
    for _ in 0..500 {
        suite.read_into(world.time(), &mut sensors);
        odometry.update(&sensors);
        let truth = Vector3::from_column_slice(&world.q()[..3]);
        place = place.max((odometry.position() - truth).norm());
        speed = speed.max((odometry.velocity() - Vector3::from_column_slice(&world.v()[..3])).norm());
        playback.tick(&sensors, &mut command);
        world.advance(&command, None).unwrap();
        suite.sense(&world);
    }
    assert!(place < 0.03, "the base was believed to be up to {place:.3} m away from where it was");
    assert!(speed < 0.5, "its velocity was wrong by up to {speed:.3} m/s");
}

#[test]
fn standing_feet_take_a_wrong_start_out_of_the_odometry() {
    let (robot, _) = prestoe();
    let mut world = World::new(Arc::clone(&robot), &WorldSettings::default()).unwrap();
    let mut suite = SensorSuite::new(&mut world, 1);
    let mut sensors = Sensors::default();
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&robot.stand[7..]);
    let mut odometry = Odometry::new(&robot);
    let wrong = Vector3::new(0.3, -0.2, 0.1);
    odometry.start(0.0, Vector3::from_column_slice(&robot.stand[..3]) + Vector3::z() * 0.05, wrong);
    for _ in 0..150 {
        suite.sense(&world);
        suite.read_into(world.time(), &mut sensors);
        odometry.update(&sensors);
        world.advance(&command, None).unwrap();
    }
    let speed = odometry.velocity() - Vector3::from_column_slice(&world.v()[..3]);
    assert!(speed.norm() < 0.02, "after 0.3 s the velocity is still wrong by {speed:?}");
    let height = odometry.position().z - world.q()[2];
    assert!(height.abs() < 0.005, "and the height by {height}");
}

#[test]
fn behind_its_window_a_track_stands_still_in_the_last_pose() {
    let (robot, reference) = prestoe();
    let mut track = Track::new(&robot, reference, [0.9, 1.0]).unwrap();
    let (mut end, mut later) = (TrackState::default(), TrackState::default());
    track.sample_into(0.1 - 1e-9, &mut end);
    track.sample_into(0.7, &mut later);
    let apart = end.q.iter().zip(&later.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-6, "{apart}");
    assert!(end.v.iter().any(|v| v.abs() > 1.0) && later.v.iter().all(|&v| v == 0.0));
}

fn follower(robot: &Robot, reference: &Arc<Reference>) -> Follower {
    let track = Track::new(robot, Arc::clone(reference), [0.15, 2.4]).unwrap();
    Follower::new(robot, track, FollowerSettings::default())
}

#[test]
fn on_the_reference_every_error_is_zero_and_the_command_is_the_reference() {
    let (robot, reference) = prestoe();
    let mut follower = follower(&robot, &reference);
    let mut track = follower.track().clone();
    let mut state = TrackState::default();
    track.sample_into(0.5, &mut state);
    let mut world = World::new(Arc::clone(&robot), &WorldSettings::default()).unwrap();
    world.reset(&state.q, &state.v, &BallState::at_rest(reference.ball)).unwrap();
    let mut suite = SensorSuite::new(&mut world, 1);
    suite.sense(&world);
    let mut sensors = Sensors::default();
    suite.read_into(0.0, &mut sensors);
    let position = Vector3::new(state.q[0], state.q[1], state.q[2]);
    let velocity = Vector3::new(state.v[0], state.v[1], state.v[2]);
    follower.start(0.0, 0.5, position, velocity);
    follower.sense(&sensors);
    let mut seen = vec![f32::NAN; follower.observation_len()];
    follower.observe(&sensors, &mut seen);
    assert!(seen.iter().all(|x| x.is_finite()));
    let n = robot.joints.len();
    for (i, x) in seen[..2 * n + 6].iter().enumerate() {
        assert!(x.abs() < 1e-5, "error {i} is {x}");
    }
    let place = &seen[2 * n + 9..2 * n + 15];
    assert!(place.iter().all(|x| x.abs() < 1e-2), "{place:?}");
    let ball = &seen[2 * n + 17..2 * n + 19];
    assert!(ball.iter().all(|x| x.abs() < 1e-2), "{ball:?}");

    let mut command = JointCommand::zeros(n);
    follower.command(0.0, &mut command);
    assert_eq!(command.positions, state.q[7..]);
    let mut action = vec![0.0; n];
    action[3] = 1.0;
    follower.act(&action);
    follower.command(0.0, &mut command);
    let joint = &robot.joints[3];
    let shift = (command.positions[3] - state.q[10]) * joint.kp;
    assert!((shift - 0.25 * joint.torque).abs() < 1e-9, "{shift}");
}

pub(crate) fn policy(robot: &Robot, reference: &Arc<Reference>) -> Policy {
    let follower = follower(robot, reference);
    let (inputs, outputs) = (follower.observation_len(), follower.action_len());
    let layer = Layer { weight: vec![0.01; inputs * outputs], bias: vec![0.1; outputs] };
    let normalizer = Normalizer { mean: vec![0.0; inputs], deviation: vec![1.0; inputs] };
    Policy {
        header: PolicyHeader {
            format: PolicyHeader::FORMAT,
            robot: robot.name.clone(),
            reference: "10_03_kinodynamic.json".into(),
            window: [0.15, 2.4],
            follower: FollowerSettings::default(),
            activation: Activation::Relu,
            steps: 0,
        },
        reference: Arc::clone(reference),
        network: Network::new(normalizer, vec![layer], Activation::Relu),
    }
}

#[test]
fn a_policy_comes_back_from_its_file_and_every_broken_file_is_refused() {
    let (robot, reference) = prestoe();
    let policy = policy(&robot, &reference);
    let bytes = policy.to_bytes().unwrap();
    let back = Policy::from_bytes(&bytes).unwrap();
    assert_eq!((&back.header, &back.network, &back.reference), (&policy.header, &policy.network, &policy.reference));
    assert_eq!(back.to_bytes().unwrap(), bytes);

    for end in [0, 1, 8, 100, bytes.len() / 2, bytes.len() - 1] {
        assert!(Policy::from_bytes(&bytes[..end]).is_err());
    }
    let mut sick = policy.clone();
    sick.network.layers[0].bias[0] = f32::NAN;
    assert!(sick.to_bytes().unwrap_err().contains("not finite"));
}

#[test]
fn a_policy_of_another_robot_or_shape_is_refused() {
    let (robot, reference) = prestoe();
    let nao = Robot::load(&root().join("robots/nao")).unwrap();
    let mut policy = policy(&robot, &reference);
    let error = policy.follower(&nao).unwrap_err().to_string();
    assert!(error.contains("prestoe") && error.contains("nao"), "{error}");
    policy.header.follower.horizons.pop();
    let error = policy.follower(&robot).unwrap_err().to_string();
    assert!(error.contains("inputs") && error.contains("expected"), "{error}");
}
