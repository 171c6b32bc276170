//! Runs recorded inputs through the core again and compares what it answers.
//!
//! Only inputs are fed: the recorded outputs are what the new ones are held
//! against, bit for bit.

use fitmac_core::{
    Controller, ValidParams,
    message::{Output, TraceRecord},
};

use crate::{
    diff::{Difference, first_difference},
    frame::Tick,
    layout::Payload,
    trace::Record,
};

/// Where an answer differs from the recorded one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parting {
    /// The tick's number.
    pub tick: u64,
    /// The tick's time, ns.
    pub now_ns: u64,
    /// The message and its first differing field.
    pub what: &'static str,
    /// Recorded on the left, replayed on the right; `None` if one of the two
    /// has no such message.
    pub difference: Option<Difference>,
}

impl core::fmt::Display for Parting {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "tick {}: {}", self.tick, self.what)?;
        match &self.difference {
            Some(d) => write!(f, ".{}: recorded {}, replayed {}", d.field, d.left, d.right),
            None => write!(f, ": sent by one of the two only"),
        }
    }
}

/// A decision and what the other controller decided in its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decisions {
    /// The recorded decision.
    pub recorded: Option<TraceRecord>,
    /// The replayed one.
    pub replayed: Option<TraceRecord>,
}

/// What a replay found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReplayReport {
    /// Ticks that were run.
    pub ticks: u64,
    /// Ticks whose answer differs.
    pub different_ticks: u64,
    /// The first difference of all.
    pub first: Option<Parting>,
    /// The first tick whose decision differs, and both decisions.
    pub first_decision: Option<(Parting, Decisions)>,
    /// Why the trace cannot be replayed further, if so.
    pub stopped: Option<NotReplayable>,
}

/// Why recorded inputs don't determine the outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotReplayable {
    /// The record does not begin with the controller's start.
    #[error(
        "the trace begins at tick {0}, so the controller's memory at that time is unknown (a black box is for looking at)"
    )]
    BeginsLate(u64),
    /// Ticks are missing.
    #[error("ticks are missing between {before} and {after}: the recorder's ring was full")]
    Gap {
        /// The last tick before the gap.
        before: u64,
        /// The first one after it.
        after: u64,
    },
}

/// Replays ticks through a controller with these parameters.
///
/// With the recorded parameters, any difference is a fault of determinism.
/// With others it shows where decisions part; from there on the recorded
/// inputs are no consequence of the new decisions any more.
pub fn replay(records: impl Iterator<Item = Record>, params: ValidParams) -> ReplayReport {
    let mut core = Controller::new(params);
    let mut report = ReplayReport::default();
    for record in records {
        let Record::Tick(tick) = record else { continue };
        if let Some(stopped) = follows(report.ticks, tick.head.tick) {
            report.stopped = Some(stopped);
            break;
        }
        let replayed = core.tick(tick.head.now_ns, &tick.input());
        report.ticks = tick.head.tick;
        compare(&tick, &replayed, &mut report);
    }
    report
}

fn follows(before: u64, next: u64) -> Option<NotReplayable> {
    match (before, next) {
        (0, 1) => None,
        (0, late) => Some(NotReplayable::BeginsLate(late)),
        (before, after) if after == before + 1 => None,
        (before, after) => Some(NotReplayable::Gap { before, after }),
    }
}

fn compare(tick: &Tick, replayed: &Output, report: &mut ReplayReport) {
    let recorded = &tick.output;
    let at = |what, difference| Parting {
        tick: tick.head.tick,
        now_ns: tick.head.now_ns,
        what,
        difference,
    };
    let decision = optional("trace", recorded.trace.as_ref(), replayed.trace.as_ref());
    let first = first_difference(&recorded.command, &replayed.command)
        .map(|d| ("command", Some(d)))
        .or_else(|| optional("query", recorded.query.as_ref(), replayed.query.as_ref()))
        .or_else(|| optional("rebind", recorded.rebind.as_ref(), replayed.rebind.as_ref()))
        .or_else(|| decision.clone())
        .or_else(|| optional("event", recorded.event.as_ref(), replayed.event.as_ref()));
    if let Some((what, difference)) = first {
        report.different_ticks += 1;
        report.first.get_or_insert_with(|| at(what, difference));
    }
    if let Some((what, difference)) = decision {
        report.first_decision.get_or_insert_with(|| {
            let decisions = Decisions {
                recorded: recorded.trace,
                replayed: replayed.trace,
            };
            (at(what, difference), decisions)
        });
    }
}

type Found = (&'static str, Option<Difference>);

fn optional<T: Payload>(what: &'static str, left: Option<&T>, right: Option<&T>) -> Option<Found> {
    match (left, right) {
        (None, None) => None,
        (Some(l), Some(r)) => first_difference(l, r).map(|d| (what, Some(d))),
        _ => Some((what, None)),
    }
}
