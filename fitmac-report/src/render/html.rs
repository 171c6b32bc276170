//! The report as one HTML page that needs nothing else: no network, no other file.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use sim_harness::evaluation::EpisodeRecord;

use crate::gallery::Gallery;
use crate::plots::escape;
use crate::table::{Cell, Column, Table};
use crate::{Plot, Report, ReportError};

const STYLE: &str = include_str!("../../assets/report.css");
const SCRIPT: &str = include_str!("../../assets/report.js");
/// The part of the page in which episodes are looked at.
const VIEWER: &str = include_str!("../../assets/viewer.html");

/// Writes it.
///
/// # Errors
/// [`ReportError::Json`] if an episode can't be written, which does not happen.
pub fn html(report: &Report) -> Result<String, ReportError> {
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>FIT-MAC evaluation: surrogate policies</title>\n<style>\n{STYLE}</style>\n</head>\n\
         <body>\n<header>\n<h1>FIT-MAC evaluation <small>surrogate policies</small></h1>\n"
    );
    preamble(&mut out, report);
    contents(&mut out, report);
    out.push_str("</header>\n<main>\n");
    if !report.plots.is_empty() {
        out.push_str("<section id=\"plots\">\n<h2>Plots</h2>\n");
        report.plots.iter().for_each(|plot| figure(&mut out, plot));
        out.push_str("</section>\n");
    }
    out.push_str(
        "<p class=\"key\">A cell of a table shows what was measured here, below it the Wilson 95 % \
         interval, and in italics the paper's figure, which is of the model itself and not of a \
         surrogate.</p>\n",
    );
    for topic in report.tables.chunk_by(|a, b| a.topic == b.topic) {
        let _ = writeln!(out, "<section>\n<h2>{}</h2>", topic[0].topic.title());
        topic.iter().for_each(|t| table(&mut out, t));
        out.push_str("</section>\n");
    }
    out.push_str(VIEWER);
    problems(&mut out, report);
    out.push_str("</main>\n");
    let data = episodes(&report.episodes)?;
    let shown = pictures(&report.pictures)?;
    let _ = write!(
        out,
        "<script type=\"application/json\" id=\"episodes-data\">{data}</script>\n\
         <script type=\"application/json\" id=\"pictures-data\">{shown}</script>\n<script>\n\
         {SCRIPT}</script>\n</body>\n</html>\n"
    );
    Ok(out)
}

fn preamble(out: &mut String, report: &Report) {
    let _ = writeln!(out, "<p>{}</p>", escape(&super::surrogates(report)));
    let _ = writeln!(out, "<p>{}</p>", escape(&super::seeds(report)));
    for warning in &report.about.warnings {
        let _ = writeln!(
            out,
            "<p class=\"warning\" role=\"note\">{}</p>",
            escape(warning)
        );
    }
    if !report.verdicts.is_empty() {
        out.push_str("<dl class=\"verdicts\">\n");
        for verdict in &report.verdicts {
            let _ = writeln!(
                out,
                "<dt>{}</dt><dd>{}</dd>",
                escape(&verdict.label),
                escape(&super::sentence(verdict))
            );
        }
        out.push_str("</dl>\n");
    }
}

fn contents(out: &mut String, report: &Report) {
    out.push_str("<nav aria-label=\"Contents\"><details><summary>Contents</summary><ul>\n");
    let plots = report.plots.iter().map(|p| (&p.id, &p.title));
    let tables = report.tables.iter().map(|t| (&t.id, &t.title));
    for (id, title) in plots.chain(tables) {
        let _ = writeln!(
            out,
            "<li><a href=\"#{}\">{}</a></li>",
            escape(id),
            escape(title)
        );
    }
    out.push_str("<li><a href=\"#episodes\">Episodes</a></li>\n</ul></details></nav>\n");
}

fn figure(out: &mut String, plot: &Plot) {
    let _ = writeln!(
        out,
        "<figure id=\"{}\"><h3>{}</h3><div class=\"scroll\" tabindex=\"0\" role=\"region\" \
         aria-label=\"{1}\">{}</div><figcaption>{}</figcaption></figure>",
        escape(&plot.id),
        escape(&plot.title),
        plot.svg,
        escape(&plot.caption)
    );
}

fn table(out: &mut String, table: &Table) {
    let _ = write!(
        out,
        "<div class=\"scroll\" id=\"{}\" tabindex=\"0\" role=\"region\" aria-label=\"{}\">\n<table>\
         <caption><strong>{1}</strong> {}</caption>\n<thead>",
        escape(&table.id),
        escape(&table.title),
        escape(&table.caption)
    );
    head(out, table);
    out.push_str("</thead>\n<tbody>\n");
    for row in &table.rows {
        let _ = write!(out, "<tr><th scope=\"row\">{}</th>", escape(&row.name));
        row.cells.iter().for_each(|c| cell(out, c));
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div>\n");
}

fn head(out: &mut String, table: &Table) {
    let grouped = table.columns.iter().any(|c| !c.group.is_empty());
    let rows = if grouped { 2 } else { 1 };
    let _ = write!(
        out,
        "<tr><th scope=\"col\" rowspan=\"{rows}\">{}</th>",
        escape(&table.rows_are)
    );
    let th = |out: &mut String, c: &Column, attributes: &str| {
        let _ = write!(
            out,
            "<th scope=\"col\"{attributes}>{}</th>",
            escape(&c.name)
        );
    };
    if grouped {
        for run in table.columns.chunk_by(|a, b| a.group == b.group) {
            if run[0].group.is_empty() {
                run.iter().for_each(|c| th(out, c, " rowspan=\"2\""));
            } else {
                let _ = write!(
                    out,
                    "<th scope=\"colgroup\" colspan=\"{}\" class=\"group\">{}</th>",
                    run.len(),
                    escape(&run[0].group)
                );
            }
        }
        out.push_str("</tr>\n<tr>");
    }
    let own = table
        .columns
        .iter()
        .filter(|c| !grouped || !c.group.is_empty());
    own.for_each(|c| th(out, c, ""));
    out.push_str("</tr>");
}

fn cell(out: &mut String, cell: &Cell) {
    let (ours, paper) = (cell.ours(), cell.paper());
    let title = cell
        .count()
        .map_or_else(String::new, |c| format!(" title=\"{c}\""));
    let _ = write!(out, "<td{title}>");
    // Nothing was measured and the paper has a figure: the figure alone.
    if !(ours == "–" && paper.is_some()) {
        out.push_str(&escape(&ours));
    }
    if let Some(interval) = cell.interval() {
        let _ = write!(out, "<small>{interval}</small>");
    }
    if let Some(paper) = paper {
        let _ = write!(out, "<i>{}</i>", escape(&paper));
    }
    out.push_str("</td>");
}

fn problems(out: &mut String, report: &Report) {
    if report.problems.is_empty() {
        return;
    }
    out.push_str("<section id=\"problems\">\n<h2>Lines that could not be used</h2>\n<ul>\n");
    for problem in &report.problems {
        let _ = writeln!(out, "<li>{}</li>", escape(&problem.to_string()));
    }
    out.push_str("</ul>\n</section>\n");
}

/// The episodes as JSON that may stand in a script element.
fn episodes(records: &[EpisodeRecord]) -> Result<String, ReportError> {
    let list: Vec<Value> = records.iter().map(line).collect();
    // A `</script>` in a name would end the element.
    Ok(serde_json::to_string(&list)?.replace('<', "\\u003c"))
}

/// The pictures as JSON that may stand in a script element: captions and PNG in base 64, by the key
/// of the episode.
fn pictures(gallery: &Gallery) -> Result<String, ReportError> {
    let all: serde_json::Map<String, Value> = gallery
        .iter()
        .map(|(key, frames)| {
            let list: Vec<Value> = frames
                .iter()
                .map(|f| json!([f.caption, STANDARD.encode(&f.png)]))
                .collect();
            (key.clone(), Value::from(list))
        })
        .collect();
    Ok(serde_json::to_string(&all)?.replace('<', "\\u003c"))
}

/// What the viewer needs of an episode; names are short because there may be ten thousands.
fn line(r: &EpisodeRecord) -> Value {
    let parts: Vec<Value> = r
        .activations
        .iter()
        .map(|a| json!([a.kind.name(), a.start_step, a.end_step, a.outcome.name()]))
        .collect();
    json!({
        "s": r.suite, "t": r.task, "p": r.perturbation, "l": r.level, "b": r.backbone,
        "c": r.config, "f": r.profile, "v": r.perception, "k": r.knowledge, "n": r.seed,
        "e": r.episode, "ok": r.success, "x": r.failure.map(|f| f.name()), "a": parts,
        "o": r.onset_step, "d": r.first_failure_step, "i": r.first_intervention_step,
        "u": r.steps, "z": r.sim_seconds, "g": r.gate_reasons, "r": r.rebinds,
        "w": r.graspable, "m": r.end_distance_m, "y": r.drawn,
        "q": r.pair_key(),
    })
}
