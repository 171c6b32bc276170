//! Measures the grounder on generated scenes, fits its confidence, draws the
//! reliability diagram.
//!
//! ```text
//! cargo run -p fitmac-agents --example reliability -- report docs/kappa.png
//! cargo run -p fitmac-agents --example reliability -- fit
//! ```

use std::collections::BTreeMap;
use std::ops::Range;

use anyhow::Context as _;
use fitmac_agents::canvas::{Canvas, Colour};
use fitmac_agents::grounder::{Verdict, kappa};
use fitmac_agents::synthetic::{self, Bin, DetectorModel, Outcome, calibration_error, reliability};

/// Seeds that the report uses; the fit never sees them.
const REPORT_SEEDS: [u64; 5] = [7, 11, 13, 17, 23];
const SCENES_PER_SEED: u64 = 400;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    match arguments.next().as_deref() {
        Some("fit") => {
            fit(&mixed(1000..1020, 1020..1040));
            knots(&mixed(1040..1055, 1055..1070));
            Ok(())
        }
        Some("report") => report(arguments.next().as_deref()),
        _ => anyhow::bail!("say `report [FILE.png]` or `fit`"),
    }
}

fn outcomes(seeds: impl IntoIterator<Item = u64>, model: &DetectorModel) -> Vec<Outcome> {
    seeds
        .into_iter()
        .flat_map(|seed| (0..SCENES_PER_SEED).map(move |number| (seed, number)))
        .map(|(seed, number)| synthetic::run(&synthetic::case(seed, number, model)).1)
        .collect()
}

/// Scenes of the default detector and of the harsh one.
fn mixed(default: Range<u64>, harsh: Range<u64>) -> Vec<Outcome> {
    let mut scenes = outcomes(default, &DetectorModel::default());
    scenes.extend(outcomes(harsh, &DetectorModel::harsh()));
    scenes
}

/// Pool-adjacent-violators on groups of equal size.
fn knots(outcomes: &[Outcome]) {
    const GROUP: usize = 400;
    let told = |o: &Outcome| Some((kappa::raw(&o.evidence?), f64::from(u8::from(o.right))));
    let mut data: Vec<(f64, f64)> = outcomes.iter().filter_map(told).collect();
    data.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Sum of what was told, sum of right, count.
    let mut groups: Vec<[f64; 3]> = Vec::new();
    for chunk in data.chunks(GROUP) {
        let sum = |part: fn(&(f64, f64)) -> f64| chunk.iter().map(part).sum::<f64>();
        groups.push([sum(|row| row.0), sum(|row| row.1), chunk.len() as f64]);
        while let [.., low, high] = groups.as_slice()
            && low[1] / low[2] >= high[1] / high[2]
        {
            let pooled = [low[0] + high[0], low[1] + high[1], low[2] + high[2]];
            groups.truncate(groups.len() - 2);
            groups.push(pooled);
        }
    }
    println!("{} scenes", data.len());
    println!("(0.0, 0.0),");
    for [told, right, count] in groups {
        // No share is certain: the rule of succession.
        println!(
            "({:.3}, {:.3}),",
            told / count,
            (right + 1.0) / (count + 2.0)
        );
    }
}

/// Newton's method on the logistic likelihood, with a small ridge.
fn fit(outcomes: &[Outcome]) {
    const N: usize = kappa::TERMS;
    let data: Vec<([f64; N], f64)> = outcomes
        .iter()
        .filter_map(|o| Some((kappa::terms(&o.evidence?), f64::from(u8::from(o.right)))))
        .collect();
    let mut weights = [0.0; N];
    for _ in 0..50 {
        let mut gradient = [0.0; N];
        let mut hessian = [[0.0; N]; N];
        for (terms, right) in &data {
            let sum: f64 = terms
                .iter()
                .zip(weights)
                .map(|(term, weight)| term * weight)
                .sum();
            let p = 1.0 / (1.0 + (-sum).exp());
            for row in 0..N {
                gradient[row] += (right - p) * terms[row];
                for column in 0..N {
                    hessian[row][column] += p * (1.0 - p) * terms[row] * terms[column];
                }
            }
        }
        for row in 0..N {
            gradient[row] -= 0.1 * weights[row];
            hessian[row][row] += 0.1;
        }
        let step = solve(hessian, gradient);
        for (weight, step) in weights.iter_mut().zip(step) {
            *weight += step;
        }
    }
    println!("{} scenes", data.len());
    for (name, weight) in kappa::TERM_NAMES.iter().zip(weights) {
        println!("{weight:>8.3}, // {name}");
    }
}

/// Gauss with pivoting.
fn solve<const N: usize>(mut matrix: [[f64; N]; N], mut right: [f64; N]) -> [f64; N] {
    for column in 0..N {
        let pivot = (column..N)
            .max_by(|a, b| {
                matrix[*a][column]
                    .abs()
                    .total_cmp(&matrix[*b][column].abs())
            })
            .unwrap_or(column);
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        for row in 0..N {
            if row != column {
                let factor = matrix[row][column] / matrix[column][column];
                let pivot_row = matrix[column];
                for (value, pivot) in matrix[row].iter_mut().zip(pivot_row).skip(column) {
                    *value -= factor * pivot;
                }
                right[row] -= factor * right[column];
            }
        }
    }
    std::array::from_fn(|row| right[row] / matrix[row][row])
}

fn report(png: Option<&str>) -> anyhow::Result<()> {
    println!("== a detector of ordinary noise");
    let bins = table(&outcomes(REPORT_SEEDS, &DetectorModel::default()));
    println!("\n== a detector on a bad day");
    let harsh = table(&outcomes(REPORT_SEEDS, &DetectorModel::harsh()));
    if let Some(path) = png {
        let mut canvas = Canvas::filled(2 * SIDE_PX, SIDE_PX, Colour::WHITE);
        diagram(&mut canvas, 0, "ordinary noise", &bins);
        diagram(&mut canvas, SIDE_PX as i32, "a bad day", &harsh);
        let image = canvas.png()?;
        std::fs::write(path, image).with_context(|| format!("{path} can't be written"))?;
    }
    Ok(())
}

/// Prints rates by kind and the reliability of kappa.
fn table(outcomes: &[Outcome]) -> [Bin; 10] {
    let mut kinds: BTreeMap<&str, [u32; 5]> = BTreeMap::new();
    for outcome in outcomes {
        for kind in [outcome.kind, "all"] {
            let counts = kinds.entry(kind).or_default();
            let unsure = outcome.verdict != Verdict::Resolved;
            if outcome.clear {
                counts[0] += 1;
                counts[1] += u32::from(outcome.right);
                counts[2] += u32::from(unsure);
            } else {
                counts[3] += 1;
                counts[4] += u32::from(unsure);
            }
        }
    }
    println!(
        "{:<18} clear: scenes, right, called ambiguous; ambiguous: scenes, reported",
        "kind"
    );
    for (kind, [clear, right, called, ambiguous, reported]) in kinds {
        println!(
            "{kind:<18} {clear:5} {:6.2}% {:6.2}%   {ambiguous:5} {:6.2}%",
            percent(right, clear),
            percent(called, clear),
            percent(reported, ambiguous)
        );
    }
    let mut errors: Vec<f64> = outcomes.iter().filter_map(|o| o.error_m).collect();
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| 1000.0 * errors[((errors.len() - 1) as f64 * share) as usize];
    println!(
        "\nposition of the selected object off by {:.0} mm in the median, {:.0} mm in one of twenty",
        at(0.5),
        at(0.95)
    );
    let bins = reliability(outcomes);
    println!("\nkappa bin, locks, mean kappa, right");
    for (index, bin) in bins.iter().enumerate().filter(|(_, bin)| bin.locks > 0) {
        let locks = f64::from(bin.locks);
        println!(
            "{:.1}..{:.1}  {:5}  {:.3}  {:.3}",
            index as f64 / 10.0,
            (index + 1) as f64 / 10.0,
            bin.locks,
            bin.kappa / locks,
            f64::from(bin.right) / locks
        );
    }
    println!("expected calibration error {:.4}", calibration_error(&bins));
    bins
}

fn percent(part: u32, whole: u32) -> f64 {
    if whole == 0 {
        f64::NAN
    } else {
        100.0 * f64::from(part) / f64::from(whole)
    }
}

/// Side of a diagram, px.
const SIDE_PX: u32 = 480;

/// Share of right locks over kappa, with the diagonal and the counts.
fn diagram(canvas: &mut Canvas, left_px: i32, title: &str, bins: &[Bin; 10]) {
    let margin = 56_i32;
    let plot = SIDE_PX as i32 - 2 * margin;
    let x = |value: f64| left_px + margin + (value * f64::from(plot)) as i32;
    let y = |value: f64| SIDE_PX as i32 - margin - (value * f64::from(plot)) as i32;
    canvas.line([x(0.0), y(0.0)], [x(1.0), y(1.0)], Colour::GREY);
    for (index, bin) in bins.iter().enumerate().filter(|(_, bin)| bin.locks > 0) {
        let share = f64::from(bin.right) / f64::from(bin.locks);
        let left = index as f64 / 10.0;
        let (top, bottom) = (y(share), y(0.0));
        let height = (bottom - top).max(1) as u32;
        canvas.fill(
            [x(left) + 2, top],
            [(plot / 10 - 4) as u32, height],
            Colour::BLUE,
        );
        let mean = bin.kappa / f64::from(bin.locks);
        canvas.fill([x(mean) - 3, y(share) - 3], [7, 7], Colour::RED);
        canvas.text(
            &bin.locks.to_string(),
            [x(left) + 4, top - 12],
            Colour::BLACK,
        );
    }
    canvas.line([x(0.0), y(0.0)], [x(1.0), y(0.0)], Colour::BLACK);
    canvas.line([x(0.0), y(0.0)], [x(0.0), y(1.0)], Colour::BLACK);
    for tick in 0..=5 {
        let value = f64::from(tick) / 5.0;
        canvas.text(
            &format!("{value:.1}"),
            [x(value) - 9, y(0.0) + 8],
            Colour::BLACK,
        );
        canvas.text(
            &format!("{value:.1}"),
            [x(0.0) - 30, y(value) - 5],
            Colour::BLACK,
        );
    }
    canvas.text("reported kappa", [x(0.5) - 42, y(0.0) + 28], Colour::BLACK);
    canvas.text(title, [x(0.0), 14], Colour::BLACK);
    canvas.text(
        "share of right locks (red: at the bin's mean kappa)",
        [x(0.0), 30],
        Colour::BLACK,
    );
}
