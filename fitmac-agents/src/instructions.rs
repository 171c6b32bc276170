//! Instructions with their ground truth: what the planner was tuned on, and
//! what was held back.
//!
//! The sets are files of the crate's `data` folder, described there. A line
//! that starts with `#` is a remark.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use serde::Deserialize;

use crate::planner::{
    Action, Doubt, Experience, PartKind, SURE, SpatialPhrase, Subtask, TaskPlan, plan, read_text,
};

/// Sentences that the rules and the confidence were made with.
pub const USED: &str = include_str!("../data/used.jsonl");

/// Sentences that were written with their truth before the planner was run on
/// them, and that led to no correction.
pub const FRESH: &str = include_str!("../data/held-out.jsonl");

/// What the planner should make of a sentence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Expect {
    /// The steps of the case, and nothing else.
    Steps,
    /// Outside the language: the base policy keeps its own path.
    Refuse,
    /// Several readings are equally good: none may be reported as sure.
    Unsure,
}

/// A step of the truth.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// What is done.
    pub action: Action,
    /// To which object.
    pub target: String,
    /// Where that object is, if the sentence says so.
    #[serde(default)]
    pub source: Option<SpatialPhrase>,
    /// Where it goes, if the sentence says so.
    #[serde(default)]
    pub destination: Option<SpatialPhrase>,
}

impl Step {
    fn is(&self, step: &Subtask) -> bool {
        self.action == step.action
            && self.target == step.target
            && self.source == step.source
            && self.destination == step.destination
    }
}

/// A sentence with its truth.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Its number.
    pub id: u32,
    /// Its group: one of LIBERO's suites, or paraphrases.
    pub suite: String,
    /// When it was written, and for what.
    pub origin: String,
    /// The sentence as typed.
    pub text: String,
    /// What should come of it.
    pub expect: Expect,
    /// The truth where `expect` is [`Expect::Steps`].
    #[serde(default)]
    pub steps: Vec<Step>,
}

impl Case {
    /// True if the steps of `read` are the truth's.
    #[must_use]
    pub fn reads(&self, read: &[Subtask]) -> bool {
        self.expect == Expect::Steps
            && self.steps.len() == read.len()
            && self
                .steps
                .iter()
                .zip(read)
                .all(|(truth, step)| truth.is(step))
    }

    /// What the planner made of it.
    ///
    /// # Panics
    /// If the sentence is empty or longer than the planner reads.
    #[must_use]
    pub fn judge(&self) -> Judged<'_> {
        let plan = plan(&self.text).expect("a sentence that can be read");
        let right = match self.expect {
            Expect::Steps => self.reads(&plan.subtasks) && plan.understood(),
            Expect::Refuse => !plan.understood(),
            Expect::Unsure => plan.confidence < SURE,
        };
        Judged {
            case: self,
            holds: plan.understood() && self.reads(&plan.subtasks),
            plan,
            right,
        }
    }
}

/// A case with the planner's answer.
#[derive(Clone, Debug)]
pub struct Judged<'a> {
    /// The case.
    pub case: &'a Case,
    /// The answer.
    pub plan: TaskPlan,
    /// True if the answer is what should come of the sentence.
    pub right: bool,
    /// True if the answer is a plan, and the truth's.
    pub holds: bool,
}

/// Reads a set.
///
/// # Errors
/// Names the line.
pub fn read(set: &str) -> Result<Vec<Case>, String> {
    set.lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'))
        .map(|(number, line)| {
            serde_json::from_str(line).map_err(|error| format!("line {}: {error}", number + 1))
        })
        .collect()
}

/// The counts behind the planner's confidence, as the source of `learned.rs`.
#[must_use]
pub fn learn(cases: &[Case]) -> String {
    let mut doubts: BTreeMap<&'static str, Experience> = BTreeMap::new();
    let mut places: BTreeMap<[PartKind; 3], Experience> = BTreeMap::new();
    for case in cases {
        let reading = read_text(&case.text);
        let Some(subtasks) = &reading.subtasks else {
            continue;
        };
        let halves = match case.expect {
            Expect::Steps => 2 * u16::from(case.reads(subtasks)),
            Expect::Refuse => 0,
            Expect::Unsure => 1,
        };
        let count = |experience: &mut Experience| {
            experience.halves += halves;
            experience.total += 1;
        };
        let mut names: BTreeSet<_> = reading.doubts.iter().filter_map(Doubt::name).collect();
        // The graver doubt explains the unknown noun.
        if reading.doubts.contains(&Doubt::NothingKnown) {
            names = BTreeSet::from_iter(Doubt::NothingKnown.name());
        }
        names
            .into_iter()
            .for_each(|name| count(doubts.entry(name).or_default()));
        let seen: BTreeSet<[PartKind; 3]> = reading
            .shape
            .windows(3)
            .filter_map(|place| place.try_into().ok())
            .collect();
        // A doubt has its own count: what it explains isn't the shape's fault.
        if halves > 0 || reading.doubts.is_empty() {
            seen.into_iter()
                .for_each(|place| count(places.entry(place).or_default()));
        }
    }
    let mut out = String::from(LEARNED_HEAD);
    for (name, Experience { halves, total }) in doubts {
        let _ = writeln!(out, "    (\"{name}\", {halves}, {total}),");
    }
    out.push_str(LEARNED_MIDDLE);
    for ([a, b, c], Experience { halves, total }) in places {
        let _ = writeln!(
            out,
            "    ([K::{a:?}, K::{b:?}, K::{c:?}], {halves}, {total}),"
        );
    }
    out.push_str("];\n");
    out
}

const LEARNED_HEAD: &str = "\
//! What the used instructions taught: printed by
//! `cargo run -p fitmac-agents --example instructions -- fit`.

use super::shape::Kind as K;

/// Doubts: name, read right (in halves), read at all.
pub(super) const DOUBTS: &[(&str, u16, u16)] = &[
";

const LEARNED_MIDDLE: &str = "];

/// Three parts in a row: the parts, read right (in halves), read at all.
#[rustfmt::skip]
pub(super) const PLACES: &[([K; 3], u16, u16)] = &[
";
