//! Real-time priority for the control thread, where the system gives it.

/// Priority among real-time threads, 1 to 99: above ordinary work, below the kernel's own.
const PRIORITY: i32 = 40;

/// Asks for first-in-first-out scheduling of this thread and for exact timers; tells whether the first was given. The
/// loop works without either, only less evenly.
#[cfg(target_os = "linux")]
pub(crate) fn raise() -> bool {
    let parameters = libc::sched_param { sched_priority: PRIORITY };
    // SAFETY: both calls concern the calling thread alone; `parameters` lives through the call.
    unsafe {
        libc::prctl(libc::PR_SET_TIMERSLACK, 1_u64);
        libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) == 0
    }
}

/// Elsewhere nothing is asked for.
#[cfg(not(target_os = "linux"))]
pub(crate) fn raise() -> bool {
    let _ = PRIORITY;
    false
}
