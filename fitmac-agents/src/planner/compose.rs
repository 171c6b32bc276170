//! From clauses to subtasks: pronouns, lists, and picks that a later clause
//! completes.

use super::attach::{self, Roles};
use super::clause::{Clause, Group};
use super::confidence::Doubt;
use super::lexer::Verb;
use super::lexicon;
use super::locate::plural_stem;
use super::phrase::{Noun, Place};
use super::types::{
    Action, Relation, SUBTASK_CAPACITY, SpatialPhrase, Subtask, canonical_sentence,
};

/// An object that was named and waits for its destination.
pub(super) struct Held {
    target: String,
    source: Option<SpatialPhrase>,
    /// "Get the milk in the basket" may already be the whole task.
    loose: bool,
    /// Named by a verb, so that it is a step of its own if nothing follows.
    picked: bool,
}

/// Builds the subtasks of an instruction clause by clause.
#[derive(Default)]
pub(super) struct Composer<'a> {
    pub(super) subtasks: Vec<Subtask>,
    pub(super) held: Vec<Held>,
    fronted: Option<Place<'a>>,
    /// A picked object was never put down.
    hand_full: bool,
    /// No clause follows.
    ended: bool,
    /// Names in the order in which they were mentioned.
    pub(super) mentions: Vec<String>,
    pub(super) doubts: Vec<Doubt>,
}

impl<'a> Composer<'a> {
    /// Takes the next clause.
    pub(super) fn clause(&mut self, clause: Clause<'a>) -> Result<(), Doubt> {
        match clause {
            Clause::Fronted(place) => {
                if self.fronted.replace(place).is_some() {
                    return Err(Doubt::Incomplete);
                }
                Ok(())
            }
            Clause::Command {
                verb,
                fronted,
                groups,
            } => {
                let fronted = fronted.or_else(|| self.fronted.take());
                let last = groups.len().saturating_sub(1);
                if groups.iter().rev().skip(1).any(ends_beside) {
                    // "Next to the plate and the cup": is the cup the next object?
                    self.doubts.push(Doubt::AmbiguousAttachment);
                }
                for (index, group) in groups.into_iter().enumerate() {
                    let fronted = if index == last { fronted.clone() } else { None };
                    self.command(verb, &group, fronted)?;
                }
                Ok(())
            }
            Clause::Statement {
                subject,
                mut destination,
            } => {
                let mut roles = attach::sources(subject.after.clone(), &mut self.doubts)?;
                let mut places = destination.drain(..);
                (roles.destination, roles.destination_qualifier) = (places.next(), places.next());
                if places.next().is_some() {
                    return Err(Doubt::Incomplete);
                }
                self.place_named(Action::PickAndPlace, &subject, &roles)
            }
            Clause::Bare { groups, wanted } => self.bare(groups, wanted),
        }
    }

    /// Ends the instruction.
    pub(super) fn finish(mut self) -> Result<(Vec<Subtask>, Vec<Doubt>), Doubt> {
        self.ended = true;
        self.flush_held()?;
        if self.fronted.is_some() || self.subtasks.is_empty() {
            return Err(Doubt::Incomplete);
        }
        if !self.subtasks.iter().any(names_something_known) {
            self.doubts.push(Doubt::NothingKnown);
        }
        if self.mixed_directions() {
            self.doubts.push(Doubt::AmbiguousAttachment);
        }
        Ok((self.subtasks, self.doubts))
    }

    /// "The fork to the left and the knife to the right of the plate": "to the
    /// left" may lack its reference.
    fn mixed_directions(&self) -> bool {
        use Relation::{AtBack, AtFront, AtLeft, AtRight, Behind, InFrontOf, LeftOf, RightOf};
        let some = |set: [Relation; 4]| {
            let goals = self
                .subtasks
                .iter()
                .filter_map(|step| step.destination.as_ref());
            goals.into_iter().any(|goal| set.contains(&goal.relation))
        };
        some([AtLeft, AtRight, AtFront, AtBack]) && some([LeftOf, RightOf, InFrontOf, Behind])
    }

    fn command(
        &mut self,
        verb: Verb,
        group: &Group<'a>,
        fronted: Option<Place<'a>>,
    ) -> Result<(), Doubt> {
        let pronoun = matches!(group.names.as_slice(), [] | [Noun::It | Noun::Them]);
        if matches!(verb, Verb::Pick | Verb::Get)
            && pronoun
            && group.after.is_empty()
            && fronted.is_none()
        {
            // "Find the milk, pick it up, ...".
            return if self.held.is_empty() || group.names.is_empty() {
                Err(Doubt::Incomplete)
            } else {
                self.held.iter_mut().for_each(|held| held.picked = true);
                Ok(())
            };
        }
        let roles = attach::roles(verb, group, fronted, &mut self.doubts)?;
        let open = |place: &Place<'_>| place.relation.is_none();
        if verb == Verb::Push && roles.destination.as_ref().is_some_and(open) {
            // "To the stove": up to it or onto it?
            self.doubts.push(Doubt::RelationGuess);
        }
        let action = match verb {
            Verb::Pick | Verb::Get | Verb::Find if roles.destination.is_none() => {
                return self.hold(group, &roles, verb);
            }
            Verb::Leave if !pronoun || self.held.is_empty() => {
                return Err(Doubt::Unsupported("leave".to_owned()));
            }
            Verb::Pick | Verb::Get | Verb::Find | Verb::Place | Verb::Leave | Verb::Move => {
                Action::PickAndPlace
            }
            Verb::Slide if goes_in(&roles) => Action::PickAndPlace,
            Verb::Slide | Verb::Push => Action::Push,
            Verb::Open => Action::Open,
            Verb::Close => Action::Close,
            Verb::TurnOn => Action::TurnOn,
            Verb::TurnOff | Verb::Turn => Action::TurnOff,
        };
        match action {
            Action::Open | Action::Close | Action::TurnOn | Action::TurnOff => {
                self.fixture(action, group, &roles)
            }
            _ if pronoun => {
                let several = matches!(group.names.as_slice(), [Noun::Them]);
                // "Them" when one object or none is at hand.
                if several && self.held.len() < 2 {
                    return Err(Doubt::Unsupported("them".to_owned()));
                }
                // "It" when two are at hand: which?
                if !several && self.held.len() > 1 {
                    self.doubts.push(Doubt::PronounGuess);
                }
                self.place_held(action, &roles)
            }
            _ => self.place_named(action, group, &roles),
        }
    }

    fn bare(&mut self, groups: Vec<Group<'a>>, wanted: bool) -> Result<(), Doubt> {
        if let [group] = groups.as_slice()
            && group.after.is_empty()
            && group.before.is_empty()
        {
            return self.hold(group, &Roles::default(), Verb::Find);
        }
        if !wanted {
            self.doubts.push(Doubt::NoVerb);
        }
        for mut group in groups {
            if let Some(place) = group.after.last_mut().filter(|_| wanted) {
                if place.says_plainly() {
                    self.doubts.push(Doubt::LooseVerb);
                }
                place.marked = place.negated;
            }
            let roles = attach::roles(Verb::Place, &group, None, &mut self.doubts)?;
            self.place_named(Action::PickAndPlace, &group, &roles)?;
        }
        Ok(())
    }

    /// Remembers objects until a clause says what to do with them.
    fn hold(&mut self, group: &Group<'a>, roles: &Roles<'a>, verb: Verb) -> Result<(), Doubt> {
        self.flush_held()?;
        let source = self.source(roles)?;
        self.check_shared(group, source.as_ref());
        for target in self.targets(group)? {
            self.mentions.push(target.clone());
            self.held.push(Held {
                target,
                source: source.clone(),
                loose: verb == Verb::Get,
                picked: verb != Verb::Find,
            });
        }
        Ok(())
    }

    fn flush_held(&mut self) -> Result<(), Doubt> {
        for held in std::mem::take(&mut self.held) {
            if !held.picked {
                return Err(Doubt::Incomplete);
            }
            if held.loose {
                self.doubts.push(Doubt::LooseVerb);
            }
            // Another step while this one is in the hand, or two picks.
            if std::mem::replace(&mut self.hand_full, true) || !self.ended {
                self.doubts.push(Doubt::HandFull);
            }
            self.push(Action::Pick, held.target, held.source, None, "")?;
        }
        Ok(())
    }

    /// "Place it on the plate": completes what is held, or moves the last
    /// target once more.
    fn place_held(&mut self, action: Action, roles: &Roles<'a>) -> Result<(), Doubt> {
        let (destination, prep) = self.destination(roles)?;
        let mut held = std::mem::take(&mut self.held);
        if held.is_empty() {
            let last = self
                .subtasks
                .last()
                .filter(|last| last.action.is_pick_place());
            let target = last.ok_or(Doubt::Incomplete)?.target.clone();
            self.doubts.push(Doubt::PronounGuess);
            held.push(Held {
                target,
                source: None,
                loose: false,
                picked: true,
            });
        }
        for held in held {
            self.push(
                action,
                held.target,
                held.source,
                Some(destination.clone()),
                prep,
            )?;
        }
        Ok(())
    }

    fn place_named(
        &mut self,
        action: Action,
        group: &Group<'a>,
        roles: &Roles<'a>,
    ) -> Result<(), Doubt> {
        self.flush_held()?;
        let source = self.source(roles)?;
        let (destination, prep) = self.destination(roles)?;
        self.check_shared(group, source.as_ref());
        for target in self.targets(group)? {
            self.push(
                action,
                target,
                source.clone(),
                Some(destination.clone()),
                prep,
            )?;
        }
        Ok(())
    }

    /// "The bowl and the cup next to the stove": is the bowl there, too?
    fn check_shared(&mut self, group: &Group<'_>, source: Option<&SpatialPhrase>) {
        if group.names.len() > 1 && source.is_some() {
            self.doubts.push(Doubt::AmbiguousAttachment);
        }
    }

    fn fixture(
        &mut self,
        action: Action,
        group: &Group<'a>,
        roles: &Roles<'a>,
    ) -> Result<(), Doubt> {
        self.flush_held()?;
        let source = self.source(roles)?;
        let targets = match group.names.as_slice() {
            [Noun::It] => {
                let fits: fn(&str) -> bool = match action {
                    Action::Open | Action::Close => lexicon::is_closable,
                    _ => lexicon::is_switchable,
                };
                let found = self.mentions.iter().rev().find(|name| fits(name));
                vec![found.ok_or(Doubt::Incomplete)?.clone()]
            }
            _ => self.targets(group)?,
        };
        for target in targets {
            let fits = match action {
                Action::Open | Action::Close => lexicon::is_closable(&target),
                _ => lexicon::is_switchable(&target),
            };
            if lexicon::has_known_head(&target) && !fits {
                return Err(Doubt::Unsupported(target));
            }
            self.push(action, target, source.clone(), None, "")?;
        }
        Ok(())
    }

    fn targets(&self, group: &Group<'_>) -> Result<Vec<String>, Doubt> {
        let mut targets = Vec::with_capacity(group.names.len());
        for noun in &group.names {
            let Noun::Name(name) = noun else {
                return Err(Doubt::Incomplete);
            };
            match plural_stem(name) {
                // "Both moka pots": the same kind twice.
                Some(one) if group.both && group.names.len() == 1 => {
                    targets.extend([one.clone(), one]);
                }
                Some(_) => return Err(Doubt::Unsupported(name.text.clone())),
                None => targets.push(name.text.clone()),
            }
        }
        let counted = !group.both || targets.len() == 2;
        if targets.is_empty() || !counted {
            Err(Doubt::Incomplete)
        } else {
            Ok(targets)
        }
    }

    fn push(
        &mut self,
        action: Action,
        target: String,
        source: Option<SpatialPhrase>,
        destination: Option<SpatialPhrase>,
        prep: &str,
    ) -> Result<(), Doubt> {
        if self.subtasks.len() == SUBTASK_CAPACITY {
            return Err(Doubt::TooManySteps);
        }
        let fixture = matches!(action, Action::Pick | Action::PickAndPlace | Action::Push);
        if fixture && lexicon::is_fixed(&target) {
            return Err(Doubt::Unsupported(target));
        }
        self.mentions.push(target.clone());
        if let Some(destination) = &destination {
            use Relation::{AtBack, AtFront, AtLeft, AtRight};
            let aside = [AtLeft, AtRight, AtFront, AtBack].contains(&destination.relation);
            let told_apart = source.is_some() || destination.qualifier.is_some();
            if aside || (!told_apart && destination.references.contains(&target)) {
                // Left of where it is, or of the table; the milk on which milk?
                self.doubts.push(Doubt::RelationGuess);
            }
            self.mentions.extend(destination.references.iter().cloned());
        }
        let mut subtask = Subtask {
            text: String::new(),
            action,
            target,
            source,
            destination,
            destination_prep: prep.to_owned(),
        };
        subtask.text = canonical_sentence(&subtask);
        self.subtasks.push(subtask);
        Ok(())
    }
}

fn names_something_known(step: &Subtask) -> bool {
    let phrases = [&step.source, &step.destination].into_iter().flatten();
    let references = phrases.flat_map(|phrase| &phrase.references);
    references
        .chain([&step.target])
        .any(|name| lexicon::has_known_head(name))
}

fn ends_beside(group: &Group<'_>) -> bool {
    let last = group.after.last();
    last.is_some_and(|place| place.relation == Some(Relation::NextTo))
}

fn goes_in(roles: &Roles<'_>) -> bool {
    roles
        .destination
        .as_ref()
        .is_some_and(|place| place.relation == Some(Relation::In))
}
