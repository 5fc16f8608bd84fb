//! The legs: stands, walks with a velocity, kicks within the gait, lies on the ground, stands down.
//!
//! The walk and the kick are instep-walk's. Here is what stands between them and the rest: who leads (navigation's velocity
//! or the kick's run-up), and what the joints are told when walking makes no sense.

use std::sync::Arc;

use instep_field::Pose;
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_walk::gait::Mode;
use instep_walk::in_gait::{Aim, InGait, InGaitSettings, Stage as KickStage};
use instep_walk::settings::Limits;
use instep_walk::{StateEstimate, Velocity, WalkError, WalkSettings, Walker};
use serde::Serialize;

/// From this tilt on, a robot that lay stands again, rad.
const UPRIGHT: f64 = 0.35;
/// And must do so for this long before it walks, s.
const STEADY: f64 = 0.5;

/// What the legs are at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Stands.
    Stand,
    /// Walks.
    Walk,
    /// On the line to the ball.
    RunUp,
    /// The step that kicks.
    Kick,
    /// Lies on the ground.
    Down,
    /// Senses cannot be believed: the joints hold where they are.
    Safe,
}

/// Walker alone, or walker with a kick.
#[derive(Debug)]
enum Gear {
    Walk(Box<Walker>),
    Kick(Box<InGait>),
}

/// The legs of one robot.
#[derive(Debug)]
pub struct Legs {
    robot: Arc<Robot>,
    walk: WalkSettings,
    in_gait: Option<InGaitSettings>,
    ball_radius: f64,
    fallen_tilt: f64,
    gear: Gear,
    stage: Stage,
    /// Since when a fallen robot is upright again, s.
    upright: Option<f64>,
    falls: u64,
    /// The odometry began anew since this was last asked.
    interrupted: bool,
}

fn gear(
    robot: &Arc<Robot>,
    walk: &WalkSettings,
    in_gait: Option<&InGaitSettings>,
    radius: f64,
) -> Result<Gear, WalkError> {
    let (robot, walk) = (Arc::clone(robot), walk.clone());
    Ok(match in_gait {
        Some(settings) => Gear::Kick(Box::new(InGait::new(robot, walk, settings.clone(), radius)?)),
        None => Gear::Walk(Box::new(Walker::new(robot, walk)?)),
    })
}

/// Angle between the base's z axis and the vertical, rad.
#[must_use]
pub fn tilt(orientation: &[f64; 4]) -> f64 {
    let [w, x, y, z] = orientation;
    let norm = w * w + x * x + y * y + z * z;
    (1.0 - 2.0 * (x * x + y * y) / norm).clamp(-1.0, 1.0).acos()
}

impl Legs {
    /// For `robot`, which plays a ball of `ball_radius` (m) and counts as fallen from `fallen_tilt` (rad) on.
    ///
    /// # Errors
    /// When the robot has not what walking needs.
    pub fn new(
        robot: Arc<Robot>,
        walk: WalkSettings,
        in_gait: Option<InGaitSettings>,
        ball_radius: f64,
        fallen_tilt: f64,
    ) -> Result<Self, WalkError> {
        let gear = gear(&robot, &walk, in_gait.as_ref(), ball_radius)?;
        Ok(Self {
            robot,
            walk,
            in_gait,
            ball_radius,
            fallen_tilt,
            gear,
            stage: Stage::Stand,
            upright: None,
            falls: 0,
            interrupted: false,
        })
    }

    /// The walk starts anew from where the robot stands: it was carried, or time has a gap.
    pub fn restart(&mut self) {
        // The same robot and settings made a gear before.
        if let Ok(gear) = gear(&self.robot, &self.walk, self.in_gait.as_ref(), self.ball_radius) {
            self.gear = gear;
        }
        self.stage = Stage::Stand;
        self.interrupted = true;
    }

    /// Whether the odometry began anew since this was last asked.
    pub fn take_interruption(&mut self) -> bool {
        std::mem::take(&mut self.interrupted)
    }

    /// How often the robot has fallen.
    #[must_use]
    pub fn falls(&self) -> u64 {
        self.falls
    }

    /// What the legs are at.
    #[must_use]
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Whether a kick leads, not navigation.
    #[must_use]
    pub fn is_kicking(&self) -> bool {
        matches!(self.stage, Stage::RunUp | Stage::Kick)
    }

    /// What the walk allows.
    #[must_use]
    pub fn limits(&self) -> &Limits {
        &self.walk.limits
    }

    /// The kick within the gait, where there is one.
    #[must_use]
    pub fn in_gait(&self) -> Option<&InGaitSettings> {
        self.in_gait.as_ref()
    }

    /// The walker.
    #[must_use]
    pub fn walker(&self) -> &Walker {
        match &self.gear {
            Gear::Walk(walker) => walker,
            Gear::Kick(kick) => kick.walker(),
        }
    }

    /// Pose in the odometry's frame.
    #[must_use]
    pub fn odometry(&self) -> Pose {
        let [x, y, heading] = self.walker().odometry();
        Pose::new(x, y, heading)
    }

    /// Velocity that the gait is at, m/s, m/s, rad/s.
    #[must_use]
    pub fn velocity(&self) -> [f64; 3] {
        let Velocity { x, y, turn } = self.walker().velocity();
        [x, y, turn]
    }

    /// Walks with `velocity` from now on, unless a kick leads. Zero is a stop, then a stand.
    pub fn walk(&mut self, [x, y, turn]: [f64; 3]) {
        let velocity = Velocity { x, y, turn };
        match &mut self.gear {
            Gear::Walk(walker) => {
                walker.set_velocity(velocity);
            }
            Gear::Kick(kick) => {
                if kick.stage() == KickStage::Idle {
                    kick.walker_mut().set_velocity(velocity);
                }
            }
        }
    }

    /// Kicks the ball at `ball` in `direction` (odometry's frame, m and rad), at `speed` (m/s), where the legs have a kick.
    pub fn kick(&mut self, ball: [f64; 2], direction: f64, speed: f64) {
        if let Gear::Kick(kick) = &mut self.gear
            && matches!(self.stage, Stage::Stand | Stage::Walk)
        {
            kick.ask(Aim { ball, direction, speed, foot: None });
            self.stage = Stage::RunUp;
        }
    }

    /// Gives a run-up up; a kick that has begun is made.
    pub fn give_up(&mut self) {
        if let Gear::Kick(kick) = &mut self.gear {
            kick.release();
        }
    }

    /// One tick with senses that may be believed; a `state` that is told overrules the walker's own estimate.
    pub fn tick(&mut self, sensors: &Sensors, state: Option<&StateEstimate>, command: &mut JointCommand) {
        let tilt = tilt(&sensors.orientation);
        if self.stage == Stage::Down {
            self.lie(sensors, tilt, command);
            return;
        }
        if tilt > self.fallen_tilt {
            self.falls += 1;
            self.upright = None;
            self.stage = Stage::Down;
            self.lie(sensors, tilt, command);
            return;
        }
        if let Some(state) = state {
            match &mut self.gear {
                Gear::Walk(walker) => walker.tell(state),
                Gear::Kick(kick) => kick.walker_mut().tell(state),
            }
        }
        match &mut self.gear {
            Gear::Walk(walker) => walker.tick(sensors, command),
            Gear::Kick(kick) => {
                kick.tick(sensors, command);
                // After the follow-through navigation goes on without a stop.
                if matches!(kick.stage(), KickStage::Stop | KickStage::Done) {
                    kick.release();
                }
            }
        }
        self.stage = match &self.gear {
            Gear::Kick(kick) if matches!(kick.stage(), KickStage::Approach | KickStage::RunUp) => Stage::RunUp,
            Gear::Kick(kick) if matches!(kick.stage(), KickStage::Kick | KickStage::FollowThrough) => Stage::Kick,
            _ if self.walker().view().mode == Mode::Stand => Stage::Stand,
            _ => Stage::Walk,
        };
    }

    /// On the ground: the joints hold where they are, softly, until somebody has put the robot up.
    fn lie(&mut self, sensors: &Sensors, tilt: f64, command: &mut JointCommand) {
        hold(sensors, command);
        if tilt > UPRIGHT {
            self.upright = None;
            return;
        }
        let since = *self.upright.get_or_insert(sensors.time);
        if sensors.time - since > STEADY {
            self.restart();
        }
    }

    /// Senses cannot be believed: the last positions are held, nothing is fed forward.
    pub fn stand_down(&mut self, command: &mut JointCommand) {
        command.velocities.fill(0.0);
        command.torques.fill(0.0);
        if self.stage != Stage::Safe {
            self.give_up();
            self.walk([0.0; 3]);
            self.stage = Stage::Safe;
        }
    }
}

/// Joints where they are, braked.
fn hold(sensors: &Sensors, command: &mut JointCommand) {
    command.positions.copy_from_slice(&sensors.joint_positions);
    command.velocities.fill(0.0);
    command.torques.fill(0.0);
}
