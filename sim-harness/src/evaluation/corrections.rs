//! What the controller did in an episode, read off its commands and trace.

use fitmac_core::message::Command;
use fitmac_core::reason;
use fitmac_core::wire::{Diagnosis, Mode, Route, SubPhase};

use super::record::{Activation, Ending, Routine};
use crate::lockstep::Ticked;

/// The reasons that keep the gate closed.
const CLOSED: u64 = reason::STREAK_SHORT
    | reason::CONFIDENCE_LOW
    | reason::CONFIDENCE_STREAK_SHORT
    | reason::ATTEMPT_YOUNG
    | reason::PROGRESS
    | reason::COOL_DOWN
    | reason::BUDGET_SPENT
    | reason::DESTINATION_INDIRECT
    | reason::SWITCHED_OFF
    | reason::PLAN_UNCERTAIN;
/// How a correction ends, by the controller's bits.
const ENDINGS: [(u64, Ending); 5] = [
    (reason::CORRECTED, Ending::Corrected),
    (reason::BUDGET_EXHAUSTED, Ending::BudgetExhausted),
    (reason::NO_ACTION, Ending::NoAction),
    (reason::VALIDITY_LOST, Ending::ValidityLost),
    (reason::PHASE_INCOMPATIBLE, Ending::PhaseIncompatible),
];

/// Follows the corrections of an episode.
#[derive(Clone, Debug, Default)]
pub(super) struct Corrections {
    parts: Vec<Activation>,
    open: bool,
    corrections: u32,
    first_failure: Option<u64>,
    closed: u64,
}

impl Corrections {
    /// Takes a tick in.
    pub(super) fn note(&mut self, ticked: &Ticked) {
        let reasons = ticked.trace.as_ref().map_or(0, |record| record.reasons);
        if let Some(record) = &ticked.trace {
            self.judged(record.diagnosis, reasons, record.policy_step);
        }
        if let Some(command) = ticked.command.filter(|_| ticked.acted) {
            self.acted(acting(&command), reasons, command.policy_step);
        }
    }

    /// A query was decided.
    fn judged(&mut self, diagnosis: u8, reasons: u64, step: u64) {
        let failures = [
            Diagnosis::PickFailure.code(),
            Diagnosis::PlaceFailure.code(),
        ];
        if failures.contains(&diagnosis) {
            self.first_failure.get_or_insert(step);
            self.closed |= reasons & CLOSED;
        }
    }

    /// An action began: a correction's, or the policy's.
    fn acted(&mut self, kind: Option<Routine>, reasons: u64, step: u64) {
        match kind {
            Some(kind) => self.act(kind, step),
            None => self.close(ending(reasons)),
        }
    }

    /// The episode is over.
    pub(super) fn finish(&mut self) {
        self.close(Ending::EpisodeEnd);
    }

    /// The parts so far.
    pub(super) fn parts(&self) -> &[Activation] {
        &self.parts
    }

    /// Whether a correction acts now.
    pub(super) fn running(&self) -> bool {
        self.open
    }

    pub(super) fn first_step(&self) -> Option<u64> {
        self.parts.first().map(|part| part.start_step)
    }

    pub(super) fn first_failure_step(&self) -> Option<u64> {
        self.first_failure
    }

    pub(super) fn gate_reasons(&self) -> Vec<String> {
        reason::names(self.closed).map(str::to_owned).collect()
    }

    fn act(&mut self, kind: Routine, step: u64) {
        match self.parts.last_mut().filter(|_| self.open) {
            Some(part) if part.kind == kind => part.end_step = step,
            Some(part) => {
                part.outcome = Ending::Continued;
                let correction = part.correction;
                self.begin(correction, kind, step);
            }
            None => {
                self.begin(self.corrections, kind, step);
                self.corrections += 1;
            }
        }
    }

    fn begin(&mut self, correction: u32, kind: Routine, step: u64) {
        self.open = true;
        self.parts.push(Activation {
            correction,
            kind,
            start_step: step,
            end_step: step,
            outcome: Ending::EpisodeEnd,
        });
    }

    fn close(&mut self, ending: Ending) {
        if let Some(part) = self.parts.last_mut().filter(|_| self.open) {
            part.outcome = ending;
        }
        self.open = false;
    }
}

/// The routine whose action has replaced the policy's.
fn acting(command: &Command) -> Option<Routine> {
    let corrects = [Route::Execution.code(), Route::Pending.code()].contains(&command.route)
        && command.flags & Command::FROM_POLICY == 0
        && command.mode < Mode::Hold.code();
    if !corrects {
        return None;
    }
    Some(match SubPhase::try_from(command.sub_phase).ok()? {
        SubPhase::SetDown
        | SubPhase::ApproachHover
        | SubPhase::Descend
        | SubPhase::Close
        | SubPhase::LiftTest
        | SubPhase::Reopen => Routine::Pick,
        SubPhase::LiftCarry
        | SubPhase::MoveAbove
        | SubPhase::Lower
        | SubPhase::ReleaseReady
        | SubPhase::ReleaseHold => Routine::Place,
        SubPhase::Retreat | SubPhase::Settle => Routine::Settle,
        SubPhase::Idle => return None,
    })
}

/// Why the policy acts again.
fn ending(reasons: u64) -> Ending {
    ENDINGS
        .iter()
        .find(|(bit, _)| reasons & bit != 0)
        .map_or(Ending::Other, |(_, ending)| *ending)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pick_that_goes_on_to_a_place_is_one_correction_of_two_parts() {
        let mut seen = Corrections::default();
        seen.judged(Diagnosis::PickFailure.code(), reason::STREAK_SHORT, 19);
        seen.acted(None, reason::STREAK_SHORT, 20);
        for (step, kind) in [
            (21, Routine::Pick),
            (22, Routine::Pick),
            (23, Routine::Place),
        ] {
            seen.acted(Some(kind), reason::CORRECTION_PENDING, step);
        }
        seen.acted(None, reason::BUDGET_EXHAUSTED, 24);
        seen.acted(Some(Routine::Place), 0, 60);
        seen.finish();
        let parts: Vec<_> = seen
            .parts()
            .iter()
            .map(|p| (p.correction, p.kind, p.start_step, p.end_step, p.outcome))
            .collect();
        assert_eq!(
            parts,
            [
                (0, Routine::Pick, 21, 22, Ending::Continued),
                (0, Routine::Place, 23, 23, Ending::BudgetExhausted),
                (1, Routine::Place, 60, 60, Ending::EpisodeEnd),
            ]
        );
        assert_eq!(
            (seen.first_failure_step(), seen.first_step()),
            (Some(19), Some(21))
        );
        assert_eq!(seen.gate_reasons(), ["streak_short"]);
    }
}
