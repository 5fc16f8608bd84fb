//! A walking robot: senses in, joint commands out. What navigation, behaviour and a match steer.

use std::sync::Arc;

use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_robot::drive::DriveKind;

use crate::estimate::Estimator;
use crate::servo::Model;
use crate::whole_body::{Outcome, Targets};
use crate::{Gait, StateEstimate, Velocity, WalkError, WalkSettings};

/// The gait with its estimator.
#[derive(Debug)]
pub struct Walker {
    gait: Gait,
    estimator: Estimator,
    state: StateEstimate,
    /// The state of the next tick was told.
    told: bool,
    /// What walks in place of a robot whose drives are position servos.
    model: Option<Model>,
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
        let is_servo = robot.drives.kind == DriveKind::PositionServo;
        Ok(Self {
            state: StateEstimate::standing(&robot),
            told: false,
            model: is_servo.then(|| Model::new(Arc::clone(&robot), settings.drive.servo.clone())),
            estimator: Estimator::new(Arc::clone(&robot)),
            gait: Gait::new(robot, settings)?,
        })
    }

    /// Asks for a velocity from now on; returns what the robot is allowed. Zero is a stop, then a stand.
    pub fn set_velocity(&mut self, velocity: Velocity) -> Velocity {
        self.gait.set_velocity(velocity)
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

    /// The gait.
    #[must_use]
    pub fn gait(&self) -> &Gait {
        &self.gait
    }

    /// First stage of a tick: estimates the state and says what is wanted. The stages are there to be timed one by one;
    /// [`Controller::tick`] calls all three.
    pub fn plan(&mut self, sensors: &Sensors) -> Targets {
        if !std::mem::take(&mut self.told) {
            self.estimator.update(sensors, &mut self.state);
        }
        let pose = self.odometry();
        let Some(model) = &mut self.model else { return self.gait.plan(&self.state) };
        let steps = model.sense(sensors, &self.state);
        for _ in 1..steps {
            model.prepare(&mut self.gait);
            let targets = self.gait.plan(&model.state);
            model.watch(&mut self.gait, pose);
            let outcome = self.gait.solve(&targets);
            model.integrate(&self.gait, outcome);
        }
        model.prepare(&mut self.gait);
        let targets = self.gait.plan(&model.state);
        model.watch(&mut self.gait, pose);
        targets
    }

    /// Second stage: the whole-body controller.
    pub fn solve(&mut self, targets: &Targets) -> Outcome {
        self.gait.solve(targets)
    }

    /// Last stage: the command.
    pub fn write(&mut self, outcome: Outcome, command: &mut JointCommand) {
        match &mut self.model {
            None => self.gait.write(&self.state, outcome, command),
            Some(model) => {
                model.integrate(&self.gait, outcome);
                model.write(&self.gait, command);
                self.gait.count(outcome);
            }
        }
    }

    /// The gait, to lead a swing foot.
    pub fn gait_mut(&mut self) -> &mut Gait {
        &mut self.gait
    }
}

impl Controller for Walker {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        let targets = self.plan(sensors);
        let outcome = self.solve(&targets);
        self.write(outcome, command);
    }
}
