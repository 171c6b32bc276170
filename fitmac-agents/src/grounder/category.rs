//! Does a label fit a name? Synonyms, packaging, colours, brands.

/// Words that mean the same; the first one stands for all.
const SYNONYMS: &[&[&str]] = &[
    &["bbq", "barbecue"],
    &["black", "dark"],
    &["can", "tin"],
    &["mug", "cup", "teacup"],
    &["pan", "frypan", "skillet"],
    &["stove", "burner", "cooker", "hob", "cooktop"],
    &["cabinet", "cupboard"],
    &["bin", "trash", "garbage", "wastebasket"],
    &["fridge", "refrigerator"],
    &["cookie", "cookies", "biscuit", "biscuits"],
    &["gray", "grey"],
    &["ramekin", "ramequin"],
    &["pudding", "puddings"],
    &["carton", "pack", "packet"],
    &["juice", "juices"],
    &["yellow", "golden", "gold"],
    &["wooden", "wood"],
    &["wicker", "woven"],
    &["table", "desk", "tabletop", "worktop", "counter", "floor"],
    &["soup", "soups"],
];

const COLOURS: &str =
    "black white red green blue yellow orange purple pink brown gray silver beige";

/// Names that fit every object.
const ANYTHING: &[&str] = &["object", "item", "thing"];

/// Kinds of packaging, with the products that LIBERO's shelf packs in them.
const PACKAGING: &[(&str, &[&str])] = &[
    (
        "can",
        &["soup", "tomato sauce", "tuna", "coke", "soda", "beer"],
    ),
    (
        "bottle",
        &["ketchup", "bbq sauce", "salad dressing", "wine", "water"],
    ),
    ("carton", &["milk", "orange juice"]),
    (
        "box",
        &[
            "cream cheese",
            "butter",
            "chocolate pudding",
            "cookie",
            "macaroni",
            "popcorn",
        ],
    ),
    ("stick", &["butter"]),
    ("jar", &["jam", "honey"]),
];

/// Sizes and sides: they rank candidates and name no category.
const RANKING: &str = "left right leftmost rightmost front back rear middle center centre central \
    largest biggest large big huge smallest small little tiny tallest tall shortest short nearest";

/// A name or label, split into canonical words.
#[derive(Clone, Debug, PartialEq)]
pub struct Words<'a> {
    words: Vec<&'a str>,
}

impl<'a> Words<'a> {
    /// Splits `text`, which must be in lower case.
    #[must_use]
    pub fn of(text: &'a str) -> Self {
        let is_article = |word: &&str| !matches!(*word, "the" | "a" | "an" | "of" | "with" | "and");
        let is_number = |word: &&str| !word.bytes().all(|byte| byte.is_ascii_digit());
        let words = text
            .split(|c: char| !c.is_alphanumeric())
            .filter(|word| !word.is_empty())
            .filter(is_article)
            .filter(is_number)
            .map(canonical)
            .collect();
        Self { words }
    }

    fn has(&self, word: &str) -> bool {
        self.words.contains(&word)
    }

    fn has_all(&self, phrase: &str) -> bool {
        phrase.split(' ').all(|word| self.has(word))
    }

    /// The words that rank candidates rather than name them.
    pub fn ranking(&self) -> impl Iterator<Item = &'a str> {
        self.words
            .iter()
            .copied()
            .filter(|word| is_in(RANKING, word))
    }
}

fn canonical(word: &str) -> &str {
    SYNONYMS
        .iter()
        .find(|group| group.contains(&word))
        .map_or(word, |group| group[0])
}

fn is_in(list: &str, word: &str) -> bool {
    list.split_ascii_whitespace().any(|entry| entry == word)
}

/// Probability-like score that an object with this label and colour is meant
/// by the name, in [0, 1]. All texts in lower case.
#[must_use]
pub fn fit(name: &Words<'_>, label: &Words<'_>, colour: Option<&str>) -> f64 {
    let wanted: Vec<&str> = name
        .words
        .iter()
        .copied()
        .filter(|word| !is_in(RANKING, word))
        .collect();
    let Some(head) = wanted.last() else {
        return 0.5;
    };
    let kind = if ANYTHING.contains(head) {
        0.8
    } else {
        kind_fit(&wanted, label)
    };
    if kind == 0.0 {
        return 0.0;
    }
    let colour_score = colour_fit(&wanted, label, colour);
    // Words of the label that the name doesn't have set products apart:
    // "tomato sauce" isn't "bbq sauce".
    let extra =
        |word: &&str| !is_in(COLOURS, word) && !is_packaging(word) && !is_in(MATERIALS, word);
    let name_only = wanted
        .iter()
        .filter(|word| extra(word) && !label.has(word))
        .count();
    let label_only = label
        .words
        .iter()
        .filter(|word| extra(word) && !wanted.contains(word))
        .count();
    let product = match (name_only, label_only) {
        (0, _) => 1.0,
        // A brand, or a word that the detector doesn't use.
        (_, 0) => 0.85,
        (_, _) if ANYTHING.contains(head) => 1.0,
        (_, _) if packed_kind(head, label) => 1.0,
        (_, _) => 0.1,
    };
    kind * colour_score * product
}

const MATERIALS: &str =
    "wooden metal plastic glass ceramic porcelain wicker akita flat glazed rim plain round new";

fn is_packaging(word: &str) -> bool {
    PACKAGING.iter().any(|(kind, _)| *kind == word)
}

/// True if the name ends in a packaging, as in "large can".
#[must_use]
pub fn is_packed(name: &str) -> bool {
    name.rsplit(' ')
        .next()
        .is_some_and(|head| is_packaging(canonical(head)))
}

/// True if `head` is a packaging, and the label a product that comes in it.
fn packed_kind(head: &str, label: &Words<'_>) -> bool {
    PACKAGING
        .iter()
        .any(|(kind, products)| *kind == head && products.iter().any(|p| label.has_all(p)))
}

/// Whether the kinds agree, colours and brands aside.
fn kind_fit(wanted: &[&str], label: &Words<'_>) -> f64 {
    let name = Words {
        words: wanted.to_vec(),
    };
    // The head is the last word that isn't packaging, unless there is no other.
    let content = wanted
        .iter()
        .rev()
        .find(|word| !is_packaging(word) && !is_in(COLOURS, word));
    match content {
        Some(head) if label.has(head) => 1.0,
        // "Heinz ketchup bottle" for "ketchup": all of the label is in the name.
        Some(_)
            if label
                .words
                .iter()
                .all(|word| name.has(word) || is_packaging(word))
                && label
                    .words
                    .iter()
                    .any(|word| name.has(word) && !is_in(COLOURS, word)) =>
        {
            0.9
        }
        Some(_) if wanted.last().is_some_and(|last| is_packaging(last)) => {
            let last = wanted[wanted.len() - 1];
            // "Tall yellow carton": modifiers before the packaging.
            let known = wanted[..wanted.len() - 1]
                .iter()
                .all(|word| is_in(COLOURS, word) || is_in(MATERIALS, word));
            if known && (label.has(last) || packed_kind(last, label)) {
                0.9
            } else {
                0.0
            }
        }
        Some(_) => 0.0,
        None => {
            let packaging = wanted.iter().rev().find(|word| is_packaging(word));
            match packaging {
                Some(kind) if label.has(kind) || packed_kind(kind, label) => 0.9,
                _ => 0.0,
            }
        }
    }
}

fn colour_fit(wanted: &[&str], label: &Words<'_>, seen: Option<&str>) -> f64 {
    let seen = seen.map(canonical);
    let mut score = 1.0;
    // "Orange juice" and "chocolate pudding" aren't colours.
    let named = wanted
        .windows(2)
        .filter(|pair| pair != &["orange", "juice"])
        .map(|pair| pair[0]);
    for colour in named.filter(|word| is_in(COLOURS, word)) {
        let labelled = label.words.iter().any(|word| is_in(COLOURS, word));
        score *= if label.has(colour) || seen == Some(colour) {
            1.0
        } else if labelled || seen.is_some() {
            0.08
        } else {
            0.7
        };
    }
    score
}
