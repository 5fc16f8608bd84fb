//! MuJoCo's own messages. Left to itself it prints them and appends them to a file MUJOCO_LOG.TXT in the user's folder;
//! here warnings are kept, to be told beside the error that they explain, and nothing is written.

use std::io::Write;
use std::sync::Mutex;

use mujoco_rs::logging::set_log_handler;
use mujoco_rs::wrappers::mj_logging::{MjLogMessage, MjtLogLevel};

/// The first few different warnings.
static WARNINGS: Mutex<Vec<String>> = Mutex::new(Vec::new());
const MOST: usize = 3;

fn handler(message: &MjLogMessage) {
    let subject = message.subject().trim().to_owned();
    match message.level() {
        // MuJoCo ends the process after this, with code 1: nobody else will tell.
        MjtLogLevel::mjLOG_ERROR => {
            let _ = writeln!(std::io::stderr().lock(), "error: MuJoCo gave up: {subject}");
        }
        MjtLogLevel::mjLOG_WARNING => {
            if let Ok(mut warnings) = WARNINGS.lock()
                && warnings.len() < MOST
                && !warnings.contains(&subject)
            {
                warnings.push(subject);
            }
        }
        _ => {}
    }
}

/// From here on, MuJoCo's messages come here. To be called first of all.
pub(crate) fn listen() {
    // SAFETY: called at the start of `main`, when there is no other thread and MuJoCo has not been used.
    unsafe { set_log_handler(handler) };
}

/// What MuJoCo has warned about so far.
pub(crate) fn warnings() -> Vec<String> {
    WARNINGS.lock().map(|warnings| warnings.clone()).unwrap_or_default()
}
