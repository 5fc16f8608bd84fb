//! What a control tick or an inner loop calls allocates nothing once its memory is there.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use instep_motion::clip::BonePoses;
use instep_motion::landmark::{Landmark, Landmarks, Segment};
use instep_motion::phase::Side;
use instep_motion::reference::Knot;
use instep_motion::spline::{CubicSpline, Ends, ViaPoint};

use crate::reference::example;
use crate::synthetic;

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

/// How often `work` allocates.
fn allocations(work: impl FnOnce()) -> usize {
    let before = COUNT.with(Cell::get);
    work();
    COUNT.with(Cell::get) - before
}

#[test]
fn sampling_a_reference_allocates_nothing() {
    let reference = example();
    let mut knot = Knot::default();
    assert!(allocations(|| reference.sample_into(0.0, &mut knot)) > 0, "the counter counts");
    let again = || (0..100).for_each(|i| reference.sample_into(f64::from(i) * 0.0013, &mut knot));
    assert_eq!(allocations(again), 0);
}

#[test]
fn evaluating_splines_allocates_nothing() {
    let curve = ViaPoint::new([0.0; 3], (0.2, [1.0; 3]), (0.3, [2.0; 3]), [0.0; 3]).unwrap();
    let spline = CubicSpline::through(&[(0.0, [0.0]), (0.5, [1.0]), (1.0, [0.0])], Ends::Natural).unwrap();
    let mut sum = 0.0;
    let work = || {
        for i in 0..100 {
            let t = f64::from(i) * 0.011;
            sum += curve.position(t)[0] + curve.velocity(t)[1] + curve.acceleration(t)[2] + spline.position(t)[0];
        }
    };
    assert_eq!(allocations(work), 0);
    assert!(sum.is_finite());
}

#[test]
fn forward_kinematics_allocates_nothing() {
    let clip = synthetic::clip();
    let landmarks = Landmarks::find(&clip.skeleton).unwrap();
    let mut poses = BonePoses::default();
    clip.poses_into(0, &mut poses);
    let mut sum = 0.0;
    let work = || {
        for frame in 0..clip.frames.len() {
            clip.poses_into(frame, &mut poses);
            sum += Landmark::ALL.iter().map(|landmark| landmarks.position(&poses, *landmark).z).sum::<f64>();
            sum += landmarks.rotation(&poses, Segment::Chest).w + landmarks.sole(&poses, Side::Left).ball.x;
        }
    };
    assert_eq!(allocations(work), 0);
    assert!(sum.is_finite());
}
