//! The trial's measures against what is known beforehand, and the audit against impacts that are wrong on purpose.

use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_sim::audit::{Audit, Evidence, Fault, Outcome};
use instep_sim::impact::Impact;
use instep_sim::settings::{Step, WorldSettings};
use instep_sim::trial::{Disturbance, Trial, TrialSettings, run, run_disturbed};
use instep_sim::{BallState, World};

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
    let hold = || Hold(robot.stand[7..].to_vec());
    run(&robot, &settings, &mut hold(), &mut hold()).unwrap()
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
    assert!(trial.ball_speed.unwrap() < 4.0 && (0.1..0.75).contains(&impact.restitution), "{impact:?}");
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

fn good_touch() -> Impact {
    Impact {
        time: 0.1,
        duration: 0.009,
        link: "right_foot".into(),
        point: [0.0; 3],
        normal: [1.0, 0.0, 0.0],
        impulse: 4.3,
        depth: 0.03,
        foot_speed: 9.0,
        foot_speed_normal: 9.0,
        approach: 9.0,
        effective_mass: 1.2,
        restitution: 0.68,
        ball_velocity: [10.0, 0.0, 1.0],
        kinetic_before: 120.0,
        kinetic_after: 118.0,
        motor_work: 3.0,
        push_work: 0.0,
        gravity_work: 0.1,
    }
}

const GOOD: Outcome = Outcome { ball_speed: Some(10.0), direction_error: Some(0.02), upright: true };

/// The audit of a kick with these touches and this re-run.
fn audit(touches: &[Impact], rerun: Option<Outcome>) -> Audit {
    let rerun = rerun.map(|outcome| (outcome, Step::default().finer(4.0)));
    let audit = Audit::new(&Evidence { touches, finished: true, ball_radius: 0.11, outcome: GOOD, rerun });
    assert_eq!(audit.is_valid(), audit.faults.is_empty());
    audit
}

/// Its faults.
fn faults(touches: &[Impact], rerun: Option<Outcome>) -> Vec<Fault> {
    audit(touches, rerun).faults
}

#[test]
fn each_test_of_the_audit_finds_its_fault() {
    let good = good_touch();
    assert_eq!(faults(&[good_touch()], Some(GOOD)), []);
    let unfinished = Evidence {
        touches: &[good_touch()],
        finished: false,
        ball_radius: 0.11,
        outcome: GOOD,
        rerun: Some((GOOD, Step::default())),
    };
    assert!(matches!(Audit::new(&unfinished).faults[..], [Fault::Unfinished]));

    let fault = |change: fn(&mut Impact)| {
        let mut touch = good_touch();
        change(&mut touch);
        faults(&[touch], Some(GOOD))
    };
    assert!(matches!(fault(|t| t.kinetic_after = 125.0)[..], [Fault::Energy { .. }]));
    assert!(matches!(fault(|t| t.kinetic_after = f64::NAN)[..], [Fault::Energy { .. }]));
    // Motors, pushes and gravity may each give what they gave.
    assert_eq!(fault(|t| (t.kinetic_after, t.motor_work) = (125.0, 8.0)), []);
    assert_eq!(fault(|t| (t.kinetic_after, t.push_work) = (125.0, 6.0)), []);
    assert_eq!(fault(|t| (t.kinetic_after, t.gravity_work) = (125.0, 6.0)), []);
    assert!(matches!(fault(|t| t.restitution = 0.86)[..], [Fault::Restitution { .. }]));
    assert!(matches!(fault(|t| t.restitution = f64::NAN)[..], [Fault::Restitution { .. }]));
    assert!(matches!(fault(|t| t.depth = 0.056)[..], [Fault::Depth { .. }]));
    assert!(matches!(fault(|t| t.duration = 0.031)[..], [Fault::Contact { .. }]));

    // The second touch counts as the first does.
    let light = Impact { impulse: 0.1, time: 0.4, ..good.clone() };
    assert_eq!(faults(&[good.clone(), light.clone()], Some(GOOD)), []);
    let bouncy = Impact { restitution: 0.9, ..light.clone() };
    assert!(
        matches!(faults(&[good.clone(), bouncy], Some(GOOD))[..], [Fault::Restitution { time, .. }] if time == 0.4)
    );
    // A foot that leads the ball has no restitution.
    let led = Impact { restitution: 9.0, approach: 0.1, ..light };
    assert_eq!(faults(&[good.clone(), led], Some(GOOD)), []);
}

#[test]
fn a_kick_that_changes_with_the_step_is_invalid() {
    let touches = [good_touch()];
    let again = |outcome: Outcome| faults(&touches, Some(outcome));
    let speed = |speed: f64| Outcome { ball_speed: Some(speed), ..GOOD };
    let turned = |degrees: f64| Outcome { direction_error: Some(0.02 + degrees.to_radians()), ..GOOD };
    assert_eq!(again(Outcome { ball_speed: Some(9.51), ..turned(2.99) }), []);
    assert_eq!(again(Outcome { ball_speed: Some(10.49), ..turned(-2.99) }), []);
    assert!(matches!(again(speed(9.49))[..], [Fault::StepSpeed { .. }]));
    assert!(matches!(again(speed(10.51))[..], [Fault::StepSpeed { .. }]));
    assert!(matches!(
        again(Outcome { ball_speed: None, direction_error: None, ..GOOD })[..],
        [Fault::StepSpeed { .. }]
    ));
    assert!(matches!(again(turned(3.01))[..], [Fault::StepDirection { .. }]));
    assert!(matches!(again(turned(-3.01))[..], [Fault::StepDirection { .. }]));
    // A slow ball's few centimetres per second are believed, but not a ball that the re-run misses.
    let slow = |fine: Option<f64>| {
        let outcome = |ball_speed: Option<f64>| Outcome { ball_speed, ..GOOD };
        let rerun = Some((outcome(fine), Step::default()));
        let (touches, outcome) = (&touches[..], outcome(Some(0.4)));
        Audit::new(&Evidence { touches, finished: true, ball_radius: 0.11, outcome, rerun })
    };
    assert!(slow(Some(0.429)).is_valid() && !slow(Some(0.429)).converged);
    assert!(!slow(Some(0.431)).is_valid() && !slow(None).is_valid());
    // A kick has converged within narrower bounds than those within which it is believed.
    let converged = |outcome: Outcome| audit(&touches, Some(outcome)).converged;
    assert!(converged(speed(9.81)) && converged(speed(10.19)) && converged(turned(0.99)) && converged(turned(-0.99)));
    assert!(!converged(speed(9.79)) && !converged(speed(10.21)));
    assert!(!converged(turned(1.01)) && !converged(turned(-1.01)));
    assert!(!converged(Outcome { upright: false, ..GOOD }));
    assert!(matches!(
        again(Outcome { upright: false, ..GOOD })[..],
        [Fault::StepBalance { coarse: true, fine: false }]
    ));
    assert!(matches!(faults(&touches, None)[..], [Fault::StepSpeed { .. }]));
}

#[test]
fn the_rerun_is_the_whole_kick_at_a_quarter_of_the_step() {
    let trial = trial(4.0, WorldSettings::default());
    let rerun = trial.audit.rerun.expect("the ball was touched");
    assert!((rerun.step - 0.25 * WorldSettings::default().step.far).abs() < 1e-12);
    // Other steps, so another number, but nearly the same; in the same steps it would be the same bytes.
    let change = rerun.ball_speed_change.unwrap();
    assert!(change != 0.0 && change.abs() < 0.02, "{rerun:?}");
    assert!((rerun.ball_speed.unwrap() / trial.ball_speed.unwrap() - 1.0 - change).abs() < 1e-12);
    let turn = rerun.direction_deg.unwrap() - trial.direction_error.unwrap().to_degrees();
    assert!((turn - rerun.direction_change_deg.unwrap()).abs() < 1e-9);
}

/// A ball thrown at a toe bounces up, off the shank, and away; a second, slower one comes later. Nothing of it is lost, the
/// hardest touch is the impact, and the ball's speed is that after the last.
#[test]
fn every_touch_is_told_and_the_ball_leaves_after_the_last() {
    let robot = robot("prestoe");
    let toward = |speed: f64| BallState { velocity: [-speed, 0.0, 0.0], ..BallState::at_rest([0.35, -0.085, 0.11]) };
    let settings = TrialSettings {
        world: WorldSettings::default(),
        seed: 1,
        duration: 1.2,
        control_period: 0.002,
        q: robot.stand.clone(),
        v: vec![0.0; robot.nv()],
        ball: toward(4.0),
        direction: 0.0,
    };
    let again = Disturbance::MoveBall { time: 0.6, ball: toward(2.0) };
    let mut world = World::new(robot.clone(), &settings.world).unwrap();
    let hold = || Hold(robot.stand[7..].to_vec());
    let trial = run_disturbed(&mut world, &settings, &[again], &mut hold(), &mut hold()).unwrap();
    let touches = &trial.touches;
    let links: Vec<&str> = touches.iter().map(|touch| touch.link.as_str()).collect();
    assert_eq!(links[..2], ["right_toe", "right_shank"], "{touches:?}");
    let (early, late) =
        (touches.iter().filter(|t| t.time < 0.6).count(), touches.iter().filter(|t| t.time > 0.6).count());
    assert!(early >= 2 && late >= 1 && early + late == touches.len(), "{touches:?}");
    let hardest = touches.iter().max_by(|a, b| a.impulse.total_cmp(&b.impulse));
    assert_eq!(trial.impact.as_ref(), hardest);
    let last = nalgebra::Vector3::from(touches[touches.len() - 1].ball_velocity).norm();
    assert!((trial.ball_speed.unwrap() - last).abs() < 1e-12 && last < 2.0, "{last}");
    // An impulse is what changes the ball's momentum.
    let first = &touches[0];
    let before = nalgebra::Vector3::from(trial.record.ball[(first.time / 0.002) as usize].velocity);
    let change = 0.43 * (nalgebra::Vector3::from(first.ball_velocity) - before);
    assert!((change.norm() / first.impulse - 1.0).abs() < 0.05, "{change:?} {first:?}");
}

#[test]
fn a_ball_inside_robot_or_ground_is_bad_input() {
    let robot = robot("prestoe");
    let world = WorldSettings::default();
    let settings = |position: [f64; 3]| TrialSettings {
        world,
        seed: 1,
        duration: 0.1,
        control_period: 0.002,
        q: robot.stand.clone(),
        v: vec![0.0; robot.nv()],
        ball: BallState::at_rest(position),
        direction: 0.0,
    };
    let error = |position: [f64; 3]| {
        let hold = || Hold(robot.stand[7..].to_vec());
        run(&robot, &settings(position), &mut hold(), &mut hold()).map(|_| ()).unwrap_err().to_string()
    };
    assert!(error([1.0, 0.0, 0.05]).contains("0.060 m inside the ground"), "{}", error([1.0, 0.0, 0.05]));
    let foot = error([0.05, -0.085, 0.11]);
    assert!(foot.contains("inside") && foot.contains("right"), "{foot}");
    assert!(error([0.0, 0.0, 0.9]).contains("inside"));
}

/// A push gives what it gives: on a robot in free fall, force x way, which is also the kinetic energy beyond the fall's.
#[test]
fn a_push_moves_the_robot_and_its_work_is_counted() {
    let robot = robot("prestoe");
    let mut world = World::new(robot.clone(), &WorldSettings::default()).unwrap();
    let mut q = robot.stand.clone();
    q[2] += 5.0;
    world.reset(&q, &vec![0.0; robot.nv()], &BallState::at_rest([9.0, 0.0, 0.11])).unwrap();
    let mut command = JointCommand::zeros(robot.joints.len());
    command.positions.copy_from_slice(&q[7..]);
    let force = 100.0;
    world.push([force, 0.0, 0.0]);
    for _ in 0..50 {
        world.advance(&command, None).unwrap();
    }
    let work = world.push_work();
    world.push([0.0; 3]);
    world.advance(&command, None).unwrap();
    assert!((world.push_work() - work).abs() < 1e-12, "a push that is over works no more");
    // The base goes at least as far as the whole robot as one lump would, 1/2 F t^2 / m = 17 mm.
    let lump = 0.5 * force * 0.1 * 0.1 / robot.mass();
    let way = world.q()[0] - q[0];
    assert!(way > 0.9 * lump, "{way} m");
    assert!(work > 0.9 * force * lump && work < 1.5 * force * way.max(lump), "{work} J for {way} m");
}

/// Positive is to the left, from where it was wanted.
#[test]
fn the_direction_error_is_from_the_wanted_to_the_real_direction() {
    let robot = robot("prestoe");
    let kick = |direction: f64| {
        let ball = BallState { velocity: [-3.0, 1.0, 0.0], ..BallState::at_rest([0.35, -0.18, 0.11]) };
        let settings = TrialSettings {
            world: WorldSettings::default(),
            seed: 1,
            duration: 0.4,
            control_period: 0.002,
            q: robot.stand.clone(),
            v: vec![0.0; robot.nv()],
            ball,
            direction,
        };
        let hold = || Hold(robot.stand[7..].to_vec());
        run(&robot, &settings, &mut hold(), &mut hold()).unwrap()
    };
    let trial = kick(0.0);
    let [x, y, z] = trial.touches.last().expect("the foot is in its way").ball_velocity;
    assert!(y.abs() > 0.2, "the ball goes aside: {y} m/s");
    assert!((trial.direction_error.unwrap() - y.atan2(x)).abs() < 1e-12);
    assert!((trial.launch_angle.unwrap() - z.atan2(x.hypot(y))).abs() < 1e-12);
    // Wanted a little to the left, the same ball went farther to the right of it.
    assert!((kick(0.3).direction_error.unwrap() - (y.atan2(x) - 0.3)).abs() < 1e-12);
}

#[test]
fn a_push_of_a_trial_is_a_push_in_the_world() {
    let robot = robot("prestoe");
    let settings = TrialSettings {
        world: WorldSettings::default(),
        seed: 1,
        duration: 0.3,
        control_period: 0.002,
        q: robot.stand.clone(),
        v: vec![0.0; robot.nv()],
        ball: BallState::at_rest([5.0, 0.0, 0.11]),
        direction: 0.0,
    };
    let mut world = World::new(robot.clone(), &settings.world).unwrap();
    let mut speed_after = |force: f64| {
        let push = Disturbance::Push { time: 0.1, duration: 0.05, force: [0.0, force, 0.0] };
        let hold = || Hold(robot.stand[7..].to_vec());
        let trial = run_disturbed(&mut world, &settings, &[push], &mut hold(), &mut hold()).unwrap();
        trial.record.row(&trial.record.v, 75)[1]
    };
    // 0.3 m/s for the whole robot as one lump; the feet stand, so the base has less, or more, but that way.
    let force = 0.3 * robot.mass() / 0.05;
    assert!(speed_after(0.0).abs() < 0.02);
    assert!(speed_after(force) > 0.1 && speed_after(-force) < -0.1);
}
