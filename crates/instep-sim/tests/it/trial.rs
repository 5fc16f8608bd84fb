//! The trial's measures against what is known beforehand, and the audit against impacts that are wrong on purpose.

use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_sim::BallState;
use instep_sim::audit::{Audit, Fault};
use instep_sim::impact::Impact;
use instep_sim::settings::{Step, WorldSettings};
use instep_sim::trial::{Trial, TrialSettings, run};

use crate::robot;

/// Holds one pose.
struct Hold(Vec<f64>);

impl Controller for Hold {
    fn tick(&mut self, _: &Sensors, command: &mut JointCommand) {
        command.positions.copy_from_slice(&self.0);
    }
}

/// A ball at `speed` m/s against the front of the robot's standing right foot, or nothing where it is zero.
fn trial(speed: f64, world: WorldSettings) -> Trial {
    let robot = robot("prestoe");
    let ball = BallState { velocity: [-speed, 0.0, 0.0], ..BallState::at_rest([0.35, -0.085, 0.11]) };
    let settings = TrialSettings {
        world,
        seed: 1,
        duration: 1.0,
        control_period: 0.002,
        q: robot.stand.clone(),
        v: vec![0.0; robot.nv()],
        ball,
        direction: 0.0,
    };
    run(&robot, &settings, &mut Hold(robot.stand[7..].to_vec())).unwrap()
}

#[test]
fn a_ball_that_is_not_touched_is_no_kick() {
    let trial = trial(0.0, WorldSettings::default());
    assert_eq!(trial.audit.faults, [Fault::NoImpact]);
    assert!(trial.impact.is_none() && trial.direction_error.is_none() && trial.upright());
}

/// The ball bounces off the toe of a standing foot, which meets it below its middle: upward, slower, and with less than
/// the law's restitution, since the toe gives way.
#[test]
fn a_ball_thrown_at_a_foot_bounces_off_it() {
    let trial = trial(4.0, WorldSettings::default());
    let impact = trial.impact.as_ref().expect("the foot is in its way");
    assert!(trial.audit.faults.is_empty(), "{:?}", trial.audit);
    assert!(impact.ball_velocity[0] > -3.5 && impact.ball_velocity[2] > 0.5, "{impact:?}");
    assert!(impact.ball_speed() < 4.0 && (0.1..0.75).contains(&impact.restitution), "{impact:?}");
    assert!(impact.link.starts_with("right"), "{}", impact.link);
    assert!(impact.effective_mass > 0.1 && impact.effective_mass < 30.0);
    // Energy is lost, and about as much as restitution says: never gained.
    assert!(trial.audit.energy_gain.unwrap() < 0.0);
}

/// With far steps only and a stiff contact, MuJoCo invents ball speed; the audit must not let that pass.
#[test]
fn an_impact_in_coarse_steps_is_invalid() {
    let mut world = WorldSettings::default();
    world.impact.contact_time = 0.003;
    world.step = Step { far: 0.002, near: 0.002, ..Step::default() };
    let invalid = (0..6).filter(|i| !trial(3.0 + f64::from(*i), world).audit.faults.is_empty()).count();
    assert!(invalid >= 4, "{invalid} of 6 were found out");
}

fn good_impact() -> Impact {
    Impact {
        time: 0.1,
        duration: 0.009,
        link: "right_foot".into(),
        point: [0.0; 3],
        normal: [1.0, 0.0, 0.0],
        foot_speed: 9.0,
        foot_speed_normal: 9.0,
        effective_mass: 1.2,
        restitution: 0.68,
        ball_velocity: [10.0, 0.0, 1.0],
        kinetic_before: 120.0,
        kinetic_after: 118.0,
        motor_work: 3.0,
        gravity_work: 0.1,
        touches: 1,
    }
}

#[test]
fn each_test_of_the_audit_finds_its_fault() {
    let good = good_impact();
    assert!(Audit::new(Some(&good), Some(&good), true).faults.is_empty());
    assert!(matches!(Audit::new(Some(&good), Some(&good), false).faults[..], [Fault::Unfinished]));

    let more_energy = Impact { kinetic_after: 125.0, ..good.clone() };
    assert!(matches!(Audit::new(Some(&more_energy), Some(&good), true).faults[..], [Fault::Energy { .. }]));

    let bouncy = Impact { restitution: 0.86, ..good.clone() };
    assert!(matches!(Audit::new(Some(&bouncy), Some(&good), true).faults[..], [Fault::Restitution { .. }]));
    let no_number = Impact { restitution: f64::NAN, ..good.clone() };
    assert!(matches!(Audit::new(Some(&no_number), Some(&good), true).faults[..], [Fault::Restitution { .. }]));

    let slower = Impact { ball_velocity: [9.7, 0.0, 1.0], ..good.clone() };
    assert!(matches!(Audit::new(Some(&good), Some(&slower), true).faults[..], [Fault::StepSize { .. }]));
    assert!(matches!(Audit::new(Some(&good), None, true).faults[..], [Fault::StepSize { .. }]));
}
