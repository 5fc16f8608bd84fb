//! Wind-up and kick of paper 2 (sections 3.1 and 4.2) between the foot's raise and the way back, with times from distances.

use instep_motion::phase::Side;
use instep_motion::spline::State;
use nalgebra::{Rotation3, Vector3};

use crate::dynamic::settings::DynamicSettings;
use crate::engine::{Face, Phase};
use crate::whole_body::body::Body;
use crate::whole_body::foot::windup_point;
use crate::whole_body::motion::{Motion, place};

/// Length of the foot behind the striking face, in units of the face's distance from the sole's centre.
const BEHIND: f64 = 1.5;

/// The kicking part of a motion: everything that depends on the ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stroke {
    pub(crate) swing: Side,
    pub(crate) face: Face,
    /// Foot yaw, rad.
    pub(crate) yaw: f64,
    /// Sole's centre at the contact, m.
    pub(crate) contact: Vector3<f64>,
    /// Direction in which the foot moves, rad.
    pub(crate) direction: f64,
    /// Wind-up distance, m.
    pub(crate) windup: f64,
    /// Follow-through distance, m.
    pub(crate) follow: f64,
    /// Foot speed at contact, m/s.
    pub(crate) speed: f64,
    /// The striking face's axis in the sole's frame, m: the foot pitches about it.
    pub(crate) axis: Vector3<f64>,
    /// Pitch of the foot over its way, rad/m.
    pub(crate) pitch: f64,
    /// How much the foot rises over its way at the contact. It comes from the same height as that of the contact and dips on
    /// its way, as a pendulum does.
    pub(crate) rise: f64,
}

impl Stroke {
    /// Sole's x, y, z, yaw and pitch where the striking face is `way` (m) past the contact: equation (2) for the face.
    pub(crate) fn pose(&self, way: f64) -> [f64; 5] {
        let pitch = -self.pitch * way;
        let yaw = Rotation3::from_axis_angle(&Vector3::z_axis(), self.yaw);
        let pitched = yaw * Rotation3::from_axis_angle(&Vector3::y_axis(), pitch) * self.axis;
        let face = windup_point(&(self.contact + yaw * self.axis), self.direction, -way);
        let mut sole = face - pitched;
        if way < 0.0 {
            sole.z += self.rise * way * (1.0 + way / self.windup).max(0.0);
        } else {
            // What is behind the face goes down as the foot pitches up: the foot rises by as much until it rests.
            let share = (way / self.follow).min(1.0);
            let behind = BEHIND * self.axis.xy().norm();
            sole.z += way * (self.rise * (1.0 - 0.5 * share) + self.pitch * behind * share);
        }
        [sole.x, sole.y, sole.z, self.yaw, pitch]
    }

    pub(crate) fn windup_pose(&self) -> [f64; 5] {
        self.pose(-self.windup)
    }

    pub(crate) fn follow_pose(&self) -> [f64; 5] {
        self.pose(self.follow)
    }

    /// Change of the pose with the way at the contact.
    fn slope(&self) -> [f64; 5] {
        const STEP: f64 = 1e-5;
        let (after, before) = (self.pose(STEP), self.pose(-STEP));
        std::array::from_fn(|i| (after[i] - before[i]) / (2.0 * STEP))
    }

    /// From the wind-up point to the contact, s: with a quintic from rest to the speed v without acceleration at either
    /// end, the speed's mean is v / 2.
    pub(crate) fn time(&self) -> f64 {
        2.0 * self.windup / self.speed
    }
}

/// The kick with `stroke`, from the stand to the stand.
pub(crate) fn kick(body: &Body, settings: &DynamicSettings, stroke: &Stroke) -> Motion {
    let manner = settings.manner();
    let mut motion = Motion::raised(body, &manner, stroke.swing);
    lay(&mut motion, body, settings, stroke);
    motion.back(body, &manner, 1.0);
    motion
}

/// Another stroke from `time` in the wind-up, for a ball that has moved.
pub(crate) fn retargeted(
    motion: &Motion,
    body: &Body,
    settings: &DynamicSettings,
    time: f64,
    stroke: &Stroke,
) -> Motion {
    let mut motion = motion.from(time);
    lay(&mut motion, body, settings, stroke);
    motion.back(body, &settings.manner(), 1.0);
    motion
}

/// Wind-up and kick from where the paths end.
fn lay(motion: &mut Motion, body: &Body, settings: &DynamicSettings, stroke: &Stroke) {
    let times = &settings.times;
    let (windup, follow) = (stroke.windup_pose(), stroke.follow_pose());
    let way = (place(&windup) - place(&motion.foot.last().position)).norm();
    let duration = (way / times.foot_speed).max(times.foot_least);
    let turned = settings.manner().trunk_support(body, motion.swing, stroke.yaw);
    motion.foot.to(duration, State::at_rest(windup));
    motion.trunk.to(duration, State::at_rest(turned));
    motion.foot.hold(times.aim);
    motion.trunk.hold(times.aim);
    motion.timeline.end_at(Phase::WindUp, motion.foot.end());
    let velocity = stroke.slope().map(|slope| slope * stroke.speed);
    let contact = State { position: stroke.pose(0.0), velocity, acceleration: [0.0; 5] };
    motion.foot.to(stroke.time(), contact);
    motion.contact = Some(motion.foot.end());
    motion.foot.to(2.0 * stroke.follow / stroke.speed, State::at_rest(follow));
    motion.trunk.hold(motion.foot.end() - motion.trunk.end());
    motion.timeline.end_at(Phase::Kick, motion.foot.end());
}
