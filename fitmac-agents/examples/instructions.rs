//! Measures the planner on the instruction sets, and learns its confidence.
//!
//! ```text
//! cargo run -p fitmac-agents --example instructions            # right, wrong, calibration
//! cargo run -p fitmac-agents --example instructions -- wrong   # and every wrong answer
//! cargo run -p fitmac-agents --example instructions -- fit     # planner/learned.rs
//! ```

use std::collections::BTreeMap;

use fitmac_agents::instructions::{self, Case, Expect, FRESH, Judged, USED};
use fitmac_agents::planner::SURE;

fn main() -> anyhow::Result<()> {
    let read = |set| instructions::read(set).map_err(anyhow::Error::msg);
    let (used, fresh) = (read(USED)?, read(FRESH)?);
    let mode = std::env::args().nth(1);
    match mode.as_deref() {
        Some("fit") => print!("{}", instructions::learn(&used)),
        None | Some("wrong") => {
            for (name, cases) in [("used", &used), ("held back", &fresh)] {
                report(name, cases, mode.is_some());
            }
        }
        Some(other) => anyhow::bail!("{other}: say nothing, `wrong` or `fit`"),
    }
    Ok(())
}

/// Right, all, wrong above 0.8.
type Score = [u32; 3];

fn report(name: &str, cases: &[Case], wrong: bool) {
    let judged: Vec<Judged<'_>> = cases.iter().map(Case::judge).collect();
    let mut groups: BTreeMap<&str, Score> = BTreeMap::new();
    for judged in &judged {
        let by_origin = [judged.case.origin.as_str(), "all"];
        let groups_of = by_origin.into_iter().chain([judged.case.suite.as_str()]);
        for group in groups_of {
            let score = groups.entry(group).or_default();
            score[0] += u32::from(judged.right);
            score[1] += 1;
            score[2] += u32::from(!judged.right && judged.plan.confidence > SURE);
        }
    }
    println!("== {name}");
    println!("{:<24} right    of      share  wrong above 0.8", "");
    for (group, [right, all, sure]) in groups {
        let share = 100.0 * f64::from(right) / f64::from(all);
        println!("{group:<24} {right:>5} {all:>5} {share:>9.1}%  {sure:>5}");
    }
    calibration(&judged);
    if wrong {
        judged.iter().filter(|judged| !judged.right).for_each(show);
    }
    println!();
}

fn show(judged: &Judged<'_>) {
    let (case, plan) = (judged.case, &judged.plan);
    println!(
        "{} {:?} {:.2} {}",
        case.id, case.expect, plan.confidence, case.text
    );
    println!("     {:?} | {}", plan.doubts, plan.canonical_instruction);
}

/// What confidence was told, and what share of the plans holds; a sentence with
/// two readings counts as half.
fn calibration(judged: &[Judged<'_>]) {
    println!("confidence    plans   mean  right");
    for (low, high) in [(0.5, 0.6), (0.6, 0.7), (0.7, SURE), (SURE, 0.9), (0.9, 1.0)] {
        let bin: Vec<&Judged<'_>> = judged
            .iter()
            .filter(|judged| judged.plan.understood())
            .filter(|judged| judged.plan.confidence > low && judged.plan.confidence <= high)
            .collect();
        if bin.is_empty() {
            continue;
        }
        let count = bin.len() as f64;
        let mean = bin.iter().map(|judged| judged.plan.confidence).sum::<f64>() / count;
        let held = |judged: &&Judged<'_>| match judged.case.expect {
            Expect::Unsure => 0.5,
            _ => f64::from(u8::from(judged.holds)),
        };
        let right = bin.iter().map(held).sum::<f64>() / count;
        println!(
            "{low:.1} to {high:.1}  {:>6}  {mean:.2}   {right:.2}",
            bin.len()
        );
    }
}
