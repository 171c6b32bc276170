//! What makes a parse doubtful, and by how much.
//!
//! The rule: of the used instructions (`data/used.jsonl`) that were read with
//! the same doubt, or with the same three parts of speech in a row, how many
//! were read right? A sentence with two equally good readings counts as half
//! right. `right` of `total` count as
//! `(right + 2 p) / (total + 2)`, where `p` is the share that a case without
//! any experience gets ([`UNTRIED`]): Laplace's rule of succession with a
//! cautious start. The confidence is [`CLEAN`] times the lesser of two: the
//! product over the doubts, and the share of the least familiar place. What was never seen
//! can't be sure, and what leaves two readings can't either, however often the
//! likelier one was right; an unknown word does, as it may be a slip.
//!
//! The counts in `learned.rs` are printed by `cargo run -p fitmac-agents
//! --example instructions -- fit`; a test holds them to the used set.

use std::collections::HashMap;
use std::sync::LazyLock;

use serde::Serialize;

use super::learned;
use super::shape::Kind;

/// A reason to trust a parse less.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Doubt {
    /// The head of a name isn't in the vocabulary.
    UnknownNoun(String),
    /// No name in the instruction is in the vocabulary: "close the deal".
    NothingKnown,
    /// A word that isn't in the vocabulary after one that is: "bowl upright".
    TrailingWord(String),
    /// A word was read as its neighbour in the vocabulary: what was written, how
    /// it was read.
    Spelling(String, &'static str),
    /// A modifier, often a brand, isn't in the vocabulary.
    UnknownModifier(String),
    /// A sentence without a verb.
    NoVerb,
    /// A phrase may belong to the object or to the place.
    AmbiguousAttachment,
    /// "The A and B" may be one object or two.
    AmbiguousList,
    /// "From the box" may be off it or out of it.
    RelationGuess,
    /// A word that leaves open whether more or less is wanted than it says: "get
    /// the milk in the basket", "I need the bowl on the stove".
    LooseVerb,
    /// Another step begins while an object is in the hand.
    HandFull,
    /// A pronoun that could only be guessed.
    PronounGuess,
    /// Parts in an order that was hardly ever seen, or was read wrong: its
    /// familiarity in percent.
    UnfamiliarShape(u8),
    /// A word that changes the meaning in a way that the grammar doesn't cover,
    /// such as "or", "unless", "all".
    Unsupported(String),
    /// Words that fit nowhere.
    Unparsed(String),
    /// A verb without the object or the place that it needs.
    Incomplete,
    /// More steps than a plan holds.
    TooManySteps,
    /// The model's answer and the rules' parse name different things.
    ModelDisagrees,
}

/// Confidence of a parse with nothing against it: nothing is certain.
pub(super) const CLEAN: f64 = 0.98;

/// Share of right readings assumed where nothing was seen. [`CLEAN`] times this
/// stays below [`super::SURE`].
pub(super) const UNTRIED: f64 = 0.75;

/// Confidence of a text that has no reading.
const NO_READING: f64 = 0.15;

/// Factor of a model's answer that the rules' reading contradicts.
const CONTRADICTED: f64 = 0.7;

/// Most that a doubt with two readings leaves: [`CLEAN`] times this stays below
/// [`super::SURE`].
const TWO_READINGS: f64 = 0.8;

/// How often something was read right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Experience {
    /// Read right, in halves.
    pub(crate) halves: u16,
    pub(crate) total: u16,
}

impl Experience {
    /// Share to be expected next time.
    fn expected(self) -> f64 {
        (f64::from(self.halves) / 2.0 + 2.0 * UNTRIED) / (f64::from(self.total) + 2.0)
    }
}

impl Doubt {
    /// Its name in [`learned`]; none where there is no reading to count.
    pub(crate) fn name(&self) -> Option<&'static str> {
        Some(match self {
            Self::UnknownNoun(_) => "unknown_noun",
            Self::NothingKnown => "nothing_known",
            Self::TrailingWord(_) => "trailing_word",
            Self::Spelling(..) => "spelling",
            Self::UnknownModifier(_) => "unknown_modifier",
            Self::NoVerb => "no_verb",
            Self::AmbiguousAttachment => "ambiguous_attachment",
            Self::AmbiguousList => "ambiguous_list",
            Self::RelationGuess => "relation_guess",
            Self::LooseVerb => "loose_verb",
            Self::HandFull => "hand_full",
            Self::PronounGuess => "pronoun_guess",
            Self::UnfamiliarShape(_)
            | Self::Unsupported(_)
            | Self::Unparsed(_)
            | Self::Incomplete
            | Self::TooManySteps
            | Self::ModelDisagrees => return None,
        })
    }

    /// Factor on the confidence, in (0, 1].
    #[must_use]
    pub fn factor(&self) -> f64 {
        let learned = || {
            let name = self.name();
            let row = learned::DOUBTS.iter().find(|row| Some(row.0) == name);
            row.map_or(Experience::default(), |row| Experience {
                halves: row.1,
                total: row.2,
            })
            .expected()
        };
        match self {
            Self::NoVerb | Self::TrailingWord(_) => learned(),
            Self::UnknownNoun(_)
            | Self::UnknownModifier(_)
            | Self::NothingKnown
            | Self::Spelling(..)
            | Self::AmbiguousAttachment
            | Self::AmbiguousList
            | Self::RelationGuess
            | Self::LooseVerb
            | Self::HandFull
            | Self::PronounGuess => learned().min(TWO_READINGS),
            Self::UnfamiliarShape(percent) => f64::from(*percent) / 100.0,
            Self::ModelDisagrees => CONTRADICTED,
            Self::Unsupported(_) | Self::Unparsed(_) | Self::Incomplete | Self::TooManySteps => {
                NO_READING
            }
        }
    }
}

static PLACES: LazyLock<HashMap<[Kind; 3], Experience>> = LazyLock::new(|| {
    let rows = learned::PLACES.iter();
    rows.map(|&(place, halves, total)| (place, Experience { halves, total }))
        .collect()
});

/// Familiarity of the least familiar place of a sentence, in (0, 1].
pub(super) fn familiarity(shape: &[Kind]) -> f64 {
    let places = shape
        .windows(3)
        .filter_map(|place| <[Kind; 3]>::try_from(place).ok());
    places
        .map(|place| PLACES.get(&place).copied().unwrap_or_default().expected())
        .fold(1.0, f64::min)
}

/// Confidence of a parse with these doubts, in (0, 1).
#[must_use]
pub fn confidence(doubts: &[Doubt]) -> f64 {
    let unknown = |doubt: &Doubt| {
        matches!(
            doubt,
            Doubt::UnknownNoun(_) | Doubt::UnknownModifier(_) | Doubt::Spelling(..)
        )
    };
    let shape = |doubt: &&Doubt| matches!(doubt, Doubt::UnfamiliarShape(_));
    let least = |value: f64, doubt: &Doubt| value.min(doubt.factor());
    let familiar = doubts.iter().filter(shape).fold(1.0, least);
    let others = doubts.iter().filter(|doubt| !shape(doubt));
    let product = familiar.min(others.map(Doubt::factor).product());
    // A verb is what tells an instruction from any other language.
    if doubts.contains(&Doubt::NoVerb) && doubts.iter().any(unknown) {
        CLEAN * product.min(NO_READING)
    } else {
        CLEAN * product
    }
}
