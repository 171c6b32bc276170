//! Free spots for references, candidates and products.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::catalogue::{BOWL, PRODUCTS, TABLE, disc, spoken, thing};
use super::layout::{Layout, Query, Support, Thing, Wish};

impl Layout {
    /// LIBERO-Object's floor: products and a basket.
    pub(super) fn shelf(&mut self, name: &str, wish: Wish, rng: &mut ChaCha8Rng) -> Option<()> {
        self.fixtures.clear();
        let wanted = PRODUCTS.iter().find(|product| product.0 == name)?;
        let copies = if wish == Wish::One { 1 } else { 2 };
        let mut things = Vec::new();
        for _ in 0..copies {
            things.push(self.on_table(wanted.1, wanted.2, &things, None, rng)?);
        }
        let mut others: Vec<_> = PRODUCTS
            .iter()
            .filter(|product| product.0 != name)
            .collect();
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
    pub(super) fn on_table(
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
            let low = others
                .iter()
                .filter(|other| other.support == Support::Table);
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
    pub(super) fn bowl(
        &self,
        fit: bool,
        references: &[Thing],
        bowls: &[Thing],
        rng: &mut ChaCha8Rng,
    ) -> Option<Thing> {
        let (label, size) = BOWL;
        let all: Vec<Thing> = references.iter().chain(bowls).cloned().collect();
        match &self.query {
            Query::Supported {
                reference, negated, ..
            } if fit != *negated => self.supported(reference, references, bowls, rng),
            Query::Placed {
                references: names,
                negated,
                ..
            } if fit != *negated => {
                let centre = self.middle(names, references)?;
                self.on_table(label, size, &all, Some((centre, 0.22)), rng)
            }
            // Elsewhere: mostly on the table, sometimes on something.
            _ if rng.random_bool(0.7) => self.on_table(label, size, &all, None, rng),
            _ => {
                let places = [
                    "stove",
                    "wooden cabinet",
                    "ramekin",
                    "top drawer of the wooden cabinet",
                ];
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
        let reference = references
            .iter()
            .position(|r| spoken(&r.detection.label) == name);
        let (base, support, half) = match reference {
            Some(index) => (&references[index].detection, Support::Thing(index), 0.01),
            None => {
                let index = self
                    .fixtures
                    .iter()
                    .position(|f| spoken(&f.label) == name)?;
                (&self.fixtures[index], Support::Fixture(index), 0.04)
            }
        };
        let [x, y, _] = base.position_m;
        let at = [
            x + jitter(half),
            y + jitter(half),
            base.top_m() + size[2] / 2.0,
        ];
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
                let things = references
                    .iter()
                    .map(|thing| &thing.detection)
                    .chain(&self.fixtures);
                disc(
                    things
                        .into_iter()
                        .find(|thing| spoken(&thing.label) == *name)?,
                )
                .at
            };
            sum = [sum[0] + at[0], sum[1] + at[1]];
        }
        Some(sum.map(|value| value / names.len() as f64))
    }
}
