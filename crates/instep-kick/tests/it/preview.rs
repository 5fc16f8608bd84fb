//! The preview engine in the world: balance against the truth, all faces, cancels, and both placements of the body.

use std::sync::Arc;

use instep_kick::Settings;
use instep_kick::preview::{Balanced, Com, PreviewKick, PreviewSettings};
use instep_kick::{BallModel, Face, KickEngine, KickPlan, KickRequest, KickStatus, Phase, Refusal};
use instep_motion::phase::Side;
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_sim::BallState;
use instep_sim::settings::{Ball, WorldSettings};
use instep_sim::trial::{self, Trial, TrialSettings};
use nalgebra::Vector3;

use crate::rig::{robot, standing};

fn ball(robot: &Robot) -> BallModel {
    BallModel::load(robot.folder()).unwrap()
}

fn settings(robot: &Robot, file: &str) -> PreviewSettings {
    PreviewSettings::load(&robot.model_file().with_file_name(file)).unwrap()
}

/// An engine whose beliefs are kept, tick by tick; cancelled at a time if so wanted.
struct Watched {
    engine: PreviewKick,
    cancel: f64,
    ticks: Vec<(f64, Phase, Balanced)>,
}

impl Controller for Watched {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        if sensors.time >= self.cancel {
            self.engine.cancel();
            self.cancel = f64::INFINITY;
        }
        self.engine.tick(sensors, command);
        self.ticks.push((sensors.time, self.engine.progress().phase, self.engine.balanced()));
    }
}

fn run(
    robot: &Arc<Robot>,
    settings: PreviewSettings,
    request: &KickRequest,
    cancel: f64,
) -> (KickPlan, Trial, Watched) {
    let model = ball(robot);
    let planned = || {
        let mut engine = PreviewKick::new(Arc::clone(robot), model, settings.clone()).unwrap();
        let plan = engine.plan(request, &standing(robot)).unwrap_or_else(|e| panic!("{}", e.explain(robot)));
        (engine, plan)
    };
    let (engine, plan) = planned();
    let world = WorldSettings {
        ball: Ball { mass: model.mass, radius: model.radius, ..Ball::default() },
        ..WorldSettings::default()
    };
    let data = robot.data();
    let [left, right] = [0, 1].map(|side| data.point(&robot.legs[side].sole));
    let foot = 0.5 * (left + right);
    let at = [request.ball[0] + foot.x, request.ball[1] + foot.y, model.radius];
    let settings = TrialSettings {
        world,
        seed: 1,
        duration: plan.duration + 0.8,
        control_period: engine.control_period(),
        q: robot.stand.clone(),
        v: vec![0.0; robot.nv()],
        ball: BallState::at_rest(at),
        direction: request.direction,
    };
    let mut watched = Watched { engine, cancel, ticks: Vec::new() };
    let mut twin = Watched { engine: planned().0, cancel, ticks: Vec::new() };
    let trial = trial::run(robot, &settings, &mut watched, &mut twin).unwrap();
    (plan, trial, watched)
}

/// Zero-moment point and centre of mass of a recorded sample in the support sole's frame, from the world's forces.
fn truth(robot: &Robot, trial: &Trial, sample: usize, support: Side) -> ([f64; 2], [f64; 2]) {
    let mut data = robot.data();
    data.set_position(trial.record.row(&trial.record.q, sample));
    let forces = trial.record.row(&trial.record.contact_forces, sample);
    let (mut load, mut moment) = (0.0, Vector3::zeros());
    for (contact, force) in robot.contacts.iter().zip(forces.chunks(3)) {
        load += force[2];
        moment += data.point(&contact.at) * force[2];
    }
    let sole = &robot.leg(support).sole;
    let turn = data.link_matrix(sole.link).transpose();
    let local = |point: Vector3<f64>| {
        let p = turn * (point - data.point(sole));
        [p.x, p.y]
    };
    (local(moment / load), local(data.com()))
}

/// Root mean square of the zero-moment point's distance from its reference, how near it comes to the sole's edge, and the
/// largest distance of the centre of mass from where it is wanted, while the foot is in the air, m.
fn balance(robot: &Robot, plan: &KickPlan, trial: &Trial, watched: &Watched) -> (f64, f64, f64) {
    let support = plan.foot.other();
    let data = robot.data();
    let sole = data.point(&robot.leg(support).sole);
    let corners: Vec<Vector3<f64>> =
        robot.contacts.iter().filter(|c| c.leg == support).map(|c| data.point(&c.at) - sole).collect();
    let range = |k: usize| {
        let values = corners.iter().map(|c| c[k]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)])
    };
    let (x, y) = (range(0), range(1));
    let (mut sum, mut count, mut edge, mut com) = (0.0, 0, f64::INFINITY, 0.0_f64);
    let times = &trial.record.times;
    for (time, phase, balanced) in &watched.ticks {
        if !(Phase::Raise..=Phase::MoveBack).contains(phase) {
            continue;
        }
        // The middle of the tick: what was planned for half a period later.
        let at = time + 0.5 * watched.engine.control_period();
        let sample = times.partition_point(|t| *t < at).min(times.len() - 1);
        let (p, c) = truth(robot, trial, sample, support);
        sum += (p[0] - balanced.reference[0]).powi(2) + (p[1] - balanced.reference[1]).powi(2);
        count += 1;
        edge = edge.min(p[0] - x[0]).min(x[1] - p[0]).min(p[1] - y[0]).min(y[1] - p[1]);
        com = com.max((c[0] - balanced.com[0]).hypot(c[1] - balanced.com[1]));
    }
    ((sum / f64::from(count)).sqrt(), edge, com)
}

#[test]
fn balance_holds_within_a_centimetre_in_a_kick() {
    let robot = robot("nao");
    for (file, speed) in [("preview.toml", 0.6), ("preview-tuned.toml", 1.45)] {
        for (y, foot) in [(-0.05, Side::Right), (0.05, Side::Left)] {
            let request = KickRequest::new([0.17, y], 0.0, speed);
            let (plan, trial, watched) = run(&robot, settings(&robot, file), &request, f64::INFINITY);
            assert_eq!(plan.foot, foot);
            assert!(trial.upright());
            let (zmp, edge, com) = balance(&robot, &plan, &trial, &watched);
            println!("{file}: zmp rms {zmp:.4} m, edge {edge:.4} m, com {com:.4} m");
            assert!(zmp < 0.01 && edge > 0.0 && com < 0.01, "{file}: zmp {zmp}, edge {edge}, com {com}");
        }
    }
}

#[test]
fn front_side_and_heel_kick_where_they_should() {
    let robot = robot("nao");
    let turn = std::f64::consts::FRAC_PI_2;
    for (ball, direction, speed, face) in [
        ([0.17, -0.05], 0.0, 0.6, Face::Front),
        ([0.04, -0.18], -turn, 0.2, Face::Outer),
        ([-0.13, -0.05], 2.0 * turn, 0.4, Face::Back),
    ] {
        let mut settings = settings(&robot, "preview.toml");
        if face == Face::Outer {
            // Sideways NAO's leg is nearly straight; an upright body and a high foot leave it some bend.
            settings.stance.roll = 0.0;
            settings.swing.sole_least = 0.03;
        }
        let request = KickRequest::new(ball, direction, speed);
        let (plan, trial, _) = run(&robot, settings, &request, f64::INFINITY);
        let speed = trial.ball_speed.expect("a hit") / speed;
        let off = trial.direction_error.unwrap();
        println!("{face:?}: {speed:.3} of the asked speed, {:.1} deg off", off.to_degrees());
        assert_eq!(plan.face, face);
        assert!(trial.upright(), "{face:?} fell");
        assert!(off.abs() < 0.1, "{face:?}: {off} rad");
        // The side kick reaches half of its speed only: a hit, as KickBench counts it.
        let least = if face == Face::Outer { 0.3 } else { 0.85 };
        assert!((least..1.15).contains(&speed), "{face:?}: {speed} of the asked speed");
    }
}

#[test]
fn the_two_link_arm_kicks_too_and_its_error_is_known() {
    let robot = robot("nao");
    let request = KickRequest::new([0.17, -0.05], 0.0, 0.6);
    // Measured: under 0.000 01 m, and 0.001 4 m.
    for (com, most) in [(Com::General, 1e-4), (Com::TwoLink, 0.003)] {
        let settings = PreviewSettings { com, ..settings(&robot, "preview.toml") };
        let (_, trial, watched) = run(&robot, settings, &request, f64::INFINITY);
        let errors: Vec<f64> = watched.ticks.iter().map(|(_, _, balanced)| balanced.placement).collect();
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let greatest = errors.iter().fold(0.0_f64, |most, e| most.max(*e));
        println!(
            "{com:?}: rms {rms:.5}, greatest {greatest:.5} m, up {} hit {}",
            trial.upright(),
            trial.impact.is_some()
        );
        assert!(trial.upright() && trial.impact.is_some(), "{com:?}");
        assert!(greatest < most, "{com:?}: {greatest} m");
    }
}

#[test]
fn a_cancel_in_any_phase_leads_back_to_two_feet() {
    let robot = robot("nao");
    let request = KickRequest::new([0.17, -0.05], 0.0, 0.6);
    for share in [0.1, 0.3, 0.4, 0.5, 0.55, 0.7, 0.9] {
        let mut probe = PreviewKick::new(Arc::clone(&robot), ball(&robot), settings(&robot, "preview.toml")).unwrap();
        let time = share * probe.plan(&request, &standing(&robot)).unwrap().duration;
        let (_, trial, watched) = run(&robot, settings(&robot, "preview.toml"), &request, time);
        let progress = watched.engine.progress();
        assert_eq!((progress.status, progress.phase), (KickStatus::Cancelled, Phase::Stand), "{share}");
        assert!(trial.upright(), "cancelled at {share}: fell");
        let end = trial.record.row(&trial.record.q, trial.record.len() - 1);
        let near = end[7..].iter().zip(&robot.stand[7..]).all(|(a, b)| (a - b).abs() < 0.1);
        assert!(near, "cancelled at {share}: does not stand");
    }
}

#[test]
fn a_held_foot_waits_and_then_kicks() {
    let robot = robot("nao");
    let request = KickRequest { hold: true, ..KickRequest::new([0.17, -0.05], 0.0, 0.6) };
    let mut engine = PreviewKick::new(Arc::clone(&robot), ball(&robot), settings(&robot, "preview.toml")).unwrap();
    let mut sensors = standing(&robot);
    let plan = engine.plan(&request, &sensors).unwrap();
    let mut command = JointCommand::zeros(robot.joints.len());
    let mut tick = |engine: &mut PreviewKick, until: f64| {
        while sensors.time < until {
            sensors.time += engine.control_period();
            engine.tick(&sensors, &mut command);
        }
    };
    tick(&mut engine, plan.duration + 1.0);
    let held = engine.progress();
    assert_eq!((held.status, held.phase), (KickStatus::Holding, Phase::WindUp));
    engine.release();
    tick(&mut engine, 2.0 * plan.duration + 1.0);
    assert_eq!(engine.progress().status, KickStatus::Finished);
}

#[test]
fn what_cannot_be_kicked_is_refused_with_its_cause() {
    let robot = robot("nao");
    let good = KickRequest::new([0.17, -0.05], 0.0, 0.6);
    let refused = |change: fn(&mut KickRequest)| {
        // A slow kick at full strength.
        let mut settings = settings(&robot, "preview.toml");
        settings.kick.time = 0.5;
        let mut engine = PreviewKick::new(Arc::clone(&robot), ball(&robot), settings).unwrap();
        let mut request = good;
        change(&mut request);
        let refusal = engine.plan(&request, &standing(&robot)).expect_err("a refusal");
        assert_eq!(engine.progress().status, KickStatus::Idle);
        refusal
    };
    assert!(matches!(refused(|r| r.ball[0] = f64::NAN), Refusal::NotFinite { field: "ball" }));
    assert!(matches!(refused(|r| r.ball = [-0.2, 0.0]), Refusal::BallBehind { .. }));
    assert!(matches!(refused(|r| r.ball = [0.02, 0.0]), Refusal::BallUnderRobot { .. }));
    assert!(matches!(refused(|r| r.ball = [3.0, 0.0]), Refusal::TooFar { .. }));
    assert!(matches!(refused(|r| r.strength = instep_kick::Strength::BallSpeed(0.8)), Refusal::TooStrong { .. }));
    assert!(matches!(refused(|r| r.deadline = Some(0.1)), Refusal::TooLate { .. }));
    assert!(matches!(refused(|r| r.precision = Some(0.001)), Refusal::TooImprecise { .. }));
    let mut engine = PreviewKick::new(Arc::clone(&robot), ball(&robot), settings(&robot, "preview.toml")).unwrap();
    engine.plan(&good, &standing(&robot)).unwrap();
    assert_eq!(engine.plan(&good, &standing(&robot)), Err(Refusal::Busy));
}

#[test]
fn settings_that_cannot_be_name_their_field() {
    let robot = robot("nao");
    let text = std::fs::read_to_string(robot.model_file().with_file_name("preview.toml")).unwrap();
    for (from, to, field) in [
        ("share = 0.5", "share = 1.2", "kick.share"),
        ("r = 1e-6", "r = -1.0", "regulator.r"),
        ("horizon = 1.6", "horizon = nan", "regulator.horizon"),
        ("edge = 0.008", "edge = 3.0", "limits.edge"),
        ("\"inertial\"", "\"inertal\"", "inertal"),
        ("aim = 0.05", "aim = 0.05\naims = 1", "aims"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = PreviewSettings::parse("preview.toml", &text.replace(from, to)).unwrap_err().to_string();
        assert!(error.contains(field), "{error}");
    }
}
