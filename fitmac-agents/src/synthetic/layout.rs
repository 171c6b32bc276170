//! Table-top layouts in the manner of LIBERO's Spatial and Object suites.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::planner::Relation;
use crate::scene::{Camera, Detection};

use super::catalogue::{COOKIES, PLATE, PRODUCTS, RAMEKIN, TABLE, camera, disc, fixtures, spoken};
use super::truth::{Disc, Holds, Truth, holds};

/// Where a thing stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Support {
    Table,
    /// On another thing, by index.
    Thing(usize),
    /// On a fixture.
    Fixture(usize),
    /// In the first part of a fixture.
    Drawer(usize),
}

/// An object with its true pose and support.
#[derive(Clone, Debug)]
pub struct Thing {
    /// True pose, size and label.
    pub detection: Detection,
    pub(super) support: Support,
}

/// What an instruction asks for.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Query {
    /// An object by its name alone.
    Name(&'static str),
    /// A bowl on or in something.
    Supported {
        relation: Relation,
        reference: &'static str,
        negated: bool,
    },
    /// A bowl by a relation on the table.
    Placed {
        relation: Relation,
        references: Vec<&'static str>,
        negated: bool,
    },
    /// A bowl that leads all others.
    Leading {
        relation: Relation,
        reference: Option<&'static str>,
    },
}

/// A layout with its question.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Objects; the candidates come first.
    pub things: Vec<Thing>,
    /// Cabinet and stove.
    pub fixtures: Vec<Detection>,
    /// The camera, opposite the robot, or none.
    pub camera: Option<Camera>,
    pub(super) query: Query,
    pub(super) fitting: Vec<usize>,
    instruction_name: &'static str,
}

/// What is asked for: which of the candidates shall fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wish {
    One,
    Several,
    None,
}

impl Layout {
    /// Draws layouts until one is clear or plainly ambiguous; about half of
    /// each.
    pub(super) fn draw(rng: &mut ChaCha8Rng) -> Self {
        loop {
            let query = draw_query(rng);
            let wish = draw_wish(&query, rng);
            // Some wishes can't be met: two bowls on one ramekin.
            for _ in 0..200 {
                if let Some(layout) = Self::attempt(&query, wish, rng) {
                    return layout;
                }
            }
        }
    }

    fn attempt(query: &Query, wish: Wish, rng: &mut ChaCha8Rng) -> Option<Self> {
        let mut layout = Self {
            things: Vec::new(),
            fixtures: fixtures(),
            camera: rng.random_bool(0.5).then(camera),
            query: query.clone(),
            fitting: Vec::new(),
            instruction_name: "black bowl",
        };
        if let Query::Name(name) = *query {
            layout.instruction_name = name;
            layout.shelf(name, wish, rng)?;
            return Some(layout);
        }
        let references = [PLATE, RAMEKIN, COOKIES];
        let candidates = rng.random_range(2..=4);
        let fitting = match wish {
            Wish::One => 1,
            Wish::Several => 2,
            Wish::None => 0,
        };
        // References first: the candidates are placed around them.
        let mut placed = Vec::new();
        for (label, size) in references {
            placed.push(layout.on_table(label, size, &placed, None, rng)?);
        }
        let mut bowls = Vec::new();
        for index in 0..candidates {
            let bowl = layout.bowl(index < fitting, &placed, &bowls, rng)?;
            bowls.push(bowl);
        }
        let offset = bowls.len();
        for bowl in &mut bowls {
            if let Support::Thing(index) = &mut bowl.support {
                *index += offset;
            }
        }
        layout.things = bowls.into_iter().chain(placed).collect();
        layout.settle(candidates, wish).then_some(layout)
    }

    /// Decides which candidates fit; false if that isn't what was wished.
    fn settle(&mut self, candidates: usize, wish: Wish) -> bool {
        let mut fitting = Vec::new();
        for index in 0..candidates {
            match self.fits(index, candidates) {
                Holds::Yes => fitting.push(index),
                Holds::No => {}
                Holds::Borderline => return false,
            }
        }
        let count = fitting.len();
        self.fitting = fitting;
        match wish {
            Wish::One => count == 1,
            Wish::Several => count >= 2,
            Wish::None => count == 0,
        }
    }

    fn fits(&self, index: usize, candidates: usize) -> Holds {
        match &self.query {
            Query::Name(_) => Holds::Yes,
            Query::Supported {
                reference, negated, ..
            } => {
                let yes = self.support_label(self.things[index].support) == Some(*reference);
                if yes != *negated {
                    Holds::Yes
                } else {
                    Holds::No
                }
            }
            Query::Placed {
                relation,
                references,
                negated,
            } => {
                let plain = self.placed_fits(index, *relation, references);
                match (plain, negated) {
                    (Holds::Yes, true) => Holds::No,
                    (Holds::No, true) => Holds::Yes,
                    (plain, _) => plain,
                }
            }
            Query::Leading {
                relation,
                reference,
            } => self.leads(index, candidates, *relation, *reference),
        }
    }

    fn placed_fits(&self, index: usize, relation: Relation, references: &[&str]) -> Holds {
        // On a stove or a box it may look "next to" or not: nobody could say.
        if self.things[index].support != Support::Table {
            let thing = &self.things[index];
            let high = thing.detection.bottom_m() > 0.10;
            let sided = matches!(relation, Relation::NextTo) && high;
            return if sided { Holds::No } else { Holds::Borderline };
        }
        let discs: Vec<Disc> = references
            .iter()
            .filter_map(|name| self.disc_of(name))
            .collect();
        let (left, away) = self.view();
        holds(
            relation,
            &disc(&self.things[index].detection),
            &discs,
            left,
            away,
        )
    }

    fn leads(
        &self,
        index: usize,
        candidates: usize,
        relation: Relation,
        reference: Option<&str>,
    ) -> Holds {
        let (left, _) = self.view();
        let value = |at: usize| {
            let own = disc(&self.things[at].detection);
            match (relation, reference.and_then(|name| self.disc_of(name))) {
                (Relation::NearestTo, Some(reference)) => -own.free(&reference),
                (Relation::FarthestFrom, Some(reference)) => own.free(&reference),
                (Relation::AtRight, _) => -(own.at[0] * left[0] + own.at[1] * left[1]),
                _ => own.at[0] * left[0] + own.at[1] * left[1],
            }
        };
        let own = value(index);
        let rival = (0..candidates)
            .filter(|other| *other != index)
            .map(value)
            .fold(f64::NEG_INFINITY, f64::max);
        if (own - rival).abs() < 0.05 {
            Holds::Borderline
        } else if own > rival {
            Holds::Yes
        } else {
            Holds::No
        }
    }

    /// The viewer's left and away: a camera opposite the robot, or the robot.
    fn view(&self) -> ([f64; 2], [f64; 2]) {
        if self.camera.is_some() {
            ([0.0, -1.0], [-1.0, 0.0])
        } else {
            ([0.0, 1.0], [1.0, 0.0])
        }
    }

    fn disc_of(&self, name: &str) -> Option<Disc> {
        if name == "table" {
            let [x, y, _] = TABLE.centre_m;
            return Some(Disc {
                at: [x, y],
                half: TABLE.half_extent_m,
            });
        }
        let things = self
            .things
            .iter()
            .map(|thing| &thing.detection)
            .chain(&self.fixtures);
        things
            .into_iter()
            .find(|thing| spoken(&thing.label) == name)
            .map(disc)
    }

    fn support_label(&self, support: Support) -> Option<&'static str> {
        match support {
            Support::Table => Some("table"),
            Support::Thing(index) => self.things.get(index).map(|t| spoken(&t.detection.label)),
            Support::Fixture(index) => self.fixtures.get(index).map(|f| spoken(&f.label)),
            Support::Drawer(_) => Some("top drawer of the wooden cabinet"),
        }
    }

    /// The instruction in words.
    #[must_use]
    pub fn instruction(&self) -> String {
        let phrase = |relation: Relation, references: &[&str], negated: bool| {
            let not = if negated { "not " } else { "" };
            let list = references.join(" and the ");
            format!("{not}{} the {list}", relation.words())
        };
        let name = self.instruction_name;
        let place = match &self.query {
            Query::Name(_) => return format!("pick up the {name} and place it in the basket"),
            Query::Supported {
                relation,
                reference,
                negated,
            } => phrase(*relation, &[reference], *negated),
            Query::Placed {
                relation,
                references,
                negated,
            } => phrase(*relation, references, *negated),
            Query::Leading {
                relation,
                reference: Some(reference),
            } => phrase(*relation, &[reference], false),
            Query::Leading {
                relation,
                reference: None,
            } => relation.words().to_owned(),
        };
        format!("pick up the {name} {place} and place it on the plate")
    }

    /// Kind of the layout, for tables.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match &self.query {
            Query::Name(_) => "by name",
            Query::Supported { negated: true, .. } => "not on or in",
            Query::Supported { relation, .. } | Query::Leading { relation, .. } => relation.words(),
            Query::Placed { negated: true, .. } => "not by place",
            Query::Placed { relation, .. } => relation.words(),
        }
    }

    /// Which object is meant; `lot` draws among several.
    pub(super) fn truth(&self, lot: usize) -> Truth {
        match self.fitting.as_slice() {
            [] => Truth::None,
            [one] => Truth::One(*one),
            several => Truth::OneOfSeveral(several[lot % several.len()]),
        }
    }
}

fn draw_wish(query: &Query, rng: &mut ChaCha8Rng) -> Wish {
    match (rng.random_range(0..8), query) {
        (0..=3, _) | (_, Query::Leading { .. }) => Wish::One,
        // Without an object of the name there is nothing to select.
        (4 | 5, _) | (_, Query::Name(_)) => Wish::Several,
        _ => Wish::None,
    }
}

fn draw_query(rng: &mut ChaCha8Rng) -> Query {
    let supports = ["ramekin", "cookie box", "stove", "wooden cabinet"];
    let places = ["plate", "ramekin", "cookie box"];
    let support = supports[rng.random_range(0..supports.len())];
    let place = places[rng.random_range(0..places.len())];
    let placed = |relation, references, negated| Query::Placed {
        relation,
        references,
        negated,
    };
    let on = |negated| Query::Supported {
        relation: Relation::On,
        reference: support,
        negated,
    };
    let drawer = "top drawer of the wooden cabinet";
    match rng.random_range(0..18) {
        0 | 1 => Query::Name(PRODUCTS[rng.random_range(0..PRODUCTS.len())].0),
        2 | 3 => on(false),
        4 => on(true),
        5 => Query::Supported {
            relation: Relation::In,
            reference: drawer,
            negated: false,
        },
        6 | 7 => placed(Relation::NextTo, vec![place], false),
        8 => placed(Relation::NextTo, vec![place], true),
        9 => placed(Relation::Between, vec!["plate", "ramekin"], false),
        10 => placed(Relation::Between, vec!["plate", "ramekin"], true),
        11 => placed(Relation::AtCentre, vec!["table"], false),
        12 => placed(Relation::LeftOf, vec![place], false),
        13 => placed(Relation::RightOf, vec![place], false),
        14 => placed(Relation::InFrontOf, vec![place], false),
        15 => placed(Relation::Behind, vec![place], false),
        16 => Query::Leading {
            relation: Relation::NearestTo,
            reference: Some(place),
        },
        _ => {
            let relation = if rng.random_bool(0.5) {
                Relation::AtLeft
            } else {
                Relation::AtRight
            };
            Query::Leading {
                relation,
                reference: None,
            }
        }
    }
}
