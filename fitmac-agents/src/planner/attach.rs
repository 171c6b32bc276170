//! Which place says where an object is, and which where it goes.

use super::clause::Group;
use super::confidence::Doubt;
use super::lexer::{Direction, TOWARDS, Verb};
use super::lexicon;
use super::phrase::{Noun, Place};
use super::types::Relation;

/// The places of a group by their role.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Roles<'a> {
    pub(super) source: Option<Place<'a>>,
    pub(super) source_qualifier: Option<Place<'a>>,
    pub(super) destination: Option<Place<'a>>,
    pub(super) destination_qualifier: Option<Place<'a>>,
}

/// Gives each place of `group` its role under `verb`.
pub(super) fn roles<'a>(
    verb: Verb,
    group: &Group<'a>,
    fronted: Option<Place<'a>>,
    doubts: &mut Vec<Doubt>,
) -> Result<Roles<'a>, Doubt> {
    let mut before = group.before.iter().cloned();
    let leading = fronted.or_else(|| before.next());
    // "From the drawer, take the bowl": where it is, said first.
    let (origin, leading) = match leading {
        Some(place) if place.direction == Direction::From => (Some(place), None),
        other => (None, other),
    };
    let rest = before.chain(group.after.iter().cloned());
    let mut after: Vec<Place<'a>> = origin.into_iter().chain(rest).collect();
    let pronoun = matches!(group.names.as_slice(), [] | [Noun::It | Noun::Them]);
    if let Some(destination) = leading {
        if pronoun && group.names.is_empty() {
            return place_pronoun(std::iter::once(destination).chain(after).collect());
        }
        if after.iter().any(Place::says_plainly) {
            // "Next to the stove, put the bowl on the plate."
            doubts.push(Doubt::AmbiguousAttachment);
        }
        let mut roles = sources(after, doubts)?;
        roles.destination = Some(destination);
        return Ok(roles);
    }
    match verb {
        Verb::Pick | Verb::Get | Verb::Find => {
            let goes = after
                .last()
                .is_some_and(|place| place.direction == Direction::To);
            let destination = if goes { after.pop() } else { None };
            let mut roles = sources(after, doubts)?;
            roles.destination = destination;
            Ok(roles)
        }
        Verb::Place | Verb::Leave | Verb::Move | Verb::Slide | Verb::Push if pronoun => {
            place_pronoun(after)
        }
        Verb::Place | Verb::Leave | Verb::Move | Verb::Slide | Verb::Push => {
            place_named(after, doubts)
        }
        Verb::Open | Verb::Close | Verb::TurnOn | Verb::TurnOff | Verb::Turn => {
            sources(after, doubts)
        }
    }
}

/// All places say where the object is.
pub(super) fn sources<'a>(
    places: Vec<Place<'a>>,
    doubts: &mut Vec<Doubt>,
) -> Result<Roles<'a>, Doubt> {
    let mut places = places.into_iter();
    let roles = Roles {
        source: places.next(),
        source_qualifier: places.next(),
        ..Roles::default()
    };
    if roles.source_qualifier.is_some() {
        doubts.push(Doubt::AmbiguousAttachment);
    }
    if places.next().is_some() || roles.source.as_ref().is_some_and(is_goal) {
        return Err(Doubt::Unparsed("place".to_owned()));
    }
    Ok(roles)
}

fn is_goal(place: &Place<'_>) -> bool {
    place.direction == Direction::To
}

/// "Place it on the plate next to the stove": the object is settled, so all
/// that follows belongs to the destination.
fn place_pronoun(places: Vec<Place<'_>>) -> Result<Roles<'_>, Doubt> {
    let mut places = places.into_iter();
    let (destination, destination_qualifier) = (places.next(), places.next());
    let wrong = |place: &Place<'_>| place.direction == Direction::From;
    if destination.as_ref().is_none_or(wrong) || places.next().is_some() {
        return Err(Doubt::Incomplete);
    }
    Ok(Roles {
        destination,
        destination_qualifier,
        ..Roles::default()
    })
}

fn place_named<'a>(places: Vec<Place<'a>>, doubts: &mut Vec<Doubt>) -> Result<Roles<'a>, Doubt> {
    let mut roles = Roles::default();
    let mut places = places.into_iter();
    match (places.next(), places.next(), places.next()) {
        (Some(only), None, None) if !says_where(&only) => roles.destination = Some(only),
        (Some(goal), Some(origin), None) if is_goal(&goal) && says_where(&origin) => {
            if origin.direction == Direction::From {
                roles.source = Some(origin);
            } else {
                roles.destination_qualifier = Some(origin);
            }
            roles.destination = Some(goal);
        }
        // "On the plate from the stove".
        (Some(goal), Some(origin), None)
            if origin.direction == Direction::From && !says_where(&goal) =>
        {
            (roles.destination, roles.source) = (Some(goal), Some(origin));
        }
        (Some(goal), Some(mark), None) if mark.marked && !says_where(&goal) => {
            (roles.destination, roles.destination_qualifier) = (Some(goal), Some(mark));
        }
        (Some(origin), Some(goal), None) if goal.direction != Direction::From => {
            if !clearly_two_places(&origin, &goal) {
                doubts.push(Doubt::AmbiguousAttachment);
            }
            (roles.source, roles.destination) = (Some(origin), Some(goal));
        }
        (Some(origin), Some(goal), Some(mark)) if goal.direction != Direction::From => {
            if !is_goal(&goal) || is_goal(&origin) {
                doubts.push(Doubt::AmbiguousAttachment);
            }
            roles.source = Some(origin);
            (roles.destination, roles.destination_qualifier) = (Some(goal), Some(mark));
        }
        _ => return Err(Doubt::Incomplete),
    }
    if places.next().is_some() || roles.source.as_ref().is_some_and(is_goal) {
        return Err(Doubt::Unparsed("place".to_owned()));
    }
    Ok(roles)
}

/// True if the phrase can only say where something is.
fn says_where(place: &Place<'_>) -> bool {
    place.marked || place.direction == Direction::From
}

/// True if the first place is surely the origin and the second the destination.
/// Two plain places have two readings ("beside the plate on the stove"), unless
/// the second can't say where the first one's reference is, because it is that
/// reference ("beside the plate on the plate").
fn clearly_two_places(origin: &Place<'_>, goal: &Place<'_>) -> bool {
    let shared = |goal: &Noun| {
        origin
            .references
            .iter()
            .any(|reference| same(reference, goal))
    };
    says_where(origin)
        || is_goal(goal)
        || origin.references.is_empty()
        || goal.references.iter().any(shared)
}

fn same(one: &Noun, other: &Noun) -> bool {
    matches!((one, other), (Noun::Name(one), Noun::Name(other)) if one.text == other.text)
}

/// The relation of a place, settled by its reference where the words leave it
/// open.
pub(super) fn settled_relation(
    place: &Place<'_>,
    references: &[String],
    doubts: &mut Vec<Doubt>,
) -> Result<Relation, Doubt> {
    match (place.relation, references.first()) {
        (Some(relation), _) => Ok(relation),
        (None, Some(_)) if place.direction == Direction::Static => {
            Err(Doubt::Unsupported(place.preposition.to_owned()))
        }
        (None, name) => {
            let container = name.is_some_and(|name| lexicon::is_container(name));
            let open_box = name.is_some_and(|name| lexicon::is_open_box(name));
            let surface = name.is_some_and(|name| lexicon::is_surface(name));
            if open_box || place.preposition == TOWARDS || !(container || surface) {
                doubts.push(Doubt::RelationGuess);
            }
            let flat = name.is_some_and(|name| name == "tray");
            Ok(if container && !flat {
                Relation::In
            } else {
                Relation::On
            })
        }
    }
}
