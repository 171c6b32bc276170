//! Groups of two bars with intervals, and the paper's figure beside each.

use std::fmt::Write as _;

use super::frame::{BOTTOM, COLOURS, LEFT, below, escape, legend, open, y};
use crate::stats::Share;

/// Width of a bar, px.
const BAR: f64 = 20.0;
/// Space between groups.
const GAP: f64 = 22.0;

/// A bar.
pub(super) struct Bar {
    pub(super) share: Share,
    /// The paper's, from 0 to 1.
    pub(super) paper: Option<f64>,
}

/// Bars that stand together.
pub(super) struct Group {
    pub(super) name: String,
    /// What neighbouring groups have in common.
    pub(super) of: String,
    /// One a series.
    pub(super) bars: [Option<Bar>; 2],
}

/// Draws them.
pub(super) fn grouped(title: &str, series: [&str; 2], groups: &[Group]) -> String {
    let slot = 2.0 * BAR + GAP;
    let start = LEFT + 12.0;
    let width = (start + slot * groups.len() as f64).max(420.0);
    let mut out = open(title, width);
    for (i, group) in groups.iter().enumerate() {
        let left = start + slot * i as f64;
        for (j, bar) in group.bars.iter().enumerate() {
            if let Some(bar) = bar {
                draw(
                    &mut out,
                    left + BAR * j as f64,
                    bar,
                    group,
                    series[j],
                    COLOURS[j],
                );
            }
        }
        below(&mut out, left + BAR, 0, &group.name);
    }
    for run in groups.chunk_by(|a, b| a.of == b.of) {
        let first = groups.iter().position(|g| g.of == run[0].of).unwrap_or(0) as f64;
        let middle = start + slot * (first + 0.5 * run.len() as f64) - 0.5 * GAP;
        below(&mut out, middle, 1, &run[0].of);
    }
    let names: Vec<(String, &str)> = series
        .iter()
        .zip(COLOURS)
        .map(|(n, c)| ((*n).to_owned(), c))
        .collect();
    legend(&mut out, &names);
    out.push_str("</svg>");
    out
}

fn draw(out: &mut String, x: f64, bar: &Bar, group: &Group, series: &str, colour: &str) {
    let (top, middle) = (y(bar.share.share), x + 0.5 * BAR - 1.0);
    let cap = middle - 4.0;
    let Share {
        hits,
        of,
        low,
        high,
        ..
    } = bar.share;
    let _ = write!(
        out,
        r##"<g><title>{} {}, {}: {hits} of {of}, 95 % {:.1}–{:.1}</title><rect x="{x}" y="{top:.1}" width="{}" height="{:.1}" fill="{colour}"/><path d="M{middle} {:.1}V{:.1}M{cap} {:.1}h8M{cap} {:.1}h8" stroke="#1c2329" fill="none"/>"##,
        escape(&group.of),
        escape(&group.name),
        escape(series),
        100.0 * low,
        100.0 * high,
        BAR - 2.0,
        BOTTOM - top,
        y(high),
        y(low),
        y(high),
        y(low),
    );
    if let Some(paper) = bar.paper {
        let at = y(paper);
        let _ = write!(
            out,
            r##"<path d="M{middle} {:.1}l4 4l-4 4l-4 -4z" fill="#fff" stroke="#1c2329"><title>paper: {:.1} %</title></path>"##,
            at - 4.0,
            100.0 * paper
        );
    }
    out.push_str("</g>");
}
