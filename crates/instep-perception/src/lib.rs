//! Seeing: camera frames, detector, ball, landmarks and obstacles.
