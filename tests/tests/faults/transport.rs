//! D. Shared memory.

use std::{
    fs::{self, File},
    os::unix::fs::{FileExt, MetadataExt, PermissionsExt},
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
};

use fitmac_core::{
    message::{Command, Plan, TraceRecord},
    reason,
};
use fitmac_rt::{
    endpoint::HarnessEndpoint,
    envelope::{Header, MAGIC},
    message::Status,
    port::{Receiver, Sender, Session},
    service::{self, Service},
    transport::Ipc,
};
use fitmac_tests::{
    cell::{AgentsState, Cell, Heard, PolicyState, RobotState, signal},
    fitmac::wait_for,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::process::Signal;

use crate::{STOP_MAX_M, assert_sound, holds, moving, note, now_ns, stop_distance_m};

const PEER: &str = env!("CARGO_BIN_EXE_peer");

#[test]
fn d1_a_robot_that_applies_nothing_is_a_hold() {
    let cell = moving(&[]);
    let since = now_ns();
    let robot = cell.robot.as_ref().expect("a thread");
    robot.with(|robot| robot.deaf = true);
    let hold = cell.wait("hold", since, holds(reason::COMMAND_NOT_APPLIED));
    robot.with(|robot| robot.deaf = false);
    cell.wait("actions", now_ns(), Heard::acts);
    note(
        "d1_a_robot_that_applies_nothing_is_a_hold",
        since,
        &hold,
        None,
    );
    cell.close();
}

#[test]
fn d2_a_listener_that_hangs_delays_nobody() {
    let cell = moving(&[]);
    let before = cell.instance().files().len();
    let mut listener = cell.process(PEER, "listener");
    wait_for("its connections", || {
        (cell.instance().files().len() > before + 2).then_some(())
    });
    let since = now_ns();
    signal(listener.id(), Signal::STOP);
    let first = cell.wait("a command", since, |_| true).command.sequence;
    // Far more than any buffer holds.
    let later = cell.wait("a thousand more", since, |h| {
        h.command.sequence > first + 1000
    });
    assert!(later.acts());
    assert_eq!(cell.count("publish_faults"), 0);
    listener.kill().expect("it runs");
    listener.wait().expect("a child of ours");
    note(
        "d2_a_listener_that_hangs_delays_nobody",
        later.sent_ns,
        &later,
        None,
    );
    cell.close();
}

#[test]
fn d3_a_second_controller_is_refused() {
    let mut cell = moving(&[]);
    let since = now_ns();
    let pid = cell.rt().pid();
    let second = cell
        .another(&["rt", "--instance", "cell", "--allow-non-rt"])
        .finish();
    assert_eq!(second.status.code(), Some(3));
    assert!(
        second.stderr.contains("a controller already runs"),
        "{}",
        second.stderr
    );
    assert!(
        second.stderr.contains(&pid.to_string()),
        "{}",
        second.stderr
    );
    let after = cell.wait("actions", now_ns(), Heard::acts);
    assert!(
        cell.commands_since(since)
            .iter()
            .all(|h| h.session == after.session)
    );
    note("d3_a_second_controller_is_refused", since, &after, None);
    cell.close();
}

#[test]
fn d4_another_type_is_refused_at_the_start() {
    let cell = Cell::empty();
    let transport = Ipc::join(cell.instance()).expect("joins");
    let wrong: Service<Plan> = Service::new(service::STATE.name, 1, 1);
    let sender = Sender::connect(&transport, &wrong, Session::start()).expect("the first");
    let refused = cell.start_under(&[], &[]).finish();
    assert_eq!(refused.status.code(), Some(3));
    let says = format!(
        "service `{}` exists with another message type",
        service::STATE.name
    );
    assert!(refused.stderr.contains(&says), "{}", refused.stderr);
    drop((sender, transport));
    cell.assert_nothing_is_left();
}

#[test]
fn d5_another_version_is_dropped_unread() {
    let cell = moving(&["--set", "state.stop_age_ms=10000"]);
    let since = now_ns();
    let robot = cell.robot.as_ref().expect("a thread");
    robot.with(|robot| robot.abi_ahead = 1);
    let hold = cell.wait("hold", since, holds(reason::STATE_STALE));
    assert!(cell.wait_for_count("state.malformed") > 0);
    let far_m = stop_distance_m(&cell, since, STOP_MAX_M);
    robot.with(|robot| robot.abi_ahead = 0);
    cell.wait("actions", now_ns(), Heard::acts);
    note(
        "d5_another_version_is_dropped_unread",
        since,
        &hold,
        Some(far_m),
    );
    cell.close();
}

#[test]
fn d6_a_killed_robot_may_come_back() {
    let mut cell = Cell::empty();
    let mut robot = cell.process(PEER, "robot");
    cell.add_policy(PolicyState::moving());
    cell.add_agents(AgentsState::default());
    cell.start(&["--backbone-only", "--set", "state.stop_age_ms=10000"]);
    cell.wait("actions", 0, Heard::acts);
    let killed = now_ns();
    robot.kill().expect("it runs");
    robot.wait().expect("a child of ours");
    let hold = cell.wait("hold", killed, holds(reason::STATE_STALE));
    let mut robot = cell.process(PEER, "robot");
    cell.wait("actions", hold.sent_ns, Heard::acts);
    robot.kill().expect("it runs");
    robot.wait().expect("a child of ours");
    note("d6_a_killed_robot_may_come_back", killed, &hold, None);
    cell.close();
}

fn shared_memory_of(cell: &Cell) -> Vec<PathBuf> {
    let files = cell.instance().files();
    files
        .into_iter()
        .filter(|f| f.starts_with("/dev/shm"))
        .collect()
}

#[test]
fn d7_removed_shared_memory_ends_in_a_hold_at_the_latest() {
    let cell = moving(&[]);
    let files = shared_memory_of(&cell);
    assert!(!files.is_empty());
    files
        .iter()
        .for_each(|file| fs::remove_file(file).expect("it is there"));
    // Who is connected stays so; who is gone cannot come back.
    cell.wait("actions", now_ns(), Heard::acts);
    let since = now_ns();
    let robot = cell.robot.as_ref().expect("a thread");
    robot.with(|robot| robot.mute = true);
    let hold = cell.wait("hold", since, holds(reason::STATE_STALE));
    let far_m = stop_distance_m(&cell, since, STOP_MAX_M);
    let test = "d7_removed_shared_memory_ends_in_a_hold_at_the_latest";
    note(test, since, &hold, Some(far_m));
    cell.close();
}

/// Where the controller's inputs lie in a file of shared memory: their
/// payload's place and size.
fn inputs(bytes: &[u8]) -> impl Iterator<Item = (u64, u64)> + '_ {
    const HEADER: usize = size_of::<Header>();
    let magic = MAGIC.to_ne_bytes();
    let places = (0..bytes.len().saturating_sub(HEADER)).step_by(8);
    places
        .filter(move |&at| bytes[at..at + 4] == magic)
        .filter_map(|at| {
            let size = u64::from_ne_bytes(bytes[at + 8..at + 16].try_into().ok()?);
            let own = [
                size_of::<Command>(),
                size_of::<TraceRecord>(),
                size_of::<Status>(),
            ];
            (!own.contains(&(size as usize))).then_some(((at + HEADER) as u64, size))
        })
}

#[test]
fn d8_too_little_shared_memory_is_refused_by_name() {
    let cell = Cell::empty();
    // A /dev/shm of its own with room for next to nothing.
    let small = "mount -t tmpfs -o size=1m none /dev/shm && exec \"$0\" \"$@\"";
    let ended = cell
        .start_under(&["unshare", "-m", "sh", "-c", small], &[])
        .finish();
    assert_eq!(ended.status.code(), Some(3), "{}", ended.stderr);
    for says in [
        "/dev/shm",
        "1024 KiB free",
        "remount,size=64M",
        "--shm-size",
    ] {
        assert!(ended.stderr.contains(says), "{says}: {}", ended.stderr);
    }
    assert_eq!(cell.commands_since(0), [], "it never came to a tick");
    cell.assert_nothing_is_left();
}

#[test]
fn d9_a_foreign_writer_gets_nothing_unsound_through() {
    let cell = moving(&["--set", "state.stop_age_ms=10000"]);
    let since = now_ns();
    // The publisher keeps its memory writable, and so does whoever opens it:
    // every input, sent or not, is scribbled over while the loop reads.
    let targets: Vec<(File, Vec<(u64, u64)>)> = shared_memory_of(&cell)
        .into_iter()
        .filter_map(|path| {
            let bytes = fs::read(&path).ok()?;
            let places: Vec<_> = inputs(&bytes).collect();
            let file = File::options().write(true).open(&path).ok()?;
            (!places.is_empty()).then_some((file, places))
        })
        .collect();
    assert!(!targets.is_empty(), "no message was found in shared memory");
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for _ in 0..3000 {
        for (file, places) in &targets {
            for &(place, size) in places {
                let at = place + 8 * rng.random_range(0..size / 8);
                let noise: [u8; 8] = rng.random();
                file.write_all_at(&noise, at).expect("writes");
            }
        }
    }
    let after = now_ns();
    let still = cell.wait("commands", after, |_| true);
    assert_sound(&cell, since);
    assert!(
        cell.commands_since(since)
            .iter()
            .all(|h| h.session == still.session)
    );
    assert!(cell.commands_since(since).len() > 10);
    note(
        "d9_a_foreign_writer_gets_nothing_unsound_through",
        after,
        &still,
        None,
    );
    cell.close();
}

#[test]
fn d11_only_their_owner_may_open_the_files() {
    let cell = moving(&[]);
    let root = cell.instance().root().to_owned();
    assert_eq!(
        fs::metadata(&root).expect("there").permissions().mode() & 0o777,
        0o700
    );
    for file in cell.instance().files() {
        let meta = fs::metadata(&file).expect("there");
        assert_eq!(
            meta.mode() & 0o077,
            0,
            "{}: {:o}",
            file.display(),
            meta.mode()
        );
    }
    cell.close();
}

#[test]
fn d12_a_message_is_never_torn() {
    let mut cell = Cell::empty();
    cell.add_agents(AgentsState::default());
    let transport = Ipc::join(cell.instance()).expect("joins");
    let instance = cell.instance().clone();
    let enough = Arc::new(AtomicBool::new(false));
    let seen_enough = Arc::clone(&enough);
    let writer = std::thread::spawn(move || {
        let transport = Ipc::join(&instance).expect("joins");
        let mut harness = HarnessEndpoint::connect(&transport, Session::start()).expect("connects");
        for n in 0.. {
            if seen_enough.load(Relaxed) {
                break;
            }
            let mut sample = RobotState::default().world.sample();
            let same = f64::from(n);
            sample.joint_position_rad = [same; 7];
            sample
                .objects
                .iter_mut()
                .for_each(|o| o.position_m = [same; 3]);
            harness.publish_state(now_ns(), &mut sample).expect("sends");
        }
    });
    let mut states = Receiver::connect(&transport, &service::STATE).expect("connects");
    let mut whole = 0;
    while whole < 1000 {
        assert!(!writer.is_finished(), "the writer ended");
        let Some(envelope) = states.poll() else {
            continue;
        };
        let sample = &envelope.payload;
        let [same, ..] = sample.joint_position_rad;
        assert!(sample.joint_position_rad.iter().all(|x| *x == same));
        let objects = &sample.objects[..sample.object_count as usize];
        assert!(!objects.is_empty());
        assert!(objects.iter().all(|o| o.position_m == [same; 3]));
        whole += 1;
    }
    enough.store(true, Relaxed);
    writer.join().expect("no panic");
    drop((states, transport));
    cell.assert_nothing_is_left();
}
