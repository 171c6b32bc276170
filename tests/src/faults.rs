//! The faults that the system is built for: what happens, how it reacts, and
//! which tests show it. `docs/faults.md` is made from this table and from what
//! `cargo xtask faults` measured.

use std::{collections::BTreeMap, fmt::Write, fs, io, path::Path};

use serde::{Deserialize, Serialize};

use crate::oracle::workspace_root;

/// A fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Its row: a letter for what fails, and a number.
    pub row: &'static str,
    /// What happens.
    pub fault: &'static str,
    /// How the system reacts.
    pub reaction: &'static str,
    /// The file of its tests.
    pub file: &'static str,
    /// Its tests; none where nothing can be tested, and the reaction says why.
    pub tests: &'static [&'static str],
}

/// What a letter stands for.
pub const SECTIONS: &[(char, &str)] = &[
    ('A', "The policy"),
    ('B', "Robot state, objects, perception"),
    ('C', "Time"),
    ('D', "Shared memory"),
    ('E', "Processes and the system"),
    ('F', "Configuration, and text that cannot be trusted"),
];

const POLICY: &str = "tests/tests/faults/policy.rs";
const PERCEPTION: &str = "tests/tests/faults/perception.rs";
const TIME: &str = "tests/tests/faults/time.rs";
const TRANSPORT: &str = "tests/tests/faults/transport.rs";
const PROCESS: &str = "tests/tests/faults/process.rs";
const CONFIGURATION: &str = "tests/tests/faults/configuration.rs";
const BORDER: &str = "fitmac-capi/tests/border.rs";
const BORDER_TESTS: [&str; 1] = ["fault_rows_of_the_border_hold_under_address_sanitizer"];

macro_rules! faults {
    ($($row:ident $fault:literal => $reaction:literal in $file:expr, $tests:expr;)+) => {
        /// Every fault, by row.
        pub const FAULTS: &[Fault] = &[$(Fault {
            row: stringify!($row),
            fault: $fault,
            reaction: $reaction,
            file: $file,
            tests: &$tests,
        },)+];
    };
}

faults! {
    A1 "it never starts, or dies" => "no motion before the first chunk; hold when the queue is empty and the answer late, then a latched stop" in POLICY, ["a1_a_policy_that_never_starts_moves_nothing", "a1_a_killed_policy_is_a_hold_and_then_a_stop"];
    A2 "it stalls" => "hold until it answers" in POLICY, ["a2_a_stalled_policy_is_a_hold_until_it_answers"];
    A3 "its chunk is late" => "dropped; hold for want of a good one, then asked again" in POLICY, ["a3_a_late_chunk_is_dropped"];
    A4 "its chunk comes unasked" => "dropped, the queue is played on" in POLICY, ["a4_a_chunk_that_nobody_asked_for_is_dropped"];
    A5 "its chunks are repeated or permuted" => "a repeated one is dropped; wrong numbers are refused, two are a hold, twenty a stop" in POLICY, ["a5_a_repeated_chunk_is_dropped", "a5_permuted_chunks_are_refused_and_then_stop"];
    A6 "its chunk is too long" => "refused whole; two are a hold, twenty a stop" in POLICY, ["a6_a_chunk_that_is_too_long_is_refused"];
    A7 "its chunk is empty" => "refused; two are a hold, twenty a stop" in POLICY, ["a7_an_empty_chunk_is_refused"];
    A8 "a number is not finite" => "refused whole; two are a hold, twenty a stop" in POLICY, ["a8_a_chunk_with_a_nan_is_refused_whole"];
    A9 "a number is out of range" => "clamped and flagged, or refused, as the parameters say" in POLICY, ["a9_an_action_out_of_range_is_clamped_and_flagged", "a9_or_its_chunk_is_refused"];
    A10 "it declares another convention" => "refused; two are a hold, twenty a stop" in POLICY, ["a10_another_convention_is_refused", "a10_an_unknown_convention_is_refused"];
    A11 "it answers for another epoch or subtask" => "dropped; hold for want of a good one, then asked again" in POLICY, ["a11_a_chunk_of_another_epoch_is_dropped", "a11_a_chunk_of_another_subtask_is_dropped"];
    A12 "its chunk comes from the future" => "refused; two are a hold, twenty a stop" in POLICY, ["a12_a_chunk_from_the_future_is_refused"];
    A13 "it restarts" => "told apart by its session: its first chunk is not used, the queue is void, then it goes on" in POLICY, ["a13_a_restarted_policy_is_told_apart_and_goes_on"];
    A14 "it repeats itself" => "a warning; evidence of a stall counts as always" in POLICY, ["a14_a_frozen_policy_is_noticed"];
    B1 "samples cease" => "hold, then a latched stop" in PERCEPTION, ["b1_a_state_that_ceases_is_a_hold_and_then_a_stop"];
    B2 "a number is not finite" => "sample refused; its age is a hold" in PERCEPTION, ["b2_a_nan_in_the_state_is_refused"];
    B3 "the end effector jumps" => "five samples dropped, then believed, and nothing is compared across the jump" in PERCEPTION, ["b3_a_jump_is_dropped_and_then_believed"];
    B4 "an orientation is none" => "sample refused; its age is a hold" in PERCEPTION, ["b4_an_orientation_that_is_none_is_refused"];
    B5 "the target is lost" => "the recovery ends, the base policy acts" in PERCEPTION, ["b5_a_lost_target_ends_the_recovery"];
    B6 "the detector flaps between instances" => "the lock stays" in PERCEPTION, ["b6_a_detector_that_flaps_does_not_move_the_lock"];
    B7 "no candidate is the target" => "no recovery, the base policy acts" in PERCEPTION, ["b7_without_a_target_the_base_policy_acts"];
    B8 "the gripper closes on nothing" => "seen by its width; opened and tried again" in PERCEPTION, ["b8_an_empty_grasp_is_seen_and_tried_again"];
    B9 "the gripper's width is no number" => "sample refused; its age is a hold" in PERCEPTION, ["b9_a_gripper_that_measures_nothing_is_refused"];
    B10 "the grounding is withdrawn in mid-recovery" => "the recovery ends, the base policy acts" in PERCEPTION, ["b10_a_grounding_that_is_withdrawn_ends_the_recovery"];
    B11 "the destination is lost in transport" => "the recovery ends, the base policy acts" in PERCEPTION, ["b11_a_destination_that_is_lost_ends_the_transport"];
    B12 "lengths are in millimetres" => "sample refused as implausible; its age is a hold" in PERCEPTION, ["b12_millimetres_are_refused"];
    B13 "the target is out of the workspace" => "no waypoint leads there: the recovery ends, the base policy acts" in PERCEPTION, ["b13_a_target_out_of_the_workspace_is_not_followed"];
    C1 "the wall clock leaps" => "nothing: it is never read" in TIME, ["c1_a_leaping_wall_clock_changes_nothing"];
    C2 "time stands still or runs backwards" => "a warning; nothing advances" in TIME, ["c2_time_that_stands_or_runs_backwards_advances_nothing"];
    C3 "ticks overrun" => "periods are skipped and counted, never caught up; more than twenty in a row are a stop" in TIME, ["c3_missed_periods_are_skipped_and_never_caught_up"];
    C4 "a signal ends the sleep" => "no tick comes early" in TIME, ["c4_signals_make_no_tick_early"];
    C5 "sequence numbers wrap" => "nothing: they compare with wrapping" in TIME, ["c5_numbers_that_wrap_are_numbers"];
    C6 "the controller is suspended" => "the robot stops by itself; the controller stops when it wakes, until a reset" in TIME, ["c6_a_suspended_controller_stops_when_it_wakes"];
    D1 "the robot applies no command" => "hold until it does" in TRANSPORT, ["d1_a_robot_that_applies_nothing_is_a_hold"];
    D2 "a listener hangs" => "nothing: a sender never waits" in TRANSPORT, ["d2_a_listener_that_hangs_delays_nobody"];
    D3 "a second controller starts" => "it is refused; the first goes on" in TRANSPORT, ["d3_a_second_controller_is_refused"];
    D4 "a service carries another type" => "refused at the start, by name" in TRANSPORT, ["d4_another_type_is_refused_at_the_start"];
    D5 "a sender has another version" => "dropped unread and counted; the age is a hold" in TRANSPORT, ["d5_another_version_is_dropped_unread"];
    D6 "a peer is killed" => "hold; it may come back" in TRANSPORT, ["d6_a_killed_robot_may_come_back"];
    D7 "shared memory is removed" => "who is connected stays so; who drops out is a hold" in TRANSPORT, ["d7_removed_shared_memory_ends_in_a_hold_at_the_latest"];
    D8 "there is too little shared memory" => "refused at the start, with what it needs and how to get it; all of it is taken before the first tick" in TRANSPORT, ["d8_too_little_shared_memory_is_refused_by_name"];
    D9 "a foreign process writes into messages" => "each is copied once and checked on the copy: nothing unsound comes out" in TRANSPORT, ["d9_a_foreign_writer_gets_nothing_unsound_through"];
    D10 "a hostile process sends broken offsets" => "not defended: shared memory is for processes that trust each other; put a socket between you and others" in TRANSPORT, [];
    D11 "another user opens the files" => "refused by the system: only their owner may" in TRANSPORT, ["d11_only_their_owner_may_open_the_files"];
    D12 "a message is read while it is written" => "never: it is sent whole" in TRANSPORT, ["d12_a_message_is_never_torn"];
    E1 "the controller is killed" => "the robot stops by itself; the next run resumes nothing" in PROCESS, ["e1_a_killed_controller_is_safe_and_starts_afresh"];
    E2 "it is asked to end" => "a controlled stop, a last command, a whole trace; a second signal ends it at once" in PROCESS, ["e2_a_termination_is_a_controlled_stop_and_a_whole_trace", "e2_a_second_signal_ends_at_once"];
    E3 "it crashes" => "the robot stops by itself, as if it had been killed" in PROCESS, ["e3_a_crashed_controller_is_safe"];
    E4 "memory cannot be locked" => "refused by name, unless --allow-non-rt" in PROCESS, ["e4_memory_that_cannot_be_locked_is_refused_by_name"];
    E5 "real-time priority is not allowed" => "refused by name, unless --allow-non-rt" in PROCESS, ["e5_a_priority_that_is_not_allowed_is_refused_by_name"];
    E6 "the disk is full" => "the trace ends and says so; the loop goes on, and what is not recorded is counted" in PROCESS, ["e6_a_full_disk_ends_the_trace_and_not_the_loop"];
    E7 "no more files may be opened, or the trace is removed" => "nothing: all is open since the start" in PROCESS, ["e7_the_loop_needs_no_file_that_is_not_open"];
    E8 "the C interface gets bad arguments" => "a status, never a crash" in BORDER, BORDER_TESTS;
    E9 "it is called from two threads at once" => "a status, never a race" in BORDER, BORDER_TESTS;
    E10 "the host changes the floating-point mode" => "seen and reported; a tick computes in the core's own mode" in BORDER, BORDER_TESTS;
    E11 "the host forks" => "the handle is void in the child" in BORDER, BORDER_TESTS;
    E12 "another process is pinned to the control core" => "skipped periods are counted and reported, not prevented: give the policy other cores" in PROCESS, ["e12_whoever_takes_the_control_core_shows_in_the_counts"];
    F1 "a key is unknown, a type is wrong" => "refused by name" in CONFIGURATION, ["f1_an_unknown_key_is_refused_by_name", "f1_a_wrong_type_is_refused_by_name"];
    F2 "values are out of range" => "refused, all named at once" in CONFIGURATION, ["f2_every_value_out_of_range_is_named_at_once"];
    F3 "the file is too large or too deep" => "refused" in CONFIGURATION, ["f3_a_file_that_is_too_large_is_refused", "f3_a_file_that_is_nested_too_deeply_is_refused"];
    F4 "a robot description leads out of its folder" => "refused by name" in "kinematics/src/urdf/tests.rs", ["paths_that_leave_their_package_are_refused"];
    F5 "a model answers what is not asked" => "held to a schema; else the rules decide" in "fitmac-agents/src/planner/tests.rs", ["a_models_answer_is_held_to_the_schema"];
    F6 "a label gives orders to the model" => "it stays data: a model may only choose among candidates" in "fitmac-agents/src/model/tests.rs", ["the_resolver_chooses_among_candidates_only", "a_label_that_gives_orders_stays_data"];
    F7 "a label holds control characters" => "refused by name" in CONFIGURATION, ["f7_a_label_with_control_characters_is_refused"];
    F8 "labels are equal" => "ids are the keys, never labels" in "fitmac-agents/src/model/tests.rs", ["the_resolver_chooses_among_candidates_only"];
    F9 "a trace file is damaged or cut off" => "read up to the damage, and says so" in "fitmac-rt/tests/trace.rs", ["a_truncated_file_is_read_up_to_its_end_and_says_so", "a_flipped_bit_never_passes_and_never_panics"];
    F10 "the configuration changes in mid-run" => "nothing: a controller reads its parameters once, and its trace holds them" in CONFIGURATION, ["f10_a_file_that_changes_in_mid_run_changes_nothing"];
}

/// What was measured of a reaction. Times are of the machine that measured;
/// tests never judge them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reaction {
    /// From the fault to the reaction, ms.
    pub after_ms: f64,
    /// How far the arm got until it stood, m.
    pub stop_m: Option<f64>,
}

impl Reaction {
    /// Writes it to a file of the test's name in the folder that
    /// `FITMAC_FAULTS` names, if it does.
    ///
    /// # Panics
    /// If it cannot be written.
    pub fn note(&self, test: &str) {
        let Some(folder) = std::env::var_os("FITMAC_FAULTS") else {
            return;
        };
        let file = Path::new(&folder).join(format!("{test}.json"));
        let text = serde_json::to_string(self).expect("two numbers");
        fs::write(&file, text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    }
}

/// One run's measurements.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The machine, and when.
    pub run: String,
    /// By test.
    pub reactions: BTreeMap<String, Reaction>,
}

impl Measured {
    /// Gathers what the tests of one run have written to `folder`.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn gather(run: String, folder: &Path) -> io::Result<Self> {
        let mut reactions = BTreeMap::new();
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let reaction = serde_json::from_slice(&fs::read(&path)?)?;
            reactions.insert(name.into_owned(), reaction);
        }
        Ok(Self { run, reactions })
    }
}

/// Where the page stands.
pub const PAGE: &str = "docs/faults.md";
/// Where the times of the page stand.
pub const MEASURED: &str = "tests/data/faults.json";

/// The page: every fault with its reaction, and what was measured.
///
/// # Panics
/// If the measurements cannot be read.
#[must_use]
pub fn page() -> String {
    let file = workspace_root().join(MEASURED);
    let text = fs::read(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let measured = serde_json::from_slice(&text);
    page_of(&measured.unwrap_or_else(|e| panic!("{}: {e}", file.display())))
}

fn page_of(measured: &Measured) -> String {
    let mut page = format!(
        "# Faults\n\n\
         What can fail, how the system reacts, and how long it takes. Made by `cargo xtask docs` \
         from `tests/src/faults.rs`; the times by `cargo xtask faults`.\n\n\
         Each test runs `fitmac rt` as a process and checks the reaction, a bound on how far \
         the arm gets, and that no file is left; some loosen a threshold of the default \
         parameters, so that a busy machine does not interfere. A row without a test names \
         what is not defended. Times are those of one run ({}): they tell the \
         order of magnitude. A stop of ours is a request: the robot's own safety functions \
         stay in the robot.\n",
        measured.run
    );
    for (letter, title) in SECTIONS {
        let _ = write!(
            page,
            "\n## {letter}. {title}\n\n\
             | | fault | reaction | after | arm moves | test |\n|---|---|---|---|---|---|\n"
        );
        for fault in FAULTS.iter().filter(|f| f.row.starts_with(*letter)) {
            row(&mut page, fault, measured);
        }
    }
    page
}

fn row(page: &mut String, fault: &Fault, measured: &Measured) {
    let Fault {
        row,
        fault,
        reaction,
        file,
        tests,
    } = fault;
    let of = |test: &&str| measured.reactions.get(*test);
    let first = tests.iter().find_map(of);
    let after = first.map_or("-".into(), |r| match r.after_ms {
        ms if ms < 0.05 => "-".to_owned(),
        ms if ms < 10.0 => format!("{ms:.1} ms"),
        ms => format!("{ms:.0} ms"),
    });
    let moves = tests
        .iter()
        .filter_map(of)
        .filter_map(|r| r.stop_m)
        .reduce(f64::max)
        .map_or("-".into(), |m| format!("{:.1} mm", m * 1000.0));
    let names: Vec<String> = tests.iter().map(|t| format!("`{t}`")).collect();
    let shown = if names.is_empty() {
        "-".to_owned()
    } else {
        format!("[{}](../{file})", names.join(", "))
    };
    let _ = writeln!(
        page,
        "| {row} | {fault} | {reaction} | {after} | {moves} | {shown} |"
    );
}
