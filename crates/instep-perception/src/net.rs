//! The detector's network: kernels ([`conv`], [`grid`]), shape ([`shape`]), file ([`file`], [`onnx`]).

pub mod conv;
pub mod file;
pub mod grid;
mod lanes;
pub mod onnx;
pub mod shape;
