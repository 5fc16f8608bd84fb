//! The engine `adaptive`: a kick toward any direction from where the robot stands, which follows the ball while the foot
//! is back.
//!
//! Source: Xu, Mellmann, Adaptive motion control: dynamic kick for a humanoid robot (paper 3). The places that the foot
//! can reach are a measured grid ([`grid`], [`probe`]); the retraction point is its argmax of equation (2)
//! ([`retraction`]); the foot target is corrected for the foot's true shape (`geometry`); `lookup` puts these together in
//! microseconds, so that each tick can do it again for the newest ball (`engine`).
//!
//! It does not walk, does not recover from a fall, and knows no obstacle but the robot itself.

mod engine;
mod geometry;
pub mod grid;
mod lookup;
mod motion;
mod plan;
pub mod probe;
pub mod retraction;
mod settings;

use std::sync::Arc;

use instep_robot::Robot;

use crate::KickError;
use crate::ball::BallModel;
use crate::whole_body::body::Body;
use crate::whole_body::drive::{Drive, Loop, pressure};
use crate::whole_body::inclination::Lean;
use crate::whole_body::torque::Dynamics;
use instep_robot::ik::{Ik, Weights};

pub use engine::{AdaptiveKick, Outlook, load_grid};
pub use grid::Grid;
pub use settings::{Accuracy, AdaptiveSettings, Kick, Stabiliser};

/// Weight of the swing foot's roll in inverse kinematics, 1/rad: a leg far to the side meets the limit of its ankle's roll, and
/// the foot may lean rather than the body.
const ROLL: f64 = 0.6;

/// The grid's file, beside `robot.toml`.
pub const GRID_FILE: &str = "reach.bin";

/// What an engine and a probe of the same robot have in common.
fn parts(robot: Arc<Robot>, ball: BallModel, settings: &AdaptiveSettings) -> Result<(Body, Drive), KickError> {
    let ik = Ik::new(&robot, &settings.coupled, settings.limits.joint_margin, settings.limits.knee_bend)?
        .with_weights(Weights { roll: ROLL, ..Weights::default() });
    let dynamics = Dynamics::new(&robot, &settings.coupled);
    let stabiliser = match settings.stabiliser {
        Stabiliser::Pressure => pressure(settings.feedback),
        Stabiliser::Inclination => Loop::Inclination(Lean::new(settings.inclination)),
    };
    let body = Body::new(robot, ball, &settings.arms)?;
    let drive = Drive::new(&body, ik, dynamics, stabiliser);
    Ok((body, drive))
}

/// Hash of what a grid depends on: the robot's links, joints, masses and shapes, and the stance, arms and limits of the
/// settings. Comments, the ball and the stabiliser's gains are not in it. FNV-1a (Fowler, Noll, Vo) over text.
#[must_use]
pub fn grid_hash(robot: &Robot, settings: &AdaptiveSettings) -> u64 {
    let model = robot.model();
    let l = &settings.limits;
    let text = format!(
        "{} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?}",
        robot.name,
        robot.joints.iter().map(|j| (&j.name, j.range, j.torque, j.speed, j.corner, j.kp, j.kd)).collect::<Vec<_>>(),
        robot.legs.iter().map(|leg| (leg.thigh, leg.shank, leg.foot, &leg.sole, &leg.strike)).collect::<Vec<_>>(),
        robot.contacts,
        robot.self_collision,
        robot.stand,
        model.body_pos(),
        model.body_quat(),
        model.body_mass(),
        model.body_ipos(),
        model.jnt_axis(),
        model.jnt_pos(),
        (model.geom_pos(), model.geom_quat(), model.geom_size()),
        settings.stance,
        settings.arms,
        settings.coupled,
        (l.joint_margin, l.knee_bend, l.clearance, settings.kick.base_yaw),
    );
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
