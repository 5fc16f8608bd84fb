//! The engine `policy`: what it takes, what it refuses, and that it kicks as the bare policy does.

use std::path::Path;
use std::sync::Arc;

use instep_kick::policy::{LearnedKick, PolicyKick, PolicySettings};
use instep_kick::{BallModel, KickEngine, KickRequest, KickStatus, Learned, Phase, Refusal, Settings, Strength};
use instep_motion::phase::Side;
use instep_robot::control::Sensors;
use instep_sim::settings::WorldSettings;
use instep_sim::trial::{self, TrialSettings};
use instep_sim::{BallState, World};

use crate::rig::{robot, standing};

/// The engine with the policy that is shipped for PresToe.
pub(crate) fn learned() -> LearnedKick {
    let robot = robot("prestoe");
    let settings = PolicySettings::load(robot.folder()).unwrap();
    let policy = settings.load_policy(robot.folder()).unwrap();
    LearnedKick::new(&robot, BallModel::load(robot.folder()).unwrap(), &policy, settings).unwrap()
}

/// Sensors of the robot where the engine's kick starts.
fn at_start(engine: &LearnedKick) -> Sensors {
    let mut sensors = standing(&robot("prestoe"));
    sensors.joint_positions.copy_from_slice(&engine.own_start().unwrap().q[7..]);
    sensors
}

#[test]
fn it_kicks_as_the_bare_policy_does_to_the_last_bit() {
    let robot = robot("prestoe");
    let settings = PolicySettings::load(robot.folder()).unwrap();
    let policy = settings.load_policy(robot.folder()).unwrap();
    let mut bare = PolicyKick::new(&robot, &policy, 0.0).unwrap();
    let mut engine = learned();
    let start = engine.own_start().unwrap();
    let (q, v) = bare.initial_state();
    assert_eq!((&start.q, &start.v), (&q, &v));
    let [x, y] = [0, 1].map(|k| start.request.ball[k] + start.footprint[k]);
    assert_eq!([x, y], [policy.reference.ball[0], policy.reference.ball[1]]);

    let world = WorldSettings::default();
    let settings = TrialSettings {
        world,
        seed: 1,
        duration: 1.3,
        control_period: engine.control_period(),
        q,
        v,
        ball: BallState::at_rest([x, y, world.ball.radius]),
        direction: 0.0,
    };
    let mut twin = learned();
    engine.plan(&start.request, &at_start(&engine)).unwrap();
    twin.plan(&start.request, &at_start(&twin)).unwrap();
    let mut room = World::new(Arc::clone(&robot), &world).unwrap();
    let mut again = PolicyKick::new(&robot, &policy, 0.0).unwrap();
    let first = trial::run_in(&mut room, &settings, &mut bare, &mut again).unwrap();
    let second = trial::run_in(&mut room, &settings, &mut engine, &mut twin).unwrap();
    assert_eq!(first, second);
    assert!(first.ball_speed.unwrap() > 10.0);
}

#[test]
fn what_it_has_not_learned_is_refused_with_the_cause() {
    let mut engine = learned();
    let sensors = at_start(&engine);
    let own = engine.own_start().unwrap().request;
    let mut refused = |change: &dyn Fn(&mut KickRequest)| {
        let mut request = own;
        change(&mut request);
        let refusal = engine.plan(&request, &sensors).unwrap_err();
        assert_eq!(engine.progress().status, KickStatus::Idle);
        refusal
    };
    let other = |refusal: Refusal, part: Learned| matches!(refusal, Refusal::OtherKick { what, .. } if what == part);
    assert!(other(refused(&|r| r.ball[1] += 0.1), Learned::Ball));
    assert!(other(refused(&|r| r.ball_velocity[0] = -0.5), Learned::Rest));
    assert!(other(refused(&|r| r.direction = 0.6), Learned::Direction));
    assert!(other(refused(&|r| r.strength = Strength::BallSpeed(3.0)), Learned::Speed));
    assert!(other(refused(&|r| r.strength = Strength::FootSpeed(1.0)), Learned::Speed));
    assert_eq!(refused(&|r| r.hold = true), Refusal::CannotHold);
    assert_eq!(refused(&|r| r.foot = Some(Side::Left)), Refusal::OtherFoot { foot: Side::Right });
    assert!(matches!(refused(&|r| r.deadline = Some(0.1)), Refusal::TooLate { .. }));
    assert!(matches!(refused(&|r| r.precision = Some(1e-3)), Refusal::TooImprecise { .. }));
    assert!(matches!(refused(&|r| r.direction = f64::NAN), Refusal::NotFinite { .. }));
    let text = refused(&|r| r.ball[0] += 0.2).to_string();
    assert!(text.contains("0.200 m off its place") && text.contains("only one kick was learned"), "{text}");

    // Standing, as any other engine would have it.
    let stands = standing(&robot("prestoe"));
    assert!(matches!(engine.plan(&own, &stands), Err(Refusal::NotAtStart { .. })));
    engine.plan(&own, &sensors).unwrap();
    assert_eq!(engine.plan(&own, &sensors), Err(Refusal::Busy));
}

#[test]
fn a_cancelled_run_up_goes_on_and_says_so() {
    use instep_robot::control::{Controller, JointCommand};
    let mut engine = learned();
    let mut sensors = at_start(&engine);
    let own = engine.own_start().unwrap().request;
    let plan = engine.plan(&own, &sensors).unwrap();
    let mut command = JointCommand::zeros(sensors.joint_positions.len());
    let mut phases = Vec::new();
    engine.cancel();
    while engine.progress().status == KickStatus::Cancelling {
        assert!(sensors.time <= plan.duration + 0.01);
        engine.tick(&sensors, &mut command);
        let progress = engine.progress();
        assert!(progress.foot.is_none_or(|foot| foot == plan.foot));
        phases.push(progress.phase);
        sensors.time += engine.control_period();
    }
    assert_eq!((engine.progress().status, engine.progress().phase), (KickStatus::Cancelled, Phase::Stand));
    phases.dedup();
    assert_eq!(phases, [Phase::Shift, Phase::Kick, Phase::MoveBack, Phase::Stand]);
}

#[test]
fn wrong_settings_name_file_and_field() {
    let good = std::fs::read_to_string(robot("prestoe").folder().join("policy.toml")).unwrap();
    let error = PolicySettings::parse("policy.toml", &good.replace("reach = 0.0", "reach = 7.0")).unwrap_err();
    assert!(error.to_string().starts_with("policy.toml: reach"), "{error}");
    let settings = PolicySettings::parse("policy.toml", &good.replace("10_03", "none")).unwrap();
    let path = settings.path(Path::new("robots/prestoe"));
    assert_eq!(path, Path::new("policies/prestoe/none.safetensors"));
    let error = settings.load_policy(robot("prestoe").folder()).unwrap_err().to_string();
    assert!(error.contains("none.safetensors"), "{error}");
}
