//! `check` on the shipped robots, on bare models, and on files that are broken in one known way.

use std::path::Path;

use instep_motion::phase::Side;
use instep_robot::check::{CheckReport, Kind, check};
use instep_robot::settings::RobotFile;
use instep_robot::{Robot, RobotError};

use crate::support::{ROBOTS, data_file, load, robot_folder};

fn details(findings: &[instep_robot::check::Finding], what: &str) -> Vec<String> {
    findings.iter().filter(|f| f.what == what).map(|f| f.detail.clone()).collect()
}

fn print(report: &CheckReport) {
    println!("{:?} {} usable {}", report.kind, report.name, report.usable);
    for finding in &report.found {
        println!("  found {}: {}", finding.what, finding.detail);
    }
    for finding in &report.missing {
        println!("  MISSING {}: {}", finding.what, finding.detail);
    }
}

/// A copy of a robot's folder with one text replaced in one file.
fn altered(robot: &str, file: &str, from: &str, to: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["robot.toml".to_owned(), format!("{robot}.xml")] {
        let text = std::fs::read_to_string(robot_folder(robot).join(&name)).unwrap();
        let text = if name == file {
            assert!(text.contains(from), "{file} has {from}");
            text.replacen(from, to, 1)
        } else {
            text
        };
        std::fs::write(folder.path().join(&name), text).unwrap();
    }
    folder
}

/// The error of a robot with one text replaced; it must name the file.
fn error_of(robot: &str, file: &str, from: &str, to: &str) -> String {
    let folder = altered(robot, file, from, to);
    let error = check(folder.path()).unwrap_err().to_string();
    assert!(error.contains(&folder.path().display().to_string()), "{error}");
    println!("{error}");
    error
}

#[test]
fn shipped_robots_are_usable_and_nothing_is_missing() {
    for name in ROBOTS {
        let report = check(&robot_folder(name)).unwrap();
        print(&report);
        assert_eq!((report.kind, report.name.as_str()), (Kind::Robot, name));
        assert!(report.usable && report.missing.is_empty(), "{name}");
        assert_eq!(check(&robot_folder(name).join("robot.toml")).unwrap(), report);
    }
}

#[test]
fn a_report_has_stable_keys() {
    let report = check(&data_file("biped/biped.urdf")).unwrap();
    let json = serde_json::to_value(&report).unwrap();
    let mut keys: Vec<&str> = json.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    assert_eq!(keys, ["found", "kind", "missing", "name", "suggested_toml", "usable"]);
    assert_eq!(json["kind"], "urdf");
    assert!(json["found"][0]["what"].is_string() && json["found"][0]["detail"].is_string());
}

/// Writes the suggestion beside its model and loads the result as a robot.
fn suggested(model: &Path) -> (CheckReport, Robot, tempfile::TempDir) {
    let report = check(model).unwrap();
    print(&report);
    let toml = report.suggested_toml.clone().unwrap();
    toml::from_str::<RobotFile>(&toml).unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(model, folder.path().join(model.file_name().unwrap())).unwrap();
    std::fs::write(folder.path().join("robot.toml"), toml).unwrap();
    let robot = Robot::load(folder.path()).unwrap_or_else(|e| panic!("{e}"));
    (report, robot, folder)
}

#[test]
fn a_bare_urdf_gets_a_robot_toml_that_loads() {
    let (report, robot, _folder) = suggested(&data_file("biped/biped.urdf"));
    assert_eq!(report.kind, Kind::Urdf);
    assert_eq!(report.name, "biped");
    assert!(!report.usable);
    assert_eq!(details(&report.found, "suggested robot.toml"), ["resolves against this model"]);
    assert_eq!(robot.joints.len(), 16);
    let leg = robot.leg(Side::Left);
    let named = |joint: usize| robot.joints[joint].name.as_str();
    assert_eq!(named(leg.hip_yaw), "left_hip_yaw");
    assert_eq!(named(leg.knee), "left_knee");
    assert_eq!(named(leg.ankle_roll.unwrap()), "left_ankle_roll");
    assert_eq!(robot.link_name(leg.thigh), "left_thigh");
    assert_eq!(robot.link_name(leg.foot), "left_foot");
    assert!(robot.contacts.len() == 8 && !leg.strike.is_empty());
    // Limits come from the URDF: effort by MuJoCo, velocity by our own reading.
    let knee = &robot.joints[leg.knee];
    assert_eq!((knee.torque, knee.speed, knee.range), (6.0, 6.0, [0.0, 2.2]));
    // What was suggested passes the check of a finished robot.
    let second = check(&_folder.path().join("robot.toml")).unwrap();
    print(&second);
    assert!(second.usable);
}

#[test]
fn legs_of_the_shipped_models_are_found_without_their_robot_toml() {
    for name in ROBOTS {
        let (_, guess, _folder) = suggested(&robot_folder(name).join(format!("{name}.xml")));
        let robot = load(name);
        assert_eq!(guess.joints.len(), robot.joints.len());
        for (a, b) in guess.legs.iter().zip(&robot.legs) {
            assert_eq!((a.hip_yaw, a.hip_roll, a.hip_pitch), (b.hip_yaw, b.hip_roll, b.hip_pitch), "{name}");
            assert_eq!((a.knee, a.ankle_pitch, a.ankle_roll, a.toe), (b.knee, b.ankle_pitch, b.ankle_roll, b.toe));
            assert_eq!((a.thigh, a.shank, a.foot, a.toe_link), (b.thigh, b.shank, b.foot, b.toe_link), "{name}");
        }
    }
}

#[test]
fn a_bare_model_with_faults_says_each_of_them() {
    let report = check(&data_file("faulty.xml")).unwrap();
    print(&report);
    assert!(!report.usable);
    assert!(!details(&report.missing, "free joint").is_empty());
    assert!(details(&report.missing, "hinge")[0].contains("slider"));
    assert!(details(&report.missing, "joint names")[0].contains('1'));
    assert!(details(&report.missing, "range")[0].contains("loose"));
    assert!(details(&report.missing, "torque limit")[0].contains("loose"));
    assert!(!details(&report.missing, "legs").is_empty());
    // The actuator's limit is found, since the joint itself has none.
    assert!(details(&report.found, "joint").iter().any(|d| d.contains("elbow") && d.contains("6 N m")));
    toml::from_str::<RobotFile>(&report.suggested_toml.unwrap()).unwrap();
}

#[test]
fn missing_meshes_are_named_and_the_rest_is_still_checked() {
    let text = std::fs::read_to_string(data_file("biped/biped.urdf")).unwrap();
    let text =
        text.replacen("<box size=\"0.12 0.2 0.2\"/>", "<mesh filename=\"package://biped/meshes/trunk.stl\"/>", 1);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("biped.urdf");
    std::fs::write(&file, text).unwrap();
    let report = check(&file).unwrap();
    print(&report);
    assert!(details(&report.missing, "mesh files")[0].contains("trunk.stl"));
    assert_eq!(details(&report.found, "leg").len(), 2);
}

#[test]
fn meshes_of_a_ros_package_are_found_near_the_urdf() {
    // The layout of a ROS package: <package>/urdf/x.urdf names package://<package>/meshes/y.obj.
    let text = std::fs::read_to_string(data_file("biped/biped.urdf")).unwrap();
    let mesh = "<mesh filename=\"package://biped/meshes/trunk.obj\"/>";
    let text = text.replacen("<box size=\"0.12 0.2 0.2\"/>", mesh, 1);
    let package = tempfile::tempdir().unwrap();
    std::fs::create_dir(package.path().join("urdf")).unwrap();
    std::fs::create_dir(package.path().join("meshes")).unwrap();
    let tetrahedron = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::fs::write(package.path().join("meshes/trunk.obj"), tetrahedron).unwrap();
    let file = package.path().join("urdf/biped.urdf");
    std::fs::write(&file, text).unwrap();
    let report = check(&file).unwrap();
    print(&report);
    assert!(details(&report.missing, "mesh files").is_empty());
    assert_eq!(details(&report.found, "suggested robot.toml"), ["resolves against this model"]);
}

#[test]
fn a_urdf_called_xml_is_still_a_urdf() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("robot.xml");
    std::fs::copy(data_file("biped/biped.urdf"), &file).unwrap();
    let report = check(&file).unwrap();
    assert_eq!(report.kind, Kind::Urdf);
    std::fs::write(folder.path().join("robot.toml"), report.suggested_toml.unwrap()).unwrap();
    assert_eq!(Robot::load(folder.path()).unwrap().joints.len(), 16);
}

#[test]
fn files_that_are_not_there_are_named() {
    for path in ["no_such_folder", "no_such.toml", "no_such.xml", "no_such.urdf", "no_such.stl"] {
        let error = check(&data_file(path)).unwrap_err();
        assert!(matches!(error, RobotError::Read { .. }), "{error}");
        assert!(error.to_string().contains(path));
    }
    let error = check(&data_file("biped")).unwrap_err().to_string();
    assert!(error.contains("robot.toml"), "{error}");
    let error = check(&data_file("prestoe_pinocchio.json")).unwrap_err().to_string();
    assert!(error.contains(".json") && error.contains("URDF"), "{error}");
    let error = error_of("prestoe", "robot.toml", "model = \"prestoe.xml\"", "model = \"presto.xml\"");
    assert!(error.contains("presto.xml"));
}

#[test]
fn names_that_do_not_exist_are_met_with_the_nearest() {
    let error = error_of("prestoe", "robot.toml", "knee = \"left_knee\"", "knee = \"left_kne\"");
    assert!(error.contains("leg.left.knee") && error.contains("nearest is \"left_knee\""), "{error}");
    let error = error_of("prestoe", "robot.toml", "foot = \"left_foot\"", "foot = \"left_foo\"");
    assert!(error.contains("leg.left.foot") && error.contains("nearest is \"left_foot\""), "{error}");
    let error = error_of("prestoe", "robot.toml", "[\"left_instep\",", "[\"left_insteb\",");
    assert!(error.contains("leg.left.strike") && error.contains("nearest is \"left_instep\""), "{error}");
    let error = error_of("nao", "robot.toml", "link = \"torso\"\nimu", "link = \"Torso\"\nimu");
    assert!(error.contains("base.link") && error.contains("\"torso\""), "{error}");
    let error = error_of("nao", "robot.toml", "link = \"torso\"\nimu", "link = \"LThigh\"\nimu");
    assert!(error.contains("base.link") && error.contains("the link with the free joint, \"torso\""), "{error}");
}

#[test]
fn settings_that_cannot_be_are_refused_with_their_field() {
    let toml = "robot.toml";
    let error = error_of("prestoe", toml, "imu = [0.0, 0.0, 0.05]", "imu = [0.0, nan, 0.05]");
    assert!(error.contains("base.imu[1]") && error.contains("NaN"), "{error}");
    let error = error_of("prestoe", toml, "radius = 0.008", "radius = inf");
    assert!(error.contains("contact[0].radius"), "{error}");
    let error = error_of("prestoe", toml, "speed = 20.0", "speed = -20.0");
    assert!(error.contains("group[0].speed"), "{error}");
    let error = error_of("prestoe", toml, "corner = 0.9", "corner = 1.0");
    assert!(error.contains("group[0].corner"), "{error}");
    let error = error_of("prestoe", toml, "left_knee = 0.5", "left_knee = 5.0");
    assert!(error.contains("stand.left_knee") && error.contains("[0, 2.5]"), "{error}");
    let error = error_of("prestoe", toml, "title = ", "colour = \"white\"\ntitle = ");
    assert!(error.contains("unknown field") && error.contains("colour"), "{error}");
    let error = error_of("prestoe", toml, "link = \"pelvis\"", "link = \"pel\\u0000vis\"");
    assert!(error.contains("base.link") && error.contains("NUL"), "{error}");
    let error = error_of("prestoe", toml, "name = \"left_heel_point\"", "name = \"left_heel\"");
    assert!(error.contains("no other geom"), "{error}");
    let error = error_of("prestoe", toml, "\"left_toe\", \"right_toe\"]", "\"left_toe\"]");
    assert!(error.contains("right_toe") && error.contains("no group"), "{error}");
}

#[test]
fn models_that_cannot_be_are_refused_with_their_file() {
    let error = error_of("prestoe", "prestoe.xml", "<freejoint name=\"root\"/>", "");
    assert!(error.contains("free joint"), "{error}");
    let error = error_of("prestoe", "prestoe.xml", "</worldbody>", "</worldbod>");
    assert!(error.contains("prestoe.xml") && error.contains("MuJoCo"), "{error}");
    let error = error_of("prestoe", "prestoe.xml", "mass=\"4.2\"", "mass=\"nan\"");
    assert!(error.contains("prestoe.xml") && error.contains("line 15") && error.contains("nan"), "{error}");
    let error = error_of("prestoe", "prestoe.xml", "pos=\"0 0.085 0\"", "pos=\"0 inf 0\"");
    assert!(error.contains("inf"), "{error}");
    let error = error_of("prestoe", "prestoe.xml", "name=\"left_knee\" axis", "name=\"left_knee\" type=\"slide\" axis");
    assert!(error.contains("left_knee") && error.contains("hinge"), "{error}");
}

#[test]
fn a_pose_that_falls_over_and_gains_that_shake_are_told() {
    let folder = altered("prestoe", "robot.toml", "name", "name");
    let file = folder.path().join("robot.toml");
    let mut settings: RobotFile = toml::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    // Leaning back at the hips with level feet: the torso's weight goes behind the heels.
    for side in ["left", "right"] {
        settings.stand.insert(format!("{side}_hip_pitch"), 0.9);
        settings.stand.insert(format!("{side}_knee"), 0.0);
        settings.stand.insert(format!("{side}_ankle_pitch"), -0.9);
    }
    let toe = settings.group.iter_mut().find(|group| group.name == "toe").unwrap();
    toe.kd *= 10.0;
    std::fs::write(&file, toml::to_string(&settings).unwrap()).unwrap();
    let report = check(folder.path()).unwrap();
    print(&report);
    assert!(!report.usable);
    assert!(details(&report.missing, "stand")[0].contains("mm outside the support"));
    assert!(details(&report.missing, "gains").iter().any(|d| d.contains("toe")));
}

#[test]
fn limits_of_the_two_sides_are_compared() {
    let folder = altered("prestoe", "prestoe.xml", "range=\"0 2.5\"", "range=\"0 1.5\"");
    let report = check(folder.path()).unwrap();
    assert!(report.usable);
    assert!(details(&report.missing, "sides")[0].contains("left_knee"));
}
