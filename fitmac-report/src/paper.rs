//! The paper's own figures, for the columns beside ours.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::ReportError;

/// The figures, embedded.
const FIGURES: &str = include_str!("../assets/paper.toml");

/// Rates that the paper reports, in percent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PaperRates {
    /// Success rate.
    pub sr: f64,
    /// Intervention rate, where given.
    pub ir: Option<f64>,
    /// Recovered success rate, where given.
    pub rsr: Option<f64>,
}

/// Which group of the paper's tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Experiment {
    /// Table 1: other methods.
    Others,
    /// Tables 1 and 2.
    Main,
    /// Table 5.
    Backbones,
    /// Tables 9 and 10.
    Ablation,
    /// Tables 11 to 18.
    Sweeps,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    #[expect(dead_code, reason = "says where the figures stand")]
    table: u32,
    experiment: Experiment,
    suite: String,
    model: String,
    config: String,
    cells: BTreeMap<String, Vec<f64>>,
}

/// All of the paper's figures.
#[derive(Clone, Debug)]
pub struct Paper {
    rows: Vec<Row>,
}

/// The paper's model that a surrogate stands for.
#[must_use]
pub fn model_of(surrogate: &str) -> Option<&'static str> {
    match surrogate {
        "openvla-like" => Some("OpenVLA"),
        "pi0-like" => Some("pi0"),
        "pi05-like" => Some("pi0.5"),
        _ => None,
    }
}

impl Paper {
    /// The embedded figures.
    ///
    /// # Errors
    /// Only if the embedded file is broken, which a test rules out.
    pub fn embedded() -> Result<Self, ReportError> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct File {
            row: Vec<Row>,
        }
        let file: File = toml::from_str(FIGURES).map_err(|e| ReportError::Embedded {
            file: "paper.toml",
            problem: e.to_string(),
        })?;
        Ok(Self { rows: file.row })
    }

    /// A cell by the paper's model, if the paper has it.
    #[must_use]
    pub fn of_model(
        &self,
        experiment: Experiment,
        suite: &str,
        perturbation: &str,
        model: &str,
        config: &str,
    ) -> Option<PaperRates> {
        let row = self.rows.iter().find(|r| {
            r.experiment == experiment && r.suite == suite && r.model == model && r.config == config
        })?;
        let rates = row.cells.get(perturbation)?;
        Some(PaperRates {
            sr: *rates.first()?,
            ir: rates.get(1).copied(),
            rsr: rates.get(2).copied(),
        })
    }

    /// A cell by the surrogate that stands for the paper's model.
    #[must_use]
    pub fn get(
        &self,
        experiment: Experiment,
        suite: &str,
        perturbation: &str,
        surrogate: &str,
        config: &str,
    ) -> Option<PaperRates> {
        let model = model_of(surrogate)?;
        self.of_model(experiment, suite, perturbation, model, config)
    }

    /// The models of Table 1 that are neither the paper's backbones nor its method.
    #[must_use]
    pub fn others(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for row in self
            .rows
            .iter()
            .filter(|r| r.experiment == Experiment::Others)
        {
            if !names.contains(&row.model.as_str()) {
                names.push(&row.model);
            }
        }
        names
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The paper's averages over the five perturbations are computed from its cells.
    fn mean(paper: &Paper, experiment: Experiment, suite: &str, who: &str, config: &str) -> f64 {
        ["obj", "pos", "sem", "task", "env"]
            .iter()
            .map(|p| paper.get(experiment, suite, p, who, config).unwrap().sr)
            .sum::<f64>()
            / 5.0
    }

    #[test]
    fn the_figures_are_those_of_the_paper() {
        let paper = Paper::embedded().unwrap();
        let near = |a: f64, b: f64| assert!((a - b).abs() < 0.051, "{a} is not {b}");
        // Table 1.
        let both = |config| {
            let of = |suite| mean(&paper, Experiment::Main, suite, "openvla-like", config);
            0.5 * (of("object") + of("spatial"))
        };
        near(both("base"), 45.9);
        near(both("full"), 78.7);
        // Table 6.
        let six = [
            ("object", "openvla-like", 39.2, 85.4),
            ("object", "pi0-like", 42.6, 78.4),
            ("object", "pi05-like", 57.0, 79.4),
            ("spatial", "openvla-like", 52.6, 72.0),
            ("spatial", "pi0-like", 50.8, 67.4),
            ("spatial", "pi05-like", 52.2, 69.2),
        ];
        for (suite, who, base, full) in six {
            near(
                mean(&paper, Experiment::Backbones, suite, who, "base"),
                base,
            );
            near(
                mean(&paper, Experiment::Backbones, suite, who, "full"),
                full,
            );
        }
        // Table 3.
        let three = [
            ("wo-target", 77.2, 69.8),
            ("wo-execution", 47.0, 62.4),
            ("wo-hard-pick", 50.2, 70.0),
            ("wo-hard-place", 63.2, 64.0),
        ];
        for (config, object, spatial) in three {
            near(
                mean(
                    &paper,
                    Experiment::Ablation,
                    "object",
                    "openvla-like",
                    config,
                ),
                object,
            );
            near(
                mean(
                    &paper,
                    Experiment::Ablation,
                    "spatial",
                    "openvla-like",
                    config,
                ),
                spatial,
            );
        }
        // Table 4, its last row: execution horizon 1, 2, 3.
        for (value, object, spatial) in [(1, 68.0, 72.0), (2, 85.4, 70.0), (3, 87.4, 69.8)] {
            let config = format!("full+horizon.execution_steps={value}");
            near(
                mean(
                    &paper,
                    Experiment::Sweeps,
                    "object",
                    "openvla-like",
                    &config,
                ),
                object,
            );
            near(
                mean(
                    &paper,
                    Experiment::Sweeps,
                    "spatial",
                    "openvla-like",
                    &config,
                ),
                spatial,
            );
        }
    }

    #[test]
    fn dashes_stay_dashes() {
        let paper = Paper::embedded().unwrap();
        let cell = |s, p, c| {
            paper
                .get(Experiment::Ablation, s, p, "openvla-like", c)
                .unwrap()
        };
        let none = cell("object", "task", "wo-execution");
        assert_eq!((none.sr, none.ir, none.rsr), (0.0, Some(0.0), None));
        assert_eq!(cell("spatial", "sem", "base").ir, None);
        assert_eq!(paper.others().len(), 6);
        assert!(
            paper
                .of_model(Experiment::Others, "object", "env", "NORA", "base")
                .is_none()
        );
        assert!(model_of("bc").is_none());
    }
}
