//! C. Time.

use std::{fs, process::Command as Process, time::Duration};

use fitmac_core::{Controller, Params, message::Input, reason, wire::Mode};
use fitmac_core_tests::world::Scene;
use fitmac_rt::{endpoint::StopCause, layout::Payload};
use fitmac_tests::cell::{AgentsState, Cell, Heard, PolicyState, RobotState, signal};
use rustix::process::Signal;

use crate::{STOP_MAX_M, assert_sound, moving, note, note_time, now_ns, stop_distance_m, stops};

/// A wall clock that leaps by an hour at every look, for programs that use the
/// system's C library.
const LEAPING_CLOCK: &str = r#"
#define _GNU_SOURCE
#include <dlfcn.h>
#include <time.h>
int clock_gettime(clockid_t id, struct timespec *t) {
    static int (*real)(clockid_t, struct timespec *);
    static long hours;
    if (!real) real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    int status = real(id, t);
    if (id == CLOCK_REALTIME) t->tv_sec += 3600 * ((++hours % 7) - 3) - 86400;
    return status;
}
time_t time(time_t *out) {
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    if (out) *out = t.tv_sec;
    return t.tv_sec;
}
"#;

#[test]
fn c1_a_leaping_wall_clock_changes_nothing() {
    let mut cell = Cell::empty();
    let (source, library) = (
        cell.folder().join("clock.c"),
        cell.folder().join("clock.so"),
    );
    fs::write(&source, LEAPING_CLOCK).expect("writes");
    let compiled = Process::new("cc")
        .args(["-shared", "-fPIC", "-o"])
        .args([&library, &source])
        .arg("-ldl")
        .status();
    assert!(compiled.expect("cc starts").success());
    let preload = format!("LD_PRELOAD={}", library.display());
    // The trick works: `date` believes it.
    let told = Process::new("env")
        .args([&preload, "date", "+%s"])
        .output()
        .expect("date");
    let told: u64 = String::from_utf8_lossy(&told.stdout)
        .trim()
        .parse()
        .expect("seconds");
    let real = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    assert!(real.expect("after 1970").as_secs().abs_diff(told) > 40_000);

    cell.add_robot(RobotState::default());
    cell.add_policy(PolicyState::moving());
    cell.add_agents(AgentsState::default());
    let since = now_ns();
    cell.start_with(&["env", &preload], &["--backbone-only"]);
    let acting = cell.wait("actions", since, Heard::acts);
    let late = cell.wait("two hundred steps", since, |h| h.command.policy_step > 20);
    let commands = cell.commands_since(acting.sent_ns);
    assert!(commands.windows(2).all(|w| w[0].sent_ns < w[1].sent_ns));
    assert!(commands.iter().all(|h| !h.says(reason::TIME_FAULT)));
    note(
        "c1_a_leaping_wall_clock_changes_nothing",
        late.sent_ns,
        &late,
        None,
    );
    cell.close();
}

#[test]
fn c2_time_that_stands_or_runs_backwards_advances_nothing() {
    // The kernel's monotonic clock cannot be made to do this: the core is told.
    let params = Params::guarded().validate().expect("valid");
    let mut core = Controller::new(params);
    let mut world = Scene::can_to_plate().world;
    let mut told = |ms: u64| {
        world.advance(1_000_000);
        let mut sample = world.sample();
        sample.stamp_ns = ms * 1_000_000;
        let input = Input {
            state: Some(&sample),
            ..Input::default()
        };
        core.tick(ms * 1_000_000, &input)
    };
    let before = (1000..1100).map(&mut told).last().expect("ticks").command;
    let still = told(1099).command;
    assert_eq!(still.policy_step, before.policy_step);
    let back = told(1050).command;
    assert_ne!(back.reasons & reason::TIME_FAULT, 0);
    assert!(back.mode() <= Some(Mode::Warn));
    assert_eq!(back.policy_step, before.policy_step);
    assert!(back.as_bytes().len() > 100);
    assert_eq!(told(1100).command.reasons & reason::TIME_FAULT, 0);
}

/// Never more ticks than periods, give or take the lateness of the two at the ends.
fn assert_no_burst(commands: &[Heard]) {
    const PERIOD_NS: u64 = 1_000_000;
    let (first, last) = (commands[0], commands[commands.len() - 1]);
    let ticks = last.command.sequence - first.command.sequence;
    let periods = (last.sent_ns - first.sent_ns) / PERIOD_NS;
    assert!(ticks <= periods + 2, "{ticks} ticks in {periods} periods");
}

#[test]
fn c3_missed_periods_are_skipped_and_never_caught_up() {
    let mut cell = moving(&["--set", "clock.gap_stop_ms=5000"]);
    let since = now_ns();
    let pid = cell.rt().pid();
    for _ in 0..5 {
        signal(pid, Signal::STOP);
        std::thread::sleep(Duration::from_millis(30));
        signal(pid, Signal::CONT);
        std::thread::sleep(Duration::from_millis(30));
    }
    assert!(cell.wait_for_count("overruns") >= 5);
    assert!(cell.wait_for_count("skipped_periods") >= 5 * 20);
    let commands = cell.commands_since(since);
    assert_no_burst(&commands);
    let late = cell.wait("actions", now_ns(), Heard::acts);
    note(
        "c3_missed_periods_are_skipped_and_never_caught_up",
        late.sent_ns,
        &late,
        None,
    );
    cell.close();
}

#[test]
fn c4_signals_make_no_tick_early() {
    let mut cell = moving(&[]);
    let since = now_ns();
    let pid = cell.rt().pid();
    for _ in 0..300 {
        signal(pid, Signal::USR1);
        std::thread::sleep(Duration::from_micros(700));
    }
    let late = cell.wait("actions", now_ns(), Heard::acts);
    assert_no_burst(&cell.commands_since(since));
    note("c4_signals_make_no_tick_early", late.sent_ns, &late, None);
    cell.close();
}

#[test]
fn c5_numbers_that_wrap_are_numbers() {
    let mut cell = Cell::empty();
    let state = RobotState {
        spoil: Some(Box::new(|s| {
            s.sequence = s.sequence.wrapping_add(u64::MAX - 500);
        })),
        ..RobotState::default()
    };
    cell.add_robot(state);
    let mut policy = PolicyState::moving();
    policy.sequence_base = u64::MAX - 3;
    cell.add_policy(policy);
    cell.add_agents(AgentsState::default());
    cell.start(&["--backbone-only"]);
    let robot = cell.robot.as_ref().expect("a thread");
    let wrapped = |_: &Heard| robot.with(|r| r.log.len() > 1500);
    let beyond = cell.wait("the wrap", 0, wrapped);
    let late = cell.wait("ten chunks", beyond.sent_ns, |h| h.command.policy_step > 80);
    assert!(late.acts());
    assert_eq!(cell.count("refused.sequence"), 0);
    note(
        "c5_numbers_that_wrap_are_numbers",
        late.sent_ns,
        &late,
        None,
    );
    cell.close();
}

#[test]
fn c6_a_suspended_controller_stops_when_it_wakes() {
    let mut cell = moving(&[]);
    let since = now_ns();
    let pid = cell.rt().pid();
    signal(pid, Signal::STOP);
    // The robot does not wait for us.
    let robot = cell.robot.as_ref().expect("a thread");
    let silence = fitmac_tests::fitmac::wait_for("the robot's own stop", || {
        robot.with(|r| {
            let stopped = |m: &&fitmac_tests::cell::Moment| {
                m.now_ns > since && m.stopped == Some(StopCause::Silence)
            };
            r.log.iter().find(stopped).copied()
        })
    });
    let far_m = stop_distance_m(&cell, since, STOP_MAX_M);
    std::thread::sleep(Duration::from_millis(400));
    let woken = now_ns();
    signal(pid, Signal::CONT);
    cell.wait("stop", woken, stops(reason::TIME_FAULT));
    assert_sound(&cell, since);
    note_time(
        "c6_a_suspended_controller_stops_when_it_wakes",
        since,
        silence.now_ns,
        Some(far_m),
    );
    let said = cell
        .another(&["rt", "reset", "--instance", "cell"])
        .finish();
    assert_eq!(said.status.code(), Some(0), "{}", said.stdout);
    cell.wait("actions", now_ns(), Heard::acts);
    cell.close();
}
