//! Wind-up and kick of paper 2 (sections 3.1 and 4.2) between the foot's raise and the way back, with times from distances.

use instep_motion::phase::Side;
use instep_motion::spline::State;
use nalgebra::{Rotation3, Vector2, Vector3};

use crate::dynamic::settings::DynamicSettings;
use crate::engine::{Face, Phase};
use crate::whole_body::body::Body;
use crate::whole_body::foot::windup_point;
use crate::whole_body::motion::{Motion, place};

/// Length of the foot behind the striking face, in units of the face's distance from the sole's centre.
const BEHIND: f64 = 1.5;

/// How long the foot goes on at the speed of the contact, s.
pub(crate) const THROUGH: f64 = 0.025;

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
    /// Time to the contact in units of the wind-up over that speed. At 2 a quintic without acceleration at either end gains speed
    /// evenly about the middle; at less it gains it sooner, where a motor that is still slow has more torque.
    pub(crate) haste: f64,
    /// The striking face's axis in the sole's frame, m: the foot pitches about it.
    pub(crate) axis: Vector3<f64>,
    /// Pitch of the foot over its way, rad/m.
    pub(crate) pitch: f64,
    /// How much the foot rises over its way at the contact.
    pub(crate) rise: f64,
    /// How much the foot turns to the left over its way, rad/m, about the striking face's axis.
    pub(crate) turn: f64,
    /// How the way before the contact bends, 1/m and rad/m^2, and the lowest that the sole may be there, m.
    pub(crate) bend: [f64; 5],
    pub(crate) lowest: f64,
    /// What the times of the way to the wind-up point and back are multiplied with, 1 or more.
    pub(crate) pace: f64,
    /// When the contact should be, s of the motion; 0: as soon as can be.
    pub(crate) at: f64,
    /// The ball at the contact, support sole's frame, m.
    pub(crate) ball: Vector2<f64>,
}

impl Stroke {
    /// Sole's x, y, z, yaw and pitch where the striking face is `way` (m) past the contact: equation (2) for the face. Before the
    /// contact the way bends as the joints have it that turn at one rate each.
    pub(crate) fn pose(&self, way: f64) -> [f64; 5] {
        if way < 0.0 {
            let (here, slope) = (self.ahead(0.0), self.slope());
            let mut pose: [f64; 5] = std::array::from_fn(|k| here[k] + way * (slope[k] + 0.5 * way * self.bend[k]));
            pose[2] = pose[2].max(self.lowest);
            return pose;
        }
        self.ahead(way)
    }

    /// The same at the contact and after it.
    fn ahead(&self, way: f64) -> [f64; 5] {
        let pitch = -self.pitch * way;
        let heading = self.yaw + self.turn * way;
        let [struck, yaw] = [self.yaw, heading].map(|angle| Rotation3::from_axis_angle(&Vector3::z_axis(), angle));
        let pitched = yaw * Rotation3::from_axis_angle(&Vector3::y_axis(), pitch) * self.axis;
        let face = windup_point(&(self.contact + struck * self.axis), self.direction, -way);
        let mut sole = face - pitched;
        // What is behind the face goes down as the foot pitches up: the foot rises by as much until it rests.
        let share = (way / self.follow).min(1.0);
        let behind = BEHIND * self.axis.xy().norm();
        sole.z += way * (self.rise * (1.0 - 0.5 * share) + self.pitch.abs() * behind * share);
        [sole.x, sole.y, sole.z, heading, pitch]
    }

    pub(crate) fn windup_pose(&self) -> [f64; 5] {
        self.pose(-self.windup)
    }

    pub(crate) fn follow_pose(&self) -> [f64; 5] {
        self.pose(self.follow)
    }

    /// Change of the pose with the way at the contact.
    pub(crate) fn slope(&self) -> [f64; 5] {
        self.slope_at(0.0)
    }

    /// The same `way` (m) past it.
    fn slope_at(&self, way: f64) -> [f64; 5] {
        const STEP: f64 = 1e-5;
        let (after, here) = (self.ahead(way + STEP), self.ahead(way));
        std::array::from_fn(|i| (after[i] - here[i]) / STEP)
    }

    /// From the wind-up point to the contact, s.
    pub(crate) fn time(&self) -> f64 {
        self.haste * self.windup / self.speed
    }
}

/// The kick with `stroke`, from the stand to the stand.
pub(crate) fn kick(body: &Body, settings: &DynamicSettings, stroke: &Stroke) -> Motion {
    let manner = settings.manner();
    let away = if stroke.at > 0.0 { [0.0; 2] } else { body.away(stroke.swing, stroke.ball) };
    let mut motion = Motion::raised(body, &manner, stroke.swing, away);
    lay(&mut motion, body, settings, stroke);
    motion.back(body, &manner, stroke.pace);
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
    motion.back(body, &settings.manner(), stroke.pace);
    motion
}

/// Time from the lifted foot to the wind-up point at the pace 1, s.
pub(crate) fn retraction_time(body: &Body, settings: &DynamicSettings, stroke: &Stroke) -> f64 {
    let lifted = body.lifted(stroke.swing, settings.swing.lift);
    let way = (place(&stroke.windup_pose()) - place(&lifted)).norm();
    (way / settings.times.foot_speed).max(settings.times.foot_least)
}

/// Wind-up and kick from where the paths end.
fn lay(motion: &mut Motion, body: &Body, settings: &DynamicSettings, stroke: &Stroke) {
    let times = &settings.times;
    let (windup, follow) = (stroke.windup_pose(), stroke.follow_pose());
    let way = (place(&windup) - place(&motion.foot.last().position)).norm();
    let duration = stroke.pace * (way / times.foot_speed).max(times.foot_least);
    let turned = settings.manner().trunk_support(body, motion.swing, stroke.yaw);
    motion.foot.to(duration, State::at_rest(windup));
    motion.trunk.to(duration, State::at_rest(turned));
    let wait = times.aim.max(stroke.at - stroke.time() - motion.foot.end());
    motion.foot.hold(wait);
    motion.trunk.hold(wait);
    motion.timeline.end_at(Phase::WindUp, motion.foot.end());
    let velocity = stroke.slope().map(|slope| slope * stroke.speed);
    let contact = State { position: stroke.pose(0.0), velocity, acceleration: [0.0; 5] };
    motion.foot.to(stroke.time(), contact);
    motion.contact = Some(motion.foot.end());
    // On at the same speed for a moment: drives that lag meet the ball a little later, and a foot that brakes then kicks by chance.
    let on = THROUGH.min(0.45 * stroke.follow / stroke.speed);
    let way = on * stroke.speed;
    motion.foot.to(
        on,
        State {
            position: stroke.pose(way),
            velocity: stroke.slope_at(way).map(|slope| slope * stroke.speed),
            acceleration: [0.0; 5],
        },
    );
    motion.foot.to(2.0 * (stroke.follow - way) / stroke.speed, State::at_rest(follow));
    motion.trunk.hold(motion.foot.end() - motion.trunk.end());
    motion.timeline.end_at(Phase::Kick, motion.foot.end());
}
