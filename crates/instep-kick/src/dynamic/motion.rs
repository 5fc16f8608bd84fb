//! The phases of a kick as splines of the swing sole and of the trunk in the support sole's frame (paper 2, sections
//! 3.1 and 4.2), with times from distances, and the way back to the stand from any instant.

use instep_motion::phase::Side;
use instep_motion::spline::State;
use nalgebra::{Rotation3, Vector3};

use crate::dynamic::settings::DynamicSettings;
use crate::engine::{Face, Phase};
use crate::ik::Goals;
use crate::whole_body::body::Body;
use crate::whole_body::foot::windup_point;
use crate::whole_body::path::Path;

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
}

impl Stroke {
    /// Sole's x, y, z, yaw and pitch where the striking face is `way` (m) past the contact: equation (2) for the face.
    pub(crate) fn pose(&self, way: f64) -> [f64; 5] {
        let pitch = -self.pitch * way;
        let yaw = Rotation3::from_axis_angle(&Vector3::z_axis(), self.yaw);
        let pitched = yaw * Rotation3::from_axis_angle(&Vector3::y_axis(), pitch) * self.axis;
        let face = windup_point(&(self.contact + yaw * self.axis), self.direction, -way);
        let sole = face - pitched;
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

/// A whole motion. Times are the motion's own, s; it stands still where the engine holds it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    pub(crate) swing: Side,
    /// Sole's x, y, z, yaw, pitch.
    foot: Path<5>,
    /// Centre of mass x, y; base height, roll, pitch, yaw; share of the arms' way.
    trunk: Path<7>,
    /// Ends of the phases from [`Phase::Shift`] to [`Phase::ShiftBack`].
    ends: [f64; 7],
    pub(crate) contact: Option<f64>,
}

fn trunk_stand(body: &Body, swing: Side) -> [f64; 7] {
    let stand = body.stand(swing);
    let [roll, pitch, yaw] = stand.base;
    [stand.com.x, stand.com.y, stand.height, roll, pitch, yaw, 0.0]
}

/// The trunk over the support foot, with the base's share of the foot's `yaw`.
pub(crate) fn trunk_support(body: &Body, settings: &DynamicSettings, swing: Side, yaw: f64) -> [f64; 7] {
    let stand = body.stand(swing);
    let (s, sign) = (&settings.stance, Body::sign(swing));
    let [roll, pitch, base_yaw] = stand.base;
    [
        s.balance[0],
        sign * s.balance[1],
        stand.height - s.crouch,
        roll + sign * s.roll,
        pitch + s.pitch,
        base_yaw + settings.swing.base_yaw * yaw,
        1.0,
    ]
}

/// Goals from the two parts.
pub(crate) fn goals(foot: &[f64; 5], trunk: &[f64; 7]) -> Goals {
    Goals {
        position: Vector3::new(foot[0], foot[1], foot[2]),
        yaw_pitch: [foot[3], foot[4]],
        balance: [trunk[0], trunk[1]],
        height: trunk[2],
        base: [trunk[3], trunk[4], trunk[5]],
    }
}

impl Motion {
    /// Stands for ever, as seen from the support foot of `swing`.
    pub(crate) fn standing(body: &Body, swing: Side) -> Self {
        let stand = body.stand(swing);
        let [yaw, pitch] = stand.yaw_pitch;
        let foot = [stand.home.x, stand.home.y, stand.home.z, yaw, pitch];
        Self {
            swing,
            foot: Path::starting(0.0, State::at_rest(foot)),
            trunk: Path::starting(0.0, State::at_rest(trunk_stand(body, swing))),
            ends: [0.0; 7],
            contact: None,
        }
    }

    /// The kick with `stroke`, from the stand to the stand.
    pub(crate) fn kick(body: &Body, settings: &DynamicSettings, stroke: &Stroke) -> Self {
        let mut motion = Self::standing(body, stroke.swing);
        let times = &settings.times;
        let over = trunk_support(body, settings, stroke.swing, 0.0);
        motion.trunk.to(times.shift, State::at_rest(over));
        motion.trunk.hold(times.settle);
        motion.foot.hold(times.shift + times.settle);
        motion.ends[0] = motion.foot.end();
        let lifted = motion.lifted(body, settings);
        motion.foot.to(times.foot_least, State::at_rest(lifted));
        motion.trunk.hold(times.foot_least);
        motion.ends[1] = motion.foot.end();
        motion.stroke(body, settings, stroke);
        motion.back(body, settings);
        motion
    }

    /// The foot over its place.
    fn lifted(&self, body: &Body, settings: &DynamicSettings) -> [f64; 5] {
        let stand = body.stand(self.swing);
        let [yaw, pitch] = stand.yaw_pitch;
        [stand.home.x, stand.home.y, settings.swing.lift, yaw, pitch]
    }

    /// Wind-up and kick from where the paths end.
    fn stroke(&mut self, body: &Body, settings: &DynamicSettings, stroke: &Stroke) {
        let times = &settings.times;
        let (windup, follow) = (stroke.windup_pose(), stroke.follow_pose());
        let now = self.foot.last().position;
        let way = (Vector3::new(windup[0], windup[1], windup[2]) - Vector3::new(now[0], now[1], now[2])).norm();
        let duration = (way / times.foot_speed).max(times.foot_least);
        let turned = trunk_support(body, settings, self.swing, stroke.yaw);
        self.foot.to(duration, State::at_rest(windup));
        self.trunk.to(duration, State::at_rest(turned));
        self.foot.hold(times.aim);
        self.trunk.hold(times.aim);
        self.ends[2] = self.foot.end();
        let velocity = stroke.slope().map(|slope| slope * stroke.speed);
        let contact = State { position: stroke.pose(0.0), velocity, acceleration: [0.0; 5] };
        self.foot.to(stroke.time(), contact);
        self.contact = Some(self.foot.end());
        self.foot.to(2.0 * stroke.follow / stroke.speed, State::at_rest(follow));
        self.trunk.hold(self.foot.end() - self.trunk.end());
        self.ends[3] = self.foot.end();
    }

    /// From where the paths end, foot in the air: over its place, down, and the weight back between the feet.
    fn back(&mut self, body: &Body, settings: &DynamicSettings) {
        let times = &settings.times;
        let lifted = self.lifted(body, settings);
        let last = self.foot.last();
        let way = (Vector3::new(lifted[0], lifted[1], lifted[2])
            - Vector3::new(last.position[0], last.position[1], last.position[2]))
        .norm();
        let speed = Vector3::new(last.velocity[0], last.velocity[1], last.velocity[2]).norm();
        // A moving foot needs time to stop: at least what a brake over the wind-up distance would take.
        let brake = 2.0 * settings.swing.follow / speed.max(0.1);
        let stop = if speed > 0.05 { (1.5 * times.foot_least).max(brake.min(0.6)) } else { 0.0 };
        let duration = (way / times.foot_speed).max(times.foot_least).max(stop);
        self.foot.to(duration, State::at_rest(lifted));
        self.trunk.to(duration, State::at_rest(trunk_support(body, settings, self.swing, 0.0)));
        self.ends[4] = self.foot.end();
        let mut ground = lifted;
        ground[2] = body.stand(self.swing).home.z;
        self.foot.to(times.lower, State::at_rest(ground));
        self.trunk.hold(times.lower);
        self.ends[5] = self.foot.end();
        self.weight_back(body, times.shift_back);
    }

    /// From where the paths end, both feet on the ground: the weight back between the feet.
    fn weight_back(&mut self, body: &Body, duration: f64) {
        self.trunk.to(duration, State::at_rest(trunk_stand(body, self.swing)));
        self.foot.hold(duration);
        self.ends[6] = self.foot.end();
    }

    /// The shortest way back to the stand from `time`, for a cancel.
    pub(crate) fn cancelled(&self, body: &Body, settings: &DynamicSettings, time: f64) -> Self {
        let phase = self.phase(time);
        let mut motion = *self;
        match phase {
            Phase::Stand | Phase::MoveBack | Phase::Lower | Phase::ShiftBack => return motion,
            Phase::Shift => {
                motion.foot = Path::starting(time, State::at_rest(self.foot.at(time).position));
                motion.trunk = Path::starting(time, self.trunk.at(time));
                motion.ends = [time; 7];
                motion.contact = None;
                motion.weight_back(body, settings.times.shift_back);
            }
            Phase::Raise | Phase::WindUp | Phase::Kick => {
                motion.foot = Path::starting(time, self.foot.at(time));
                motion.trunk = Path::starting(time, self.trunk.at(time));
                motion.ends = [time; 7];
                motion.contact = None;
                motion.back(body, settings);
            }
        }
        motion
    }

    /// The foot straight to its place on the ground and the weight between the feet, from `time` after the contact: for
    /// a robot that tips toward the swing foot.
    pub(crate) fn caught(&self, body: &Body, settings: &DynamicSettings, time: f64) -> Self {
        let stand = body.stand(self.swing);
        let [yaw, pitch] = stand.yaw_pitch;
        let mut motion = *self;
        motion.foot = Path::starting(time, self.foot.at(time));
        motion.trunk = Path::starting(time, self.trunk.at(time));
        let home = [stand.home.x, stand.home.y, stand.home.z, yaw, pitch];
        motion.foot.to(settings.times.lower, State::at_rest(home));
        motion.ends[4] = motion.foot.end();
        motion.ends[5] = motion.foot.end();
        // The body is on its way to the middle already: it gets there with the foot's landing or soon after.
        motion
            .trunk
            .to(settings.times.lower + 0.5 * settings.times.shift_back, State::at_rest(trunk_stand(body, self.swing)));
        motion.foot.hold(motion.trunk.end() - motion.foot.end());
        motion.ends[6] = motion.trunk.end();
        motion
    }

    /// Another stroke from `time` in the wind-up, for a ball that has moved.
    pub(crate) fn retargeted(&self, body: &Body, settings: &DynamicSettings, time: f64, stroke: &Stroke) -> Self {
        let mut motion = *self;
        motion.foot = Path::starting(time, self.foot.at(time));
        motion.trunk = Path::starting(time, self.trunk.at(time));
        motion.stroke(body, settings, stroke);
        motion.back(body, settings);
        motion
    }

    /// Where the engine wants everything at `time`.
    pub(crate) fn goals(&self, time: f64) -> Goals {
        goals(&self.foot.at(time).position, &self.trunk.at(time).position)
    }

    /// Share of the arms' way at `time`.
    pub(crate) fn arms(&self, time: f64) -> f64 {
        self.trunk.at(time).position[6]
    }

    /// End, s.
    pub(crate) fn end(&self) -> f64 {
        self.ends[6]
    }

    /// End of a phase, s.
    pub(crate) fn end_of(&self, phase: Phase) -> f64 {
        match phase {
            Phase::Stand => 0.0,
            _ => self.ends[phase as usize - 1],
        }
    }

    /// The phase at `time`.
    pub(crate) fn phase(&self, time: f64) -> Phase {
        const PHASES: [Phase; 7] =
            [Phase::Shift, Phase::Raise, Phase::WindUp, Phase::Kick, Phase::MoveBack, Phase::Lower, Phase::ShiftBack];
        PHASES.into_iter().zip(self.ends).find(|(_, end)| time < *end).map_or(Phase::Stand, |(phase, _)| phase)
    }

    /// Whether both feet stand at `time`.
    pub(crate) fn both_feet(&self, time: f64) -> bool {
        matches!(self.phase(time), Phase::Stand | Phase::Shift | Phase::ShiftBack)
    }
}
