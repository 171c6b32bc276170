//! The ends of the policy, the agents, operators and listeners.

use fitmac_core::{
    message::{
        ActionChunk, Command, CriticReport, GroundingRecord, Plan, PolicyQuery, RebindRequest,
        StateSample, TraceRecord, VerifierReport,
    },
    wire::Request,
};

use crate::{
    message::{ModelCall, OperatorRequest, PromptText, Status},
    port::{Receiver, Sender, Session},
    service,
    transport::{ConnectError, Transport, TransportFault},
};

/// The ends of a policy.
pub struct PolicyEndpoint<Tr: Transport> {
    chunk: Sender<ActionChunk, Tr>,
    query: Receiver<PolicyQuery, Tr>,
    state: Receiver<StateSample, Tr>,
    prompt: Receiver<PromptText, Tr>,
}

impl<Tr: Transport> PolicyEndpoint<Tr> {
    /// Connects all ends.
    ///
    /// # Errors
    /// If another policy is there, or a service cannot be opened.
    pub fn connect(transport: &Tr, session: Session) -> Result<Self, ConnectError> {
        Ok(Self {
            chunk: Sender::connect(transport, &service::CHUNK, session)?,
            query: Receiver::connect(transport, &service::QUERY)?,
            state: Receiver::connect(transport, &service::STATE)?,
            prompt: Receiver::connect(transport, &service::PROMPT)?,
        })
    }

    /// The open query, if a new one came since the last call.
    pub fn poll_query(&mut self) -> Option<PolicyQuery> {
        self.query
            .poll_newest(&service::QUERY)
            .map(|envelope| envelope.payload)
    }

    /// The newest state sample, if one came since the last call.
    pub fn poll_state(&mut self) -> Option<&StateSample> {
        self.state.poll().map(|envelope| &envelope.payload)
    }

    /// The next prompt text. Call until it returns `None` and keep the texts
    /// by their id: a query names its prompt by that.
    pub fn poll_prompt(&mut self) -> Option<PromptText> {
        self.prompt.poll().map(|envelope| envelope.payload)
    }

    /// Answers a query at `now_ns`: query id, epoch, subtask and prompt are
    /// taken from it, sequence number and session are filled in.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn send_chunk(
        &mut self,
        now_ns: u64,
        query: &PolicyQuery,
        chunk: &mut ActionChunk,
    ) -> Result<(), TransportFault> {
        chunk.query_id = query.query_id;
        chunk.epoch = query.epoch;
        chunk.subtask = query.subtask;
        chunk.prompt_id = query.prompt_id;
        chunk.session = self.chunk.session().0;
        chunk.sequence = self.chunk.sequence().wrapping_add(1);
        chunk.stamp_ns = now_ns;
        self.chunk.send(now_ns, chunk)
    }

    /// The sending end, for tests that send what a sound policy would not.
    pub fn chunk_sender(&mut self) -> &mut Sender<ActionChunk, Tr> {
        &mut self.chunk
    }
}

/// The ends of the agents.
pub struct AgentsEndpoint<Tr: Transport> {
    plan: Sender<Plan, Tr>,
    grounding: Sender<GroundingRecord, Tr>,
    critic: Sender<CriticReport, Tr>,
    prompt: Sender<PromptText, Tr>,
    model_call: Sender<ModelCall, Tr>,
    rebind: Receiver<RebindRequest, Tr>,
    state: Receiver<StateSample, Tr>,
    command: Receiver<Command, Tr>,
}

impl<Tr: Transport> AgentsEndpoint<Tr> {
    /// Connects all ends.
    ///
    /// # Errors
    /// If other agents are there, or a service cannot be opened.
    pub fn connect(transport: &Tr, session: Session) -> Result<Self, ConnectError> {
        Ok(Self {
            plan: Sender::connect(transport, &service::PLAN, session)?,
            grounding: Sender::connect(transport, &service::GROUNDING, session)?,
            critic: Sender::connect(transport, &service::CRITIC, session)?,
            prompt: Sender::connect(transport, &service::PROMPT, session)?,
            model_call: Sender::connect(transport, &service::MODEL_CALL, session)?,
            rebind: Receiver::connect(transport, &service::REBIND)?,
            state: Receiver::connect(transport, &service::STATE)?,
            command: Receiver::connect(transport, &service::COMMAND)?,
        })
    }

    /// Hands plan, prompts and model calls to a controller, policy or recorder
    /// that came after they were sent. Call it now and then.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn refresh(&mut self) -> Result<(), TransportFault> {
        self.plan.refresh()?;
        self.prompt.refresh()?;
        self.model_call.refresh()
    }

    /// The next request to ground the target.
    pub fn poll_rebind(&mut self) -> Option<RebindRequest> {
        self.rebind.poll().map(|envelope| envelope.payload)
    }

    /// The newest state sample, if one came since the last call.
    pub fn poll_state(&mut self) -> Option<&StateSample> {
        self.state.poll().map(|envelope| &envelope.payload)
    }

    /// The newest command, if one came since the last call: it tells phase,
    /// route and mode.
    pub fn poll_command(&mut self) -> Option<&Command> {
        self.command.poll().map(|envelope| &envelope.payload)
    }

    /// Starts an episode of decisions.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn send_plan(&mut self, now_ns: u64, plan: &Plan) -> Result<(), TransportFault> {
        self.plan.send(now_ns, plan)
    }

    /// Sends a prompt's text to the policy. Send it before the grounding
    /// record that names it.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn send_prompt(&mut self, now_ns: u64, prompt: &PromptText) -> Result<(), TransportFault> {
        self.prompt.send(now_ns, prompt)
    }

    /// Sends a grounding record; sequence number and session are filled in,
    /// its stamp is the caller's: when the observation was taken.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn send_grounding(
        &mut self,
        now_ns: u64,
        record: &mut GroundingRecord,
    ) -> Result<(), TransportFault> {
        record.session = self.grounding.session().0;
        record.sequence = self.grounding.sequence().wrapping_add(1);
        self.grounding.send(now_ns, record)
    }

    /// Sends the critic's word; its sequence number is filled in.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn send_critic(
        &mut self,
        now_ns: u64,
        report: &mut CriticReport,
    ) -> Result<(), TransportFault> {
        report.sequence = self.critic.sequence().wrapping_add(1);
        self.critic.send(now_ns, report)
    }

    /// Tells the recorder of a model call that came to its end.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn send_model_call(&mut self, now_ns: u64, call: &ModelCall) -> Result<(), TransportFault> {
        self.model_call.send(now_ns, call)
    }

    /// The sending end of the grounding, for tests that send what sound agents would not.
    pub fn grounding_sender(&mut self) -> &mut Sender<GroundingRecord, Tr> {
        &mut self.grounding
    }
}

/// The ends of an operator or supervisor.
pub struct OperatorEndpoint<Tr: Transport> {
    request: Sender<OperatorRequest, Tr>,
    status: Receiver<Status, Tr>,
}

impl<Tr: Transport> OperatorEndpoint<Tr> {
    /// Connects all ends.
    ///
    /// # Errors
    /// If too many operators are there, or a service cannot be opened.
    pub fn connect(transport: &Tr, session: Session) -> Result<Self, ConnectError> {
        Ok(Self {
            request: Sender::connect(transport, &service::REQUEST, session)?,
            status: Receiver::connect(transport, &service::STATUS)?,
        })
    }

    /// Asks the controller for something.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn send(&mut self, now_ns: u64, request: Request) -> Result<(), TransportFault> {
        let message = OperatorRequest {
            request: request.code(),
            reserved: [0; 7],
        };
        self.request.send(now_ns, &message)
    }

    /// The controller's newest status, if one came since the last call.
    pub fn poll_status(&mut self) -> Option<Status> {
        self.status.poll().map(|envelope| envelope.payload)
    }
}

/// Listens to everything, for live views. It may miss messages: the recorder
/// of the controller process is the one that doesn't.
pub struct Tap<Tr: Transport> {
    /// Robot and objects.
    pub state: Receiver<StateSample, Tr>,
    /// The verifier's word.
    pub verifier: Receiver<VerifierReport, Tr>,
    /// Action chunks.
    pub chunk: Receiver<ActionChunk, Tr>,
    /// Commands.
    pub command: Receiver<Command, Tr>,
    /// Requests for chunks.
    pub query: Receiver<PolicyQuery, Tr>,
    /// Requests to ground.
    pub rebind: Receiver<RebindRequest, Tr>,
    /// Plans.
    pub plan: Receiver<Plan, Tr>,
    /// Grounding records.
    pub grounding: Receiver<GroundingRecord, Tr>,
    /// Prompts.
    pub prompt: Receiver<PromptText, Tr>,
    /// Model calls.
    pub model_call: Receiver<ModelCall, Tr>,
    /// Decisions and events.
    pub trace: Receiver<TraceRecord, Tr>,
    /// Health.
    pub status: Receiver<Status, Tr>,
}

impl<Tr: Transport> Tap<Tr> {
    /// Connects all ends.
    ///
    /// # Errors
    /// If too many listeners are there, or a service cannot be opened.
    pub fn connect(transport: &Tr) -> Result<Self, ConnectError> {
        Ok(Self {
            state: Receiver::connect(transport, &service::STATE)?,
            verifier: Receiver::connect(transport, &service::VERIFIER)?,
            chunk: Receiver::connect(transport, &service::CHUNK)?,
            command: Receiver::connect(transport, &service::COMMAND)?,
            query: Receiver::connect(transport, &service::QUERY)?,
            rebind: Receiver::connect(transport, &service::REBIND)?,
            plan: Receiver::connect(transport, &service::PLAN)?,
            grounding: Receiver::connect(transport, &service::GROUNDING)?,
            prompt: Receiver::connect(transport, &service::PROMPT)?,
            model_call: Receiver::connect(transport, &service::MODEL_CALL)?,
            trace: Receiver::connect(transport, &service::TRACE)?,
            status: Receiver::connect(transport, &service::STATUS)?,
        })
    }
}
