//! The figures, as a table or as JSON.

use fitmac_benches::rounds::Times;
use serde_json::{Value, json};

/// One contestant's figures.
pub(crate) struct Row {
    pub(crate) key: &'static str,
    pub(crate) what: &'static str,
    /// Only ours: the bound of its time in that of the first peer.
    pub(crate) at_most: Option<f64>,
    pub(crate) times: Times,
    /// Per call; none without Valgrind.
    pub(crate) instructions: Option<f64>,
}

/// Contestants that solved the same problems.
pub(crate) struct Group {
    pub(crate) title: &'static str,
    pub(crate) calls: usize,
    pub(crate) rounds: usize,
    pub(crate) rows: Vec<Row>,
}

/// A row's figures in those of the first peer: best rounds, medians, instructions.
struct Ratios {
    best: f64,
    median: f64,
    instructions: Option<f64>,
}

impl Group {
    fn ratios(&self, row: &Row) -> Ratios {
        let peer = self.rows.iter().find(|row| row.at_most.is_none());
        let peer = peer.unwrap_or(row);
        Ratios {
            best: row.times.best_ns / peer.times.best_ns,
            median: row.times.median_ns / peer.times.median_ns,
            instructions: row.instructions.zip(peer.instructions).map(|(a, b)| a / b),
        }
    }
}

/// What misses its bound, a sentence each. The ratio that counts is that of the medians; one that
/// is not a number misses too.
pub(crate) fn missed(groups: &[Group]) -> Vec<String> {
    let mut missed = Vec::new();
    for group in groups {
        for row in &group.rows {
            let Some(at_most) = row.at_most else { continue };
            let ratio = group.ratios(row).median;
            let kept = ratio <= at_most;
            if !kept {
                missed.push(format!(
                    "{} ({}): {ratio:.3} instead of at most {at_most}",
                    row.what, group.title
                ));
            }
        }
    }
    missed
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}

/// Prints a table a group.
pub(crate) fn print(core: usize, groups: &[Group]) {
    println!("All on core {core}, alternating; per call; ratios to the first peer.");
    for group in groups {
        println!(
            "\n{} ({} problems, {} rounds)",
            group.title, group.calls, group.rounds
        );
        println!(
            "{:<28} {:>9} {:>9} {:>12} {:>10} {:>10} {:>12} {:>8}",
            "", "best ns", "median ns", "instructions", "best", "median", "instructions", "bound"
        );
        for row in &group.rows {
            let ratios = group.ratios(row);
            println!(
                "{:<28} {:>9.1} {:>9.1} {:>12} {:>10.3} {:>10.3} {:>12} {:>8}",
                row.what,
                row.times.best_ns,
                row.times.median_ns,
                number(row.instructions, 0),
                ratios.best,
                ratios.median,
                number(ratios.instructions, 3),
                number(row.at_most, 2),
            );
        }
    }
}

/// The same figures for a program.
pub(crate) fn json(core: usize, groups: &[Group]) -> Value {
    let row = |group: &Group, row: &Row| {
        let ratios = group.ratios(row);
        json!({
            "contestant": row.key,
            "what": row.what,
            "best_ns": row.times.best_ns,
            "median_ns": row.times.median_ns,
            "instructions": row.instructions,
            "ratio_best": ratios.best,
            "ratio_median": ratios.median,
            "ratio_instructions": ratios.instructions,
            "ratio_at_most": row.at_most,
        })
    };
    let group = |group: &Group| {
        let rows: Vec<Value> = group.rows.iter().map(|r| row(group, r)).collect();
        json!({
            "title": group.title,
            "problems": group.calls,
            "rounds": group.rounds,
            "contestants": rows,
        })
    };
    json!({ "core": core, "groups": groups.iter().map(group).collect::<Vec<_>>() })
}
