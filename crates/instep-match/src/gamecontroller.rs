//! GameController.
