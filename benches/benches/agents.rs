//! Time and allocations of planning and grounding.
//!
//! `cargo xtask bench agents`. Times are medians on the machine at hand; the
//! ratio to parsing the same scene from JSON says more.

use std::alloc::{GlobalAlloc, Layout, System};
use std::hint::black_box;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use fitmac_agents::grounder::{Context, ground};
use fitmac_agents::planner::plan;
use fitmac_agents::scene::Scene;
use fitmac_agents::synthetic::{DetectorModel, case};
use fitmac_agents::track::{TrackParams, Tracker};

struct Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

// SAFETY: every call goes to the system's allocator unchanged.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(at, layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `realloc`.
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const ROUNDS: usize = 400;

/// Median time in microseconds and allocations a call.
fn measure<T>(mut call: impl FnMut(usize) -> T) -> (f64, f64) {
    (0..ROUNDS).for_each(|round| drop(black_box(call(round))));
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    let mut times = Vec::with_capacity(ROUNDS);
    let reserved = ALLOCATIONS.load(Ordering::Relaxed) - before;
    for round in 0..ROUNDS {
        let start = Instant::now();
        black_box(call(round));
        times.push(start.elapsed().as_nanos() as f64 / 1000.0);
    }
    let count = ALLOCATIONS.load(Ordering::Relaxed) - before - reserved;
    times.sort_by(f64::total_cmp);
    (times[ROUNDS / 2], count as f64 / ROUNDS as f64)
}

fn main() {
    let model = DetectorModel::default();
    let cases: Vec<_> = (0..50).map(|number| case(7, number, &model)).collect();
    let scenes: Vec<Scene> = cases
        .iter()
        .map(|case| {
            Tracker::new(TrackParams::default())
                .update(&case.frames[0])
                .scene
        })
        .collect();
    let plans: Vec<_> = cases
        .iter()
        .map(|case| plan(&case.instruction).expect("a sentence"))
        .collect();
    let json: Vec<String> = scenes
        .iter()
        .map(|scene| serde_json::to_string(scene).expect("a scene"))
        .collect();

    let at = |round: usize| round % cases.len();
    let floor = measure(|round| Scene::from_json(&json[at(round)]).expect("a scene"));
    let planned = measure(|round| plan(&cases[at(round)].instruction));
    let tracked = measure(|round| {
        let mut tracker = Tracker::new(TrackParams::default());
        tracker.update(&cases[at(round)].frames[0])
    });
    let grounded = measure(|round| {
        let index = at(round);
        ground(
            &plans[index].subtasks[0],
            &scenes[index],
            &Context::default(),
        )
    });
    println!(
        "{:<28} {:>10} {:>14} {:>12}",
        "", "us", "allocations", "to parsing"
    );
    for (name, (time, count)) in [
        ("parse a scene from JSON", floor),
        ("plan an instruction", planned),
        ("track a scene", tracked),
        ("ground a subtask", grounded),
    ] {
        println!(
            "{name:<28} {time:>10.2} {count:>14.1} {:>12.2}",
            time / floor.0
        );
    }
}
