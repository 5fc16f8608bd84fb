//! A robot as loaded: the compiled model, and every role of `robot.toml` resolved to an index in it.
//!
//! The model on disk may be any MJCF with one free joint and hinges, or a URDF (its root link is given the free
//! joint). Its actuators are not used: drives with torque and speed limits belong to the world. Contact points are
//! added as small spheres named after `[[contact]]`, so a model needs no special geoms for its feet.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use instep_motion::phase::Side;
use mujoco_rs::prelude::*;
use mujoco_rs::wrappers::mj_editing::MjSpec;
use nalgebra::{UnitQuaternion, Vector3};

use crate::RobotError;
use crate::drive::{DriveKind, DriveSettings, Pid};
use crate::model_file::{sane, spec, spec_of_text};
use crate::names::{Names, drives, joint_index, joints, self_collision};
use crate::senses::{Camera, SenseSettings};
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
    /// Stiffness of a torque drive or an ideal one, N m/rad.
    pub kp: f64,
    /// Damping of a torque drive or an ideal one, N m s/rad.
    pub kd: f64,
    /// A position servo's own PID.
    pub pid: Pid,
    /// Position error up to which the drive does nothing, rad.
    pub dead_zone: f64,
    /// Play of the gears, from flank to flank, rad.
    pub play: f64,
    /// Dry friction, N m.
    pub static_friction: f64,
    /// Viscous friction beside the motor's back-EMF, N m s/rad.
    pub viscous_friction: f64,
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
    /// Ankle roll joint, where there is one; without it the foot rolls about the line of its contact points.
    pub ankle_roll: Option<usize>,
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
        [self.hip_yaw, self.hip_roll, self.hip_pitch, self.knee, self.ankle_pitch]
            .into_iter()
            .chain(self.ankle_roll)
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
    /// What its drives take, how often and how late.
    pub drives: DriveSettings,
    /// How its senses err.
    pub senses: SenseSettings,
    /// The engine that kicks where none is named.
    pub engine: Option<String>,
    /// The camera that looks for the ball, where it has one.
    pub camera: Option<Camera>,
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
    /// The same robot with drives that take angle, speed and torque of every command at once: what it is in an ideal world, so
    /// that whoever steers it does not make up for servos that are not there. The bus keeps its cycle.
    #[must_use]
    pub fn with_ideal_drives(mut self) -> Self {
        self.drives = DriveSettings { kind: DriveKind::Torque, delay: 0.0, ..self.drives };
        self
    }

    /// Loads a robot from its folder or its `robot.toml`.
    ///
    /// # Errors
    /// When a file is missing, is not what it should be, or names a part that the model does not have: each error
    /// names the file, the field, what stands there and what would be right.
    pub fn load(path: &Path) -> Result<Self, RobotError> {
        let file = if path.is_dir() { path.join("robot.toml") } else { path.to_owned() };
        let text = std::fs::read_to_string(&file).map_err(|source| RobotError::Read { file: file.clone(), source })?;
        let settings = crate::settings::read(&file, &text)
            .map_err(|detail| RobotError::Settings { file: file.clone(), detail })?;
        let model_file = file.parent().unwrap_or(Path::new(".")).join(&settings.model);
        Self::resolve(&file, model_file, settings)
    }

    pub(crate) fn resolve(file: &Path, model_file: PathBuf, settings: RobotFile) -> Result<Self, RobotError> {
        sane(file, &settings)?;
        let spec = spec(file, &model_file, &settings)?;
        Self::of_spec(file, model_file, spec, settings)
    }

    /// The robot of an MJCF that is not on disk yet, which cannot be asked for its [`Robot::spec`].
    pub(crate) fn resolve_text(file: &Path, model: &str, settings: RobotFile) -> Result<Self, RobotError> {
        sane(file, &settings)?;
        let model_file = PathBuf::from(&settings.model);
        let spec = spec_of_text(file, &model_file, model, &settings)?;
        Self::of_spec(file, model_file, spec, settings)
    }

    fn of_spec(file: &Path, model_file: PathBuf, mut spec: MjSpec, settings: RobotFile) -> Result<Self, RobotError> {
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
                ankle_roll: leg.ankle_roll.as_deref().map(|name| joint("ankle_roll", name)).transpose()?,
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

        if let Some((field, found, expected)) = settings.senses.fault() {
            return Err(names.wrong(&field, found, expected.into()));
        }
        let camera_link =
            settings.senses.camera.as_ref().map(|c| names.link("senses.camera.link", &c.link)).transpose()?;

        let mut robot = Self {
            senses: settings.senses.clone(),
            engine: settings.engine.clone(),
            camera: None,
            name: settings.name.clone(),
            title: settings.title.clone(),
            joints,
            groups,
            drives: drives(&names, &settings.drives)?,
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
        if let (Some(link), Some(camera)) = (camera_link, &robot.senses.camera) {
            let mut straight = vec![0.0; robot.nq()];
            straight[3] = 1.0;
            data.set_position(&straight);
            robot.camera = Some(Camera {
                at: LinkPoint { link, point: camera.position.into() },
                link_from_camera: data.link_rotation(link).inverse()
                    * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), camera.pitch),
                field_of_view: camera.field_of_view,
                period: camera.period,
                latency: camera.latency,
                angle_error: camera.angle_error,
                correlation: camera.correlation,
            });
        }
        data.set_position(&robot.stand);
        robot.stand[2] -= robot.contacts.iter().map(|c| data.point(&c.at).z - c.radius).fold(f64::INFINITY, f64::min);
        Ok(robot)
    }

    /// What it is called on pages for people: its title up to the first comma.
    #[must_use]
    pub fn display_name(&self) -> &str {
        self.title.split(',').next().map(str::trim).filter(|name| !name.is_empty()).unwrap_or(&self.name)
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

    /// The folder that it was loaded from, where its engines' settings lie.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.model_file.parent().unwrap_or(Path::new("."))
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

    /// Length of the left leg: in the stand from the hip's pitch joint to the knee, to the ankle, and down to the sole, m.
    #[must_use]
    pub fn leg_length(&self) -> f64 {
        let (data, leg) = (self.data(), &self.legs[0]);
        // Joint 0 of the model is the base's free joint.
        let hip = self.model.jnt_bodyid().get(leg.hip_pitch + 1).and_then(|&link| usize::try_from(link).ok());
        let length = |a: usize, b: usize| (data.link_position(a) - data.link_position(b)).norm();
        length(hip.unwrap_or(leg.thigh), leg.shank) + length(leg.shank, leg.foot) - leg.sole.point.z.min(0.0)
    }

    /// Pairs of joints that the model holds equal, by name: one motor turns both.
    #[must_use]
    pub fn coupled(&self) -> Vec<[String; 2]> {
        let model = self.model();
        let name = |id: i32| {
            // Model joint 0 is the free joint.
            let joint = usize::try_from(id).ok()?.checked_sub(1)?;
            Some(self.joints.get(joint)?.name.clone())
        };
        (0..model.eq_type().len())
            .filter(|&e| model.eq_type()[e] == MjtEq::mjEQ_JOINT)
            .filter_map(|e| Some([name(model.eq_obj1id()[e])?, name(model.eq_obj2id()[e])?]))
            .collect()
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
