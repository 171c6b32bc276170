//! Words and multi-word phrases of an instruction.

use super::confidence::Doubt;
use super::lexicon;
use super::spelling;
use super::table::Entry;
use super::types::Relation;

/// Way in which a preposition points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    /// Says where something is: "on".
    Static,
    /// Says where something goes: "onto".
    To,
    /// Says where something comes from: "off".
    From,
}

/// Class of a verb.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verb {
    Pick,
    /// A pick that may say more: "get the milk in the basket", "hold the door".
    Get,
    /// "Find": names the object for a later clause, and is no step by itself.
    Find,
    Place,
    Move,
    /// "Leave it in the basket": places what is held; of anything else it says
    /// not to touch it.
    Leave,
    /// "Slide": a push along the support or a move into a container.
    Slide,
    Push,
    Open,
    Close,
    TurnOn,
    TurnOff,
    /// "Turn ... on", "switch ... off": decided by the particle.
    Turn,
}

/// A unit of the grammar.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Item<'a> {
    Verb(Verb, &'a str),
    /// `None` leaves the relation to the reference: in for a container, else on.
    Prep {
        relation: Option<Relation>,
        direction: Direction,
        text: &'a str,
    },
    Word(&'a str),
    Determiner,
    Of,
    Possessive,
    Not,
    /// "that is", "located": what follows says where the object is.
    Relative,
    /// "goes", "should be placed": what follows says where the object goes.
    Goes,
    /// "I want", "make sure".
    Want,
    Both,
    And,
    Then,
    Comma,
    Stop,
    It,
    Them,
    /// A word that says nothing here: "please", "up". The parser doesn't see it.
    Filler,
    /// A word that the grammar must not skip.
    Unsupported(&'a str),
}

/// The preposition that leaves open how far.
pub(super) const TOWARDS: &str = "towards";

/// Longest instruction that is read, bytes.
pub(super) const TEXT_CAP: usize = 1024;

/// Lower-case words and punctuation, separated by spaces. Hyphens and
/// typographic apostrophes are normalised and the possessive is split off.
pub(super) fn normalise(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        match c {
            '\u{2019}' | '\'' => out.push('\''),
            ',' | ';' | '.' | ':' | '!' | '?' => {
                out.push(' ');
                out.push(if c == ':' { ',' } else { c });
                out.push(' ');
            }
            c if c.is_alphanumeric() => out.extend(c.to_lowercase()),
            '"' | '\u{201c}' | '\u{201d}' | '-' | '_' => out.push(' '),
            c if c.is_whitespace() => out.push(' '),
            // Anything else is no part of an instruction; a control character
            // becomes a word that nothing matches.
            _ => out.push_str(" \u{fffd} "),
        }
    }
    if out.contains("'s") {
        out.replace("'s", " 's")
    } else {
        out
    }
}

/// The items of a normalised text.
pub(super) fn items<'a>(text: &'a str, doubts: &mut Vec<Doubt>) -> Vec<Item<'a>> {
    let mut words: Vec<&str> = text.split_ascii_whitespace().collect();
    for word in &mut words {
        if !lexicon::is_known(word)
            && let Some(meant) = spelling::meant(word)
        {
            doubts.push(Doubt::Spelling((*word).to_owned(), meant));
            *word = meant;
        }
    }
    let mut items = Vec::with_capacity(words.len());
    let mut at = 0;
    while let Some(rest) = words.get(at..).filter(|rest| !rest.is_empty()) {
        let at_start = items.iter().all(|item| *item == Item::Filler);
        let after_determiner = matches!(items.last(), Some(Item::Determiner));
        let (item, used) = next_item(rest, after_determiner, at_start);
        items.push(item);
        at += used;
    }
    let asks = text.contains('?') && !items.contains(&Item::Filler);
    if asks {
        // A question, unless it is a polite request.
        doubts.push(Doubt::Unsupported("?".to_owned()));
    }
    items
}

/// The item at the head of `words`, and the words it takes.
fn next_item<'a>(words: &[&'a str], after_determiner: bool, at_start: bool) -> (Item<'a>, usize) {
    let first = words[0];
    for (phrase, entry) in lexicon::phrases(first) {
        if !matches(words, phrase) {
            continue;
        }
        let used = phrase.len();
        let next = words.get(used).copied();
        let item = match *entry {
            // After an article a verb is a noun: "the stand", "the rest".
            Entry::Verb(_) if after_determiner => continue,
            Entry::Verb(verb) => Item::Verb(verb, first),
            Entry::Prep(relation, direction) => Item::Prep {
                relation,
                direction,
                text: lexicon::surface(phrase),
            },
            Entry::Place(_) if next.is_some_and(|word| !lexicon::ends_place(word)) => continue,
            Entry::Place(relation) => Item::Prep {
                relation: Some(relation),
                direction: Direction::Static,
                text: lexicon::surface(phrase),
            },
            Entry::Towards => Item::Prep {
                relation: None,
                direction: Direction::To,
                text: TOWARDS,
            },
            Entry::Determiner => Item::Determiner,
            Entry::Of => Item::Of,
            Entry::Possessive => Item::Possessive,
            Entry::Not => Item::Not,
            Entry::Relative => Item::Relative,
            Entry::Goes if at_start => continue,
            Entry::Goes => Item::Goes,
            Entry::Want => Item::Want,
            Entry::Both => Item::Both,
            Entry::And => Item::And,
            Entry::Then => Item::Then,
            Entry::Comma => Item::Comma,
            Entry::Stop => Item::Stop,
            Entry::It => Item::It,
            Entry::Them => Item::Them,
            // "First put the milk ...": an order that the words keep anyway.
            Entry::Unsupported if first == "first" && !after_determiner => Item::Filler,
            Entry::Unsupported => Item::Unsupported(lexicon::surface(phrase)),
            Entry::Skip if after_determiner => continue,
            Entry::Skip => Item::Filler,
        };
        return (item, used);
    }
    let item = if first.bytes().all(|byte| byte.is_ascii_digit()) {
        Item::Unsupported(first)
    } else {
        Item::Word(first)
    };
    (item, 1)
}

fn matches(words: &[&str], phrase: &[&str]) -> bool {
    words.len() >= phrase.len() && words.iter().zip(phrase).all(|(word, part)| word == part)
}
