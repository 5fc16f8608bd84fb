//! What follows the network (paper 4, sections IV-A1 to IV-A3): checks that throw out false balls, depth, the best
//! landmarks, and a track of the ball.

pub mod ball;
pub mod depth;
pub mod diameter;
pub mod green;
pub mod height;
pub mod kalman;
pub mod select;
pub mod sights;
pub mod size;
