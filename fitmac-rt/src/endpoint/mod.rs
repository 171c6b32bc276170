//! The typed ends of the four roles, and of a listener.
//!
//! | role | sends | receives |
//! |---|---|---|
//! | [`HarnessEndpoint`] (robot or simulator) | state, verifier | command |
//! | [`PolicyEndpoint`] | chunk | query, state, prompt |
//! | [`AgentsEndpoint`] | plan, grounding, critic, prompt, model_call | rebind, state |
//! | [`ControllerEndpoint`] | command, query, rebind | all the others |
//! | [`Tap`] (live views) | nothing | everything |
//! | [`OperatorEndpoint`] | request | status |
//!
//! A role connects all its ends at once, before it starts to work.

mod controller;
mod harness;
mod peers;
mod watch;

pub use controller::ControllerEndpoint;
pub use harness::HarnessEndpoint;
pub use peers::{AgentsEndpoint, OperatorEndpoint, PolicyEndpoint, Tap};
pub use watch::{CommandLimits, CommandState, CommandWatch, StopCause};
