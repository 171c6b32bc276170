//! Bytes become time steps and messages of a controller; every tick is checked.
#![no_main]

use fitmac_core_tests::bytes;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    if let Err((tick, broken)) = bytes::run(input) {
        panic!("tick {tick}: {}: {}", broken.invariant, broken.found);
    }
});
