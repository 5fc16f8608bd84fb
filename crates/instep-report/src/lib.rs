//! What a person looks at: one-file HTML replays with plots, and MCAP recordings.
