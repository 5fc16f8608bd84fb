//! A robot as a URDF: its tree, inertias, limits and the shapes that are seen, for programs that want one (Foxglove, RViz,
//! robot_state_publisher). Capsules become a cylinder between two spheres. Which shapes are seen:
//! [`crate::Visible`].
//!
//! Names are the model's, so that link frames in a recording find their shapes.

use std::fmt::Write;

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::Robot;
use crate::visible::{Form, Visible};

impl Robot {
    /// The robot as a URDF; its root is the base link.
    #[must_use]
    pub fn urdf(&self) -> String {
        let model = self.model();
        let index = |id: i32| usize::try_from(id).unwrap_or(0);
        let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", quoted(&self.name));
        for link in self.base..model.body_parentid().len() {
            if link != self.base && index(model.body_parentid()[link]) == 0 {
                continue;
            }
            let name = quoted(self.link_name(link));
            let turn = rotation(model.body_iquat()[link]);
            let inertia = turn * Matrix3::from_diagonal(&Vector3::from(model.body_inertia()[link])) * turn.transpose();
            let _ = writeln!(
                text,
                "  <link name=\"{name}\">\n    <inertial>{}<mass value=\"{}\"/><inertia ixx=\"{}\" iyy=\"{}\" izz=\"{}\" ixy=\"{}\" ixz=\"{}\" iyz=\"{}\"/></inertial>",
                origin(&Vector3::from(model.body_ipos()[link]), &Matrix3::identity()),
                model.body_mass()[link],
                inertia[(0, 0)],
                inertia[(1, 1)],
                inertia[(2, 2)],
                inertia[(0, 1)],
                inertia[(0, 2)],
                inertia[(1, 2)],
            );
            for part in self.visible().filter(|part| part.link == link) {
                visual(&part, &mut text);
            }
            text.push_str("  </link>\n");
            if link == self.base {
                continue;
            }
            let parent = quoted(self.link_name(index(model.body_parentid()[link])));
            let place = origin(&Vector3::from(model.body_pos()[link]), &rotation(model.body_quat()[link]));
            let joint = (1..model.jnt_bodyid().len()).find(|&joint| index(model.jnt_bodyid()[joint]) == link);
            match joint.and_then(|joint| Some((joint, self.joints.get(joint - 1)?))) {
                None => {
                    let _ = writeln!(
                        text,
                        "  <joint name=\"{name}_fixed\" type=\"fixed\">{place}<parent link=\"{parent}\"/><child link=\"{name}\"/></joint>"
                    );
                }
                Some((id, joint)) => {
                    let [x, y, z] = model.jnt_axis()[id];
                    let [low, high] = joint.range;
                    let _ = writeln!(
                        text,
                        "  <joint name=\"{}\" type=\"revolute\">{place}<parent link=\"{parent}\"/><child link=\"{name}\"/><axis xyz=\"{x} {y} {z}\"/>\
                         <limit lower=\"{low}\" upper=\"{high}\" effort=\"{}\" velocity=\"{}\"/></joint>",
                        quoted(&joint.name),
                        joint.torque,
                        joint.speed,
                    );
                }
            }
        }
        text.push_str("</robot>\n");
        text
    }
}

fn visual(part: &Visible, text: &mut String) {
    let [r, g, b, a] = part.color;
    let (at, turn) = (part.position, part.rotation.to_rotation_matrix().into_inner());
    let mut show = |at: Vector3<f64>, shape: String| {
        let _ = writeln!(
            text,
            "    <visual>{}<geometry>{shape}</geometry><material name=\"geom_{}\"><color rgba=\"{r} {g} {b} {a}\"/></material></visual>",
            origin(&at, &turn),
            part.geom
        );
    };
    let sphere = |radius: f64| format!("<sphere radius=\"{radius}\"/>");
    let cylinder = |radius: f64, half: f64| format!("<cylinder radius=\"{radius}\" length=\"{}\"/>", 2.0 * half);
    match part.form {
        Form::Sphere(radius) => show(at, sphere(radius)),
        Form::Capsule(radius, half) => {
            let end = turn.column(2) * half;
            show(at, cylinder(radius, half));
            show(at - end, sphere(radius));
            show(at + end, sphere(radius));
        }
        Form::Cylinder(radius, half) => show(at, cylinder(radius, half)),
        Form::Box([x, y, z]) => show(at, format!("<box size=\"{} {} {}\"/>", 2.0 * x, 2.0 * y, 2.0 * z)),
        // A URDF knows no ellipsoid.
        Form::Ellipsoid([x, y, z]) => show(at, sphere((x * y * z).cbrt())),
    }
}

fn rotation([w, x, y, z]: [f64; 4]) -> Matrix3<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)).to_rotation_matrix().into_inner()
}

/// An origin; URDF's angles turn about the fixed axes x, y, z in this order.
fn origin(at: &Vector3<f64>, turn: &Matrix3<f64>) -> String {
    let (roll, pitch, yaw) = nalgebra::Rotation3::from_matrix_unchecked(*turn).euler_angles();
    format!("<origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/>", at.x, at.y, at.z)
}

/// Text that stands between quotes in XML.
fn quoted(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
