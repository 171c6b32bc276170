//! Processes of the demo die, or the user interrupts it: a clear message, an
//! orderly end of the others, nothing left behind.

use std::{fs, time::Instant};

use fitmac_tests::fitmac::{Finished, Place, Run, is_running, wait_for};
use rustix::process::{Pid, Signal, kill_process};

const ROLES: [&str; 4] = ["sim", "vla", "agents", "rt"];

/// A demo whose robot already moves.
fn moving_demo(place: &Place) -> Run {
    let run = place.start(&["demo", "--seed", "1", "--out", "out"]);
    // The controller connects last; its log says so.
    wait_for("the controller", || run.role("rt"));
    wait_for("shared memory", || {
        let files = place.instance_files();
        files
            .iter()
            .any(|file| file.starts_with("/dev/shm"))
            .then_some(())
    });
    let trace = place.folder().join("out/policy-alone/trace.mcap");
    wait_for("a trace that grows", || {
        fs::metadata(&trace)
            .ok()
            .filter(|meta| meta.len() > 0)
            .map(|_| ())
    });
    run
}

fn send(pid: u32, signal: Signal) {
    let pid = Pid::from_raw(i32::try_from(pid).expect("a process id")).expect("not zero");
    kill_process(pid, signal).expect("it runs");
}

/// What must hold after every end.
fn assert_nothing_is_left(place: &Place, pid: u32, processes: &[u32]) {
    for &process in processes {
        wait_for("the end of every process", || {
            (!is_running(process)).then_some(())
        });
    }
    assert_eq!(place.instance_files(), Vec::<std::path::PathBuf>::new());
    for run in ["policy-alone", "fit-mac"] {
        let left = place.files_of_instance(&format!("demo-{pid}-{run}"));
        assert!(left.is_empty(), "left behind: {left:?}");
    }
}

fn kill_role(role: &str, title: &str) {
    let place = Place::new();
    let run = moving_demo(&place);
    let (pid, processes) = (run.pid(), run.children());
    assert_eq!(processes.len(), ROLES.len());
    let victim = run.role(role).expect("the role runs");
    let killed = Instant::now();
    send(victim, Signal::KILL);
    let Finished { status, stderr, .. } = run.finish();
    println!("{role} killed: ended after {:?}", killed.elapsed());
    assert_eq!(status.code(), Some(3), "{stderr}");
    let message = format!("the {title} process (pid {victim}) was ended by signal 9");
    assert!(stderr.contains(&message), "{stderr}");
    assert_nothing_is_left(&place, pid, &processes);
}

#[test]
fn a_killed_simulator_ends_the_demo_in_order() {
    kill_role("sim", "simulator");
}

#[test]
fn a_killed_policy_ends_the_demo_in_order() {
    kill_role("vla", "policy");
}

#[test]
fn killed_agents_end_the_demo_in_order() {
    kill_role("agents", "agents");
}

#[test]
fn a_killed_controller_ends_the_demo_in_order() {
    kill_role("rt", "controller");
}

#[test]
fn a_killed_supervisor_takes_the_others_along() {
    let place = Place::new();
    let run = moving_demo(&place);
    let (pid, processes) = (run.pid(), run.children());
    send(pid, Signal::KILL);
    let finished = run.finish();
    assert_eq!(finished.status.code(), None);
    assert_nothing_is_left(&place, pid, &processes);
}

#[test]
fn an_interrupted_demo_says_so_and_cleans_up() {
    let place = Place::new();
    let run = moving_demo(&place);
    let (pid, processes) = (run.pid(), run.children());
    send(pid, Signal::INT);
    let Finished { status, stderr, .. } = run.finish();
    assert_eq!(status.code(), Some(130), "{stderr}");
    assert!(
        stderr.contains("interrupted; all processes have ended"),
        "{stderr}"
    );
    assert_nothing_is_left(&place, pid, &processes);
}

#[test]
fn what_a_killed_demo_left_is_removed_by_the_next_one() {
    let place = Place::new();
    let run = moving_demo(&place);
    let (pid, processes) = (run.pid(), run.children());
    // All at once: nobody is left to clean up.
    for &process in processes.iter().chain([&pid]) {
        send(process, Signal::KILL);
    }
    let _ = run.finish();
    assert!(
        !place
            .files_of_instance(&format!("demo-{pid}-policy-alone"))
            .is_empty()
    );
    let next = moving_demo(&place);
    let left = place.files_of_instance(&format!("demo-{pid}-policy-alone"));
    assert!(left.is_empty(), "left behind: {left:?}");
    let (pid, processes) = (next.pid(), next.children());
    send(pid, Signal::INT);
    let _ = next.finish();
    assert_nothing_is_left(&place, pid, &processes);
}
