//! The detector's network: kernels ([`conv`]), shape ([`shape`]), file ([`file`]).

pub mod conv;
pub mod file;
mod product;
pub mod shape;
