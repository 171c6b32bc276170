//! H. Purity, totality, resources, reports.

use fitmac_core::{
    Controller, Params, State,
    message::{
        ActionChunk, Command, CriticReport, GroundingRecord, Plan, PolicyQuery, RebindRequest,
        StateSample, TraceRecord, VerifierReport,
    },
    params::ParamInfo,
    wire::{Mode, Route},
};
use fitmac_core_tests::swarm::{Swarm, Told};

use super::stand::{SEEDS, swarms};

#[test]
fn inv_62_the_same_inputs_give_the_same_outputs_and_state() {
    for seed in SEEDS {
        let mut swarm = Swarm::new(seed);
        let mut first = Controller::new(swarm.params);
        let mut second = first.clone();
        let mut log: Vec<Told> = Vec::new();
        let mut outputs = Vec::new();
        for _ in 0..400 {
            let told = swarm.tick();
            let output = first.tick(told.now_ns, &told.input());
            swarm.hear(&output);
            outputs.push(output);
            log.push(told);
        }
        for (n, (told, expected)) in log.iter().zip(&outputs).enumerate() {
            let found = second.tick(told.now_ns, &told.input());
            assert_eq!(
                bytes(&found.command),
                bytes(&expected.command),
                "seed {seed}, tick {n}"
            );
            assert_eq!(format!("{found:?}"), format!("{expected:?}"));
        }
        assert_eq!(first, second);
    }
}

/// Bit for bit: a NaN that equals itself, and zeros that differ by sign.
fn bytes(c: &Command) -> Vec<u64> {
    c.action
        .iter()
        .chain(&c.setpoint_position_m)
        .chain(&c.setpoint_velocity_m_s)
        .chain(&c.setpoint_acceleration_m_s2)
        .chain(&c.setpoint_orientation)
        .map(|x| x.to_bits())
        .chain([c.sequence, c.stamp_ns, c.policy_step, c.query, c.reasons])
        .chain([c.mode, c.route, c.phase, c.sub_phase].map(u64::from))
        .chain([u64::from(c.flags)])
        .collect()
}

#[test]
fn inv_63_any_time_and_any_input_give_one_command() {
    // The swarm's broken messages, told at times from all over the range.
    for seed in SEEDS {
        let mut swarm = Swarm::new(seed);
        let mut controller = Controller::new(swarm.params);
        for n in 0..300_u64 {
            let told = swarm.tick();
            let now_ns = match n % 7 {
                0 => u64::MAX - n,
                1 => 0,
                2 => told.now_ns.wrapping_mul(0x9E37_79B9_7F4A_7C15),
                _ => told.now_ns,
            };
            let output = controller.tick(now_ns, &told.input());
            assert_eq!(output.command.sequence, n + 1);
            assert!(output.command.action.iter().all(|x| x.is_finite()));
        }
    }
}

#[test]
fn inv_66_the_messages_have_their_sizes_and_the_state_is_small() {
    assert_eq!(size_of::<StateSample>(), 240 + 104 * 32);
    assert_eq!(size_of::<ActionChunk>(), 64 + 28 * 64);
    assert_eq!(size_of::<GroundingRecord>(), 120 + 16 * 16);
    assert_eq!(size_of::<Plan>(), 16);
    assert_eq!(size_of::<VerifierReport>(), 24);
    assert_eq!(size_of::<CriticReport>(), 32);
    assert_eq!(size_of::<PolicyQuery>(), 48);
    assert_eq!(size_of::<RebindRequest>(), 40);
    assert_eq!(size_of::<Command>(), 32 + 56 + 104 + 16);
    assert_eq!(size_of::<TraceRecord>(), 56 + 24 + 16 + 32 + 72 + 112);
    assert!(size_of::<State>() <= 16 * 1024, "{}", size_of::<State>());
}

#[test]
fn inv_67_a_snapshot_goes_on_as_if_nothing_had_happened() {
    for seed in SEEDS {
        let mut swarm = Swarm::new(seed);
        let mut whole = Controller::new(swarm.params);
        let mut restored = Controller::new(swarm.params);
        for n in 0..400 {
            let told = swarm.tick();
            let output = whole.tick(told.now_ns, &told.input());
            if n % 37 == 0 {
                // Through a controller that has seen nothing.
                restored = Controller::new(swarm.params);
                restored.restore(whole.state().clone());
            } else {
                let again = restored.tick(told.now_ns, &told.input());
                assert_eq!(bytes(&again.command), bytes(&output.command), "seed {seed}");
            }
            swarm.hear(&output);
        }
        assert_eq!(whole, restored);
    }
}

/// A number that is none, in a place that does not count, would make a state unequal to itself.
#[test]
fn inv_67_a_snapshot_equals_itself_whatever_a_record_holds() {
    for (seed, change) in (0..40).flat_map(|seed| (0..4).map(move |change| (seed, change))) {
        let mut swarm = Swarm::new(seed);
        let mut controller = Controller::new(swarm.params);
        for _ in 0..300 {
            let mut told = swarm.tick();
            if let Some(record) = &mut told.grounding {
                let [first, rest @ ..] = &mut record.candidates;
                match change {
                    0 => first.confidence = f64::NAN,
                    1 => rest.iter_mut().for_each(|c| c.confidence = f64::NAN),
                    2 => record.image_box_px = [f64::NAN; 4].map(|n| n as _),
                    _ => record.confidence = f64::NAN,
                }
            }
            let output = controller.tick(told.now_ns, &told.input());
            let copy = controller.state().clone();
            assert!(copy == *controller.state(), "seed {seed}, change {change}");
            swarm.hear(&output);
        }
    }
}

fn with(info: &ParamInfo, value: f64) -> Params {
    let mut params = Params::guarded();
    let key = format!("{}.{}", info.stage, info.name);
    if params.assign(&key, &format!("{value}")).is_err() {
        // A count has no fraction.
        params
            .assign(&key, &format!("{value:.0}"))
            .expect("a number");
    }
    params
}

/// The next number up or down that the parameter can hold.
fn beyond(info: &ParamInfo, bound: f64, outwards: f64) -> Option<f64> {
    let is_count = Params::guarded()
        .assign(&format!("{}.{}", info.stage, info.name), "0.5")
        .is_err();
    if !is_count {
        return Some(bound + outwards * 1e-6 * bound.abs().max(1e-3));
    }
    let next = bound + outwards;
    (next >= 0.0).then_some(next)
}

#[test]
fn inv_68_every_bound_of_every_parameter_holds_at_its_edge() {
    let mut checked = 0;
    for info in Params::TABLES.iter().copied().flatten() {
        let violated = |value: f64| {
            let found = with(info, value).validate();
            found.is_err_and(|v| {
                v.iter()
                    .any(|x| x.stage == info.stage && x.name == info.name)
            })
        };
        let key = format!("{}.{}", info.stage, info.name);
        assert!(!violated(info.min), "{key} at its least");
        assert!(!violated(info.max), "{key} at its greatest");
        assert!(!violated(info.default), "{key} at its default");
        assert!(
            info.min <= info.default && info.default <= info.max,
            "{key}"
        );
        for (bound, outwards) in [(info.min, -1.0), (info.max, 1.0)] {
            if let Some(value) = beyond(info, bound, outwards) {
                assert!(violated(value), "{key} = {value}");
                checked += 1;
            }
        }
        let mut nan = Params::guarded();
        if nan.assign(&key, "NaN").is_ok() {
            let found = nan.validate().expect_err("a NaN is no value");
            assert!(found.iter().any(|x| x.name == info.name), "{key}");
        }
    }
    assert!(checked > 150, "{checked}");
}

#[test]
fn inv_68_all_violations_are_named_at_once() {
    let mut params = Params::guarded();
    params.gate.failure_streak = 0;
    params.lock.kappa_min = f64::NAN;
    params.recovery.close_min = 50;
    params.filter.workspace_min_x_m = 1.0;
    let found = params.validate().expect_err("four things are wrong");
    let text = found.to_string();
    assert_eq!(found.len(), 4, "{text}");
    for name in [
        "failure_streak",
        "kappa_min",
        "close_min",
        "workspace_min_x_m",
    ] {
        assert!(text.contains(name), "{text}");
    }
}

#[test]
fn inv_68_everything_wrong_at_once_still_fits() {
    let mut params = Params::guarded();
    for info in Params::TABLES.iter().copied().flatten() {
        let key = format!("{}.{}", info.stage, info.name);
        if params.assign(&key, "NaN").is_err() {
            params.assign(&key, "4000000000").expect("a count");
        }
    }
    let found = params.validate().expect_err("all is wrong");
    for info in Params::TABLES.iter().copied().flatten() {
        let named = found
            .iter()
            .any(|x| x.stage == info.stage && x.name == info.name);
        assert!(named, "{}.{}", info.stage, info.name);
    }
}

#[test]
fn inv_69_reasons_stand_iff_something_is_not_plain() {
    let (mut plain, mut reasoned) = (0, 0);
    swarms(|seen| {
        let c = &seen.output.command;
        let is_plain = c.mode == Mode::Normal.code() && c.route == Route::Base.code();
        assert_eq!(c.reasons == 0, is_plain, "seed {}: {c:?}", seen.seed);
        plain += u32::from(is_plain);
        reasoned += u32::from(!is_plain);
    });
    assert!(plain > 1000 && reasoned > 1000);
}

#[test]
fn inv_70_who_reads_the_trace_changes_nothing() {
    // A controller whose records are all read, and one whose records are all
    // dropped, from the same inputs: the record is a value, not a sink.
    for seed in SEEDS {
        let mut swarm = Swarm::new(seed);
        let mut read = Controller::new(swarm.params);
        let mut dropped = read.clone();
        let mut lines = 0;
        for _ in 0..300 {
            let told = swarm.tick();
            let output = read.tick(told.now_ns, &told.input());
            if let Some(record) = &output.trace {
                lines += fitmac_core_tests::world::table::row(record).len();
            }
            let command = dropped.tick(told.now_ns, &told.input()).command;
            assert_eq!(bytes(&command), bytes(&output.command));
            swarm.hear(&output);
        }
        assert_eq!(read, dropped);
        assert!(lines < usize::MAX);
    }
}
