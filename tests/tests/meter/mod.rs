//! A counting allocator: calls of the thread that asks. That the meter works is tested too.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    hint::black_box,
};

thread_local! {
    static CALLS: Cell<u64> = const { Cell::new(0) };
}

/// Counts the calls of its own thread.
struct Meter;

fn count() {
    // A thread that is being torn down has no counter any more.
    let _gone = CALLS.try_with(|calls| calls.set(calls.get() + 1));
}

// SAFETY: every call goes to the system's allocator unchanged.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Meter {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        count();
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(block, layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promise is passed on.
        unsafe { System.realloc(block, layout, size) }
    }
}

#[global_allocator]
static METER: Meter = Meter;

/// Calls of the allocator while `work` runs.
pub(crate) fn calls(work: impl FnOnce()) -> u64 {
    let before = CALLS.get();
    work();
    CALLS.get() - before
}

#[test]
fn the_meter_counts_each_kind_of_call() {
    let mut kept = Vec::new();
    assert_eq!(calls(|| kept.push(1_u64)), 1, "one allocation");
    assert_eq!(calls(|| kept.reserve_exact(100)), 1, "one reallocation");
    assert_eq!(calls(|| drop(std::mem::take(&mut kept))), 1, "one release");
    assert_eq!(calls(|| drop(black_box(Box::new([0_u8; 64])))), 2);
    assert_eq!(calls(|| {}), 0);
}
