//! Adoption of small models made here: what makes a robot, and what is refused with what was found and what to do.

use std::path::PathBuf;

use instep_robot::Robot;
use instep_robot::adopt::adopt;
use proptest::prelude::*;

/// A leg of six hinges on side `y` (m), whose sole is `tilt` rad off level.
fn leg(word: &str, y: f64, tilt: f64, foot: &str) -> String {
    format!(
        r#"<body name="{word}_hip" pos="0 {y} -0.05">
          <joint name="{word}_hip_yaw" axis="0 0 1" range="-0.8 0.8" actuatorfrcrange="-20 20"/><geom type="sphere" size="0.03" mass="0.3"/>
          <body name="{word}_hip2"><joint name="{word}_hip_roll" axis="1 0 0" range="-0.5 0.5" actuatorfrcrange="-20 20"/><geom type="sphere" size="0.03" mass="0.3"/>
          <body name="{word}_thigh"><joint name="{word}_hip_pitch" axis="0 1 0" range="-1.6 0.8" actuatorfrcrange="-20 20"/>
            <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.03" mass="0.8"/>
          <body name="{word}_shank" pos="0 0 -0.2"><joint name="{word}_knee" axis="0 1 0" range="0 2.2" actuatorfrcrange="-20 20"/>
            <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.025" mass="0.5"/>
          <body name="{word}_ankle" pos="0 0 -0.2"><joint name="{word}_ankle_pitch" axis="0 1 0" range="-1 0.8" actuatorfrcrange="-20 20"/><geom type="sphere" size="0.02" mass="0.1"/>
          <body name="{word}_foot"><joint name="{word}_ankle_roll" axis="1 0 0" range="-0.5 0.5" actuatorfrcrange="-20 20"/>
            {}
          </body></body></body></body></body></body>"#,
        foot.replace("TILT", &tilt.to_string())
    )
}

const PLATE: &str = r#"<geom type="box" size="0.09 0.045 0.012" pos="0.03 0 -0.04" euler="0 TILT 0" mass="0.3"/>"#;

fn robot(base: &str, inside: &str) -> String {
    format!(
        r#"<mujoco model="tiny"><compiler angle="radian" autolimits="true"/><worldbody><geom type="plane" size="0 0 1"/>
        <body name="torso" pos="0 0 0.5">{base}<geom type="box" size="0.06 0.08 0.12" pos="0 0 0.1" mass="4"/>{inside}</body>
        </worldbody></mujoco>"#
    )
}

fn whole() -> String {
    robot("<freejoint/>", &(leg("left", 0.07, 0.0, PLATE) + &leg("right", -0.07, 0.0, PLATE)))
}

/// Adopts the text of a model from a file of its own.
fn adopted(text: &str, ending: &str) -> Result<(tempfile::TempDir, Robot, instep_robot::adopt::Adoption), String> {
    let folder = tempfile::tempdir().unwrap();
    let file: PathBuf = folder.path().join(format!("tiny.{ending}"));
    std::fs::write(&file, text).unwrap();
    let mut adoption = adopt(&file, "tiny").map_err(|e| e.to_string())?;
    assert!(adoption.bend_knees(0.4).map_err(|e| e.to_string())?, "no stand");
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    adoption.write(&out).unwrap();
    Ok((folder, Robot::load(&out.clone()).map_err(|e| e.to_string())?, adoption))
}

#[test]
fn a_small_humanoid_becomes_a_robot_that_checks_as_usable() {
    let (folder, robot, adoption) = adopted(&whole(), "xml").unwrap();
    let report = instep_robot::check::check(&folder.path().join("out")).unwrap();
    assert!(report.usable, "{report:?}");
    assert_eq!(robot.joints.len(), 12);
    assert_eq!(robot.contacts.len(), 8);
    // The sole lies under the plate: its centre 0.03 m ahead of the ankle, 0.052 m under it.
    for leg in &robot.legs {
        assert!((leg.sole.point - nalgebra::Vector3::new(0.03, 0.0, -0.052)).norm() < 1e-5, "{:?}", leg.sole);
        assert!(leg.ankle_roll.is_some() && leg.toe.is_none());
    }
    // Half of the plate's length and width, but for the contact spheres' radius.
    let spread = robot.contacts.iter().map(|c| c.at.point.x).fold(0.0, f64::max);
    assert!((spread - (0.03 + 0.09 - 0.005)).abs() < 1e-5, "{spread}");
    assert!((robot.mass() - adoption.mass).abs() < 1e-6 && (robot.mass() - (4.0 + 2.0 * 2.3)).abs() < 1e-6);
    // Both feet stand level, in the middle under the centre of mass.
    let data = robot.data();
    for contact in &robot.contacts {
        assert!((data.point(&contact.at).z - contact.radius).abs() < 2e-3);
    }
    let soles = 0.5 * (data.point(&robot.legs[0].sole) + data.point(&robot.legs[1].sole));
    assert!((soles - data.com()).xy().norm() < 5e-3);
    assert!(adoption.asked.iter().any(|item| item.contains("speed")), "{:?}", adoption.asked);
}

#[test]
fn what_a_person_must_read_is_short() {
    let (folder, ..) = adopted(&whole(), "xml").unwrap();
    let text = std::fs::read_to_string(folder.path().join("out/robot.toml")).unwrap();
    assert!(text.lines().count() <= 35, "{text}");
    // And what stands there counts.
    let changed = text.replacen("speed = ", "speed = 1", 1);
    std::fs::write(folder.path().join("out/robot.toml"), &changed).unwrap();
    let robot = Robot::load(&folder.path().join("out")).unwrap();
    assert!(robot.joints.iter().any(|joint| joint.speed > 9.0), "{changed}");
}

/// The dynamics are those of the source: masses, centre of mass and mass matrix, whatever frames its links have.
#[test]
fn masses_and_inertias_are_those_of_the_model() {
    let (_folder, robot, _) = adopted(&whole(), "xml").unwrap();
    let mut data = robot.data();
    let mut q = robot.stand.clone();
    q[..7].copy_from_slice(&[0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0]);
    for (i, angle) in q[7..].iter_mut().enumerate() {
        *angle = 0.1 * (i as f64 + 1.0).sin();
    }
    data.set_state(&q, &vec![0.0; robot.nv()]);
    let mut spec = mujoco_rs::wrappers::mj_editing::MjSpec::from_xml_string(&whole()).unwrap();
    let model = spec.compile().unwrap();
    let mut source = mujoco_rs::prelude::MjData::new(std::sync::Arc::new(model));
    source.qpos_mut().copy_from_slice(&q);
    source.kinematics();
    source.com_pos();
    let com = nalgebra::Vector3::from(source.subtree_com()[1]);
    assert!((data.com() - com).norm() < 1e-6, "{:?} {com:?}", data.com());
    source.make_m();
    let nv = source.qvel().len();
    let mut matrix = nalgebra::DMatrix::zeros(nv, nv);
    source.full_m(matrix.as_mut_slice()).unwrap();
    // But for the rotor inertia, which the tiny model lacks.
    let (ours, theirs) = (data.mass_matrix(), matrix);
    for i in 0..nv {
        for j in 0..nv {
            if i != j || i < 6 {
                assert!((ours[(i, j)] - theirs[(i, j)]).abs() < 1e-5, "{i} {j}: {} {}", ours[(i, j)], theirs[(i, j)]);
            }
        }
        assert!(i < 6 || ours[(i, i)] > theirs[(i, i)], "{i}");
    }
}

#[test]
fn what_is_no_humanoid_is_refused_with_what_was_found_and_what_to_do() {
    let (left, right) = (leg("left", 0.07, 0.0, PLATE), leg("right", -0.07, 0.0, PLATE));
    let free = "<freejoint/>";
    let wheel = |word: &str, y: f64| {
        format!(
            r#"<body name="{word}_wheel" pos="0 {y} -0.3"><joint name="{word}_axle" axis="0 1 0"/>
            <geom type="cylinder" size="0.1 0.02" euler="1.5708 0 0" mass="0.5"/></body>"#
        )
    };
    let arm = r#"<body pos="0 0 0.3"><joint name="neck" axis="0 0 1" range="-1 1"/><geom type="sphere" size="0.05" mass="0.5"/></body>"#;
    let four = ["fl", "fr", "bl", "br"]
        .iter()
        .zip([[0.2, 0.07], [0.2, -0.07], [-0.2, 0.07], [-0.2, -0.07]])
        .map(|(word, [x, y])| {
            leg(word, y, 0.0, PLATE).replace(&format!("pos=\"0 {y} -0.05\""), &format!("pos=\"{x} {y} -0.05\""))
        })
        .collect::<String>();
    let two_robots = whole().replace(
        "</worldbody>",
        r#"<body name="ball" pos="1 0 0.1"><freejoint/><geom type="sphere" size="0.1" mass="0.4"/></body></worldbody>"#,
    );
    let light = whole().replace(
        "<body name=\"left_hip2\">",
        "<body name=\"left_hip2\"><body name=\"ghost\"><joint name=\"ghost_joint\" axis=\"1 0 0\" range=\"-1 1\"/></body>",
    );
    let mesh = whole().replace("<worldbody>", r#"<asset><mesh name="shell" file="shell.stl"/></asset><worldbody>"#);
    let higher = leg("right", -0.07, 0.0, PLATE).replace("pos=\"0.03 0 -0.04\"", "pos=\"0.03 0 -0.08\"");
    let cases: Vec<(&str, String, Vec<&str>)> = vec![
        ("no legs", robot(free, arm), vec!["no legs", "two legs"]),
        ("one leg", robot(free, &left), vec!["one leg", "left_foot", "two legs"]),
        ("four legs", robot(free, &four), vec!["4 legs", "fl_foot", "br_foot", "two legs"]),
        ("wheels", robot(free, &(wheel("left", 0.1) + &wheel("right", -0.1))), vec!["wheels", "left_wheel", "feet"]),
        ("no inertia", light, vec!["ghost", "inertial"]),
        (
            "tilted",
            robot(free, &(leg("left", 0.07, 0.3, PLATE) + &leg("right", -0.07, 0.3, PLATE))),
            vec!["not level", "17.2 degrees", "zero"],
        ),
        ("heights", robot(free, &(left.clone() + &higher)), vec!["different heights", "40.0 mm"]),
        ("mesh", mesh, vec!["shell.stl", "not there"]),
        ("two free joints", two_robots, vec!["2 free joints", "\"torso\" and \"ball\"", "one robot"]),
        ("stiff", robot(free, ""), vec!["no", "legs"]),
        ("xml", "<svg/>".into(), vec!["<svg>", "MJCF"]),
        (
            "point feet",
            robot(
                free,
                &(leg("left", 0.07, 0.0, PLATE) + &right).replace(
                    "type=\"box\" size=\"0.09 0.045 0.012\" pos=\"0.03 0 -0.04\"",
                    "type=\"sphere\" size=\"0.01\" pos=\"0 0 -0.03\"",
                ),
            ),
            vec!["point foot", "soles"],
        ),
    ];
    for (case, text, parts) in cases {
        let error = match adopted(&text, "xml") {
            Ok(_) => panic!("{case}: was adopted"),
            Err(error) => error,
        };
        for part in parts {
            assert!(error.contains(part), "{case}: {error:?} lacks {part:?}");
        }
    }
}

#[test]
fn a_model_without_free_joint_names_ranges_or_torques_is_filled_in() {
    let bare = whole()
        .replace("<freejoint/>", "")
        .replace(" actuatorfrcrange=\"-20 20\"", "")
        .replace(" range=\"0 2.2\"", "")
        .replace(" name=\"left_hip2\"", "")
        .replace(" name=\"left_ankle_roll\"", "");
    let (_folder, robot, adoption) = adopted(&bare, "xml").unwrap();
    assert_eq!(robot.joints.len(), 12);
    let said = [adoption.asked.clone(), adoption.notes.clone()].concat().join("\n");
    for part in ["torque limits", "ranges of left_knee, right_knee", "no free joint"] {
        assert!(said.contains(part), "{said} lacks {part:?}");
    }
}

#[test]
fn a_model_that_faces_along_y_is_turned() {
    // Without a free joint the zero pose is the model's own.
    let turned = whole().replace("<freejoint/>", "").replace(
        "<body name=\"torso\" pos=\"0 0 0.5\">",
        "<body name=\"torso\" pos=\"0 0 0.5\"><body name=\"turned\" euler=\"0 0 1.570796\">",
    );
    let turned = turned.replace("</body>\n        </worldbody>", "</body></body></worldbody>");
    let (_folder, robot, adoption) = adopted(&turned, "xml").unwrap();
    assert!(adoption.notes.iter().any(|note| note.contains("turned by 270")), "{:?}", adoption.notes);
    assert!((robot.legs[0].sole.point.x - 0.03).abs() < 1e-5);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// A file cut off anywhere is refused or adopted, and never a panic.
    #[test]
    fn half_a_model_is_no_panic(share in 0.0..1.0f64) {
        let text = whole();
        let end = (text.len() as f64 * share) as usize;
        let end = (0..=end).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
        let _ = adopted(&text[..end], "xml");
    }
}
