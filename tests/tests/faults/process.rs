//! E. Processes and the system.

use std::{
    fs, os::unix::process::ExitStatusExt as _, process::Command as Process, thread, time::Duration,
};

use fitmac_core::{message::Command, wire::Mode};
use fitmac_rt::{
    endpoint::StopCause,
    realtime::{Core, RealTime, allowed_cores},
};
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

#[test]
fn e3_a_crashed_controller_is_safe() {
    let mut cell = moving(&[]);
    let crashed = now_ns();
    // Rust's own handler takes the first one, for it finds no cause: it comes
    // from us. Then the system's default stands.
    while cell.rt().is_running() {
        signal(cell.rt().pid(), Signal::SEGV);
        thread::sleep(Duration::from_millis(1));
    }
    let ended = cell.finish_rt();
    assert_eq!(ended.status.signal(), Some(Signal::SEGV.as_raw()));
    let stop = own_stop(&cell, crashed, StopCause::Silence);
    let far_m = stop_distance_m(&cell, crashed, STOP_MAX_M);
    let test = "e3_a_crashed_controller_is_safe";
    note_time(test, crashed, stop.now_ns, Some(far_m));
    // Another run takes its place, and cleans up after it.
    cell.start(&[]);
    cell.close();
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
fn e6_a_full_disk_ends_the_trace_and_not_the_loop() {
    let mut cell = Cell::empty();
    cell.add_robot(RobotState::default());
    cell.add_policy(PolicyState::moving());
    cell.add_agents(AgentsState::default());
    // A disk of its own, so small that it is full after a moment.
    let small = "mkdir disk && mount -t tmpfs -o size=200k none disk && exec \"$0\" \"$@\"";
    let since = now_ns();
    cell.start_with(
        &["unshare", "-m", "sh", "-c", small],
        &["--backbone-only", "--trace", "disk/run.mcap"],
    );
    assert_eq!(cell.wait_for_count("recorders_failed"), 1);
    let acting = cell.wait("actions", now_ns(), Heard::acts);
    let ended = cell.end_rt();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    for says in [
        "disk/run.mcap stopped: No space left on device",
        "the loop goes on without it",
        "disk/run.mcap is incomplete",
    ] {
        assert!(ended.stderr.contains(says), "{says}: {}", ended.stderr);
    }
    // It says how much is lost.
    let (took, of) = ticks_taken(&ended.stderr);
    assert!(0 < took && took < of, "{took} of {of}");
    let commands = cell.commands_since(since);
    assert!(commands.iter().all(|h| h.session == acting.session));
    cell.assert_nothing_is_left();
}

/// The numbers in `it took 12 of 345 ticks`.
fn ticks_taken(said: &str) -> (u64, u64) {
    let words: Vec<&str> = said.split_whitespace().collect();
    let found = words.windows(5).find_map(|w| match w {
        ["took", took, "of", of, "ticks"] => Some((took.parse().ok()?, of.parse().ok()?)),
        _ => None,
    });
    found.unwrap_or_else(|| panic!("no numbers: {said}"))
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

#[test]
fn e12_whoever_takes_the_control_core_shows_in_the_counts() {
    let mut cell = Cell::empty();
    cell.add_robot(RobotState::default());
    cell.add_policy(PolicyState::moving());
    cell.add_agents(AgentsState::default());
    // Below everyone else, so that only this controller is in the way of what comes.
    cell.start(&["--backbone-only", "--priority", "1"]);
    cell.wait("actions", 0, Heard::acts);
    let before = cell.count("skipped_periods");
    let core = allowed_cores().last().copied().expect("a core");
    let hog = thread::spawn(move || {
        let above = RealTime {
            priority: Some(2),
            core: Core::Number(core),
            ..RealTime::off()
        };
        let _prepared = above.prepare();
        let until_ns = now_ns() + 50_000_000;
        while now_ns() < until_ns {
            std::hint::spin_loop();
        }
    });
    hog.join().expect("no panic");
    let periods = cell.count("skipped_periods") - before;
    assert!(periods >= 20, "{periods} periods of 50 were skipped");
    assert!(cell.count("overruns") > 0);
    cell.close();
}
