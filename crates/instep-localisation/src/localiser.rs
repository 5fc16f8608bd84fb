//! What every method has in common: time. A frame is used at the moment when its picture was taken, and the pose of
//! now is that of then, carried on by the odometry since; so a delay costs no more than the odometry's drift in it.
//!
//! Here is also where input is refused that cannot be: a method sees only what is finite and in order.

use std::collections::VecDeque;

use instep_field::Pose;
use nalgebra::Matrix3;

use crate::{Candidate, Frame, LocalisationError, Step};

/// What is known at the start, from what really happened in the game.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// Placed by hand, or walked on from a known place.
    Near {
        /// Where about.
        pose: Pose,
        /// Standard deviation in each direction, m.
        position_sigma: f64,
        /// Standard deviation, rad.
        heading_sigma: f64,
    },
    /// Somewhere in our own half (kick-off, end of a penalty), with any heading.
    OwnHalf,
    /// Nothing is known. A symmetric field then has two answers.
    Anywhere,
}

/// How far a pose may be believed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Status {
    /// One pose, followed from frame to frame.
    Tracking,
    /// Followed, but the start left both halves open: this one explains the sights as well. Do not shoot before the
    /// game tells which.
    Ambiguous {
        /// The other pose.
        twin: Pose,
    },
    /// No pose. Stand still and look round.
    Lost,
}

/// A way to localise. Motions and frames come in the order of their time; all are finite.
pub trait Method {
    /// Short name for tables.
    fn name(&self) -> &'static str;

    /// Begins anew; whatever was known is forgotten.
    fn start(&mut self, start: Start);

    /// The robot moved by `motion` (`before_from_now`) in `dt` seconds.
    fn predict(&mut self, motion: &Pose, dt: f64);

    /// The robot sees this, now.
    fn update(&mut self, frame: &Frame);

    /// The slow part: looks at the last seconds as a whole. Called about twice a second, outside the tick.
    fn check(&mut self) {}

    /// Time between two checks, s.
    fn check_period(&self) -> f64 {
        0.5
    }

    /// `field_from_robot`; without meaning while the status is [`Status::Lost`].
    fn pose(&self) -> Pose;

    /// Of (x, y, heading), m and rad, where the method knows it.
    fn covariance(&self) -> Option<Matrix3<f64>> {
        None
    }

    /// How far the pose may be believed.
    fn status(&self) -> Status {
        Status::Tracking
    }

    /// How often the pose has been replaced since the start.
    fn resets(&self) -> usize {
        0
    }

    /// What the last check found, best first: for reports.
    fn candidates(&self) -> &[Candidate] {
        &[]
    }
}

impl Method for Box<dyn Method> {
    fn name(&self) -> &'static str {
        (**self).name()
    }
    fn start(&mut self, start: Start) {
        (**self).start(start);
    }
    fn predict(&mut self, motion: &Pose, dt: f64) {
        (**self).predict(motion, dt);
    }
    fn update(&mut self, frame: &Frame) {
        (**self).update(frame);
    }
    fn check(&mut self) {
        (**self).check();
    }
    fn check_period(&self) -> f64 {
        (**self).check_period()
    }
    fn pose(&self) -> Pose {
        (**self).pose()
    }
    fn covariance(&self) -> Option<Matrix3<f64>> {
        (**self).covariance()
    }
    fn status(&self) -> Status {
        (**self).status()
    }
    fn resets(&self) -> usize {
        (**self).resets()
    }
    fn candidates(&self) -> &[Candidate] {
        (**self).candidates()
    }
}

/// Odometry that is kept for frames that come late, s.
const KEPT: f64 = 2.0;
/// Steps that are kept at most.
const STEPS: usize = 4096;

/// A method, fed with stamped steps and frames.
#[derive(Debug, Clone)]
pub struct Localiser<M> {
    method: M,
    /// Steps since (and the last one before) the newest frame: end, motion.
    steps: VecDeque<(f64, Pose)>,
    /// End of the step before the first in `steps`, s.
    begin: Option<f64>,
    /// Time of the method's state, s.
    state: Option<f64>,
    checked: f64,
}

impl<M: Method> Localiser<M> {
    /// Begins with what is known.
    pub fn new(mut method: M, start: Start) -> Localiser<M> {
        method.start(start);
        let steps = VecDeque::with_capacity(256);
        Localiser { method, steps, begin: None, state: None, checked: f64::NEG_INFINITY }
    }

    /// Begins anew; time goes on.
    pub fn restart(&mut self, start: Start) {
        self.method.start(start);
        self.state = self.newest();
        self.begin = self.state;
        self.steps.clear();
    }

    /// End of the newest step, s.
    fn newest(&self) -> Option<f64> {
        self.steps.back().map(|s| s.0).or(self.begin)
    }

    /// The robot moved.
    ///
    /// # Errors
    /// [`LocalisationError`] for what is not finite and for time that runs backwards; then nothing has changed.
    pub fn step(&mut self, step: &Step) -> Result<(), LocalisationError> {
        step.validate()?;
        let Some(before) = self.newest() else {
            // The first step only tells when the odometry begins.
            self.begin = Some(step.time);
            self.state = Some(step.time);
            return Ok(());
        };
        if step.time < before {
            return Err(LocalisationError::Backwards { place: "odometry", found: step.time, before });
        }
        self.steps.push_back((step.time, step.motion));
        // A camera that is silent for long: the state follows the odometry.
        while self.steps.len() > STEPS || self.state.is_some_and(|state| step.time - state > KEPT) {
            let Some((end, motion)) = self.steps.pop_front() else { break };
            self.advance(&motion, end);
            self.begin = Some(end);
        }
        Ok(())
    }

    /// A frame arrived. A time beyond the newest step is taken as that step's end.
    ///
    /// # Errors
    /// [`LocalisationError`] for numbers that cannot be, for a frame older than one already used and for one whose
    /// odometry is no longer kept; then nothing has changed.
    pub fn see(&mut self, frame: &Frame) -> Result<(), LocalisationError> {
        frame.validate()?;
        let (Some(newest), Some(state)) = (self.newest(), self.state) else {
            self.begin = Some(frame.time);
            self.state = Some(frame.time);
            self.method.update(frame);
            return Ok(());
        };
        let time = frame.time.min(newest);
        if time < state {
            return Err(if newest - state >= KEPT {
                LocalisationError::TooOld { found: frame.time, kept: state }
            } else {
                LocalisationError::Backwards { place: "frame", found: frame.time, before: state }
            });
        }
        while let Some(&(end, motion)) = self.steps.front() {
            if end <= time {
                self.steps.pop_front();
                self.advance(&motion, end);
                self.begin = Some(end);
                continue;
            }
            // The frame falls into this step: its first part now, the rest later.
            let begin = self.begin.unwrap_or(end);
            let share = if end > begin { (time - begin) / (end - begin) } else { 0.0 };
            if share > 0.0 {
                let part = Pose::new(motion.x * share, motion.y * share, motion.heading * share);
                let rest = part.relative(&motion);
                self.advance(&part, time);
                self.begin = Some(time);
                if let Some(front) = self.steps.front_mut() {
                    front.1 = rest;
                }
            }
            break;
        }
        self.method.update(frame);
        Ok(())
    }

    fn advance(&mut self, motion: &Pose, end: f64) {
        let dt = self.state.map_or(0.0, |state| (end - state).max(0.0));
        self.method.predict(motion, dt);
        self.state = Some(end);
    }

    /// Runs the method's slow part when it is due, about twice a second. Tells whether it ran.
    pub fn check_if_due(&mut self) -> bool {
        let now = self.newest().unwrap_or(f64::NEG_INFINITY);
        let due = now >= self.checked + self.method.check_period() - 1e-9;
        if due {
            self.checked = now;
            self.method.check();
        }
        due
    }

    /// `field_from_robot` at the end of the newest step.
    pub fn pose(&self) -> Pose {
        self.steps.iter().fold(self.method.pose(), |pose, (_, motion)| pose.then(motion))
    }

    /// Of (x, y, heading) at the newest frame, m and rad.
    pub fn covariance(&self) -> Option<Matrix3<f64>> {
        self.method.covariance()
    }

    /// How far the pose may be believed.
    pub fn status(&self) -> Status {
        self.method.status()
    }

    /// The method itself.
    pub fn method(&self) -> &M {
        &self.method
    }
}
