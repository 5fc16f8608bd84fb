//! A robot: a MuJoCo model and the file that says which of its parts plays which role.
//!
//! [`Robot`] is read once and never changes; [`RobotData`] is the scratch space of one thread, in which
//! kinematics and dynamics are computed for a state that the caller sets. Loading: [`Robot::load`].
//!
//! Conventions, said here once for the whole project:
//!
//! - Quaternions are unit, scalar first: w, x, y, z.
//! - `q` has 7 + n numbers: base position in the world (m), `world_from_base` quaternion, then n joint angles (rad).
//! - `v` has 6 + n numbers: base linear velocity in the **world** (m/s), base angular velocity in the **base frame**
//!   (rad/s), then n joint speeds (rad/s). Forces conjugate to `v` are ordered in the same way. (MuJoCo's free joint.)
//! - Momentum is linear, then angular about the centre of mass, both in world axes.
//! - Jacobians are row-major slices, 3 x (6 + n): `velocity[i] = sum_j jacobian[i * nv + j] * v[j]`.
//!
//! [`tree`] and [`ik`]: kinematics without MuJoCo, and inverse kinematics of both legs with weighted goals under joint limits.
//!
//! Nothing here simulates: the world with its ball, contacts and noise is instep-sim.

pub mod adopt;
mod capsule;
pub mod check;
pub mod control;
mod data;
pub mod drive;
mod error;
pub mod ik;
mod meshes;
mod model_file;
mod names;
mod robot;
pub mod senses;
pub mod settings;
pub mod tree;
mod urdf;
mod visible;
mod warnings;

pub use capsule::{SegmentPair, closest_points};
pub use data::RobotData;
pub use error::RobotError;
pub use robot::{ContactPoint, Joint, Leg, LinkPoint, Robot};
pub use visible::{Form, Visible};
