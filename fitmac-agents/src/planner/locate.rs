//! From places to relations with named references.

use super::attach::{self, Roles};
use super::compose::Composer;
use super::confidence::Doubt;
use super::lexicon;
use super::phrase::{Name, Noun, Place};
use super::types::{Action, Relation, SpatialPhrase};

impl<'a> Composer<'a> {
    pub(super) fn source(&mut self, roles: &Roles<'a>) -> Result<Option<SpatialPhrase>, Doubt> {
        self.phrase(roles.source.as_ref(), roles.source_qualifier.as_ref())
    }

    pub(super) fn destination(
        &mut self,
        roles: &Roles<'a>,
    ) -> Result<(SpatialPhrase, &'a str), Doubt> {
        let place = roles.destination.as_ref().ok_or(Doubt::Incomplete)?;
        if place.negated {
            return Err(Doubt::Unsupported("not".to_owned()));
        }
        let phrase = self.phrase(Some(place), roles.destination_qualifier.as_ref())?;
        Ok((phrase.ok_or(Doubt::Incomplete)?, place.preposition))
    }

    fn phrase(
        &mut self,
        place: Option<&Place<'a>>,
        qualifier: Option<&Place<'a>>,
    ) -> Result<Option<SpatialPhrase>, Doubt> {
        let Some(place) = place else { return Ok(None) };
        let mut references = Vec::with_capacity(place.references.len());
        for noun in &place.references {
            references.push(match noun {
                Noun::Name(name) if plural_stem(name).is_some() => {
                    return Err(Doubt::Unsupported(name.text.clone()));
                }
                Noun::Name(name) => name.text.clone(),
                Noun::It => self.antecedent(place)?,
                Noun::Them => return Err(Doubt::Incomplete),
            });
        }
        // "Put the bowl inside": in what was mentioned last.
        if references.is_empty() && place.relation == Some(Relation::In) {
            references.push(self.mentions.last().ok_or(Doubt::Incomplete)?.clone());
        }
        let relation = attach::settled_relation(place, &references, &mut self.doubts)?;
        let centre_of_all = relation == Relation::AtCentre && references.is_empty();
        if centre_of_all {
            references.push("table".to_owned());
        }
        if references.len() != relation.arity() {
            return Err(Doubt::Incomplete);
        }
        let qualifier = self.phrase(qualifier, None)?.map(Box::new);
        Ok(Some(SpatialPhrase {
            relation,
            negated: place.negated,
            references,
            qualifier,
        }))
    }

    /// The object that "it" stands for in a place: the fixture that was just
    /// opened or turned on. Elsewhere "behind it" has two readings.
    fn antecedent(&self, place: &Place<'a>) -> Result<String, Doubt> {
        let settled = match self.subtasks.last().map(|last| last.action) {
            Some(Action::Open | Action::TurnOn | Action::TurnOff) => true,
            Some(_) => matches!(place.relation, Some(Relation::In)),
            None => false,
        };
        let last = self
            .mentions
            .last()
            .filter(|_| settled && self.held.is_empty());
        last.cloned()
            .ok_or_else(|| Doubt::Unsupported("it".to_owned()))
    }
}

/// The singular of a name whose head is a plural of the vocabulary.
pub(super) fn plural_stem(name: &Name) -> Option<String> {
    let object = name.text.split(" of ").next()?;
    let head = object.split(" with ").next()?.rsplit(' ').next()?;
    if lexicon::is_vocabulary_noun(head) {
        return None;
    }
    let stem = lexicon::singular(head).filter(|stem| lexicon::is_vocabulary_noun(stem))?;
    Some(name.text.replacen(head, stem, 1))
}
