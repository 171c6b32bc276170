//! The table of decisions, with the columns of the paper's Table 19.

use fitmac_core::{
    evidence,
    message::TraceRecord,
    reason,
    wire::{Diagnosis, Phase, Route, SubPhase},
};

/// The heading of the table.
pub const HEADING: &str = "Query Step  Phase       Event / evidence               \
Diagnosis and route                           Controller state";

/// One line of the table.
#[must_use]
pub fn row(record: &TraceRecord) -> String {
    let name = |known: Option<&'static str>| known.unwrap_or("?");
    let phase = name(Phase::try_from(record.phase).ok().map(Phase::name));
    let diagnosis = name(
        Diagnosis::try_from(record.diagnosis)
            .ok()
            .map(Diagnosis::name),
    );
    let route = name(Route::try_from(record.route).ok().map(Route::name));
    let seen: Vec<_> = evidence::names(record.evidence & !evidence::PROGRESS).collect();
    format!(
        "{:5} {:4}  {phase:10}  {:29}  {:44}  {}",
        record.query,
        record.policy_step,
        if seen.is_empty() {
            "-".to_owned()
        } else {
            seen.join(", ")
        },
        format!("{diagnosis}; {route}"),
        state(record),
    )
}

/// The controller's state: the recovery's step, or why nothing is done.
#[must_use]
pub fn state(record: &TraceRecord) -> String {
    let why: Vec<_> = reason::names(record.reasons & !reason::CORRECTION_PENDING).collect();
    let why = why.join(", ");
    match SubPhase::try_from(record.sub_phase) {
        Ok(SubPhase::Idle) => {
            let base = format!("base policy, {} actions", record.effective_horizon);
            if why.is_empty() {
                base
            } else {
                format!("{base} ({why})")
            }
        }
        Ok(step) if why.is_empty() => format!("{step}, {} queries left", record.budget),
        Ok(step) => format!("{step}, {} queries left ({why})", record.budget),
        Err(_) => "?".to_owned(),
    }
}

/// The rows that differ from the one before in more than query, step and
/// counters.
#[must_use]
pub fn changes(records: &[TraceRecord]) -> Vec<&TraceRecord> {
    let key = |r: &TraceRecord| {
        (
            r.phase,
            r.diagnosis,
            r.route,
            r.sub_phase,
            r.epoch,
            r.evidence & !evidence::PROGRESS,
        )
    };
    let mut rows: Vec<&TraceRecord> = Vec::new();
    for record in records {
        if rows.last().is_none_or(|last| key(last) != key(record)) {
            rows.push(record);
        }
    }
    rows
}

/// Prints the rows at which something changes.
pub fn print(records: &[TraceRecord]) {
    println!("{HEADING}");
    for record in changes(records) {
        println!("{}", row(record));
    }
}
