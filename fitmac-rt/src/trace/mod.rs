//! The trace: what the core was told and what it answered, tick by tick, in an
//! MCAP file with protobuf channels that Foxglove, Rerun and PlotJuggler open.
//!
//! | topic | message | rate |
//! |---|---|---|
//! | `/tick` | [`TickHead`](crate::frame::TickHead) | each tick, first of its messages |
//! | `/state`, `/chunk`, `/grounding`, `/plan`, `/verifier`, `/critic` | what the core was given | as they came |
//! | `/command` | what it commanded | each tick |
//! | `/query`, `/rebind` | what it asked for | as asked |
//! | `/trace` | what it decided | one a query |
//! | `/event` | refusals and changes of mode | as they happen |
//! | `/prompt`, `/status` | texts; health and counters | as sent; 10 Hz |
//! | `/model_call` | what a model was asked, how long it took, what came of it | as they end |
//! | `/tf`, `/scene`, `/log` | Foxglove's own: frames, shapes, messages | 25 Hz; each change of decision |
//!
//! All rows but the last three, in the order of the file, are all that a replay needs.
//! Times are nanoseconds of the monotonic clock: viewers show dates of 1970.

pub mod codec;
pub mod schema;

mod black_box;
mod csv;
mod reader;
mod scene;
mod topic;
mod writer;

pub use black_box::BlackBox;
pub use csv::write_csv;
pub use reader::{Damage, ReadError, Record, TraceReader};
pub use topic::layout_of;
pub use writer::{Metadata, TraceFile, TraceWriter};

/// A layout for Foxglove that shows a trace's topics.
pub const FOXGLOVE_LAYOUT: &str = include_str!("foxglove-layout.json");
