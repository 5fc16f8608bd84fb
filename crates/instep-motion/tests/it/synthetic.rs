//! A motion of our own, from formulas: a player lowers the left foot to the ground and kicks with the right one.
//! 48 frames at 60 Hz. It is written as ASF and AMC and as BVH by code that shares nothing with the readers; the
//! files in `tests/data` were made by `cargo test -p instep-motion --test it -- --ignored write_data`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use instep_motion::clip::{Bone, Clip, Frame, Skeleton};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

pub(crate) const RATE: f64 = 60.0;

pub(crate) fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// ASF name, BVH name, parent, end in its own frame (m). A bone starts where its parent ends.
type Row = (&'static str, &'static str, Option<usize>, [f64; 3]);

const BONES: [Row; 21] = [
    ("root", "Hips", None, [0.0, 0.0, 0.0]),
    ("lhipjoint", "LHipJoint", Some(0), [0.0, 0.09, -0.08]),
    ("lfemur", "LeftUpLeg", Some(1), [0.0, 0.0, -0.42]),
    ("ltibia", "LeftLeg", Some(2), [0.0, 0.0, -0.41]),
    ("lfoot", "LeftFoot", Some(3), [0.12, 0.0, -0.05]),
    ("ltoes", "LeftToeBase", Some(4), [0.07, 0.0, 0.0]),
    ("rhipjoint", "RHipJoint", Some(0), [0.0, -0.09, -0.08]),
    ("rfemur", "RightUpLeg", Some(6), [0.0, 0.0, -0.42]),
    ("rtibia", "RightLeg", Some(7), [0.0, 0.0, -0.41]),
    ("rfoot", "RightFoot", Some(8), [0.12, 0.0, -0.05]),
    ("rtoes", "RightToeBase", Some(9), [0.07, 0.0, 0.0]),
    ("thorax", "Spine", Some(0), [0.0, 0.0, 0.45]),
    ("head", "Head", Some(11), [0.0, 0.0, 0.25]),
    ("lclavicle", "LeftShoulder", Some(11), [0.0, 0.18, 0.0]),
    ("lhumerus", "LeftArm", Some(13), [0.0, 0.28, 0.0]),
    ("lradius", "LeftForeArm", Some(14), [0.0, 0.25, 0.0]),
    ("lhand", "LeftHand", Some(15), [0.0, 0.18, 0.0]),
    ("rclavicle", "RightShoulder", Some(11), [0.0, -0.18, 0.0]),
    ("rhumerus", "RightArm", Some(17), [0.0, -0.28, 0.0]),
    ("rradius", "RightForeArm", Some(18), [0.0, -0.25, 0.0]),
    ("rhand", "RightHand", Some(19), [0.0, -0.18, 0.0]),
];

fn bone(name: &str) -> usize {
    BONES.iter().position(|row| row.0 == name).unwrap()
}

pub(crate) fn skeleton() -> Skeleton {
    let end = |i: usize| Vector3::from(BONES[i].3);
    let bones = BONES.iter().map(|(name, _, parent, tip)| Bone {
        name: (*name).to_owned(),
        parent: *parent,
        origin: parent.map_or_else(Vector3::zeros, end),
        tip: Vector3::from(*tip),
    });
    Skeleton { bones: bones.collect() }
}

/// From 0 before `from` to 1 after `to`, smooth.
fn ramp(t: f64, from: f64, to: f64) -> f64 {
    let s = ((t - from) / (to - from)).clamp(0.0, 1.0);
    s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
}

/// When the left foot has come down, and when the right foot is about fastest, s.
pub(crate) const PLANT: f64 = 0.22;
pub(crate) const IMPACT: f64 = 0.5;

pub(crate) fn clip() -> Clip {
    let skeleton = skeleton();
    let frames = (0..48).map(|i| {
        let t = f64::from(i) / RATE;
        let mut rotations = vec![UnitQuaternion::identity(); skeleton.bones.len()];
        let mut turn = |name: &str, x: f64, y: f64, z: f64| {
            rotations[bone(name)] = UnitQuaternion::from_euler_angles(x, y, z);
        };
        // About y, a positive angle swings a hanging limb back.
        let lift = 1.0 - ramp(t, 0.0, PLANT);
        turn("lfemur", 0.0, -0.9 * lift, 0.0);
        turn("ltibia", 0.0, 1.3 * lift, 0.0);
        turn("lfoot", 0.0, -0.4 * lift, 0.0);
        let (back, forward) = (ramp(t, 0.05, 0.35), ramp(t, 0.33, 0.62));
        turn("rfemur", 0.1 * back, 0.6 * back - 1.5 * forward, 0.2 * forward);
        turn("rtibia", 0.0, 1.4 * back - 1.2 * ramp(t, 0.4, 0.6), 0.0);
        turn("rfoot", 0.05, 0.6 * back, -0.1);
        turn("rtoes", 0.0, 0.1 * forward, 0.0);
        turn("thorax", 0.05 * back, 0.2 * forward, 0.3 * back - 0.5 * forward);
        turn("head", 0.0, 0.3, 0.1);
        turn("lhumerus", -1.0 + 0.5 * back, 0.2, -0.6 * back);
        turn("rhumerus", 1.0, -0.2, 0.4 * forward);
        turn("lradius", 0.0, 0.0, -0.5);
        turn("rradius", 0.0, 0.0, 0.7 * back);
        // The whole player looks 0.4 rad to the left of x and stands on ground 3 cm above zero.
        let world_from_root = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.4);
        rotations[0] = world_from_root;
        Frame { root: Vector3::new(0.3, -0.2, 0.03 + 0.02 + 0.05 + 0.41 + 0.42 + 0.08), rotations }
    });
    let frames = frames.collect();
    Clip { skeleton, rate: RATE, frames }
}

/// Our axes to the file's: its x, y, z are our y, z, x.
fn to_file(v: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.y, v.z, v.x)
}

fn rotation_to_file(q: &UnitQuaternion<f64>) -> Rotation3<f64> {
    let p = Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0);
    Rotation3::from_matrix_unchecked(p * q.to_rotation_matrix().matrix() * p.transpose())
}

/// Angles x, y, z (degrees) with `r = Rz Ry Rx`.
fn angles_zyx(r: &Rotation3<f64>) -> [f64; 3] {
    let (x, y, z) = r.euler_angles();
    [x, y, z].map(f64::to_degrees)
}

/// Angles x, y, z (degrees) with `r = Rx Ry Rz`.
fn angles_xyz(r: &Rotation3<f64>) -> [f64; 3] {
    angles_zyx(&r.inverse()).map(|angle| -angle)
}

/// Angles z, x, y (degrees) with `r = Rz Rx Ry`.
fn angles_zxy(r: &Rotation3<f64>) -> [f64; 3] {
    let m = r.matrix();
    let x = m[(2, 1)].asin();
    [(-m[(0, 1)]).atan2(m[(1, 1)]), x, (-m[(2, 0)]).atan2(m[(2, 2)])].map(f64::to_degrees)
}

/// How the ASF tells each bone's axis: angles in degrees and whether the order is ZYX instead of XYZ.
fn asf_axis(name: &str) -> ([f64; 3], bool) {
    match name {
        "lfemur" => ([0.0, 0.0, 20.0], false),
        "rfemur" => ([0.0, 0.0, -20.0], false),
        "lhumerus" => ([180.0, -30.0, -90.0], false),
        "rhumerus" => ([25.0, 40.0, -70.0], true),
        "root" => ([10.0, 20.0, -30.0], false),
        _ => ([0.0; 3], false),
    }
}

fn axis_rotation(([x, y, z], reversed): ([f64; 3], bool)) -> Rotation3<f64> {
    let [x, y, z] = [x, y, z].map(f64::to_radians);
    if reversed {
        // First z, then y, then x.
        Rotation3::from_axis_angle(&Vector3::x_axis(), x)
            * Rotation3::from_axis_angle(&Vector3::y_axis(), y)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), z)
    } else {
        Rotation3::from_euler_angles(x, y, z)
    }
}

const LENGTH_UNIT: f64 = 0.45;
const METRES: f64 = 0.0254 / LENGTH_UNIT;
const ROOT_POSITION: [f64; 3] = [1.0, 2.0, 3.0];

pub(crate) fn asf() -> String {
    let mut s = String::from("# synthetic kick, made by tests/it/synthetic.rs\n:version 1.10\n:name KICK\n:units\n");
    write!(s, "  mass 1.0\n  length {LENGTH_UNIT}\n  angle deg\n:documentation\n   free text: begin end\n").unwrap();
    let [x, y, z] = asf_axis("root").0;
    s += ":root\n   order TZ TX TY RZ RY RX\n   axis XYZ\n";
    write!(s, "   position 1 2 3\n   orientation {x} {y} {z}\n:bonedata\n").unwrap();
    for (i, (name, _, _, tip)) in BONES.iter().enumerate().skip(1) {
        let tip = to_file(Vector3::from(*tip));
        let (d, length) = (tip.normalize(), tip.norm() / METRES);
        let ([x, y, z], reversed) = asf_axis(name);
        write!(s, "  begin\n     id {i}\n     name {name}\n     direction {:.9} {:.9} {:.9}\n", d.x, d.y, d.z).unwrap();
        let order = if reversed { "ZYX" } else { "XYZ" };
        write!(s, "     length {length:.9}\n     axis {x} {y} {z}  {order}\n").unwrap();
        if let Some(dof) = asf_dof(name) {
            write!(s, "    dof {dof}\n    limits (-180.0 180.0)\n           (-180.0 180.0)\n").unwrap();
        }
        s += "  end\n";
    }
    s += ":hierarchy\n  begin\n";
    for (i, (name, ..)) in BONES.iter().enumerate() {
        let children: Vec<_> = BONES.iter().filter(|row| row.2 == Some(i)).map(|row| row.0).collect();
        if !children.is_empty() {
            writeln!(s, "    {name} {}", children.join(" ")).unwrap();
        }
    }
    s + "  end\n"
}

/// Knees bend about x only, one bone has its angles in another order, and some cannot move.
fn asf_dof(name: &str) -> Option<&'static str> {
    match name {
        "lhipjoint" | "rhipjoint" | "lclavicle" | "rclavicle" => None,
        "ltibia" | "rtibia" | "rtoes" => Some("rx"),
        "thorax" => Some("rz ry rx"),
        _ => Some("rx ry rz"),
    }
}

pub(crate) fn amc(clip: &Clip) -> String {
    let mut s = String::from("#!OML:ASF synthetic\n:FULLY-SPECIFIED\n:DEGREES\n");
    for (i, frame) in clip.frames.iter().enumerate() {
        writeln!(s, "{}", i + 1).unwrap();
        for (name, q) in BONES.iter().map(|row| row.0).zip(&frame.rotations) {
            let c = axis_rotation(asf_axis(name));
            let r = c.inverse() * rotation_to_file(q) * c;
            let [x, y, z] = angles_zyx(&r);
            if name == "root" {
                let p = to_file(frame.root) / METRES - Vector3::from(ROOT_POSITION);
                writeln!(s, "root {:.7} {:.7} {:.7} {z:.7} {y:.7} {x:.7}", p.z, p.x, p.y).unwrap();
                continue;
            }
            match asf_dof(name) {
                Some("rx") => writeln!(s, "{name} {x:.7}").unwrap(),
                Some("rz ry rx") => {
                    let [x, y, z] = angles_xyz(&r);
                    writeln!(s, "{name} {z:.7} {y:.7} {x:.7}").unwrap();
                }
                Some(_) => writeln!(s, "{name} {x:.7} {y:.7} {z:.7}").unwrap(),
                None => {}
            }
        }
    }
    s
}

/// Centimetres, names as Mixamo has them.
pub(crate) fn bvh(clip: &Clip) -> String {
    let mut s = String::from("HIERARCHY\n");
    joint(&mut s, 0, 0);
    writeln!(s, "MOTION\nFrames: {}\nFrame Time: 0.0166667", clip.frames.len()).unwrap();
    for frame in &clip.frames {
        let root = to_file(frame.root) * 100.0;
        write!(s, "{:.6} {:.6} {:.6}", root.x, root.y, root.z).unwrap();
        for i in order(0) {
            let r = rotation_to_file(&frame.rotations[i]);
            let angles = if BONES[i].0 == "thorax" { angles_xyz(&r) } else { angles_zxy(&r) };
            for angle in angles {
                write!(s, " {angle:.7}").unwrap();
            }
        }
        s.push('\n');
    }
    s
}

fn children(i: usize) -> impl Iterator<Item = usize> {
    (0..BONES.len()).filter(move |child| BONES[*child].2 == Some(i))
}

/// Bones in the order of the BVH's channels.
fn order(i: usize) -> Vec<usize> {
    std::iter::once(i).chain(children(i).flat_map(order)).collect()
}

fn joint(s: &mut String, i: usize, depth: usize) {
    let pad = "  ".repeat(depth);
    let kind = if i == 0 { "ROOT" } else { "JOINT" };
    let offset = BONES[i].2.map_or_else(Vector3::zeros, |parent| to_file(Vector3::from(BONES[parent].3)) * 100.0);
    write!(s, "{pad}{kind} mixamorig:{}\n{pad}{{\n", BONES[i].1).unwrap();
    writeln!(s, "{pad}  OFFSET {:.6} {:.6} {:.6}", offset.x, offset.y, offset.z).unwrap();
    let channels = match BONES[i].0 {
        "root" => "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
        "thorax" => "3 Xrotation Yrotation Zrotation",
        _ => "3 Zrotation Xrotation Yrotation",
    };
    writeln!(s, "{pad}  CHANNELS {channels}").unwrap();
    let mut end = true;
    for child in children(i) {
        joint(s, child, depth + 1);
        end = false;
    }
    if end {
        let tip = to_file(Vector3::from(BONES[i].3)) * 100.0;
        write!(s, "{pad}  End Site\n{pad}  {{\n{pad}    OFFSET {:.6} {:.6} {:.6}\n{pad}  }}\n", tip.x, tip.y, tip.z)
            .unwrap();
    }
    writeln!(s, "{pad}}}").unwrap();
}

#[test]
#[ignore = "writes tests/data"]
fn write_data() {
    let clip = clip();
    std::fs::create_dir_all(data("")).unwrap();
    // The skeleton with the line ends of CMU's files, the others with plain ones.
    std::fs::write(data("kick.asf"), asf().replace('\n', "\r\n")).unwrap();
    std::fs::write(data("kick_01.amc"), amc(&clip)).unwrap();
    std::fs::write(data("kick.bvh"), bvh(&clip)).unwrap();
}
