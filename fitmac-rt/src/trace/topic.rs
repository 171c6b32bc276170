//! The topics of a trace, and what their messages look like.

use fitmac_core::message::{
    ActionChunk, Command, CriticReport, GroundingRecord, Plan, PolicyQuery, RebindRequest,
    StateSample, TraceRecord, VerifierReport,
};

use super::schema;
use crate::{
    frame::TickHead,
    layout::{Layout, Payload},
    message::{ModelCall, PromptText, Status},
};

/// A topic that we read; others are passed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Topic {
    Tick,
    State,
    Chunk,
    Grounding,
    Plan,
    Verifier,
    Critic,
    Command,
    Query,
    Rebind,
    Trace,
    Event,
    Prompt,
    ModelCall,
    Status,
}

impl Topic {
    /// Every one, with its name.
    const ALL: [(&str, Self); 15] = [
        ("/tick", Self::Tick),
        ("/state", Self::State),
        ("/chunk", Self::Chunk),
        ("/grounding", Self::Grounding),
        ("/plan", Self::Plan),
        ("/verifier", Self::Verifier),
        ("/critic", Self::Critic),
        ("/command", Self::Command),
        ("/query", Self::Query),
        ("/rebind", Self::Rebind),
        ("/trace", Self::Trace),
        ("/event", Self::Event),
        ("/prompt", Self::Prompt),
        ("/model_call", Self::ModelCall),
        ("/status", Self::Status),
    ];

    /// The topic of that name, if it is one of ours.
    pub(super) fn named(name: &str) -> Option<Self> {
        let (_, topic) = Self::ALL.iter().find(|(n, _)| *n == name)?;
        Some(*topic)
    }

    /// Name and descriptor of its messages.
    pub(super) fn schema(self) -> (String, Vec<u8>) {
        fn of<T: Payload>() -> (String, Vec<u8>) {
            (schema::full_name::<T>(), schema::descriptor_set::<T>())
        }
        match self {
            Self::Tick => of::<TickHead>(),
            Self::State => of::<StateSample>(),
            Self::Chunk => of::<ActionChunk>(),
            Self::Grounding => of::<GroundingRecord>(),
            Self::Plan => of::<Plan>(),
            Self::Verifier => of::<VerifierReport>(),
            Self::Critic => of::<CriticReport>(),
            Self::Command => of::<Command>(),
            Self::Query => of::<PolicyQuery>(),
            Self::Rebind => of::<RebindRequest>(),
            Self::Trace | Self::Event => of::<TraceRecord>(),
            Self::Prompt => of::<PromptText>(),
            Self::ModelCall => of::<ModelCall>(),
            Self::Status => of::<Status>(),
        }
    }
}

/// The layout of a topic of ours; `None` for others.
#[must_use]
pub fn layout_of(topic: &str) -> Option<Layout> {
    Some(match Topic::named(topic)? {
        Topic::Tick => TickHead::LAYOUT,
        Topic::State => StateSample::LAYOUT,
        Topic::Chunk => ActionChunk::LAYOUT,
        Topic::Grounding => GroundingRecord::LAYOUT,
        Topic::Plan => Plan::LAYOUT,
        Topic::Verifier => VerifierReport::LAYOUT,
        Topic::Critic => CriticReport::LAYOUT,
        Topic::Command => Command::LAYOUT,
        Topic::Query => PolicyQuery::LAYOUT,
        Topic::Rebind => RebindRequest::LAYOUT,
        Topic::Trace | Topic::Event => TraceRecord::LAYOUT,
        Topic::Prompt => PromptText::LAYOUT,
        Topic::ModelCall => ModelCall::LAYOUT,
        Topic::Status => Status::LAYOUT,
    })
}
