//! The planner's words.

use std::collections::{BTreeSet, HashMap};
use std::sync::LazyLock;

use super::table::{Entry, TABLE};
use super::vocabulary::{
    COLOURS, COMPOUNDS, CONTAINERS, FIXED, MODIFIERS, NOUNS, REGIONS, SURFACES,
};

type Phrases = Vec<(Vec<&'static str>, Entry)>;

struct Lexicon {
    phrases: HashMap<&'static str, Phrases>,
    surfaces: HashMap<Vec<&'static str>, &'static str>,
    words: HashMap<&'static str, Word>,
    known: BTreeSet<&'static str>,
}

#[derive(Clone, Copy, Default)]
struct Word {
    noun: bool,
    modifier: bool,
    container: bool,
    colour: bool,
}

static LEXICON: LazyLock<Lexicon> = LazyLock::new(|| {
    let mut phrases: HashMap<&str, Phrases> = HashMap::new();
    let mut surfaces = HashMap::new();
    for (entry, list) in TABLE {
        for text in list.split('|') {
            let parts: Vec<&str> = text.split(' ').collect();
            surfaces.insert(parts.clone(), text);
            phrases.entry(parts[0]).or_default().push((parts, *entry));
        }
    }
    for list in phrases.values_mut() {
        list.sort_by_key(|(parts, _)| std::cmp::Reverse(parts.len()));
    }
    let mut words: HashMap<&str, Word> = HashMap::new();
    for noun in NOUNS.split(' ') {
        words.entry(noun).or_default().noun = true;
    }
    for modifier in MODIFIERS.split(' ') {
        words.entry(modifier).or_default().modifier = true;
    }
    for container in CONTAINERS.split(' ') {
        words.entry(container).or_default().container = true;
    }
    for colour in COLOURS.split(' ') {
        words.entry(colour).or_default().colour = true;
    }
    let regions = REGIONS.split(' ');
    let parts = phrases.values().flatten().flat_map(|(parts, _)| parts);
    let known = parts.chain(words.keys()).copied().chain(regions).collect();
    Lexicon {
        known,
        phrases,
        surfaces,
        words,
    }
});

/// Phrases that begin with `word`, longest first.
pub(super) fn phrases(word: &str) -> &'static [(Vec<&'static str>, Entry)] {
    LEXICON.phrases.get(word).map_or(&[], Vec::as_slice)
}

/// A phrase of the table as one text.
pub(super) fn surface(phrase: &[&'static str]) -> &'static str {
    LEXICON.surfaces.get(phrase).copied().unwrap_or_default()
}

/// True if the planner has the word in any place.
pub(super) fn is_known(text: &str) -> bool {
    LEXICON.known.contains(text) || singular(text).is_some_and(|stem| LEXICON.known.contains(stem))
}

/// All words that the planner has in any place, each once.
pub(super) fn known_words() -> impl Iterator<Item = &'static str> {
    LEXICON.known.iter().copied()
}

/// True if a place without a reference may end before this word.
pub(super) fn ends_place(word: &str) -> bool {
    phrases(word).iter().any(|(parts, entry)| {
        parts.len() == 1
            && matches!(
                entry,
                Entry::And
                    | Entry::Comma
                    | Entry::Stop
                    | Entry::Then
                    | Entry::Prep(..)
                    | Entry::Towards
                    | Entry::Verb(_)
                    | Entry::Skip
            )
    })
}

fn word(text: &str) -> Word {
    LEXICON.words.get(text).copied().unwrap_or_default()
}

/// True if the vocabulary has `text` as the head of a name, singular or plural.
pub(super) fn is_noun(text: &str) -> bool {
    word(text).noun || singular(text).is_some_and(|stem| word(stem).noun)
}

/// True if the vocabulary lists `text` itself as a noun.
pub(super) fn is_vocabulary_noun(text: &str) -> bool {
    word(text).noun
}

/// True if the vocabulary has `text` as a part of a name.
pub(super) fn is_modifier(text: &str) -> bool {
    let word = word(text);
    word.modifier || word.noun
}

/// True if `text` is a colour.
pub(super) fn is_colour(text: &str) -> bool {
    word(text).colour
}

/// True if things go *into* an object with this name.
pub(super) fn is_container(name: &str) -> bool {
    let object = name.split(" of ").next().unwrap_or(name);
    let head = object.rsplit(' ').next().unwrap_or(object);
    word(head).container || is_open_box(name)
}

/// True if things may equally be on or in an object with this name.
pub(super) fn is_open_box(name: &str) -> bool {
    matches!(name, "box" | "tray" | "bowl")
}

/// True if the name is a region of an object, as in "the top of the ramekin".
pub(super) fn is_region(name: &str) -> bool {
    let head = name.rsplit(' ').next().unwrap_or(name);
    REGIONS.split(' ').any(|region| region == head)
}

/// True if the name is one object although it has "and" in it.
pub(super) fn is_compound(name: &str) -> bool {
    COMPOUNDS.contains(&name)
}

/// The singular of a regular plural.
pub(super) fn singular(text: &str) -> Option<&str> {
    let stem = text
        .strip_suffix('s')
        .filter(|stem| !stem.ends_with('s') && stem.len() > 2)?;
    match stem.strip_suffix('e') {
        Some(short)
            if ["sh", "ch", "x", "ss"]
                .iter()
                .any(|end| short.ends_with(end)) =>
        {
            Some(short)
        }
        _ => Some(stem),
    }
}

/// True if an object with this name can be opened and closed.
pub(super) fn is_closable(name: &str) -> bool {
    has_head(
        name,
        &[
            "drawer",
            "door",
            "microwave",
            "cabinet",
            "box",
            "oven",
            "fridge",
            "refrigerator",
            "lid",
            "jar",
            "bottle",
            "bag",
            "book",
            "container",
            "cupboard",
            "wardrobe",
            "dresser",
            "cap",
            "cover",
            "carton",
            "laptop",
            "bin",
            "umbrella",
        ],
    )
}

/// True if an object with this name is part of the house.
pub(super) fn is_fixed(name: &str) -> bool {
    has_head(name, FIXED)
}

/// True if "to" an object with this name is onto it.
pub(super) fn is_surface(name: &str) -> bool {
    has_head(name, SURFACES)
}

/// True if an object with this name can be turned on and off.
pub(super) fn is_switchable(name: &str) -> bool {
    has_head(
        name,
        &[
            "stove",
            "burner",
            "lamp",
            "oven",
            "microwave",
            "kettle",
            "toaster",
            "light",
            "cooker",
            "phone",
            "laptop",
            "screen",
            "speaker",
            "camera",
            "remote",
        ],
    )
}

/// True if the vocabulary has the head of the name.
pub(super) fn has_known_head(name: &str) -> bool {
    let object = name.split(" of ").next().unwrap_or(name);
    is_noun(object.rsplit(' ').next().unwrap_or(object))
}

fn has_head(name: &str, heads: &[&str]) -> bool {
    let object = name.split(" of ").next().unwrap_or(name);
    heads.contains(&object.rsplit(' ').next().unwrap_or(object))
}
