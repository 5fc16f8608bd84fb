//! A kick as splines of the swing sole and of the trunk in the support sole's frame (paper 2, sections 3.1 and 4.2), and
//! the way back to the stand from any instant. Engines lay the strike between; the rest is here.

use instep_motion::phase::Side;
use instep_motion::spline::State;
use nalgebra::Vector3;

use crate::engine::Phase;
use crate::whole_body::body::Body;
use crate::whole_body::path::Path;
use crate::whole_body::settings::{Stance, Times};
use crate::whole_body::timeline::Timeline;
use instep_robot::ik::Goals;

/// What a motion takes from an engine's settings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Manner<'a> {
    pub(crate) times: &'a Times,
    pub(crate) stance: &'a Stance,
    /// Height of the sole over its place before and after the swing, m.
    pub(crate) lift: f64,
    /// Way in which the foot can brake after the contact, m.
    pub(crate) follow: f64,
    /// Share of the foot's yaw that the base turns.
    pub(crate) base_yaw: f64,
}

/// A whole motion. Times are the motion's own, s; it stands still where the engine holds it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    pub(crate) swing: Side,
    /// Sole's x, y, z, yaw, pitch.
    pub(crate) foot: Path<5>,
    /// Centre of mass x, y; base height, roll, pitch, yaw; share of the arms' way.
    pub(crate) trunk: Path<7>,
    pub(crate) timeline: Timeline,
    pub(crate) contact: Option<f64>,
}

fn trunk_stand(body: &Body, swing: Side) -> [f64; 7] {
    let stand = body.stand(swing);
    let [roll, pitch, yaw] = stand.base;
    [stand.com.x, stand.com.y, stand.height, roll, pitch, yaw, 0.0]
}

/// Where a sole's pose is, m.
pub(crate) fn place(pose: &[f64; 5]) -> Vector3<f64> {
    Vector3::new(pose[0], pose[1], pose[2])
}

/// Goals from the two parts.
pub(crate) fn goals(foot: &[f64; 5], trunk: &[f64; 7]) -> Goals {
    Goals {
        position: place(foot),
        yaw_pitch: [foot[3], foot[4]],
        balance: [trunk[0], trunk[1]],
        height: trunk[2],
        base: [trunk[3], trunk[4], trunk[5]],
    }
}

/// Time from a place to rest over the stand, s, for a foot `way` (m) off that moves at `speed` (m/s): at least what a
/// brake over `follow` (m) would take, for a moving foot needs time to stop.
pub(crate) fn way_back(times: &Times, follow: f64, way: f64, speed: f64) -> f64 {
    let brake = 2.0 * follow / speed.max(0.1);
    let stop = if speed > 0.05 { (1.5 * times.foot_least).max(brake.min(0.6)) } else { 0.0 };
    (way / times.foot_speed).max(times.foot_least).max(stop)
}

impl Manner<'_> {
    /// The trunk over the support foot, with the base's share of the foot's `yaw`.
    pub(crate) fn trunk_support(&self, body: &Body, swing: Side, yaw: f64) -> [f64; 7] {
        let (s, sign) = (self.stance, Body::sign(swing));
        let [height, roll, pitch, base_yaw] =
            body.base_support(swing, s.crouch, [s.roll, s.pitch], self.base_yaw * yaw);
        [s.balance[0], sign * s.balance[1], height, roll, pitch, base_yaw, 1.0]
    }

    /// Goals of the pose on the support foot with the other one lifted over its place, level and straight.
    pub(crate) fn lifted_goals(&self, body: &Body, swing: Side) -> Goals {
        let home = body.stand(swing).home;
        goals(&[home.x, home.y, self.lift, 0.0, 0.0], &self.trunk_support(body, swing, 0.0))
    }
}

impl Motion {
    /// Stands for ever, as seen from the support foot of `swing`.
    pub(crate) fn standing(body: &Body, swing: Side) -> Self {
        Self {
            swing,
            foot: Path::starting(0.0, State::at_rest(body.home(swing))),
            trunk: Path::starting(0.0, State::at_rest(trunk_stand(body, swing))),
            timeline: Timeline::default(),
            contact: None,
        }
    }

    /// From the stand to the foot lifted over its place, or `away` (m) from there.
    pub(crate) fn raised(body: &Body, manner: &Manner<'_>, swing: Side, away: [f64; 2]) -> Self {
        let mut motion = Self::standing(body, swing);
        let times = manner.times;
        motion.trunk.to(times.shift, State::at_rest(manner.trunk_support(body, swing, 0.0)));
        motion.trunk.hold(times.settle);
        motion.foot.hold(times.shift + times.settle);
        motion.timeline.end_at(Phase::Shift, motion.foot.end());
        let mut lifted = body.lifted(swing, manner.lift);
        (0..2).for_each(|k| lifted[k] += away[k]);
        motion.foot.to(times.foot_least, State::at_rest(lifted));
        motion.trunk.hold(times.foot_least);
        motion.timeline.end_at(Phase::Raise, motion.foot.end());
        motion
    }

    /// From where the paths end, foot in the air: over its place, down, and the weight back between the feet. `pace`
    /// stretches the way over its place.
    pub(crate) fn back(&mut self, body: &Body, manner: &Manner<'_>, pace: f64) {
        let times = manner.times;
        let lifted = body.lifted(self.swing, manner.lift);
        let last = self.foot.last();
        let (way, speed) = ((place(&lifted) - place(&last.position)).norm(), place(&last.velocity).norm());
        let duration = pace * way_back(times, manner.follow, way, speed);
        self.foot.to(duration, State::at_rest(lifted));
        self.trunk.to(duration, State::at_rest(manner.trunk_support(body, self.swing, 0.0)));
        self.timeline.end_at(Phase::MoveBack, self.foot.end());
        let mut ground = lifted;
        ground[2] = body.stand(self.swing).home.z;
        self.foot.to(times.lower, State::at_rest(ground));
        self.trunk.hold(times.lower);
        self.timeline.end_at(Phase::Lower, self.foot.end());
        self.weight_back(body, times.shift_back);
    }

    /// From where the paths end, both feet on the ground: the weight back between the feet.
    fn weight_back(&mut self, body: &Body, duration: f64) {
        self.trunk.to(duration, State::at_rest(trunk_stand(body, self.swing)));
        self.foot.hold(duration);
        self.timeline.end_at(Phase::ShiftBack, self.foot.end());
    }

    /// Both paths from where they are at `time`, to be laid anew.
    pub(crate) fn from(&self, time: f64) -> Self {
        let mut motion = *self;
        motion.foot = Path::starting(time, self.foot.at(time));
        motion.trunk = Path::starting(time, self.trunk.at(time));
        motion
    }

    /// The shortest way back to the stand from `time`, at `pace`, for a cancel.
    pub(crate) fn cancelled(&self, body: &Body, manner: &Manner<'_>, time: f64, pace: f64) -> Self {
        let phase = self.timeline.phase(time);
        if matches!(phase, Phase::Stand | Phase::MoveBack | Phase::Lower | Phase::ShiftBack) {
            return *self;
        }
        let mut motion = self.from(time);
        motion.timeline = Timeline::over(time);
        motion.contact = None;
        if phase == Phase::Shift {
            motion.foot = Path::starting(time, State::at_rest(self.foot.at(time).position));
            motion.weight_back(body, manner.times.shift_back);
        } else {
            motion.back(body, manner, pace);
        }
        motion
    }

    /// The foot straight to its place on the ground and the weight between the feet, from `time` after the contact: for
    /// a robot that tips toward the swing foot.
    pub(crate) fn caught(&self, body: &Body, manner: &Manner<'_>, time: f64) -> Self {
        let times = manner.times;
        let mut motion = self.from(time);
        motion.foot.to(times.lower, State::at_rest(body.home(self.swing)));
        motion.timeline.end_at(Phase::MoveBack, motion.foot.end());
        motion.timeline.end_at(Phase::Lower, motion.foot.end());
        // The body is on its way to the middle already: it gets there with the foot's landing or soon after.
        motion.trunk.to(times.lower + 0.5 * times.shift_back, State::at_rest(trunk_stand(body, self.swing)));
        motion.foot.hold(motion.trunk.end() - motion.foot.end());
        motion.timeline.end_at(Phase::ShiftBack, motion.trunk.end());
        motion
    }

    /// Where everything is wanted at `time`.
    pub(crate) fn goals(&self, time: f64) -> Goals {
        goals(&self.foot.at(time).position, &self.trunk.at(time).position)
    }

    /// Share of the arms' way at `time`.
    pub(crate) fn arms(&self, time: f64) -> f64 {
        self.trunk.at(time).position[6]
    }
}
