//! A MuJoCo Panda, scenes, surrogate policies and episodes.
//!
//! Everything here runs on simulated time and from seeds: no clock, no transport, no threads of
//! its own. The processes that put a [`sim::Sim`] or a [`backbone::Backbone`] on shared memory
//! live elsewhere, and so does the evaluation's command line.
//!
//! Frames and units: SI; positions in the robot's base frame (Panda link 0); quaternions
//! (w, x, y, z), unit, Hamilton; the end effector is the tool centre point between the finger
//! pads, 0.1034 m beyond the hand's flange.

pub mod action;
pub mod agents;
pub mod alone;
pub mod backbone;
pub mod error;
pub mod evaluation;
mod geometry;
pub mod grasp;
pub mod grounding;
pub mod lockstep;
pub mod object;
pub mod osc;
pub mod panda;
pub mod perception;
pub mod perturb;
pub mod picture;
pub mod plot;
pub mod pose;
pub mod predicate;
pub mod raster;
pub mod scene;
pub mod sim;
pub mod suite;

pub use error::SimError;
