//! From a human clip to a reference that a robot can follow.
