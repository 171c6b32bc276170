//! The decision timeline: the columns of the paper's Table 19.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use comfy_table::{ContentArrangement, Table, presets::ASCII_MARKDOWN};
use fitmac_core::{
    evidence,
    message::{ObjectId, TraceRecord},
    reason,
    wire::{Diagnosis, EventKind, Mode, Phase, Route, SubPhase, Verdict},
};
use fitmac_rt::trace::{Record, TraceReader};
use serde::Serialize;

/// What objects are called, by their ids.
pub(crate) type Names = BTreeMap<ObjectId, String>;

/// One row: what was seen and decided in one query.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Row {
    /// The query.
    pub(crate) query: u64,
    /// The policy step.
    pub(crate) step: u64,
    /// The phase.
    pub(crate) phase: String,
    /// What happened, or what evidence of failure is at hand.
    pub(crate) event: String,
    /// The diagnosis and the route.
    pub(crate) decision: String,
    /// What the controller does: the recovery's step, the lock, the gate.
    pub(crate) state: String,
}

/// The decisions and events of a recorded trace, as far as it can be read.
pub(crate) fn read_decisions(trace: &std::path::Path) -> anyhow::Result<Vec<TraceRecord>> {
    let reader = TraceReader::open(trace)?;
    let ticks = reader.filter_map(|record| match record {
        Record::Tick(tick) => Some(tick.output),
        Record::Prompt(..) | Record::ModelCall(..) | Record::Status(_) => None,
    });
    Ok(ticks
        .flat_map(|output| [output.event, output.trace])
        .flatten()
        .collect())
}

/// The rows of an episode: its first query, each one that differs from the row
/// before in what it saw or decided, and its last.
pub(crate) fn rows(records: &[TraceRecord], names: &Names) -> Vec<Row> {
    let mut shown: Vec<&TraceRecord> = Vec::new();
    // The queries tell the mode.
    let mode_changed = EventKind::ModeChanged.code();
    for record in records.iter().filter(|record| record.kind != mode_changed) {
        let news = shown.last().is_none_or(|last| key(last) != key(record));
        if news {
            shown.push(record);
        }
    }
    let last = records.iter().rfind(|record| record.kind != mode_changed);
    if let (Some(last), Some(shown_last)) = (last, shown.last())
        && last.query != shown_last.query
    {
        shown.push(last);
    }
    let before = std::iter::once(None).chain(shown.iter().copied().map(Some));
    before
        .zip(&shown)
        .map(|(before, record)| row(before, record, names))
        .collect()
}

/// What makes a row news. Progress comes and goes by the step and is none; nor
/// is evidence while a correction runs, which acts on its own.
fn key(record: &TraceRecord) -> impl PartialEq + use<> {
    let evidence = match Route::try_from(record.route) {
        Ok(Route::Pending) => 0,
        _ => record.evidence & !evidence::PROGRESS,
    };
    (
        (record.kind, record.phase, record.diagnosis, record.route),
        (record.mode, record.sub_phase, record.verdict, record.lifted),
        (record.target, record.epoch, record.subtask),
        evidence,
    )
}

fn row(before: Option<&TraceRecord>, record: &TraceRecord, names: &Names) -> Row {
    Row {
        query: record.query,
        step: record.policy_step,
        phase: phase(record.phase),
        event: event(before, record, names),
        decision: decision(record),
        state: state(record, names),
    }
}

/// A member's name as words, or the byte that has none.
fn words<T: TryFrom<u8> + std::fmt::Display>(code: u8) -> String {
    match T::try_from(code) {
        Ok(member) => member.to_string().replace('_', " "),
        Err(_) => format!("unknown {code}"),
    }
}

fn sentence(parts: Vec<String>) -> String {
    parts
        .into_iter()
        .filter(|part| !part.is_empty())
        .collect::<Vec<_>>()
        .join("; ")
}

/// `Pick approach`, as Table 19 writes it.
fn phase(code: u8) -> String {
    let stage = match Phase::try_from(code) {
        Ok(Phase::Approach | Phase::Grasp | Phase::Lift) => "Pick ",
        Ok(Phase::Transport | Phase::Descend | Phase::Release | Phase::Stabilise) => "Place ",
        Ok(Phase::Complete) | Err(_) => "",
    };
    format!("{stage}{}", words::<Phase>(code))
}

fn event(before: Option<&TraceRecord>, record: &TraceRecord, names: &Names) -> String {
    let kind = match EventKind::try_from(record.kind) {
        Ok(EventKind::Query) => String::new(),
        _ => words::<EventKind>(record.kind),
    };
    let locked = if before.is_some_and(|before| before.target == record.target) {
        String::new()
    } else if record.target == 0 {
        "no target".to_owned()
    } else {
        format!("target is {}", name(record.target, names))
    };
    let lifted = before.is_some_and(|before| before.lifted == 0) && record.lifted == 1;
    let said_before = before.map_or(Verdict::Unknown.code(), |before| before.verdict);
    let verdict = match Verdict::try_from(record.verdict) {
        _ if record.verdict == said_before => String::new(),
        // Until something was lifted there is nothing to judge.
        Ok(Verdict::Fail) if before.is_none_or(|before| before.lifted == 0) => String::new(),
        _ => format!("verifier: {}", words::<Verdict>(record.verdict)),
    };
    let failures = evidence::names(record.evidence & !evidence::PROGRESS);
    let failures: Vec<String> = failures.map(|name| name.replace('_', " ")).collect();
    let other = match record.other {
        0 => String::new(),
        other => format!("at {}", name(other, names)),
    };
    let lifted = if lifted {
        "target lifted".to_owned()
    } else {
        String::new()
    };
    let text = sentence(vec![
        kind,
        locked,
        lifted,
        failures.join(", "),
        other,
        verdict,
    ]);
    match record.evidence & evidence::PROGRESS {
        0 => text,
        _ => sentence(vec![text, "progress".to_owned()]),
    }
}

fn decision(record: &TraceRecord) -> String {
    let diagnosis = match Diagnosis::try_from(record.diagnosis) {
        Ok(Diagnosis::None) => "none".to_owned(),
        _ => words::<Diagnosis>(record.diagnosis),
    };
    let mode = match Mode::try_from(record.mode) {
        Ok(Mode::Normal) => String::new(),
        _ => format!("mode {}", words::<Mode>(record.mode)),
    };
    sentence(vec![diagnosis, words::<Route>(record.route), mode])
}

fn state(record: &TraceRecord, names: &Names) -> String {
    let recovery = match SubPhase::try_from(record.sub_phase) {
        Ok(SubPhase::Idle) => String::new(),
        _ => format!(
            "{}, budget {}",
            words::<SubPhase>(record.sub_phase),
            record.budget
        ),
    };
    let lock = match record.target {
        0 => "no lock".to_owned(),
        target => format!(
            "locked on {}, kappa {:.2}",
            name(target, names),
            record.kappa
        ),
    };
    let streak = match record.failure_streak {
        0 => String::new(),
        streak => format!("failure streak {streak}"),
    };
    let reasons: Vec<String> = reason::names(record.reasons)
        .map(|name| name.replace('_', " "))
        .collect();
    sentence(vec![recovery, lock, streak, reasons.join(", ")])
}

fn name(id: ObjectId, names: &Names) -> String {
    names
        .get(&id)
        .cloned()
        .unwrap_or_else(|| format!("object {id}"))
}

/// The rows as a table for a terminal of this width.
pub(crate) fn table(rows: &[Row], width: u16) -> Table {
    let mut table = Table::new();
    table
        .load_style(ASCII_MARKDOWN)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(width)
        .set_header([
            "Query",
            "Step",
            "Phase",
            "Event / evidence",
            "Diagnosis and route",
            "Controller state",
        ]);
    for row in rows {
        let Row {
            query,
            step,
            phase,
            event,
            decision,
            state,
        } = row;
        table.add_row([
            &query.to_string(),
            &step.to_string(),
            phase,
            event,
            decision,
            state,
        ]);
    }
    table
}
