//! Where am I: odometry, landmarks and what a league tells, as one pose on the field.
//!
//! Landmarks go through the filter that instep-localisation ships. A fix (a simulation server's own pose sense) overrules it
//! while it is fresh and is carried on by odometry; the filter runs beside it and takes over when fixes stop.

use std::collections::VecDeque;
use std::sync::Arc;

use instep_field::{Field, Pose};
use instep_localisation::{Frame, LandmarkFilter, Localiser, Map, Settings, Start, Status, Step};

use crate::PlayerError;
use crate::senses::{Fix, Sights};

/// Time between two steps of odometry that the filter is told, s.
const STEP: f64 = 0.02;
/// Odometry that is kept for frames that come late, s.
const KEPT: f64 = 1.0;
/// Faster than this, m/s, the odometry has broken, not the robot moved.
const FASTEST: f64 = 5.0;
/// A fix older than this is carried no farther, s.
const FIX_HOLDS: f64 = 1.0;
/// How much of a fixed pose's certainty an interrupted odometry costs: m, rad.
const INTERRUPTED: [f64; 2] = [0.5, 0.5];

/// The pose on the field.
#[derive(Debug, Clone)]
pub struct Place {
    localiser: Localiser<LandmarkFilter>,
    /// Odometry's pose of the last step, and its time.
    last: Option<(f64, Pose)>,
    trail: VecDeque<(f64, Pose)>,
    fix: Option<(Fix, Pose)>,
    frame: f64,
    refused: u64,
    buffer: Frame,
}

impl Place {
    /// On `field`, begun with what is known.
    ///
    /// # Errors
    /// When the field has no landmarks to localise by.
    pub fn new(field: &Field, start: Start) -> Result<Self, PlayerError> {
        let map = Arc::new(Map::new(field, true)?);
        Ok(Self {
            localiser: Localiser::new(LandmarkFilter::new(map, Settings::default()), start),
            last: None,
            trail: VecDeque::with_capacity(64),
            fix: None,
            frame: f64::NEG_INFINITY,
            refused: 0,
            buffer: Frame::default(),
        })
    }

    /// Begins anew with what is known.
    pub fn restart(&mut self, start: Start) {
        self.localiser.restart(start);
        self.fix = None;
    }

    /// Odometry begins anew, somewhere near: the robot fell or was carried.
    pub fn interrupt(&mut self) {
        let pose = self.pose();
        self.last = None;
        self.trail.clear();
        self.fix = None;
        if self.is_located() {
            let [position_sigma, heading_sigma] = INTERRUPTED;
            self.localiser.restart(Start::Near { pose, position_sigma, heading_sigma });
        }
    }

    /// The robot is at `odometry` (in the odometry's own frame) at `time`.
    pub fn walked(&mut self, time: f64, odometry: Pose) {
        if !odometry.is_finite() {
            return;
        }
        let Some((before, from)) = self.last else {
            self.last = Some((time, odometry));
            self.trail.push_back((time, odometry));
            self.tell(&Step { time, motion: Pose::default() });
            return;
        };
        if time - before < STEP - 1e-9 {
            return;
        }
        let motion = from.relative(&odometry);
        if motion.x.hypot(motion.y) > FASTEST * (time - before) {
            self.trail.clear();
            self.trail.push_back((time, odometry));
            self.last = Some((time, odometry));
            self.refused += 1;
            return;
        }
        self.tell(&Step { time, motion });
        self.last = Some((time, odometry));
        while self.trail.front().is_some_and(|first| first.0 < time - KEPT) {
            self.trail.pop_front();
        }
        self.trail.push_back((time, odometry));
        self.localiser.check_if_due();
    }

    fn tell(&mut self, step: &Step) {
        if self.localiser.step(step).is_err() {
            self.refused += 1;
        }
    }

    /// Odometry's pose at `time`, as near as it is kept.
    fn odometry_at(&self, time: f64) -> Option<Pose> {
        let after = self.trail.iter().find(|kept| kept.0 >= time - 1e-9);
        after.or(self.trail.back()).map(|kept| kept.1)
    }

    /// Takes the landmarks of a frame, once. Tells whether the frame is new.
    pub fn see(&mut self, sights: &Sights) -> bool {
        if !(sights.time > self.frame) {
            return false;
        }
        self.frame = sights.time;
        if sights.landmarks.is_empty() && sights.lines.is_empty() {
            return true;
        }
        self.buffer.time = sights.time;
        self.buffer.landmarks.clone_from(&sights.landmarks);
        self.buffer.lines.clone_from(&sights.lines);
        if self.localiser.see(&self.buffer).is_err() {
            self.refused += 1;
        }
        true
    }

    /// Takes what the league tells.
    pub fn fixed(&mut self, fix: &Fix) {
        let newer = self.fix.is_none_or(|(before, _)| fix.time > before.time);
        if !(newer && fix.time.is_finite() && fix.pose.is_finite() && fix.std.iter().all(|s| s.is_finite())) {
            return;
        }
        if let Some(odometry) = self.odometry_at(fix.time) {
            self.fix = Some((*fix, odometry));
        }
    }

    fn fresh_fix(&self) -> Option<&(Fix, Pose)> {
        let now = self.last?.0;
        self.fix.as_ref().filter(|(fix, _)| now - fix.time < FIX_HOLDS)
    }

    /// `field_from_robot`, now.
    #[must_use]
    pub fn pose(&self) -> Pose {
        match (self.fresh_fix(), self.last) {
            (Some((fix, then)), Some((_, now))) => fix.pose.then(&then.relative(&now)),
            _ => self.localiser.pose(),
        }
    }

    /// By landmarks and odometry alone, whatever a league tells.
    #[must_use]
    pub fn by_landmarks(&self) -> Pose {
        self.localiser.pose()
    }

    /// The pose at `time`, a moment ago.
    #[must_use]
    pub fn pose_at(&self, time: f64) -> Pose {
        let pose = self.pose();
        match (self.last, self.odometry_at(time)) {
            (Some((_, now)), Some(then)) => pose.then(&now.relative(&then)),
            _ => pose,
        }
    }

    /// Whether the pose may be believed.
    #[must_use]
    pub fn is_located(&self) -> bool {
        self.fresh_fix().is_some() || self.localiser.status() != Status::Lost
    }

    /// Covariance of (x, y, heading), m and rad.
    #[must_use]
    pub fn covariance(&self) -> [[f64; 3]; 3] {
        if let Some((fix, _)) = self.fresh_fix() {
            let [position, heading] = fix.std.map(|s| s * s);
            return [[position, 0.0, 0.0], [0.0, position, 0.0], [0.0, 0.0, heading]];
        }
        match self.localiser.covariance() {
            Some(c) if self.is_located() => std::array::from_fn(|i| std::array::from_fn(|j| c[(i, j)])),
            _ => [[100.0, 0.0, 0.0], [0.0, 100.0, 0.0], [0.0, 0.0, 10.0]],
        }
    }

    /// Steps and frames that were refused.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }
}
