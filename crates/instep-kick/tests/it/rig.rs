//! A robot in its world with an engine, ticked by hand.

use std::path::Path;
use std::sync::Arc;

use instep_kick::dynamic::DynamicKick;
use instep_kick::{KickEngine, KickRequest};
use instep_robot::Robot;
use instep_robot::control::{JointCommand, Sensors};
use instep_sim::sensors::SensorSuite;
use instep_sim::settings::{Ball, WorldSettings};
use instep_sim::{BallState, World};

/// The robot in an ideal world: what the engines plan is tested here, not what servos make of it.
pub(crate) fn robot(name: &str) -> Arc<Robot> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots").join(name);
    Arc::new(Robot::load(&folder).unwrap().with_ideal_drives())
}

pub(crate) fn engine(name: &str) -> DynamicKick {
    DynamicKick::load(robot(name)).unwrap()
}

/// Sensors of the robot standing still.
pub(crate) fn standing(robot: &Robot) -> Sensors {
    Sensors {
        joint_positions: robot.stand[7..].to_vec(),
        joint_velocities: vec![0.0; robot.joints.len()],
        orientation: [1.0, 0.0, 0.0, 0.0],
        contact_forces: vec![9.81 * robot.mass() / robot.contacts.len() as f64; robot.contacts.len()],
        centre_of_pressure: [Some([0.0, 0.0]); 2],
        ..Sensors::default()
    }
}

/// A request that both small robots can do.
pub(crate) fn request(name: &str) -> KickRequest {
    match name {
        "nao" => KickRequest::new([0.17, -0.05], 0.0, 0.7),
        _ => KickRequest::new([0.24, -0.07], 0.0, 0.8),
    }
}

pub(crate) struct Rig {
    pub(crate) engine: DynamicKick,
    pub(crate) world: World,
    suite: SensorSuite,
    pub(crate) sensors: Sensors,
    pub(crate) command: JointCommand,
    far: usize,
    /// The engine is not told what is seen of the ball.
    pub(crate) blind: bool,
}

impl Rig {
    pub(crate) fn new(name: &str, ball: [f64; 2]) -> Self {
        let engine = engine(name);
        let robot = robot(name);
        let model = *engine.ball();
        let settings = WorldSettings {
            ball: Ball { mass: model.mass, radius: model.radius, ..Ball::default() },
            ..WorldSettings::default()
        };
        let mut world = World::new(Arc::clone(&robot), &settings).unwrap();
        let foot = engine.footprint_from_base();
        let at = [ball[0] - foot[0], ball[1] - foot[1], model.radius];
        world.reset(&robot.stand, &vec![0.0; robot.nv()], &BallState::at_rest(at)).unwrap();
        let mut suite = SensorSuite::new(&mut world, 1);
        suite.sense(&world);
        let mut sensors = Sensors::default();
        suite.read_into(0.0, &mut sensors);
        let far = (engine.control_period() / settings.step.tick).round() as usize;
        Self { engine, world, suite, sensors, command: JointCommand::zeros(robot.joints.len()), far, blind: false }
    }

    /// One control period.
    pub(crate) fn tick(&mut self) {
        use instep_robot::control::Controller;
        self.suite.read_into(self.world.time(), &mut self.sensors);
        if self.blind {
            self.sensors.ball = None;
        }
        self.engine.tick(&self.sensors, &mut self.command);
        for _ in 0..self.far {
            self.world.advance(&self.command, None).unwrap();
            self.suite.sense(&self.world);
        }
    }

    /// Whether the robot stands on both feet in its standing pose.
    pub(crate) fn stands(&self) -> bool {
        let robot = self.world.robot();
        let mut forces = vec![nalgebra::Vector3::zeros(); robot.contacts.len()];
        self.world.contact_forces_into(&mut forces);
        let mut loads = [0.0; 2];
        for (contact, force) in robot.contacts.iter().zip(&forces) {
            loads[contact.leg as usize] += force.z;
        }
        let near = self.world.q()[7..].iter().zip(&robot.stand[7..]).all(|(a, b)| (a - b).abs() < 0.1);
        near && self.world.q()[2] > 0.95 * robot.stand[2] && loads.iter().all(|load| *load > 0.2 * 9.81 * robot.mass())
    }
}
