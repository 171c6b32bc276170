//! The planner's words.

use std::collections::{BTreeSet, HashMap};
use std::sync::LazyLock;

use super::lexer::{Direction, Verb};
use super::types::Relation;
use super::vocabulary::{COLOURS, COMPOUNDS, CONTAINERS, MODIFIERS, NOUNS, REGIONS, SURFACES};

/// Meaning of a phrase.
#[derive(Clone, Copy, Debug)]
pub(super) enum Entry {
    Verb(Verb),
    Prep(Option<Relation>, Direction),
    /// A place without a reference; only where the phrase ends.
    Place(Relation),
    /// "Towards": to, but how far is left open.
    Towards,
    Determiner,
    Of,
    Possessive,
    Not,
    Relative,
    Goes,
    Want,
    Both,
    And,
    Then,
    Comma,
    Stop,
    It,
    Them,
    Unsupported,
    /// Politeness, adverbs and particles: dropped.
    Skip,
}

/// Phrases by meaning, separated by `|`; longer phrases win.
const TABLE: &[(Entry, &str)] = {
    use Direction::{From, Static, To};
    use Entry as E;
    use Relation as R;
    &[
        (
            E::Verb(Verb::Pick),
            "pick up|pick|pick out|grab|grasp|grip|take|take hold of|get hold of|fetch|retrieve|collect|lift|lift up|raise|hold|seize|remove",
        ),
        (E::Verb(Verb::Get), "get"),
        (E::Verb(Verb::Find), "find|locate|select|choose|identify"),
        (
            E::Verb(Verb::Place),
            "place|put|set|lay|rest|drop|deposit|release|lower|stand|position|store|stow|add|load|toss|insert|pack|stack|arrange|return|hang|mount|fit|place back|put back|dump|slot|park|tuck|plop|situate|put down|set down|place down|lay down|drop off|throw|chuck|plunk|pop",
        ),
        (
            E::Verb(Verb::Move),
            "move|transfer|shift|bring|carry|relocate|transport|deliver|pick and place|haul",
        ),
        (E::Verb(Verb::Leave), "leave|keep"),
        (E::Verb(Verb::Slide), "slide"),
        (E::Verb(Verb::Push), "push|shove|nudge"),
        (E::Verb(Verb::Open), "open|pull open|open up"),
        (E::Verb(Verb::Close), "close|shut|push closed"),
        (E::Verb(Verb::TurnOn), "turn on|switch on|power on"),
        (E::Verb(Verb::TurnOff), "turn off|switch off|power off"),
        (E::Verb(Verb::Turn), "turn|switch"),
        (
            E::Prep(Some(R::On), Static),
            "on|upon|atop|right on|straight on|right on top of|on top of|on the top of|back on|on to the top of|at the top of",
        ),
        (
            E::Prep(Some(R::On), To),
            "onto|on to|over onto|back onto|right onto|straight onto|right on to|straight on to|to the top of|onto the top of|onto top of",
        ),
        (
            E::Prep(Some(R::On), From),
            "off|off of|off from|from on|from atop|from on top of|from the top of|off the top of|from top of",
        ),
        (
            E::Prep(Some(R::In), Static),
            "in|inside|inside of|within|back in|on the inside of|right in|straight in|right inside",
        ),
        (
            E::Prep(Some(R::In), To),
            "into|back into|to the inside of|right into|straight into",
        ),
        (
            E::Prep(Some(R::In), From),
            "out of|from inside|from inside of|from within|from in|out from|from out of",
        ),
        (E::Prep(None, To), "to|over to|back to|straight to"),
        (E::Towards, "toward|towards"),
        (E::Prep(None, From), "from|away off"),
        (E::Prep(None, Static), "at"),
        (
            E::Prep(Some(R::NextTo), Static),
            "next to|beside|near|near to|close to|by|adjacent to|alongside|to the side of|at the side of|by the side of|right next to|nearby|right beside|immediately next to",
        ),
        (
            E::Prep(Some(R::NextTo), From),
            "from next to|from beside|from near|from the side of",
        ),
        (
            E::Prep(Some(R::Between), Static),
            "between|in between|in the middle between",
        ),
        (
            E::Prep(Some(R::Between), From),
            "from between|from in between",
        ),
        (
            E::Prep(Some(R::LeftOf), Static),
            "left of|to the left of|on the left of|at the left of|on the left side of|to the left side of|at the left side of|on the left hand side of",
        ),
        (
            E::Prep(Some(R::LeftOf), From),
            "from the left of|from the left side of",
        ),
        (
            E::Prep(Some(R::RightOf), Static),
            "right of|to the right of|on the right of|at the right of|on the right side of|to the right side of|at the right side of|on the right hand side of",
        ),
        (
            E::Prep(Some(R::RightOf), From),
            "from the right of|from the right side of",
        ),
        (
            E::Prep(Some(R::InFrontOf), Static),
            "in front of|to the front of|at the front of|on the front of|before the front of|on the front side of",
        ),
        (
            E::Prep(Some(R::InFrontOf), From),
            "from the front of|from in front of",
        ),
        (
            E::Prep(Some(R::Behind), Static),
            "behind|in back of|at the back of|to the back of|to the rear of|at the rear of|in the rear of|on the back side of",
        ),
        (
            E::Prep(Some(R::Behind), From),
            "from behind|from the back of",
        ),
        (
            E::Prep(Some(R::AtCentre), Static),
            "at the center of|at the centre of|in the center of|in the centre of|in the middle of|at the middle of|on the center of|on the centre of|on the middle of|to the center of|to the centre of|to the middle of",
        ),
        (
            E::Prep(Some(R::AtCentre), From),
            "from the center of|from the centre of|from the middle of",
        ),
        (
            E::Prep(Some(R::Under), Static),
            "under|underneath|beneath|below",
        ),
        (
            E::Prep(Some(R::Under), From),
            "from under|from underneath|from beneath|from below",
        ),
        (
            E::Prep(Some(R::NearestTo), Static),
            "nearest|nearest to|closest|closest to",
        ),
        (
            E::Prep(Some(R::FarthestFrom), Static),
            "farthest from|furthest from|farthest away from|furthest away from",
        ),
        (
            E::Place(R::AtLeft),
            "on the left|at the left|to the left|on the left side|on the left hand side|from the left",
        ),
        (
            E::Place(R::AtRight),
            "on the right|at the right|to the right|on the right side|on the right hand side|from the right",
        ),
        (E::Place(R::AtFront), "at the front|in the front|in front"),
        (E::Place(R::AtBack), "at the back|in the back|at the rear"),
        (
            E::Place(R::AtCentre),
            "in the middle|at the center|at the centre|in the center|in the centre|from the center|from the centre|from the middle",
        ),
        (E::Determiner, "the|a|an|this|these|those|some|my|our|that"),
        (E::Of, "of"),
        (E::Possessive, "'s"),
        (
            E::Not,
            "not|isn't|is not|wasn't|aren't|doesn't|does not|'s not|that isn't|that is not|that 's not|which isn't|which is not|which 's not|that does not|that doesn't|which does not|which doesn't|that are not|that was not",
        ),
        (
            E::Relative,
            "thats|that is|that 's|which is|which 's|that was|which was|that are|which are|that sits|which sits|that stands|that lies|that rests|that has been|located|situated|sitting|standing|lying|resting|placed|positioned|found|kept|sit|sits|stands|lies|rests|currently|which|stored|lie|being",
        ),
        (
            E::Goes,
            "goes|go|should go|must go|needs to go|has to go|ought to go|is to go|belongs|should be put|should be placed|should be moved|should be set|must be put|must be placed|must be moved|needs to be put|needs to be placed|needs to be moved|has to be put|has to be placed|has to be moved|to be put|to be placed|to be moved|is to be put|is to be placed|is to be moved|should end up",
        ),
        (
            E::Want,
            "i want|i need|i would like|i 'd like|i'd like|we need|we want|make sure|make sure that|ensure|ensure that|i wish",
        ),
        (E::Both, "both|both of"),
        (E::And, "and|&"),
        (
            E::Then,
            "then|after that|afterwards|next|and then|and next|and after that|and afterwards|finally|lastly|secondly|and finally",
        ),
        (E::Comma, ","),
        (E::Stop, ".|;|!|?"),
        (E::It, "it"),
        (
            E::Them,
            "them|them both|both of them|them all|they|these two",
        ),
        (
            E::Unsupported,
            "eleven|twelve|hundred|thrice|your|more|most|less|fewer|enough|extra|half|few|couple|pair|dozen|lot|lots|bit|grandma|grandpa|mom|mum|dad|someone|somebody|everyone|anyone|human|person|people|user|yourselves|the rest|the others|the remaining|its|own|non|yourself|myself|itself|hand|hands|arm|arms|finger|fingers|or|if|unless|until|while|before|after|when|once|don't|do not|do|never|everything|anything|nothing|something|all|every|each|any|two|three|four|five|six|seven|eight|nine|ten|several|many|except|without|instead|same|where|what|who|whose|why|how|other|another|else|neither|nor|either|ignore|disregard|forget|me|us|him|her|you|i|away|there|here|one|ones|first|second|third|fourth|last|again|avoid|rid|but|because|so|not the|rather|twice|as|for|about|against|through|along|around|across|above|than|is|are|was|be|been|will|would|can't|cannot|won't|shouldn't|no|only|whichever|wherever|putting|placing|picking|moving|taking|holding",
        ),
        (
            E::Skip,
            "please|kindly|could you|could you please|can you|can you please|would you|would you please|will you|you should|you must|you need to|you have to|i want you to|i need you to|i would like you to|i 'd like you to|i'd like you to|we need you to|your task is to|your job is to|your goal is to|the task is to|the goal is to|task|robot|hey robot|dear robot|now|let 's|go and|make the robot|have the robot|get the robot to|tell the robot to|the robot should|the robot must|use the gripper to|use your gripper to|use the robot to|use the arm to|use the robot arm to|with the gripper|what action should the robot take to|what should the robot do to|try to|ok|okay|gently|carefully|quickly|slowly|softly|simply|just|safely|directly|precisely|firmly|neatly|up|down|over there|right here|for me|also|hey|firstly|to start",
        ),
    ]
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
