//! The FIT-MAC decision core: runtime assurance for a robot that runs a
//! vision-language-action (VLA) policy.
//!
//! The core sits between the policy and the robot. [`Controller::tick`] takes
//! the time and whatever arrived since the last tick, and answers with exactly
//! one command. It never reads a clock, never allocates and never fails: bad
//! input is a diagnosis, not an error.
//!
//! A policy stalls above its target; the core notices, takes the arm, and hands
//! it back when the can stands on the plate (in a toy world, without a
//! simulator; `examples/` has more, each printing its table of decisions):
//!
//! ```
//! use fitmac_core::{Params, wire::Route};
//! use fitmac_core_tests::world::{Agent, Behaviour, Policy, Scene, Session, table};
//!
//! let scene = Scene::can_to_plate();
//! let agent = Agent::knowing(&scene);
//! let policy = Policy::new(Behaviour::StallsAbove(0.05));
//! let mut session = Session::new(Params::guarded(), scene, policy, agent);
//!
//! assert!(session.run(300), "the can stands on the plate");
//! table::print(&session.queries);
//!
//! let authorised = session.queries.iter().find(|r| r.route == Route::Execution.code());
//! assert!(authorised.is_some_and(|r| r.failure_streak == 3));
//! ```
#![no_std]
#![forbid(unsafe_code)]

pub mod attempt;
pub mod clock;
mod controller;
pub mod decide;
pub mod diagnosis;
pub mod evidence;
pub mod filter;
pub mod gate;
pub mod intake;
pub mod ladder;
pub mod lock;
pub mod message;
pub mod monitor;
pub mod oscillation;
pub mod params;
pub mod phase;
pub mod queue;
pub mod reason;
pub mod recovery;
pub mod route;
pub mod shaping;
pub mod signals;
#[cfg(test)]
mod stand;
pub mod subtask;
pub mod trace;
pub mod tracking;
pub mod turn;
pub mod verdicts;
pub mod wire;

pub use controller::{Controller, State};
pub use params::{Params, ValidParams};
