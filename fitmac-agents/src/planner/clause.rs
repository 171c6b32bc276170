//! Clauses: one verb with what belongs to it.

use super::confidence::Doubt;
use super::lexer::{Direction, Item, Verb};
use super::phrase::{Element, Noun, Place, Reader};

/// Objects that share their places.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Group<'a> {
    pub(super) names: Vec<Noun>,
    pub(super) both: bool,
    /// Places before the names: "put on the plate the bowl".
    pub(super) before: Vec<Place<'a>>,
    /// Places after the names.
    pub(super) after: Vec<Place<'a>>,
}

/// One clause.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Clause<'a> {
    /// A verb and its groups; a place may stand before the verb.
    Command {
        verb: Verb,
        fronted: Option<Place<'a>>,
        groups: Vec<Group<'a>>,
    },
    /// "The milk goes in the basket": the object, and where it goes.
    Statement {
        subject: Group<'a>,
        destination: Vec<Place<'a>>,
    },
    /// "The milk in the basket": no verb. `wanted` after "I need" and the like.
    Bare {
        groups: Vec<Group<'a>>,
        wanted: bool,
    },
    /// "Onto the plate," before a clause.
    Fronted(Place<'a>),
}

/// Splits items into clauses: at stops, and at connectors before a verb.
pub(super) fn split<'i, 'a>(items: &'i [Item<'a>]) -> Vec<&'i [Item<'a>]> {
    let mut clauses = Vec::new();
    let mut start = 0;
    let mut at = 0;
    while at < items.len() {
        let mut next = at;
        while items.get(next).is_some_and(is_connector) {
            next += 1;
        }
        if next > at {
            let stop = items[at..next].contains(&Item::Stop);
            let verb = matches!(items.get(next), Some(Item::Verb(..) | Item::Want))
                || (items[start..at].contains(&Item::Goes) && states(&items[next..]));
            if stop || verb || next == items.len() {
                clauses.push(&items[start..at]);
                start = next;
            }
            at = next;
        } else {
            at += 1;
        }
    }
    clauses.push(&items[start..]);
    clauses.retain(|clause| !clause.is_empty());
    clauses
}

/// True if another "the milk goes in the basket" begins here.
fn states(items: &[Item<'_>]) -> bool {
    let verb = |item: &&Item<'_>| matches!(item, Item::Verb(..) | Item::Goes | Item::Stop);
    items.iter().find(verb) == Some(&Item::Goes)
}

fn is_connector(item: &Item<'_>) -> bool {
    matches!(item, Item::And | Item::Then | Item::Comma | Item::Stop)
}

/// Parses one clause; every item must find its place.
pub(super) fn parse<'a>(items: &[Item<'a>], doubts: &mut Vec<Doubt>) -> Result<Clause<'a>, Doubt> {
    let mut reader = Reader::new(items);
    let clause = parse_with(&mut reader);
    doubts.append(&mut reader.doubts);
    clause
}

fn parse_with<'a>(reader: &mut Reader<'_, 'a>) -> Result<Clause<'a>, Doubt> {
    let wanted = reader.peek() == Some(&Item::Want);
    if wanted {
        reader.advance();
    }
    if let Some(&Item::Verb(verb, _)) = reader.peek() {
        reader.advance();
        return command(reader, verb, None);
    }
    let opening = match reader.elements() {
        // "Make sure the milk is in the basket".
        Err(Doubt::Unsupported(word)) if wanted && matches!(word.as_str(), "is" | "are") => {
            return statement_after_is(reader);
        }
        other => other?,
    };
    match (reader.peek(), opening.as_slice()) {
        (None, [Element::Place(place)]) => Ok(Clause::Fronted(place.clone())),
        (None, _) => Ok(Clause::Bare {
            groups: groups(opening)?,
            wanted,
        }),
        (Some(&Item::Verb(verb, _)), [Element::Place(place)]) => {
            reader.advance();
            command(reader, verb, Some(place.clone()))
        }
        (Some(Item::Goes), _) | (Some(Item::Verb(Verb::Place | Verb::Move, _)), [_, ..])
            if wanted || reader.peek() == Some(&Item::Goes) =>
        {
            statement(reader, opening)
        }
        (Some(item), _) => Err(Doubt::Unparsed(format!("{item:?}"))),
    }
}

/// The reader stands at an "is" that the elements refused; reads them again.
fn statement_after_is<'a>(reader: &mut Reader<'_, 'a>) -> Result<Clause<'a>, Doubt> {
    let opening = reader.reread_before_unsupported()?;
    reader.advance();
    let destination = places(reader.elements()?)?;
    Ok(Clause::Statement {
        subject: single(groups(opening)?)?,
        destination,
    })
}

fn statement<'a>(
    reader: &mut Reader<'_, 'a>,
    opening: Vec<Element<'a>>,
) -> Result<Clause<'a>, Doubt> {
    reader.advance();
    // "Should go placed": one word more of the same kind.
    if matches!(reader.peek(), Some(Item::Verb(Verb::Place | Verb::Move, _))) {
        reader.advance();
    }
    let destination = places(reader.elements()?)?;
    if reader.peek().is_some() || destination.is_empty() {
        return Err(Doubt::Incomplete);
    }
    Ok(Clause::Statement {
        subject: single(groups(opening)?)?,
        destination,
    })
}

fn command<'a>(
    reader: &mut Reader<'_, 'a>,
    verb: Verb,
    fronted: Option<Place<'a>>,
) -> Result<Clause<'a>, Doubt> {
    let mut elements = reader.elements()?;
    if let Some(item) = reader.peek() {
        return Err(Doubt::Unparsed(format!("{item:?}")));
    }
    let verb = if verb == Verb::Turn {
        turn_particle(&mut elements)?
    } else {
        verb
    };
    Ok(Clause::Command {
        verb,
        fronted,
        groups: groups(elements)?,
    })
}

/// "Turn the stove on": the last preposition has no reference.
fn turn_particle(elements: &mut Vec<Element<'_>>) -> Result<Verb, Doubt> {
    match elements.pop() {
        Some(Element::Place(place)) if place.references.is_empty() => {
            Ok(if place.direction == Direction::From {
                Verb::TurnOff
            } else {
                Verb::TurnOn
            })
        }
        _ => Err(Doubt::Incomplete),
    }
}

fn groups(elements: Vec<Element<'_>>) -> Result<Vec<Group<'_>>, Doubt> {
    let empty = || Group {
        names: vec![],
        both: false,
        before: vec![],
        after: vec![],
    };
    let mut groups = vec![empty()];
    for element in elements {
        let Some(group) = groups.last_mut() else {
            return Err(Doubt::Incomplete);
        };
        match element {
            Element::Names(names, both) if group.names.is_empty() => {
                (group.names, group.both) = (names, both);
            }
            Element::Names(..) => return Err(Doubt::Unparsed("name".to_owned())),
            Element::Place(place) if group.names.is_empty() => group.before.push(place),
            Element::Place(place) => group.after.push(place),
            Element::Break => groups.push(empty()),
        }
    }
    Ok(groups)
}

fn single(groups: Vec<Group<'_>>) -> Result<Group<'_>, Doubt> {
    let mut groups = groups.into_iter();
    match (groups.next(), groups.next()) {
        (Some(group), None) if !group.names.is_empty() && group.before.is_empty() => Ok(group),
        _ => Err(Doubt::Incomplete),
    }
}

fn places(elements: Vec<Element<'_>>) -> Result<Vec<Place<'_>>, Doubt> {
    elements
        .into_iter()
        .map(|element| match element {
            Element::Place(place) => Ok(place),
            Element::Names(..) | Element::Break => Err(Doubt::Incomplete),
        })
        .collect()
}
