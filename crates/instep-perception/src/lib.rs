//! Seeing (paper 4, sections IV-A and IV-B): camera frames, a detector of our own, ball, landmarks and obstacles.
//!
//! - [`camera`], [`scene`], [`render`]: what a head camera sees, rendered without a GPU from plain data.
//! - [`label`], [`dataset`]: what is in a frame, as COCO and YOLO have it; [`metric`]: precision, recall, mAP.
//! - [`net`]: the network's kernels and its shape; [`detector`]: from a frame to boxes.
//! - [`after`]: what follows the network, one check a file; [`proximity`]: what is too near, without the network.
//!
//! Camera frames are x right, y down, z ahead; what leaves is in the robot's frame, x ahead, y left, z up, m.

pub mod after;
pub mod camera;
mod class;
pub mod dataset;
pub mod detector;
mod error;
pub mod label;
pub mod metric;
pub mod net;
mod picture;
pub mod proximity;
pub mod render;
pub mod scene;
pub mod train;

pub use camera::{Camera, CameraPose};
pub use class::{Class, Team};
pub use error::PerceptionError;
pub use picture::{Depth, Frame};
