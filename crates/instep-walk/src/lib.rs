//! Walking: state estimate, footsteps, swing, whole-body control, kicks in the middle of a step.
