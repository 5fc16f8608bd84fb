//! Which robot of the server is which of ours: motors, sensors, camera, speaker; read off the models in `rcsssmj` 0.2.1.

use std::sync::Arc;

use instep_robot::senses::Camera;
use instep_robot::{LinkPoint, Robot};
use nalgebra::{UnitQuaternion, Vector3};

use crate::RcssError;

/// Time between two cycles of the server, s: 4 steps of 5 ms.
pub const CYCLE: f64 = 0.02;
/// A step of its physics, s: in it the motors' torques are held.
const STEP: f64 = 0.005;
/// Half of the camera's field of view, rad: 60 degrees each way, both across and up.
pub const HALF_VIEW: f64 = std::f64::consts::FRAC_PI_3;
/// Share of a motor's largest damping that stays stable in the server's steps that is used; the rest is for what the model has not.
const STABLE: f64 = 0.5;

/// A robot of the server.
#[derive(Debug)]
pub struct Model {
    /// The server's name.
    pub name: &'static str,
    /// Ours.
    pub robot: &'static str,
    /// Joints: the server's motor, its sensor, the name in both models.
    pub joints: &'static [[&'static str; 3]],
    /// Where the camera sits in the link `H2` or what it is called, m; it looks along the link's x axis.
    pub camera: (&'static str, [f64; 3]),
    /// The speaker.
    pub speaker: &'static str,
}

/// The server's robots that we have.
pub const MODELS: [Model; 2] = [
    Model { name: "T1", robot: "t1", joints: &T1, camera: ("H2", [0.05, 0.0, 0.12]), speaker: "say" },
    Model { name: "K1", robot: "k1", joints: &K1, camera: ("Head_2", [0.06, 0.0, 0.08]), speaker: "say" },
];

const T1: [[&str; 3]; 23] = [
    ["he1", "q_hj1", "AAHead_yaw"],
    ["he2", "q_hj2", "Head_pitch"],
    ["lae1", "q_laj1", "Left_Shoulder_Pitch"],
    ["lae2", "q_laj2", "Left_Shoulder_Roll"],
    ["lae3", "q_laj3", "Left_Elbow_Pitch"],
    ["lae4", "q_laj4", "Left_Elbow_Yaw"],
    ["rae1", "q_raj1", "Right_Shoulder_Pitch"],
    ["rae2", "q_raj2", "Right_Shoulder_Roll"],
    ["rae3", "q_raj3", "Right_Elbow_Pitch"],
    ["rae4", "q_raj4", "Right_Elbow_Yaw"],
    ["te1", "q_tj1", "Waist"],
    ["lle1", "q_llj1", "Left_Hip_Pitch"],
    ["lle2", "q_llj2", "Left_Hip_Roll"],
    ["lle3", "q_llj3", "Left_Hip_Yaw"],
    ["lle4", "q_llj4", "Left_Knee_Pitch"],
    ["lle5", "q_llj5", "Left_Ankle_Pitch"],
    ["lle6", "q_llj6", "Left_Ankle_Roll"],
    ["rle1", "q_rlj1", "Right_Hip_Pitch"],
    ["rle2", "q_rlj2", "Right_Hip_Roll"],
    ["rle3", "q_rlj3", "Right_Hip_Yaw"],
    ["rle4", "q_rlj4", "Right_Knee_Pitch"],
    ["rle5", "q_rlj5", "Right_Ankle_Pitch"],
    ["rle6", "q_rlj6", "Right_Ankle_Roll"],
];

const K1: [[&str; 3]; 22] = [
    ["he1", "q_hj1", "AAHead_yaw"],
    ["he2", "q_hj2", "Head_pitch"],
    ["lae1", "q_laj1", "ALeft_Shoulder_Pitch"],
    ["lae2", "q_laj2", "Left_Shoulder_Roll"],
    ["lae3", "q_laj3", "Left_Elbow_Pitch"],
    ["lae4", "q_laj4", "Left_Elbow_Yaw"],
    ["rae1", "q_raj1", "ARight_Shoulder_Pitch"],
    ["rae2", "q_raj2", "Right_Shoulder_Roll"],
    ["rae3", "q_raj3", "Right_Elbow_Pitch"],
    ["rae4", "q_raj4", "Right_Elbow_Yaw"],
    ["lle1", "q_llj1", "Left_Hip_Pitch"],
    ["lle2", "q_llj2", "Left_Hip_Roll"],
    ["lle3", "q_llj3", "Left_Hip_Yaw"],
    ["lle4", "q_llj4", "Left_Knee_Pitch"],
    ["lle5", "q_llj5", "Left_Ankle_Pitch"],
    ["lle6", "q_llj6", "Left_Ankle_Roll"],
    ["rle1", "q_rlj1", "Right_Hip_Pitch"],
    ["rle2", "q_rlj2", "Right_Hip_Roll"],
    ["rle3", "q_rlj3", "Right_Hip_Yaw"],
    ["rle4", "q_rlj4", "Right_Knee_Pitch"],
    ["rle5", "q_rlj5", "Right_Ankle_Pitch"],
    ["rle6", "q_rlj6", "Right_Ankle_Roll"],
];

/// The server's robot that is our `robot`.
///
/// # Errors
/// [`RcssError::Model`] with those that there are.
pub fn named(robot: &str) -> Result<&'static Model, RcssError> {
    MODELS
        .iter()
        .find(|model| model.robot == robot)
        .ok_or_else(|| RcssError::Model { found: robot.to_owned(), known: MODELS.map(|model| model.robot).join(", ") })
}

/// A motor's name with its sensor's and our joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Wiring {
    /// The server's motor.
    pub motor: &'static str,
    /// Its sensor.
    pub sensor: &'static str,
    /// Our joint.
    pub joint: usize,
    /// N m/rad
    pub kp: f64,
    /// N m s/rad
    pub kd: f64,
}

/// Our robot as it is on the server: its drives' cycle, its camera.
///
/// # Errors
/// [`RcssError::Part`] when it lacks a joint or a link.
pub fn on_server(model: &'static Model, robot: &Robot) -> Result<(Arc<Robot>, Vec<Wiring>), RcssError> {
    let missing = |part: String| RcssError::Part { robot: robot.name.clone(), part, model: model.name };
    let mut robot = robot.clone();
    let data = robot.data();
    let inertia = data.mass_matrix();
    let mut wires = Vec::with_capacity(model.joints.len());
    for [motor, sensor, name] in model.joints {
        let joint = robot.joint_index(name).ok_or_else(|| missing(format!("joint {name}")))?;
        // What a torque on this joint alone accelerates, everything else free: the least that it can find before it.
        let free = inertia.clone().try_inverse().map_or(0.02, |inverse| 1.0 / inverse[(6 + joint, 6 + joint)]);
        // The explicit step of v' = -(kp q + kd v) / I is stable while 2 kd h / I + kp h^2 / I < 4.
        let own = &robot.joints[joint];
        let kd = own.kd.min(STABLE * (2.0 * free / STEP - 0.5 * own.kp * STEP)).max(0.1);
        wires.push(Wiring { motor, sensor, joint, kp: own.kp, kd });
    }
    let (link, at) = model.camera;
    let link = robot.link_index(link).ok_or_else(|| missing(format!("link {link}")))?;
    robot.camera = Some(Camera {
        at: LinkPoint { link, point: Vector3::from(at) },
        link_from_camera: UnitQuaternion::identity(),
        field_of_view: [2.0 * HALF_VIEW; 2],
        period: 2.0 * CYCLE,
        latency: [0.0; 2],
        angle_error: 0.0,
        correlation: 0.0,
    });
    if let Some(camera) = &mut robot.senses.camera {
        camera.pitch = 0.0;
    }
    for (joint, wire) in wires.iter().map(|wire| (wire.joint, wire.kd)) {
        robot.joints[joint].kd = wire;
    }
    Ok((Arc::new(robot), wires))
}
