//! A second controller, to compare the first with: written from the
//! specification in another style, slow and simple. It keeps whole histories
//! and reads what it needs from them anew in every tick; of the core it uses
//! the messages, the parameters and the vocabularies only.
//!
//! It covers intake, signals, tracking, phases, monitor, attempt, diagnosis,
//! gate, router, subtasks, both recoveries with their budgets, the queue and
//! the ladder. Three things it takes from the core's output as given: the
//! setpoint's position, velocity, acceleration and orientation, and whether the
//! last filter changed the setpoint.

mod arm;
mod doors;
mod play;
mod sight;
mod space;
mod story;
mod task;
pub mod view;

use fitmac_core::{
    intake::Refusal,
    message::{Command, PolicyQuery, RebindRequest},
    params::{Params, ValidParams},
    reason,
    wire::{Diagnosis, EventKind, Mode, Phase, Request, Route, Verdict},
};

use crate::swarm::Told;
use arm::Said;
use doors::{Came, Doors, ms};
use space::Point;
use task::Task;

/// What was decided at a query.
#[derive(Clone, Copy, Debug)]
struct Decision {
    kappa: f64,
    evidence: u64,
    phase: Phase,
    diagnosis: Diagnosis,
    route: Route,
    reasons: u64,
    horizon: u32,
    other: u16,
}

impl Decision {
    const NONE: Self = Self {
        kappa: 0.0,
        evidence: 0,
        phase: Phase::Approach,
        diagnosis: Diagnosis::None,
        route: Route::Base,
        reasons: 0,
        horizon: 0,
        other: 0,
    };
}

/// What the next policy step waits for.
#[derive(Clone, Copy, Debug)]
enum Turn {
    Settle(u32),
    Due,
    Play,
    AwaitChunk(u32),
    AwaitBinding(u64),
}

/// An action that starts.
#[derive(Clone, Copy, Debug)]
struct Start {
    action: [f64; 7],
    flags: u32,
    waypoint: Option<Point>,
    query: bool,
}

/// What a tick says besides its command.
#[derive(Clone, Debug, Default)]
struct Notes {
    query: Option<PolicyQuery>,
    rebind: Option<RebindRequest>,
    event: Option<(EventKind, u32)>,
    noticed: u64,
    stop: bool,
}

/// The second controller.
#[derive(Clone, Debug)]
pub struct Model {
    p: Params,
    doors: Doors,
    task: Task,
    ticks: u64,
    last_ns: Option<u64>,
    step_ends_ns: u64,
    stopped: Option<u64>,
    mode: Mode,
    turn: Turn,
    queue: Vec<[f32; 7]>,
    played: u64,
    decision: Decision,
    queries: u64,
    corrections: u32,
    rebinds: u32,
    action: [f64; 7],
    policy_step: u64,
    flags: u32,
    observed: Option<(u64, u64)>,
    width: Option<f64>,
    query_id: u64,
    request_id: u64,
}

/// What came of a tick.
#[derive(Clone, Debug)]
struct Tick {
    mode: Mode,
    /// The mode before a mere warning was added.
    mode_of_query: Mode,
    reasons: u64,
    limited: bool,
    start: Option<Start>,
    notes: Notes,
    event: Option<(EventKind, u32)>,
}

fn still(grip: f64) -> Start {
    Start {
        action: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, grip],
        flags: 0,
        waypoint: None,
        query: false,
    }
}

impl Model {
    /// A controller that has seen nothing yet.
    #[must_use]
    pub fn new(params: &ValidParams) -> Self {
        let p = *params.get();
        Self {
            turn: Turn::Settle(p.clock.settle_steps),
            p,
            doors: Doors::default(),
            task: Task::new(0, 0),
            ticks: 0,
            last_ns: None,
            step_ends_ns: 0,
            stopped: None,
            mode: Mode::Hold,
            queue: Vec::new(),
            played: 0,
            decision: Decision::NONE,
            queries: 0,
            corrections: 0,
            rebinds: 0,
            action: still(-1.0).action,
            policy_step: 0,
            flags: 0,
            observed: None,
            width: None,
            query_id: 1,
            request_id: 1,
        }
    }

    fn verdict(&self) -> Verdict {
        self.doors.verdict.unwrap_or(Verdict::Unknown)
    }

    /// Decides a tick. `setpoint_limited`: the last filter changed the setpoint.
    fn decide(&mut self, told: &Told, setpoint_limited: bool) -> Tick {
        let now = told.now_ns;
        self.ticks += 1;
        let last = self.last_ns.unwrap_or(now);
        self.last_ns = Some(last.max(now));
        let mut notes = Notes::default();
        self.take_in(now, told, &mut notes);
        if now < last {
            notes.noticed |= reason::TIME_FAULT;
        }
        let gap = now.saturating_sub(last) > ms(self.p.clock.gap_stop_ms);
        let (ladder, faults) = self.ladder(now, gap, &notes);
        let start = if ladder >= Mode::Hold {
            self.stand_still(now, ladder, &mut notes)
        } else {
            self.play(now, &mut notes)
        };
        self.close(now, ladder, faults, start, notes, setpoint_limited)
    }

    fn refuse(&mut self, refusal: Refusal, kind: EventKind, bit: u64, notes: &mut Notes) {
        self.doors.count(refusal);
        notes.noticed |= bit;
        notes.event = Some((kind, refusal.code()));
    }

    fn take_in(&mut self, now: u64, told: &Told, notes: &mut Notes) {
        if told.request == Request::Reset.code() {
            self.begin_episode();
        }
        notes.stop = told.request == Request::Stop.code();
        if let Some(plan) = &told.plan {
            match self.doors.hear_plan(plan) {
                Ok(true) => self.begin_episode(),
                Ok(false) => {}
                Err(refusal) => {
                    let bit = reason::GROUNDING_REFUSED;
                    self.refuse(refusal, EventKind::GroundingRefused, bit, notes);
                }
            }
        }
        if let Some(sample) = &told.state {
            match self.doors.hear_state(&self.p, now, sample) {
                Ok(Came::Nothing) => {}
                Ok(Came::Leap) => self.task.forget_motion(),
                Ok(Came::On(before)) => self.task.watch(&self.p, &before, sample),
                Err(refusal) => {
                    let jump = refusal == Refusal::Jump;
                    let bits = [reason::STATE_REFUSED, reason::STATE_JUMP];
                    let bit = bits[usize::from(jump)];
                    self.refuse(refusal, EventKind::StateRefused, bit, notes);
                }
            }
        }
        if let Some(record) = &told.grounding {
            let (epoch, subtask) = (self.task.epoch, self.task.index);
            match self
                .doors
                .hear_grounding(&self.p, now, record, epoch, subtask)
            {
                Ok(true) => self.task.hear(record),
                Ok(false) => {}
                Err(refusal) => {
                    let bit = reason::GROUNDING_REFUSED;
                    self.refuse(refusal, EventKind::GroundingRefused, bit, notes);
                }
            }
        }
        if let Some(report) = &told.verifier {
            self.doors.hear_verifier(report, self.task.index);
        }
        if let Some(report) = &told.critic {
            self.doors.hear_critic(report, self.task.index);
        }
        if let Some(chunk) = &told.chunk {
            match self.doors.hear_chunk(&self.p, now, chunk) {
                Ok(true) => notes.noticed |= reason::POLICY_FROZEN,
                Ok(false) => {}
                Err(Refusal::SessionChanged) => {
                    self.queue.clear();
                    let bit = reason::POLICY_RESTARTED;
                    self.refuse(Refusal::SessionChanged, EventKind::ChunkRefused, bit, notes);
                }
                Err(refusal) => {
                    let bit = reason::CHUNK_REFUSED;
                    self.refuse(refusal, EventKind::ChunkRefused, bit, notes);
                }
            }
        }
    }

    fn begin_episode(&mut self) {
        self.task = Task::new(0, self.task.epoch);
        (self.queries, self.corrections, self.rebinds) = (0, 0, 0);
        self.doors.episode();
        self.queue.clear();
        self.stopped = None;
        self.turn = Turn::Settle(self.p.clock.settle_steps);
        self.decision = Decision::NONE;
    }

    /// The severest reaction wins; a stop is latched.
    fn ladder(&mut self, now: u64, gap: bool, notes: &Notes) -> (Mode, u64) {
        let (s, c) = (&self.p.state, &self.p.chunk);
        let age = self.doors.state.map(|x| now.saturating_sub(x.stamp_ns));
        let older = |limit| age.is_some_and(|age| age > ms(limit));
        let waited = self
            .doors
            .question
            .map_or(0, |q| now.saturating_sub(q.first));
        let answered = self.doors.chunks_accepted() > 0;
        let late = waited > ms(c.hold_after_ms);
        let broken = self.doors.broken_in_a_row;
        let sum =
            |rules: &[(bool, u64)]| rules.iter().filter(|r| r.0).fold(0, |bits, r| bits | r.1);
        let stop = sum(&[
            (notes.stop, reason::OPERATOR_STOP),
            (gap, reason::TIME_FAULT),
            (older(s.stop_age_ms), reason::STATE_STALE),
            (answered && waited > ms(c.stop_after_ms), reason::STARVED),
            (broken >= c.refusals_stop, reason::CHUNK_REFUSALS),
        ]);
        let hold = sum(&[
            (age.is_none(), reason::NO_STATE),
            (older(s.hold_age_ms), reason::STATE_STALE),
            (late && !answered, reason::NO_CHUNK),
            (late && answered, reason::STARVED),
            (broken >= c.refusals_hold, reason::CHUNK_REFUSALS),
            (
                self.doors.unapplied(now) > ms(s.applied_hold_ms),
                reason::COMMAND_NOT_APPLIED,
            ),
        ]);
        if stop != 0 {
            self.stopped = Some(self.stopped.unwrap_or(0) | stop);
        }
        match (self.stopped, hold, notes.noticed) {
            (Some(why), _, _) => (Mode::Stop, why),
            (None, 0, 0) => (Mode::Normal, 0),
            (None, 0, noticed) => (Mode::Warn, noticed),
            (None, hold, noticed) => (Mode::Hold, hold | noticed),
        }
    }

    fn stand_still(&mut self, now: u64, mode: Mode, notes: &mut Notes) -> Option<Start> {
        let enters = self.mode < Mode::Hold && self.doors.state.is_some();
        if mode == Mode::Stop {
            self.task.cancel();
            (self.doors.question, self.doors.ready) = (None, None);
            self.decision.route = Route::Base;
        }
        self.queue.clear();
        if let Turn::Play = self.turn {
            self.turn = Turn::Due;
        }
        let owed = matches!(self.turn, Turn::AwaitChunk(_)) || self.doors.broken_in_a_row > 0;
        if owed && mode == Mode::Hold {
            notes.query = self.ask(now);
        }
        enters.then(|| still(self.action[6]))
    }

    fn due(&self, now: u64) -> bool {
        now >= self.step_ends_ns
    }

    /// The end of a tick: what starts passes the limits, the mode is final.
    fn close(
        &mut self,
        now: u64,
        ladder: Mode,
        faults: u64,
        start: Option<Start>,
        notes: Notes,
        setpoint_limited: bool,
    ) -> Tick {
        let awaits = matches!(self.turn, Turn::AwaitBinding(_));
        let mode_of_query = if awaits {
            ladder.max(Mode::Hold)
        } else {
            ladder
        };
        if let Some(start) = &start {
            self.begin(now, start);
        }
        let limited = setpoint_limited || self.flags & Command::LIMITED != 0;
        let clamped = self.flags & Command::CLAMPED != 0;
        let mut reasons = faults;
        for (holds, bit) in [
            (awaits, reason::AWAITING_REBIND),
            (clamped, reason::ACTION_CLAMPED),
            (limited, reason::LIMITED),
        ] {
            reasons |= if holds { bit } else { 0 };
        }
        let mode = match mode_of_query {
            Mode::Normal if reasons != 0 => Mode::Warn,
            mode => mode,
        };
        let changed = mode != self.mode && mode.max(self.mode) >= Mode::Hold;
        let event = notes
            .event
            .or(changed.then_some((EventKind::ModeChanged, 0)));
        self.mode = mode;
        Tick {
            mode,
            mode_of_query,
            reasons,
            limited,
            start,
            notes,
            event,
        }
    }

    fn begin(&mut self, now: u64, start: &Start) {
        let ee = self.doors.state.map_or([0.0; 3], |s| s.ee_position_m);
        let (action, limited) = self.limit(ee, &start.action);
        self.action = action;
        self.flags = start.flags | if limited { Command::LIMITED } else { 0 };
        self.policy_step += 1;
        let step = ms(self.p.clock.step_ms);
        // The grid goes on if this step follows the last one closely.
        let late = now.checked_sub(self.step_ends_ns);
        let on_grid = late.is_some_and(|late| late < step / 2) && self.step_ends_ns != 0;
        let begins = if on_grid { self.step_ends_ns } else { now };
        self.step_ends_ns = begins.saturating_add(step);
    }

    /// The action box and the workspace.
    fn limit(&self, ee: Point, wanted: &[f64; 7]) -> ([f64; 7], bool) {
        let f = &self.p.filter;
        let unit = self.p.action.translation_m;
        let walls = [
            (f.workspace_min_x_m, f.workspace_max_x_m),
            (f.workspace_min_y_m, f.workspace_max_y_m),
            (f.workspace_min_z_m, f.workspace_max_z_m),
        ];
        let mut action = wanted.map(|x| x.clamp(-1.0, 1.0));
        for (axis, (lo, hi)) in walls.into_iter().enumerate() {
            let (x, at) = (action[axis], ee[axis]);
            let goal = at + x * unit;
            if x > 0.0 && goal > hi {
                action[axis] = (hi - at).max(0.0) / unit;
            } else if x < 0.0 && goal < lo {
                action[axis] = (lo - at).min(0.0) / unit;
            }
        }
        (action, action != *wanted)
    }
}
