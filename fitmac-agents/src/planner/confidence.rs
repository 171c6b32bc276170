//! What makes a parse doubtful, and by how much.

use serde::Serialize;

/// A reason to trust a parse less.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Doubt {
    /// The head of a name isn't in the vocabulary.
    UnknownNoun(String),
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
    /// A pronoun that could only be guessed.
    PronounGuess,
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

impl Doubt {
    /// Factor on the confidence, in (0, 1]. A reading that is only the
    /// likelier of two ends between [`super::UNDERSTOOD`] and
    /// [`super::SURE`]; what the grammar doesn't cover ends below both.
    #[must_use]
    pub fn factor(&self) -> f64 {
        match self {
            Self::UnknownModifier(_) => 0.97,
            Self::NoVerb => 0.88,
            Self::UnknownNoun(_) => 0.75,
            Self::ModelDisagrees => 0.7,
            Self::PronounGuess | Self::RelationGuess => 0.6,
            Self::AmbiguousAttachment => 0.55,
            Self::AmbiguousList => 0.45,
            Self::Unsupported(_) | Self::Unparsed(_) => 0.15,
            Self::Incomplete | Self::TooManySteps => 0.2,
        }
    }
}

/// Confidence of a parse with nothing against it.
const CLEAN: f64 = 0.98;

/// Confidence of a parse with these doubts, in (0, 1).
#[must_use]
pub fn confidence(doubts: &[Doubt]) -> f64 {
    let mut value = CLEAN;
    let mut unknown = 0_u32;
    let mut verbless = false;
    for doubt in doubts {
        value *= doubt.factor();
        unknown += u32::from(matches!(
            doubt,
            Doubt::UnknownNoun(_) | Doubt::UnknownModifier(_)
        ));
        verbless |= *doubt == Doubt::NoVerb;
    }
    // A verb is what tells an instruction from any other language.
    if verbless && unknown > 0 {
        value * 0.4
    } else {
        value
    }
}
