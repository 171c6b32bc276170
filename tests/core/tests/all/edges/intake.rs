//! Messages at the very limits of what the doors of the intake let in.

use fitmac_core::{
    Controller, Params,
    intake::{Refusal, is_newer},
    message::{
        ActionChunk, GroundingRecord, Input, OBJECT_CAPACITY, ObjectSample, Plan, PolicyQuery,
        StateSample,
    },
    params::{OutOfRange, WhileRebinding},
    wire::{ActionFrame, ActionSpace, DestinationKind, GraspClass, PlaceRelation, Provenance},
};

const MS: u64 = 1_000_000;
const NOW_NS: u64 = 10_000 * MS;

/// Parameters whose limits a binary fraction holds, no settling, and questions without a lock.
fn params() -> Params {
    let mut params = Params::guarded();
    params.clock.settle_steps = 0;
    params.while_rebinding = WhileRebinding::BaseActs;
    params.state.plausible_position_m = 2.0;
    params.state.jump_margin_m = 0.125;
    params.state.jump_speed_m_s = 4.0;
    params.chunk.hold_after_ms = 100;
    params.out_of_range = OutOfRange::Refuse;
    params.chunk.range_tolerance = 0.125;
    params
}

fn controller() -> Controller {
    Controller::new(params().validate().expect("they are valid"))
}

/// Why this was refused, if it was; the controller's first refusal.
fn refusal(controller: &mut Controller, now_ns: u64, input: &Input<'_>) -> Option<Refusal> {
    controller.tick(now_ns, input);
    let refusals = controller.state().refusals();
    let refused = refusals.iter().find(|&(_, n)| n > 0);
    refused.map(|(why, _)| why)
}

fn sample() -> StateSample {
    let mut sample = StateSample {
        sequence: 1,
        session: 1,
        stamp_ns: NOW_NS,
        ee_position_m: [0.5, 0.0, 0.25],
        gripper_width_m: 0.08,
        object_count: 1,
        ..StateSample::default()
    };
    sample.objects[0] = ObjectSample {
        id: 1,
        grasp_class: GraspClass::Box.code(),
        visible: 1,
        stamp_ns: NOW_NS,
        position_m: [0.5, 0.0, 0.0],
        orientation: [1.0, 0.0, 0.0, 0.0],
        half_extent_m: [0.25; 3],
        confidence: 1.0,
        ..ObjectSample::default()
    };
    sample
}

/// Why a sample changed by `change` is refused.
fn of_state(change: impl FnOnce(&mut StateSample)) -> Option<Refusal> {
    let mut sample = sample();
    change(&mut sample);
    let input = Input {
        state: Some(&sample),
        ..Input::default()
    };
    refusal(&mut controller(), NOW_NS, &input)
}

#[test]
fn a_state_may_be_as_far_out_as_is_plausible_and_no_farther() {
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let hand = |x: f64| of_state(|s| s.ee_position_m[axis] = side * x);
            assert_eq!(hand(2.0), None);
            assert_eq!(hand(2.0_f64.next_up()), Some(Refusal::Implausible));
            let object = |x: f64| of_state(|s| s.objects[0].position_m[axis] = side * x);
            assert_eq!(object(2.0), None);
            assert_eq!(object(2.0_f64.next_up()), Some(Refusal::Implausible));
        }
        let extent = |h: f64| of_state(|s| s.objects[0].half_extent_m[axis] = h);
        assert_eq!(extent(2.0), None);
        assert_eq!(extent(2.0_f64.next_up()), Some(Refusal::NotFinite));
        assert_eq!(extent(0.0), None, "a flat thing");
        assert_eq!(extent(-f64::MIN_POSITIVE), Some(Refusal::NotFinite));
    }
}

#[test]
fn a_state_may_be_as_far_ahead_of_the_clock_as_the_skew() {
    let skew = u64::from(params().state.future_skew_ms) * MS;
    assert_eq!(of_state(|s| s.stamp_ns = NOW_NS + skew), None);
    let ahead = of_state(|s| s.stamp_ns = NOW_NS + skew + 1);
    assert_eq!(ahead, Some(Refusal::FromFuture));
}

#[test]
fn a_state_holds_as_many_objects_as_there_is_room_for() {
    let full = |count: usize| {
        of_state(|s| {
            let first = s.objects[0];
            for (object, id) in s.objects.iter_mut().zip(1..) {
                *object = ObjectSample { id, ..first };
            }
            s.object_count = u32::try_from(count).expect("few");
        })
    };
    assert_eq!(full(OBJECT_CAPACITY), None);
    assert_eq!(full(OBJECT_CAPACITY + 1), Some(Refusal::TooLong));
}

#[test]
fn a_turn_may_be_off_by_rounding_only() {
    for (w, refused) in [(1.0 + 0.99e-5, false), (1.0 + 1.01e-5, true)] {
        let why = refused.then_some(Refusal::Quaternion);
        assert_eq!(of_state(|s| s.ee_orientation = [w, 0.0, 0.0, 0.0]), why);
        let short = [0.0, 2.0 - w, 0.0, 0.0];
        assert_eq!(of_state(|s| s.objects[0].orientation = short), why);
    }
}

#[test]
fn a_hand_jumps_when_it_goes_farther_than_its_speed_and_the_margin_reach() {
    let after = |seconds: f64, far_m: f64| {
        let mut controller = controller();
        let mut sample = sample();
        controller.tick(
            NOW_NS,
            &Input {
                state: Some(&sample),
                ..Input::default()
            },
        );
        sample.sequence = 2;
        sample.stamp_ns += (seconds * 1e9) as u64;
        sample.ee_position_m[1] = far_m;
        let input = Input {
            state: Some(&sample),
            ..Input::default()
        };
        refusal(&mut controller, sample.stamp_ns, &input)
    };
    // The margin is an eighth of a metre, the speed four metres a second.
    assert_eq!(after(0.0, 0.125), None);
    assert_eq!(after(0.0, 0.126), Some(Refusal::Jump));
    assert_eq!(after(0.125, -0.625), None);
    assert_eq!(after(0.125, -0.626), Some(Refusal::Jump));
}

/// A controller that has just asked its policy, and what it asked.
fn asking() -> (Controller, PolicyQuery) {
    let mut controller = controller();
    let sample = sample();
    let input = Input {
        state: Some(&sample),
        ..Input::default()
    };
    let output = controller.tick(NOW_NS, &input);
    let query = output.query.expect("it asks at once");
    (controller, query)
}

/// Why a chunk changed by `change` is refused, a hold's time after the question at most.
fn of_chunk(later_ns: u64, change: impl FnOnce(&mut ActionChunk)) -> Option<Refusal> {
    let (mut controller, query) = asking();
    let mut chunk = ActionChunk {
        sequence: 1,
        session: 1,
        observation_ns: NOW_NS,
        stamp_ns: NOW_NS,
        query_id: query.query_id,
        epoch: query.epoch,
        subtask: query.subtask,
        prompt_id: query.prompt_id,
        horizon: 8,
        action_space: ActionSpace::OscPoseDelta.code(),
        frame: ActionFrame::Base.code(),
        gripper: params().policy_gripper.convention().code(),
        ..ActionChunk::default()
    };
    change(&mut chunk);
    let input = Input {
        chunk: Some(&chunk),
        ..Input::default()
    };
    refusal(&mut controller, NOW_NS + later_ns, &input)
}

#[test]
fn an_action_may_be_out_of_the_box_by_the_tolerance() {
    for side in [1.0, -1.0] {
        let with = |x: f32| of_chunk(0, |c| c.actions[7][6] = side * x);
        assert_eq!(with(1.125), None);
        assert_eq!(with(1.125_f32.next_up()), Some(Refusal::OutOfRange));
    }
    let beyond = of_chunk(0, |c| c.actions[8][0] = 2.0);
    assert_eq!(beyond, None, "behind the horizon anything may stand");
}

#[test]
fn a_chunk_may_be_as_old_as_the_limit_and_as_far_ahead_as_the_skew() {
    let skew = u64::from(params().chunk.future_skew_ms) * MS;
    assert_eq!(of_chunk(0, |c| c.stamp_ns += skew), None);
    assert_eq!(of_chunk(0, |c| c.observation_ns += skew), None);
    let ahead = Some(Refusal::FromFuture);
    assert_eq!(of_chunk(0, |c| c.stamp_ns += skew + 1), ahead);
    assert_eq!(of_chunk(0, |c| c.observation_ns += skew + 1), ahead);
    let oldest = NOW_NS - u64::from(params().chunk.max_age_ms) * MS;
    assert_eq!(of_chunk(0, |c| c.observation_ns = oldest), None);
    let older = of_chunk(0, |c| c.observation_ns = oldest - 1);
    assert_eq!(older, Some(Refusal::TooOld));
    assert_eq!(of_chunk(1, |c| c.observation_ns = oldest), older);
}

#[test]
fn a_chunk_holds_one_action_at_least_and_as_many_as_there_is_room_for() {
    assert_eq!(of_chunk(0, |c| c.horizon = 1), None);
    assert_eq!(of_chunk(0, |c| c.horizon = 64), None);
    assert_eq!(of_chunk(0, |c| c.horizon = 0), Some(Refusal::Empty));
    assert_eq!(of_chunk(0, |c| c.horizon = 65), Some(Refusal::TooLong));
}

#[test]
fn a_chunk_of_another_space_or_frame_is_refused() {
    let refused = Some(Refusal::Convention);
    for code in (0..=u8::MAX).filter(|c| *c != ActionSpace::OscPoseDelta.code()) {
        let known = ActionSpace::try_from(code).is_ok();
        let why = of_chunk(MS, |c| c.action_space = code);
        assert_eq!(
            why,
            if known {
                refused
            } else {
                Some(Refusal::UnknownCode)
            }
        );
    }
    for code in (0..=u8::MAX).filter(|c| *c != ActionFrame::Base.code()) {
        let known = ActionFrame::try_from(code).is_ok();
        let why = of_chunk(MS, |c| c.frame = code);
        assert_eq!(
            why,
            if known {
                refused
            } else {
                Some(Refusal::UnknownCode)
            }
        );
    }
    assert_eq!(of_chunk(MS, |_| ()), None);
}

#[test]
fn a_question_is_asked_again_after_the_time_of_a_hold_and_not_before() {
    let (mut controller, query) = asking();
    let hold = u64::from(params().chunk.hold_after_ms) * MS;
    let mut at = |later_ns: u64| {
        let sample = StateSample {
            sequence: 1 + later_ns,
            stamp_ns: NOW_NS + later_ns,
            ..sample()
        };
        let input = Input {
            state: Some(&sample),
            ..Input::default()
        };
        controller.tick(sample.stamp_ns, &input).query
    };
    assert_eq!(at(hold - 1), None);
    assert_eq!(at(hold), Some(query));
    assert_eq!(at(2 * hold - 1), None);
    assert_eq!(at(2 * hold), Some(query));
}

/// A record with a direct destination.
fn record() -> GroundingRecord {
    let mut record = GroundingRecord {
        sequence: 1,
        session: 1,
        stamp_ns: NOW_NS,
        epoch: 1,
        target: 1,
        destination: 2,
        destination_kind: DestinationKind::Direct.code(),
        relation: PlaceRelation::On.code(),
        provenance: Provenance::Rules.code(),
        candidate_count: 1,
        confidence: 1.0,
        ..GroundingRecord::default()
    };
    record.candidates[0].id = 1;
    record
}

/// Why it is refused, changed by `change`.
fn of_grounding(change: impl FnOnce(&mut GroundingRecord)) -> Option<Refusal> {
    let mut record = record();
    change(&mut record);
    let input = Input {
        grounding: Some(&record),
        ..Input::default()
    };
    refusal(&mut controller(), NOW_NS, &input)
}

#[test]
fn a_number_is_newer_up_to_half_of_all_numbers_ahead() {
    const HALF: u64 = 1 << 63;
    for last in [0, 1, HALF - 1, HALF, u64::MAX] {
        let newer = |ahead: u64| is_newer(last.wrapping_add(ahead), last);
        assert!(!newer(0));
        assert!(newer(1));
        assert!(newer(HALF - 1));
        assert!(!newer(HALF), "as far ahead as behind");
        assert!(!newer(u64::MAX));
    }
}

#[test]
fn a_grounder_that_restarts_counts_from_its_own_beginning() {
    let mut controller = controller();
    let mut hear = |session, sequence| {
        let record = GroundingRecord {
            session,
            sequence,
            ..record()
        };
        let input = Input {
            grounding: Some(&record),
            ..Input::default()
        };
        controller.tick(NOW_NS, &input);
        controller
            .state()
            .refusals()
            .iter()
            .map(|(_, n)| n)
            .sum::<u32>()
    };
    assert_eq!(hear(1, 7), 0);
    // The same number of another session is no repetition, and a lower one is not old.
    assert_eq!(hear(2, 7), 0);
    assert_eq!(hear(3, 1), 0);
    assert_eq!(hear(3, 1), 1);
}

#[test]
fn what_a_record_holds_beyond_its_candidates_leaves_no_trace() {
    let after = |change: fn(&mut GroundingRecord)| {
        let mut record = record();
        change(&mut record);
        let mut controller = controller();
        let input = Input {
            grounding: Some(&record),
            ..Input::default()
        };
        controller.tick(NOW_NS, &input);
        controller
    };
    let plain = after(|_| ());
    assert!(after(|r| r.candidates[1].id = 9).state() == plain.state());
    assert!(after(|r| r.candidates[0].id = 9).state() != plain.state());
}

#[test]
fn a_region_may_be_as_far_out_and_as_large_as_is_plausible() {
    let refused = Some(Refusal::NotFinite);
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let offset = |x: f64| of_grounding(|r| r.region_offset_m[axis] = side * x);
            assert_eq!(offset(2.0), None);
            assert_eq!(offset(2.0_f64.next_up()), refused);
        }
        let extent = |x: f64| of_grounding(|r| r.region_half_extent_m[axis] = x);
        assert_eq!(extent(2.0), None);
        assert_eq!(extent(2.0_f64.next_up()), refused);
        assert_eq!(extent(0.0), None);
        assert_eq!(extent(-f64::MIN_POSITIVE), refused);
    }
}

#[test]
fn a_record_may_be_as_far_ahead_of_the_clock_as_the_skew_and_name_as_many_as_there_is_room_for() {
    let skew = u64::from(params().state.future_skew_ms) * MS;
    assert_eq!(of_grounding(|r| r.stamp_ns += skew), None);
    let ahead = of_grounding(|r| r.stamp_ns += skew + 1);
    assert_eq!(ahead, Some(Refusal::FromFuture));
    assert_eq!(of_grounding(|r| r.candidate_count = 16), None);
    let many = of_grounding(|r| r.candidate_count = 17);
    assert_eq!(many, Some(Refusal::TooLong));
    let other = of_grounding(|r| r.target = 2);
    assert_eq!(other, Some(Refusal::NotACandidate));
}

#[test]
fn a_plan_has_a_subtask_at_least_and_as_many_as_there_is_room_for() {
    let of_plan = |subtask_count, confidence_permille| {
        let plan = Plan {
            id: 1,
            subtask_count,
            confidence_permille,
        };
        let input = Input {
            plan: Some(&plan),
            ..Input::default()
        };
        refusal(&mut controller(), NOW_NS, &input)
    };
    let bad = Some(Refusal::BadPlan);
    assert_eq!(of_plan(1, 1000), None);
    assert_eq!(of_plan(8, 0), None);
    assert_eq!(of_plan(0, 1000), bad);
    assert_eq!(of_plan(9, 1000), bad);
    assert_eq!(of_plan(1, 1001), bad);
}
