//! FIT-MAC's processes: shared-memory services, the real-time loop, watchdogs
//! and the recorder.
//!
//! The only crate that reads a clock. What is decided is decided in
//! [`fitmac_core`]; this crate carries messages to it, in time, and records
//! what happened.
//!
//! This is not a safety function: the stops of ISO 10218-1 stay in the robot's
//! own controller. A stop of ours is a request to it.

pub mod clock;
pub mod config;
pub mod control_loop;
pub mod counters;
pub mod cycle;
pub mod diff;
pub mod endpoint;
pub mod envelope;
pub mod frame;
pub mod histogram;
pub mod instance;
pub mod layout;
pub mod message;
pub mod port;
pub mod realtime;
pub mod replay;
pub mod ring;
pub mod roles;
mod room;
pub mod service;
pub mod signals;
pub mod telemetry;
pub mod trace;
pub mod transport;
