//! The four phases of the kick (paper 3, section 2) as curves of the swing sole and of the trunk in the support sole's
//! frame: preparation (the weight goes over the support foot, the other is lifted), retraction, execution, wrap-up.
//!
//! Until the strike begins the curves are laid anew from where everything is, each time that the retraction point or the
//! foot target has moved; the way back to the stand can be laid from any instant.

use instep_motion::phase::Side;
use instep_motion::spline::State;
use nalgebra::{Vector2, Vector3};

use crate::adaptive::geometry::Part;
use crate::adaptive::settings::AdaptiveSettings;
use crate::engine::{Face, Phase};
use crate::ik::Goals;
use crate::whole_body::body::Body;
use crate::whole_body::path::Path;

/// Most corners of the way from the retraction point to the foot target.
pub(crate) const CORNERS: usize = 2;
/// Pace of the way back after a break-off or from another stroke, which no forecast has seen.
const CAREFUL: f64 = 2.0;
/// Largest acceleration of a quintic between rests, over its way and the square of its time.
const QUINTIC: f64 = 5.77;
/// Largest acceleration of the foot when the retraction is laid anew, m/s^2.
const ACCELERATION: f64 = 3.5;
/// Way aside and forward from which on the foot goes around the ball, m.
const ASIDE: f64 = 0.03;
/// Share of the strike's speed with which the foot passes a corner.
const CORNER_SPEED: f64 = 0.6;

/// Everything that depends on the ball. Places are the sole's centre in the support sole's frame, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stroke {
    pub(crate) swing: Side,
    pub(crate) face: Face,
    pub(crate) part: Part,
    /// Foot yaw, rad.
    pub(crate) yaw: f64,
    /// Retraction point p_r.
    pub(crate) retraction: Vector3<f64>,
    /// Corners of the way between.
    pub(crate) corners: [Option<Vector3<f64>>; CORNERS],
    /// Foot target p_f.
    pub(crate) contact: Vector3<f64>,
    /// Way after the contact, m.
    pub(crate) follow: f64,
    /// Foot speed at the contact, m/s.
    pub(crate) speed: f64,
    /// g(p_r).
    pub(crate) forecast: f64,
    /// The ball at the contact, support sole's frame, m.
    pub(crate) ball: Vector2<f64>,
    /// Direction of the push at the contact, rad.
    pub(crate) normal: f64,
    /// What the times of retraction and way back are multiplied with, 1 or more.
    pub(crate) pace: f64,
    /// When the contact should be, s of the motion; 0: as soon as can be.
    pub(crate) at: f64,
}

impl Stroke {
    /// Direction in which the foot moves at the contact: a unit vector.
    pub(crate) fn direction(&self) -> Vector3<f64> {
        let before = self.corners.iter().rev().flatten().next().unwrap_or(&self.retraction);
        (self.contact - before).try_normalize(1e-9).unwrap_or(Vector3::x())
    }

    /// Where the foot comes to rest after the contact: level, whatever the way before.
    pub(crate) fn rest(&self) -> Vector3<f64> {
        let along = self.direction();
        self.contact + Vector3::new(along.x, along.y, 0.0) * self.follow
    }

    /// The sole's x, y, z, yaw, pitch at a place.
    pub(crate) fn pose(&self, place: &Vector3<f64>) -> [f64; 5] {
        [place.x, place.y, place.z, self.yaw, 0.0]
    }

    /// Length of the last straight part of the way, m.
    pub(crate) fn run(&self) -> f64 {
        let before = self.corners.iter().rev().flatten().next().unwrap_or(&self.retraction);
        (self.contact - before).norm()
    }

    /// From the retraction point to the contact, s: with a quintic from rest to the speed v without acceleration at
    /// either end the mean speed is v / 2.
    pub(crate) fn time(&self) -> f64 {
        let mut time = 0.0;
        let mut from = self.retraction;
        let mut start = 0.0;
        for corner in self.corners.iter().flatten() {
            let pass = CORNER_SPEED * self.speed;
            time += 2.0 * (corner - from).norm() / (start + pass);
            (from, start) = (*corner, pass);
        }
        time + 2.0 * (self.contact - from).norm() / (start + self.speed)
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
pub(crate) fn trunk_support(body: &Body, settings: &AdaptiveSettings, swing: Side, yaw: f64) -> [f64; 7] {
    let stand = body.stand(swing);
    let (s, sign) = (&settings.stance, Body::sign(swing));
    let [roll, pitch, base_yaw] = stand.base;
    [
        s.balance[0],
        sign * s.balance[1],
        stand.height - s.crouch,
        roll + sign * s.roll,
        pitch + s.pitch,
        base_yaw + settings.kick.base_yaw * yaw,
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

fn place(pose: &[f64; 5]) -> Vector3<f64> {
    Vector3::new(pose[0], pose[1], pose[2])
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
    pub(crate) fn kick(body: &Body, settings: &AdaptiveSettings, stroke: &Stroke) -> Self {
        let mut motion = Self::standing(body, stroke.swing);
        let times = &settings.times;
        motion.trunk.to(times.shift, State::at_rest(trunk_support(body, settings, stroke.swing, 0.0)));
        motion.trunk.hold(times.settle);
        motion.foot.hold(times.shift + times.settle);
        motion.ends[0] = motion.foot.end();
        let lifted = motion.lifted(body, settings);
        motion.foot.to(times.foot_least, State::at_rest(lifted));
        motion.trunk.hold(times.foot_least);
        motion.ends[1] = motion.foot.end();
        motion.retract(body, settings, stroke, times.foot_least);
        motion.strike(stroke);
        motion.back(body, settings, stroke.pace);
        motion
    }

    /// The foot over its place.
    fn lifted(&self, body: &Body, settings: &AdaptiveSettings) -> [f64; 5] {
        let stand = body.stand(self.swing);
        let [yaw, pitch] = stand.yaw_pitch;
        [stand.home.x, stand.home.y, settings.kick.lift, yaw, pitch]
    }

    /// From where the paths end to the retraction point, within `least` (s) or longer.
    fn retract(&mut self, body: &Body, settings: &AdaptiveSettings, stroke: &Stroke, least: f64) {
        let times = &settings.times;
        let last = self.foot.last();
        let goal = stroke.pose(&stroke.retraction);
        let way = (stroke.retraction - place(&last.position)).norm();
        let duration = stroke.pace * (way / times.foot_speed).max(least);
        // Beside a ball that lies in front of the foot: first aside, then forward.
        let from = last.position;
        let aside = Body::sign(self.swing) * (goal[1] - from[1]);
        if aside > ASIDE && goal[0] - from[0] > ASIDE {
            let share = [0.15, 0.85, 0.5, 0.5, 0.5];
            let rate = [0.9, 0.9, 1.0, 1.0, 1.0];
            let position = std::array::from_fn(|k| from[k] + share[k] * (goal[k] - from[k]));
            let velocity = std::array::from_fn(|k| rate[k] * (goal[k] - from[k]) / duration);
            self.foot.to(0.5 * duration, State { position, velocity, acceleration: [0.0; 5] });
            self.foot.to(0.5 * duration, State::at_rest(goal));
        } else {
            self.foot.to(duration, State::at_rest(goal));
        }
        self.trunk.to(duration, State::at_rest(trunk_support(body, settings, self.swing, stroke.yaw)));
        let wait = times.aim.max(stroke.at - stroke.time() - self.foot.end());
        self.foot.hold(wait);
        self.trunk.hold(wait);
        self.ends[2] = self.foot.end();
    }

    /// From the retraction point through the ball to rest.
    fn strike(&mut self, stroke: &Stroke) {
        let mut from = stroke.retraction;
        let mut speed = 0.0;
        let points = stroke.corners.iter().flatten().copied().chain([stroke.contact]);
        let count = stroke.corners.iter().flatten().count();
        for (i, point) in points.enumerate() {
            let pass = if i == count { stroke.speed } else { CORNER_SPEED * stroke.speed };
            let direction = if i == count {
                stroke.direction()
            } else {
                let next =
                    stroke.corners.get(i + 1).copied().flatten().filter(|_| i + 1 < count).unwrap_or(stroke.contact);
                (next - from).try_normalize(1e-9).unwrap_or(Vector3::x())
            };
            let velocity = direction * pass;
            let state = State {
                position: stroke.pose(&point),
                velocity: [velocity.x, velocity.y, velocity.z, 0.0, 0.0],
                acceleration: [0.0; 5],
            };
            self.foot.to(2.0 * (point - from).norm() / (speed + pass), state);
            (from, speed) = (point, pass);
        }
        self.contact = Some(self.foot.end());
        self.foot.to(2.0 * stroke.follow / stroke.speed, State::at_rest(stroke.pose(&stroke.rest())));
        self.trunk.hold(self.foot.end() - self.trunk.end());
        self.ends[3] = self.foot.end();
    }

    /// From where the paths end, foot in the air: over its place, down, and the weight back between the feet.
    fn back(&mut self, body: &Body, settings: &AdaptiveSettings, pace: f64) {
        let times = &settings.times;
        let lifted = self.lifted(body, settings);
        let last = self.foot.last();
        let way = (place(&lifted) - place(&last.position)).norm();
        let speed = place(&last.velocity).norm();
        // A moving foot needs time to stop: at least what a brake over the follow-through would take.
        let brake = 2.0 * settings.kick.follow / speed.max(0.1);
        let stop = if speed > 0.05 { (1.5 * times.foot_least).max(brake.min(0.6)) } else { 0.0 };
        let duration = pace * (way / times.foot_speed).max(times.foot_least).max(stop);
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

    /// Both paths from where they are at `time`.
    fn from(&self, time: f64) -> Self {
        let mut motion = *self;
        motion.foot = Path::starting(time, self.foot.at(time));
        motion.trunk = Path::starting(time, self.trunk.at(time));
        motion
    }

    /// The shortest way back to the stand from `time`, for a break-off.
    pub(crate) fn cancelled(&self, body: &Body, settings: &AdaptiveSettings, time: f64) -> Self {
        let mut motion = self.from(time);
        match self.phase(time) {
            Phase::Stand | Phase::MoveBack | Phase::Lower | Phase::ShiftBack => return *self,
            Phase::Shift => {
                motion.foot = Path::starting(time, State::at_rest(self.foot.at(time).position));
                motion.ends = [time; 7];
                motion.contact = None;
                motion.weight_back(body, settings.times.shift_back);
            }
            Phase::Raise | Phase::WindUp | Phase::Kick => {
                motion.ends = [time; 7];
                motion.contact = None;
                motion.back(body, settings, CAREFUL);
            }
        }
        motion
    }

    /// The foot straight to its place on the ground and the weight between the feet, from `time` after the contact: for
    /// a robot that tips toward the swing foot.
    pub(crate) fn caught(&self, body: &Body, settings: &AdaptiveSettings, time: f64) -> Self {
        let stand = body.stand(self.swing);
        let [yaw, pitch] = stand.yaw_pitch;
        let mut motion = self.from(time);
        let home = [stand.home.x, stand.home.y, stand.home.z, yaw, pitch];
        motion.foot.to(settings.times.lower, State::at_rest(home));
        motion.ends[4] = motion.foot.end();
        motion.ends[5] = motion.foot.end();
        let whole = settings.times.lower + 0.5 * settings.times.shift_back;
        motion.trunk.to(whole, State::at_rest(trunk_stand(body, self.swing)));
        motion.foot.hold(motion.trunk.end() - motion.foot.end());
        motion.ends[6] = motion.trunk.end();
        motion
    }

    /// The retraction and what follows laid anew from `time` for another stroke; before the retraction only what comes
    /// after the foot's raise changes.
    pub(crate) fn adapted(&self, body: &Body, settings: &AdaptiveSettings, time: f64, stroke: &Stroke) -> Self {
        if self.phase(time) < Phase::WindUp {
            let mut whole = Self::kick(body, settings, stroke);
            whole.ends[0] = self.ends[0];
            return whole;
        }
        let mut motion = self.from(time);
        // What is left of the time that a retraction takes, or what the way takes without haste.
        let way = (stroke.retraction - place(&motion.foot.last().position)).norm();
        let left = (self.ends[1] + settings.times.foot_least - time).max((QUINTIC * way / ACCELERATION).sqrt());
        motion.retract(body, settings, stroke, left);
        motion.strike(stroke);
        motion.back(body, settings, stroke.pace.max(CAREFUL));
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
