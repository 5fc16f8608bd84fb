//! Plays a reference: joint angles, speeds and feed-forward torques as they stand in it, open loop. Where it carries no
//! torques, [`crate::feedforward`] guesses them.
//!
//! This is the baseline that every engine is compared with. It balances nothing; what the drives cannot follow is lost.
//! After the last knot the final pose is held.

use std::sync::Arc;

use instep_motion::reference::Reference;
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};

use crate::KickError;
use crate::track::{Track, TrackState};

/// A controller that plays one reference from a given instant.
#[derive(Debug, Clone)]
pub struct Playback {
    track: Track,
    state: TrackState,
}

impl Playback {
    /// Plays `reference` on `robot` from `start` (s, in the reference's time).
    ///
    /// # Errors
    /// When the reference is another robot's or does not hold `start`.
    pub fn new(robot: &Robot, reference: Arc<Reference>, start: f64) -> Result<Self, KickError> {
        let duration = reference.duration();
        if !(0.0..duration).contains(&start) {
            return Err(KickError::Start { start, duration });
        }
        let mut track = Track::new(robot, reference, [start, duration])?;
        // The state's vectors get their size here, not in a tick.
        let mut state = TrackState::default();
        track.sample_into(0.0, &mut state);
        Ok(Self { track, state })
    }

    /// The state from which the playback starts: q (7 + n) and v (6 + n) in the robot's order.
    #[must_use]
    pub fn initial_state(&self) -> (Vec<f64>, Vec<f64>) {
        self.track.initial_state(0.0)
    }
}

impl Controller for Playback {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        self.track.sample_into(sensors.time, &mut self.state);
        command.positions.copy_from_slice(&self.state.q[7..]);
        command.velocities.copy_from_slice(&self.state.v[6..]);
        command.torques.copy_from_slice(&self.state.torques);
    }
}
