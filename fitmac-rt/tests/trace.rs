//! The trace: written, read back, damaged, replayed.

use std::io::Cursor;

use fitmac_core::{
    Controller, Params, ValidParams,
    message::{ActionChunk, Input, Plan, StateSample},
    wire::{ActionFrame, ActionSpace, GripperConvention},
};
use fitmac_rt::{
    config,
    frame::{Parts, Tick, TickHead},
    message::PromptText,
    replay::{NotReplayable, replay},
    ring::Record as _,
    trace::{FOXGLOVE_LAYOUT, Metadata, Record, TraceReader, TraceWriter, write_csv},
};

const MS: u64 = 1_000_000;

/// A controller that asks its policy at once.
fn params() -> ValidParams {
    let mut params = Params::default();
    params.clock.settle_steps = 0;
    params.lock.rebind_wait_ms = 0;
    params.validate().expect("valid")
}

/// Ticks of a policy that answers every query and a robot that does as told.
fn episode(ticks: u64) -> Vec<Tick> {
    let mut core = Controller::new(params());
    let mut recorded: Vec<Tick> = Vec::new();
    let (mut state, mut answer) = (StateSample::default(), None);
    state.ee_position_m = [0.4, 0.0, 0.3];
    state.gripper_width_m = 0.08;
    state.session = 1;
    let plan = Plan {
        id: 1,
        subtask_count: 1,
        confidence_permille: 1000,
    };
    for tick in 1..=ticks {
        let now_ns = tick * MS;
        state.sequence += 1;
        state.stamp_ns = now_ns;
        let chunk: Option<ActionChunk> = answer.take();
        let input = Input {
            state: Some(&state),
            chunk: chunk.as_ref(),
            plan: (tick == 1).then_some(&plan),
            ..Input::default()
        };
        let output = core.tick(now_ns, &input);
        let head = TickHead {
            tick,
            now_ns,
            ..TickHead::default()
        };
        recorded.record(&Parts::of(head, &input, &output));
        answer = output.query.map(|query| ActionChunk {
            sequence: tick,
            session: 1,
            observation_ns: now_ns,
            stamp_ns: now_ns,
            query_id: query.query_id,
            epoch: query.epoch,
            subtask: query.subtask,
            prompt_id: query.prompt_id,
            horizon: 8,
            action_space: ActionSpace::OscPoseDelta.code(),
            frame: ActionFrame::Base.code(),
            gripper: GripperConvention::MinusOneOpen.code(),
            actions: core::array::from_fn(|i| [0.1, -0.05, 0.01 * i as f32, 0.0, 0.0, 0.0, -1.0]),
            ..ActionChunk::default()
        });
        state.applied_command = output.command.sequence;
        state.ee_position_m = output.command.setpoint_position_m;
    }
    assert!(recorded.iter().any(|t| t.chunk.is_some()));
    assert!(recorded.iter().any(|t| t.output.trace.is_some()));
    recorded
}

fn metadata() -> Metadata {
    Metadata::from([("params".to_owned(), config::to_text(&params()))])
}

fn file(ticks: &[Tick]) -> Vec<u8> {
    let mut writer = TraceWriter::new(Cursor::new(Vec::new()), &metadata()).expect("starts");
    let prompt = PromptText::new(1, 0, 1, "pick up the can").expect("fits");
    writer.prompt(MS, &prompt).expect("writes");
    ticks.iter().for_each(|t| writer.tick(t).expect("writes"));
    writer.finish().expect("ends").into_inner()
}

fn reader(bytes: &[u8]) -> TraceReader<&[u8]> {
    TraceReader::new(bytes, bytes.len() as u64)
}

fn ticks_of(records: impl Iterator<Item = Record>) -> Vec<Tick> {
    records
        .filter_map(|r| match r {
            Record::Tick(tick) => Some(*tick),
            _ => None,
        })
        .collect()
}

/// Ticks as bytes: equality of bits, where a NaN equals itself.
fn bits(ticks: &[Tick]) -> Vec<Vec<u8>> {
    ticks
        .iter()
        .map(|t| {
            let mut bytes = Vec::new();
            Parts::of(t.head, &t.input(), &t.output).for_each(|p| bytes.extend_from_slice(p));
            bytes
        })
        .collect()
}

#[test]
fn what_is_written_is_read_back_bit_for_bit() {
    let ticks = episode(3000);
    let bytes = file(&ticks);
    let mut reader = reader(&bytes);
    let records: Vec<Record> = reader.by_ref().collect();
    assert_eq!(reader.damage(), None);
    assert_eq!(reader.metadata(), &metadata());
    assert!(
        records
            .iter()
            .any(|r| matches!(r, Record::Prompt(MS, p) if p.text() == Ok("pick up the can")))
    );
    assert_eq!(bits(&ticks_of(records.into_iter())), bits(&ticks));
}

#[test]
fn a_truncated_file_is_read_up_to_its_end_and_says_so() {
    let ticks = episode(3000);
    let bytes = file(&ticks);
    let whole = bits(&ticks);
    let mut most = 0;
    for percent in (1..100).step_by(7) {
        let cut = &bytes[..bytes.len() * percent / 100];
        let mut reader = reader(cut);
        let read = bits(&ticks_of(reader.by_ref()));
        assert!(reader.damage().is_some(), "cut at {percent} %");
        assert_eq!(read, whole[..read.len()], "cut at {percent} %");
        assert!(read.len() >= most);
        most = read.len();
    }
    assert!(most > whole.len() / 2, "only {most} ticks were rescued");
}

#[test]
fn a_flipped_bit_never_passes_and_never_panics() {
    let ticks = episode(400);
    let bytes = file(&ticks);
    let whole = bits(&ticks);
    let mut noticed = 0;
    for at in (0..bytes.len()).step_by(bytes.len() / 300) {
        let mut spoilt = bytes.clone();
        spoilt[at] ^= 0x10;
        let mut reader = reader(&spoilt);
        let read = bits(&ticks_of(reader.by_ref()));
        assert_eq!(read, whole[..read.len()], "a flip at {at} passed");
        noticed += usize::from(reader.damage().is_some());
    }
    assert!(noticed > 0);
}

#[test]
fn what_is_no_trace_is_refused_by_name() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("x.mcap");
    std::fs::write(&path, "hello, this is text and no recording").expect("writes");
    let error = TraceReader::open(&path).err().expect("refused").to_string();
    assert!(
        error.contains("x.mcap") && error.contains("no MCAP"),
        "{error}"
    );

    let mut foreign = mcap::Writer::new(Cursor::new(Vec::new())).expect("starts");
    foreign.finish().expect("ends");
    std::fs::write(&path, foreign.into_inner().into_inner()).expect("writes");
    let error = TraceReader::open(&path).err().expect("refused").to_string();
    assert!(error.contains("no FIT-MAC trace"), "{error}");
    assert!(TraceReader::open(&dir.path().join("none")).is_err());
}

#[test]
fn a_replay_agrees_and_another_parameter_parts() {
    let ticks = episode(3000);
    let bytes = file(&ticks);
    let params = params();
    let report = replay(reader(&bytes), params);
    assert_eq!((report.ticks, report.different_ticks), (3000, 0));
    assert_eq!((report.first, report.stopped), (None, None));

    let other = config::assign(&params, &["clock.settle_steps=4"]).expect("valid");
    let report = replay(reader(&bytes), other);
    assert_eq!(report.ticks, 3000);
    let (parting, decisions) = report.first_decision.expect("decisions part");
    // Standing still first, the other controller has no decision yet when the
    // recorded one made its first.
    let first = ticks.iter().find(|t| t.output.trace.is_some());
    assert_eq!(Some(parting.tick), first.map(|t| t.head.tick));
    assert!(decisions.recorded.is_some() && decisions.replayed.is_none());
    assert!(report.first.expect("answers differ").tick <= parting.tick);
}

#[test]
fn a_changed_output_is_found_at_its_tick_and_field() {
    let mut ticks = episode(500);
    ticks[321].output.command.setpoint_position_m[2] =
        f64::from_bits(ticks[321].output.command.setpoint_position_m[2].to_bits() ^ 1);
    let report = replay(reader(&file(&ticks)), params());
    let first = report.first.expect("found");
    assert_eq!(first.tick, 322);
    assert_eq!(
        first.difference.map(|d| d.field),
        Some("setpoint_position_m[2]".to_owned())
    );
    assert_eq!(report.different_ticks, 1);
}

#[test]
fn gaps_end_a_replay() {
    let ticks = episode(200);
    let params = params();
    let late = replay(reader(&file(&ticks[50..])), params);
    assert_eq!(late.stopped, Some(NotReplayable::BeginsLate(51)));
    let mut holed = ticks;
    holed.drain(100..110);
    let report = replay(reader(&file(&holed)), params);
    assert_eq!(
        report.stopped,
        Some(NotReplayable::Gap {
            before: 100,
            after: 111
        })
    );
}

#[test]
fn the_table_has_a_row_a_tick_and_a_name_a_column() {
    let ticks = episode(120);
    let bytes = file(&ticks);
    let mut out = Vec::new();
    let rows = write_csv(reader(&bytes), &mut out).expect("writes");
    assert_eq!(rows, 120);
    let text = String::from_utf8(out).expect("text");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let column = |name: &str| {
        header
            .iter()
            .position(|h| *h == name)
            .unwrap_or_else(|| panic!("no {name}"))
    };
    let (z, tick) = (column("command.setpoint_position_m[2]"), column("tick"));
    for (line, expected) in lines.zip(&ticks) {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), header.len());
        assert_eq!(cells[tick].parse(), Ok(expected.head.tick));
        let got: f64 = cells[z].parse().expect("a number");
        let wanted = expected.output.command.setpoint_position_m[2];
        assert_eq!(got.to_bits(), wanted.to_bits());
    }
}

/// Every topic and field that the layout names exists.
#[test]
fn the_foxglove_layout_names_what_there_is() {
    let layout: serde_json::Value = serde_json::from_str(FOXGLOVE_LAYOUT).expect("JSON");
    let bytes = file(&episode(200));
    let topics: Vec<String> = mcap::Summary::read(&bytes)
        .expect("reads")
        .expect("a summary")
        .channels
        .values()
        .map(|c| c.topic.clone())
        .collect();
    let mut paths = Vec::new();
    collect(&layout, &mut paths);
    assert!(paths.len() > 20);
    for path in paths {
        let (topic, field) = path.split_once('.').unwrap_or((&path, ""));
        assert!(topics.iter().any(|t| t == topic), "no topic for {path}");
        let field = field.split('[').next().unwrap_or("");
        let known = fitmac_rt::trace::layout_of(topic)
            .is_none_or(|layout| field.is_empty() || layout.field(field).is_some());
        assert!(known, "no field for {path}");
    }
}

fn collect(value: &serde_json::Value, paths: &mut Vec<String>) {
    match value {
        serde_json::Value::String(text) if text.starts_with('/') => paths.push(text.clone()),
        serde_json::Value::Array(items) => items.iter().for_each(|v| collect(v, paths)),
        serde_json::Value::Object(map) => {
            paths.extend(map.keys().filter(|k| k.starts_with('/')).cloned());
            map.values().for_each(|v| collect(v, paths));
        }
        _ => {}
    }
}
