//! The instruction set: the tuning half in detail, the held-out half in sum.

use serde::Deserialize;

use super::*;

#[derive(Deserialize)]
struct Case {
    id: u32,
    split: String,
    text: String,
    expect: String,
    #[serde(default)]
    steps: Vec<Step>,
}

#[derive(Deserialize, PartialEq, Debug)]
struct Step {
    action: Action,
    target: String,
    source: Option<SpatialPhrase>,
    destination: Option<SpatialPhrase>,
}

fn second_set() -> Vec<Case> {
    let text = include_str!("../../data/instructions-second.jsonl");
    text.lines()
        .map(|line| serde_json::from_str(line).expect("instruction set"))
        .collect()
}

fn cases(split: &str) -> Vec<Case> {
    let text = include_str!("../../data/instructions.jsonl");
    let cases: Vec<Case> = text
        .lines()
        .map(|line| serde_json::from_str(line).expect("instruction set"))
        .collect();
    for case in &cases {
        let hash = case
            .text
            .bytes()
            .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
                (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
            });
        let expected = if hash & 1 == 1 { "held_out" } else { "tuning" };
        assert_eq!(case.split, expected, "split of {}", case.id);
    }
    cases
        .into_iter()
        .filter(|case| case.split == split)
        .collect()
}

fn steps(plan: &TaskPlan) -> Vec<Step> {
    plan.subtasks
        .iter()
        .map(|step| Step {
            action: step.action,
            target: step.target.clone(),
            source: step.source.clone(),
            destination: step.destination.clone(),
        })
        .collect()
}

struct Score {
    right: usize,
    total: usize,
    confidently_wrong: usize,
}

fn score(split: &str, cases: Vec<Case>) -> Score {
    let mut score = Score {
        right: 0,
        total: 0,
        confidently_wrong: 0,
    };
    for case in cases {
        let plan = plan(&case.text).expect("a sentence");
        let matches = steps(&plan) == case.steps;
        let right = match case.expect.as_str() {
            "steps" => matches && plan.understood(),
            "refuse" => !plan.understood(),
            "unsure" => plan.confidence < SURE,
            other => panic!("unknown expectation {other}"),
        };
        score.total += 1;
        score.right += usize::from(right);
        score.confidently_wrong += usize::from(!right && plan.confidence > SURE);
        if !right {
            println!(
                "{} {:.2} {}\n   {:?}\n   {:?}",
                case.id,
                plan.confidence,
                case.text,
                plan.doubts,
                steps(&plan)
            );
        }
    }
    println!(
        "{split}: {} of {} right, {} confidently wrong",
        score.right, score.total, score.confidently_wrong
    );
    score
}

#[test]
fn tuning_half_is_right() {
    let score = score("tuning", cases("tuning"));
    assert!(score.right * 100 >= score.total * 99);
    assert_eq!(score.confidently_wrong, 0);
}

#[test]
fn held_out_half_is_right() {
    let score = score("held_out", cases("held_out"));
    assert!(score.right * 100 >= score.total * 97);
    assert_eq!(score.confidently_wrong, 0);
}

#[test]
fn second_set_is_mostly_right_and_never_confidently_wrong() {
    let score = score("second", second_set());
    assert!(score.right * 100 >= score.total * 96);
    assert_eq!(score.confidently_wrong, 0);
}
