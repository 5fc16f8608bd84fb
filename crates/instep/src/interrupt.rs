//! Ctrl-C: work that can stop in order asks a flag.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The code of a program that Ctrl-C ended.
pub(crate) const INTERRUPTED: u8 = 130;

/// A flag that Ctrl-C or a request to terminate raises; a second Ctrl-C ends the program at once.
pub(crate) fn stopped_by_the_user() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&stop);
    // Without a handler Ctrl-C ends the program, as it would anyway.
    let _ = ctrlc::set_handler(move || {
        if raised.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(INTERRUPTED));
        }
    });
    stop
}
