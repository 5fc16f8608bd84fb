//! A robot as loaded: the compiled model, and every role of `robot.toml` resolved to an index in it.
//!
//! The model on disk may be any MJCF with one free joint and hinges, or a URDF (its root link is given the free
//! joint). Its actuators are not used: drives with torque and speed limits belong to the world. Contact points are
//! added as small spheres named after `[[contact]]`, so a model needs no special geoms for its feet.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use instep_motion::phase::Side;
use mujoco_rs::prelude::*;
use mujoco_rs::wrappers::mj_editing::{MjSpec, SpecItem};
use nalgebra::Vector3;

use crate::RobotError;
use crate::settings::{LegFile, PointFile, RobotFile};

/// One actuated joint. Its position in [`Robot::joints`] is its index in every joint vector.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// The model's name for it.
    pub name: String,
    /// Index into [`Robot::groups`].
    pub group: usize,
    /// Least and greatest angle, rad.
    pub range: [f64; 2],
    /// Largest torque, N m.
    pub torque: f64,
    /// Largest speed, rad/s.
    pub speed: f64,
    /// Share of the speed limit from which the torque falls; see [`crate::control::torque_range`].
    pub corner: f64,
    /// Drive stiffness, N m/rad.
    pub kp: f64,
    /// Drive damping, N m s/rad.
    pub kd: f64,
}

/// A point fixed to a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkPoint {
    /// MuJoCo body index of the link.
    pub link: usize,
    /// The point in the link's frame, m.
    pub point: Vector3<f64>,
}

/// One leg; joints are indices into [`Robot::joints`], links are MuJoCo body indices.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// Hip yaw joint.
    pub hip_yaw: usize,
    /// Hip roll joint.
    pub hip_roll: usize,
    /// Hip pitch joint.
    pub hip_pitch: usize,
    /// Knee joint.
    pub knee: usize,
    /// Ankle pitch joint.
    pub ankle_pitch: usize,
    /// Ankle roll joint.
    pub ankle_roll: usize,
    /// Toe joint, where there is one.
    pub toe: Option<usize>,
    /// Link between hip and knee.
    pub thigh: usize,
    /// Link between knee and ankle.
    pub shank: usize,
    /// Link that carries the sole.
    pub foot: usize,
    /// Link in front of the toe joint, where there is one.
    pub toe_link: Option<usize>,
    /// Centre of the sole; its frame has the foot's axes.
    pub sole: LinkPoint,
    /// Geom indices that may strike the ball, the usual striking part first.
    pub strike: Vec<usize>,
}

impl Leg {
    /// Its joints from hip to toe.
    pub fn joints(&self) -> impl Iterator<Item = usize> {
        [self.hip_yaw, self.hip_roll, self.hip_pitch, self.knee, self.ankle_pitch, self.ankle_roll]
            .into_iter()
            .chain(self.toe)
    }
}

/// A contact point: a small sphere fixed to a foot or toe.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactPoint {
    /// Its name.
    pub name: String,
    /// The leg it belongs to.
    pub leg: Side,
    /// The sphere's centre.
    pub at: LinkPoint,
    /// The sphere's radius, m.
    pub radius: f64,
    /// Index of the sphere's geom.
    pub geom: usize,
}

/// A robot. Immutable; shared between threads.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Short name.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// Actuated joints, in the model's order.
    pub joints: Vec<Joint>,
    /// Names of the joint groups.
    pub groups: Vec<String>,
    /// MuJoCo body index of the base link.
    pub base: usize,
    /// The inertial sensor, with the base link's axes.
    pub imu: LinkPoint,
    /// Left leg, right leg.
    pub legs: [Leg; 2],
    /// Contact points of both feet.
    pub contacts: Vec<ContactPoint>,
    /// Pairs of geom indices that must not touch; capsules or spheres.
    pub self_collision: Vec<[usize; 2]>,
    /// Human landmark name and the point that follows it.
    pub landmarks: Vec<(String, LinkPoint)>,
    /// `q` of the standing pose with the lowest contact point on the ground, heading along x, at the origin.
    pub stand: Vec<f64>,
    model: Arc<MjModel>,
    model_file: PathBuf,
    file: RobotFile,
}

impl Robot {
    /// Loads a robot from its folder or its `robot.toml`.
    ///
    /// # Errors
    /// When a file is missing, is not what it should be, or names a part that the model does not have: each error
    /// names the file, the field, what stands there and what would be right.
    pub fn load(path: &Path) -> Result<Self, RobotError> {
        let file = if path.is_dir() { path.join("robot.toml") } else { path.to_owned() };
        let text = std::fs::read_to_string(&file).map_err(|source| RobotError::Read { file: file.clone(), source })?;
        let settings: RobotFile = toml::from_str(&text)
            .map_err(|e| RobotError::Settings { file: file.clone(), detail: e.to_string().trim_end().to_owned() })?;
        let model_file = file.parent().unwrap_or(Path::new(".")).join(&settings.model);
        Self::resolve(&file, model_file, settings)
    }

    pub(crate) fn resolve(file: &Path, model_file: PathBuf, settings: RobotFile) -> Result<Self, RobotError> {
        sane(file, &settings)?;
        let mut spec = spec(file, &model_file, &settings)?;
        let model =
            spec.compile().map_err(|e| RobotError::Model { file: model_file.clone(), detail: e.to_string() })?;
        let names = Names { file, model: &model };

        let base = names.link("base.link", &settings.base.link)?;
        let free = model.jnt_bodyid().first().map_or(base, |&link| usize::try_from(link).unwrap_or(0));
        if free != base && model.jnt_type().first() == Some(&MjtJoint::mjJNT_FREE) {
            let right = model.id_to_name(MjtObjBase::mjOBJ_BODY, free).unwrap_or_default();
            let found = format!("\"{}\"", settings.base.link);
            return Err(names.wrong("base.link", found, format!("the link with the free joint, \"{right}\"")));
        }
        let (joints, groups) = joints(&names, &model_file, &settings)?;
        let index = |field: &str, name: &str| joint_index(&names, &joints, field, name);
        let leg = |side: &str, leg: &LegFile| -> Result<Leg, RobotError> {
            let field = |part: &str| format!("leg.{side}.{part}");
            let joint = |part: &str, name: &str| index(&field(part), name);
            let foot = names.link(&field("foot"), &leg.foot)?;
            Ok(Leg {
                hip_yaw: joint("hip_yaw", &leg.hip_yaw)?,
                hip_roll: joint("hip_roll", &leg.hip_roll)?,
                hip_pitch: joint("hip_pitch", &leg.hip_pitch)?,
                knee: joint("knee", &leg.knee)?,
                ankle_pitch: joint("ankle_pitch", &leg.ankle_pitch)?,
                ankle_roll: joint("ankle_roll", &leg.ankle_roll)?,
                toe: leg.toe.as_deref().map(|name| joint("toe", name)).transpose()?,
                thigh: names.link(&field("thigh"), &leg.thigh)?,
                shank: names.link(&field("shank"), &leg.shank)?,
                foot,
                toe_link: leg.toe_link.as_deref().map(|name| names.link(&field("toe_link"), name)).transpose()?,
                sole: LinkPoint { link: foot, point: leg.sole.into() },
                strike: leg.strike.iter().map(|name| names.geom(&field("strike"), name)).collect::<Result<_, _>>()?,
            })
        };
        let legs = [leg("left", &settings.leg.left)?, leg("right", &settings.leg.right)?];
        let contacts = settings
            .contact
            .iter()
            .enumerate()
            .map(|(i, contact)| {
                Ok(ContactPoint {
                    name: contact.name.clone(),
                    leg: contact.leg,
                    at: LinkPoint {
                        link: names.link(&format!("contact[{i}].link"), &contact.link)?,
                        point: contact.point.into(),
                    },
                    radius: contact.radius,
                    geom: names.geom(&format!("contact[{i}].name"), &contact.name)?,
                })
            })
            .collect::<Result<Vec<_>, RobotError>>()?;
        let self_collision = self_collision(&names, &settings)?;
        let point = |field: &str, at: &PointFile| -> Result<LinkPoint, RobotError> {
            Ok(LinkPoint { link: names.link(&format!("{field}.link"), &at.link)?, point: at.point.into() })
        };
        let landmarks = settings
            .landmark
            .iter()
            .map(|(name, at)| Ok((name.clone(), point(&format!("landmark.{name}"), at)?)))
            .collect::<Result<_, RobotError>>()?;
        let mut stand = vec![0.0; 7 + joints.len()];
        stand[3] = 1.0;
        for (name, &angle) in &settings.stand {
            let field = format!("stand.{name}");
            let joint = index(&field, name)?;
            let [least, greatest] = joints[joint].range;
            if !(least..=greatest).contains(&angle) {
                return Err(names.wrong(&field, angle.to_string(), format!("an angle in [{least}, {greatest}] rad")));
            }
            stand[7 + joint] = angle;
        }

        let mut robot = Self {
            name: settings.name.clone(),
            title: settings.title.clone(),
            joints,
            groups,
            base,
            imu: LinkPoint { link: base, point: settings.base.imu.into() },
            legs,
            contacts,
            self_collision,
            landmarks,
            stand,
            model: Arc::new(model),
            model_file,
            file: settings,
        };
        let mut data = robot.data();
        data.set_position(&robot.stand);
        robot.stand[2] -= robot.contacts.iter().map(|c| data.point(&c.at).z - c.radius).fold(f64::INFINITY, f64::min);
        Ok(robot)
    }

    /// The compiled model: the robot alone, with gravity, without a ground.
    #[must_use]
    pub fn model(&self) -> &Arc<MjModel> {
        &self.model
    }

    /// The model file that it was loaded from.
    #[must_use]
    pub fn model_file(&self) -> &Path {
        &self.model_file
    }

    /// An editable copy of the model with the contact spheres, without the model's own actuators, for building a
    /// world around it. Body, joint and geom names are those of [`Robot::model`].
    ///
    /// # Errors
    /// When the model file has gone or changed since the robot was loaded.
    pub fn spec(&self) -> Result<MjSpec, RobotError> {
        spec(&self.model_file, &self.model_file, &self.file)
    }

    /// Scratch space for kinematics and dynamics, in the standing pose.
    #[must_use]
    pub fn data(&self) -> crate::RobotData {
        crate::RobotData::new(self)
    }

    /// Length of `v`: 6 + joints.
    #[must_use]
    pub fn nv(&self) -> usize {
        6 + self.joints.len()
    }

    /// Length of `q`: 7 + joints.
    #[must_use]
    pub fn nq(&self) -> usize {
        7 + self.joints.len()
    }

    /// Mass of the whole robot, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.model.body_subtreemass()[self.base]
    }

    /// The leg on `side`.
    #[must_use]
    pub fn leg(&self, side: Side) -> &Leg {
        &self.legs[side as usize]
    }

    /// Index of the joint called `name`.
    #[must_use]
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// MuJoCo body index of the link called `name`.
    #[must_use]
    pub fn link_index(&self, name: &str) -> Option<usize> {
        self.model.name_to_id(MjtObjBase::mjOBJ_BODY, name)
    }

    /// Name of the link with MuJoCo body index `link`.
    #[must_use]
    pub fn link_name(&self, link: usize) -> &str {
        self.model.id_to_name(MjtObjBase::mjOBJ_BODY, link).unwrap_or("unnamed")
    }

    /// The point that follows the human landmark `name`.
    #[must_use]
    pub fn landmark(&self, name: &str) -> Option<&LinkPoint> {
        self.landmarks.iter().find(|(known, _)| known == name).map(|(_, point)| point)
    }
}

/// Reads a model's text. MuJoCo reads the file itself; this says what is wrong where MuJoCo or its bindings would not:
/// a missing file, bytes that are no text, and NaN or infinity, which MuJoCo lets pass.
pub(crate) fn read_model(file: &Path) -> Result<String, RobotError> {
    crate::warnings::silence();
    let bytes = std::fs::read(file).map_err(|source| RobotError::Read { file: file.to_owned(), source })?;
    let refused = |detail: String| RobotError::Model { file: file.to_owned(), detail };
    let text = String::from_utf8(bytes)
        .map_err(|e| refused(format!("byte {} is no UTF-8 text", e.utf8_error().valid_up_to())))?;
    match crate::check::not_finite(&text) {
        Some((line, found)) => Err(refused(format!("line {line}: {found}; expected finite numbers"))),
        None => Ok(text),
    }
}

/// Every number of the settings is finite and no text has a NUL, which would end a name early in MuJoCo.
fn sane(file: &Path, settings: &RobotFile) -> Result<(), RobotError> {
    fn walk(value: &toml::Value, field: &str) -> Option<(String, String, &'static str)> {
        match value {
            toml::Value::Float(x) if !x.is_finite() => Some((field.to_owned(), x.to_string(), "a finite number")),
            toml::Value::String(s) if s.contains('\0') => {
                Some((field.to_owned(), format!("{s:?}"), "text without a NUL"))
            }
            toml::Value::Array(items) => {
                items.iter().enumerate().find_map(|(i, item)| walk(item, &format!("{field}[{i}]")))
            }
            toml::Value::Table(table) => table.iter().find_map(|(key, item)| {
                let field = if field.is_empty() { key.clone() } else { format!("{field}.{key}") };
                if key.contains('\0') {
                    return Some((format!("{field:?}"), format!("{key:?}"), "a name without a NUL"));
                }
                walk(item, &field)
            }),
            _ => None,
        }
    }
    let value = toml::Value::try_from(settings)
        .map_err(|e| RobotError::Settings { file: file.to_owned(), detail: e.to_string() })?;
    match walk(&value, "") {
        Some((field, found, expected)) => {
            Err(RobotError::Field { file: file.to_owned(), field, found, expected: expected.into() })
        }
        None => Ok(()),
    }
}

/// Reads the model and makes it a robot: a free joint for a URDF, no actuators, contact spheres.
fn spec(file: &Path, model_file: &Path, settings: &RobotFile) -> Result<MjSpec, RobotError> {
    let text = read_model(model_file)?;
    let refused = |detail: String| RobotError::Model { file: model_file.to_owned(), detail };
    let mut spec = MjSpec::from_xml(model_file).map_err(|e| refused(e.to_string()))?;
    let is_urdf = crate::check::is_urdf(&text);
    if is_urdf {
        spec.compiler_mut().set_fusestatic(false);
        crate::meshes::resolve(&mut spec, model_file);
    }
    let wrong = |field: String, found: &str, expected: String| RobotError::Field {
        file: file.to_owned(),
        field,
        found: format!("\"{found}\""),
        expected,
    };
    // Our own drives take the place of the model's actuators; a sensor or keyframe might refer to them.
    let actuators: Vec<_> = spec.actuator_iter_mut().map(std::ptr::from_mut).collect();
    for actuator in actuators {
        // SAFETY: each element is deleted once, before anything else is changed in the specification.
        unsafe { (*actuator).delete() }.map_err(|e| refused(e.to_string()))?;
    }
    let keys: Vec<_> = spec.key_iter_mut().map(std::ptr::from_mut).collect();
    for key in keys {
        // SAFETY: as above.
        unsafe { (*key).delete() }.map_err(|e| refused(e.to_string()))?;
    }
    let world = spec.world_body_mut();
    if is_urdf {
        let base = world.child_mut(&settings.base.link).ok_or_else(|| {
            wrong("base.link".into(), &settings.base.link, format!("the root link of {}", model_file.display()))
        })?;
        base.add_free_joint().set_name("root").map_err(|e| refused(e.to_string()))?;
    }
    for (i, contact) in settings.contact.iter().enumerate() {
        if contact.radius.is_nan() || contact.radius <= 0.0 {
            return Err(RobotError::Field {
                file: file.to_owned(),
                field: format!("contact[{i}].radius"),
                found: contact.radius.to_string(),
                expected: "a radius above 0 m".into(),
            });
        }
        let link = world.child_mut(&contact.link).ok_or_else(|| {
            wrong(format!("contact[{i}].link"), &contact.link, format!("a link of {}", model_file.display()))
        })?;
        let sphere = link.add_geom();
        sphere
            .with_type(MjtGeomBase::mjGEOM_SPHERE)
            .with_size([contact.radius, 0.0, 0.0])
            .with_pos(contact.point)
            .with_mass(0.0)
            .with_rgba([0.2, 0.2, 0.2, 1.0])
            .set_name(&contact.name)
            .map_err(|_| wrong(format!("contact[{i}].name"), &contact.name, "a name that no other geom has".into()))?;
    }
    Ok(spec)
}

/// Looks up names in the compiled model and says which field named something that is not there.
struct Names<'a> {
    file: &'a Path,
    model: &'a MjModel,
}

impl Names<'_> {
    fn wrong(&self, field: &str, found: String, expected: String) -> RobotError {
        RobotError::Field { file: self.file.to_owned(), field: field.to_owned(), found, expected }
    }

    fn find(&self, kind: MjtObjBase, what: &str, field: &str, name: &str) -> Result<usize, RobotError> {
        self.model.name_to_id(kind, name).ok_or_else(|| {
            let count = match kind {
                MjtObjBase::mjOBJ_BODY => self.model.ffi().nbody,
                _ => self.model.ffi().ngeom,
            };
            let known = (0..usize::try_from(count).unwrap_or(0)).filter_map(|i| self.model.id_to_name(kind, i));
            self.wrong(field, format!("\"{name}\""), expected_name(what, name, known))
        })
    }

    fn link(&self, field: &str, name: &str) -> Result<usize, RobotError> {
        self.find(MjtObjBase::mjOBJ_BODY, "link", field, name)
    }

    fn geom(&self, field: &str, name: &str) -> Result<usize, RobotError> {
        self.find(MjtObjBase::mjOBJ_GEOM, "geom", field, name)
    }
}

/// "a link of the model; the nearest is "left_foot"".
fn expected_name<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> String {
    let nearest = known.filter(|k| !k.is_empty() && *k != "world").min_by_key(|k| edit_distance(k, name));
    match nearest {
        Some(nearest) => format!("a {what} of the model; the nearest is \"{nearest}\""),
        None => format!("a {what} of the model, which names none"),
    }
}

/// Levenshtein's distance, to suggest the name that was probably meant.
fn edit_distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.chars().count()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.chars().enumerate() {
            let substituted = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[row.len() - 1]
}

fn joint_index(names: &Names<'_>, joints: &[Joint], field: &str, name: &str) -> Result<usize, RobotError> {
    joints.iter().position(|joint| joint.name == name).ok_or_else(|| {
        let known = joints.iter().map(|joint| joint.name.as_str());
        names.wrong(field, format!("\"{name}\""), expected_name("joint", name, known))
    })
}

/// The model's joints with the limits and gains of their groups.
fn joints(names: &Names<'_>, model_file: &Path, settings: &RobotFile) -> Result<(Vec<Joint>, Vec<String>), RobotError> {
    let model = names.model;
    let structure = |found: String, expected: &str| RobotError::Structure {
        file: model_file.to_owned(),
        found,
        expected: expected.to_owned(),
    };
    let types = model.jnt_type();
    let name_of = |i: usize| model.id_to_name(MjtObjBase::mjOBJ_JOINT, i).unwrap_or_default().to_owned();
    if types.first() != Some(&MjtJoint::mjJNT_FREE) {
        return Err(structure(
            "the model has no free joint at its root".into(),
            "one <freejoint/> in the base link, as the first joint",
        ));
    }
    let mut joints = Vec::with_capacity(types.len() - 1);
    for (i, kind) in types.iter().enumerate().skip(1) {
        let name = name_of(i);
        if *kind != MjtJoint::mjJNT_HINGE {
            return Err(structure(format!("joint \"{name}\" is no hinge"), "one free joint, then hinges only"));
        }
        if name.is_empty() {
            return Err(structure(format!("joint {i} has no name"), "a name for every joint"));
        }
        if !model.jnt_limited()[i] {
            return Err(structure(format!("joint \"{name}\" has no range"), "a range (MJCF) or a limit (URDF)"));
        }
        joints.push(Joint {
            name,
            group: usize::MAX,
            range: model.jnt_range()[i],
            torque: if model.jnt_actfrclimited()[i] { model.jnt_actfrcrange()[i][1] } else { 0.0 },
            speed: 0.0,
            corner: 0.0,
            kp: 0.0,
            kd: 0.0,
        });
    }
    for (g, group) in settings.group.iter().enumerate() {
        let positive = |part: &str, value: f64, unit: &str| {
            if value > 0.0 && value.is_finite() {
                Ok(value)
            } else {
                Err(names.wrong(&format!("group[{g}].{part}"), value.to_string(), format!("a number above 0 {unit}")))
            }
        };
        if !(0.0..1.0).contains(&group.corner) {
            let field = format!("group[{g}].corner");
            return Err(names.wrong(&field, group.corner.to_string(), "a share in [0, 1)".into()));
        }
        for name in &group.joints {
            let field = format!("group[{g}].joints");
            let index = joint_index(names, &joints, &field, name)?;
            let joint = &mut joints[index];
            if joint.group != usize::MAX {
                let other = &settings.group[joint.group].name;
                return Err(names.wrong(
                    &field,
                    format!("\"{name}\" again (it is in \"{other}\")"),
                    "one group".into(),
                ));
            }
            joint.group = g;
            joint.speed = positive("speed", group.speed, "rad/s")?;
            joint.corner = group.corner;
            joint.kp = positive("kp", group.kp, "N m/rad")?;
            joint.kd = positive("kd", group.kd, "N m s/rad")?;
            if let Some(torque) = group.torque {
                joint.torque = positive("torque", torque, "N m")?;
            }
            if joint.torque <= 0.0 {
                let field = format!("group[{g}].torque");
                return Err(names.wrong(&field, format!("none, and the model has none for \"{name}\""), "N m".into()));
            }
        }
    }
    if let Some(joint) = joints.iter().find(|joint| joint.group == usize::MAX) {
        return Err(names.wrong(
            "group",
            format!("joint \"{}\" is in no group", joint.name),
            "every joint in one".into(),
        ));
    }
    Ok((joints, settings.group.iter().map(|group| group.name.clone()).collect()))
}

fn self_collision(names: &Names<'_>, settings: &RobotFile) -> Result<Vec<[usize; 2]>, RobotError> {
    let mut pairs = Vec::with_capacity(settings.self_collision.pairs.len());
    for (i, [first, second]) in settings.self_collision.pairs.iter().enumerate() {
        let field = format!("self_collision.pairs[{i}]");
        let pair = [names.geom(&field, first)?, names.geom(&field, second)?];
        for geom in pair {
            let kind = names.model.geom_type()[geom];
            if !matches!(kind, MjtGeomBase::mjGEOM_CAPSULE | MjtGeomBase::mjGEOM_SPHERE) {
                return Err(names.wrong(&field, format!("a geom of type {kind:?}"), "capsules or spheres".into()));
            }
        }
        pairs.push(pair);
    }
    Ok(pairs)
}
