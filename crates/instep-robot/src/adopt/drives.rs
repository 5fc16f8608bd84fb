//! What drives the joints: limits where the model has none, gains from what each joint carries, groups of joints that are alike.
//!
//! Gains. A leg's joint holds the whole robot, an inverted pendulum that falls with m g h a radian: stiffness 1.3 of that (0.8 at the ankle's
//! roll), damping a tenth of sqrt(leg / g) times it; so have the T1 and the K1, by hand. Any other joint carries the inertia I of what hangs
//! on it: stiffness w^2 I with w = 20 rad/s, damping ratio 0.5. Both no more than a 2 ms step holds on the inertia that the joint feels
//! while all others are free. Guesses, said to be such: torque and speed where neither model nor table has one, rotor inertia.

use std::collections::BTreeMap;
use std::sync::Arc;

use mujoco_rs::prelude::*;

use super::actuators;
use super::skeleton::Skeleton;
use crate::check::outline::effective_inertias;
use crate::drive::{DriveKind, DriveSettings, Pid};
use crate::senses::SenseSettings;
use crate::settings::GroupFile;

const GRAVITY: f64 = 9.81;
/// A robot lighter than this whose strongest leg joint is no stronger than that (kg, N m) is taken for one of position servos.
const SERVO: [f64; 2] = [9.0, 15.0];
/// Torque where the model gives none, N m a kg of the robot.
const TORQUE_PER_MASS: f64 = 0.8;
/// Speed where neither model nor table gives one, rad/s: of servos, of other drives.
const SPEED: [f64; 2] = [5.0, 8.0];
/// Inertia of a rotor behind its gears where the model gives none, kg m^2 a N m.
const ROTOR: f64 = 2.5e-4;
/// Natural frequency of arms and head, rad/s, and their damping ratio.
const FREE: [f64; 2] = [20.0, 0.5];
/// Step that gains must be stable at, s, and the share of what it holds that they may use.
const STEP: [f64; 2] = [0.002, 0.4];

/// What part of the robot a joint belongs to.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// A leg's, by its role.
    Leg(&'static str),
    Arm,
    Body,
}

/// Fills in what the model does not say of its joints; gives what is asked of a person.
pub(super) fn fill_in(skeleton: &mut Skeleton, parts: &[Option<Part>], servos: bool) -> Vec<String> {
    let mass = skeleton.mass();
    let (mut torques, mut guessed, mut rotors) = (Vec::new(), Vec::new(), Vec::new());
    let mut tabled: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for (link, part) in skeleton.links.iter_mut().zip(parts) {
        let Some(hinge) = &mut link.hinge else { continue };
        let given = hinge.torque.is_some();
        let torque = *hinge.torque.get_or_insert_with(|| {
            torques.push(hinge.name.clone());
            match part {
                Some(Part::Leg(_)) => (TORQUE_PER_MASS * mass).max(0.5),
                _ => (0.25 * TORQUE_PER_MASS * mass).max(0.3),
            }
        });
        if hinge.speed.is_none() {
            hinge.speed = Some(match actuators::known(mass, torque).filter(|_| given) {
                Some((name, speed)) => {
                    tabled.entry(name).or_default().push(hinge.name.clone());
                    speed
                }
                None => {
                    guessed.push(hinge.name.clone());
                    SPEED[usize::from(!servos)]
                }
            });
        }
        if hinge.armature <= 0.0 {
            hinge.armature = ROTOR * torque;
            rotors.push(hinge.name.clone());
        }
    }
    let mut asked = Vec::new();
    let list = |names: &[String]| if names.len() > 6 { format!("{} joints", names.len()) } else { names.join(", ") };
    if !torques.is_empty() {
        asked.push(format!("torque limits of {}: guessed from the robot's mass", list(&torques)));
    }
    if !guessed.is_empty() {
        asked.push(format!("speed limits of {}: a guess ({} rad/s)", list(&guessed), SPEED[usize::from(!servos)]));
    }
    for (name, joints) in tabled {
        asked.push(format!("speed limits of {}: taken for those of {name}", list(&joints)));
    }
    if !rotors.is_empty() {
        asked
            .push(format!("rotor inertia of {}: guessed from the torque limit (armature in the model)", list(&rotors)));
    }
    asked
}

/// Whether it looks like a robot of position servos: light, with weak motors.
pub(super) fn servos(skeleton: &Skeleton) -> bool {
    let [mass, torque] = SERVO;
    let strongest = skeleton.links.iter().filter_map(|link| link.hinge.as_ref()?.torque).fold(0.0, f64::max);
    skeleton.mass() < mass && strongest <= torque
}

/// `[drives]` of either kind: assumptions of a bus that is as common.
pub(super) fn settings(servos: bool) -> DriveSettings {
    if servos {
        DriveSettings { kind: DriveKind::PositionServo, period: 0.008, delay: 0.008, sag: 0.1 }
    } else {
        DriveSettings { kind: DriveKind::Torque, period: 0.002, delay: 0.002, sag: 0.05 }
    }
}

/// `[senses]` of either kind: those of NAO's class, of the T1's class.
pub(super) fn senses(servos: bool) -> SenseSettings {
    if servos {
        SenseSettings {
            delay: 0.008,
            encoder_resolution: 0.001534,
            encoder_offset: 0.005,
            gyro_bias: 0.01,
            gyro_noise: 0.01,
            accelerometer_bias: 0.2,
            accelerometer_noise: 0.1,
            tilt_bias: 0.01,
            yaw_drift: 0.003,
            orientation_noise: 0.003,
            foot_gain: 0.05,
            foot_offset: 0.3,
            foot_dead_zone: 0.5,
            foot_noise: 0.05,
            camera: None,
        }
    } else {
        SenseSettings {
            delay: 0.002,
            encoder_resolution: 0.00005,
            encoder_offset: 0.001,
            gyro_bias: 0.003,
            gyro_noise: 0.005,
            accelerometer_bias: 0.03,
            accelerometer_noise: 0.05,
            tilt_bias: 0.005,
            yaw_drift: 0.002,
            orientation_noise: 0.002,
            foot_gain: 0.05,
            foot_offset: 2.0,
            foot_dead_zone: 5.0,
            foot_noise: 0.03,
            camera: None,
        }
    }
}

/// Groups of joints, with gains; `model` is the adopted one, compiled, its joints in the order of the skeleton's links after the base.
pub(super) fn groups(
    model: &Arc<MjModel>,
    skeleton: &Skeleton,
    parts: &[Option<Part>],
    leg: f64,
    servos: bool,
) -> Vec<GroupFile> {
    let mut data = MjData::new(Arc::clone(model));
    data.kinematics();
    data.com_pos();
    data.make_m();
    let free = effective_inertias(&data);
    let carried = composite(&data);
    let stiffness = 1.3 * skeleton.mass() * GRAVITY * 1.15 * leg;
    let mut groups: Vec<(Part, GroupFile)> = Vec::new();
    for (link, part) in skeleton.links.iter().zip(parts) {
        let (Some(hinge), Some(part)) = (&link.hinge, part) else { continue };
        let (Some(torque), Some(speed)) = (hinge.torque, hinge.speed) else { continue };
        let Some(dof) = (0..model.jnt_type().len())
            .find(|&joint| model.id_to_name(MjtObjBase::mjOBJ_JOINT, joint) == Some(&hinge.name))
            .map(|joint| 5 + joint)
        else {
            continue;
        };
        let (kp, kd) = match part {
            Part::Leg(role) => {
                let share = match *role {
                    "ankle_roll" => 0.8 / 1.3,
                    "toe" => 0.3,
                    _ => 1.0,
                };
                (share * stiffness, share * stiffness * 0.1 * (leg / GRAVITY).sqrt())
            }
            Part::Arm | Part::Body => {
                let [w, ratio] = FREE;
                let inertia = carried.get(dof).copied().unwrap_or(0.01);
                (w * w * inertia, 2.0 * ratio * w * inertia)
            }
        };
        let [step, share] = STEP;
        let holds = share * 4.0 * free.get(dof).copied().flatten().unwrap_or(f64::INFINITY);
        let uses = 2.0 * kd * step + kp * step * step;
        let scale = (holds / uses).min(1.0);
        let (kp, kd) = (tidy(kp * scale), tidy(kd * scale));
        // A damping that would eat a third of the torque at speed is the gain of a drive, not a loss.
        let damping = if hinge.damping * speed < 0.3 * torque { hinge.damping } else { 0.0 };
        let usual = if servos { 0.05 * torque } else { 0.0 };
        let friction = if hinge.friction > 0.0 { hinge.friction.min(0.2 * torque) } else { usual };
        let group = GroupFile {
            name: String::new(),
            joints: vec![hinge.name.clone()],
            torque: Some(tidy(torque)),
            speed: tidy(speed),
            corner: if servos { 0.0 } else { 0.8 },
            kp,
            kd,
            pid: servos.then(|| Pid { p: tidy(6.9 * torque), i: 0.0, d: 0.0 }),
            dead_zone: 0.0,
            play: if servos { 0.0058 } else { 0.0 },
            static_friction: tidy(friction),
            viscous_friction: tidy(damping),
        };
        // Joints of one part with the same limits, about the same gains, and nothing else between them.
        let alike = |(other, known): &&mut (Part, GroupFile)| {
            let near = |a: f64, b: f64| a <= 2.0 * b && b <= 2.0 * a;
            other == part
                && known.torque == group.torque
                && known.speed == group.speed
                && (known.static_friction, known.viscous_friction) == (group.static_friction, group.viscous_friction)
                && near(known.kp, group.kp)
        };
        match groups.iter_mut().find(alike) {
            Some((_, known)) => {
                known.joints.push(hinge.name.clone());
                (known.kp, known.kd) = (known.kp.min(group.kp), known.kd.min(group.kd));
            }
            None => groups.push((part.clone(), group)),
        }
    }
    let mut counts: BTreeMap<Part, usize> = BTreeMap::new();
    let totals = groups.iter().fold(BTreeMap::new(), |mut totals: BTreeMap<Part, usize>, (part, _)| {
        *totals.entry(part.clone()).or_default() += 1;
        totals
    });
    groups
        .into_iter()
        .map(|(part, mut group)| {
            let word = match &part {
                Part::Leg(role) => role,
                Part::Arm => "arm",
                Part::Body => "body",
            };
            let n = counts.entry(part.clone()).or_default();
            *n += 1;
            group.name = if totals[&part] > 1 { format!("{word}_{n}") } else { word.to_owned() };
            group
        })
        .collect()
}

/// Inertia about each joint of all that hangs on it, held still: the mass matrix's diagonal.
fn composite(data: &MjData<Arc<MjModel>>) -> Vec<f64> {
    let nv = data.qvel().len();
    let mut matrix = nalgebra::DMatrix::zeros(nv, nv);
    if nv == 0 || data.full_m(matrix.as_mut_slice()).is_err() {
        return vec![0.01; nv];
    }
    matrix.diagonal().iter().copied().collect()
}

/// Three digits.
pub(super) fn tidy(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
