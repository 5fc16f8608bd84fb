//! What walking knows of its robot: the seam between whoever estimates the state and whoever controls it.
//!
//! An estimator fills a [`StateEstimate`] from the senses once a tick; the controller reads nothing else. A test may fill it
//! with the simulator's truth. Angular momentum is computed from it by the controller.

use instep_robot::Robot;

/// One estimate of the robot's state. The world frame is the odometry's: it starts where the estimator was started, with
/// its yaw, and drifts.
#[derive(Debug, Clone, PartialEq)]
pub struct StateEstimate {
    /// Since the start, s.
    pub time: f64,
    /// Position, 7 + n, as instep-robot orders it: base position (m), `world_from_base` (w, x, y, z), joint angles (rad).
    pub q: Vec<f64>,
    /// Speed, 6 + n: base velocity in the world (m/s), base angular velocity in the base frame (rad/s), joint speeds (rad/s).
    pub v: Vec<f64>,
    /// Whether the left and the right foot stand on the ground.
    pub contact: [bool; 2],
    /// Normal force under the left and the right foot, N.
    pub load: [f64; 2],
}

impl StateEstimate {
    /// The robot in its standing pose at the origin, on both feet.
    #[must_use]
    pub fn standing(robot: &Robot) -> Self {
        Self {
            time: 0.0,
            q: robot.stand.clone(),
            v: vec![0.0; robot.nv()],
            contact: [true; 2],
            load: [0.5 * 9.81 * robot.mass(); 2],
        }
    }
}
