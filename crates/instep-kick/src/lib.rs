//! Kick engines: what turns a request and sensor readings into joint commands, so that a ball is kicked.
//!
//! - [`request`]: what is asked, and the causes of a refusal; [`dialect`]: the request formats that teams already send.
//! - [`ball`]: the ball that a robot plays.
//! - [`bound`]: what geometry and joint speeds allow of a kick, whatever the engine.
//! - [`gaze`]: a neck that keeps the camera on the ball, for any engine.
//! - [`rolling`]: how fast the ball rolls, from the camera's sights of it.
//! - [`stand`]: where to stand for a kick that was refused.
//! - [`settings`]: the files of a robot's folder, read and checked.
//! - [`derive`]: those settings as they follow from a robot, so that a file holds only what differs.
//! - [`engine`]: the trait that every engine implements.
//! - [`adaptive`]: paper 3's engine: retraction and strike in a measured reachability grid, following the ball.
//! - [`dynamic`]: paper 2's engine: splines of foot and trunk in the support foot's frame, stabilised by the centre of
//!   pressure.
//! - [`whole_body`]: what such engines share: the robot's feet, curves, feed-forward torques, closed loop.
//! - [`preview`]: paper 5's engine: preview control of the zero-moment point, a kick through a via point.
//! - [`track`]: a window of a reference on one robot; [`playback`]: plays one open loop; [`feedforward`]: the torques that it needs.
//! - [`policy`]: runs a network that was trained to follow a reference (paper 1), with its state estimate.
//!
//! An engine sees sensors, never the simulator's truth, and allocates nothing in a tick.

pub mod adaptive;
pub mod ball;
pub mod bound;
pub mod derive;
pub mod dialect;
pub mod dynamic;
pub mod engine;
mod error;
pub mod feedforward;
pub mod gaze;
pub mod playback;
pub mod policy;
pub mod preview;
pub mod request;
pub mod rolling;
pub mod settings;
pub mod stand;
pub mod track;
pub mod whole_body;

pub use ball::BallModel;
pub use derive::{Build, Derive};
pub use engine::{BreakOff, Face, KickEngine, KickPlan, KickStart, KickStatus, Phase, Progress};
pub use error::KickError;
pub use playback::Playback;
pub use request::{KickRequest, Learned, Place, Refusal, Strength};
pub use settings::Settings;
pub use stand::Standing;
