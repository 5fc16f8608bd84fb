//! The adopted model as an MJCF of its own: links, hinges, masses and capsules, no mesh, no include.
//!
//! With every joint at zero each link has the base's axes (x forward, y left, z up), whatever the source had, and a foot those of its level
//! sole: then feet, soles and axes can be read, and the engines' conventions hold.

use std::fmt::Write;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::shapes::Capsule;
use super::skeleton::Skeleton;

/// Seven digits, without a tail of zeros.
fn number(x: f64) -> String {
    let text = format!("{x:.7}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" || text.is_empty() { "0".into() } else { text.to_owned() }
}

fn vector(v: &Vector3<f64>) -> String {
    format!("{} {} {}", number(v.x), number(v.y), number(v.z))
}

/// Digits of an inertia, which may be small.
fn small(x: f64) -> String {
    format!("{x:.8e}")
}

/// Text that stands between quotes in XML.
fn quoted(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

/// The model's text; `ranges` are the joints' (rad), by link; `head` is its comment.
pub(super) fn mjcf(name: &str, head: &str, skeleton: &Skeleton, ranges: &[[f64; 2]], capsules: &[Capsule]) -> String {
    let mut text = format!("<mujoco model=\"{}\">\n  <!-- {} -->\n", quoted(name), head.replace("--", "- -"));
    text.push_str("  <compiler angle=\"radian\" autolimits=\"true\" balanceinertia=\"true\"/>\n  <worldbody>\n");
    link(&mut text, skeleton, ranges, capsules, 0, 2);
    text.push_str("  </worldbody>\n</mujoco>\n");
    text
}

fn link(text: &mut String, skeleton: &Skeleton, ranges: &[[f64; 2]], capsules: &[Capsule], at: usize, depth: usize) {
    let indent = "  ".repeat(depth);
    let link_ = &skeleton.links[at];
    let parent = link_.parent.map(|parent| &skeleton.links[parent]);
    let (from, axes) = parent.map_or((Vector3::zeros(), Matrix3::identity()), |parent| (parent.origin, parent.turn));
    let place = vector(&(axes.transpose() * (link_.origin - from)));
    // From the world's axes to the link's own.
    let own = link_.turn.transpose();
    let relative = axes.transpose() * link_.turn;
    let turned = if (relative - Matrix3::identity()).norm() < 1e-9 {
        String::new()
    } else {
        let q = UnitQuaternion::from_matrix(&relative);
        format!(" quat=\"{} {} {} {}\"", number(q.w), number(q.i), number(q.j), number(q.k))
    };
    let _ = writeln!(text, "{indent}<body name=\"{}\" pos=\"{place}\"{turned}>", quoted(&link_.name));
    match &link_.hinge {
        None => {
            let _ = writeln!(text, "{indent}  <freejoint/>");
        }
        Some(hinge) => {
            let [low, high] = ranges[at];
            let _ = writeln!(
                text,
                "{indent}  <joint name=\"{}\" axis=\"{}\" range=\"{} {}\" armature=\"{}\"/>",
                quoted(&hinge.name),
                vector(&(own * hinge.axis)),
                number(low),
                number(high),
                number(hinge.armature)
            );
        }
    }
    let i = own * link_.inertia * own.transpose();
    let full = [i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]].map(small).join(" ");
    let _ = writeln!(
        text,
        "{indent}  <inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{full}\"/>",
        vector(&(own * (link_.com - link_.origin))),
        number(link_.mass)
    );
    for capsule in capsules.iter().filter(|capsule| capsule.link == at) {
        let [a, b] = capsule.ends.map(|end| vector(&(end - link_.origin)));
        // A capsule without length is a sphere.
        let shape = if (capsule.ends[0] - capsule.ends[1]).norm() > 1e-4 {
            format!("type=\"capsule\" fromto=\"{a} {b}\"")
        } else {
            format!("type=\"sphere\" pos=\"{a}\"")
        };
        let _ = writeln!(
            text,
            "{indent}  <geom name=\"{}\" {shape} size=\"{}\" rgba=\"{}\"/>",
            quoted(&capsule.name),
            number(capsule.radius),
            if capsule.name.starts_with("left_") || capsule.name.starts_with("right_") {
                "0.25 0.45 0.75 1"
            } else {
                "0.88 0.89 0.91 1"
            },
        );
    }
    for child in (0..skeleton.links.len()).filter(|&child| skeleton.links[child].parent == Some(at)) {
        link(text, skeleton, ranges, capsules, child, depth + 1);
    }
    let _ = writeln!(text, "{indent}</body>");
}
