//! The services: what travels, from how many, and how much of it is kept.

use core::marker::PhantomData;

use fitmac_core::message::{
    ActionChunk, Command, CriticReport, GroundingRecord, Plan, PolicyQuery, RebindRequest,
    StateSample, TraceRecord, VerifierReport,
};

use crate::message::{ModelCall, OperatorRequest, PromptText, Status};

/// A named stream of one message type.
#[derive(Debug)]
pub struct Service<T> {
    /// Its name.
    pub name: &'static str,
    /// Most senders. One, except where people or tools send.
    pub max_publishers: usize,
    /// Most receivers.
    pub max_subscribers: usize,
    /// Messages that wait for a receiver. When they are full the oldest is
    /// dropped: a sender never waits.
    pub buffer: usize,
    /// Messages that a late receiver still gets.
    pub history: usize,
    payload: PhantomData<fn(T)>,
}

impl<T> Clone for Service<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Service<T> {}

impl<T> Service<T> {
    /// A service with one sender, eight receivers.
    #[must_use]
    pub const fn new(name: &'static str, buffer: usize, history: usize) -> Self {
        assert!(history <= buffer && buffer > 0);
        Self {
            name,
            max_publishers: 1,
            max_subscribers: 8,
            buffer,
            history,
            payload: PhantomData,
        }
    }

    /// The same with another number of senders.
    #[must_use]
    pub const fn with_publishers(mut self, max_publishers: usize) -> Self {
        self.max_publishers = max_publishers;
        self
    }
}

/// Robot and objects, newest only. From the harness.
pub const STATE: Service<StateSample> = Service::new("state", 1, 1);
/// The task verifier's word, newest only. From the harness.
pub const VERIFIER: Service<VerifierReport> = Service::new("verifier", 1, 1);
/// Action chunks. From the policy.
pub const CHUNK: Service<ActionChunk> = Service::new("chunk", 1, 0);
/// The command of each tick. From the controller: the one-sender limit is what
/// keeps a second controller out.
pub const COMMAND: Service<Command> = Service::new("command", 1, 0);
/// Requests for chunks. From the controller; a policy that starts late still
/// gets the open one.
pub const QUERY: Service<PolicyQuery> = Service::new("query", 1, 1);
/// Requests to ground the target. From the controller.
pub const REBIND: Service<RebindRequest> = Service::new("rebind", 8, 1);
/// The plan. From the agents.
pub const PLAN: Service<Plan> = Service::new("plan", 2, 1);
/// Grounding records. From the agents.
pub const GROUNDING: Service<GroundingRecord> = Service::new("grounding", 8, 1);
/// The critic's word. From the agents.
pub const CRITIC: Service<CriticReport> = Service::new("critic", 4, 0);
/// Prompt texts. From the agents to the policy; one a subtask and epoch, all
/// kept for a policy that starts late.
pub const PROMPT: Service<PromptText> = Service::new("prompt", 16, 16);
/// Model calls that came to their end. From the agents to the recorder; those
/// before it is there are kept.
pub const MODEL_CALL: Service<ModelCall> = Service::new("model_call", 16, 16);
/// Requests of operators and supervisors; several may be connected.
pub const REQUEST: Service<OperatorRequest> = Service::new("request", 8, 0).with_publishers(4);
/// Trace records, for live views. From the controller's telemetry thread.
pub const TRACE: Service<TraceRecord> = Service::new("trace", 64, 0);
/// The controller's health. From its telemetry thread.
pub const STATUS: Service<Status> = Service::new("status", 1, 1);
