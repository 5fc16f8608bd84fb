//! Deciding: memory, targets, roles, kicks and gaze.
