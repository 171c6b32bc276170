//! Both controllers, shown alike: a list of names and values.

use fitmac_core::{
    Controller, State,
    message::{Command, Output, PolicyQuery, RebindRequest, TraceRecord},
    phase::Carry,
    signals::{GripperState, Signals},
    wire::{EventKind, Mode, Route, SubPhase},
};

use super::{Model, Tick, arm::Arm, sight::Look, sight::Pads, story, task::Goes};
use crate::swarm::Told;

/// One value.
#[derive(Clone, Copy, Debug)]
pub enum Value {
    /// A number that must agree exactly.
    Count(u64),
    /// A measure that must agree within 1e-9; a NaN agrees with a NaN.
    Measure(f64),
}

/// Largest difference of two measures that agree.
const TOLERANCE: f64 = 1e-9;

impl Value {
    /// True if both say the same.
    #[must_use]
    pub fn agrees(self, other: Self) -> bool {
        match (self, other) {
            (Self::Count(a), Self::Count(b)) => a == b,
            (Self::Measure(a), Self::Measure(b)) => {
                a == b || (a - b).abs() <= TOLERANCE || (a.is_nan() && b.is_nan())
            }
            _ => false,
        }
    }
}

/// What one controller shows after a tick.
#[derive(Clone, Debug, Default)]
pub struct View {
    values: Vec<(&'static str, Value)>,
}

/// One thing that the two controllers see differently.
#[derive(Clone, Debug)]
pub struct Difference {
    /// Its name.
    pub name: &'static str,
    /// What the core shows.
    pub core: Value,
    /// What the model shows.
    pub model: Value,
}

impl View {
    fn count(&mut self, name: &'static str, value: impl TryInto<u64>) {
        let value = value.try_into().unwrap_or(u64::MAX);
        self.values.push((name, Value::Count(value)));
    }

    fn measure(&mut self, name: &'static str, value: f64) {
        self.values.push((name, Value::Measure(value)));
    }

    fn measures<const N: usize>(&mut self, name: &'static str, values: &[f64; N]) {
        values.iter().for_each(|x| self.measure(name, *x));
    }

    /// Where a place is; NaN for none.
    fn place(&mut self, name: &'static str, at: Option<[f64; 3]>) {
        self.measures(name, &at.unwrap_or([f64::NAN; 3]));
    }

    /// Values shown.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// True if nothing is shown.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// What differs from the model's view.
    #[must_use]
    pub fn differences(&self, model: &Self) -> Vec<Difference> {
        let pairs = self.values.iter().zip(&model.values);
        let mut found: Vec<_> = pairs
            .filter(|(a, b)| a.0 != b.0 || !a.1.agrees(b.1))
            .map(|(a, b)| Difference {
                name: a.0,
                core: a.1,
                model: b.1,
            })
            .collect();
        if self.len() != model.len() {
            found.push(Difference {
                name: "values shown",
                core: Value::Count(self.len() as u64),
                model: Value::Count(model.len() as u64),
            });
        }
        found
    }

    fn query(&mut self, query: Option<&PolicyQuery>) {
        self.count("query: asked", u64::from(query.is_some()));
        if let Some(q) = query {
            self.count("query: id", q.query_id);
            self.count("query: stamp", q.stamp_ns);
            self.count("query: state", q.state_sequence);
            self.count("query: policy step", q.policy_step);
            self.count("query: epoch", q.epoch);
            self.count("query: subtask", q.subtask);
            self.count("query: prompt", q.prompt_id);
        }
    }

    fn rebind(&mut self, request: Option<&RebindRequest>) {
        self.count("rebind: asked", u64::from(request.is_some()));
        if let Some(r) = request {
            self.count("rebind: id", r.request_id);
            self.count("rebind: stamp", r.stamp_ns);
            self.count("rebind: epoch", r.epoch);
            self.count("rebind: subtask", r.subtask);
            self.count("rebind: suspect", r.suspect);
            self.count("rebind: reasons", r.reasons);
        }
    }

    fn trace(&mut self, record: Option<&TraceRecord>) {
        self.count("trace: written", u64::from(record.is_some()));
        if let Some(r) = record {
            self.count("trace: query", r.query);
            self.count("trace: policy step", r.policy_step);
            self.count("trace: mode", r.mode);
            self.count("trace: phase", r.phase);
            self.count("trace: phase steps", r.phase_steps);
            self.count("trace: attempt", r.attempt);
            self.count("trace: attempt steps", r.attempt_steps);
            self.count("trace: sub-phase", r.sub_phase);
            self.count("trace: budget", r.budget);
            self.count("trace: verdict", r.verdict);
            self.count("trace: failure streak", r.failure_streak);
            self.count("trace: confidence streak", r.confidence_streak);
            self.count("trace: target", r.target);
            self.measures("trace: waypoint", &r.waypoint_m);
            self.measures("trace: base action", &r.base_action);
            self.measures("trace: action", &r.action);
        }
    }
}

/// What the core shows.
#[must_use]
pub fn of_core(output: &Output, controller: &Controller) -> View {
    let (c, s) = (&output.command, controller.state());
    let mut v = View::default();
    v.count("command: sequence", c.sequence);
    v.count("command: policy step", c.policy_step);
    v.count("command: query", c.query);
    v.count("command: mode", c.mode);
    v.count("command: route", c.route);
    v.count("command: phase", c.phase);
    v.count("command: sub-phase", c.sub_phase);
    v.count("command: reasons", c.reasons);
    v.count("command: flags", c.flags);
    v.measures("command: action", &c.action);
    v.query(output.query.as_ref());
    v.rebind(output.rebind.as_ref());
    v.trace(output.trace.as_ref());
    v.count("event: written", u64::from(output.event.is_some()));
    v.count("event: kind", output.event.map_or(0, |e| e.kind));
    v.count("event: detail", output.event.map_or(0, |e| e.detail));
    core_memory(&mut v, s);
    core_signals(&mut v, s.subtask().signals());
    v
}

fn core_memory(v: &mut View, s: &State) {
    let t = s.subtask();
    for (refusal, n) in s.refusals().iter() {
        v.count(refusal.name(), n);
    }
    let d = s.decision();
    v.measure("decision: kappa", d.kappa);
    v.count("decision: evidence", d.evidence);
    v.count("decision: phase", d.phase.code());
    v.count("decision: diagnosis", d.diagnosis.code());
    v.count("decision: route", d.route.code());
    v.count("decision: reasons", d.reasons);
    v.count("decision: horizon", d.effective_horizon);
    v.count("decision: other", d.other);
    v.count("episode: queries", s.episode().queries());
    v.count("episode: corrections", s.episode().correction_queries());
    v.count("episode: rebinds", s.episode().rebinds());
    v.count("queue: left", s.queue().len() as u64);
    v.count("queue: played", s.queue().played());
    v.count("subtask", t.index());
    v.count("lock: epoch", t.lock().epoch());
    v.count("lock: target", t.lock().target());
    v.count("lock: anchor", t.lock().anchor().map_or(0, |a| a.object));
    v.count("phase", t.estimator().phase().code());
    v.count("phase: steps", t.estimator().steps());
    let (carry, top) = match t.estimator().carry() {
        Carry::Resting { .. } => (0_u64, 0.0),
        Carry::Lifted { top_z_m, .. } => (1, top_z_m),
        Carry::Released => (2, 0.0),
    };
    v.count("carry", carry);
    v.measure("carry: top", top);
    v.count("monitor: history", t.monitor().history().len() as u64);
    v.count("monitor: since progress", t.monitor().since_progress());
    v.count("attempt: id", t.attempt().id());
    v.count("attempt: steps", t.attempt().steps());
    v.count("attempt: has acted", u64::from(t.attempt().has_acted()));
    let held = t.attempt().held_other();
    v.count("attempt: holds another", held.map_or(0, |(id, _)| id));
    v.measure("attempt: its height", held.map_or(0.0, |(_, z)| z));
    for diagnosis in t.diagnoses().newest_first() {
        v.count("diagnoses", diagnosis.code());
    }
    v.count("streaks: failures", t.streaks().failures());
    v.count("streaks: confident", t.streaks().confident());
    let r = t.recovery();
    v.count("recovery: pending", u64::from(r.is_pending()));
    v.count("recovery: step", r.sub_phase().code());
    v.count("recovery: budget", r.budget());
    v.count("recovery: re-descents", r.redescents());
    v.count("recovery: activations", r.activations());
    v.count(
        "recovery: since",
        r.since_hand_back().map_or(u64::MAX, u64::from),
    );
    v.count("since rebind", t.since_rebind().map_or(u64::MAX, u64::from));
}

fn core_signals(v: &mut View, signals: Option<&Signals>) {
    v.count("signals: known", u64::from(signals.is_some()));
    let Some(s) = signals else {
        return;
    };
    v.measures("signals: end effector", &s.ee_m);
    v.measure("signals: width", s.gripper.width_m);
    let pads = match s.gripper.state {
        GripperState::Open => 0_u64,
        GripperState::Closing => 1,
        GripperState::Holding => 2,
        GripperState::Empty => 3,
    };
    v.count("signals: gripper", pads);
    v.place("target: place", s.target.map(|t| t.position_m));
    if let Some(t) = &s.target {
        v.count("target: id", t.id);
        v.measure("target: half height", t.half_height_m);
        v.measure("target: distance", t.distance_m);
        v.measure("target: beside", t.distance_xy_m);
        v.measure("target: above", t.height_m);
    }
    v.place("destination: place", s.destination.map(|d| d.position_m));
    if let Some(d) = &s.destination {
        v.measure("destination: distance", d.distance_m);
        v.measure("destination: beside", d.distance_xy_m);
        v.measure("destination: clearance", d.clearance_m);
    }
    v.place("other: place", s.other.map(|o| o.position_m));
    v.count("other: id", s.other.map_or(0, |o| o.id));
    v.measure("other: distance", s.other.map_or(0.0, |o| o.distance_m));
}

impl Model {
    /// Decides a tick and shows what came of it. `given` is the core's answer,
    /// of which the model takes whether the last filter changed the setpoint.
    #[must_use]
    pub fn tick(&mut self, told: &Told, given: &Output) -> View {
        let limited = given.command.flags & Command::LIMITED != 0;
        // An action that was limited says so by itself.
        let tick = self.decide(told, limited);
        self.view(&tick)
    }

    fn view(&self, tick: &Tick) -> View {
        let mut v = View::default();
        let task = &self.task;
        let d = &self.decision;
        let base = d.route == Route::Base;
        let plain = tick.mode == Mode::Normal && base;
        let reasons = tick.reasons | if base { 0 } else { d.reasons };
        let flags = self.flags | if tick.limited { Command::LIMITED } else { 0 };
        let step = task.arm.as_ref().map_or(SubPhase::Idle, Arm::step_name);
        v.count("command: sequence", self.ticks);
        v.count("command: policy step", self.policy_step);
        v.count("command: query", self.queries);
        v.count("command: mode", tick.mode.code());
        v.count("command: route", d.route.code());
        v.count("command: phase", task.story.phase.code());
        v.count("command: sub-phase", step.code());
        v.count("command: reasons", if plain { 0 } else { reasons });
        v.count("command: flags", flags);
        v.measures("command: action", &self.action);
        v.query(tick.notes.query.as_ref());
        v.rebind(tick.notes.rebind.as_ref());
        self.view_trace(&mut v, tick, step);
        v.count("event: written", u64::from(tick.event.is_some()));
        v.count(
            "event: kind",
            tick.event.map_or(EventKind::Query, |e| e.0).code(),
        );
        v.count("event: detail", tick.event.map_or(0, |e| e.1));
        self.view_memory(&mut v, step);
        view_look(&mut v, task.look.as_ref());
        v
    }

    fn view_trace(&self, v: &mut View, tick: &Tick, step: SubPhase) {
        let start = tick.start.filter(|s| s.query);
        v.count("trace: written", u64::from(start.is_some()));
        let Some(start) = start else {
            return;
        };
        let story = &self.task.story;
        v.count("trace: query", self.queries);
        v.count("trace: policy step", self.policy_step - 1);
        v.count("trace: mode", tick.mode_of_query.code());
        v.count("trace: phase", self.decision.phase.code());
        v.count("trace: phase steps", story.phase_steps() as u64);
        v.count("trace: attempt", story.attempt_id);
        v.count("trace: attempt steps", story.attempt_steps() as u64);
        v.count("trace: sub-phase", step.code());
        v.count(
            "trace: budget",
            self.task.arm.as_ref().map_or(0, |a| a.budget),
        );
        v.count("trace: verdict", self.verdict().code());
        v.count("trace: failure streak", self.task.failures());
        v.count("trace: confidence streak", self.task.confident(&self.p));
        v.count("trace: target", self.task.target());
        v.place("trace: waypoint", start.waypoint);
        let from_policy = start.flags & Command::FROM_POLICY != 0;
        let base = if from_policy {
            start.action
        } else {
            [f64::NAN; 7]
        };
        v.measures("trace: base action", &base);
        v.measures("trace: action", &self.action);
    }

    fn view_memory(&self, v: &mut View, step: SubPhase) {
        let (t, d) = (&self.task, &self.decision);
        for (refusal, n) in fitmac_core::intake::Refusal::ALL
            .iter()
            .zip(self.doors.refused)
        {
            v.count(refusal.name(), n);
        }
        v.measure("decision: kappa", d.kappa);
        v.count("decision: evidence", d.evidence);
        v.count("decision: phase", d.phase.code());
        v.count("decision: diagnosis", d.diagnosis.code());
        v.count("decision: route", d.route.code());
        v.count("decision: reasons", d.reasons);
        v.count("decision: horizon", d.horizon);
        v.count("decision: other", d.other);
        v.count("episode: queries", self.queries);
        v.count("episode: corrections", self.corrections);
        v.count("episode: rebinds", self.rebinds);
        v.count("queue: left", self.queue.len() as u64);
        v.count("queue: played", self.played);
        v.count("subtask", t.index);
        v.count("lock: epoch", t.epoch);
        v.count("lock: target", t.target());
        let anchor = match t.binding.map(|b| b.goes) {
            Some(Goes::To(anchor)) => anchor.object,
            _ => 0,
        };
        v.count("lock: anchor", anchor);
        v.count("phase", t.story.phase.code());
        v.count("phase: steps", t.story.phase_steps() as u64);
        let (carry, top) = match t.story.carry() {
            story::Carry::Resting => (0_u64, 0.0),
            story::Carry::Lifted { top, .. } => (1, top),
            story::Carry::Released => (2, 0.0),
        };
        v.count("carry", carry);
        v.measure("carry: top", top);
        v.count("monitor: history", t.story.history() as u64);
        let since = t.story.since_progress();
        v.count(
            "monitor: since progress",
            since.map_or(u64::from(u32::MAX), |n| n as u64),
        );
        v.count("attempt: id", t.story.attempt_id);
        v.count("attempt: steps", t.story.attempt_steps() as u64);
        v.count("attempt: has acted", u64::from(t.story.has_acted()));
        let held = t.story.held_other(&self.p);
        v.count("attempt: holds another", held.map_or(0, |(id, _)| id));
        v.measure("attempt: its height", held.map_or(0.0, |(_, z)| z));
        for n in 0..16 {
            let diagnosis = t.queries.iter().rev().nth(n).map_or(0, |q| q.0.code());
            v.count("diagnoses", diagnosis);
        }
        v.count("streaks: failures", t.failures());
        v.count("streaks: confident", t.confident(&self.p));
        v.count("recovery: pending", u64::from(t.arm.is_some()));
        v.count("recovery: step", step.code());
        v.count("recovery: budget", t.arm.as_ref().map_or(0, |a| a.budget));
        v.count(
            "recovery: re-descents",
            t.arm.as_ref().map_or(0, Arm::redescents),
        );
        v.count("recovery: activations", t.activations);
        v.count(
            "recovery: since",
            t.since_hand_back().map_or(u64::MAX, u64::from),
        );
        v.count("since rebind", t.since_rebind().map_or(u64::MAX, u64::from));
    }
}

fn view_look(v: &mut View, look: Option<&Look>) {
    v.count("signals: known", u64::from(look.is_some()));
    let Some(look) = look else {
        return;
    };
    v.measures("signals: end effector", &look.ee);
    v.measure("signals: width", look.width);
    let pads = match look.pads {
        Pads::Open => 0_u64,
        Pads::Closing => 1,
        Pads::Holding => 2,
        Pads::Empty => 3,
    };
    v.count("signals: gripper", pads);
    v.place("target: place", look.target.map(|t| t.at));
    if let Some(t) = &look.target {
        v.count("target: id", t.id);
        v.measure("target: half height", t.half_height);
        v.measure("target: distance", t.distance);
        v.measure("target: beside", t.beside);
        v.measure("target: above", t.above);
    }
    v.place("destination: place", look.place.map(|d| d.at));
    if let Some(d) = &look.place {
        v.measure("destination: distance", d.distance);
        v.measure("destination: beside", d.beside);
        v.measure("destination: clearance", d.clearance);
    }
    v.place("other: place", look.other.map(|o| o.at));
    v.count("other: id", look.other.map_or(0, |o| o.id));
    v.measure("other: distance", look.other.map_or(0.0, |o| o.distance));
}
