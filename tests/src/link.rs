//! What the tests of the C, C++ and Python interfaces share: recorded inputs
//! with the core's answers as bytes, and programs of other languages.
#![allow(unsafe_code)]

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    process::Command,
};

use fitmac_core::{
    Params,
    message::{Input, Output},
    wire::{Provenance, Route},
};

use fitmac_core_tests::world::{Agent, Answer, Behaviour, OTHER, Policy, Scene, Session};

use crate::oracle::{python, workspace_root};

/// The inputs of an episode and the core's answers, as bytes.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// A record a tick: `now_ns`, request, contents (u64 each), messages.
    pub inputs: Vec<u8>,
    /// A record a tick: contents (u64), command, messages.
    pub outputs: Vec<u8>,
    /// Ticks.
    pub ticks: usize,
    /// Routes that were taken.
    pub routes: BTreeSet<Route>,
}

/// Recordings that take every route, in the `guarded` profile.
#[must_use]
pub fn recordings() -> Vec<Recording> {
    let episodes = [
        (Scene::can_to_plate(), Behaviour::WrongObject(OTHER)),
        (Scene::can_to_basket(), Behaviour::StallsAbove(0.05)),
        (Scene::can_to_plate(), Behaviour::MissesPlace([0.12, 0.0])),
    ];
    let record = |(scene, behaviour): (Scene, Behaviour)| {
        let answer = |kappa| Answer::Target {
            id: scene.target,
            kappa,
            provenance: Provenance::Rules,
        };
        let agent = Agent::new([answer(0.2), answer(0.95)]);
        let session = Session::new(Params::guarded(), scene, Policy::new(behaviour), agent);
        Recording::of(session, 5000)
    };
    episodes.into_iter().map(record).collect()
}

impl Recording {
    /// Records `ticks` ticks of a session that has not begun.
    #[must_use]
    pub fn of(mut session: Session, ticks: usize) -> Self {
        let mut recording = Self {
            ticks,
            ..Self::default()
        };
        for _ in 0..ticks {
            let mut told = Vec::new();
            let output = session.tick_with(|input| told = messages_in(input));
            let now_ns = session.world.now_ns();
            recording.inputs.extend(now_ns.to_ne_bytes());
            recording.inputs.extend(told);
            recording.outputs.extend(messages_out(&output));
            recording.routes.extend(output.command.route());
        }
        recording
    }
}

/// The bytes of a message. Messages have no padding.
fn bytes<T: Copy>(message: &T) -> &[u8] {
    // SAFETY: the memory of a message is all numbers, without gaps.
    unsafe { core::slice::from_raw_parts(core::ptr::from_ref(message).cast(), size_of::<T>()) }
}

fn optional<T: Copy>(message: Option<&T>) -> &[u8] {
    message.map_or(&[], bytes)
}

fn join(head: &[u64], messages: &[&[u8]], contents_of: &[&[u8]]) -> Vec<u8> {
    let mut contents = 0_u64;
    for (bit, message) in contents_of.iter().enumerate() {
        contents |= u64::from(!message.is_empty()) << bit;
    }
    let head = head.iter().chain([&contents]);
    let mut all: Vec<u8> = head.flat_map(|number| number.to_ne_bytes()).collect();
    for message in messages {
        all.extend_from_slice(message);
    }
    all
}

fn messages_in(input: &Input<'_>) -> Vec<u8> {
    let messages = [
        optional(input.state),
        optional(input.chunk),
        optional(input.grounding),
        optional(input.plan),
        optional(input.verifier),
        optional(input.critic),
    ];
    join(&[u64::from(input.request)], &messages, &messages)
}

fn messages_out(output: &Output) -> Vec<u8> {
    let command = bytes(&output.command);
    let rest = [
        optional(output.query.as_ref()),
        optional(output.rebind.as_ref()),
        optional(output.trace.as_ref()),
        optional(output.event.as_ref()),
    ];
    let [query, rebind, trace, event] = rest;
    join(&[], &[command, query, rebind, trace, event], &rest)
}

/// Fails where two runs of bytes differ, with the first place.
///
/// # Panics
/// If they differ.
pub fn assert_same_bytes(expected: &[u8], got: &[u8]) {
    let differs = expected.iter().zip(got).position(|(e, g)| e != g);
    assert_eq!(
        differs,
        None,
        "first byte that differs, of {}",
        expected.len()
    );
    assert_eq!(expected.len(), got.len(), "bytes in all");
}

/// Runs a command to its end and returns what it printed.
///
/// # Panics
/// If it cannot be started or fails.
pub fn run(command: &mut Command) -> String {
    let shown = format!("{command:?}");
    let output = command
        .output()
        .unwrap_or_else(|e| panic!("{shown} cannot be started: {e}"));
    let out = String::from_utf8_lossy(&output.stdout);
    let err = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "{shown}: {}\n{out}\n{err}",
        output.status
    );
    out.into_owned()
}

/// A program of the virtual environment that holds the oracles.
///
/// # Panics
/// With the remedy, where it is not there.
#[must_use]
pub fn tool(name: &str) -> PathBuf {
    let program = python().with_file_name(name);
    assert!(
        program.exists(),
        "no {name} at {}: run `cargo xtask test`, which installs \
         tests/oracles/link-requirements.txt there",
        program.display()
    );
    program
}

/// Installs the C library below `prefix` by `cargo xtask install`.
///
/// # Panics
/// If that fails.
pub fn install(prefix: &Path) {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command
        .args([
            "run",
            "--quiet",
            "--locked",
            "--package=xtask",
            "--",
            "install",
            "--prefix",
        ])
        .arg(prefix)
        .current_dir(workspace_root());
    let said = run(&mut command);
    assert!(said.starts_with("installed FIT-MAC"), "{said}");
}

/// The blocks of code in `language` of a page in `docs`.
///
/// # Panics
/// If the page cannot be read or has none.
#[must_use]
pub fn blocks(page: &str, language: &str) -> Vec<String> {
    let path = workspace_root().join("docs").join(page);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let fence = format!("```{language}\n");
    let rest = text.split(fence.as_str()).skip(1);
    let found: Vec<String> = rest
        .filter_map(|after| after.split("```").next())
        .map(str::to_owned)
        .collect();
    assert!(!found.is_empty(), "{page} has no block of {language}");
    found
}
