//! The paper's experiments as named grids.

use super::config::{Config, Knowledge, Profile, Vision};
use super::grid::Grid;
use crate::backbone::bc;
use crate::error::SimError;
use crate::perturb::{Level, Perturbation};

/// The paper's seeds: for reports only.
pub const PAPER_SEEDS: [u64; 5] = [7, 11, 13, 17, 23];
/// Seeds for choosing parameters: never in a report.
pub const TUNING_SEEDS: std::ops::RangeInclusive<u64> = 1_000..=9_999;

/// An experiment of the paper, or one that we added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Tables 1 and 2: ten cells, 50 episodes a task, the base policy beside it.
    Main,
    /// Tables 5 and 6: three backbones.
    Backbones,
    /// Tables 3, 9 and 10: what each module is worth to the main backbone.
    Ablation,
    /// Tables 9 and 10, the other backbone, with half of the paper's episodes.
    AblationPi05,
    /// Tables 4 and 11 to 18: four parameters, with half of the paper's episodes.
    Sweeps,
    /// Tables 7 and 8: five seeds.
    Seeds,
    /// Ours: nominal scenes and perturbed ones, all backbones and one that is always right, and
    /// what the controller costs them.
    Harm,
    /// Ours: the same with the parameters as published, with half of the episodes.
    Contrast,
    /// Ours: how far a target can be displaced before the policy alone loses it.
    Displacement,
    /// Ours: the surrogate that learned from demonstrations, in nominal and perturbed scenes.
    Learned,
    /// A few episodes of everything, to see that it works.
    Smoke,
}

/// The surrogates that stand for the paper's backbones.
const BACKBONES: [&str; 3] = ["openvla-like", "pi0-like", "pi05-like"];
/// The paper's ablations.
const ABLATION: [&str; 6] = [
    "base",
    "full",
    "wo-target",
    "wo-execution",
    "wo-hard-pick",
    "wo-hard-place",
];
/// Episodes a task where half of the paper's ten are enough for what is asked.
const HALF: u32 = 5;
/// The paper's sweeps: parameter and values, the default left out.
const SWEEPS: [(&str, &[&str]); 4] = [
    ("gate.failure_streak", &["2", "4"]),
    ("gate.confidence", &["0.10", "0.18"]),
    ("gate.rescue_min_step", &["8", "16"]),
    ("horizon.execution_steps", &["1", "3", "4"]),
];

impl Preset {
    /// All of them, what matters most first.
    pub const ALL: [Self; 11] = [
        Self::Main,
        Self::Harm,
        Self::Backbones,
        Self::Ablation,
        Self::Seeds,
        Self::Sweeps,
        Self::Contrast,
        Self::Displacement,
        Self::AblationPi05,
        Self::Learned,
        Self::Smoke,
    ];

    /// The name that command lines use.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Main => "main",
            Self::Backbones => "backbones",
            Self::Ablation => "ablation",
            Self::AblationPi05 => "ablation-pi05",
            Self::Sweeps => "sweeps",
            Self::Seeds => "seeds",
            Self::Harm => "harm",
            Self::Contrast => "contrast",
            Self::Displacement => "displacement",
            Self::Learned => "learned",
            Self::Smoke => "smoke",
        }
    }

    /// The preset of that name.
    ///
    /// # Errors
    /// [`SimError::Unknown`], listing the names that exist.
    pub fn by_name(name: &str) -> Result<Self, SimError> {
        let names = Self::ALL.iter().map(|p| p.name());
        Self::ALL
            .into_iter()
            .find(|p| p.name() == name)
            .ok_or_else(|| SimError::unknown("preset", name, names))
    }

    /// Its grid.
    ///
    /// # Errors
    /// Only if a parameter of a sweep no longer exists, which a test rules out.
    pub fn grid(self) -> Result<Grid, SimError> {
        let owned = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect();
        let configs = |names: &[&str]| -> Result<Vec<Config>, SimError> {
            names.iter().map(|n| Config::parse(n)).collect()
        };
        let five = || {
            Perturbation::ALL[1..]
                .iter()
                .map(|p| (*p, Level::Standard))
                .collect::<Vec<_>>()
        };
        let usual = Grid {
            suites: owned(&["object", "spatial"]),
            tasks: Vec::new(),
            perturbations: five(),
            backbones: owned(&BACKBONES[..1]),
            configs: configs(&["base", "full"])?,
            profiles: vec![Profile::Guarded],
            visions: vec![Vision::Modelled],
            knowledges: vec![Knowledge::Agents],
            seeds: vec![PAPER_SEEDS[0]],
            episodes: 10,
        };
        let nominal = vec![(Perturbation::None, Level::Standard)];
        Ok(match self {
            Self::Main => Grid {
                perturbations: [nominal, five()].concat(),
                episodes: 50,
                ..usual
            },
            Self::Backbones => Grid {
                backbones: owned(&BACKBONES),
                ..usual
            },
            Self::Ablation => Grid {
                configs: configs(&ABLATION)?,
                ..usual
            },
            Self::AblationPi05 => Grid {
                configs: configs(&ABLATION)?,
                backbones: owned(&BACKBONES[2..]),
                episodes: HALF,
                ..usual
            },
            Self::Sweeps => {
                let mut swept = configs(&["full"])?;
                for (parameter, values) in SWEEPS {
                    for value in values {
                        swept.push(Config::parse(&format!("full+{parameter}={value}"))?);
                    }
                }
                Grid {
                    configs: swept,
                    episodes: HALF,
                    ..usual
                }
            }
            Self::Seeds => Grid {
                configs: configs(&["full"])?,
                seeds: PAPER_SEEDS.to_vec(),
                ..usual
            },
            Self::Harm => Grid {
                perturbations: [nominal, five()].concat(),
                backbones: owned(&[&BACKBONES[..], &["oracle"]].concat()),
                ..usual
            },
            Self::Contrast => Grid {
                perturbations: [nominal, five()].concat(),
                backbones: owned(&BACKBONES),
                profiles: vec![Profile::Paper],
                episodes: HALF,
                ..usual
            },
            Self::Displacement => {
                let steps = [0.02, 0.04, 0.06, 0.08, 0.10, 0.15, 0.20, 0.30];
                let levels = steps.map(|d| (Perturbation::Pos, Level::DisplacedM(d)));
                Grid {
                    suites: owned(&["object"]),
                    perturbations: [nominal, levels.to_vec()].concat(),
                    episodes: HALF,
                    ..usual
                }
            }
            Self::Learned => Grid {
                perturbations: [nominal, five()].concat(),
                backbones: owned(&[bc::NAME]),
                ..usual
            },
            Self::Smoke => Grid {
                perturbations: [nominal, five()].concat(),
                seeds: vec![*TUNING_SEEDS.start()],
                episodes: 1,
                ..usual
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::{HashMap, HashSet};

    use super::*;
    use crate::evaluation::EpisodeSpec;
    use crate::evaluation::episode::made;
    use crate::suite::Suite;

    #[test]
    fn presets_have_the_papers_numbers_of_episodes() {
        let count = |p: Preset| p.grid().unwrap().episodes().unwrap().len();
        // Suites, tasks, cells, episodes, configurations.
        assert_eq!(count(Preset::Main), 2 * 10 * 6 * 50 * 2);
        assert_eq!(count(Preset::Backbones), 2 * 10 * 5 * 10 * 2 * 3);
        assert_eq!(count(Preset::Ablation), 2 * 10 * 5 * 10 * 6);
        assert_eq!(count(Preset::Seeds), 2 * 10 * 5 * 10 * 5);
        // Half of them.
        assert_eq!(count(Preset::AblationPi05), 2 * 10 * 5 * 5 * 6);
        assert_eq!(count(Preset::Sweeps), 2 * 10 * 5 * 5 * 10);
        // The policy alone and with the controller.
        assert_eq!(count(Preset::Learned), 2 * 10 * 6 * 10 * 2);
    }

    #[test]
    fn presets_share_episodes() {
        let keys = |preset: Preset| -> HashSet<String> {
            let specs = preset.grid().unwrap().episodes().unwrap();
            specs.iter().map(EpisodeSpec::key).collect()
        };
        let main = keys(Preset::Main);
        let apart = |preset| keys(preset).difference(&main).count();
        assert_eq!(apart(Preset::Backbones), 2 * 10 * 5 * 10 * 2 * 2);
        assert_eq!(apart(Preset::Ablation), 2 * 10 * 5 * 10 * 4);
        assert_eq!(apart(Preset::Seeds), 2 * 10 * 5 * 10 * 4);
        assert_eq!(apart(Preset::Sweeps), 2 * 10 * 5 * 5 * 9);
        let everything: HashSet<String> = Preset::ALL[..9].iter().flat_map(|p| keys(*p)).collect();
        assert!(everything.len() < 40_000, "{}", everything.len());
    }

    /// An evaluation of hours must not end at an episode that cannot be drawn.
    #[test]
    fn every_episode_of_every_preset_can_be_drawn() {
        let mut known = HashSet::new();
        let mut suites = HashMap::new();
        for preset in Preset::ALL {
            for spec in preset.grid().unwrap().episodes().unwrap() {
                let cell = (spec.perturbation, spec.level.label(), spec.draw_seed());
                if !known.insert(cell) {
                    continue;
                }
                let suite = suites
                    .entry(spec.suite.clone())
                    .or_insert_with(|| Suite::open(&spec.suite).unwrap());
                if let Err(error) = made(suite, &spec) {
                    panic!("{}: {error}", spec.key());
                }
            }
        }
    }

    #[test]
    fn reports_and_tuning_share_no_seed() {
        assert!(PAPER_SEEDS.iter().all(|seed| !TUNING_SEEDS.contains(seed)));
    }
}
