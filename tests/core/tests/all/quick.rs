//! What notices most mistakes within a second: `cargo xtask mutants` runs this, the recoveries and
//! table 19 first, the rest only where nothing was noticed.

use fitmac_core_tests::soak::{TICKS, run};

#[test]
fn core_and_model_agree_on_100_000_ticks() {
    for seed in 0..100_000 / TICKS {
        if let Err(disagreement) = run(1_000_000 + seed, TICKS) {
            panic!("{disagreement}");
        }
    }
}
