//! Which angles of the neck look where one wants to look: found in the model, between base and camera.

use instep_robot::Robot;
use nalgebra::Vector3;

/// A head that turns faster than this shakes its camera and the walk below it, rad/s.
const FASTEST: f64 = 2.0;

/// A joint of the neck.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Turn {
    joint: usize,
    /// +1 or -1: which way a positive angle turns.
    sign: f64,
    range: [f64; 2],
    /// How fast it is turned, rad/s.
    speed: f64,
}

/// The neck of a robot. A robot without one looks straight ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neck {
    yaw: Option<Turn>,
    pitch: Option<Turn>,
    /// How far down the camera looks with the pitch at zero, rad.
    mount: f64,
    /// Where yaw and pitch are told to be, rad.
    targets: [f64; 2],
}

impl Neck {
    /// Finds the joints between the base and the camera that turn about the base's z (yaw) and y axis (pitch): of each the one
    /// nearest to the camera.
    #[must_use]
    pub fn of(robot: &Robot) -> Self {
        let mut neck = Self { yaw: None, pitch: None, mount: 0.0, targets: [0.0; 2] };
        let (Some(camera), Some(settings)) = (&robot.camera, &robot.senses.camera) else { return neck };
        neck.mount = settings.pitch;
        let model = robot.model();
        let mut data = robot.data();
        let mut straight = vec![0.0; robot.nq()];
        straight[3] = 1.0;
        data.set_position(&straight);
        let mut link = camera.at.link;
        // Bounded by the number of links: a parent's index is below its child's.
        while link != robot.base && link != 0 {
            for (j, joint) in robot.joints.iter().enumerate() {
                // Joint 0 of the model is the base's free joint.
                if usize::try_from(model.jnt_bodyid()[j + 1]) != Ok(link) {
                    continue;
                }
                let axis = data.link_rotation(link) * Vector3::from(model.jnt_axis()[j + 1]);
                let turn = |sign: f64| {
                    Some(Turn {
                        joint: j,
                        sign: sign.signum(),
                        range: joint.range,
                        speed: FASTEST.min(0.5 * joint.speed),
                    })
                };
                if axis.z.abs() > 0.9 && neck.yaw.is_none() {
                    neck.yaw = turn(axis.z);
                } else if axis.y.abs() > 0.9 && neck.pitch.is_none() {
                    neck.pitch = turn(axis.y);
                }
            }
            link = usize::try_from(model.body_parentid()[link]).unwrap_or(0);
        }
        neck
    }

    /// How far it turns to either side, rad.
    #[must_use]
    pub fn yaw_limit(&self) -> f64 {
        self.yaw.map_or(0.0, |yaw| yaw.range[0].abs().min(yaw.range[1].abs()))
    }

    /// Where it looks with these joint angles (rad), from straight ahead, to the left.
    #[must_use]
    pub fn gaze_yaw(&self, joint_positions: &[f64]) -> f64 {
        self.yaw.map_or(0.0, |yaw| yaw.sign * joint_positions.get(yaw.joint).copied().unwrap_or(0.0))
    }

    /// Turns the targets in `positions` toward `yaw` (to the left) and `pitch` (down), rad, no faster than the joints turn in
    /// `period` s. Whoever wrote them before (the walk, which wants the neck of its stand) is overruled.
    pub fn look(&mut self, yaw: f64, pitch: f64, period: f64, positions: &mut [f64], velocities: &mut [f64]) {
        let wanted = [(self.yaw, yaw), (self.pitch, pitch - self.mount)];
        for ((turn, angle), target) in wanted.into_iter().zip(&mut self.targets) {
            let Some(turn) = turn else { continue };
            let (Some(position), Some(velocity)) = (positions.get_mut(turn.joint), velocities.get_mut(turn.joint))
            else {
                continue;
            };
            let wanted = (turn.sign * angle).clamp(turn.range[0], turn.range[1]);
            let most = turn.speed * period;
            *target += (wanted - *target).clamp(-most, most);
            (*position, *velocity) = (*target, 0.0);
        }
    }
}
