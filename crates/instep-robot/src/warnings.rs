//! MuJoCo's warnings. By default it prints each one and appends it to a file `MUJOCO_LOG.TXT` in the working folder,
//! which is nobody's wish: what matters here is an error of ours, or a counter in MuJoCo's data that the world reads.

use std::ffi::c_char;
use std::sync::Once;

use mujoco_rs::mujoco_c;

/// Keeps MuJoCo from printing warnings and writing its log file, in this process from now on.
pub(crate) fn silence() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // SAFETY: written once, before this crate first calls MuJoCo; the handler reads nothing.
        unsafe { mujoco_c::mju_user_warning = Some(ignore) };
    });
}

unsafe extern "C" fn ignore(_message: *const c_char) {}
