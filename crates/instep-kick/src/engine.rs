//! What every kick engine is: it plans a request or says why not, is ticked with sensors, tells how far it is, and can
//! be cancelled at any tick.
//!
//! An engine sees the request and [`Sensors`], never the simulator's truth; it reads no clock (time comes with the
//! sensors) and allocates nothing in a tick.

use instep_motion::phase::Side;
use instep_robot::control::{Controller, Sensors};
use serde::{Deserialize, Serialize};

use crate::request::{KickRequest, Refusal};
use crate::stand::Standing;

/// Why an engine gave a kick up that it had begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BreakOff {
    /// The ball went where no foot can meet it.
    BallGone,
    /// The foot could not be brought to strike in the wanted direction.
    Unaimed,
    /// The ball did not come in time.
    Late,
}

/// Where in a kick an engine is (paper 2, section 3.1, with the shift of weight before and after).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Stands on both feet; no kick is under way.
    Stand,
    /// The weight goes over the support foot.
    Shift,
    /// The kicking foot leaves the ground.
    Raise,
    /// The kicking foot goes to the wind-up point, and waits there if told to.
    WindUp,
    /// From the wind-up point through the ball to rest.
    Kick,
    /// The kicking foot goes back over its place.
    MoveBack,
    /// The kicking foot goes down.
    Lower,
    /// The weight goes back between the feet.
    ShiftBack,
}

/// What was planned.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct KickPlan {
    /// The foot that kicks.
    pub foot: Side,
    /// Which part of it strikes.
    pub face: Face,
    /// Instant of contact, s after the plan (later by the time that the foot is held).
    pub contact: f64,
    /// End of the whole motion, standing again, s after the plan.
    pub duration: f64,
    /// Speed of the foot at contact, m/s.
    pub foot_speed: f64,
    /// Forecast speed of the ball, m/s.
    pub ball_speed: f64,
    /// Stated standard deviation of the direction, rad.
    pub precision: f64,
}

/// Which part of the foot strikes the ball.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Face {
    /// The toe.
    Front,
    /// The side toward the other foot.
    Inner,
    /// The side away from it.
    Outer,
    /// The heel.
    Back,
    /// A rounded front corner, the foot turned less than the kick.
    Corner,
}

/// How a kick ended or goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum KickStatus {
    /// No kick was asked yet.
    Idle,
    /// Under way.
    Running,
    /// The foot waits retracted for [`KickEngine::release`].
    Holding,
    /// Over; the robot stands.
    Finished,
    /// A cancel is under way: the foot goes back.
    Cancelling,
    /// Cancelled; the robot stands.
    Cancelled,
}

/// How far a kick is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Progress {
    /// What goes on.
    pub status: KickStatus,
    /// Where in the kick.
    pub phase: Phase,
    /// Share of the whole motion that is done, 0 to 1 (dialect A's `percent_done` is 100 times this).
    pub done: f64,
    /// Time to the contact, s; negative after it, `None` when none is planned.
    pub to_contact: Option<f64>,
    /// The kicking foot, while a kick is under way.
    pub foot: Option<Side>,
}

/// Where the kicks of an engine start that cannot start from the stand.
#[derive(Debug, Clone, PartialEq)]
pub struct KickStart {
    /// Position, 7 + n; world frame.
    pub q: Vec<f64>,
    /// Speed, 6 + n.
    pub v: Vec<f64>,
    /// The ground point midway between the soles, m, world frame: the origin of the frame of its requests, whose axes are
    /// the world's (in a run-up the soles' headings change from step to step).
    pub footprint: [f64; 2],
    /// What it is to be asked for to do just what it can.
    pub request: KickRequest,
}

/// A kick engine. As a [`Controller`] it is ticked once a control period and holds the stand when there is no kick.
pub trait KickEngine: Controller {
    /// Short name for tables.
    fn name(&self) -> &'static str;

    /// Period at which it wants to be ticked, s.
    fn control_period(&self) -> f64;

    /// The state from which its kicks start, and the kick that it has from there; `None`: any kick, from the stand.
    fn own_start(&self) -> Option<KickStart> {
        None
    }

    /// Plans `request` from the present `sensors`; the next tick starts the motion. May allocate.
    ///
    /// # Errors
    /// Why this kick is not possible; the robot goes on as before.
    fn plan(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<KickPlan, Refusal>;

    /// Tells a kick under way where its ball is now: `request` is the one that was planned but for the ball. It is followed until the
    /// strike begins, as far as the foot can.
    ///
    /// # Errors
    /// [`Refusal::NoKick`] when none is under way, [`Refusal::Struck`] when it is too late, [`Refusal::Busy`] when another kick is
    /// asked or the engine follows no ball.
    fn update(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<(), Refusal> {
        let _ = (request, sensors);
        let running =
            matches!(self.progress().status, KickStatus::Running | KickStatus::Holding | KickStatus::Cancelling);
        Err(if running { Refusal::Busy } else { Refusal::NoKick })
    }

    /// Where the robot could stand for the kick of `request`, which it refuses from where it stands. Plans many times: for a caller
    /// that walks. `None` where no easy place will do, or for engines that cannot say.
    fn where_to_stand(&mut self, request: &KickRequest) -> Option<Standing> {
        let _ = request;
        None
    }

    /// Lets a held foot kick at the next tick.
    fn release(&mut self);

    /// Gives the kick up at the next tick: the foot goes back and the robot stands on both feet again. Before the foot
    /// has been lifted, at once; after contact it changes nothing but the status. A run-up cannot be stopped: an engine with a
    /// [`Self::own_start`] kicks all the same, and is cancelling until it stands.
    fn cancel(&mut self);

    /// How far it is.
    fn progress(&self) -> Progress;

    /// The present forecast of the direction: cosine of the angle between the foot's way and the wanted direction
    /// (paper 3, equation 1). `None` for engines that have none. A caller may break off when it is too poor.
    fn forecast(&self) -> Option<f64> {
        None
    }

    /// Why the engine itself gave the last kick up; `None` when it did not.
    fn broken_off(&self) -> Option<BreakOff> {
        None
    }
}
