//! A robot that walks in the physics world where navigation sends it, and believes what localisation tells it.
//!
//! The navigator's velocity goes to the [`Walker`], which walks on its senses. Where it believes to be comes from the shipped
//! landmark filter: fed with the walker's own odometry and with sights of a simulated camera (paper 4's errors, set-up
//! `star` of localisation); or, to tell errors of walking from those of seeing, it is told the truth.

use std::sync::Arc;

use instep_field::{Field, Pose};
use instep_localisation::scenario::Scenario;
use instep_localisation::stream::Camera;
use instep_localisation::{LandmarkFilter, Localiser, Map, Settings, Start, Step};
use instep_navigation::trial::Body;
use instep_navigation::{NavigationError, RobotLimits};
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_sim::sensors::SensorSuite;
use instep_sim::settings::WorldSettings;
use instep_sim::trial::has_fallen;
use instep_sim::{BallState, World};
use instep_walk::{Velocity, WalkSettings, Walker};

use crate::BenchError;
use crate::walking::{PERIOD, heading};

/// Frames of the camera a second.
const FRAMES: f64 = 20.0;
/// How a walking robot answers: lag and delay of its mean velocity, s : guesses, not yet fitted to measured steps.
const ANSWER: [f64; 2] = [0.3, 0.15];

/// What the robot sees by, and what it makes of it.
struct Sight {
    map: Arc<Map>,
    camera: Camera<'static>,
    localiser: Localiser<LandmarkFilter>,
    odometry: Pose,
    next_frame: f64,
}

/// The robot.
pub struct WalkingBody {
    world: World,
    walker: Walker,
    suite: SensorSuite,
    sensors: Sensors,
    command: JointCommand,
    /// Field from world.
    origin: Pose,
    sight: Option<Sight>,
    /// Simulated positions, four a second, for a replay.
    ticks: usize,
}

/// A walking robot as navigation knows it.
///
/// # Errors
/// When its walking settings cannot be used.
pub fn limits(robot: &Robot) -> Result<RobotLimits, BenchError> {
    let limits = WalkSettings::load(robot)?.limits;
    Ok(RobotLimits {
        forward: limits.forward,
        backward: limits.backward,
        sideways: limits.sideways,
        turn: limits.turn,
        acceleration: limits.acceleration,
        turn_acceleration: limits.turn_acceleration,
        lag: ANSWER[0],
        delay: ANSWER[1],
        radius: 0.25,
    })
}

impl WalkingBody {
    /// Stands at `start`; with `sees` it localises itself, else it is told where it is.
    ///
    /// # Errors
    /// When robot, field or world cannot be used.
    pub fn new(robot: &Arc<Robot>, field: &Field, start: Pose, sees: bool, seed: u64) -> Result<Self, BenchError> {
        let mut settings = WorldSettings::default();
        settings.step.tick = settings.step.tick.min(PERIOD);
        settings.step.far = settings.step.far.min(settings.step.tick);
        let mut world = World::new(Arc::clone(robot), &settings)?;
        let far_ball = BallState::at_rest([1000.0, 0.0, settings.ball.radius]);
        world.reset(&robot.stand, &vec![0.0; robot.nv()], &far_ball)?;
        let walker = Walker::load(Arc::clone(robot))?;
        let mut suite = SensorSuite::new(&mut world, seed);
        suite.sense(&world);
        let unusable = |e: &dyn std::fmt::Display| BenchError::File { file: field.name.clone(), detail: e.to_string() };
        let sight = if sees {
            let map = Arc::new(Map::new(field, true).map_err(|e| unusable(&e))?);
            let scenario = Scenario::named("star").map_err(|e| unusable(&e))?;
            let begin = Start::Near { pose: start, position_sigma: 0.1, heading_sigma: 0.05 };
            let mut localiser = Localiser::new(LandmarkFilter::new(Arc::clone(&map), Settings::default()), begin);
            let _ = localiser.step(&Step { time: 0.0, motion: Pose::default() });
            let camera = Camera::new(scenario, &map, seed);
            Some(Sight { map, camera, localiser, odometry: Pose::default(), next_frame: 0.0 })
        } else {
            None
        };
        let [x, y] = [world.q()[0], world.q()[1]];
        let world_from_robot = Pose::new(x, y, heading(world.q()));
        let joints = robot.joints.len();
        Ok(Self {
            origin: start.then(&world_from_robot.inverse()),
            world,
            walker,
            suite,
            sensors: Sensors::default(),
            command: JointCommand::zeros(joints),
            sight,
            ticks: 0,
        })
    }

    fn odometry(&self) -> Pose {
        let [x, y, heading] = self.walker.odometry();
        Pose::new(x, y, heading)
    }
}

impl Body for WalkingBody {
    fn pose(&self) -> Pose {
        let q = self.world.q();
        self.origin.then(&Pose::new(q[0], q[1], heading(q)))
    }

    fn believe(&mut self) -> Pose {
        match &self.sight {
            Some(sight) => sight.localiser.pose(),
            None => self.pose(),
        }
    }

    fn advance(&mut self, velocity: [f64; 3], dt: f64) -> Result<(), NavigationError> {
        let failed = |e: &dyn std::fmt::Display| NavigationError::Body(e.to_string());
        let period = self.world.settings().step.tick;
        self.walker.set_velocity(Velocity { x: velocity[0], y: velocity[1], turn: velocity[2] });
        for _ in 0..(dt / period).round() as usize {
            self.suite.read_into(self.world.time(), &mut self.sensors);
            self.walker.tick(&self.sensors, &mut self.command);
            self.world.advance(&self.command, None).map_err(|e| failed(&e))?;
            self.suite.sense(&self.world);
            self.ticks += 1;
            if has_fallen(&self.world) {
                return Err(NavigationError::Body(format!("fell at {:.2} s", self.world.time())));
            }
        }
        let (time, pose, odometry) = (self.ticks as f64 * period, self.pose(), self.odometry());
        if let Some(sight) = &mut self.sight {
            let step = Step { time, motion: sight.odometry.relative(&odometry) };
            sight.odometry = odometry;
            sight.localiser.step(&step).map_err(|e| failed(&e))?;
            if time >= sight.next_frame - 1e-9 {
                sight.next_frame += 1.0 / FRAMES;
                let frame = sight.camera.look(&sight.map, time, &pose);
                sight.localiser.see(&frame).map_err(|e| failed(&e))?;
            }
            sight.localiser.check_if_due();
        }
        Ok(())
    }
}
