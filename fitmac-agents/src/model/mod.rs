//! Language and vision-language models behind an OpenAI-compatible endpoint.
//!
//! vLLM, llama.cpp and Ollama speak this protocol. A call has a time limit, a
//! limit on the answer's size and a few retries; whatever goes wrong has a
//! name, and the rules go on without the model.

mod calls;
mod client;
pub mod prompts;
#[cfg(any(test, feature = "stand-in"))]
pub mod stand_in;
pub mod wire;

#[cfg(test)]
mod tests;

pub use calls::{CallRecord, Calls, Finished, Question, Role};
pub use client::{Cancel, ChatModel, ModelConfig, ModelError};
