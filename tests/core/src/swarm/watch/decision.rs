//! What the core decides.

use fitmac_core::{
    intake::is_newer,
    lock::Destination,
    message::Command,
    phase::{is_legal, is_pick, is_place},
    reason,
    signals::GripperState,
    wire::{Mode, Route, SubPhase},
};

use super::{Broken, require};
use crate::swarm::Seen;

/// Why a correction ends.
const ENDS: u64 = reason::NO_ACTION
    | reason::VALIDITY_LOST
    | reason::PHASE_INCOMPATIBLE
    | reason::BUDGET_EXHAUSTED
    | reason::CORRECTED;

pub(super) fn routing(seen: &Seen<'_>) -> Result<(), Broken> {
    let (command, before) = (&seen.output.command, seen.before);
    let settled = !seen.may_have_restarted();
    let route = seen.after.decision().route;
    require(
        !(before.pending && seen.queried() && seen.same_subtask() && settled)
            || route == Route::Pending,
        "13: a pending correction goes on whatever the gate says",
        || route.name().into(),
    )?;
    let fault = command.mode != Mode::Normal.code();
    require(
        command.route == before.route || seen.queried() || fault || !settled,
        "15: the route changes only at a query",
        || format!("{} after {}", command.route, before.route),
    )?;
    let Some(record) = &seen.output.trace else {
        return Ok(());
    };
    let executes = [Route::Pending.code(), Route::Execution.code()].contains(&record.route);
    let from_policy = command.flags & Command::FROM_POLICY != 0;
    let handed_back = record.sub_phase == SubPhase::Idle.code()
        && !seen.after.subtask().recovery().is_pending()
        && from_policy;
    require(
        !executes || record.reasons & ENDS == 0 || handed_back,
        "16: without an action the base policy acts, and nothing stays pending",
        || format!("{record:?}"),
    )?;
    let (taken, horizon) = (seen.after.queue().len() + 1, record.effective_horizon);
    require(
        !from_policy || taken <= horizon as usize,
        "17: a refill takes at most the effective horizon",
        || format!("{taken} of {horizon}"),
    )?;
    let was = before.failures;
    let streak = seen.after.subtask().streaks().failures();
    require(
        streak == was.saturating_add(1) || streak <= 1 || streak == was,
        "23: a streak grows by one",
        || format!("{streak} after {was}"),
    )
}

pub(super) fn lock(seen: &Seen<'_>) -> Result<(), Broken> {
    let (before, lock) = (seen.before, seen.after.subtask().lock());
    let settled = !seen.may_have_restarted() && seen.same_subtask();
    let retargeted = seen.queried() && seen.after.decision().route == Route::Target;
    require(
        lock.target() == before.target || retargeted || !settled,
        "51: the locked instance changes only in a target query",
        || format!("{} after {}", lock.target(), before.target),
    )?;
    let pending = seen.after.subtask().recovery().is_pending();
    require(
        !(before.pending && pending && seen.same_subtask())
            || (lock.target(), lock.epoch()) == (before.target, before.epoch),
        "52: a pending correction keeps the lock",
        || format!("{} after {}", lock.target(), before.target),
    )?;
    let epoch = lock.epoch();
    let rises = epoch == before.epoch || is_newer(epoch, before.epoch);
    require(rises, "54: epochs rise, wrapping", || {
        format!("{epoch} after {}", before.epoch)
    })?;
    let asked = seen.output.query.map(|q| q.epoch);
    require(
        asked.is_none_or(|asked| asked == epoch || is_newer(epoch, asked)),
        "54: a question carries the committed epoch",
        || format!("{:?}", seen.output.query),
    )
}

pub(super) fn budget(seen: &Seen<'_>) -> Result<(), Broken> {
    let (before, recovery) = (seen.before, seen.after.subtask().recovery());
    let expected = before.budget.wrapping_sub(u32::from(seen.queried()));
    require(
        !(before.pending && recovery.is_pending()) || recovery.budget() == expected,
        "57: each query of a correction costs one",
        || format!("{} after {}", recovery.budget(), before.budget),
    )?;
    let starts = recovery.activations() > before.activations
        && seen.same_subtask()
        && !seen.may_have_restarted();
    let gate = &seen.params.gate;
    // The step that this tick observed counts too.
    let rested = before
        .since_hand_back
        .is_none_or(|n| n.saturating_add(1) >= gate.cool_down_steps);
    require(
        !starts || rested && recovery.activations() <= gate.activations,
        "60: corrections are limited, and a cool-down lies between them",
        || {
            let (n, since) = (recovery.activations(), before.since_hand_back);
            format!("number {n}, {since:?} steps after the last")
        },
    )
}

pub(super) fn phases(seen: &Seen<'_>) -> Result<(), Broken> {
    let (from, to) = (seen.before.phase, seen.after.subtask().estimator().phase());
    if from == to || !seen.same_subtask() || seen.may_have_restarted() {
        return Ok(());
    }
    let retargeted = seen.before.target != seen.after.subtask().lock().target();
    require(
        is_legal(from, to) || retargeted,
        "43: the phase changes along declared edges",
        || format!("{from} to {to}"),
    )?;
    let subtask = seen.after.subtask();
    // Closed is what does not open: fingers may still give way to the object.
    let held = subtask
        .signals()
        .is_some_and(|s| s.gripper.state != GripperState::Open);
    let carries = subtask.estimator().is_lifted() && held;
    require(
        !(is_pick(from) && is_place(to)) || carries,
        "44: a place phase begins only with carrying evidence",
        || format!("{from} to {to}"),
    )
}

/// What a recovery's action may be, by its step.
pub(super) fn recovery(seen: &Seen<'_>) -> Result<(), Broken> {
    if !seen.starts_recovery_action() {
        return Ok(());
    }
    let step = seen.sub_phase();
    let action = &seen.output.command.action;
    let found = || format!("{step}: {action:?}");
    require(
        action[6].abs() == 1.0,
        "2: the gripper of a recovery is -1 or +1",
        found,
    )?;
    let turns = action[3..6].iter().any(|a| a.to_bits() != 0);
    let may_turn = step == SubPhase::ApproachHover && seen.params.recovery.level_rad > 0.0;
    require(
        !turns || may_turn,
        "3: a recovery turns the hand only while it hovers",
        found,
    )?;
    use SubPhase as S;
    let may_open = matches!(
        step,
        S::SetDown
            | S::ApproachHover
            | S::Descend
            | S::Reopen
            | S::ReleaseReady
            | S::ReleaseHold
            | S::Retreat
            | S::Settle
    );
    require(
        action[6] > 0.0 || may_open,
        "45: a recovery opens the hand only where it may",
        found,
    )?;
    require(
        step != S::Settle || action[..2] == [0.0; 2] && action[2] >= 0.0 && action[6] == -1.0,
        "47: settling keeps the hand open and rises",
        found,
    )?;
    let places = matches!(
        step,
        S::LiftCarry
            | S::MoveAbove
            | S::Lower
            | S::ReleaseReady
            | S::ReleaseHold
            | S::Retreat
            | S::Settle
    );
    let binding = seen.after.subtask().lock().binding();
    let direct = binding.is_some_and(|b| matches!(b.destination, Destination::Direct(_)));
    require(
        !places || direct,
        "48: geometry places only at a direct destination",
        found,
    )?;
    let near = seen
        .after
        .subtask()
        .signals()
        .and_then(|s| s.destination)
        .is_some_and(|d| {
            let p = &seen.params.recovery;
            d.distance_xy_m <= p.align_on_m.max(p.align_in_m)
                && d.clearance_m <= p.release_on_m + 0.04
        });
    require(
        step != S::ReleaseReady || near,
        "46: it releases only above the region, and low",
        found,
    )
}
