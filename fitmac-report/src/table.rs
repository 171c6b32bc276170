//! Tables as data: what the writers of Markdown, JSON and HTML share.

use serde::Serialize;

use crate::paper::PaperRates;
use crate::select::Rates;
use crate::stats::Share;

/// What a table is about, in the order of the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Topic {
    /// The main table.
    Success,
    /// Harm and savings.
    Cost,
    /// All surrogates.
    Surrogates,
    /// What each module is worth.
    Modules,
    /// How much a parameter matters.
    Sweeps,
    /// How much the seed matters.
    Seeds,
    /// How soon and how long.
    Timing,
    /// How failures failed.
    Failures,
}

impl Topic {
    /// For headings.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Success => "Success and interventions",
            Self::Cost => "What it costs and saves",
            Self::Surrogates => "Surrogates",
            Self::Modules => "What each module is worth",
            Self::Sweeps => "Sweeps",
            Self::Seeds => "Seeds",
            Self::Timing => "Time to detect, corrections",
            Self::Failures => "Failures",
        }
    }
}

/// A table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// What it is about.
    pub topic: Topic,
    /// Identifier, unique within the report.
    pub id: String,
    /// Heading.
    pub title: String,
    /// What it shows and how to read it.
    pub caption: String,
    /// Heading of the column of the rows' names.
    pub rows_are: String,
    /// Columns.
    pub columns: Vec<Column>,
    /// Rows.
    pub rows: Vec<Row>,
}

/// A column.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Column {
    /// What neighbouring columns have in common; empty if nothing.
    pub group: String,
    /// Its own name.
    pub name: String,
}

impl Column {
    /// A column of a group.
    pub fn new(group: impl Into<String>, name: impl Into<String>) -> Self {
        Self {
            group: group.into(),
            name: name.into(),
        }
    }
}

/// A row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Its name.
    pub name: String,
    /// One cell a column.
    pub cells: Vec<Cell>,
}

impl Row {
    /// A row.
    pub fn new(name: impl Into<String>, cells: Vec<Cell>) -> Self {
        Self {
            name: name.into(),
            cells,
        }
    }
}

/// A cell: what was measured and, where there is one, the paper's figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Cell {
    /// Nothing.
    Empty,
    /// The success rate.
    Success {
        /// Ours.
        ours: Option<Rates>,
        /// The paper's.
        paper: Option<PaperRates>,
    },
    /// SR/IR/RSR.
    Rates {
        /// Ours.
        ours: Option<Rates>,
        /// The paper's.
        paper: Option<PaperRates>,
    },
    /// A share.
    Share {
        /// Ours.
        ours: Option<Share>,
        /// The paper's, in percent.
        paper: Option<f64>,
    },
    /// A number.
    Number {
        /// Ours.
        ours: Option<f64>,
        /// What it spreads by.
        spread: Option<f64>,
        /// The paper's.
        paper: Option<f64>,
        /// Digits after the point.
        digits: usize,
    },
    /// A count.
    Count {
        /// How many.
        ours: u64,
    },
    /// A text.
    Text {
        /// Which.
        ours: String,
    },
}

impl Cell {
    /// A number without spread or paper.
    #[must_use]
    pub fn number(ours: Option<f64>, digits: usize) -> Self {
        Self::compared(ours, None, digits)
    }

    /// A number beside the paper's.
    #[must_use]
    pub fn compared(ours: Option<f64>, paper: Option<f64>, digits: usize) -> Self {
        Self::Number {
            ours,
            spread: None,
            paper,
            digits,
        }
    }

    /// A share without the paper's.
    #[must_use]
    pub fn share(ours: Option<Share>) -> Self {
        Self::Share { ours, paper: None }
    }

    /// What was measured, as text; a dash if nothing was.
    #[must_use]
    pub fn ours(&self) -> String {
        let none = || "–".to_owned();
        match self {
            Self::Empty => String::new(),
            Self::Success { ours, .. } => ours.map_or_else(none, |r| percent(r.sr)),
            Self::Rates { ours, .. } => ours.map_or_else(none, |r| {
                let recovered = r.rsr.map_or_else(none, percent);
                format!("{}/{}/{recovered}", percent(r.sr), percent(r.ir))
            }),
            Self::Share { ours, .. } => ours.map_or_else(none, percent),
            Self::Number {
                ours,
                spread,
                digits,
                ..
            } => ours.map_or_else(none, |value| match spread {
                Some(spread) => format!("{value:.digits$} ± {spread:.digits$}"),
                None => format!("{value:.digits$}"),
            }),
            Self::Count { ours } => ours.to_string(),
            Self::Text { ours } => ours.clone(),
        }
    }

    /// The Wilson 95 % interval of the share, or of the success rate, in percent.
    #[must_use]
    pub fn interval(&self) -> Option<String> {
        let share = self.main_share()?;
        Some(format!(
            "{:.1}–{:.1}",
            100.0 * share.low,
            100.0 * share.high
        ))
    }

    /// How many of how many.
    #[must_use]
    pub fn count(&self) -> Option<String> {
        let share = self.main_share()?;
        Some(format!("{} of {}", share.hits, share.of))
    }

    fn main_share(&self) -> Option<Share> {
        match self {
            Self::Success { ours, .. } | Self::Rates { ours, .. } => ours.map(|r| r.sr),
            Self::Share { ours, .. } => *ours,
            _ => None,
        }
    }

    /// The paper's figure, as text.
    #[must_use]
    pub fn paper(&self) -> Option<String> {
        let dash = |v: Option<f64>| v.map_or_else(|| "–".to_owned(), |v| format!("{v:.1}"));
        match self {
            Self::Success { paper, .. } => paper.map(|p| format!("{:.1}", p.sr)),
            Self::Rates { paper, .. } => {
                paper.map(|p| format!("{:.1}/{}/{}", p.sr, dash(p.ir), dash(p.rsr)))
            }
            Self::Share { paper, .. } => paper.map(|p| format!("{p:.1}")),
            Self::Number { paper, digits, .. } => paper.map(|p| format!("{p:.digits$}")),
            Self::Empty | Self::Count { .. } | Self::Text { .. } => None,
        }
    }
}

fn percent(share: Share) -> String {
    let value = 100.0 * share.share;
    // A few of very many must not read as none.
    if share.hits > 0 && value < 0.05 {
        format!("{value:.3}")
    } else {
        format!("{value:.1}")
    }
}
