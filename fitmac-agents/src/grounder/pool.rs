//! What a name can refer to in a scene.

use crate::scene::{Detection, Scene};

use super::category::{Words, fit, is_packed};
use super::relation::Volume;

/// Something in the scene that can be named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Thing {
    /// Index into [`Scene::objects`].
    Object(usize),
    /// Index into [`Scene::fixtures`].
    Fixture(usize),
    /// Fixture and part.
    Part(usize, usize),
    /// The table.
    Table,
}

/// A thing that a name may mean, and how well it fits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Match {
    pub(super) thing: Thing,
    pub(super) volume: Volume,
    /// Fit of the name, 0 to 1.
    pub(super) fit: f64,
    /// The detector's confidence, 0 to 1.
    pub(super) confidence: f64,
}

/// Least fit at which a thing is considered at all.
pub(super) const FIT_MIN: f64 = 0.05;

/// A scene with its labels in lower case.
pub(super) struct Pool<'a> {
    pub(super) scene: &'a Scene,
    labels: Vec<String>,
}

impl<'a> Pool<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        let labels = scene
            .all()
            .map(|thing| thing.label.to_lowercase())
            .collect();
        Self { scene, labels }
    }

    /// Objects that `name` may mean.
    pub(super) fn objects(&self, name: &str) -> Vec<Match> {
        let words = Words::of(name);
        self.listed(&words, &self.scene.objects, 0, Thing::Object)
    }

    /// Objects, fixtures, parts and the table that `name` may mean.
    pub(super) fn named(&self, name: &str) -> Vec<Match> {
        let words = Words::of(name);
        let offset = self.scene.objects.len();
        let mut matches = Vec::new();
        // "Top drawer of cabinet" is no cabinet; "can of soup" is a soup.
        if name
            .split_once(" of ")
            .is_none_or(|(part, _)| is_packed(part))
        {
            matches = self.listed(&words, &self.scene.objects, 0, Thing::Object);
            matches.extend(self.listed(&words, &self.scene.fixtures, offset, Thing::Fixture));
        }
        self.parts(name, &mut matches);
        if let Some(table) = &self.scene.table {
            let fit = fit(&words, &Words::of("table"), None);
            if fit >= FIT_MIN {
                let [half_x, half_y] = table.half_extent_m;
                let [x, y, top] = table.centre_m;
                let volume = Volume {
                    centre_m: [x, y, top - 0.01],
                    size_m: [2.0 * half_x, 2.0 * half_y, 0.02],
                };
                matches.push(Match {
                    thing: Thing::Table,
                    volume,
                    fit,
                    confidence: 1.0,
                });
            }
        }
        matches
    }

    fn listed(
        &self,
        words: &Words<'_>,
        detections: &[Detection],
        offset: usize,
        thing: fn(usize) -> Thing,
    ) -> Vec<Match> {
        let mut matches = Vec::new();
        for (index, detection) in detections.iter().enumerate() {
            let Some(label) = self.labels.get(offset + index) else {
                continue;
            };
            let colour = detection.colour.as_deref();
            let fit = fit(words, &Words::of(label), colour);
            if fit >= FIT_MIN {
                matches.push(Match {
                    thing: thing(index),
                    volume: volume(detection),
                    fit,
                    confidence: detection.confidence,
                });
            }
        }
        matches
    }

    /// "Top drawer of wooden cabinet", or "top drawer" alone.
    fn parts(&self, name: &str, matches: &mut Vec<Match>) {
        let (part_name, whole) = match name.split_once(" of ") {
            Some((part, whole)) => (part, Some(Words::of(whole))),
            None => (name, None),
        };
        for (index, fixture) in self.scene.fixtures.iter().enumerate() {
            let Some(label) = self.labels.get(self.scene.objects.len() + index) else {
                continue;
            };
            let whole_fit = whole.as_ref().map_or(1.0, |whole| {
                fit(whole, &Words::of(label), fixture.colour.as_deref())
            });
            if whole_fit < FIT_MIN {
                continue;
            }
            for (at, part) in fixture.parts.iter().enumerate() {
                if has_all_words(&part.name, part_name) {
                    matches.push(Match {
                        thing: Thing::Part(index, at),
                        volume: Volume {
                            centre_m: part.position_m,
                            size_m: part.size_m,
                        },
                        fit: whole_fit,
                        confidence: fixture.confidence,
                    });
                }
            }
            if fixture.parts.is_empty() && whole.is_some() {
                // No geometry of the part: the whole must do.
                matches.push(Match {
                    thing: Thing::Fixture(index),
                    volume: volume(fixture),
                    fit: whole_fit * 0.6,
                    confidence: fixture.confidence,
                });
            }
        }
    }
}

/// The bounding box of a detection.
pub(super) fn volume(detection: &Detection) -> Volume {
    Volume {
        centre_m: detection.position_m,
        size_m: detection.size_m,
    }
}

/// True if `label` has each word of `name`, underscores and case aside.
fn has_all_words(label: &str, name: &str) -> bool {
    let mut words = name.split(' ').filter(|word| *word != "the");
    words.all(|word| {
        label
            .split(|c: char| !c.is_alphanumeric())
            .any(|part| part.eq_ignore_ascii_case(word))
    })
}
