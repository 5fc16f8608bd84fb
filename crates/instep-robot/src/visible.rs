//! What can be seen of a robot: its model's geoms, for a replay, a robot description, a rendered camera.
//!
//! Geoms of MuJoCo's hidden groups (3 and up), transparent ones and planes are left out; a mesh is the box around it.

use mujoco_rs::prelude::MjtGeomBase;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::Robot;

/// A visible part of a robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visible {
    /// The geom that it is.
    pub geom: usize,
    /// The link that carries it.
    pub link: usize,
    /// Its form.
    pub form: Form,
    /// Its middle in the link's frame, m.
    pub position: Vector3<f64>,
    /// `link_from_part`.
    pub rotation: UnitQuaternion<f64>,
    /// Red, green, blue and opacity as in the model file, 0 to 1.
    pub color: [f32; 4],
}

/// A part's form about its middle, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// Radius.
    Sphere(f64),
    /// Radius, and half the length between the ends' centres, along z.
    Capsule(f64, f64),
    /// Radius and half length, along z.
    Cylinder(f64, f64),
    /// Half sides along x, y, z.
    Box([f64; 3]),
    /// Half axes along x, y, z.
    Ellipsoid([f64; 3]),
}

impl Robot {
    /// What can be seen of it, in the order of its model's geoms.
    pub fn visible(&self) -> impl Iterator<Item = Visible> + '_ {
        let model = self.model();
        (0..model.geom_type().len()).filter_map(move |geom| {
            let link = usize::try_from(model.geom_bodyid()[geom]).ok().filter(|link| *link > 0)?;
            let color = model.geom_rgba()[geom];
            if model.geom_group()[geom] >= 3 || color[3] <= 0.0 {
                return None;
            }
            let [a, b, c] = model.geom_size()[geom];
            let [w, x, y, z] = model.geom_quat()[geom];
            let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
            let mut position = Vector3::from(model.geom_pos()[geom]);
            let form = match model.geom_type()[geom] {
                MjtGeomBase::mjGEOM_SPHERE => Form::Sphere(a),
                MjtGeomBase::mjGEOM_CAPSULE => Form::Capsule(a, b),
                MjtGeomBase::mjGEOM_CYLINDER => Form::Cylinder(a, b),
                MjtGeomBase::mjGEOM_BOX => Form::Box([a, b, c]),
                MjtGeomBase::mjGEOM_ELLIPSOID => Form::Ellipsoid([a, b, c]),
                MjtGeomBase::mjGEOM_MESH => {
                    let [x, y, z, half @ ..] = model.geom_aabb()[geom];
                    position += rotation * Vector3::new(x, y, z);
                    Form::Box(half)
                }
                _ => return None,
            };
            Some(Visible { geom, link, form, position, rotation, color })
        })
    }
}
