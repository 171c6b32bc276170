//! Table-top layouts in the manner of LIBERO's Spatial and Object suites.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::planner::Relation;
use crate::scene::{Camera, Detection, Part, Table};

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
enum Query {
    /// An object by its name alone.
    Name(&'static str),
    /// A bowl on or in something.
    Supported { relation: Relation, reference: &'static str, negated: bool },
    /// A bowl by a relation on the table.
    Placed { relation: Relation, references: Vec<&'static str>, negated: bool },
    /// A bowl that leads all others.
    Leading { relation: Relation, reference: Option<&'static str> },
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
    query: Query,
    fitting: Vec<usize>,
    instruction_name: &'static str,
}

/// The table of every layout.
pub(super) const TABLE: Table =
    Table { centre_m: [0.55, 0.0, 0.0], half_extent_m: [0.36, 0.50] };

const BOWL: (&str, [f64; 3]) = ("akita_black_bowl", [0.107, 0.107, 0.050]);
const PLATE: (&str, [f64; 3]) = ("plate", [0.16, 0.16, 0.02]);
const RAMEKIN: (&str, [f64; 3]) = ("glazed_rim_porcelain_ramekin", [0.08, 0.08, 0.04]);
const COOKIES: (&str, [f64; 3]) = ("cookies", [0.14, 0.07, 0.04]);

const PRODUCTS: &[(&str, &str, [f64; 3])] = &[
    ("alphabet soup", "alphabet_soup", [0.065, 0.065, 0.085]),
    ("cream cheese", "cream_cheese", [0.09, 0.06, 0.03]),
    ("salad dressing", "salad_dressing", [0.05, 0.05, 0.17]),
    ("bbq sauce", "bbq_sauce", [0.05, 0.05, 0.15]),
    ("ketchup", "ketchup", [0.05, 0.05, 0.15]),
    ("tomato sauce", "tomato_sauce", [0.065, 0.065, 0.085]),
    ("butter", "butter", [0.10, 0.05, 0.04]),
    ("milk", "milk", [0.06, 0.06, 0.17]),
    ("chocolate pudding", "chocolate_pudding", [0.09, 0.06, 0.03]),
    ("orange juice", "orange_juice", [0.06, 0.06, 0.17]),
];

/// What is asked for: which of the candidates shall fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wish {
    One,
    Several,
    None,
}

impl Layout {
    /// Draws layouts until one is clear or plainly ambiguous; about half of
    /// each.
    pub(super) fn draw(rng: &mut ChaCha8Rng) -> Self {
        let query = draw_query(rng);
        let leading = matches!(query, Query::Leading { .. });
        let wish = match rng.random_range(0..8) {
            0..=3 => Wish::One,
            _ if leading => Wish::One,
            4 | 5 => Wish::Several,
            // Without an object of the name there is nothing to select.
            _ if matches!(query, Query::Name(_)) => Wish::Several,
            _ => Wish::None,
        };
        loop {
            if let Some(layout) = Self::attempt(&query, wish, rng) {
                return layout;
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
            Query::Supported { reference, negated, .. } => {
                let yes = self.support_label(self.things[index].support) == Some(*reference);
                if yes != *negated { Holds::Yes } else { Holds::No }
            }
            Query::Placed { relation, references, negated } => {
                let plain = self.placed_fits(index, *relation, references);
                match (plain, negated) {
                    (Holds::Yes, true) => Holds::No,
                    (Holds::No, true) => Holds::Yes,
                    (plain, _) => plain,
                }
            }
            Query::Leading { relation, reference } => {
                self.leads(index, candidates, *relation, *reference)
            }
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
        let discs: Vec<Disc> = references.iter().filter_map(|name| self.disc_of(name)).collect();
        let (left, away) = self.view();
        holds(relation, &disc(&self.things[index].detection), &discs, left, away)
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
            return Some(Disc { at: [x, y], half: TABLE.half_extent_m });
        }
        let things = self.things.iter().map(|thing| &thing.detection).chain(&self.fixtures);
        things.into_iter().find(|thing| spoken(&thing.label) == name).map(disc)
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
            Query::Supported { relation, reference, negated } => {
                phrase(*relation, &[reference], *negated)
            }
            Query::Placed { relation, references, negated } => {
                phrase(*relation, references, *negated)
            }
            Query::Leading { relation, reference: Some(reference) } => {
                phrase(*relation, &[reference], false)
            }
            Query::Leading { relation, reference: None } => relation.words().to_owned(),
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

    /// LIBERO-Object's floor: products and a basket.
    fn shelf(&mut self, name: &str, wish: Wish, rng: &mut ChaCha8Rng) -> Option<()> {
        self.fixtures.clear();
        let wanted = PRODUCTS.iter().find(|product| product.0 == name)?;
        let copies = if wish == Wish::One { 1 } else { 2 };
        let mut things = Vec::new();
        for _ in 0..copies {
            things.push(self.on_table(wanted.1, wanted.2, &things, None, rng)?);
        }
        let mut others: Vec<_> = PRODUCTS.iter().filter(|product| product.0 != name).collect();
        for _ in 0..rng.random_range(4..=6) {
            let (_, label, size) = *others.swap_remove(rng.random_range(0..others.len()));
            things.push(self.on_table(label, size, &things, None, rng)?);
        }
        things.push(self.on_table("basket", [0.2, 0.2, 0.12], &things, None, rng)?);
        self.things = things;
        self.fitting = (0..copies).collect();
        Some(())
    }

    /// A thing on a free spot of the table, near `around` if given.
    fn on_table(
        &self,
        label: &str,
        size: [f64; 3],
        others: &[Thing],
        around: Option<([f64; 2], f64)>,
        rng: &mut ChaCha8Rng,
    ) -> Option<Thing> {
        for _ in 0..40 {
            let at = match around {
                Some((centre, reach)) => {
                    [0, 1].map(|axis| centre[axis] + rng.random_range(-reach..reach))
                }
                None => [
                    TABLE.centre_m[0] + rng.random_range(-0.28..0.28),
                    TABLE.centre_m[1] + rng.random_range(-0.40..0.40),
                ],
            };
            let inside = (at[0] - TABLE.centre_m[0]).abs() < 0.30
                && (at[1] - TABLE.centre_m[1]).abs() < 0.44;
            let thing = thing(label, size, [at[0], at[1], size[2] / 2.0], Support::Table);
            let own = disc(&thing.detection);
            let low = others.iter().filter(|other| other.support == Support::Table);
            let free = low
                .map(|other| &other.detection)
                .chain(&self.fixtures)
                .all(|other| own.free(&disc(other)) > 0.01);
            if inside && free {
                return Some(thing);
            }
        }
        None
    }

    /// A bowl that shall fit the query or shall not; whether it does is checked
    /// later.
    fn bowl(
        &self,
        fit: bool,
        references: &[Thing],
        bowls: &[Thing],
        rng: &mut ChaCha8Rng,
    ) -> Option<Thing> {
        let (label, size) = BOWL;
        let all: Vec<Thing> = references.iter().chain(bowls).cloned().collect();
        match &self.query {
            Query::Supported { reference, negated, .. } if fit != *negated => {
                self.supported(reference, references, bowls, rng)
            }
            Query::Placed { references: names, negated, .. } if fit != *negated => {
                let centre = self.middle(names, references)?;
                self.on_table(label, size, &all, Some((centre, 0.22)), rng)
            }
            // Elsewhere: mostly on the table, sometimes on something.
            _ if rng.random_bool(0.7) => self.on_table(label, size, &all, None, rng),
            _ => {
                let places =
                    ["stove", "wooden cabinet", "ramekin", "top drawer of the wooden cabinet"];
                let place = places[rng.random_range(0..places.len())];
                self.supported(place, references, bowls, rng)
            }
        }
    }

    fn supported(
        &self,
        name: &str,
        references: &[Thing],
        bowls: &[Thing],
        rng: &mut ChaCha8Rng,
    ) -> Option<Thing> {
        let (label, size) = BOWL;
        let mut jitter = |half: f64| rng.random_range(-half..half);
        if name.starts_with("top drawer") {
            let part = self.fixtures.first()?.parts.first()?;
            let [x, y, z] = part.position_m;
            let at = [x + jitter(0.03), y + jitter(0.03), z];
            return Self::free_spot(thing(label, size, at, Support::Drawer(0)), bowls);
        }
        let reference = references.iter().position(|r| spoken(&r.detection.label) == name);
        let (base, support, half) = match reference {
            Some(index) => (&references[index].detection, Support::Thing(index), 0.01),
            None => {
                let index = self.fixtures.iter().position(|f| spoken(&f.label) == name)?;
                (&self.fixtures[index], Support::Fixture(index), 0.04)
            }
        };
        let [x, y, _] = base.position_m;
        let at = [x + jitter(half), y + jitter(half), base.top_m() + size[2] / 2.0];
        Self::free_spot(thing(label, size, at, support), bowls)
    }

    /// `thing`, unless another bowl is already there.
    fn free_spot(thing: Thing, bowls: &[Thing]) -> Option<Thing> {
        let own = disc(&thing.detection);
        let clash = |bowl: &Thing| {
            own.free(&disc(&bowl.detection)) < 0.01
                && (bowl.detection.position_m[2] - thing.detection.position_m[2]).abs() < 0.06
        };
        (!bowls.iter().any(clash)).then_some(thing)
    }

    fn middle(&self, names: &[&str], references: &[Thing]) -> Option<[f64; 2]> {
        let mut sum = [0.0; 2];
        for name in names {
            let at = if *name == "table" {
                [TABLE.centre_m[0], TABLE.centre_m[1]]
            } else {
                let things = references.iter().map(|thing| &thing.detection).chain(&self.fixtures);
                disc(things.into_iter().find(|thing| spoken(&thing.label) == *name)?).at
            };
            sum = [sum[0] + at[0], sum[1] + at[1]];
        }
        Some(sum.map(|value| value / names.len() as f64))
    }
}

fn draw_query(rng: &mut ChaCha8Rng) -> Query {
    let supports = ["ramekin", "cookie box", "stove", "wooden cabinet"];
    let places = ["plate", "ramekin", "cookie box"];
    let support = supports[rng.random_range(0..supports.len())];
    let place = places[rng.random_range(0..places.len())];
    let placed = |relation, references, negated| Query::Placed { relation, references, negated };
    let on = |negated| Query::Supported { relation: Relation::On, reference: support, negated };
    let drawer = "top drawer of the wooden cabinet";
    match rng.random_range(0..18) {
        0 | 1 => Query::Name(PRODUCTS[rng.random_range(0..PRODUCTS.len())].0),
        2 | 3 => on(false),
        4 => on(true),
        5 => Query::Supported { relation: Relation::In, reference: drawer, negated: false },
        6 | 7 => placed(Relation::NextTo, vec![place], false),
        8 => placed(Relation::NextTo, vec![place], true),
        9 => placed(Relation::Between, vec!["plate", "ramekin"], false),
        10 => placed(Relation::Between, vec!["plate", "ramekin"], true),
        11 => placed(Relation::AtCentre, vec!["table"], false),
        12 => placed(Relation::LeftOf, vec![place], false),
        13 => placed(Relation::RightOf, vec![place], false),
        14 => placed(Relation::InFrontOf, vec![place], false),
        15 => placed(Relation::Behind, vec![place], false),
        16 => Query::Leading { relation: Relation::NearestTo, reference: Some(place) },
        _ => {
            let relation =
                if rng.random_bool(0.5) { Relation::AtLeft } else { Relation::AtRight };
            Query::Leading { relation, reference: None }
        }
    }
}

/// How people call a label.
fn spoken(label: &str) -> &'static str {
    match label {
        "plate" => "plate",
        "glazed_rim_porcelain_ramekin" => "ramekin",
        "cookies" => "cookie box",
        "flat_stove" => "stove",
        "wooden_cabinet" => "wooden cabinet",
        _ => "object",
    }
}

fn disc(detection: &Detection) -> Disc {
    let [x, y, _] = detection.position_m;
    Disc { at: [x, y], half: [detection.size_m[0] / 2.0, detection.size_m[1] / 2.0] }
}

fn thing(label: &str, size_m: [f64; 3], position_m: [f64; 3], support: Support) -> Thing {
    Thing { detection: fixture(label, position_m, size_m), support }
}

fn fixture(label: &str, position_m: [f64; 3], size_m: [f64; 3]) -> Detection {
    Detection {
        id: 0,
        label: label.to_owned(),
        confidence: 1.0,
        position_m,
        size_m,
        box_px: None,
        colour: None,
        parts: Vec::new(),
    }
}

fn fixtures() -> Vec<Detection> {
    let mut cabinet = fixture("wooden_cabinet", [0.50, -0.62, 0.12], [0.25, 0.20, 0.24]);
    cabinet.parts.push(Part {
        name: "top drawer".to_owned(),
        position_m: [0.50, -0.48, 0.17],
        size_m: [0.22, 0.26, 0.07],
    });
    vec![cabinet, fixture("flat_stove", [0.42, 0.60, 0.02], [0.2, 0.2, 0.04])]
}

/// A camera opposite the robot, looking down at 30 degrees.
fn camera() -> Camera {
    let (down, level) = (0.5, 0.75_f64.sqrt());
    Camera {
        name: "agentview".to_owned(),
        image_size_px: [256, 256],
        focal_px: [309.0, 309.0],
        principal_px: [128.0, 128.0],
        position_m: [1.35, 0.0, 0.55],
        rotation: [[0.0, down, -level], [1.0, 0.0, 0.0], [0.0, -level, -down]],
    }
}
