//! The world: a robot with its real limits, the pitch, a ball whose impacts can be trusted, and the trial.
