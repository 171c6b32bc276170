//! Which episodes a cell is made of.

use std::collections::hash_map::Entry;
use std::collections::{BTreeSet, HashMap, HashSet};

use serde::Serialize;
use sim_harness::evaluation::{EpisodeRecord, PAPER_SEEDS, TUNING_SEEDS};

use crate::stats::Share;

/// The paper's order of perturbations.
pub const PERTURBATIONS: [&str; 5] = ["obj", "pos", "sem", "task", "env"];
/// The suites, in the paper's order.
pub const SUITES: [&str; 2] = ["object", "spatial"];
/// The surrogate that stands for the paper's main backbone.
pub const MAIN: &str = "openvla-like";
/// The level that tables are made of.
pub const STANDARD: &str = "standard";
/// The policy alone.
pub const BASE: &str = "base";
/// The whole controller.
pub const FULL: &str = "full";

/// What seeds are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SeedClass {
    /// The paper's: for reports.
    Paper,
    /// 1000 to 9999: for choosing parameters.
    Tuning,
    /// Any others.
    Other,
}

impl SeedClass {
    /// The class of a seed.
    #[must_use]
    pub fn of(seed: u64) -> Self {
        if PAPER_SEEDS.contains(&seed) {
            Self::Paper
        } else if TUNING_SEEDS.contains(&seed) {
            Self::Tuning
        } else {
            Self::Other
        }
    }

    /// What a reader has to know.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Paper => "the paper's seeds, never used for choosing parameters",
            Self::Tuning => "tuning seeds (1000 to 9999): for choosing parameters, not a result",
            Self::Other => "neither the paper's seeds nor tuning seeds",
        }
    }
}

/// Under which the controller ran.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct Setting {
    /// Its parameters.
    pub profile: String,
    /// What it sees.
    pub perception: String,
    /// Who grounds.
    pub knowledge: String,
}

impl Setting {
    /// Of an episode.
    #[must_use]
    pub fn of(record: &EpisodeRecord) -> Self {
        Self {
            profile: record.profile.clone(),
            perception: record.perception.clone(),
            knowledge: record.knowledge.clone(),
        }
    }

    /// For headings.
    #[must_use]
    pub fn label(&self) -> String {
        let who = match self.knowledge.as_str() {
            "agents" => "own grounding",
            _ => "grounding from the simulator",
        };
        format!("{} profile, {} poses, {who}", self.profile, self.perception)
    }

    /// For identifiers.
    #[must_use]
    pub fn slug(&self) -> String {
        format!("{}-{}-{}", self.profile, self.perception, self.knowledge)
    }
}

/// The paper's three rates (equation 10).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rates {
    /// Success rate.
    pub sr: Share,
    /// Intervention rate: episodes with at least one replaced action.
    pub ir: Share,
    /// Recovered success rate: successes among those; none without interventions.
    pub rsr: Option<Share>,
}

impl Rates {
    /// Of some episodes; `None` of none.
    #[must_use]
    pub fn of(records: &[&EpisodeRecord]) -> Option<Self> {
        let intervened: Vec<_> = records.iter().filter(|r| r.intervened).collect();
        Some(Self {
            sr: Share::of(records, |r| r.success)?,
            ir: Share::of(records, |r| r.intervened)?,
            rsr: Share::of(intervened, |r| r.success),
        })
    }
}

/// What the starts and the noise of an episode are drawn from, within a suite.
type Draw<'a> = (&'a str, u64, u32);

fn draw_of(record: &EpisodeRecord) -> Draw<'_> {
    (&record.task, record.seed, record.episode)
}

fn cell_of(record: &EpisodeRecord) -> (&str, &str) {
    (&record.suite, &record.perturbation)
}

/// The episodes that a report is about: those of one class of seeds.
#[derive(Clone, Debug)]
pub struct Episodes<'a> {
    records: Vec<&'a EpisodeRecord>,
    /// The class of their seeds.
    pub class: SeedClass,
    /// How many episodes of other classes were left out.
    pub left_out: usize,
}

impl<'a> Episodes<'a> {
    /// The episodes of the best class that occurs: classes are never pooled.
    #[must_use]
    pub fn of(records: &'a [EpisodeRecord]) -> Self {
        let class = |r: &EpisodeRecord| SeedClass::of(r.seed);
        let best = records.iter().map(class).min().unwrap_or(SeedClass::Other);
        let mut alone = HashSet::new();
        let kept: Vec<_> = records
            .iter()
            .filter(|r| class(r) == best)
            // The policy alone plays the same whatever stands beside it.
            .filter(|r| r.config != BASE || alone.insert(r.pair_key()))
            .collect();
        Self {
            left_out: records.iter().filter(|r| class(r) != best).count(),
            records: kept,
            class: best,
        }
    }

    /// All of them.
    #[must_use]
    pub fn all(&self) -> &[&'a EpisodeRecord] {
        &self.records
    }

    /// Values of a field, sorted.
    #[must_use]
    pub fn values(&self, field: impl Fn(&'a EpisodeRecord) -> &'a str) -> Vec<&'a str> {
        let set: BTreeSet<_> = self.records.iter().map(|r| field(r)).collect();
        set.into_iter().collect()
    }

    /// The surrogates that occur: the paper's first, in the paper's order, then the others.
    #[must_use]
    pub fn backbones(&self) -> Vec<&'a str> {
        let rank = |name: &str| {
            ["openvla-like", "pi0-like", "pi05-like"]
                .iter()
                .position(|n| *n == name)
        };
        let mut names = self.values(|r| &r.backbone);
        names.sort_by_key(|name| (rank(name).unwrap_or(usize::MAX), *name));
        names
    }

    /// Under which settings the controller ran; for results of policies alone, what those say.
    #[must_use]
    pub fn settings(&self) -> Vec<Setting> {
        let of = |base: bool| -> BTreeSet<Setting> {
            self.records
                .iter()
                .filter(|r| base || r.config != BASE)
                .map(|r| Setting::of(r))
                .collect()
        };
        let with = of(false);
        if with.is_empty() {
            of(true).into_iter().take(1).collect()
        } else {
            with.into_iter().collect()
        }
    }

    /// The settings that have tables of their own. One that differs from another with more episodes
    /// only in who grounds is there for the comparison of the two.
    #[must_use]
    pub fn own_settings(&self) -> Vec<Setting> {
        let settings = self.settings();
        let count = |setting: &Setting| {
            let controlled = self.records.iter().filter(|r| r.config != BASE);
            controlled.filter(|r| Setting::of(r) == *setting).count()
        };
        let beside = |a: &Setting, b: &Setting| {
            (&a.profile, &a.perception) == (&b.profile, &b.perception) && count(b) > count(a)
        };
        let contrast = |a: &Setting| settings.iter().any(|b| beside(a, b));
        settings.iter().filter(|s| !contrast(s)).cloned().collect()
    }

    /// Whether some episode has a surrogate and configuration under a setting, at the standard level.
    #[must_use]
    pub fn has(&self, backbone: &str, config: &str, setting: &Setting) -> bool {
        !self.of_config(backbone, config, setting).is_empty()
    }

    /// The episodes of a configuration under a setting, at the standard level.
    #[must_use]
    pub fn of_config(
        &self,
        backbone: &str,
        config: &str,
        setting: &Setting,
    ) -> Vec<&'a EpisodeRecord> {
        self.records
            .iter()
            .copied()
            .filter(|r| r.level == STANDARD && r.backbone == backbone && r.config == config)
            .filter(|r| r.config == BASE || Setting::of(r) == *setting)
            .collect()
    }

    /// Only those episodes whose draws all of some players (surrogate and configuration) have
    /// played in the same cell: what a table compares is then played on the same draws. A player
    /// that has played nothing of a cell does not count there.
    #[must_use]
    pub fn on_common_draws(&self, players: &[(&str, &str)], setting: &Setting) -> Self {
        let mut common: HashMap<(&str, &str), HashSet<Draw<'_>>> = HashMap::new();
        for (backbone, config) in players {
            let mut own: HashMap<_, HashSet<Draw<'_>>> = HashMap::new();
            for record in self.of_config(backbone, config, setting) {
                own.entry(cell_of(record))
                    .or_default()
                    .insert(draw_of(record));
            }
            for (cell, draws) in own {
                match common.entry(cell) {
                    Entry::Occupied(mut known) => known.get_mut().retain(|d| draws.contains(d)),
                    Entry::Vacant(free) => {
                        free.insert(draws);
                    }
                }
            }
        }
        let shared = |record: &&&EpisodeRecord| {
            let draws = common.get(&cell_of(record));
            draws.is_none_or(|draws| draws.contains(&draw_of(record)))
        };
        Self {
            records: self.records.iter().filter(shared).copied().collect(),
            ..*self
        }
    }

    /// The episodes of a cell.
    #[must_use]
    pub fn cell(&self, at: &Cell<'_>) -> Vec<&'a EpisodeRecord> {
        let mut chosen = self.of_config(at.backbone, at.config, at.setting);
        chosen.retain(|r| r.suite == at.suite && r.perturbation == at.perturbation);
        chosen
    }

    /// The rates of a cell.
    #[must_use]
    pub fn rates(&self, at: &Cell<'_>) -> Option<Rates> {
        Rates::of(&self.cell(at))
    }
}

/// A cell of the paper's grid.
#[derive(Clone, Copy, Debug)]
pub struct Cell<'a> {
    /// Suite.
    pub suite: &'a str,
    /// Perturbation.
    pub perturbation: &'a str,
    /// Surrogate.
    pub backbone: &'a str,
    /// What of the controller is on.
    pub config: &'a str,
    /// Under which it ran.
    pub setting: &'a Setting,
}
