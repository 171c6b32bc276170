//! Action: what leaves in this tick.

use super::{Controller, Report, Start, state::Current};
use crate::{
    filter::{Commanded, limit_action},
    message::{Command, Output, TraceRecord},
    reason,
    shaping::Shaper,
    trace::{self, Moment},
    turn::{Turn, Waiting},
    wire::{EventKind, Mode, Route},
};

/// The setpoint of one tick.
#[derive(Clone, Copy)]
struct Setpoint {
    translation: Commanded,
    orientation: [f64; 4],
}

impl Controller {
    pub(super) fn act(
        &mut self,
        now_ns: u64,
        ladder_mode: Mode,
        faults: u64,
        dt_s: f64,
        start: Option<Start>,
        report: Report,
    ) -> Output {
        let awaiting = matches!(self.state.turn, Turn::Waiting(Waiting::Grounding { .. }));
        let mode = if awaiting {
            ladder_mode.max(Mode::Hold)
        } else {
            ladder_mode
        };
        let mut trace = None;
        let mut reasons = faults | if awaiting { reason::AWAITING_REBIND } else { 0 };
        if let Some(start) = start {
            let limited = self.begin(now_ns, &start);
            if start.query {
                trace = Some(self.query_record(now_ns, mode, &start));
            }
            reasons |= if limited { reason::LIMITED } else { 0 };
        }
        let (setpoint, limited) = self.shape(mode, dt_s);
        let flags = self.state.current.flags;
        reasons |= if flags & Command::CLAMPED != 0 {
            reason::ACTION_CLAMPED
        } else {
            0
        };
        reasons |= if limited || flags & Command::LIMITED != 0 {
            reason::LIMITED
        } else {
            0
        };
        let warned = reasons != 0 && mode == Mode::Normal;
        let mode = if warned { Mode::Warn } else { mode };
        let event = self.event_record(now_ns, mode, &report);
        self.state.mode = mode;
        let command = self.command(now_ns, mode, reasons, setpoint, limited);
        Output {
            command,
            query: report.query,
            rebind: report.rebind,
            trace,
            event,
        }
    }

    /// Starts an action, through the last filter.
    fn begin(&mut self, now_ns: u64, start: &Start) -> bool {
        let (state, params) = (&mut self.state, self.params.get());
        let [.., gripper] = state.current.action;
        let ee_m = state.robot.latest().map_or([0.0; 3], |s| s.ee_position_m);
        let filtered = limit_action(&params.action, &params.filter, ee_m, gripper, &start.action);
        let mut flags = start.flags;
        flags |= if filtered.limited {
            Command::LIMITED
        } else {
            0
        };
        flags |= if start.from_policy {
            Command::FROM_POLICY
        } else {
            0
        };
        state.current = Current {
            action: filtered.value,
            policy_step: state.current.policy_step.wrapping_add(1),
            flags,
        };
        state.clock.start_step(now_ns, params.clock.step_ms);
        if let (Some((shaper, _)), Some(sample)) = (&mut state.shaper, state.robot.latest()) {
            shaper.aim(params, sample, &filtered.value);
        }
        filtered.limited
    }

    /// The setpoint of this tick, through the last filter.
    fn shape(&mut self, mode: Mode, dt_s: f64) -> (Setpoint, bool) {
        let (state, params) = (&mut self.state, self.params.get());
        if state.shaper.is_none()
            && let Some(sample) = state.robot.latest()
        {
            let commanded = Commanded::at_rest(sample.ee_position_m);
            state.shaper = Some((Shaper::at(sample), commanded));
        }
        let Some((shaper, commanded)) = &mut state.shaper else {
            return (
                Setpoint {
                    translation: Commanded::at_rest([0.0; 3]),
                    orientation: [1.0, 0.0, 0.0, 0.0],
                },
                false,
            );
        };
        if mode >= Mode::Hold {
            shaper.halt();
        }
        let wanted = shaper.step(params, dt_s);
        let translation = Commanded {
            position_m: wanted.position_m,
            velocity_m_s: wanted.velocity_m_s,
            acceleration_m_s2: wanted.acceleration_m_s2,
        };
        let filtered = commanded.step(&params.filter, &translation, dt_s);
        *commanded = filtered.value;
        if filtered.limited {
            shaper.follow(&filtered.value);
        }
        (
            Setpoint {
                translation: filtered.value,
                orientation: wanted.orientation.wxyz(),
            },
            filtered.limited,
        )
    }

    fn command(
        &self,
        now_ns: u64,
        mode: Mode,
        faults: u64,
        setpoint: Setpoint,
        limited: bool,
    ) -> Command {
        let state = &self.state;
        let route = state.decision.route;
        let quiet = mode == Mode::Normal && route == Route::Base;
        let decided = if route == Route::Base {
            0
        } else {
            state.decision.reasons
        };
        Command {
            sequence: state.sequence,
            stamp_ns: now_ns,
            policy_step: state.current.policy_step,
            query: state.episode.queries(),
            action: state.current.action,
            setpoint_position_m: setpoint.translation.position_m,
            setpoint_velocity_m_s: setpoint.translation.velocity_m_s,
            setpoint_acceleration_m_s2: setpoint.translation.acceleration_m_s2,
            setpoint_orientation: setpoint.orientation,
            reasons: if quiet { 0 } else { faults | decided },
            mode: mode.code(),
            route: route.code(),
            phase: state.subtask.estimator.phase().code(),
            sub_phase: state.subtask.recovery.sub_phase().code(),
            flags: state.current.flags | if limited { Command::LIMITED } else { 0 },
        }
    }

    fn moment(&self, now_ns: u64, mode: Mode) -> Moment {
        Moment {
            stamp_ns: now_ns,
            query: self.state.episode.queries(),
            policy_step: self.state.current.policy_step,
            mode,
            verdict: self.state.verdicts.verdict(),
        }
    }

    fn query_record(&self, now_ns: u64, mode: Mode, start: &Start) -> TraceRecord {
        // The step at which the query was asked, before its first action.
        let mut moment = self.moment(now_ns, mode);
        moment.policy_step = moment.policy_step.saturating_sub(1);
        let record = trace::record(
            EventKind::Query,
            &moment,
            self.params.get(),
            &self.state.subtask,
            &self.state.decision,
        );
        let base = start.from_policy.then_some(&start.action);
        trace::with_action(record, &self.state.current.action, base, start.waypoint_m)
    }

    fn event_record(&self, now_ns: u64, mode: Mode, report: &Report) -> Option<TraceRecord> {
        let changed = (mode != self.state.mode && mode.max(self.state.mode) >= Mode::Hold)
            .then_some((EventKind::ModeChanged, None));
        let (kind, refusal) = report.event.or(changed)?;
        let record = trace::record(
            kind,
            &self.moment(now_ns, mode),
            self.params.get(),
            &self.state.subtask,
            &self.state.decision,
        );
        Some(match refusal {
            Some(refusal) => trace::with_refusal(record, refusal),
            None => record,
        })
    }
}

#[cfg(test)]
mod tests;
