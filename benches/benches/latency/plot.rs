//! Both distributions, drawn: the share of times above each time.

use std::{fmt::Write as _, fs, path::Path};

use anyhow::Context as _;

use crate::{
    distribution::Distribution,
    report::{Condition, Report},
};

/// Of one panel, px.
const WIDTH: f64 = 460.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 60.0;
const RIGHT: f64 = 440.0;
const TOP: f64 = 60.0;
const BOTTOM: f64 = 255.0;
/// Decades of time from 100 ns on, and of shares from 1 down.
const FIRST_NS: f64 = 100.0;
const DECADES: f64 = 6.0;
const SHARES: f64 = 5.0;
/// Colours that people with any colour vision tell apart (Okabe and Ito).
const GREY: &str = "#8a8f98";
const BLUE: &str = "#0072b2";

/// Writes the drawing.
pub(crate) fn write(report: &Report, file: &Path) -> anyhow::Result<()> {
    let panels: Vec<_> = report.conditions.iter().flat_map(panels).collect();
    let rows = report.conditions.len() as f64;
    let (width, height) = (2.0 * WIDTH, rows * HEIGHT);
    let mut out = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="system-ui, sans-serif" font-size="12"><rect width="100%" height="100%" fill="white"/>"#
    );
    for (i, panel) in panels.iter().enumerate() {
        let (x, y) = ((i % 2) as f64 * WIDTH, (i / 2) as f64 * HEIGHT);
        let _ = write!(out, r#"<g transform="translate({x} {y})">"#);
        draw(&mut out, panel);
        out.push_str("</g>");
    }
    out.push_str("</svg>\n");
    let folder = file.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder)
        .and_then(|()| fs::write(file, out))
        .with_context(|| format!("{} cannot be written", file.display()))
}

struct Panel<'a> {
    title: String,
    series: [(&'static str, &'static str, &'a Distribution); 2],
}

fn panels(of: &Condition) -> [Panel<'_>; 2] {
    [
        Panel {
            title: format!("{}: from a sample sent to its command", of.name),
            series: [("bare echo", GREY, &of.floor), ("FIT-MAC", BLUE, &of.ours)],
        },
        Panel {
            title: format!("{}: lateness of a wake-up", of.name),
            series: [("bare loop", GREY, &of.bare), ("FIT-MAC", BLUE, &of.wake)],
        },
    ]
}

fn x(time_ns: f64) -> f64 {
    let share = (time_ns.max(FIRST_NS) / FIRST_NS).log10() / DECADES;
    LEFT + (RIGHT - LEFT) * share.min(1.0)
}

fn y(share: f64) -> f64 {
    TOP + (BOTTOM - TOP) * (-share.log10() / SHARES).clamp(0.0, 1.0)
}

fn draw(out: &mut String, panel: &Panel<'_>) {
    let _ = write!(
        out,
        r##"<text x="{LEFT}" y="22" font-size="14" fill="#1c2329">{}</text>"##,
        panel.title
    );
    axes(out);
    for (i, (name, colour, times)) in panel.series.iter().enumerate() {
        let at = LEFT + 110.0 * i as f64;
        let _ = write!(
            out,
            r##"<rect x="{at}" y="34" width="12" height="12" fill="{colour}"/><text x="{}" y="44" fill="#1c2329">{name}</text><polyline fill="none" stroke="{colour}" stroke-width="2" points="{}"/>"##,
            at + 17.0,
            steps(times)
        );
    }
}

fn axes(out: &mut String) {
    let labels = [
        "100 ns", "1 us", "10 us", "100 us", "1 ms", "10 ms", "100 ms",
    ];
    for (decade, label) in labels.iter().enumerate() {
        let at = x(FIRST_NS * 10_f64.powi(decade as i32));
        let _ = write!(
            out,
            r##"<line x1="{at:.1}" x2="{at:.1}" y1="{TOP}" y2="{BOTTOM}" stroke="#dfe3e8"/><text x="{at:.1}" y="{}" text-anchor="middle" fill="#4a5260">{label}</text>"##,
            BOTTOM + 18.0
        );
    }
    let labels = ["100 %", "10 %", "1 %", "0.1 %", "0.01 %", "0.001 %"];
    for (decade, label) in labels.iter().enumerate() {
        let at = y(10_f64.powi(-(decade as i32)));
        let _ = write!(
            out,
            r##"<line x1="{LEFT}" x2="{RIGHT}" y1="{at:.1}" y2="{at:.1}" stroke="#dfe3e8"/><text x="{}" y="{:.1}" text-anchor="end" fill="#4a5260">{label}</text>"##,
            LEFT - 5.0,
            at + 4.0
        );
    }
    let _ = write!(
        out,
        r##"<text x="{}" y="{}" text-anchor="middle" fill="#1c2329">share of times above</text>"##,
        (LEFT + RIGHT) / 2.0,
        BOTTOM + 36.0
    );
}

/// The share of times above each time, as points of a line.
fn steps(times: &Distribution) -> String {
    let all = times.count().max(1) as f64;
    let (mut above, mut points) = (times.count(), String::new());
    let mut last = (f64::NAN, f64::NAN);
    for (time_ns, n) in times.pairs() {
        for share in [above, above - n] {
            if share == 0 {
                continue;
            }
            let point = (x(time_ns as f64), y(share as f64 / all));
            // What falls on the same pixel is one point.
            if (point.0 - last.0).abs() + (point.1 - last.1).abs() < 0.3 {
                continue;
            }
            last = point;
            let _ = write!(points, "{:.1},{:.1} ", point.0, point.1);
        }
        above -= n;
    }
    points
}
