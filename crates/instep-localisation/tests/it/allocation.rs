//! A tick allocates nothing once its memory is there; neither does a check.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

use instep_localisation::scenario::Scenario;
use instep_localisation::stream::{Stream, Told};
use instep_localisation::{Localiser, Map, Settings, methods};

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator, with the calls of each thread counted.
struct Counting;

// SAFETY: every call is passed on unchanged to the system's allocator; counting touches a thread-local cell that needs
// no memory of its own.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's contract is this one's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's contract is this one's.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn ticks_and_checks_allocate_nothing() {
    let scenario = Scenario { lines: true, delay: 0.1, duration: 8.0, ..Scenario::named("false-30").unwrap().clone() };
    let stream = Stream::simulate(&scenario, 520).unwrap();
    let map = Arc::new(Map::new(&stream.field, true).unwrap());
    // The shipped filter, CLAP, Monte Carlo, Kalman; the smoother is there for comparison only.
    for method in methods(&map, &Settings::default(), 1).into_iter().take(4) {
        let name = method.name();
        let mut localiser = Localiser::new(method, stream.start);
        let (mut counts, mut time) = ([0, 0], 0.0);
        for told in &stream.told {
            let before = COUNT.with(Cell::get);
            match told {
                Told::Odometry(step) => localiser.step(step).unwrap(),
                Told::Frame(frame) => {
                    time = frame.time;
                    localiser.see(frame).unwrap();
                    localiser.check_if_due();
                }
                _ => {}
            }
            counts[usize::from(time > 4.0)] += COUNT.with(Cell::get) - before;
        }
        assert_eq!(counts[1], 0, "{name}");
        assert!(name == "Monte Carlo" || name == "Kalman filter" || counts[0] > 0, "{name}: the counter counts");
    }
}
