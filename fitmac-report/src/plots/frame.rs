//! What all plots share: size, axes, legend.

use std::fmt::Write as _;

/// Colours that people with any colour vision tell apart (Okabe and Ito), on white.
pub(super) const COLOURS: [&str; 6] = [
    "#8a8f98", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00",
];
/// Height of a plot, px.
const HEIGHT: f64 = 290.0;
/// Where the plot's area begins and ends, px from the top.
pub(super) const TOP: f64 = 34.0;
pub(super) const BOTTOM: f64 = 230.0;
/// Where it begins from the left.
pub(super) const LEFT: f64 = 46.0;

/// Where a share stands, px from the top.
pub(super) fn y(share: f64) -> f64 {
    BOTTOM - (BOTTOM - TOP) * share
}

/// Text that stands in a drawing or a page.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Opens a drawing with a vertical axis in percent. Close it with `</svg>`.
pub(super) fn open(title: &str, width: f64) -> String {
    let mut out = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {HEIGHT}" width="{width}" height="{HEIGHT}" role="img" aria-label="{0}" font-family="system-ui, sans-serif" font-size="12"><title>{0}</title>"#,
        escape(title)
    );
    for percent in [0, 25, 50, 75, 100] {
        let at = y(f64::from(percent) / 100.0);
        let _ = write!(
            out,
            r##"<line x1="{LEFT}" x2="{width}" y1="{at}" y2="{at}" stroke="#dfe3e8"/><text x="{}" y="{}" text-anchor="end" fill="#4a5260">{percent} %</text>"##,
            LEFT - 5.0,
            at + 4.0
        );
    }
    out
}

/// Names of the series, from the left above the plot.
pub(super) fn legend(out: &mut String, names: &[(String, &str)]) {
    let mut x = LEFT;
    for (name, colour) in names {
        let _ = write!(
            out,
            r##"<rect x="{x}" y="8" width="12" height="12" fill="{colour}"/><text x="{}" y="18" fill="#1c2329">{}</text>"##,
            x + 17.0,
            escape(name)
        );
        x += 34.0 + 7.0 * name.chars().count() as f64;
    }
}

/// A label below the horizontal axis.
pub(super) fn below(out: &mut String, x: f64, line: usize, text: &str) {
    let _ = write!(
        out,
        r##"<text x="{x:.1}" y="{}" text-anchor="middle" fill="#1c2329">{}</text>"##,
        BOTTOM + 18.0 + 18.0 * line as f64,
        escape(text)
    );
}
