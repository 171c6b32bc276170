//! Every fault of `fitmac_tests::faults`, against a real controller process:
//! the reaction, how far the arm gets, and that no file is left behind. What
//! they measure is written down where `FITMAC_FAULTS` names a folder; nothing
//! here depends on how fast the machine is.

mod configuration;
mod index;
mod perception;
mod policy;
mod process;
mod time;
mod transport;

use fitmac_core::wire::Mode;
use fitmac_rt::clock;
use fitmac_tests::{
    cell::{Cell, Heard, PolicyState},
    faults::Reaction,
};

/// The arm swings to and fro, and nothing corrects it.
fn moving(arguments: &[&str]) -> Cell {
    let arguments: Vec<&str> = ["--backbone-only"]
        .iter()
        .chain(arguments)
        .copied()
        .collect();
    Cell::running(PolicyState::moving(), &arguments)
}

/// A hold for these reasons.
fn holds(reasons: u64) -> impl Fn(&Heard) -> bool {
    move |heard| heard.mode() == Mode::Hold && heard.says(reasons)
}

/// A stop for these reasons.
fn stops(reasons: u64) -> impl Fn(&Heard) -> bool {
    move |heard| heard.mode() == Mode::Stop && heard.says(reasons)
}

/// Everything sent since then is sound, whatever went wrong.
fn assert_sound(cell: &Cell, since_ns: u64) {
    for heard in cell.commands_since(since_ns) {
        let c = &heard.command;
        let numbers = c.action.iter().chain(&c.setpoint_position_m);
        assert!(numbers.into_iter().all(|x| x.is_finite()), "{c:?}");
        assert!(c.action.iter().all(|a| a.abs() <= 1.0), "{c:?}");
    }
}

/// Notes how long the reaction took, and how far the arm got.
fn note(test: &str, since_ns: u64, reaction: &Heard, stop_m: Option<f64>) {
    note_time(test, since_ns, reaction.sent_ns, stop_m);
}

fn note_time(test: &str, since_ns: u64, reaction_ns: u64, stop_m: Option<f64>) {
    Reaction {
        after_ms: reaction_ns.saturating_sub(since_ns) as f64 * 1e-6,
        stop_m,
    }
    .note(test);
}

/// How far the arm may get before it stands, m: at the most 0.25 m/s for the
/// 60 ms until a stale state is a hold and the 20 ms until the robot stops by
/// itself, and then some.
const STOP_MAX_M: f64 = 0.04;

/// Waits for rest, and checks the way to it.
fn stop_distance_m(cell: &Cell, since_ns: u64, most_m: f64) -> f64 {
    let far_m = cell.stop_distance_m(since_ns);
    assert!(far_m <= most_m, "{far_m} m until it stands");
    far_m
}

/// Now, and everything until now.
fn now_ns() -> u64 {
    clock::now_ns()
}
