//! A tick allocates nothing: a counting allocator watches it. That the meter
//! works is tested too.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    hint::black_box,
};

use fitmac_core::Controller;
use fitmac_tests::swarm::Swarm;

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
fn calls(work: impl FnOnce()) -> u64 {
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

#[test]
fn inv_64_a_tick_allocates_nothing() {
    let (mut queries, mut corrections) = (0, 0);
    for seed in 0..60 {
        let mut swarm = Swarm::new(seed);
        let mut controller = Controller::new(swarm.params);
        for n in 0..1500 {
            let told = swarm.tick();
            let input = told.input();
            let mut output = None;
            let allocated = calls(|| output = Some(controller.tick(told.now_ns, &input)));
            assert_eq!(allocated, 0, "seed {seed}, tick {n}");
            let output = output.expect("set above");
            queries += u32::from(output.trace.is_some());
            corrections += u32::from(output.command.sub_phase != 0);
            swarm.hear(&output);
        }
    }
    assert!(
        queries > 1000 && corrections > 1000,
        "{queries} {corrections}"
    );
}

#[test]
fn inv_64_a_snapshot_is_a_copy() {
    let mut swarm = Swarm::new(7);
    let mut controller = Controller::new(swarm.params);
    let told = swarm.tick();
    controller.tick(told.now_ns, &told.input());
    let mut copy = None;
    assert_eq!(calls(|| copy = Some(controller.state().clone())), 0);
    assert_eq!(copy.as_ref(), Some(controller.state()));
}
