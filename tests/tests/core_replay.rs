//! The same inputs give the same answers in another build: here the one that runs the tests, and
//! one that is optimised as a whole. `cargo xtask replay-identity` compares four.

use std::process::Command;

use fitmac_core_tests::replay::fingerprint;

const SEEDS: u64 = 8;

#[test]
fn inv_62_an_optimised_build_answers_bit_for_bit_as_this_one() {
    let ours = fingerprint(0..SEEDS).expect("writing into a hash");
    let program = fitmac_benches::ticks::program().expect("the harness builds");
    let output = Command::new(program)
        .args(["replay", &SEEDS.to_string()])
        .output()
        .expect("the harness starts");
    assert!(output.status.success(), "{output:?}");
    let theirs = String::from_utf8_lossy(&output.stdout);
    assert_eq!(theirs.trim(), ours.to_string());
}

/// Other inputs have another fingerprint, or equal ones would prove nothing.
#[test]
fn other_inputs_are_told_apart() {
    let [a, b] = [0..1, 1..2].map(|seeds| fingerprint(seeds).expect("writing into a hash"));
    assert_ne!(a.inputs, b.inputs);
    assert_ne!(a.answers, b.answers);
}
