//! Lines over a quantity, and cumulative distributions.

use std::fmt::Write as _;

use super::frame::{COLOURS, LEFT, below, legend, open, y};
use crate::stats::Share;

/// Width of a plot, px.
const WIDTH: f64 = 640.0;
/// Free space at the right.
const MARGIN: f64 = 24.0;

/// A line with intervals.
pub(super) struct Curve {
    pub(super) name: String,
    pub(super) points: Vec<Point>,
}

/// A point of it.
pub(super) struct Point {
    pub(super) x: f64,
    pub(super) share: Share,
}

/// A distribution of sorted values.
pub(super) struct Steps {
    pub(super) name: String,
    pub(super) values: Vec<f64>,
}

/// The horizontal axis.
struct Axis {
    from: f64,
    to: f64,
}

impl Axis {
    fn x(&self, value: f64) -> f64 {
        let span = (self.to - self.from).max(1e-9);
        LEFT + 10.0 + (WIDTH - LEFT - 10.0 - MARGIN) * (value - self.from) / span
    }
}

fn colour(i: usize) -> &'static str {
    COLOURS[i % COLOURS.len()]
}

fn names<'a>(all: impl Iterator<Item = &'a str>) -> Vec<(String, &'static str)> {
    all.enumerate()
        .map(|(i, n)| (n.to_owned(), colour(i)))
        .collect()
}

/// Draws lines.
pub(super) fn curves(title: &str, label: &str, all: &[Curve]) -> String {
    let mut marks: Vec<f64> = all
        .iter()
        .flat_map(|c| c.points.iter().map(|p| p.x))
        .collect();
    marks.sort_by(f64::total_cmp);
    marks.dedup();
    let axis = Axis {
        from: marks.first().copied().unwrap_or(0.0),
        to: marks.last().copied().unwrap_or(1.0),
    };
    let mut out = open(title, WIDTH);
    for (i, curve) in all.iter().enumerate() {
        let mut path = String::new();
        for point in &curve.points {
            let (x, share) = (axis.x(point.x), point.share);
            let letter = if path.is_empty() { 'M' } else { 'L' };
            let _ = write!(path, "{letter}{x:.1} {:.1}", y(share.share));
            let _ = write!(
                out,
                r#"<g fill="{0}" stroke="{0}"><title>{1}: {2} of {3}</title><line x1="{x:.1}" x2="{x:.1}" y1="{4:.1}" y2="{5:.1}" stroke-width="2"/><circle cx="{x:.1}" cy="{6:.1}" r="4"/></g>"#,
                colour(i),
                super::frame::escape(&curve.name),
                share.hits,
                share.of,
                y(share.high),
                y(share.low),
                y(share.share),
            );
        }
        let _ = write!(
            out,
            r#"<path d="{path}" fill="none" stroke="{}" stroke-width="2"/>"#,
            colour(i)
        );
    }
    let mut last = f64::NEG_INFINITY;
    for mark in &marks {
        // A number is about 28 px wide.
        if axis.x(*mark) - last > 28.0 {
            last = axis.x(*mark);
            below(&mut out, last, 0, &format!("{mark:.0}"));
        }
    }
    below(&mut out, 0.5 * (LEFT + WIDTH), 1, label);
    legend(&mut out, &names(all.iter().map(|c| c.name.as_str())));
    out.push_str("</svg>");
    out
}

/// Draws cumulative distributions.
pub(super) fn distribution(title: &str, label: &str, all: &[Steps]) -> String {
    let ends = |s: &Steps| Some((*s.values.first()?, *s.values.last()?));
    let from = all.iter().filter_map(ends).map(|e| e.0).fold(0.0, f64::min);
    let to = all.iter().filter_map(ends).map(|e| e.1).fold(1.0, f64::max);
    let axis = Axis { from, to };
    let mut out = open(title, WIDTH);
    for (i, steps) in all.iter().enumerate() {
        let mut path = format!("M{:.1} {:.1}", axis.x(from), y(0.0));
        for (k, value) in steps.values.iter().enumerate() {
            let share = (k + 1) as f64 / steps.values.len() as f64;
            let _ = write!(path, "H{:.1}V{:.1}", axis.x(*value), y(share));
        }
        let _ = write!(path, "H{:.1}", axis.x(to));
        let _ = write!(
            out,
            r#"<path d="{path}" fill="none" stroke="{}" stroke-width="2"/>"#,
            colour(i + 1)
        );
    }
    for k in 0..=4 {
        let value = from + (to - from) * f64::from(k) / 4.0;
        below(&mut out, axis.x(value), 0, &format!("{value:.0}"));
    }
    below(&mut out, 0.5 * (LEFT + WIDTH), 1, label);
    let names: Vec<(String, &str)> = all
        .iter()
        .enumerate()
        .map(|(i, s)| (format!("{} ({})", s.name, s.values.len()), colour(i + 1)))
        .collect();
    legend(&mut out, &names);
    out.push_str("</svg>");
    out
}
