//! Raw bytes as input: what the fuzzer kept, and bytes at random. The fuzz
//! target itself (`cargo xtask fuzz`) runs the same function.

use std::fs;

use fitmac_core_tests::{
    bytes::{self, Run},
    workspace_root,
};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn feed(total: &mut Run, name: &str, input: &[u8]) {
    match bytes::run(input) {
        Ok(run) => {
            total.ticks += run.ticks;
            total.queries += run.queries;
            total.correcting += run.correcting;
        }
        Err((tick, broken)) => panic!(
            "{name}, tick {tick}: {}: {}",
            broken.invariant, broken.found
        ),
    }
}

#[test]
fn the_corpus_breaks_nothing() {
    let folder = workspace_root().join("tests/fuzz/corpus/tick");
    let mut total = Run::default();
    for entry in fs::read_dir(&folder).expect("the corpus is in the repository") {
        let path = entry.expect("readable").path();
        let input = fs::read(&path).expect("readable");
        feed(&mut total, &path.display().to_string(), &input);
    }
    assert!(total.ticks > 1000 && total.correcting > 200, "{total:?}");
}

#[test]
fn bytes_at_random_break_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut total = Run::default();
    for n in 0..4000 {
        let length = rng.random_range(3..400);
        let mut input = vec![0; length];
        rng.fill_bytes(&mut input);
        // Mostly in good order, or nothing ever gets anywhere.
        let odd = [0.02, 0.1, 0.5, 1.0][n % 4];
        for byte in input.iter_mut().skip(3) {
            if !rng.random_bool(odd) {
                *byte = 0;
            }
        }
        feed(&mut total, &format!("{input:?}"), &input);
    }
    assert!(
        total.queries > 10_000 && total.correcting > 2000,
        "{total:?}"
    );
}
