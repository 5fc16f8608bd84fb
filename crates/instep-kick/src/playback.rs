//! Plays a reference: joint angles, speeds and feed-forward torques as they stand in it, open loop. Where it carries no
//! torques, [`crate::feedforward`] guesses them.
//!
//! This is the baseline that every engine is compared with. It balances nothing; what the drives cannot follow is lost.
//! After the last knot the final pose is held.

use std::sync::Arc;

use instep_motion::reference::{Knot, Reference};
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};

use crate::{KickError, feedforward};

/// A controller that plays one reference from a given instant.
#[derive(Debug, Clone)]
pub struct Playback {
    reference: Arc<Reference>,
    /// For each of the robot's joints, its place in the reference.
    places: Vec<usize>,
    start: f64,
    knot: Knot,
    /// Feed-forward torques of each knot in the robot's joint order, N m.
    torques: Vec<Vec<f64>>,
}

impl Playback {
    /// Plays `reference` on `robot` from `start` (s, in the reference's time).
    ///
    /// # Errors
    /// When the reference is another robot's or does not hold `start`.
    pub fn new(robot: &Robot, reference: Arc<Reference>, start: f64) -> Result<Self, KickError> {
        if reference.robot != robot.name {
            return Err(KickError::OtherRobot { reference: reference.robot.clone(), robot: robot.name.clone() });
        }
        let duration = reference.duration();
        if !(0.0..duration).contains(&start) {
            return Err(KickError::Start { start, duration });
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
        let mut knot = Knot::default();
        reference.sample_into(start, &mut knot);
        Ok(Self { reference, places, start, knot, torques })
    }

    /// Feed-forward torque of the robot's joint `joint` at `time` (s, in the reference's time), N m.
    fn torque(&self, joint: usize, time: f64) -> f64 {
        let last = self.torques.len() - 1;
        let at = (time * self.reference.rate).clamp(0.0, last as f64);
        let below = at.floor() as usize;
        let (from, to) = (self.torques[below][joint], self.torques[(below + 1).min(last)][joint]);
        from + (to - from) * at.fract()
    }

    /// The state from which the playback starts: q (7 + n) and v (6 + n) in the robot's order.
    #[must_use]
    pub fn initial_state(&self) -> (Vec<f64>, Vec<f64>) {
        let mut knot = Knot::default();
        self.reference.sample_into(self.start, &mut knot);
        feedforward::state(&knot, &self.places)
    }
}

impl Controller for Playback {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        let time = self.start + sensors.time;
        self.reference.sample_into(time, &mut self.knot);
        let over = time >= self.reference.duration();
        for (i, &place) in self.places.iter().enumerate() {
            command.positions[i] = self.knot.joints[place];
            command.velocities[i] = if over { 0.0 } else { self.knot.joint_velocities[place] };
            command.torques[i] = self.torque(i, time);
        }
    }
}
