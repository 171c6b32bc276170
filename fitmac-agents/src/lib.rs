//! Planner, grounder and critic: the slow side of the loop.
//!
//! Language and vision live here and never in the control path. Everything
//! works offline by rules; a language model, a vision-language model and a
//! learned detector may be added and are never trusted further than the rules
//! allow.

pub mod bind;
pub mod canvas;
pub mod critic;
pub mod detector;
pub mod grounder;
pub mod instructions;
pub mod model;
pub mod planner;
pub mod prompt;
pub mod scene;
pub mod service;
pub mod synthetic;
pub mod track;
