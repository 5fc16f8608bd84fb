//! A window of a reference on one robot, in the robot's joint order, with the torques that it needs; then a stand in the
//! pose at the window's end. What a playback plays and a policy follows.
//!
//! A window leaves out what is no part of the kick: the ends of an optimised reference, where nothing lies beyond that
//! could hold its speeds, and the steps with which the human walks away. Times here count from the window's start.

use std::sync::Arc;

use instep_motion::reference::{Knot, Reference};
use instep_robot::Robot;

use crate::{KickError, feedforward};

/// One state of the motion, in the robot's joint order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrackState {
    /// Position, 7 + n.
    pub q: Vec<f64>,
    /// Speed, 6 + n.
    pub v: Vec<f64>,
    /// Feed-forward torques, n, N m.
    pub torques: Vec<f64>,
}

/// A window of a reference on one robot.
#[derive(Debug, Clone)]
pub struct Track {
    reference: Arc<Reference>,
    /// For each of the robot's joints, its place in the reference.
    places: Vec<usize>,
    /// Feed-forward torques of each knot in the robot's joint order, N m.
    torques: Vec<Vec<f64>>,
    window: [f64; 2],
    knot: Knot,
}

impl Track {
    /// The part of `reference` from `window[0]` to `window[1]` (s, in the reference's time) on `robot`.
    ///
    /// # Errors
    /// When the reference is another robot's, or the window is empty or not inside it.
    pub fn new(robot: &Robot, reference: Arc<Reference>, window: [f64; 2]) -> Result<Self, KickError> {
        if reference.robot != robot.name {
            return Err(KickError::OtherRobot { reference: reference.robot.clone(), robot: robot.name.clone() });
        }
        let duration = reference.duration();
        if !(window[0] >= 0.0 && window[0] < window[1] && window[1] <= duration) {
            return Err(KickError::Setting {
                field: "window".into(),
                found: format!("[{}, {}]", window[0], window[1]),
                expected: format!("two rising times from 0 to {duration:.3} s"),
            });
        }
        let places: Vec<usize> = robot
            .joints
            .iter()
            .map(|joint| {
                reference
                    .joint_index(&joint.name)
                    .ok_or_else(|| KickError::MissingJoint { joint: joint.name.clone(), robot: robot.name.clone() })
            })
            .collect::<Result<_, _>>()?;
        let torques = feedforward::of_reference(robot, &reference, &places);
        Ok(Self { reference, places, torques, window, knot: Knot::default() })
    }

    /// The reference.
    #[must_use]
    pub fn reference(&self) -> &Arc<Reference> {
        &self.reference
    }

    /// Start and end of the window in the reference's time, s.
    #[must_use]
    pub fn window(&self) -> [f64; 2] {
        self.window
    }

    /// Length of the window, s; the stand follows.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.window[1] - self.window[0]
    }

    /// When the foot meets the ball, s after the window's start.
    #[must_use]
    pub fn contact_time(&self) -> f64 {
        self.reference.phases.t_impact - self.window[0]
    }

    /// Position (7 + n) and speed (6 + n) at `time` (s after the window's start).
    #[must_use]
    pub fn initial_state(&self, time: f64) -> (Vec<f64>, Vec<f64>) {
        let mut state = TrackState::default();
        self.clone().sample_into(time, &mut state);
        (state.q, state.v)
    }

    /// The state at `time` (s after the window's start), over `state`. After the window it is the pose at its end, at
    /// rest. Allocates only while `state` has not yet the capacity.
    pub fn sample_into(&mut self, time: f64, state: &mut TrackState) {
        let at = (self.window[0] + time).min(self.window[1]);
        self.reference.sample_into(at, &mut self.knot);
        let knot = &self.knot;
        state.q.clear();
        state.q.extend_from_slice(&knot.base_position);
        state.q.extend_from_slice(&knot.base_orientation);
        state.q.extend(self.places.iter().map(|&place| knot.joints[place]));
        state.v.clear();
        if time >= self.duration() {
            state.v.resize(6 + self.places.len(), 0.0);
        } else {
            state.v.extend_from_slice(&knot.base_velocity);
            state.v.extend_from_slice(&knot.base_angular_velocity);
            state.v.extend(self.places.iter().map(|&place| knot.joint_velocities[place]));
        }
        let last = self.torques.len() - 1;
        let place = (at * self.reference.rate).clamp(0.0, last as f64);
        let below = place as usize;
        let (from, to) = (&self.torques[below], &self.torques[(below + 1).min(last)]);
        state.torques.clear();
        state.torques.extend(from.iter().zip(to).map(|(a, b)| a + (b - a) * place.fract()));
    }
}
