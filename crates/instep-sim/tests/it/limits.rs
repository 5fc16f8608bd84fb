//! Torque and speed limits live in the world, whatever a controller asks for.

use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_sim::settings::{Fidelity, Step, WorldSettings};
use instep_sim::trial::{TrialSettings, run};
use instep_sim::{BallState, World};

use crate::robot;

/// Asks for far more than any motor has.
struct Greedy;

impl Controller for Greedy {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        let sign = if (sensors.time * 5.0) as i64 % 2 == 0 { 1.0 } else { -1.0 };
        command.torques.fill(sign * 1e5);
    }
}

/// Holds one pose.
struct Hold(Vec<f64>);

impl Controller for Hold {
    fn tick(&mut self, _: &Sensors, command: &mut JointCommand) {
        command.positions.copy_from_slice(&self.0);
    }
}

#[test]
fn a_greedy_controller_gets_no_more_than_the_motors_have() {
    let robot = robot("prestoe");
    let mut q = robot.stand.clone();
    q[2] += 2.0;
    // A tick of one step: every torque is recorded beside the speed at which it was given.
    let step = Step { tick: 0.001, far: 0.001, ..Step::default() };
    let settings = TrialSettings {
        world: WorldSettings { step, ..WorldSettings::default() },
        seed: 1,
        duration: 0.6,
        control_period: 0.002,
        v: vec![0.0; robot.nv()],
        q,
        ball: BallState::at_rest([5.0, 0.0, 0.11]),
        direction: 0.0,
    };
    let trial = run(&robot, &settings, &mut Greedy, &mut Greedy).unwrap();
    for group in &trial.groups {
        assert!(group.torque <= group.torque_limit * (1.0 + 1e-12), "{group:?}");
    }
    // No motor pushes on at or beyond its speed limit.
    let record = &trial.record;
    let mut fast = 0;
    for i in 1..record.len() {
        let (before, torques) = (record.row(&record.v, i - 1), record.row(&record.torques, i));
        for (j, joint) in robot.joints.iter().enumerate() {
            if before[6 + j].abs() >= joint.speed {
                fast += 1;
                assert!(torques[j] * before[6 + j] <= 0.0, "{} at {} rad/s", joint.name, before[6 + j]);
            }
        }
    }
    assert!(fast > 10, "the controller drove joints to their speed limits {fast} times");
    let torque_violations = trial.limit_violations.iter().filter(|v| v.quantity == "torque").count();
    assert_eq!(torque_violations, 0, "{:?}", trial.limit_violations);
    // It did try: the hips reached their torque limit.
    assert!(trial.groups.iter().any(|g| g.group == "hip" && g.torque > 0.99 * g.torque_limit));
}

#[test]
fn a_standing_robot_stands_and_its_weight_is_on_its_soles() {
    for name in ["prestoe"] {
        let robot = robot(name);
        let mut world = World::new(robot.clone(), &WorldSettings::default()).unwrap();
        let mut command = JointCommand::zeros(robot.joints.len());
        command.positions.copy_from_slice(&robot.stand[7..]);
        let mut forces = vec![nalgebra::Vector3::zeros(); robot.contacts.len()];
        let mut mean = 0.0;
        for step in 0..1500 {
            world.advance(&command, None).unwrap();
            if step >= 1000 {
                world.contact_forces_into(&mut forces);
                mean += forces.iter().map(|f| f.z).sum::<f64>() / 500.0;
            }
        }
        assert!(world.q()[2] > 0.9 * robot.stand[2], "{name} has fallen to {} m", world.q()[2]);
        assert!((mean / (9.81 * robot.mass()) - 1.0).abs() < 0.01, "{name} carries {mean} N");
    }
}

/// What the world lets through of a feed-forward torque on an elbow of a robot that falls freely, N m, and when, s.
fn nudged(name: &str, drives: Fidelity) -> Option<(f64, f64)> {
    let robot = robot(name);
    let mut q = robot.stand.clone();
    q[2] += 2.0;
    let joint = robot.joints.iter().position(|joint| joint.name.contains("lbow")).unwrap();
    let mut world = World::new(robot.clone(), &WorldSettings { drives, ..WorldSettings::default() }).unwrap();
    world.reset(&q, &vec![0.0; robot.nv()], &BallState::at_rest([5.0, 0.0, 0.11])).unwrap();
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&q[7..]);
    for step in 0..30 {
        // The first command counts as long under way; this one is new.
        command.torques[joint] = if step == 0 { 0.0 } else { 0.5 };
        let time = world.time();
        world.advance(&command, None).unwrap();
        if world.torques()[joint] > 0.25 {
            return Some((world.torques()[joint], time));
        }
    }
    None
}

#[test]
fn feed_forward_reaches_a_torque_drive_late_and_a_position_servo_never() {
    let (_, ideal) = nudged("prestoe", Fidelity::Ideal).unwrap();
    let (torque, late) = nudged("prestoe", Fidelity::AsBuilt).unwrap();
    assert!((0.25..0.6).contains(&torque), "{torque} N m");
    // One far step, then a delay of 1 ms in steps of 2 ms, and the play.
    assert!((ideal - 0.002).abs() < 1e-9 && (0.004..=0.012).contains(&late), "{ideal} {late}");
    assert_eq!(nudged("nao", Fidelity::AsBuilt), None);
    assert_eq!(nudged("wolfgang", Fidelity::AsBuilt), None);
}

/// What is left after 20 ms of an elbow's 2 rad/s, rad/s, with a drive that does nothing, for a dry (N m) and a viscous (N m s/rad)
/// friction.
fn coasting(dry: f64, viscous: f64) -> f64 {
    let mut robot = (*robot("prestoe")).clone();
    let elbow = robot.joints.iter().position(|joint| joint.name.contains("lbow")).unwrap();
    let joint = &mut robot.joints[elbow];
    (joint.kp, joint.kd, joint.static_friction, joint.viscous_friction) = (0.0, 0.0, dry, viscous);
    let (mut q, mut v) = (robot.stand.clone(), vec![0.0; robot.nv()]);
    q[2] += 2.0;
    v[6 + elbow] = 2.0;
    let settings = WorldSettings { drives: Fidelity::AsBuilt, ..WorldSettings::default() };
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&q[7..]);
    let mut world = World::new(robot.into(), &settings).unwrap();
    world.reset(&q, &v, &BallState::at_rest([5.0, 0.0, 0.11])).unwrap();
    while world.time() < 0.0199 {
        world.advance(&command, None).unwrap();
    }
    world.v()[6 + elbow]
}

#[test]
fn joints_have_dry_and_viscous_friction() {
    let (free, dry, viscous) = (coasting(0.0, 0.0), coasting(0.3, 0.0), coasting(0.0, 0.15));
    // 0.3 N m either way at 2 rad/s; the viscous one wanes with the speed.
    assert!(dry < free - 0.1 && viscous < free - 0.1, "{free}, {dry}, {viscous} rad/s");
    assert!(viscous > dry, "{dry}, {viscous} rad/s");
}

/// Something outside drives a joint past its speed limit: the trial says which, how far and when.
#[test]
fn a_joint_beyond_its_speed_limit_is_reported() {
    let robot = robot("prestoe");
    let mut q = robot.stand.clone();
    q[2] += 2.0;
    let joint = robot.joints.iter().position(|joint| joint.name == "left_elbow").unwrap();
    let run_at = |share: f64| {
        let mut v = vec![0.0; robot.nv()];
        v[6 + joint] = -share * robot.joints[joint].speed;
        let settings = TrialSettings {
            world: WorldSettings::default(),
            seed: 1,
            duration: 0.02,
            control_period: 0.002,
            q: q.clone(),
            v,
            ball: BallState::at_rest([5.0, 0.0, 0.11]),
            direction: 0.0,
        };
        let hold = || Hold(q[7..].to_vec());
        run(&robot, &settings, &mut hold(), &mut hold()).unwrap().limit_violations
    };
    let beyond = run_at(1.1);
    let [violation] = &beyond[..] else { panic!("{beyond:?}") };
    assert_eq!((violation.joint.as_str(), violation.quantity), ("left_elbow", "speed"));
    assert_eq!(violation.limit, robot.joints[joint].speed);
    assert!((violation.peak / violation.limit - 1.1).abs() < 1e-9 && violation.time < 0.004, "{violation:?}");
    assert_eq!(run_at(0.98), []);
}

/// The robot in the world may weigh more than its model says; its soles then carry more.
#[test]
fn an_error_of_the_masses_is_in_the_world() {
    let robot = robot("prestoe");
    let carried = |mass: f64| {
        let mut settings = WorldSettings::default();
        settings.model_error.mass = mass;
        let mut world = World::new(robot.clone(), &settings).unwrap();
        let mut command = JointCommand::zeros(robot.joints.len());
        command.positions.copy_from_slice(&robot.stand[7..]);
        let mut forces = vec![nalgebra::Vector3::zeros(); robot.contacts.len()];
        let mut mean = 0.0;
        for step in 0..400 {
            world.advance(&command, None).unwrap();
            if step >= 200 {
                world.contact_forces_into(&mut forces);
                mean += forces.iter().map(|f| f.z).sum::<f64>() / 200.0;
            }
        }
        mean / (9.81 * robot.mass())
    };
    assert!((carried(1.1) / carried(1.0) - 1.1).abs() < 0.02, "{} {}", carried(1.0), carried(1.1));
}
