//! A robot as a URDF: its tree, inertias, limits and the shapes that are seen, for programs that want one (Foxglove, RViz,
//! robot_state_publisher). Capsules become a cylinder between two spheres; meshes and planes are left out.
//!
//! Names are the model's, so that link frames in a recording find their shapes.

use std::fmt::Write;

use mujoco_rs::prelude::MjtGeomBase;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::Robot;

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
            for geom in (0..model.geom_bodyid().len()).filter(|&geom| index(model.geom_bodyid()[geom]) == link) {
                self.visual(geom, &mut text);
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

    fn visual(&self, geom: usize, text: &mut String) {
        let model = self.model();
        let [r, g, b, a] = model.geom_rgba()[geom];
        if model.geom_group()[geom] >= 3 || a <= 0.0 {
            return;
        }
        let (at, turn) = (Vector3::from(model.geom_pos()[geom]), rotation(model.geom_quat()[geom]));
        let [x, y, z] = model.geom_size()[geom];
        let mut show = |at: Vector3<f64>, shape: String| {
            let _ = writeln!(
                text,
                "    <visual>{}<geometry>{shape}</geometry><material name=\"geom_{geom}\"><color rgba=\"{r} {g} {b} {a}\"/></material></visual>",
                origin(&at, &turn)
            );
        };
        let sphere = |radius: f64| format!("<sphere radius=\"{radius}\"/>");
        let cylinder = |radius: f64, half: f64| format!("<cylinder radius=\"{radius}\" length=\"{}\"/>", 2.0 * half);
        match model.geom_type()[geom] {
            MjtGeomBase::mjGEOM_SPHERE => show(at, sphere(x)),
            MjtGeomBase::mjGEOM_CAPSULE => {
                let end = turn.column(2) * y;
                show(at, cylinder(x, y));
                show(at - end, sphere(x));
                show(at + end, sphere(x));
            }
            MjtGeomBase::mjGEOM_CYLINDER => show(at, cylinder(x, y)),
            MjtGeomBase::mjGEOM_BOX => show(at, format!("<box size=\"{} {} {}\"/>", 2.0 * x, 2.0 * y, 2.0 * z)),
            // A URDF knows no ellipsoid.
            MjtGeomBase::mjGEOM_ELLIPSOID => show(at, sphere((x * y * z).cbrt())),
            _ => {}
        }
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
