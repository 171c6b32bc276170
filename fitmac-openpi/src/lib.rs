//! Client of a policy server that speaks [openpi](https://github.com/Physical-Intelligence/openpi)'s
//! protocol: pi0, pi0-FAST, pi0.5 and what else is served by its `serve_policy.py`.
//!
//! The protocol, read off openpi's `websocket_policy_server.py` and `msgpack_numpy.py`: after the
//! websocket handshake the server sends one msgpack map, its metadata. Then each binary frame with
//! an observation is answered by one binary frame with actions. A text frame is the traceback of
//! a failure, after which the server closes. Arrays are maps with binary keys ([`mod@array`]).
//!
//! An answer carries no number of its question. So there is one question at a time, and a
//! connection whose answer did not come in time is dropped: the late answer must not be taken for
//! the next one.

pub mod address;
pub mod answer;
pub mod array;
pub mod client;
pub mod convention;
mod link;
pub mod metadata;
pub mod observation;
pub mod refusal;
mod retry;

pub use address::Address;
pub use answer::Answer;
pub use client::{ApiKey, Client, Counters, Failure, Settings};
pub use convention::Conventions;
pub use metadata::Metadata;
pub use observation::{Image, Observation, libero_state};
pub use refusal::Refusal;

// The example of the page is compiled with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../docs/openpi.md")]
struct Page;
