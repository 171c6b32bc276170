//! Calls of the allocator while something runs. That the meter works is tested too.

use std::hint::black_box;

use fitmac_tests::meter::{self, Meter};

#[global_allocator]
static METER: Meter = Meter;

/// Calls of the allocator while `work` runs.
pub(crate) fn calls(work: impl FnOnce()) -> u64 {
    let before = meter::calls();
    work();
    meter::calls() - before
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
