//! The deepest stack of a tick: the stack below the call is painted, the tick runs, and the paint
//! that is left tells how far down it came.

use std::hint::black_box;

use fitmac_core::{
    Controller,
    message::{Input, Output},
};
use fitmac_core_tests::swarm::Swarm;

const PAINTED: usize = 64 * 1024;
const PAINT: u8 = 0xa5;
const TICKS: usize = 1500;

/// Prints the deepest use over so many seeds of the swarm. False if the measure itself is wrong.
pub(crate) fn run(seeds: u64) -> bool {
    let (shallow, deep) = (depth(burn::<1_000>), depth(burn::<9_000>));
    let difference = deep.saturating_sub(shallow);
    if !(7_900..=8_300).contains(&difference) {
        eprintln!("ticks stack: 8,000 bytes more are measured as {difference}");
        return false;
    }
    let nothing = depth(|| {
        black_box(0_u8);
    });
    let mut deepest = (0, 0, 0);
    for seed in 0..seeds {
        let mut swarm = Swarm::new(seed);
        let mut controller = Controller::new(swarm.params);
        for n in 1..=TICKS {
            let told = swarm.tick();
            let input = told.input();
            let mut output = None;
            let used = depth(|| one(&mut controller, told.now_ns, &input, &mut output));
            deepest = deepest.max((used.saturating_sub(nothing), seed, n));
            if let Some(output) = output {
                swarm.hear(&output);
            }
        }
    }
    let (used, seed, tick) = deepest;
    println!("the deepest tick uses {used} bytes of stack (seed {seed}, tick {tick})");
    used < PAINTED - 4096
}

#[inline(never)]
fn one(
    controller: &mut Controller,
    now_ns: u64,
    input: &Input<'_>,
    output: &mut Option<Output>,
) {
    *output = Some(controller.tick(now_ns, input));
}

/// Uses a little more than so many bytes of stack.
#[inline(never)]
fn burn<const BYTES: usize>() {
    black_box(&mut [0_u8; BYTES]);
}

/// Bytes of stack that `work` uses, and a few of this function's own.
#[inline(never)]
fn depth(work: impl FnOnce()) -> usize {
    let bottom = paint();
    work();
    PAINTED - unpainted(bottom)
}

/// Paints what lies below the caller's frame; gives the lowest address.
#[inline(never)]
fn paint() -> usize {
    let mut area = [0_u8; PAINTED];
    for byte in &mut area {
        // SAFETY: a reference is valid; volatile, so that the paint is not left out.
        unsafe { std::ptr::write_volatile(byte, PAINT) };
    }
    black_box(&mut area).as_ptr().expose_provenance()
}

/// Bytes from `bottom` up that still hold the paint.
#[inline(never)]
fn unpainted(bottom: usize) -> usize {
    let byte = |n: &usize| {
        let address = std::ptr::with_exposed_provenance::<u8>(bottom + n);
        // SAFETY: it is this thread's own stack, mapped when it was painted, and only read.
        unsafe { std::ptr::read_volatile(address) == PAINT }
    };
    (0..PAINTED).take_while(byte).count()
}
