//! A robot in the simulated world in place of a real one, so that the whole can be tried on a laptop.
//!
//! The physics is instep-sim's, with its limits and sensors. What makes a demonstration go on forever, and no
//! measurement, is ours: before each kick the ball is put back on its spot before the robot, and a robot that fell is
//! put back on its feet. Nothing that is published here counts as a ball speed.

use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::control::{JointCommand, Sensors};
use instep_robot::{Robot, RobotData};
use instep_sim::sensors::SensorSuite;
use instep_sim::settings::WorldSettings;
use instep_sim::trial::has_fallen;
use instep_sim::{BallState, SimError, World};
use nalgebra::{Rotation2, Vector2};

use crate::body::{Body, Freshness, Whereabouts};

/// How long a fallen robot lies before it is put back, s.
const LIES: f64 = 1.0;

/// The simulated robot.
pub(crate) struct SimBody {
    robot: Arc<Robot>,
    world: World,
    suite: SensorSuite,
    data: RobotData,
    /// Where the ball is put before each kick, m, in the footprint.
    spot: [f64; 2],
    far_steps: usize,
    fell_at: Option<f64>,
}

impl SimBody {
    /// In a world of `settings`, where a command holds for `period` (s).
    ///
    /// # Errors
    /// When the world cannot be made.
    pub(crate) fn new(
        robot: Arc<Robot>,
        settings: &WorldSettings,
        spot: [f64; 2],
        period: f64,
        seed: u64,
    ) -> Result<Self, SimError> {
        let mut world = World::new(Arc::clone(&robot), settings)?;
        let suite = SensorSuite::new(&mut world, seed);
        let data = robot.data();
        // A rounding of a small positive number.
        let far_steps = (period / settings.step.tick).round().max(1.0) as usize;
        let mut body = Self { robot, world, suite, data, spot, far_steps, fell_at: None };
        body.stand_up()?;
        Ok(body)
    }

    /// Puts the robot in its standing pose at the origin, and the ball on its spot.
    fn stand_up(&mut self) -> Result<(), SimError> {
        let still = vec![0.0; self.robot.nv()];
        let stand = self.robot.stand.clone();
        let ball = self.ball_on_spot(&stand);
        self.world.reset(&stand, &still, &ball)?;
        self.suite.sense(&self.world);
        self.fell_at = None;
        Ok(())
    }

    fn ball_on_spot(&mut self, q: &[f64]) -> BallState {
        self.data.set_position(q);
        let [x, y, yaw] = footprint(&self.robot, &self.data, q);
        let at = Vector2::new(x, y) + Rotation2::new(yaw) * Vector2::from(self.spot);
        BallState::at_rest([at.x, at.y, self.world.settings().ball.radius])
    }
}

/// The footprint in the world: midway between the soles, turned as the base is about the vertical.
fn footprint(robot: &Robot, data: &RobotData, q: &[f64]) -> [f64; 3] {
    let [left, right] = [Side::Left, Side::Right].map(|side| data.point(&robot.leg(side).sole));
    let middle = 0.5 * (left + right);
    let (w, x, y, z) = (q[3], q[4], q[5], q[6]);
    [middle.x, middle.y, (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))]
}

impl Body for SimBody {
    fn sense(&mut self, sensors: &mut Sensors) -> Freshness {
        self.suite.read_into(self.world.time(), sensors);
        Freshness::Fresh
    }

    fn act(&mut self, command: &JointCommand) {
        for _ in 0..self.far_steps {
            // A state that diverged cannot be gone on from; neither can the robot stay on the ground.
            let done = self.world.advance(command, None);
            self.suite.sense(&self.world);
            let down = has_fallen(&self.world);
            let now = self.world.time();
            let since = if down { *self.fell_at.get_or_insert(now) } else { now };
            if done.is_err() || now - since > LIES {
                // The pose is the robot's own stand: it cannot be refused.
                let _ = self.stand_up();
                return;
            }
        }
    }

    fn prepare(&mut self) {
        let q = self.world.q().to_vec();
        let ball = self.ball_on_spot(&q);
        self.world.place_ball(&ball);
    }

    fn whereabouts(&mut self) -> Option<Whereabouts> {
        let q = self.world.q();
        self.data.set_position(q);
        let mut base = [0.0; 7];
        base.copy_from_slice(&q[..7]);
        Some(Whereabouts { base, ball: self.world.ball().position, footprint: footprint(&self.robot, &self.data, q) })
    }
}
