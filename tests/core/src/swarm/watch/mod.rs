//! What must hold in every tick, whatever goes wrong. The numbers are those of
//! [`crate::invariants`].

mod decision;
mod output;

use fitmac_core::{message::Command, wire::Mode};

use super::Seen;

/// An invariant that does not hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Broken {
    /// What should hold.
    pub invariant: &'static str,
    /// What was found.
    pub found: String,
}

/// Follows a run tick by tick.
#[derive(Clone, Debug, Default)]
pub struct Watch {
    last: Option<(Command, u64)>,
    stopped: bool,
    settling: u32,
}

impl Watch {
    /// Checks a tick.
    ///
    /// # Errors
    /// The first invariant that it breaks.
    pub fn look(&mut self, seen: &Seen<'_>) -> Result<(), Broken> {
        let command = &seen.output.command;
        let mode = output::codes(command)?;
        output::numbers(command)?;
        output::flags_and_reasons(seen, mode)?;
        output::standstill(seen, mode)?;
        self.latch(seen, mode)?;
        if let Some((last, _)) = &self.last {
            output::succession(command, last)?;
        }
        // The core's clock never runs backwards.
        let then_ns = self.last.map_or(seen.told.now_ns, |(_, ns)| ns);
        let now_ns = seen.told.now_ns.max(then_ns);
        if let Some((last, _)) = &self.last {
            output::limits(&seen.params.filter, command, last, now_ns - then_ns)?;
        }
        decision::routing(seen)?;
        decision::lock(seen)?;
        decision::budget(seen)?;
        decision::phases(seen)?;
        self.settles(seen)?;
        decision::recovery(seen)?;
        self.last = Some((*command, now_ns));
        Ok(())
    }

    /// A stop stays until a reset. (A new plan begins an episode too.)
    fn latch(&mut self, seen: &Seen<'_>, mode: Mode) -> Result<(), Broken> {
        let was = self.stopped && !seen.may_have_restarted();
        self.stopped = mode == Mode::Stop;
        require(
            !was || self.stopped,
            "a stop is latched until a reset",
            || mode.name().into(),
        )
    }

    /// 47: settling ends.
    fn settles(&mut self, seen: &Seen<'_>) -> Result<(), Broken> {
        if !seen.starts_recovery_action() {
            return Ok(());
        }
        let settling = seen.sub_phase() == fitmac_core::wire::SubPhase::Settle;
        self.settling = if settling { self.settling + 1 } else { 0 };
        let most = seen.params.recovery.settle + seen.params.recovery.verify;
        require(self.settling <= most, "47: settling ends", || {
            format!("{} queries of {most}", self.settling)
        })
    }
}

fn require(
    holds: bool,
    invariant: &'static str,
    found: impl FnOnce() -> String,
) -> Result<(), Broken> {
    if holds {
        return Ok(());
    }
    Err(Broken {
        invariant,
        found: found(),
    })
}
