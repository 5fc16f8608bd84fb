//! The phases of a kick: the swing sole's way (quintics to the retraction point, the kick's two cubics, quintics back),
//! that of the base, and the reference of the zero-moment point, all in the support sole's frame; and the way back to the
//! stand from any instant.

use instep_motion::phase::Side;
use instep_motion::spline::State;

use crate::engine::Phase;
use crate::preview::settings::PreviewSettings;
use crate::preview::stroke::Stroke;
use crate::whole_body::body::Body;
use crate::whole_body::motion::{place, way_back};
use crate::whole_body::path::Path;
use crate::whole_body::timeline::Timeline;
use instep_robot::ik::Goals;

/// Half the step of the differences that give the foot's speed, s.
const STEP: f64 = 1e-4;

/// A whole motion. Times are the motion's own, s; it stands still where the engine holds it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    pub(crate) swing: Side,
    /// Sole's x, y, z, yaw, pitch until the retraction point, and from the kick's end on.
    before: Path<5>,
    after: Path<5>,
    /// The kick and its start.
    kick: Option<(f64, Stroke)>,
    /// Base height, roll, pitch, yaw; share of the arms' way.
    trunk: Path<5>,
    /// Reference of the zero-moment point, x and y.
    zmp: Path<2>,
    pub(crate) timeline: Timeline,
    pub(crate) contact: Option<f64>,
}

/// The trunk on two feet: base height, roll, pitch, yaw; share of the arms' way.
fn trunk_stand(body: &Body, swing: Side) -> [f64; 5] {
    let stand = body.stand(swing);
    let [roll, pitch, yaw] = stand.base;
    [stand.height, roll, pitch, yaw, 0.0]
}

/// The trunk over the support foot, with the base's share of the foot's `yaw`.
pub(crate) fn trunk_support(body: &Body, settings: &PreviewSettings, swing: Side, yaw: f64) -> [f64; 5] {
    let s = &settings.stance;
    let [height, roll, pitch, yaw] =
        body.base_support(swing, s.crouch, [s.roll, s.pitch], settings.swing.base_yaw * yaw);
    [height, roll, pitch, yaw, 1.0]
}

/// The reference of the zero-moment point in the support sole, m.
pub(crate) fn zmp_support(settings: &PreviewSettings, swing: Side) -> [f64; 2] {
    let [x, y] = settings.stance.balance;
    [x, Body::sign(swing) * y]
}

/// The centre of mass of the stand, m: the reference of the zero-moment point on two feet.
pub(crate) fn zmp_stand(body: &Body, swing: Side) -> [f64; 2] {
    let com = body.stand(swing).com;
    [com.x, com.y]
}

/// Goals from the parts.
pub(crate) fn goals(foot: &[f64; 5], trunk: &[f64; 5], com: [f64; 2]) -> Goals {
    Goals {
        position: place(foot),
        yaw_pitch: [foot[3], foot[4]],
        balance: com,
        height: trunk[0],
        base: [trunk[1], trunk[2], trunk[3]],
    }
}

impl Motion {
    /// Stands for ever, as seen from the support foot of `swing`.
    pub(crate) fn standing(body: &Body, swing: Side) -> Self {
        let foot = Path::starting(0.0, State::at_rest(body.home(swing)));
        Self {
            swing,
            before: foot,
            after: foot,
            kick: None,
            trunk: Path::starting(0.0, State::at_rest(trunk_stand(body, swing))),
            zmp: Path::starting(0.0, State::at_rest(zmp_stand(body, swing))),
            timeline: Timeline::default(),
            contact: None,
        }
    }

    /// The kick with `stroke`, from the stand to the stand.
    pub(crate) fn kick(body: &Body, settings: &PreviewSettings, stroke: &Stroke) -> Self {
        let swing = stroke.swing;
        let mut motion = Self::standing(body, swing);
        let times = &settings.times;
        motion.zmp.hold(0.25 * times.shift);
        motion.zmp.to(0.5 * times.shift, State::at_rest(zmp_support(settings, swing)));
        motion.trunk.to(times.shift, State::at_rest(trunk_support(body, settings, swing, 0.0)));
        motion.trunk.hold(times.settle);
        motion.before.hold(times.shift + times.settle);
        motion.timeline.end_at(Phase::Shift, motion.before.end());
        let lifted = body.lifted(swing, settings.swing.lift);
        motion.before.to(times.foot_least, State::at_rest(lifted));
        motion.trunk.hold(times.foot_least);
        motion.timeline.end_at(Phase::Raise, motion.before.end());
        let retraction = stroke.retraction();
        let way = (place(&retraction) - place(&lifted)).norm();
        let duration = (way / times.foot_speed).max(times.foot_least);
        motion.before.to(duration, State::at_rest(retraction));
        motion.trunk.to(duration, State::at_rest(trunk_support(body, settings, swing, stroke.yaw)));
        motion.before.hold(times.aim);
        let start = motion.before.end();
        let end = start + stroke.time;
        motion.timeline.end_at(Phase::WindUp, start);
        motion.kick = Some((start, *stroke));
        motion.contact = Some(start + stroke.time * stroke.shape.contact);
        motion.timeline.end_at(Phase::Kick, end);
        motion.trunk.hold(end - motion.trunk.end());
        motion.zmp.hold(end - motion.zmp.end());
        motion.after = Path::starting(end, State::at_rest(stroke.end()));
        motion.back(body, settings);
        motion
    }

    /// From where the paths end, foot in the air: over its place, down, and the weight back between the feet.
    fn back(&mut self, body: &Body, settings: &PreviewSettings) {
        let times = &settings.times;
        let lifted = body.lifted(self.swing, settings.swing.lift);
        let last = self.after.last();
        let (way, speed) = ((place(&lifted) - place(&last.position)).norm(), place(&last.velocity).norm());
        let duration = way_back(times, settings.swing.follow, way, speed);
        self.after.to(duration, State::at_rest(lifted));
        self.trunk.to(duration, State::at_rest(trunk_support(body, settings, self.swing, 0.0)));
        self.timeline.end_at(Phase::MoveBack, self.after.end());
        self.after.to(times.lower, State::at_rest(body.home(self.swing)));
        self.trunk.hold(times.lower);
        self.timeline.end_at(Phase::Lower, self.after.end());
        self.zmp.hold(self.after.end() - self.zmp.end());
        self.weight_back(body, times.shift_back);
    }

    /// From where the paths end, both feet on the ground: the weight back between the feet.
    fn weight_back(&mut self, body: &Body, duration: f64) {
        self.trunk.to(duration, State::at_rest(trunk_stand(body, self.swing)));
        self.zmp.hold(0.25 * duration);
        self.zmp.to(0.5 * duration, State::at_rest(zmp_stand(body, self.swing)));
        self.after.hold(duration);
        self.timeline.end_at(Phase::ShiftBack, self.after.end());
    }

    /// The shortest way back to the stand from `time`, for a cancel.
    pub(crate) fn cancelled(&self, body: &Body, settings: &PreviewSettings, time: f64) -> Self {
        let mut motion = *self;
        let phase = self.timeline.phase(time);
        if matches!(phase, Phase::Stand | Phase::MoveBack | Phase::Lower | Phase::ShiftBack) {
            return motion;
        }
        motion.trunk = Path::starting(time, self.trunk.at(time));
        motion.zmp = Path::starting(time, State::at_rest(self.zmp.at(time).position));
        motion.after = Path::starting(time, self.foot_state(time));
        motion.before = motion.after;
        motion.kick = None;
        motion.timeline = Timeline::over(time);
        motion.contact = None;
        if phase == Phase::Shift {
            motion.weight_back(body, settings.times.shift_back);
        } else {
            motion.back(body, settings);
        }
        motion
    }

    /// Sole's x, y, z, yaw and pitch at `time`.
    pub(crate) fn foot(&self, time: f64) -> [f64; 5] {
        match &self.kick {
            Some((start, stroke)) if time >= *start && time < self.timeline.end_of(Phase::Kick) => {
                stroke.at(time - start)
            }
            Some((start, _)) if time < *start => self.before.at(time).position,
            _ => self.after.at(time).position,
        }
    }

    /// The same with speed and acceleration, by differences.
    fn foot_state(&self, time: f64) -> State<5> {
        let (a, b, c) = (self.foot(time - STEP), self.foot(time), self.foot(time + STEP));
        State {
            position: b,
            velocity: std::array::from_fn(|i| (c[i] - a[i]) / (2.0 * STEP)),
            acceleration: std::array::from_fn(|i| (c[i] - 2.0 * b[i] + a[i]) / (STEP * STEP)),
        }
    }

    /// Where foot and base are to be at `time`, with the centre of mass at `com` (m).
    pub(crate) fn goals(&self, time: f64, com: [f64; 2]) -> Goals {
        goals(&self.foot(time), &self.trunk.at(time).position, com)
    }

    /// Reference of the zero-moment point at `time`, m.
    pub(crate) fn zmp(&self, time: f64) -> [f64; 2] {
        self.zmp.at(time).position
    }

    /// Share of the arms' way at `time`.
    pub(crate) fn arms(&self, time: f64) -> f64 {
        self.trunk.at(time).position[4]
    }
}
