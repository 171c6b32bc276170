//! The core against the model, as far as every test run affords it; `cargo
//! xtask soak` runs it for longer.

use std::cell::Cell;

use fitmac_core::{message::Output, reason, wire::Route};
use fitmac_core_tests::soak::{Disagreement, Seen, TICKS, run, run_spoilt};

/// What so few ticks need not reach, or what the core itself never says.
const RARE: [&str; 7] = [
    "dropped",
    "flapping",
    "confidence_low",
    "attempt_young",
    "no_action",
    "phase_incompatible",
    "shutting_down",
];

#[test]
fn core_and_model_agree_on_300_000_ticks() {
    let mut sum = Seen::default();
    for seed in 0..300_000 / TICKS {
        match run(1_000_000 + seed, TICKS) {
            Ok(seen) => sum.add(&seen),
            Err(disagreement) => panic!("{disagreement}"),
        }
    }
    assert!(sum.ticks + sum.ties * TICKS >= 300_000, "{sum:?}");
    assert!(sum.ties <= 1, "{sum:?}");
    assert!(sum.corrections > 6000 && sum.rebinds > 300, "{sum:?}");
    let mut missing = sum.reached.missing();
    missing.retain(|name| !RARE.contains(name));
    assert!(missing.is_empty(), "never occurred: {missing:?}");
}

#[test]
fn a_limit_met_to_within_rounding_is_a_tie_and_ends_the_run() {
    // The target drew back by the limit of `moving_away`, 1e-17 m more or less.
    let seen = run(4932, TICKS).expect("no disagreement");
    assert!(seen.ties == 1 && seen.ticks < TICKS, "{seen:?}");
}

/// The first disagreement with a core that is spoilt.
fn noticed(spoil: impl Fn(&mut Output) -> bool) -> Disagreement {
    for seed in 0..50 {
        let spoilt = Cell::new(None);
        let result = run_spoilt(seed, TICKS, || {
            spoilt.set(None);
            |tick, output: &mut Output| {
                if spoilt.get().is_none() && spoil(output) {
                    spoilt.set(Some(tick));
                }
            }
        });
        match (result, spoilt.get()) {
            (Err(d), Some(tick)) => {
                assert_eq!(d.tick, tick, "in the same tick");
                return d;
            }
            (Err(d), None) => panic!("not spoilt yet: {d}"),
            (Ok(_), Some(tick)) => panic!("seed {seed}, tick {tick}: not noticed"),
            (Ok(_), None) => {}
        }
    }
    panic!("nothing to spoil");
}

#[test]
fn a_difference_is_noticed_at_once_and_named() {
    let named = |d: &Disagreement, name| d.differences.iter().any(|x| x.name == name);
    let moved = noticed(|o| {
        let corrects = o.command.sub_phase != 0;
        o.command.action[0] += if corrects { 1e-8 } else { 0.0 };
        corrects
    });
    assert!(named(&moved, "command: action"), "{moved}");
    let routed = noticed(|o| {
        let base = o.command.route == Route::Base.code() && o.trace.is_some();
        o.command.route = if base {
            Route::Target.code()
        } else {
            o.command.route
        };
        base
    });
    assert!(named(&routed, "command: route"), "{routed}");
    let silent = noticed(|o| o.query.take().is_some());
    assert!(named(&silent, "query: asked"), "{silent}");
    let untold = noticed(|o| {
        let bit = o.command.reasons & reason::STREAK_SHORT;
        let clamped = o.command.reasons & reason::CHUNK_REFUSED;
        o.command.reasons &= !(bit | clamped);
        bit | clamped != 0
    });
    assert!(named(&untold, "command: reasons"), "{untold}");
}
