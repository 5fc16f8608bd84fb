//! Derivatives against finite differences, and dynamics against MuJoCo.
#![allow(clippy::unwrap_used, reason = "tests stop at the first surprise")]

use std::path::Path;

use instep_robot::Robot;

use super::inverse_dynamics::Dynamics;
use super::tree::Tree;

fn robots() -> Vec<Robot> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots");
    ["prestoe", "nao"].iter().map(|name| Robot::load(&root.join(name)).unwrap()).collect()
}

/// Numbers in [-1, 1) without pattern, the same every time.
pub(super) fn noise(seed: u64, count: usize) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(1);
    (0..count)
        .map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        })
        .collect()
}

#[test]
fn inverse_dynamics_and_momentum_are_mujocos() {
    for robot in robots() {
        let tree = Tree::new(&robot);
        let nv = robot.nv();
        let mut data = robot.data();
        let mut dynamics = Dynamics::new(&tree);
        for seed in 0..5 {
            let x: Vec<f64> = noise(seed, nv).iter().map(|r| 0.4 * r).collect();
            let v: Vec<f64> = noise(seed + 100, nv).iter().map(|r| 3.0 * r).collect();
            let a: Vec<f64> = noise(seed + 200, nv).iter().map(|r| 30.0 * r).collect();
            dynamics.compute(&tree, &x, &v, &a, false);
            let (q, w) = tree.state(&x, &v);
            // The acceleration in MuJoCo's convention, as a difference of its speeds along the motion.
            let t = 1e-6;
            let moved = |s: f64| -> Vec<f64> {
                let x1: Vec<f64> = (0..nv).map(|i| x[i] + s * v[i] + 0.5 * s * s * a[i]).collect();
                let v1: Vec<f64> = (0..nv).map(|i| v[i] + s * a[i]).collect();
                tree.state(&x1, &v1).1
            };
            let b: Vec<f64> = moved(t).iter().zip(moved(-t)).map(|(p, m)| (p - m) / (2.0 * t)).collect();
            data.set_state(&q, &w);
            let mut expected = vec![0.0; nv];
            data.inverse_dynamics_into(&b, &[], &mut expected);
            for i in (0..3).chain(6..nv) {
                let miss = (dynamics.force[i] - expected[i]).abs();
                assert!(
                    miss < 1e-4 * (1.0 + expected[i].abs()),
                    "{} {i}: {} {}",
                    robot.name,
                    dynamics.force[i],
                    expected[i]
                );
            }
            let momentum = data.momentum();
            let (linear, angular) = dynamics.momentum();
            for i in 0..3 {
                assert!((linear[i] - momentum[i]).abs() < 1e-9, "{linear} {momentum:?}");
                assert!((angular[i] - momentum[3 + i]).abs() < 1e-9, "{angular} {momentum:?}");
            }
            assert!((dynamics.com - data.com()).norm() < 1e-12);
        }
    }
}

#[test]
fn derivatives_of_inverse_dynamics_are_differences() {
    for robot in robots() {
        let tree = Tree::new(&robot);
        let nv = robot.nv();
        let mut dynamics = Dynamics::new(&tree);
        let mut state: [Vec<f64>; 3] = [
            noise(7, nv).iter().map(|r| 0.5 * r).collect(),
            noise(8, nv).iter().map(|r| 3.0 * r).collect(),
            noise(9, nv).iter().map(|r| 20.0 * r).collect(),
        ];
        let [x, v, a] = &state;
        dynamics.compute(&tree, x, v, a, true);
        let analytic = [dynamics.by_position.clone(), dynamics.by_speed.clone(), dynamics.by_acceleration.clone()];
        let momentum: Vec<_> = (0..nv).map(|i| dynamics.angular_momentum_by(&tree, i)).collect();
        let e = 1e-6;
        for part in 0..3 {
            for j in 0..nv {
                let mut sides = Vec::new();
                for sign in [1.0, -1.0] {
                    state[part][j] += sign * e;
                    let [x, v, a] = &state;
                    dynamics.compute(&tree, x, v, a, false);
                    sides.push((dynamics.force.clone(), dynamics.momentum().1));
                    state[part][j] -= sign * e;
                }
                for i in 0..nv {
                    let difference = (sides[0].0[i] - sides[1].0[i]) / (2.0 * e);
                    let miss = (difference - analytic[part][i * nv + j]).abs();
                    assert!(
                        miss < 1e-5 * (1.0 + difference.abs()),
                        "{} {part} {i} {j}: {difference} {}",
                        robot.name,
                        analytic[part][i * nv + j]
                    );
                }
                let difference = (sides[0].1 - sides[1].1) / (2.0 * e);
                let own = [momentum[j].0, momentum[j].1, nalgebra::Vector3::zeros()][part];
                assert!((difference - own).norm() < 1e-6, "{part} {j}: {difference} {own}");
            }
        }
    }
}

/// A plan of our own: half a second of standing, the left toes lifted for a while, the right foot swinging.
pub(super) fn started(robot: &Robot) -> crate::kinematic::Retargeted {
    use crate::kinematic::{Retargeted, Status};
    use crate::rescale::{Target, Targets, keypoints};
    use instep_motion::contact::{ContactSchedule, FootContact, Stance};
    use instep_motion::phase::{KickPhases, Side};
    use instep_motion::reference::{Reference, ReferenceKind, Source};
    use nalgebra::{UnitQuaternion, Vector3};

    let count = 61;
    let keypoints = keypoints(robot).unwrap();
    let mut data = robot.data();
    let mut positions = Vec::new();
    let mut frames = Vec::new();
    for k in 0..count {
        let mut q = robot.stand.clone();
        q[0] -= 0.9;
        q[1] += 0.55;
        let s = (k as f64 / 60.0 * std::f64::consts::TAU).sin();
        for (i, x) in q[7..].iter_mut().enumerate() {
            *x += 0.05 * s * ((i % 3) as f64 - 1.0);
        }
        data.set_position(&q);
        frames.push(Target {
            positions: keypoints.iter().map(|p| data.point(&p.at)).collect(),
            pelvis: UnitQuaternion::identity(),
            chest: UnitQuaternion::identity(),
            soles: [UnitQuaternion::identity(); 2],
            toes: [UnitQuaternion::identity(); 2],
        });
        positions.push(q);
    }
    let phases = KickPhases { kick_foot: Side::Right, t_plant: 0.0, t_swing: 0.2, t_lock: 0.25, t_impact: 0.3 };
    let foot = |from: usize, to: usize| FootContact {
        heel: (0..count).map(|k| !(from..to).contains(&k)).collect(),
        toe: vec![true; count],
        stance: vec![true; count],
        stances: vec![Stance { start: 0, end: count - 1 }],
    };
    let right = FootContact {
        heel: (0..count).map(|k| k < 20).collect(),
        toe: (0..count).map(|k| k < 24).collect(),
        stance: (0..count).map(|k| k < 24).collect(),
        stances: vec![Stance { start: 0, end: 23 }],
    };
    let reference = Reference {
        format: Reference::FORMAT,
        robot: robot.name.clone(),
        kind: ReferenceKind::Kinematic,
        source: Source { clip: "own".into(), skeleton: None, clip_start: 0.0, acknowledgement: String::new() },
        rate: 30.0,
        ball: [0.0, 0.0, 0.11],
        phases,
        joint_names: robot.joints.iter().map(|j| j.name.clone()).collect(),
        contact_names: robot.contacts.iter().map(|c| c.name.clone()).collect(),
        knots: Vec::new(),
    };
    Retargeted {
        reference,
        phases,
        positions,
        targets: Targets { keypoints, frames, human: vec![vec![Vector3::zeros()]; count], scale: 1.0 },
        contacts: ContactSchedule { rate: 120.0, ground: 0.0, feet: [foot(40, 50), right] },
        keypoint_errors: Vec::new(),
        max_stance_slip: 0.0,
        status: Status::Solved,
        iterations: 0,
        violations: std::collections::BTreeMap::new(),
    }
}

/// Every row of every family at several nodes: its gradient is the difference of its value.
#[test]
fn gradients_of_all_rows_are_differences() {
    use super::node::{Scratch, rows};
    use super::plan::Plan;
    use super::settings::KinodynamicSettings;
    use super::terms::{FAMILIES, Pass, Row, Sink};
    use crate::kinematic::Weights;

    for robot in robots() {
        let start = started(&robot);
        let settings = KinodynamicSettings { foot_speed: Some(9.0), rate: 120.0, ..KinodynamicSettings::default() };
        let mut settings = settings;
        settings.weights.q_i = [0.3, 0.2, 0.1];
        settings.ground = slope();
        let plan = Plan::new(&robot, &start, &Weights::default(), &settings).unwrap();
        let nv = robot.nv();
        let mut scratch = Scratch::new(&plan);
        let rho = [1.0; FAMILIES];
        let mut seen = std::collections::BTreeSet::new();
        for k in [0, 18, 23, 30, 36, 45] {
            let forces = 3 * plan.nodes[k].pushing.len();
            let mut z: Vec<f64> = noise(k as u64, 3 * nv + forces);
            for (i, z) in z.iter_mut().enumerate() {
                *z *= [0.1, 2.0, 20.0, 0.3][(i / nv).min(3)];
            }
            z[..nv].iter_mut().zip(&plan.nodes[k].posture).for_each(|(z, x)| *z += x);
            let mut collect = |z: &[f64], derivatives: bool| {
                let mut out = vec![("first".to_owned(), 0.0, Row::new(nv, forces))];
                let mut multipliers = Vec::new();
                let mut sink = Sink::new(Pass::Collect(&mut out), k, &rho, &mut multipliers);
                let parts = [&z[..nv], &z[nv..2 * nv], &z[2 * nv..3 * nv], &z[3 * nv..]];
                rows(&plan, k, parts, derivatives, &mut scratch, &mut sink);
                out
            };
            let analytic = collect(&z, true);
            let e = 1e-6;
            for i in 0..z.len() {
                let mut sides = Vec::new();
                for sign in [1.0, -1.0] {
                    z[i] += sign * e;
                    sides.push(collect(&z, false));
                    z[i] -= sign * e;
                }
                for (row, (family, _, gradient)) in analytic.iter().enumerate() {
                    let difference = (sides[0][row].1 - sides[1][row].1) / (2.0 * e);
                    let own =
                        [&gradient.q, &gradient.v, &gradient.a, &gradient.f][(i / nv).min(3)][i - nv * (i / nv).min(3)];
                    let miss = (difference - own).abs();
                    assert!(
                        miss < 2e-5 * (1.0 + difference.abs()),
                        "{} node {k} {family} row {row} by {i}: {difference} {own}",
                        robot.name
                    );
                    seen.insert(family.clone());
                }
            }
        }
        let expected = [
            "base_dynamics",
            "friction",
            "contact",
            "contact_speed",
            "penetration",
            "torque",
            "approach_angle",
            "self_collision",
            "cost",
            "gradient_only",
        ];
        for family in expected {
            assert!(
                seen.contains(family) || (family == "self_collision" && robot.self_collision.is_empty()),
                "{family} was not tried"
            );
        }
    }
}

/// Ground that rises by 5 % along x and by 3 % along y.
fn slope() -> super::HeightMap {
    super::HeightMap { origin: [-5.0; 2], spacing: 10.0, heights: vec![vec![-0.4, -0.1], vec![0.1, 0.4]] }
}

/// A robot that keeps its standing pose, both feet on the ground.
fn standing(robot: &Robot) -> crate::kinematic::Retargeted {
    let mut start = started(robot);
    let count = start.positions.len();
    let (first, frame) = (start.positions[0].clone(), start.targets.frames[0].clone());
    start.positions = vec![first; count];
    start.targets.frames = vec![frame; count];
    for foot in &mut start.contacts.feet {
        foot.heel = vec![true; count];
        foot.toe = vec![true; count];
        foot.stance = vec![true; count];
        foot.stances = vec![instep_motion::contact::Stance { start: 0, end: count - 1 }];
    }
    start
}

fn solve(robot: &Robot, start: &crate::kinematic::Retargeted, stopped: bool) -> super::Kinodynamic {
    solve_on(robot, start, super::HeightMap::default(), stopped)
}

fn solve_on(
    robot: &Robot,
    start: &crate::kinematic::Retargeted,
    ground: super::HeightMap,
    stopped: bool,
) -> super::Kinodynamic {
    let settings = super::KinodynamicSettings { rate: 60.0, ground, ..Default::default() };
    let mut settings = settings;
    settings.weights.q_i = [0.0; 3];
    let stop = std::sync::atomic::AtomicBool::new(stopped);
    super::optimize(robot, start, &crate::kinematic::Weights::default(), &settings, &stop, &mut |_| {}).unwrap()
}

/// Known solution: who stands still is carried by forces that sum to the weight, and stays.
#[test]
fn standing_still_is_carried_by_the_weight() {
    let robot = &robots()[0];
    let start = standing(robot);
    let done = solve(robot, &start, false);
    assert_eq!(done.status, super::Status::Solved, "{:?}", done.violations);
    let weight = robot.mass() * 9.81;
    let middle = &done.reference.knots[done.reference.knots.len() / 2];
    let sum: f64 = middle.forces.iter().map(|f| f[2]).sum();
    assert!((sum / weight - 1.0).abs() < 0.02, "{sum} N of {weight} N");
    assert!(done.verification.root_wrench_residual < 0.01);
    assert_eq!(done.verification.torque_violations, 0);
    assert_eq!(done, solve(robot, &start, false), "the same again");
}

/// A map of zeros is no map, to the last bit; a plane 5 cm higher gives the same motion 5 cm higher, ball and all.
#[test]
fn a_level_plane_only_raises_the_motion() {
    let robot = &robots()[0];
    let start = standing(robot);
    let plain = solve(robot, &start, false);
    let zeros = super::HeightMap { origin: [-1.1, 0.2], spacing: 0.7, heights: vec![vec![0.0; 3]; 4] };
    assert_eq!(plain, solve_on(robot, &start, zeros, false));
    let plane = super::HeightMap { heights: vec![vec![0.05]], ..Default::default() };
    let raised = solve_on(robot, &start, plane, false);
    assert_eq!(raised.status, super::Status::Solved, "{:?}", raised.violations);
    assert!((raised.reference.ball[2] - plain.reference.ball[2] - 0.05).abs() < 1e-12);
    for (k, (low, high)) in plain.reference.knots.iter().zip(&raised.reference.knots).enumerate() {
        for (axis, by) in [0.0, 0.0, 0.05].into_iter().enumerate() {
            let miss = high.base_position[axis] - low.base_position[axis] - by;
            assert!(miss.abs() < 1e-6, "knot {k}, axis {axis}: {miss}");
        }
        let joints = low.joints.iter().zip(&high.joints).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(joints, "knot {k}: {:?} {:?}", low.joints, high.joints);
    }
}

/// On a slope feet stand on the plane and the cone's axis is its normal; the weight is carried as on level ground.
#[test]
fn a_robot_stands_on_a_slope() {
    let robot = &robots()[0];
    let start = standing(robot);
    let settings = super::KinodynamicSettings { ground: slope(), ..Default::default() };
    let plan = super::plan::Plan::new(robot, &start, &crate::kinematic::Weights::default(), &settings).unwrap();
    let normal = nalgebra::Vector3::new(-0.05, -0.03, 1.0).normalize();
    for (e, episode) in plan.episodes.iter().enumerate() {
        for (p, contact) in robot.contacts.iter().enumerate().filter(|(_, c)| c.leg == episode.side) {
            let at = plan.place(e, p);
            assert!((at.dot(&normal) - contact.radius).abs() < 1e-9, "{}: {at}", contact.name);
            assert!((plan.footing(5, p)[2] - normal).norm() < 1e-9);
        }
    }
    let done = solve_on(robot, &start, slope(), false);
    assert_eq!(done.status, super::Status::Solved, "{:?} {:?}", done.violations, done.verification);
    let middle = &done.reference.knots[done.reference.knots.len() / 2];
    let weight = robot.mass() * 9.81;
    let sum: f64 = middle.forces.iter().map(|f| f[2]).sum();
    assert!((sum / weight - 1.0).abs() < 0.02, "{sum} N of {weight} N");
    // The same motion on level ground: its standing points are in the ground or above it.
    let level = super::verify::verify(robot, &done.reference, 200.0, 0.6, &super::HeightMap::default());
    assert!(level.fault().is_some());
}

/// The left foot on a step 3 cm high, the right one beside it.
#[test]
fn a_robot_stands_on_a_step() {
    let robot = &robots()[0];
    let start = standing(robot);
    // The robot stands at y = 0.55.
    let step = super::HeightMap { origin: [0.0, 0.49], spacing: 0.04, heights: vec![vec![0.0, 0.0, 0.03, 0.03]] };
    let done = solve_on(robot, &start, step, false);
    assert_eq!(done.status, super::Status::Solved, "{:?} {:?}", done.violations, done.verification);
    let knot = &done.reference.knots[done.reference.knots.len() / 2];
    let q = [&knot.base_position[..], &knot.base_orientation, &knot.joints].concat();
    let mut data = robot.data();
    data.set_position(&q);
    for contact in &robot.contacts {
        let height = if contact.leg == instep_motion::phase::Side::Left { 0.03 } else { 0.0 };
        let at = data.point(&contact.at);
        assert!((at.z - contact.radius - height).abs() < 1e-3, "{}: {at}", contact.name);
    }
}

/// A foot across the edge of a step stands on nothing that the map knows as a plane: said, not passed over.
#[test]
fn a_foot_across_an_edge_does_not_stand() {
    let robot = &robots()[0];
    let start = standing(robot);
    let ankle = robot.data().point(&robot.leg(instep_motion::phase::Side::Left).sole);
    let middle = 0.55 + ankle.y;
    let step = super::HeightMap { origin: [0.0, middle - 0.01], spacing: 0.02, heights: vec![vec![0.0, 0.03]] };
    let done = solve_on(robot, &start, step, false);
    assert!(!done.status.feasible(), "{:?}", done.verification);
    assert!(done.verification.stance_lift > super::verify::MAX_SLIP, "{:?}", done.verification);
}

/// What is not a number is refused at the door.
#[test]
fn nothing_that_is_not_a_number_comes_in() {
    let robot = &robots()[0];
    let settings = super::KinodynamicSettings { rate: 60.0, ..Default::default() };
    let go = |start: &crate::kinematic::Retargeted| {
        let stop = std::sync::atomic::AtomicBool::new(false);
        super::optimize(robot, start, &crate::kinematic::Weights::default(), &settings, &stop, &mut |_| {})
    };
    let mut start = standing(robot);
    start.positions[7][9] = f64::NAN;
    assert!(matches!(go(&start), Err(crate::RetargetError::Breakdown { .. })));
    let mut start = standing(robot);
    start.targets.frames[5].positions[2].y = f64::INFINITY;
    assert!(matches!(go(&start), Err(crate::RetargetError::Breakdown { .. })));
}

/// A target so far away that its square is no number any more: the solver ends, and what it gives back is finite.
#[test]
fn an_overflow_stays_inside() {
    let robot = &robots()[0];
    let mut start = standing(robot);
    start.targets.frames[9].positions[0].x = 1e200;
    let done = solve(robot, &start, false);
    assert!(!done.status.feasible() || done.cost.is_finite());
    done.reference.validate().unwrap();
    assert!(done.violations.values().all(|v| !v.is_nan()));
}

/// Where the ball lies and where it shall go turn and move the motion, not the ball.
#[test]
fn ball_and_aim_move_the_run_up() {
    use super::plan::Plan;
    let robot = &robots()[0];
    let start = standing(robot);
    let weights = crate::kinematic::Weights::default();
    let of = |ball: [f64; 2], aim: f64| {
        // Wide enough that the approach angle turns nothing back.
        let settings = super::KinodynamicSettings { ball, aim, approach_angle: [0.0, 1.5], ..Default::default() };
        let plan = Plan::new(robot, &start, &weights, &settings).unwrap();
        (plan.nodes[0].posture.clone(), plan.strike_place, plan.ball)
    };
    let (plain, strike, ball) = of([0.0; 2], 0.0);
    let (moved, moved_strike, moved_ball) = of([0.1, -0.05], 0.0);
    assert!((moved[0] - plain[0] + 0.1).abs() < 1e-9 && (moved[1] - plain[1] - 0.05).abs() < 1e-9);
    assert_eq!((strike, ball), (moved_strike, moved_ball));
    let (turned, turned_strike, _) = of([0.0; 2], 0.2);
    assert!((turned[3] - plain[3] + 0.2).abs() < 1e-9, "a kick to the left is run up to from farther right of it");
    assert!((turned[0].hypot(turned[1]) - plain[0].hypot(plain[1])).abs() < 1e-9);
    assert_eq!(strike, turned_strike);
}

#[test]
fn a_stop_keeps_what_there_is() {
    let robot = &robots()[0];
    let done = solve(robot, &standing(robot), true);
    assert_eq!(done.status, super::Status::Stopped);
    done.reference.validate().unwrap();
}

/// Known solutions: a point mass falls freely; a rigid body spins on about a vertical axis only by a torque of I a.
#[test]
fn falling_and_spinning_bodies_need_what_they_should() {
    for robot in robots() {
        let tree = Tree::new(&robot);
        let nv = robot.nv();
        let mut dynamics = Dynamics::new(&tree);
        let (x, mut v, mut a) = (tree.coordinates(&robot.stand, 0.0), vec![0.0; nv], vec![0.0; nv]);
        (v[0], v[2], a[2]) = (2.0, 1.0, -9.81);
        dynamics.compute(&tree, &x, &v, &a, false);
        assert!(dynamics.force[..6].iter().all(|f| f.abs() < 1e-9), "{:?}", &dynamics.force[..6]);
        // About the vertical through the base: the force at the centre of mass and the moment that Newton and Euler give.
        let rate = 3.0;
        a[3] = rate;
        dynamics.compute(&tree, &x, &v, &a, true);
        let inertia = dynamics.by_acceleration[3 * nv + 3];
        let arm = dynamics.com - nalgebra::Vector3::new(x[0], x[1], x[2]);
        assert!((dynamics.force[3] - inertia * rate).abs() < 1e-9);
        assert!((dynamics.force[1] - tree.mass * arm.x * rate).abs() < 1e-9);
        assert!((dynamics.force[0] + tree.mass * arm.y * rate).abs() < 1e-9);
    }
}
