//! Names and places: the phrases of a clause.

use super::confidence::Doubt;
use super::lexer::{Direction, Item};
use super::lexicon;
use super::types::Relation;

/// What a clause names.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Noun {
    Name(Name),
    It,
    Them,
}

/// An object's name without articles.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Name {
    pub(super) text: String,
    /// It had an article of its own.
    pub(super) determined: bool,
}

/// A prepositional phrase.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Place<'a> {
    pub(super) relation: Option<Relation>,
    pub(super) direction: Direction,
    /// The preposition as written.
    pub(super) preposition: &'a str,
    pub(super) negated: bool,
    /// Marked as saying where the object is ("that is on the stove").
    pub(super) marked: bool,
    pub(super) references: Vec<Noun>,
}

impl Place<'_> {
    /// A place in a plain phrase, that may say where something is or goes.
    pub(super) fn says_plainly(&self) -> bool {
        self.direction == Direction::Static && !self.marked
    }
}

/// A part of a clause.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Element<'a> {
    /// One name or a list, and whether "both" stood before it.
    Names(Vec<Noun>, bool),
    Place(Place<'a>),
    /// "And" between two complete groups.
    Break,
}

/// Reads a clause from left to right and collects doubts.
pub(super) struct Reader<'i, 'a> {
    items: &'i [Item<'a>],
    at: usize,
    pub(super) doubts: Vec<Doubt>,
}

impl<'i, 'a> Reader<'i, 'a> {
    pub(super) fn new(items: &'i [Item<'a>]) -> Self {
        Self {
            items,
            at: 0,
            doubts: Vec::new(),
        }
    }

    pub(super) fn peek(&self) -> Option<&'i Item<'a>> {
        self.items.get(self.at)
    }

    fn peek_after(&self, offset: usize) -> Option<&'i Item<'a>> {
        self.items.get(self.at + offset)
    }

    pub(super) fn advance(&mut self) {
        self.at += 1;
    }

    /// Parts up to a verb, a "goes" or the end of the clause.
    pub(super) fn elements(&mut self) -> Result<Vec<Element<'a>>, Doubt> {
        let mut elements = Vec::new();
        while let Some(item) = self.peek() {
            match item {
                Item::Determiner | Item::Word(_) | Item::It | Item::Them | Item::Both => {
                    let (names, both) = self.names()?;
                    elements.push(Element::Names(names, both));
                }
                Item::Prep { .. } | Item::Not | Item::Relative => {
                    elements.push(Element::Place(self.place()?));
                }
                Item::And | Item::Comma | Item::Then => self.connector(&mut elements)?,
                Item::Verb(..) | Item::Goes => break,
                Item::Unsupported(word) => return Err(Doubt::Unsupported((*word).to_owned())),
                Item::Of | Item::Possessive | Item::Want | Item::Stop | Item::Filler => {
                    return Err(Doubt::Unparsed(format!("{item:?}")));
                }
            }
        }
        Ok(elements)
    }

    /// The parts before the unsupported word that stopped [`Self::elements`].
    pub(super) fn reread_before_unsupported(&mut self) -> Result<Vec<Element<'a>>, Doubt> {
        let end = self.at;
        let mut before = Reader::new(&self.items[..end]);
        if before.peek() == Some(&Item::Want) {
            before.advance();
        }
        before.elements()
    }

    fn connector(&mut self, elements: &mut Vec<Element<'a>>) -> Result<(), Doubt> {
        let joins = self.peek() != Some(&Item::Comma);
        self.advance();
        match self.peek() {
            Some(Item::Determiner | Item::Word(_) | Item::Both) if !elements.is_empty() => {
                elements.push(Element::Break);
                Ok(())
            }
            Some(Item::And | Item::Then | Item::Comma) => Ok(()),
            // "..., on the plate": a comma between a name and its place.
            Some(Item::Prep { .. } | Item::Relative) if !joins => Ok(()),
            None if !joins => Ok(()),
            _ => Err(Doubt::Unparsed("and".to_owned())),
        }
    }

    /// A name or a list of names.
    fn names(&mut self) -> Result<(Vec<Noun>, bool), Doubt> {
        let both = self.peek() == Some(&Item::Both);
        if both {
            self.advance();
        }
        let mut names = vec![self.noun()?];
        let mut joined = false;
        while let Some(skip) = self.list_connector() {
            joined |= (0..skip).any(|at| self.peek_after(at) != Some(&Item::Comma));
            self.at += skip;
            if self.peek() == Some(&Item::Both) {
                self.advance();
            }
            names.push(self.noun()?);
        }
        if !joined && names.len() > 1 {
            // "The milk, the white carton": the same thing twice?
            self.doubts.push(Doubt::AmbiguousList);
        }
        if !both {
            self.check_list(&names);
        }
        Ok((names, both))
    }

    /// Connectors to skip if another name follows.
    fn list_connector(&self) -> Option<usize> {
        let mut skip = 0;
        while matches!(
            self.peek_after(skip),
            Some(Item::And | Item::Comma | Item::Then)
        ) {
            skip += 1;
        }
        let name_follows = matches!(
            self.peek_after(skip),
            Some(Item::Determiner | Item::Word(_))
        );
        (skip > 0 && name_follows).then_some(skip)
    }

    /// "The salt and pepper shaker" may be one object; three names are a list.
    fn check_list(&mut self, names: &[Noun]) {
        let determined = |noun: &Noun| matches!(noun, Noun::Name(name) if name.determined);
        if let [one, other] = names
            && determined(one)
            && !determined(other)
        {
            self.doubts.push(Doubt::AmbiguousList);
        }
    }

    pub(super) fn noun(&mut self) -> Result<Noun, Doubt> {
        match self.peek() {
            Some(Item::It) => {
                self.advance();
                Ok(Noun::It)
            }
            Some(Item::Them) => {
                self.advance();
                Ok(Noun::Them)
            }
            _ => self.name().map(Noun::Name),
        }
    }

    fn name(&mut self) -> Result<Name, Doubt> {
        let mut determined = false;
        while self.peek() == Some(&Item::Determiner) {
            determined = true;
            self.advance();
        }
        let mut text = self.words()?;
        match self.peek() {
            Some(Item::Of) => {
                self.advance();
                let whole = self.name()?;
                check_part(&text)?;
                if !lexicon::is_noun(text.rsplit(' ').next().unwrap_or(&text)) {
                    // "A picture of the plate".
                    return Err(Doubt::Unparsed(text));
                }
                text.push_str(" of ");
                text.push_str(&whole.text);
            }
            Some(Item::Possessive) => {
                self.advance();
                let part = self.name()?;
                check_part(&part.text)?;
                text = format!("{} of {text}", part.text);
            }
            _ => {}
        }
        Ok(Name { text, determined })
    }

    /// Plain words, joined over an "and" that belongs to the name.
    fn words(&mut self) -> Result<String, Doubt> {
        let mut words: Vec<&str> = Vec::new();
        loop {
            match self.peek() {
                Some(Item::Word(word)) => words.push(word),
                Some(Item::And) if self.joins_name(&words) => words.push("and"),
                _ => break,
            }
            self.advance();
        }
        let head = match words.iter().position(|word| *word == "with") {
            Some(0) | None => words.last(),
            Some(at) => words.get(at - 1),
        };
        let Some(head) = head.copied() else {
            return Err(Doubt::Incomplete);
        };
        if lexicon::is_colour(head) && !lexicon::is_noun(head) {
            return Err(Doubt::Incomplete);
        }
        if !lexicon::is_noun(head) {
            self.doubts.push(
                if words.iter().any(|word| lexicon::is_vocabulary_noun(word)) {
                    Doubt::TrailingWord(head.to_owned())
                } else {
                    Doubt::UnknownNoun(head.to_owned())
                },
            );
        }
        for word in words
            .iter()
            .filter(|word| **word != head && **word != "and")
        {
            if !lexicon::is_modifier(word) {
                self.doubts.push(Doubt::UnknownModifier((*word).to_owned()));
            }
        }
        Ok(words.join(" "))
    }

    /// At an "and": true for "yellow and white mug" and "macaroni and cheese".
    fn joins_name(&self, words: &[&str]) -> bool {
        let (Some(last), Some(Item::Word(next))) = (words.last(), self.peek_after(1)) else {
            return false;
        };
        let more = matches!(self.peek_after(2), Some(Item::Word(_)));
        (lexicon::is_colour(last) && lexicon::is_colour(next) && more)
            || lexicon::is_compound(&format!("{last} and {next}"))
    }

    fn place(&mut self) -> Result<Place<'a>, Doubt> {
        let (mut negated, mut marked) = (false, false);
        loop {
            match self.peek() {
                Some(Item::Not) => {
                    if negated {
                        return Err(Doubt::Unsupported("not".to_owned()));
                    }
                    (negated, marked) = (true, true);
                }
                Some(Item::Relative) => marked = true,
                _ => break,
            }
            self.advance();
        }
        let Some(&Item::Prep {
            relation,
            direction,
            text,
        }) = self.peek()
        else {
            return Err(Doubt::Unparsed("that".to_owned()));
        };
        self.advance();
        let mut place = Place {
            relation,
            direction,
            preposition: text,
            negated,
            marked,
            references: vec![],
        };
        let wanted = relation.map_or(1, Relation::arity);
        while place.references.len() < wanted && self.starts_noun() {
            place.references.push(self.noun()?);
            if place.references.len() < wanted && self.peek() == Some(&Item::And) {
                self.advance();
            }
        }
        settle_centre(&mut place);
        for noun in &place.references {
            // "On its side", "by the handle": a part of what?
            if let Noun::Name(name) = noun
                && !name.text.contains(" of ")
                && lexicon::is_region(&name.text)
            {
                return Err(Doubt::Unsupported(name.text.clone()));
            }
        }
        if relation == Some(Relation::Between) && place.references.len() < 2 {
            return Err(Doubt::Incomplete);
        }
        Ok(place)
    }

    fn starts_noun(&self) -> bool {
        matches!(
            self.peek(),
            Some(Item::Determiner | Item::Word(_) | Item::It | Item::Them)
        )
    }
}

/// "The top of the ramekin" is no object that could be found or held.
fn check_part(part: &str) -> Result<(), Doubt> {
    if lexicon::is_region(part) {
        Err(Doubt::Unsupported(part.to_owned()))
    } else {
        Ok(())
    }
}

/// "From table center" is a place of the table, not an object.
fn settle_centre(place: &mut Place<'_>) {
    if !matches!(place.relation, None | Some(Relation::On | Relation::In)) {
        return;
    }
    let [Noun::Name(name)] = place.references.as_mut_slice() else {
        return;
    };
    let centre = [" center", " centre", " middle"];
    if let Some(table) = centre.iter().find_map(|end| name.text.strip_suffix(end)) {
        name.text = table.to_owned();
        place.relation = Some(Relation::AtCentre);
    }
}
