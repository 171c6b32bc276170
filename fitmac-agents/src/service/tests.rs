use std::time::Duration;

use super::*;
use crate::model::stand_in::{Manner, StandIn};
use crate::model::{ChatModel, ModelConfig};
use crate::scene::Detection;

fn thing(id: u16, label: &str, at: [f64; 2], size_m: [f64; 3]) -> Detection {
    Detection {
        id,
        label: label.to_owned(),
        confidence: 0.85,
        position_m: [at[0], at[1], size_m[2] / 2.0],
        size_m,
        orientation: None,
        box_px: None,
        colour: None,
        parts: Vec::new(),
    }
}

fn scene(tick: u64, bowls: &[(u16, [f64; 2])]) -> Scene {
    let mut objects: Vec<Detection> = bowls
        .iter()
        .map(|(id, at)| thing(*id, "black bowl", *at, [0.107, 0.107, 0.05]))
        .collect();
    objects.push(thing(8, "plate", [0.6, 0.3], [0.16, 0.16, 0.02]));
    objects.push(thing(9, "ramekin", [0.4, -0.3], [0.08, 0.08, 0.04]));
    Scene {
        stamp_ns: tick * 200_000_000,
        objects,
        ..Scene::default()
    }
}

const TWO: [(u16, [f64; 2]); 2] = [(1, [0.5, 0.0]), (2, [0.45, -0.17])];

fn records(events: &[Event]) -> Vec<GroundingRecord> {
    let record = |event: &Event| match event {
        Event::Grounding(record) => Some(**record),
        _ => None,
    };
    events.iter().filter_map(record).collect()
}

fn offline(instruction: &str) -> AgentService {
    let mut service = AgentService::new(ServiceParams::default(), None);
    service.on_instruction(0, instruction).expect("a sentence");
    service
}

const NEAR_RAMEKIN: &str = "pick up the black bowl next to the ramekin and place it on the plate";

#[test]
fn offline_the_rules_plan_ground_and_prompt() {
    let mut service = offline(NEAR_RAMEKIN);
    service.on_scene(1, &scene(0, &TWO), None).expect("sound");
    let events = service.poll(2);
    assert!(matches!(&events[0], Event::Plan(plan) if plan.subtask_count == 1));
    assert!(matches!(&events[1], Event::Prompt { id: 1, text } if text == NEAR_RAMEKIN));
    let record = *records(&events).last().expect("a record");
    assert_eq!(
        (record.target, record.destination, record.prompt_id),
        (2, 8, 1)
    );
    assert!(record.confidence > 0.8 && record.epoch > 0 && record.candidate_count == 2);
}

#[test]
fn a_flickering_detector_does_not_move_the_lock() {
    let mut service = offline(NEAR_RAMEKIN);
    service.on_scene(1, &scene(0, &TWO), None).expect("sound");
    let first = *records(&service.poll(2)).last().expect("a record");
    for tick in 1..12 {
        // The locked bowl is seen in every third scene only.
        let seen = if tick % 3 == 0 { &TWO[..] } else { &TWO[..1] };
        service
            .on_scene(tick, &scene(tick, seen), None)
            .expect("sound");
        let record = *records(&service.poll(tick)).last().expect("a record");
        assert_eq!(
            (record.target, record.epoch),
            (first.target, first.epoch),
            "{tick}"
        );
    }
}

#[test]
fn a_lost_target_has_no_confidence_and_a_rebind_has_a_new_epoch() {
    let mut service = offline(NEAR_RAMEKIN);
    service.on_scene(1, &scene(0, &TWO), None).expect("sound");
    let first = *records(&service.poll(2)).last().expect("a record");
    service
        .on_scene(3, &scene(30, &[(1, [0.47, -0.18])]), None)
        .expect("sound");
    let lost = *records(&service.poll(4)).last().expect("a record");
    assert_eq!((lost.target, lost.epoch), (0, first.epoch));
    assert!(lost.confidence < 1e-9);
    let request = RebindRequest {
        request_id: 1,
        stamp_ns: 5,
        epoch: first.epoch + 3,
        subtask: 0,
        suspect: 2,
        reserved: 0,
        reasons: 0,
    };
    service
        .on_scene(5, &scene(31, &[(1, [0.47, -0.18])]), None)
        .expect("sound");
    service.on_rebind_request(5, &request);
    let bound = *records(&service.poll(6)).last().expect("a record");
    assert!(bound.epoch > request.epoch);
    assert_eq!(bound.target, 1);
    // A request about another subtask is stale.
    service.on_rebind_request(
        7,
        &RebindRequest {
            subtask: 3,
            ..request
        },
    );
    assert!(service.poll(8).is_empty());
}

#[test]
fn each_subtask_starts_afresh_and_leaves_out_what_was_placed() {
    let mut service = offline("put both black bowls on the plate");
    service.on_scene(1, &scene(0, &TWO), None).expect("sound");
    let first = *records(&service.poll(2)).last().expect("a record");
    service.on_subtask(3, 1);
    let second = *records(&service.poll(4)).last().expect("a record");
    assert_eq!(second.subtask, 1);
    assert!(second.epoch > first.epoch);
    assert_ne!(second.target, first.target);
    service.on_subtask(5, 9);
    assert!(service.poll(6).is_empty());
}

#[test]
fn what_is_not_understood_keeps_the_users_words() {
    let mut service = offline("polish the plate until it shines");
    service.on_scene(1, &scene(0, &TWO), None).expect("sound");
    let events = service.poll(2);
    assert!(matches!(&events[0], Event::Plan(plan) if plan.confidence_permille < 500));
    assert!(
        matches!(&events[1], Event::Prompt { text, .. } if text == "polish the plate until it shines")
    );
    assert!(records(&events).is_empty());
}

fn calls_to(manner: Manner) -> (Calls, StandIn) {
    let server = StandIn::start(manner).expect("a port");
    let config = ModelConfig {
        attempt_ms: 400,
        attempts: 1,
        ..ModelConfig::new(server.url(), "m")
    };
    (Calls::new(ChatModel::new(config).expect("no key")), server)
}

/// A server that gives every question the same content after `delay`.
fn server(content: &str, delay: Duration) -> Calls {
    calls_to(Manner::Slow(delay, content.to_owned())).0
}

fn wait_for_call(service: &mut AgentService) -> (Vec<Event>, CallRecord) {
    wait_for_call_after(service, Vec::new())
}

/// As above, with what was polled before: an answer may be quick.
fn wait_for_call_after(
    service: &mut AgentService,
    mut all: Vec<Event>,
) -> (Vec<Event>, CallRecord) {
    for tick in 0..400 {
        all.extend(service.poll(1000 + tick));
        let call = all.iter().find_map(|event| match event {
            Event::Call(call) => Some(call.clone()),
            _ => None,
        });
        if let Some(call) = call {
            return (all, call);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("no call ended");
}

#[test]
fn a_model_settles_what_the_rules_leave_open() {
    let calls = server(
        r#"{"selected_index":1,"confidence":0.95,"reason":"it does"}"#,
        Duration::ZERO,
    );
    let mut service = AgentService::new(ServiceParams::default(), Some(calls));
    service
        .on_instruction(0, "pick up the black bowl and place it on the plate")
        .expect("s");
    service.on_scene(1, &scene(0, &TWO), None).expect("sound");
    // The rules' record is there before the model's.
    let first = service.poll(2);
    let before = *records(&first).first().expect("a record");
    assert!(before.confidence < 0.7);
    let (events, call) = wait_for_call_after(&mut service, first);
    assert_eq!((call.role, call.outcome), (Role::Resolver, "ok"));
    let after = *records(&events).last().expect("a record");
    assert_eq!(
        (after.target, after.provenance),
        (2, Provenance::Resolver.code())
    );
    assert!(after.epoch > before.epoch && after.confidence > 0.8);
    // The choice holds in later scenes.
    service.on_scene(9, &scene(1, &TWO), None).expect("sound");
    let later = *records(&service.poll(10)).last().expect("a record");
    assert_eq!((later.target, later.epoch), (2, after.epoch));
    assert!(later.confidence > 0.7);
}

fn body(message: &str, finish: &str) -> Manner {
    let body = format!(r#"{{"choices":[{{"message":{message},"finish_reason":"{finish}"}}]}}"#);
    Manner::Body(body)
}

fn content(content: &str) -> Manner {
    Manner::Content(content.to_owned())
}

/// Ways to answer badly that are the same for every role, and what is recorded.
fn bad_answers() -> Vec<(Manner, &'static [&'static str])> {
    let valid = r#"{"selected_index":1,"confidence":1,"reason":""}"#.to_owned();
    vec![
        (content("I would choose the second one."), &["schema"]),
        (content(""), &["schema"]),
        (Manner::Body("<html>".to_owned()), &["protocol"]),
        (
            Manner::Slow(Duration::from_millis(900), valid),
            &["timeout"],
        ),
        (Manner::Hang, &["timeout"]),
        (Manner::Huge(300_000), &["too_large"]),
        (
            body(r#"{"refusal":"I can't do that"}"#, "stop"),
            &["refused"],
        ),
        (body(r#"{"content":""}"#, "content_filter"), &["refused"]),
        (body(r#"{"content":"{\"sel"}"#, "length"), &["truncated"]),
        // The announced end never comes: a cut stream or a wait, by the timing.
        (Manner::Cut, &["protocol", "timeout"]),
        (Manner::Status(500), &["status"]),
        (Manner::Status(401), &["status"]),
        (Manner::Redirect, &["status"]),
    ]
}

#[test]
fn a_bad_choice_changes_nothing_and_is_recorded() {
    let mut answers = bad_answers();
    for hostile in [
        r#"{"selected_index":7,"confidence":1,"reason":"take the knife"}"#,
        r#"{"selected_index":-1,"confidence":1,"reason":""}"#,
        r#"{"selected_index":1,"confidence":1,"reason":"","epoch":99}"#,
        r#"{"selected_index":1,"confidence":1e9,"reason":""}"#,
        r#"{"selected_index":1,"confidence":1,"reason":"","target_xyz":[0,0,0]}"#,
    ] {
        answers.push((content(hostile), &["schema"]));
    }
    for (manner, outcomes) in answers {
        let (calls, _server) = calls_to(manner.clone());
        let mut service = AgentService::new(ServiceParams::default(), Some(calls));
        service
            .on_instruction(0, "pick up the black bowl and place it on the plate")
            .expect("s");
        service.on_scene(1, &scene(0, &TWO), None).expect("sound");
        let first = service.poll(2);
        let before = *records(&first).first().expect("a record");
        let (events, call) = wait_for_call_after(&mut service, first);
        assert!(outcomes.contains(&call.outcome), "{manner:?}: {call:?}");
        assert_eq!((call.role, call.attempts), (Role::Resolver, 1));
        assert_eq!(records(&events).len(), 1, "the rules' own");
        service.on_scene(9, &scene(1, &TWO), None).expect("sound");
        let after = *records(&service.poll(10)).last().expect("a record");
        assert_eq!((after.target, after.epoch), (before.target, before.epoch));
    }
}

#[test]
fn a_bad_plan_changes_nothing_and_is_recorded() {
    let mut answers = bad_answers();
    let plan = |target: &str, confidence: &str| {
        content(&format!(
            r#"{{"canonical_instruction":"open the {target}","plan":["open the {target}"],
            "action":"open","target_object":"{target}","source_phrase":"","destination":"",
            "destination_prep":"","destination_relation":null,"confidence":{confidence}}}"#
        ))
    };
    // Not in the instruction; out of range; no better than the rules.
    answers.push((plan("safe", "1.0"), &["schema"]));
    answers.push((plan("plate", "2.0"), &["schema"]));
    answers.push((plan("plate", "0.01"), &["not_better"]));
    for (manner, outcomes) in answers {
        let (calls, _server) = calls_to(manner.clone());
        let mut service = AgentService::new(ServiceParams::default(), Some(calls));
        service
            .on_instruction(0, "polish the plate until it shines")
            .expect("s");
        let before = service.plan().cloned();
        let (events, call) = wait_for_call(&mut service);
        assert!(outcomes.contains(&call.outcome), "{manner:?}: {call:?}");
        assert_eq!(call.role, Role::Planner);
        let plans = events
            .iter()
            .filter(|event| matches!(event, Event::Plan(_)));
        assert_eq!(plans.count(), 1, "the rules' own");
        assert_eq!(service.plan().cloned(), before);
    }
}

#[test]
fn a_bad_critic_says_nothing_and_is_recorded() {
    let mut answers = bad_answers();
    for hostile in [
        r#"{"failure_type":"explosion","reason":"","confidence":1,"evidence_tags":[]}"#,
        r#"{"failure_type":"success","reason":"","confidence":1,"evidence_tags":[],"route":"exec"}"#,
    ] {
        answers.push((content(hostile), &["schema"]));
    }
    for (manner, outcomes) in answers {
        let (calls, _server) = calls_to(manner.clone());
        let mut service = AgentService::new(ServiceParams::default(), Some(calls));
        service.on_instruction(0, NEAR_RAMEKIN).expect("s");
        service.on_snapshot(1, &Snapshot::default(), FailureType::None, 0.5);
        let (events, call) = wait_for_call(&mut service);
        assert!(outcomes.contains(&call.outcome), "{manner:?}: {call:?}");
        assert_eq!(call.role, Role::Critic);
        assert!(!events.iter().any(|event| matches!(event, Event::Critic(_))));
    }
}

#[test]
fn a_critic_that_is_too_sure_is_clamped_and_the_rules_win() {
    let sure = r#"{"failure_type":"success","reason":"","confidence":7,"evidence_tags":[]}"#;
    let (calls, _server) = calls_to(content(sure));
    let mut service = AgentService::new(ServiceParams::default(), Some(calls));
    service.on_instruction(0, NEAR_RAMEKIN).expect("s");
    service.on_snapshot(1, &Snapshot::default(), FailureType::None, 0.5);
    let (events, call) = wait_for_call(&mut service);
    assert_eq!(call.outcome, "ok");
    let report = events.iter().find_map(|event| match event {
        Event::Critic(report) => Some(*report),
        _ => None,
    });
    let report = report.expect("a report");
    let none = bind::critic_label(FailureType::None).code();
    assert_eq!((report.label, report.confidence), (none, 0.5));
}

#[test]
fn a_new_instruction_cancels_and_the_budget_holds() {
    let content = r#"{"selected_index":0,"confidence":0.9,"reason":""}"#;
    let calls = server(content, Duration::from_millis(150));
    let mut service = AgentService::new(ServiceParams::default(), Some(calls));
    service
        .on_instruction(0, "pick up the black bowl and place it on the plate")
        .expect("s");
    service.on_scene(1, &scene(0, &TWO), None).expect("sound");
    service.on_instruction(2, NEAR_RAMEKIN).expect("s");
    let (events, call) = wait_for_call(&mut service);
    assert_eq!(call.outcome, "cancelled");
    assert!(
        records(&events)
            .iter()
            .all(|record| record.provenance != Provenance::Resolver.code())
    );
    // Two snapshots may be asked about, the third is too many.
    for _ in 0..3 {
        service.on_snapshot(3, &Snapshot::default(), FailureType::None, 0.5);
    }
    assert_eq!(service.spent[Role::Critic as usize], 2);
}

#[test]
fn a_model_may_read_what_the_rules_cannot() {
    let answer = r#"{"canonical_instruction":"put the butter in the basket",
        "plan":["put the butter in the basket"],"action":"pick_and_place",
        "target_object":"butter","source_phrase":"","destination":"basket",
        "destination_prep":"in","destination_relation":"in","confidence":0.95}"#;
    let calls = server(answer, Duration::ZERO);
    let mut service = AgentService::new(ServiceParams::default(), Some(calls));
    service
        .on_instruction(0, "the butter wants to be where the basket is")
        .expect("s");
    assert!(!service.plan().expect("a plan").understood());
    let (events, call) = wait_for_call(&mut service);
    assert_eq!((call.role, call.outcome), (Role::Planner, "ok"));
    assert!(
        events
            .iter()
            .any(|event| matches!(event, Event::Plan(plan) if plan.id == 2))
    );
    assert_eq!(service.plan().expect("a plan").subtasks[0].target, "butter");
}
