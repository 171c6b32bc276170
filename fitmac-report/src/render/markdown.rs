//! The report as Markdown.

use std::fmt::Write as _;

use crate::Report;
use crate::table::{Cell, Table};

/// Writes it.
#[must_use]
pub fn markdown(report: &Report) -> String {
    let mut out = String::from("# FIT-MAC evaluation: surrogate policies\n\n");
    summary(&mut out, report);
    out.push_str(
        "\nA cell reads: measured here [Wilson 95 % interval] (the paper's figure, of the model \
         itself).\n",
    );
    tables(&mut out, report);
    out
}

/// What was evaluated, and in short what came of it.
pub(super) fn summary(out: &mut String, report: &Report) {
    let _ = writeln!(out, "{}\n", super::surrogates(report));
    let _ = writeln!(out, "{}\n", super::seeds(report));
    for warning in &report.about.warnings {
        let _ = writeln!(out, "> **Note.** {warning}\n");
    }
    for verdict in &report.verdicts {
        let _ = writeln!(out, "- {}: {}", verdict.label, super::sentence(verdict));
    }
}

/// All tables, and the lines that could not be used.
pub(super) fn tables(out: &mut String, report: &Report) {
    for topic in report.tables.chunk_by(|a, b| a.topic == b.topic) {
        let _ = writeln!(out, "\n## {}", topic[0].topic.title());
        topic.iter().for_each(|table| write_table(out, table));
    }
    if !report.problems.is_empty() {
        out.push_str("\n## Lines that could not be used\n\n");
        for problem in &report.problems {
            let _ = writeln!(
                out,
                "- `{}:{}`: {}; {}",
                problem.file, problem.line, problem.what, problem.remedy
            );
        }
    }
}

fn write_table(out: &mut String, table: &Table) {
    let _ = writeln!(out, "\n### {}\n\n{}\n", table.title, table.caption);
    let mut head = format!("| {} |", table.rows_are);
    let mut rule = "|---|".to_owned();
    for column in &table.columns {
        let name = match column.group.as_str() {
            "" => column.name.clone(),
            group => format!("{group}: {}", column.name),
        };
        let _ = write!(head, " {} |", bar(&name));
        rule.push_str("--:|");
    }
    let _ = writeln!(out, "{head}\n{rule}");
    for row in &table.rows {
        let _ = write!(out, "| {} |", bar(&row.name));
        for cell in &row.cells {
            let _ = write!(out, " {} |", text(cell));
        }
        out.push('\n');
    }
}

fn text(cell: &Cell) -> String {
    let mut text = bar(&cell.ours());
    if let Some(interval) = cell.interval() {
        let _ = write!(text, " [{interval}]");
    }
    if let Some(paper) = cell.paper() {
        let _ = write!(text, " ({paper})");
    }
    text
}

/// A vertical bar would end the cell.
fn bar(text: &str) -> String {
    text.replace('|', "\\|")
}
