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

fn whole(text: &str) -> Vec<Case> {
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
    let score = score(
        "second",
        whole(include_str!("../../data/instructions-second.jsonl")),
    );
    assert!(score.right * 100 >= score.total * 96);
    assert_eq!(score.confidently_wrong, 0);
}

#[test]
fn third_set_is_right() {
    let score = score(
        "third",
        whole(include_str!("../../data/instructions-third.jsonl")),
    );
    assert!(score.right * 100 >= score.total * 97);
    assert_eq!(score.confidently_wrong, 0);
}

/// Of the answers given with some confidence, how many are right.
#[test]
fn confidence_means_what_it_says() {
    let mut bins = [(0_u32, 0_u32, 0.0); 3];
    let sets = [
        cases("held_out"),
        whole(include_str!("../../data/instructions-second.jsonl")),
        whole(include_str!("../../data/instructions-third.jsonl")),
    ];
    for case in sets.into_iter().flatten() {
        let plan = plan(&case.text).expect("a sentence");
        let bin = match plan.confidence {
            c if c < UNDERSTOOD => 0,
            c if c < SURE => 1,
            _ => 2,
        };
        bins[bin].0 += 1;
        bins[bin].1 += u32::from(case.expect == "steps" && steps(&plan) == case.steps);
        bins[bin].2 += plan.confidence;
    }
    for (total, right, confidence) in bins {
        println!(
            "{right} of {total} right, mean confidence {:.2}",
            confidence / f64::from(total)
        );
    }
    // No parse is used below 0.5, and above 0.8 at least 97 in 100 hold.
    assert_eq!(bins[0].1, 0);
    assert!(bins[2].1 * 100 >= bins[2].0 * 97);
}

proptest::proptest! {
    /// Any text is answered, and no name consists of anything but its words.
    #[test]
    fn any_text_is_answered_and_nothing_is_invented(
        words in proptest::collection::vec(
            proptest::sample::select(
                "put pick up the black bowl plate on in next to between and it them not , . then \
                 from both 's of stove turn that is open drawer left goes i want xyz \u{7}"
                    .split(' ')
                    .collect::<Vec<_>>(),
            ),
            0..24,
        ),
        tail in ".{0,20}",
    ) {
        let text = format!("{} {tail}", words.join(" "));
        let Ok(plan) = plan(&text) else { return Ok(()) };
        proptest::prop_assert!((0.0..=1.0).contains(&plan.confidence));
        proptest::prop_assert!((1..=SUBTASK_CAPACITY).contains(&plan.subtasks.len()));
        let normalised = lexer::normalise(&text);
        let given: Vec<&str> = normalised.split_ascii_whitespace().collect();
        for step in plan.subtasks.iter().filter(|step| step.action != Action::Unknown) {
            let mut names = vec![&step.target];
            for phrase in [&step.source, &step.destination].into_iter().flatten() {
                names.extend(&phrase.references);
            }
            for word in names.into_iter().flat_map(|name| name.split(' ')) {
                let plural = given.iter().any(|given| lexicon::singular(given) == Some(word));
                proptest::prop_assert!(
                    plural || given.contains(&word) || matches!(word, "of" | "table"),
                    "{word} isn't in {text}"
                );
            }
        }
    }
}

#[test]
fn hostile_lengths_are_refused_with_a_reason() {
    assert_eq!(plan("   "), Err(PlanError::Empty));
    let error = plan(&"bowl ".repeat(1000)).expect_err("too long");
    assert!(error.to_string().contains("5000 bytes"));
    // Deep nesting of "of" stays within the stack.
    let deep = format!("put the {} on the plate", "top of the ".repeat(80));
    assert!(!plan(&deep).expect("short enough").understood());
}

#[test]
fn a_models_answer_is_held_to_the_schema() {
    let instruction = "shelve the milk in the basket";
    let good = r#"{"canonical_instruction":"put the milk in the basket",
        "plan":["put the milk in the basket"],"action":"pick_and_place","target_object":"milk",
        "source_phrase":"","destination":"basket","destination_prep":"in",
        "destination_relation":"in","confidence":0.9}"#;
    let plan = PlannerOutput::from_model(good, instruction)
        .expect("valid")
        .into_plan();
    assert_eq!(plan.subtasks[0].target, "milk");
    assert_eq!(
        plan.subtasks[0]
            .destination
            .as_ref()
            .expect("said")
            .relation,
        Relation::In
    );
    for (from, to, expected) in [
        ("\"milk\"", "\"knife\"", "knife"),
        ("\"confidence\":0.9", "\"confidence\":7", "confidence"),
        (
            "\"destination_relation\":\"in\"",
            "\"destination_relation\":\"near\"",
            "schema",
        ),
        ("\"action\"", "\"waypoint\":[0,0,0],\"action\"", "waypoint"),
        (
            "\"destination\":\"basket\"",
            "\"destination\":\"\"",
            "destination",
        ),
        ("[\"put the milk in the basket\"]", "[]", "plan"),
        ("\"source_phrase\":\"\",", "", "source_phrase"),
    ] {
        let bad = good.replace(from, to);
        assert_ne!(bad, good, "{from}");
        let error = PlannerOutput::from_model(&bad, instruction).expect_err(to);
        assert!(error.to_string().contains(expected), "{error}");
    }
}
