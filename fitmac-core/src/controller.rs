//! The orchestrator: the order of the stages, and nothing else.
//!
//! A tick takes in what arrived, analyses it at policy steps, decides at
//! queries, and only then acts. What happens above the line in
//! [`Controller::tick`] commands nothing.

use crate::{
    clock::{StepClock, Tick},
    decide::{Decided, Episode, decide},
    filter::{Commanded, limit_action, still},
    intake::{
        Refusal, RefusalCounts,
        chunk::{self, ChunkIntake, Wanted},
        grounding::{self, GroundingIntake},
        robot::{self, RobotIntake},
    },
    ladder::{Applied, Faults, Ladder},
    message::{Action, Command, Input, Output, PolicyQuery, RebindRequest, TraceRecord},
    params::ValidParams,
    queue::ActionQueue,
    reason,
    shaping::Shaper,
    subtask::Subtask,
    trace::{self, Decision, Moment},
    turn::{Turn, Waiting},
    verdicts::Verdicts,
    wire::{EventKind, Mode, Request, Route},
};

/// The action that is being executed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Current {
    action: Action,
    policy_step: u64,
    flags: u32,
}

/// Everything that the controller remembers: a copy is a snapshot.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    sequence: u64,
    clock: StepClock,
    robot: RobotIntake,
    chunk: ChunkIntake,
    grounding: GroundingIntake,
    verdicts: Verdicts,
    refusals: RefusalCounts,
    applied: Applied,
    ladder: Ladder,
    episode: Episode,
    subtask: Subtask,
    queue: ActionQueue,
    turn: Turn,
    decision: Decision,
    current: Current,
    mode: Mode,
    observed: Option<(u64, u64)>,
    width_m: Option<f64>,
    shaper: Option<(Shaper, Commanded)>,
    next_request: u64,
}

impl State {
    fn new() -> Self {
        Self {
            sequence: 0,
            clock: StepClock::new(),
            robot: RobotIntake::new(),
            chunk: ChunkIntake::new(),
            grounding: GroundingIntake::new(),
            verdicts: Verdicts::new(),
            refusals: RefusalCounts::ZERO,
            applied: Applied::new(),
            ladder: Ladder::new(),
            episode: Episode::new(),
            subtask: Subtask::fresh(0, 0),
            queue: ActionQueue::new(),
            turn: Turn::Settling(0),
            decision: Decision::NONE,
            current: Current {
                action: still(-1.0),
                policy_step: 0,
                flags: 0,
            },
            mode: Mode::Hold,
            observed: None,
            width_m: None,
            shaper: None,
            next_request: 1,
        }
    }

    /// The active subtask.
    #[must_use]
    pub const fn subtask(&self) -> &Subtask {
        &self.subtask
    }

    /// What was refused so far, by name.
    #[must_use]
    pub const fn refusals(&self) -> &RefusalCounts {
        &self.refusals
    }

    /// The newest decision.
    #[must_use]
    pub const fn decision(&self) -> &Decision {
        &self.decision
    }

    /// Queries and corrections of the episode.
    #[must_use]
    pub const fn episode(&self) -> &Episode {
        &self.episode
    }

    /// Actions of the base policy that wait.
    #[must_use]
    pub const fn queue(&self) -> &ActionQueue {
        &self.queue
    }
}

/// What a tick has to report besides its command.
#[derive(Default)]
struct Report {
    query: Option<PolicyQuery>,
    rebind: Option<RebindRequest>,
    trace: Option<TraceRecord>,
    event: Option<(EventKind, Option<Refusal>)>,
    noticed: u64,
    stop_asked: bool,
}

/// Watches the policy and decides who acts.
#[derive(Clone, Debug, PartialEq)]
pub struct Controller {
    params: ValidParams,
    state: State,
}

impl Controller {
    /// A controller that has seen nothing yet.
    #[must_use]
    pub fn new(params: ValidParams) -> Self {
        let mut state = State::new();
        state.turn = Turn::Settling(params.get().clock.settle_steps);
        Self { params, state }
    }

    /// The parameters.
    #[must_use]
    pub const fn params(&self) -> &ValidParams {
        &self.params
    }

    /// What the controller remembers; a clone is a snapshot.
    #[must_use]
    pub const fn state(&self) -> &State {
        &self.state
    }

    /// Goes on from a snapshot.
    pub fn restore(&mut self, state: State) {
        self.state = state;
    }

    /// Decides one control tick at `now_ns` (monotonic). Total: whatever the
    /// input holds, one command comes out.
    pub fn tick(&mut self, now_ns: u64, input: &Input<'_>) -> Output {
        let mut report = Report::default();
        self.state.sequence = self.state.sequence.wrapping_add(1);
        let tick = self
            .state
            .clock
            .advance(now_ns, self.params.get().clock.gap_stop_ms);
        self.take_in(now_ns, input, &mut report);
        let (mode, faults) = self.judge_faults(now_ns, &tick, &report);
        let starts = match mode {
            Mode::Normal | Mode::Warn => self.play(now_ns, &mut report),
            Mode::Hold | Mode::Stop => self.stand_still(now_ns, mode, &mut report),
        };
        // Analysis ends here; what follows acts.
        self.act(now_ns, mode, faults, tick.dt_s, starts, report)
    }

    // ---- Intake ----

    fn take_in(&mut self, now_ns: u64, input: &Input<'_>, report: &mut Report) {
        match Request::try_from(input.request) {
            Ok(Request::Reset) => self.start_episode(),
            Ok(Request::Stop) => report.stop_asked = true,
            Ok(Request::None) | Err(_) => {}
        }
        if let Some(plan) = input.plan {
            match self.state.episode.hear_plan(plan) {
                Ok(true) => self.start_episode(),
                Ok(false) => {}
                Err(refusal) => self.refuse(
                    refusal,
                    EventKind::GroundingRefused,
                    reason::GROUNDING_REFUSED,
                    report,
                ),
            }
        }
        if let Some(sample) = input.state {
            self.take_state(now_ns, sample, report);
        }
        if let Some(record) = input.grounding {
            self.take_grounding(now_ns, record, report);
        }
        if let Some(heard) = input.verifier {
            self.state
                .verdicts
                .hear_verifier(heard, self.state.subtask.index());
        }
        if let Some(heard) = input.critic {
            self.state
                .verdicts
                .hear_critic(heard, self.state.subtask.index());
        }
        if let Some(chunk) = input.chunk {
            self.take_chunk(now_ns, chunk, report);
        }
    }

    fn take_state(
        &mut self,
        now_ns: u64,
        sample: &crate::message::StateSample,
        report: &mut Report,
    ) {
        let (state, params) = (&mut self.state, self.params.get());
        let before = *state.robot.latest().unwrap_or(sample);
        match state.robot.step(&params.state, now_ns, sample) {
            robot::Outcome::Accepted { discontinuous } => {
                state.applied.note(now_ns, sample.applied_command);
                if discontinuous {
                    state.subtask.forget_motion();
                } else if let Some(after) = state.robot.latest() {
                    state
                        .subtask
                        .lock
                        .watch(&params.lock, &params.gripper, &before, after);
                }
            }
            robot::Outcome::Duplicate => {}
            robot::Outcome::Refused(refusal) => {
                let bit = if refusal == Refusal::Jump {
                    reason::STATE_JUMP
                } else {
                    reason::STATE_REFUSED
                };
                self.refuse(refusal, EventKind::StateRefused, bit, report);
            }
        }
    }

    fn take_grounding(
        &mut self,
        now_ns: u64,
        record: &crate::message::GroundingRecord,
        report: &mut Report,
    ) {
        let (state, params) = (&mut self.state, self.params.get());
        let (epoch, subtask) = (state.subtask.lock.epoch(), state.subtask.index());
        match state
            .grounding
            .step(&params.state, now_ns, record, epoch, subtask)
        {
            grounding::Outcome::Evidence => state.subtask.lock.observe(record),
            grounding::Outcome::Proposal => {}
            grounding::Outcome::Refused(refusal) => {
                self.refuse(
                    refusal,
                    EventKind::GroundingRefused,
                    reason::GROUNDING_REFUSED,
                    report,
                );
            }
        }
    }

    fn take_chunk(
        &mut self,
        now_ns: u64,
        chunk: &crate::message::ActionChunk,
        report: &mut Report,
    ) {
        let state = &mut self.state;
        match state.chunk.step(self.params.get(), now_ns, chunk) {
            chunk::Outcome::Accepted { frozen: true } => report.noticed |= reason::POLICY_FROZEN,
            chunk::Outcome::Accepted { frozen: false } => {}
            chunk::Outcome::Refused(refusal) => {
                let bit = if refusal == Refusal::SessionChanged {
                    // The policy restarted: what it planned before is void.
                    state.queue.clear();
                    reason::POLICY_RESTARTED
                } else {
                    reason::CHUNK_REFUSED
                };
                self.refuse(refusal, EventKind::ChunkRefused, bit, report);
            }
        }
    }

    fn refuse(&mut self, refusal: Refusal, kind: EventKind, bit: u64, report: &mut Report) {
        self.state.refusals.count(refusal);
        report.noticed |= bit;
        report.event = Some((kind, Some(refusal)));
    }

    fn start_episode(&mut self) {
        let state = &mut self.state;
        let epoch = state.subtask.lock.epoch();
        state.subtask = Subtask::fresh(0, epoch);
        state.episode.restart();
        state.verdicts.forget();
        state.grounding.keep_only(0);
        state.chunk.discard();
        state.queue.clear();
        state.ladder = Ladder::new();
        state.turn = Turn::Settling(self.params.get().clock.settle_steps);
        state.decision = Decision::NONE;
    }

    // ---- Faults ----

    fn judge_faults(&mut self, now_ns: u64, tick: &Tick, report: &Report) -> (Mode, u64) {
        let (state, params) = (&mut self.state, self.params.get());
        let noticed = report.noticed
            | if tick.backwards {
                reason::TIME_FAULT
            } else {
                0
            };
        let faults = Faults {
            noticed,
            state_age_ns: state.robot.age_ns(now_ns),
            waiting_ns: state
                .chunk
                .waiting_since_ns()
                .map(|since| now_ns.saturating_sub(since)),
            chunks_accepted: state.chunk.accepted(),
            chunks_refused: state.chunk.refused_in_a_row(),
            unapplied_ns: state.applied.standing_ns(now_ns),
            suspended: tick.suspended,
            stop_asked: report.stop_asked,
        };
        state.ladder.step(params, &faults)
    }

    /// Hold or stop: the queue is void; a zero increment starts once.
    fn stand_still(&mut self, now_ns: u64, mode: Mode, report: &mut Report) -> Option<Start> {
        let state = &mut self.state;
        let enters = state.mode < Mode::Hold;
        if mode == Mode::Stop {
            state.subtask.recovery.cancel();
            state.chunk.discard();
        }
        state.queue.clear();
        if let Turn::Playing = state.turn {
            state.turn = Turn::Due;
        }
        // A hold for want of a good chunk ends only with one: keep asking.
        let owed = matches!(state.turn, Turn::Waiting(Waiting::Chunk { .. }))
            || state.chunk.refused_in_a_row() > 0;
        if owed && mode == Mode::Hold {
            report.query = self.ask(now_ns);
        }
        let state = &self.state;
        (enters && state.robot.latest().is_some()).then(|| Start::still(&state.current.action))
    }

    // ---- Policy steps and queries ----

    /// Starts an action if one is due and at hand.
    fn play(&mut self, now_ns: u64, report: &mut Report) -> Option<Start> {
        if let Turn::Waiting(waiting) = self.state.turn {
            return self.wait(now_ns, waiting, report);
        }
        if !self.state.clock.is_due(now_ns) {
            return None;
        }
        if let Turn::Settling(left) = self.state.turn {
            self.state.turn = left.checked_sub(1).map_or(Turn::Due, Turn::Settling);
            if left > 0 {
                return Some(Start::still(&still(-1.0)));
            }
        }
        self.observe();
        if self.state.queue.is_empty() {
            return self.query(now_ns, report);
        }
        if self.state.queue.len() == self.params.get().chunk.query_lead_steps as usize {
            report.query = self.ask(now_ns);
        }
        self.pop()
    }

    /// One policy step went by: analysis, once, and only on a new sample.
    fn observe(&mut self) {
        let (state, params) = (&mut self.state, self.params.get());
        let Some(sample) = state.robot.latest() else {
            return;
        };
        let seen = Some((sample.session, sample.sequence));
        if state.observed == seen {
            return;
        }
        state.observed = seen;
        let width_before = state.width_m.unwrap_or(sample.gripper_width_m);
        let [.., grip] = state.current.action;
        let commanded_closed = state.current.policy_step > 0 && grip > 0.0;
        let verdict = state.verdicts.verdict();
        state
            .subtask
            .observe(params, sample, width_before, commanded_closed, verdict);
        state.width_m = Some(sample.gripper_width_m);
    }

    /// The queue is empty: decide who acts.
    fn query(&mut self, now_ns: u64, report: &mut Report) -> Option<Start> {
        let (state, params) = (&mut self.state, self.params.get());
        let sample = state.robot.latest()?;
        let decided = decide(
            params,
            now_ns,
            sample,
            &mut state.episode,
            &mut state.subtask,
            &mut state.grounding,
            &mut state.verdicts,
        );
        state.decision = decided.decision;
        if decided.new_prompt {
            state.chunk.discard();
        }
        if decided.advanced {
            report.event = Some((EventKind::SubtaskChanged, None));
        }
        match decided.step {
            Decided::Correct { action, waypoint_m } => {
                state.chunk.discard();
                state.turn = Turn::Due;
                Some(Start {
                    action,
                    flags: 0,
                    from_policy: false,
                    waypoint_m,
                    query: true,
                })
            }
            Decided::Policy => {
                let horizon = state.decision.effective_horizon;
                state.turn = Turn::Waiting(Waiting::Chunk { horizon });
                self.wait(now_ns, Waiting::Chunk { horizon }, report)
            }
            Decided::AskAgents { hold } => {
                report.rebind = Some(self.rebind_request(now_ns));
                let state = &mut self.state;
                let horizon = state.decision.effective_horizon;
                let waiting = if hold {
                    Waiting::Grounding { since_ns: now_ns }
                } else {
                    Waiting::Chunk { horizon }
                };
                state.turn = Turn::Waiting(waiting);
                match waiting {
                    Waiting::Grounding { .. } => Some(Start {
                        query: true,
                        ..Start::still(&state.current.action)
                    }),
                    Waiting::Chunk { .. } => self.wait(now_ns, waiting, report),
                }
            }
        }
    }

    /// Something is awaited: the chunk of this query, or the agents' answer.
    fn wait(&mut self, now_ns: u64, waiting: Waiting, report: &mut Report) -> Option<Start> {
        match waiting {
            Waiting::Chunk { horizon } => {
                if self.state.clock.is_due(now_ns) && self.fill(horizon) {
                    return self.pop().map(|s| Start { query: true, ..s });
                }
                report.query = self.ask(now_ns);
                None
            }
            Waiting::Grounding { since_ns } => {
                let waited = now_ns.saturating_sub(since_ns);
                let over = waited > crate::intake::ms_to_ns(self.params.get().lock.rebind_wait_ms);
                if self.state.grounding.proposal().is_some() || over {
                    self.state.turn = Turn::Due;
                }
                None
            }
        }
    }

    /// Moves the prefix of the chunk at hand into the queue.
    fn fill(&mut self, horizon: u32) -> bool {
        let state = &mut self.state;
        match state.chunk.take(state.queue.played()) {
            Some((chunk, consumed)) => {
                let taken = state.queue.fill(chunk, consumed, horizon);
                if taken == 0 {
                    state.refusals.count(Refusal::Consumed);
                }
                taken > 0
            }
            None => false,
        }
    }

    fn pop(&mut self) -> Option<Start> {
        let state = &mut self.state;
        let popped = state.queue.pop(self.params.get())?;
        state.turn = if state.queue.is_empty() {
            Turn::Due
        } else {
            Turn::Playing
        };
        Some(Start {
            action: popped.action,
            flags: if popped.clamped { Command::CLAMPED } else { 0 },
            from_policy: true,
            waypoint_m: None,
            query: false,
        })
    }

    fn ask(&mut self, now_ns: u64) -> Option<PolicyQuery> {
        let state = &mut self.state;
        let wanted = Wanted {
            state_sequence: state.robot.latest().map_or(0, |s| s.sequence),
            policy_step: state.current.policy_step,
            played: state.queue.played(),
            epoch: state.subtask.lock.epoch(),
            subtask: state.subtask.index(),
            prompt_id: state.subtask.lock.binding().map_or(0, |b| b.prompt_id),
        };
        state.chunk.ask(self.params.get(), now_ns, wanted)
    }

    fn rebind_request(&mut self, now_ns: u64) -> RebindRequest {
        let state = &mut self.state;
        let request_id = state.next_request;
        state.next_request = state.next_request.wrapping_add(1);
        RebindRequest {
            request_id,
            stamp_ns: now_ns,
            epoch: state.subtask.lock.epoch(),
            subtask: state.subtask.index(),
            suspect: state.subtask.lock.target(),
            reserved: 0,
            reasons: state.decision.reasons,
        }
    }

    // ---- Action ----

    fn act(
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
        let mut trace = report.trace;
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
        if mode >= Mode::Hold && state.mode < Mode::Hold {
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

/// The setpoint of one tick.
#[derive(Clone, Copy)]
struct Setpoint {
    translation: Commanded,
    orientation: [f64; 4],
}

/// An action that starts in this tick.
#[derive(Clone, Copy)]
struct Start {
    action: Action,
    flags: u32,
    from_policy: bool,
    waypoint_m: Option<[f64; 3]>,
    /// It is the first of its query.
    query: bool,
}

impl Start {
    /// No increment, the gripper as in `last`.
    const fn still(last: &Action) -> Self {
        let [.., gripper] = *last;
        Self {
            action: still(gripper),
            flags: 0,
            from_policy: false,
            waypoint_m: None,
            query: false,
        }
    }
}
