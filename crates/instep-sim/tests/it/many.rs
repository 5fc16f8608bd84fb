//! Many robots in one world: each is what it would be alone, they meet, and goals hold the ball.

use std::sync::Arc;

use instep_field::{Field, Pose, Side};
use instep_robot::control::{JointCommand, Sensors};
use instep_sim::sensors::SensorSuite;
use instep_sim::settings::{Fidelity, WorldSettings};
use instep_sim::{BallState, Entrant, SimError, World};

use crate::robot;

fn field() -> Arc<Field> {
    Arc::new(Field::named("adult-2024").unwrap())
}

fn entrant(name: &str, team: Side, pose: Pose) -> Entrant {
    Entrant { robot: robot(name), team, pose }
}

fn as_built() -> WorldSettings {
    WorldSettings { drives: Fidelity::AsBuilt, senses: Fidelity::AsBuilt, ..WorldSettings::default() }
}

/// Commands that hold each robot's stand, the arms a little out, so that something moves.
fn hold(world: &World) -> Vec<JointCommand> {
    world
        .robots()
        .map(|view| {
            let mut command = JointCommand::zeros(view.robot().joints.len());
            command.positions.copy_from_slice(&view.robot().stand[7..]);
            for (position, joint) in command.positions.iter_mut().zip(&view.robot().joints) {
                if joint.name.contains("shoulder_pitch") || joint.name.contains("ShoulderPitch") {
                    *position -= 0.4;
                }
            }
            command
        })
        .collect()
}

const MIXED: [&str; 4] = ["artemis", "nao", "prestoe", "t1"];

fn mixed() -> World {
    let spot = |i: usize| Pose::new(-3.0 + 1.5 * i as f64, 1.0, 0.8 * i as f64);
    let entrants: Vec<Entrant> = MIXED
        .iter()
        .enumerate()
        .map(|(i, name)| entrant(name, if i < 2 { Side::Home } else { Side::Away }, spot(i)))
        .collect();
    World::on_field(field(), &entrants, &as_built()).unwrap()
}

/// The oracle is the world of one robot: whoever stands far from all others moves as if it were alone, whatever its model's
/// units of angle, defaults and names are.
#[test]
fn a_robot_among_others_moves_as_it_does_alone() {
    let mut together = mixed();
    let commands = hold(&together);
    for _ in 0..150 {
        together.advance_all(&commands, None).unwrap();
    }
    for (i, name) in MIXED.iter().enumerate() {
        let robot = robot(name);
        let mut alone = World::new(Arc::clone(&robot), &as_built()).unwrap();
        let far = BallState::at_rest([50.0, 0.0, 0.11]);
        alone.reset(together.on(i).start(), &vec![0.0; robot.nv()], &far).unwrap();
        for _ in 0..150 {
            alone.advance(&commands[i], None).unwrap();
        }
        let moved = alone.q().iter().zip(&robot.stand).skip(7).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved > 1e-3, "{name} has moved by {moved} rad");
        let apart = together.on(i).q().iter().zip(alone.q()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-8, "{name} is {apart} from where it would be alone");
        let torque =
            together.on(i).torques().iter().zip(alone.torques()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(torque < 1e-4, "{name}: {torque} N m");
    }
}

/// Each has its own noise, bias and zero: its senses are those of the robot alone with the same seed.
#[test]
fn a_robots_senses_are_its_own() {
    let mut together = mixed();
    let mut suites: Vec<SensorSuite> =
        (0..MIXED.len()).map(|i| SensorSuite::of(&mut together, i, 10 + i as u64)).collect();
    suites.iter_mut().for_each(|suite| suite.sense(&together));
    for (i, name) in MIXED.iter().enumerate() {
        let robot = robot(name);
        let mut alone = World::new(Arc::clone(&robot), &as_built()).unwrap();
        let mut suite = SensorSuite::new(&mut alone, 10 + i as u64);
        suite.sense(&alone);
        let (mut here, mut there) = (Sensors::default(), Sensors::default());
        suites[i].read_into(0.0, &mut here);
        suite.read_into(0.0, &mut there);
        assert_eq!(here.joint_positions, there.joint_positions, "{name}");
        assert_eq!((here.gyro, here.joint_positions.len()), (there.gyro, robot.joints.len()));
        // The yaw is relative to the start, wherever it looks.
        let turned = here.orientation.iter().zip(&there.orientation).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(turned < 1e-12, "{name}: {turned}");
        let force: f64 = here.contact_forces.iter().sum::<f64>() - there.contact_forces.iter().sum::<f64>();
        assert!(force.abs() < 1e-3, "{name}: {force} N");
    }
}

/// Pushed at each other, two robots touch and neither passes through the other; both are told of it.
#[test]
fn robots_meet() {
    let pose = |x, heading| Pose::new(x, 0.0, heading);
    let entrants = [
        entrant("artemis", Side::Home, pose(-0.4, 0.0)),
        entrant("artemis", Side::Away, pose(0.4, std::f64::consts::PI)),
    ];
    let mut world = World::on_field(field(), &entrants, &WorldSettings::default()).unwrap();
    world.place_ball(&BallState::at_rest([5.0, 3.0, 0.11]));
    let commands = hold(&world);
    assert_eq!(world.robots_touching().count(), 0);
    world.push_robot(0, [120.0, 0.0, 0.0]);
    world.push_robot(1, [-120.0, 0.0, 0.0]);
    let (mut met, mut nearest) = (0, f64::INFINITY);
    for _ in 0..400 {
        world.advance_all(&commands, None).unwrap();
        met += usize::from(world.robots_touching().any(|pair| pair == [0, 1]));
        let [a, b] = [0, 1].map(|i| world.on(i).q()[..3].to_vec());
        nearest = f64::min(nearest, (a[0] - b[0]).hypot(a[1] - b[1]));
    }
    assert!(met > 10 && nearest > 0.1, "{met} ticks in touch, {nearest} m apart");
    assert!(world.on(0).has_fallen() || world.on(1).has_fallen() || nearest < 0.5);
}

/// A shot under the bar stays in the net, whichever goal, place and speed; one at a post comes back; one beside goes past.
#[test]
fn goals_hold_what_goes_in() {
    let field = field();
    let entrants = [entrant("nao", Side::Home, Pose::new(0.0, 0.0, 0.0))];
    let mut world = World::on_field(Arc::clone(&field), &entrants, &WorldSettings::default()).unwrap();
    let commands = hold(&world);
    let shot = |world: &mut World, from: [f64; 3], velocity: [f64; 3], ticks: usize| {
        world.place_ball(&BallState { velocity, ..BallState::at_rest(from) });
        for _ in 0..ticks {
            world.advance_all(&commands, None).unwrap();
        }
        world.ball()
    };
    let (line, half, depth) = (0.5 * field.length, 0.5 * field.goal.width, field.goal.depth);
    for sign in [1.0, -1.0] {
        for (y, z, speed) in [(0.0, 0.11, 3.0), (1.0, 0.11, 12.0), (-0.8, 0.9, 12.0), (0.2, 1.4, 25.0)] {
            let ball = shot(&mut world, [sign * (line - 1.0), y, z], [sign * speed, 0.1 * y * speed, 0.0], 1500);
            let [x, y, z] = ball.position;
            assert!((line..line + depth).contains(&(sign * x)) && y.abs() < half, "{speed} m/s: {ball:?}");
            assert!(z < 0.2 && ball.velocity[0].abs() < 0.3, "{speed} m/s: {ball:?}");
        }
        let back = shot(&mut world, [sign * (line - 1.0), half, 0.11], [sign * 6.0, 0.0, 0.0], 300);
        assert!(sign * back.velocity[0] < -1.0, "{back:?}");
        let past = shot(&mut world, [sign * (line - 1.0), half + 0.6, 0.11], [sign * 6.0, 0.0, 0.0], 600);
        assert!(sign * past.position[0] > line + depth, "{past:?}");
        // From outside, the net is a wall too.
        let side = shot(&mut world, [sign * (line + 0.4), half + 1.0, 0.11], [0.0, -5.0, 0.0], 600);
        assert!(side.position[1] > half, "{side:?}");
    }
}

#[test]
fn who_cannot_stand_there_is_told_once() {
    let said =
        |entrants: &[Entrant]| World::on_field(field(), entrants, &WorldSettings::default()).unwrap_err().to_string();
    let at = |x, y| entrant("nao", Side::Home, Pose::new(x, y, 0.0));
    let outside = said(&[at(0.0, 0.0), at(8.5, 0.0)]);
    assert!(outside.starts_with("robot 1 (nao): x 8.500") && outside.contains("within 8 m"), "{outside}");
    assert!(said(&[at(f64::NAN, 0.0)]).starts_with("robot 0 (nao)"));
    let overlap = said(&[at(0.0, 0.0), at(1.0, 0.0), at(1.03, 0.02)]);
    assert!(overlap.starts_with("robot 2 (nao)") && overlap.contains("inside robot 1 (nao)"), "{overlap}");
    let post = said(&[at(7.0, 1.3)]);
    assert!(post.contains("inside a goal post"), "{post}");
    assert!(matches!(World::on_field(field(), &[], &WorldSettings::default()), Err(SimError::State { .. })));
    let mut world = World::on_field(field(), &[at(0.0, 0.0), at(1.0, 0.0)], &WorldSettings::default()).unwrap();
    let one = world.advance(&JointCommand::zeros(22), None).unwrap_err().to_string();
    assert!(one.contains("1 commands") && one.contains("2 robots"), "{one}");
}

/// Carried elsewhere by hand, a robot stands there, and nobody else has moved.
#[test]
fn a_robot_can_be_carried() {
    let mut world = mixed();
    let before = world.on(2).q().to_vec();
    let mut q = world.on(1).start().to_vec();
    (q[0], q[1]) = (2.0, -4.5);
    let still = vec![0.0; world.on(1).robot().nv()];
    world.place_robot(1, &q, &still).unwrap();
    assert_eq!(world.on(1).q(), q);
    assert_eq!(world.on(2).q(), before);
    assert!(world.place_robot(1, &q[1..], &still).is_err());
}
