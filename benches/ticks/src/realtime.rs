//! Ticks in a function that must not block. Built with the real-time sanitizer, the program ends
//! at the first call of the allocator, a lock or the system.

use std::hint::black_box;

use fitmac_core::{
    Controller,
    message::{Input, Output},
};
use fitmac_core_tests::swarm::Swarm;

const TICKS: usize = 1500;

/// Runs so many seeds of the swarm.
pub(crate) fn run(seeds: u64) {
    let (mut ticks, mut corrections) = (0_u64, 0_u64);
    for seed in 0..seeds {
        let mut swarm = Swarm::new(seed);
        let mut controller = Controller::new(swarm.params);
        for _ in 0..TICKS {
            let told = swarm.tick();
            let output = tick(&mut controller, told.now_ns, &told.input());
            ticks += 1;
            corrections += u64::from(output.command.sub_phase != 0);
            swarm.hear(&output);
        }
    }
    println!("{ticks} ticks, {corrections} of them in a recovery, and none blocked");
}

/// The control: an allocation, which the sanitizer has to notice.
pub(crate) fn control() {
    allocate();
    println!("an allocation went unnoticed: the sanitizer is not at work");
}

#[cfg_attr(rtsan, sanitize(realtime = "nonblocking"))]
#[inline(never)]
fn tick(controller: &mut Controller, now_ns: u64, input: &Input<'_>) -> Output {
    controller.tick(now_ns, input)
}

#[cfg_attr(rtsan, sanitize(realtime = "nonblocking"))]
#[inline(never)]
fn allocate() {
    black_box(vec![0_u8; black_box(64)]);
}
