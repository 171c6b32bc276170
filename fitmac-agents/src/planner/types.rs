//! What an instruction means: subtasks, relations, confidence.

use serde::{Deserialize, Serialize};

use super::confidence::Doubt;

/// Most subtasks of a plan; the controller holds no more.
pub const SUBTASK_CAPACITY: usize = 8;

/// A spatial relation of an object to its references.
///
/// `Left` and `Right` are seen by a declared viewer (see
/// [`crate::grounder::Viewpoint`]); the rest doesn't depend on one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Relation {
    /// Supported by the reference.
    On,
    /// Contained by the reference.
    In,
    /// Beside the reference.
    NextTo,
    /// Between two references.
    Between,
    /// To the viewer's left of the reference.
    LeftOf,
    /// To the viewer's right of the reference.
    RightOf,
    /// On the viewer's side of the reference.
    InFrontOf,
    /// On the far side of the reference.
    Behind,
    /// At the middle of the reference, usually a table.
    AtCentre,
    /// Below the reference.
    Under,
    /// Of all candidates, the one with the least distance to the reference.
    NearestTo,
    /// Of all candidates, the one with the greatest distance to the reference.
    FarthestFrom,
    /// Of all candidates, the leftmost; no reference.
    AtLeft,
    /// Of all candidates, the rightmost; no reference.
    AtRight,
    /// Of all candidates, the one nearest the viewer; no reference.
    AtFront,
    /// Of all candidates, the one farthest from the viewer; no reference.
    AtBack,
}

impl Relation {
    /// The words that a canonical instruction uses.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::On => "on",
            Self::In => "in",
            Self::NextTo => "next to",
            Self::Between => "between",
            Self::LeftOf => "to the left of",
            Self::RightOf => "to the right of",
            Self::InFrontOf => "in front of",
            Self::Behind => "behind",
            Self::AtCentre => "at the centre of",
            Self::Under => "under",
            Self::NearestTo => "nearest to",
            Self::FarthestFrom => "farthest from",
            Self::AtLeft => "on the left",
            Self::AtRight => "on the right",
            Self::AtFront => "at the front",
            Self::AtBack => "at the back",
        }
    }

    /// References that the relation needs.
    #[must_use]
    pub fn arity(self) -> usize {
        match self {
            Self::Between => 2,
            Self::AtLeft | Self::AtRight | Self::AtFront | Self::AtBack => 0,
            _ => 1,
        }
    }
}

/// A relation with its references, as in "not between the plate and the ramekin".
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpatialPhrase {
    /// The relation.
    pub relation: Relation,
    /// True if the object must *not* stand in this relation.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub negated: bool,
    /// Names of the references without articles, `relation.arity()` of them;
    /// a part is written `top drawer of cabinet`.
    pub references: Vec<String>,
    /// Says which reference object is meant, as in "the plate next to the stove".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub qualifier: Option<Box<SpatialPhrase>>,
}

impl SpatialPhrase {
    /// The phrase in canonical words, as in "not next to the ramekin".
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = String::with_capacity(48);
        if self.negated {
            text.push_str("not ");
        }
        text.push_str(self.relation.words());
        for (index, name) in self.references.iter().enumerate() {
            text.push_str(if index > 0 { " and the " } else { " the " });
            text.push_str(name);
        }
        if let Some(qualifier) = &self.qualifier {
            text.push(' ');
            text.push_str(&qualifier.text());
        }
        text
    }
}

/// What a subtask asks the robot to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    /// Grasp an object and release it at a destination.
    PickAndPlace,
    /// Grasp and lift an object.
    Pick,
    /// Push an object along its support.
    Push,
    /// Open a drawer, door or lid.
    Open,
    /// Close a drawer, door or lid.
    Close,
    /// Turn an appliance on.
    TurnOn,
    /// Turn an appliance off.
    TurnOff,
    /// Not understood: the instruction is left to the base policy as it stands.
    Unknown,
}

impl Action {
    /// True if picking and placing are the whole of the action, so that the
    /// monitor's phases and the recovery apply; all else stays with the policy.
    #[must_use]
    pub fn is_pick_place(self) -> bool {
        matches!(self, Self::PickAndPlace | Self::Pick)
    }
}

/// One step of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Subtask {
    /// The step as a canonical sentence; the original words if not understood.
    pub text: String,
    /// What to do.
    pub action: Action,
    /// Name of the object to act on without articles; empty if not understood.
    pub target: String,
    /// Where the target is, if the instruction says so.
    pub source: Option<SpatialPhrase>,
    /// Where it goes, if the instruction says so.
    pub destination: Option<SpatialPhrase>,
    /// The preposition of the destination as written, as in "onto"; else empty.
    pub destination_prep: String,
}

/// An instruction, parsed.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskPlan {
    /// The instruction in canonical words.
    pub canonical_instruction: String,
    /// One to [`SUBTASK_CAPACITY`] steps in order, at the instruction's own
    /// granularity.
    pub subtasks: Vec<Subtask>,
    /// Probability that all targets, relations and destinations are right, in
    /// [0, 1]. Below [`UNDERSTOOD`] the plan is one [`Action::Unknown`] step.
    pub confidence: f64,
    /// What lowered the confidence.
    pub doubts: Vec<Doubt>,
}

/// Least confidence at which a parse is used.
pub const UNDERSTOOD: f64 = 0.5;

/// Confidence above which a parse needs no second opinion.
pub const SURE: f64 = 0.8;

impl TaskPlan {
    /// The plan that leaves the instruction to the base policy.
    #[must_use]
    pub fn unknown(instruction: &str, confidence: f64, doubts: Vec<Doubt>) -> Self {
        let text = instruction.trim().to_owned();
        Self {
            canonical_instruction: text.clone(),
            subtasks: vec![Subtask {
                text,
                action: Action::Unknown,
                target: String::new(),
                source: None,
                destination: None,
                destination_prep: String::new(),
            }],
            confidence,
            doubts,
        }
    }

    /// True if the parse may be acted on.
    #[must_use]
    pub fn understood(&self) -> bool {
        self.confidence >= UNDERSTOOD
    }
}

/// The name with its article, as a canonical sentence uses it.
pub(super) fn canonical_sentence(subtask: &Subtask) -> String {
    let mut text = String::with_capacity(96);
    text.push_str(match subtask.action {
        Action::PickAndPlace | Action::Pick => "pick up the ",
        Action::Push => "push the ",
        Action::Open => "open the ",
        Action::Close => "close the ",
        Action::TurnOn => "turn on the ",
        Action::TurnOff => "turn off the ",
        Action::Unknown => "",
    });
    text.push_str(&subtask.target);
    if let Some(source) = &subtask.source {
        text.push(' ');
        text.push_str(&source.text());
    }
    if let Some(destination) = &subtask.destination {
        let verb = if subtask.action == Action::PickAndPlace {
            " and place it "
        } else {
            " "
        };
        text.push_str(verb);
        text.push_str(&destination.text());
    }
    text
}
