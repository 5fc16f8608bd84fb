//! A walking robot: senses in, joint commands out. What navigation, behaviour and a match steer.

use std::sync::Arc;

use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_robot::drive::DriveKind;

use crate::estimate::Estimator;
use crate::gait::{Counts, Footstep, GaitView};
use crate::pattern::Pattern;
use crate::whole_body::{Outcome, Targets};
use crate::{Gait, StateEstimate, Velocity, WalkError, WalkSettings};

/// The gait with its estimator.
#[derive(Debug)]
pub struct Walker {
    legs: Legs,
    estimator: Estimator,
    state: StateEstimate,
    /// The state of the next tick was told.
    told: bool,
}

/// What walks, by the kind of the drives.
#[derive(Debug)]
enum Legs {
    Torque(Box<Gait>),
    Servo(Box<Pattern>),
}

impl Walker {
    /// For `robot` with the settings of its folder; stands until it is told a velocity.
    ///
    /// # Errors
    /// When the robot has not what walking needs, or its `walk.toml` is not what it should be.
    pub fn load(robot: Arc<Robot>) -> Result<Self, WalkError> {
        let settings = WalkSettings::load(&robot)?;
        Self::new(robot, settings)
    }

    /// For `robot` with `settings`.
    ///
    /// # Errors
    /// When the robot has not what walking needs.
    pub fn new(robot: Arc<Robot>, settings: WalkSettings) -> Result<Self, WalkError> {
        Ok(Self {
            state: StateEstimate::standing(&robot),
            told: false,
            estimator: Estimator::new(Arc::clone(&robot)),
            legs: match robot.drives.kind {
                DriveKind::Torque => Legs::Torque(Box::new(Gait::new(robot, settings)?)),
                DriveKind::PositionServo => Legs::Servo(Box::new(Pattern::new(robot, settings)?)),
            },
        })
    }

    /// Asks for a velocity from now on; returns what the robot is allowed. Zero is a stop, then a stand.
    pub fn set_velocity(&mut self, velocity: Velocity) -> Velocity {
        match &mut self.legs {
            Legs::Torque(gait) => gait.set_velocity(velocity),
            Legs::Servo(pattern) => pattern.set_velocity(velocity),
        }
    }

    /// The velocity that the gait is at on its way to what was asked.
    #[must_use]
    pub fn velocity(&self) -> Velocity {
        match &self.legs {
            Legs::Torque(gait) => gait.velocity(),
            Legs::Servo(pattern) => pattern.velocity(),
        }
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &WalkSettings {
        match &self.legs {
            Legs::Torque(gait) => gait.settings(),
            Legs::Servo(pattern) => pattern.settings(),
        }
    }

    /// What the gait wants and sees.
    #[must_use]
    pub fn view(&self) -> &GaitView {
        match &self.legs {
            Legs::Torque(gait) => gait.view(),
            Legs::Servo(pattern) => pattern.view(),
        }
    }

    /// What happened how often.
    #[must_use]
    pub fn counts(&self) -> Counts {
        match &self.legs {
            Legs::Torque(gait) => gait.counts(),
            Legs::Servo(pattern) => pattern.counts(),
        }
    }

    /// The step that ended in the last tick, if one did.
    #[must_use]
    pub fn footstep(&self) -> Option<Footstep> {
        match &self.legs {
            Legs::Torque(gait) => gait.footstep(),
            Legs::Servo(pattern) => pattern.footstep(),
        }
    }

    /// Where the base is over the ground, in the frame of its start: x, y (m) and heading (rad).
    #[must_use]
    pub fn odometry(&self) -> [f64; 3] {
        let [w, x, y, z] = [self.state.q[3], self.state.q[4], self.state.q[5], self.state.q[6]];
        let heading = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
        [self.state.q[0], self.state.q[1], heading]
    }

    /// Somebody knows the state better than the own estimator, which the next tick leaves out. A state with another number of
    /// joints, or with something that is no number, is not taken.
    pub fn tell(&mut self, state: &StateEstimate) {
        let StateEstimate { time, q, v, contact, load } = state;
        let fits = q.len() == self.state.q.len() && v.len() == self.state.v.len();
        if fits && time.is_finite() && q.iter().chain(v).all(|x| x.is_finite()) {
            self.state.q.copy_from_slice(q);
            self.state.v.copy_from_slice(v);
            (self.state.time, self.state.contact, self.state.load) = (*time, *contact, *load);
            self.told = true;
        }
    }

    /// The last estimate.
    #[must_use]
    pub fn estimate(&self) -> &StateEstimate {
        &self.state
    }

    /// What estimates the state.
    #[must_use]
    pub fn estimator(&self) -> &Estimator {
        &self.estimator
    }

    /// The gait of a robot whose drives take torques.
    #[must_use]
    pub fn gait(&self) -> Option<&Gait> {
        match &self.legs {
            Legs::Torque(gait) => Some(gait),
            Legs::Servo(_) => None,
        }
    }

    /// See [`Self::gait`]; to lead a swing foot.
    pub fn gait_mut(&mut self) -> Option<&mut Gait> {
        match &mut self.legs {
            Legs::Torque(gait) => Some(gait),
            Legs::Servo(_) => None,
        }
    }

    /// Accelerations (nv) that the last command is to bring; none where drives take no torques.
    #[must_use]
    pub fn acceleration(&self) -> &[f64] {
        self.gait().map_or(&[], |gait| &gait.body().acceleration)
    }

    /// Somebody else moved the joints since the last tick.
    pub fn resume(&mut self) {
        if let Legs::Servo(pattern) = &mut self.legs {
            pattern.resume();
        }
    }

    /// First stage of a tick: estimates the state and says what is wanted; servos get their command here. The stages are there to be timed
    /// one by one; [`Controller::tick`] calls all three.
    pub fn plan(&mut self, sensors: &Sensors, command: &mut JointCommand) -> Option<Targets> {
        if !std::mem::take(&mut self.told) {
            self.estimator.update(sensors, &mut self.state);
        }
        let pose = self.odometry();
        match &mut self.legs {
            Legs::Torque(gait) => Some(gait.plan(&self.state)),
            Legs::Servo(pattern) => {
                pattern.tick(sensors, &self.state, pose, command);
                None
            }
        }
    }

    /// Second stage: the whole-body controller.
    pub fn solve(&mut self, planned: Option<&Targets>) -> Outcome {
        match (&mut self.legs, planned) {
            (Legs::Torque(gait), Some(targets)) => gait.solve(targets),
            _ => Outcome::Solved,
        }
    }

    /// Last stage: the command of torque drives.
    pub fn write(&mut self, outcome: Outcome, command: &mut JointCommand) {
        if let Legs::Torque(gait) = &mut self.legs {
            gait.write(&self.state, outcome, command);
        }
    }
}

impl Controller for Walker {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        let planned = self.plan(sensors, command);
        let outcome = self.solve(planned.as_ref());
        self.write(outcome, command);
    }
}
