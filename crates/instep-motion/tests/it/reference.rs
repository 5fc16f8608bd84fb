//! References: what is written is read, what is wrong is refused with its place, and between knots the velocities
//! are the derivatives of the positions.

use instep_motion::MotionError;
use instep_motion::phase::{KickPhases, Side};
use instep_motion::reference::{Knot, Reference, ReferenceKind, Source};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;

fn quaternion(w: Vector3<f64>) -> [f64; 4] {
    let q = UnitQuaternion::from_scaled_axis(w);
    [q.w, q.i, q.j, q.k]
}

/// A reference whose knots are made from the numbers in `seed`.
fn reference(knots: usize, seed: &[f64]) -> Reference {
    let number = |i: usize| seed[i % seed.len()];
    let vector = |i: usize| [number(i), number(i + 1), number(i + 2)];
    let knot = |k: usize| {
        let i = 31 * k;
        Knot {
            base_position: vector(i),
            base_orientation: quaternion(Vector3::from(vector(i + 3)) * 0.4),
            base_velocity: vector(i + 6),
            base_angular_velocity: vector(i + 9),
            joints: vec![number(i + 12), number(i + 13)],
            joint_velocities: vec![number(i + 14), number(i + 15)],
            contacts: vec![k.is_multiple_of(2), true, false],
            forces: vec![vector(i + 16), vector(i + 17), vector(i + 18)],
            torques: vec![number(i + 19), number(i + 20)],
            com: vector(i + 21),
            momentum: [0.1; 6].map(|v| v * number(i + 24)),
        }
    };
    Reference {
        format: Reference::FORMAT,
        robot: "prestoe".into(),
        kind: ReferenceKind::Kinodynamic,
        source: Source {
            clip: "kick_01.amc".into(),
            skeleton: Some("kick.asf".into()),
            clip_start: 0.25,
            acknowledgement: "ours".into(),
        },
        rate: 50.0,
        ball: [0.0, 0.0, 0.11],
        phases: KickPhases { kick_foot: Side::Right, t_plant: 0.1, t_swing: 0.12, t_lock: 0.2, t_impact: 0.25 },
        joint_names: vec!["hip".into(), "knee".into()],
        contact_names: vec!["heel".into(), "ball".into(), "toe".into()],
        knots: (0..knots).map(knot).collect(),
    }
}

pub(crate) fn example() -> Reference {
    reference(6, &[0.3, -0.7, 0.11, 0.9, -0.2, 1.0 / 3.0, 0.01, -1.0])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn saved_is_loaded_bit_for_bit(knots in 2_usize..6, seed in prop::collection::vec(-3.0..3.0_f64, 7..40)) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("kick.json");
        let reference = reference(knots, &seed);
        reference.save(&path).unwrap();
        prop_assert_eq!(Reference::load(&path).unwrap(), reference);
        // Only the file itself is left in the folder.
        prop_assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn velocities_are_derivatives(seed in prop::collection::vec(-3.0..3.0_f64, 7..40), s in 0.05..0.95_f64, k in 0_usize..5) {
        let reference = reference(6, &seed);
        let (t, h) = ((k as f64 + s) / reference.rate, 1e-7);
        let [mut now, mut before, mut after] = [(); 3].map(|()| Knot::default());
        reference.sample_into(t, &mut now);
        reference.sample_into(t - h, &mut before);
        reference.sample_into(t + h, &mut after);
        let slope = |a: f64, b: f64| (a - b) / (2.0 * h);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-4 * (1.0 + a.abs() + b.abs());
        for j in 0..2 {
            prop_assert!(near(slope(after.joints[j], before.joints[j]), now.joint_velocities[j]));
        }
        for i in 0..3 {
            prop_assert!(near(slope(after.base_position[i], before.base_position[i]), now.base_velocity[i]));
        }
        let q = |knot: &Knot| {
            let [w, x, y, z] = knot.base_orientation;
            UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
        };
        let turn = (q(&before).inverse() * q(&after)).scaled_axis() / (2.0 * h);
        for i in 0..3 {
            prop_assert!(near(turn[i], now.base_angular_velocity[i]), "{} {:?}", turn, now.base_angular_velocity);
        }
    }

    #[test]
    fn broken_json_is_an_error_with_a_place(cut in 0.0..1.0_f64, place in 0.0..1.0_f64, byte in any::<u8>()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("kick.json");
        example().save(&path).unwrap();
        let text = std::fs::read(&path).unwrap();
        let cut = (cut * (text.len() - 3) as f64) as usize;
        std::fs::write(&path, &text[..cut]).unwrap();
        let error = Reference::load(&path).unwrap_err().to_string();
        prop_assert!(error.contains("kick.json:"), "{}", error);
        let mut garbled = text.clone();
        garbled[(place * text.len() as f64) as usize] = byte;
        std::fs::write(&path, &garbled).unwrap();
        if let Err(error) = Reference::load(&path) {
            prop_assert!(error.to_string().contains("kick.json"), "{}", error);
        }
    }
}

#[test]
fn at_the_knots_the_sample_is_the_knot_and_outside_the_end() {
    let reference = example();
    let mut got = Knot::default();
    for (i, want) in reference.knots.iter().enumerate() {
        reference.sample_into(i as f64 / reference.rate, &mut got);
        let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(close(&got.base_position, &want.base_position) && close(&got.base_velocity, &want.base_velocity));
        assert!(close(&got.base_orientation, &want.base_orientation), "{i}");
        assert!(close(&got.base_angular_velocity, &want.base_angular_velocity), "{i}");
        assert!(close(&got.joints, &want.joints) && close(&got.joint_velocities, &want.joint_velocities));
        assert!(close(&got.com, &want.com) && close(&got.momentum, &want.momentum));
        assert!(close(&got.torques, &want.torques) && close(&got.forces[1], &want.forces[1]));
        assert_eq!(got.contacts, want.contacts, "{i}");
    }
    let mut beyond = Knot::default();
    reference.sample_into(99.0, &mut beyond);
    reference.sample_into(reference.duration(), &mut got);
    assert_eq!(beyond, got);
    reference.sample_into(-1.0, &mut beyond);
    reference.sample_into(0.0, &mut got);
    assert_eq!(beyond, got);
    assert_eq!((reference.joint_index("knee"), reference.joint_index("elbow")), (Some(1), None));
}

#[test]
fn one_knot_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kick.json");
    example().save(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(text.lines().filter(|line| line.contains("base_position")).count(), 6);
    assert_eq!(text.lines().count(), 1 + 9 + 1 + 6 + 2);
}

/// Something that a test does to a good reference.
type Fault = fn(&mut Reference);

#[test]
fn faults_are_named_by_their_path_and_nothing_is_written() {
    let faults: [(&str, Fault); 14] = [
        ("format", |r| r.format = 9),
        ("rate", |r| r.rate = 0.0),
        ("rate", |r| r.rate = f64::INFINITY),
        ("ball[2]", |r| r.ball[2] = f64::NAN),
        ("phases.t_lock", |r| r.phases.t_lock = 0.3),
        ("joint_names[1]", |r| r.joint_names[1] = "hip".into()),
        ("knots", |r| r.knots.truncate(1)),
        ("knots[2].joints", |r| r.knots[2].joints.push(0.0)),
        ("knots[3].joint_velocities[1]", |r| r.knots[3].joint_velocities[1] = f64::NAN),
        ("knots[0].base_orientation", |r| r.knots[0].base_orientation = [0.9, 0.0, 0.0, 0.0]),
        ("knots[1].forces[2][0]", |r| r.knots[1].forces[2][0] = f64::INFINITY),
        ("knots[1].forces", |r| r.knots[1].forces.clear()),
        ("knots[4].contacts", |r| r.knots[4].contacts.clear()),
        ("knots[5].momentum[5]", |r| r.knots[5].momentum[5] = f64::NAN),
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kick.json");
    for (place, fault) in faults {
        let mut reference = example();
        fault(&mut reference);
        match reference.save(&path).unwrap_err() {
            MotionError::Content { field, .. } => assert_eq!(field, place),
            other => panic!("{other}"),
        }
        assert!(!path.exists(), "{place}");
    }
}

#[test]
fn a_folder_that_is_not_there_is_a_write_error() {
    let error = example().save(std::path::Path::new("/nonexistent/kick.json")).unwrap_err();
    assert!(matches!(error, MotionError::Write { .. }), "{error}");
}

#[test]
fn unknown_fields_are_refused_with_the_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kick.json");
    example().save(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap().replace("\"rate\":", "\"hertz\": 1,\n  \"rate\":");
    std::fs::write(&path, text).unwrap();
    let error = Reference::load(&path).unwrap_err().to_string();
    assert!(error.contains("kick.json:6:") && error.contains("hertz"), "{error}");
}
