//! E. Processes and the system.

use std::{fs, process::Command as Process};

use fitmac_core::{message::Command, wire::Mode};
use fitmac_rt::endpoint::StopCause;
use fitmac_tests::{
    cell::{AgentsState, Cell, Heard, Moment, PolicyState, RobotState, signal},
    fitmac::wait_for,
};
use rustix::process::Signal;

use crate::{STOP_MAX_M, moving, note, note_time, now_ns, stop_distance_m};

/// The robot's own stop after this time.
fn own_stop(cell: &Cell, since_ns: u64, cause: StopCause) -> Moment {
    let robot = cell.robot.as_ref().expect("a thread");
    wait_for("the robot's own stop", || {
        robot.with(|r| {
            let stopped = |m: &&Moment| m.now_ns > since_ns && m.stopped == Some(cause);
            r.log.iter().find(stopped).copied()
        })
    })
}

#[test]
fn e1_a_killed_controller_is_safe_and_starts_afresh() {
    let mut cell = Cell::empty();
    cell.add_robot(RobotState::default());
    cell.add_policy(PolicyState::idle());
    cell.add_agents(AgentsState::default());
    cell.start(&[]);
    let corrects = |h: &Heard| h.command.sub_phase != 0;
    let before = cell.wait("a recovery", 0, corrects);
    let killed = now_ns();
    signal(cell.rt().pid(), Signal::KILL);
    let _ = cell.finish_rt();
    let stop = own_stop(&cell, killed, StopCause::Silence);
    let far_m = stop_distance_m(&cell, killed, STOP_MAX_M);
    let test = "e1_a_killed_controller_is_safe_and_starts_afresh";
    note_time(test, killed, stop.now_ns, Some(far_m));
    // Another run: it remembers nothing, and resumes nothing.
    let restarted = now_ns();
    cell.start(&[]);
    let first = cell.wait("the first command", restarted, |h| {
        h.session != before.session
    });
    assert!(first.session > before.session);
    assert_eq!(
        (first.command.sub_phase, first.command.action[..6].to_vec()),
        (0, vec![0.0; 6])
    );
    cell.wait("actions", restarted, |h| {
        h.session == first.session && h.acts()
    });
    cell.close();
}

#[test]
fn e2_a_termination_is_a_controlled_stop_and_a_whole_trace() {
    let mut cell = moving(&["--trace", "run.mcap"]);
    let asked = now_ns();
    let ended = cell.end_rt();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let stop = own_stop(&cell, asked, StopCause::Ended);
    let far_m = stop_distance_m(&cell, asked, STOP_MAX_M);
    let commands = cell.commands_since(asked);
    let last = commands.last().expect("commands");
    assert_ne!(last.command.flags & Command::LAST, 0);
    assert_eq!(last.mode(), Mode::Stop);
    let trace = cell.folder().join("run.mcap");
    let trace = trace.to_str().expect("UTF-8");
    let replay = cell.another(&["replay", trace]).finish();
    assert_eq!(
        replay.status.code(),
        Some(0),
        "{}\n{}",
        replay.stdout,
        replay.stderr
    );
    let test = "e2_a_termination_is_a_controlled_stop_and_a_whole_trace";
    note_time(test, asked, stop.now_ns, Some(far_m));
    cell.assert_nothing_is_left();
}

#[test]
fn e2_a_second_signal_ends_at_once() {
    let mut cell = moving(&[]);
    let asked = now_ns();
    let pid = cell.rt().pid();
    // Between the two it cannot run, so that the first cannot end it.
    signal(pid, Signal::STOP);
    signal(pid, Signal::TERM);
    signal(pid, Signal::INT);
    signal(pid, Signal::CONT);
    let ended = cell.finish_rt();
    assert_eq!(ended.status.code(), Some(130), "{}", ended.stderr);
    own_stop(&cell, asked, StopCause::Silence);
    assert!(stop_distance_m(&cell, asked, STOP_MAX_M) <= STOP_MAX_M);
    cell.instance().clean_up().expect("cleans");
    cell.assert_nothing_is_left();
}

/// Starts the controller without some rights, and without `--allow-non-rt`.
fn without_rights(cell: &Cell, wrapper: &[&str]) -> fitmac_tests::fitmac::Finished {
    cell.start_strictly_under(wrapper, &["--ticks", "50"])
        .finish()
}

#[test]
fn e4_memory_that_cannot_be_locked_is_refused_by_name() {
    let cell = Cell::empty();
    let no_lock = [
        "setpriv",
        "--bounding-set=-ipc_lock",
        "--inh-caps=-ipc_lock",
    ];
    let limit = ["prlimit", "--memlock=65536:65536"];
    let wrapper: Vec<&str> = limit.iter().chain(&no_lock).copied().collect();
    let refused = without_rights(&cell, &wrapper);
    assert_eq!(refused.status.code(), Some(3), "{}", refused.stderr);
    for word in ["locked memory", "memlock", "--allow-non-rt"] {
        assert!(refused.stderr.contains(word), "{}", refused.stderr);
    }
    cell.assert_nothing_is_left();
}

#[test]
fn e5_a_priority_that_is_not_allowed_is_refused_by_name() {
    let cell = Cell::empty();
    let no_nice = [
        "setpriv",
        "--bounding-set=-sys_nice",
        "--inh-caps=-sys_nice",
    ];
    let limit = ["prlimit", "--rtprio=0:0"];
    let wrapper: Vec<&str> = limit.iter().chain(&no_nice).copied().collect();
    let refused = without_rights(&cell, &wrapper);
    assert_eq!(refused.status.code(), Some(3), "{}", refused.stderr);
    for word in ["SCHED_FIFO", "rtprio", "--allow-non-rt"] {
        assert!(refused.stderr.contains(word), "{}", refused.stderr);
    }
    // It runs where the user says so.
    let allowed = cell.start_under(&wrapper, &["--ticks", "50"]).finish();
    assert_eq!(allowed.status.code(), Some(0), "{}", allowed.stderr);
    assert!(
        allowed.stderr.contains("SCHED_FIFO: REFUSED"),
        "{}",
        allowed.stderr
    );
    cell.assert_nothing_is_left();
}

#[test]
fn e7_the_loop_needs_no_file_that_is_not_open() {
    let mut cell = moving(&["--trace", "run.mcap"]);
    let pid = cell.rt().pid().to_string();
    // No further file may be opened, and the one that is recorded to goes.
    let limited = Process::new("prlimit")
        .args(["--nofile=0:0", "--pid", &pid])
        .status();
    assert!(limited.expect("prlimit starts").success());
    fs::remove_file(cell.folder().join("run.mcap")).expect("it is there");
    let since = now_ns();
    let first = cell.wait("a command", since, |_| true).command.sequence;
    let later = cell.wait("a thousand more", since, |h| {
        h.command.sequence > first + 1000
    });
    assert!(later.acts());
    let ended = cell.end_rt();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    note(
        "e7_the_loop_needs_no_file_that_is_not_open",
        later.sent_ns,
        &later,
        None,
    );
    cell.instance().clean_up().expect("cleans");
    cell.assert_nothing_is_left();
}
