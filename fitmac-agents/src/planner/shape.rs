//! The shape of a sentence: its words' kinds in order, names closed up.

use super::lexer::{Direction, Item, Verb};
use super::types::Relation;

/// Kind of a part of a sentence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Kind {
    Start,
    End,
    Pick,
    Find,
    Place,
    Move,
    Leave,
    Slide,
    Push,
    Open,
    Close,
    TurnOn,
    TurnOff,
    Turn,
    /// A preposition of place: "on".
    Where,
    /// One of direction: "onto", "to".
    Whither,
    /// One of origin: "from".
    Whence,
    /// "Between".
    Between,
    /// A place without a reference: "on the left".
    There,
    /// A name with an article.
    TheName,
    /// A name without one.
    Name,
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
    /// A word that was dropped: "please", "up".
    Filler,
    /// A word that the grammar doesn't cover.
    Foreign,
}

impl Kind {
    fn of(item: &Item<'_>) -> Self {
        match item {
            Item::Verb(verb, _) => Self::of_verb(*verb),
            Item::Prep {
                relation,
                direction,
                ..
            } => match (relation.map(Relation::arity), direction) {
                (Some(0), _) => Self::There,
                (Some(2), _) => Self::Between,
                (_, Direction::Static) => Self::Where,
                (_, Direction::To) => Self::Whither,
                (_, Direction::From) => Self::Whence,
            },
            Item::Word(_) => Self::Name,
            Item::Determiner => Self::TheName,
            Item::Of => Self::Of,
            Item::Possessive => Self::Possessive,
            Item::Not => Self::Not,
            Item::Relative => Self::Relative,
            Item::Goes => Self::Goes,
            Item::Want => Self::Want,
            Item::Both => Self::Both,
            Item::And => Self::And,
            Item::Then => Self::Then,
            Item::Comma => Self::Comma,
            Item::Stop => Self::Stop,
            Item::It => Self::It,
            Item::Them => Self::Them,
            Item::Filler => Self::Filler,
            Item::Unsupported(_) => Self::Foreign,
        }
    }

    fn of_verb(verb: Verb) -> Self {
        match verb {
            Verb::Pick | Verb::Get => Self::Pick,
            Verb::Find => Self::Find,
            Verb::Place => Self::Place,
            Verb::Move => Self::Move,
            Verb::Leave => Self::Leave,
            Verb::Slide => Self::Slide,
            Verb::Push => Self::Push,
            Verb::Open => Self::Open,
            Verb::Close => Self::Close,
            Verb::TurnOn => Self::TurnOn,
            Verb::TurnOff => Self::TurnOff,
            Verb::Turn => Self::Turn,
        }
    }
}

/// The kinds of `items`, from [`Kind::Start`] to [`Kind::End`].
pub(super) fn shape(items: &[Item<'_>]) -> Vec<Kind> {
    let mut kinds = Vec::with_capacity(items.len() + 2);
    kinds.push(Kind::Start);
    for item in items {
        let kind = Kind::of(item);
        let last = *kinds.last().unwrap_or(&Kind::Start);
        let goes_on = match kind {
            Kind::Name | Kind::TheName => matches!(last, Kind::Name | Kind::TheName),
            // Two dropped words are no rarer than one.
            Kind::Filler => last == Kind::Filler,
            _ => false,
        };
        if !goes_on {
            kinds.push(kind);
        }
    }
    // What closes a sentence says nothing.
    while matches!(kinds.last(), Some(Kind::Stop | Kind::Comma)) {
        kinds.pop();
    }
    kinds.push(Kind::End);
    kinds
}
