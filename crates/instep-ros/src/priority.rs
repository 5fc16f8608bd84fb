//! Real-time priority, where the system allows it: without it every busy program delays the loop by a time slice.
//!
//! Control comes before the network, and both come before whatever else the machine does.

/// Of the first-in-first-out class, from 1 to 99; above ordinary programs, below what the system itself needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Priority {
    /// The control loop.
    Control = 10,
    /// What speaks to the network: it must not delay the loop, but nothing else should delay it.
    Network = 5,
}

/// Gives the present thread, and the threads that it starts from now on, real-time priority and exact timers; tells
/// whether the system allowed the first. Everything works without either, only less evenly.
#[cfg(target_os = "linux")]
pub(crate) fn raise(priority: Priority) -> bool {
    // SAFETY: the call concerns the present thread alone.
    unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, 1_u64) };
    set(libc::SCHED_FIFO, priority as libc::c_int)
}

/// Takes real-time priority from the present thread again; those that it started keep theirs.
#[cfg(target_os = "linux")]
pub(crate) fn lower() {
    let _ = set(libc::SCHED_OTHER, 0);
}

#[cfg(target_os = "linux")]
fn set(class: libc::c_int, sched_priority: libc::c_int) -> bool {
    let parameters = libc::sched_param { sched_priority };
    // SAFETY: the parameters outlive the call; 0 is the present thread.
    unsafe { libc::sched_setscheduler(0, class, &raw const parameters) == 0 }
}

/// Elsewhere nothing is done.
#[cfg(not(target_os = "linux"))]
pub(crate) fn raise(_: Priority) -> bool {
    false
}

/// Elsewhere nothing is done.
#[cfg(not(target_os = "linux"))]
pub(crate) fn lower() {}
