//! A. The policy.

use fitmac_core::{
    message::{ActionChunk, Command},
    reason,
    wire::Mode,
};
use fitmac_tests::cell::{AgentsState, Cell, PolicyState, RobotState, signal};
use rustix::process::Signal;

use crate::{STOP_MAX_M, assert_sound, holds, moving, note, now_ns, stop_distance_m, stops};

const PEER: &str = env!("CARGO_BIN_EXE_peer");

/// What a queue of eight swings may still do, m.
const QUEUE_M: f64 = 0.08;

/// A cell whose policy is a process.
fn with_policy_process(arguments: &[&str]) -> (Cell, std::process::Child) {
    let mut cell = Cell::empty();
    cell.add_robot(RobotState::default());
    cell.add_agents(AgentsState::default());
    let policy = cell.process(PEER, "policy");
    let arguments: Vec<&str> = ["--backbone-only"]
        .iter()
        .chain(arguments)
        .copied()
        .collect();
    cell.start(&arguments);
    cell.wait("actions", 0, fitmac_tests::cell::Heard::acts);
    (cell, policy)
}

#[test]
fn a1_a_policy_that_never_starts_moves_nothing() {
    let mut cell = Cell::empty();
    cell.add_robot(RobotState::default());
    cell.add_agents(AgentsState::default());
    let started = now_ns();
    cell.start(&["--backbone-only"]);
    let hold = cell.wait("hold", started, holds(reason::NO_CHUNK));
    assert_eq!(stop_distance_m(&cell, started, 0.0), 0.0);
    note(
        "a1_a_policy_that_never_starts_moves_nothing",
        started,
        &hold,
        Some(0.0),
    );
    cell.close();
}

#[test]
fn a1_a_killed_policy_is_a_hold_and_then_a_stop() {
    let (cell, mut policy) = with_policy_process(&["--set", "chunk.stop_after_ms=2000"]);
    let killed = now_ns();
    policy.kill().expect("it runs");
    policy.wait().expect("a child of ours");
    let hold = cell.wait("hold", killed, holds(reason::STARVED));
    let stop = cell.wait("stop", killed, stops(reason::STARVED));
    assert!(hold.sent_ns < stop.sent_ns);
    let far_m = stop_distance_m(&cell, killed, QUEUE_M);
    note(
        "a1_a_killed_policy_is_a_hold_and_then_a_stop",
        killed,
        &hold,
        Some(far_m),
    );
    cell.close();
}

#[test]
fn a2_a_stalled_policy_is_a_hold_until_it_answers() {
    let (cell, mut policy) = with_policy_process(&[]);
    let stalled = now_ns();
    signal(policy.id(), Signal::STOP);
    let hold = cell.wait("hold", stalled, holds(reason::STARVED));
    let far_m = stop_distance_m(&cell, stalled, QUEUE_M);
    signal(policy.id(), Signal::CONT);
    cell.wait("actions", now_ns(), fitmac_tests::cell::Heard::acts);
    policy.kill().expect("it runs");
    policy.wait().expect("a child of ours");
    note(
        "a2_a_stalled_policy_is_a_hold_until_it_answers",
        stalled,
        &hold,
        Some(far_m),
    );
    cell.close();
}

/// The policy's answers are broken from now on: they are refused by name, two
/// in a row are a hold, twenty a stop.
fn broken(
    test: &str,
    refusal: &str,
    arguments: &[&str],
    break_it: impl FnMut(&mut ActionChunk) + Send + 'static,
) {
    let cell = moving(arguments);
    let since = now_ns();
    let policy = cell.policy.as_ref().expect("a thread");
    policy.with(|policy| policy.spoil_with(break_it));
    let hold = cell.wait("hold", since, holds(reason::CHUNK_REFUSALS));
    cell.wait("stop", since, stops(reason::CHUNK_REFUSALS));
    let far_m = stop_distance_m(&cell, since, QUEUE_M);
    assert!(cell.wait_for_count(&format!("refused.{refusal}")) >= 2);
    assert_sound(&cell, since);
    note(test, since, &hold, Some(far_m));
    // The policy is sound again, and an operator says so.
    policy.with(|policy| policy.spoil = None);
    let reset = now_ns();
    let said = cell
        .another(&["rt", "reset", "--instance", "cell"])
        .finish();
    assert_eq!(said.status.code(), Some(0), "{}", said.stdout);
    cell.wait("actions", reset, fitmac_tests::cell::Heard::acts);
    cell.close();
}

/// One answer is out of time: it is dropped by name, and asked for again.
fn dropped(test: &str, refusal: &str, mut break_it: impl FnMut(&mut ActionChunk) + Send + 'static) {
    let cell = moving(&[]);
    let since = now_ns();
    let mut left = 1;
    let policy = cell.policy.as_ref().expect("a thread");
    policy.with(|policy| {
        policy.spoil_with(move |chunk| {
            if left > 0 {
                left -= 1;
                break_it(chunk);
            }
        });
    });
    let hold = cell.wait("hold", since, holds(reason::STARVED));
    assert!(cell.wait_for_count(&format!("refused.{refusal}")) >= 1);
    cell.wait("actions", hold.sent_ns, fitmac_tests::cell::Heard::acts);
    assert_sound(&cell, since);
    note(test, since, &hold, None);
    cell.close();
}

#[test]
fn a3_a_late_chunk_is_dropped() {
    dropped("a3_a_late_chunk_is_dropped", "too_old", |c| {
        c.observation_ns -= 30_000_000_000;
    });
}

#[test]
fn a4_a_chunk_that_nobody_asked_for_is_dropped() {
    let cell = moving(&[]);
    let since = now_ns();
    let policy = cell.policy.as_ref().expect("a thread");
    policy.with(|policy| {
        let mut early = policy.newest.expect("it has answered");
        early.sequence += 1;
        early.observation_ns = since;
        policy.sequence_base += 1;
        policy.besides.push_back(early);
    });
    cell.wait_for_count("refused.query");
    let warned = cell.wait("warning", since, |h| h.says(reason::CHUNK_REFUSED));
    assert!(warned.mode() < Mode::Hold);
    cell.wait("actions", now_ns(), fitmac_tests::cell::Heard::acts);
    note(
        "a4_a_chunk_that_nobody_asked_for_is_dropped",
        since,
        &warned,
        None,
    );
    cell.close();
}

#[test]
fn a5_a_repeated_chunk_is_dropped() {
    let cell = moving(&[]);
    let since = now_ns();
    let policy = cell.policy.as_ref().expect("a thread");
    policy.with(|policy| policy.besides.extend(policy.newest));
    cell.wait_for_count("refused.repeated");
    let warned = cell.wait("warning", since, |h| h.says(reason::CHUNK_REFUSED));
    assert!(warned.mode() < Mode::Hold);
    cell.wait("actions", now_ns(), fitmac_tests::cell::Heard::acts);
    note("a5_a_repeated_chunk_is_dropped", since, &warned, None);
    cell.close();
}

#[test]
fn a5_permuted_chunks_are_refused_and_then_stop() {
    let mut n = 0;
    broken(
        "a5_permuted_chunks_are_refused_and_then_stop",
        "sequence",
        &[],
        move |c| {
            n += 1;
            c.sequence = [2, 1][n % 2];
        },
    );
}

#[test]
fn a6_a_chunk_that_is_too_long_is_refused() {
    broken(
        "a6_a_chunk_that_is_too_long_is_refused",
        "too_long",
        &[],
        |c| c.horizon = u32::MAX,
    );
}

#[test]
fn a7_an_empty_chunk_is_refused() {
    broken("a7_an_empty_chunk_is_refused", "empty", &[], |c| {
        c.horizon = 0
    });
}

#[test]
fn a8_a_chunk_with_a_nan_is_refused_whole() {
    broken(
        "a8_a_chunk_with_a_nan_is_refused_whole",
        "not_finite",
        &[],
        |c| {
            c.actions[7][4] = f32::NAN;
        },
    );
}

#[test]
fn a9_an_action_out_of_range_is_clamped_and_flagged() {
    let cell = moving(&[]);
    let since = now_ns();
    let policy = cell.policy.as_ref().expect("a thread");
    policy.with(|policy| policy.spoil_with(|c| c.actions[2][6] = 2.0));
    let clamped = cell.wait("clamped action", since, |h| h.says(reason::ACTION_CLAMPED));
    assert_ne!(clamped.command.flags & Command::CLAMPED, 0);
    assert_eq!(clamped.command.action[6], 1.0);
    assert_sound(&cell, since);
    note(
        "a9_an_action_out_of_range_is_clamped_and_flagged",
        since,
        &clamped,
        None,
    );
    cell.close();
}

#[test]
fn a9_or_its_chunk_is_refused() {
    let refuse = ["--set", "out_of_range=\"refuse\""];
    broken("a9_or_its_chunk_is_refused", "out_of_range", &refuse, |c| {
        c.actions[2][6] = 2.0
    });
}

#[test]
fn a10_another_convention_is_refused() {
    broken(
        "a10_another_convention_is_refused",
        "convention",
        &[],
        |c| {
            c.gripper = fitmac_core::wire::GripperConvention::OneOpen.code();
        },
    );
}

#[test]
fn a10_an_unknown_convention_is_refused() {
    broken(
        "a10_an_unknown_convention_is_refused",
        "unknown_code",
        &[],
        |c| c.frame = 99,
    );
}

#[test]
fn a11_a_chunk_of_another_epoch_is_dropped() {
    dropped("a11_a_chunk_of_another_epoch_is_dropped", "epoch", |c| {
        c.epoch = c.epoch.wrapping_sub(1);
    });
}

#[test]
fn a11_a_chunk_of_another_subtask_is_dropped() {
    dropped(
        "a11_a_chunk_of_another_subtask_is_dropped",
        "subtask",
        |c| c.subtask += 1,
    );
}

#[test]
fn a12_a_chunk_from_the_future_is_refused() {
    broken(
        "a12_a_chunk_from_the_future_is_refused",
        "from_future",
        &[],
        |c| {
            c.observation_ns += 3_600_000_000_000;
            c.stamp_ns += 3_600_000_000_000;
        },
    );
}

#[test]
fn a13_a_restarted_policy_is_told_apart_and_goes_on() {
    let (cell, mut policy) = with_policy_process(&[]);
    policy.kill().expect("it runs");
    policy.wait().expect("a child of ours");
    let since = now_ns();
    let mut policy = cell.process(PEER, "policy");
    let noticed = cell.wait("notice", since, |h| h.says(reason::POLICY_RESTARTED));
    cell.wait("actions", noticed.sent_ns, fitmac_tests::cell::Heard::acts);
    assert_eq!(cell.wait_for_count("refused.session_changed"), 1);
    policy.kill().expect("it runs");
    policy.wait().expect("a child of ours");
    note(
        "a13_a_restarted_policy_is_told_apart_and_goes_on",
        since,
        &noticed,
        None,
    );
    cell.close();
}

#[test]
fn a14_a_frozen_policy_is_noticed() {
    let since = now_ns();
    let cell = Cell::running(PolicyState::idle(), &["--backbone-only"]);
    let noticed = cell.wait("notice", 0, |h| h.says(reason::POLICY_FROZEN));
    assert_eq!(noticed.mode(), Mode::Warn);
    assert!(stop_distance_m(&cell, since, STOP_MAX_M) < 1e-6);
    let begun = cell
        .commands_since(0)
        .into_iter()
        .find(fitmac_tests::cell::Heard::acts);
    let begun_ns = begun.map_or(since, |heard| heard.sent_ns);
    note("a14_a_frozen_policy_is_noticed", begun_ns, &noticed, None);
    cell.close();
}
