//! The C interface of the FIT-MAC decision core (`include/fitmac.h`).
//!
//! Everything lives in memory of the caller; nothing is allocated. Every
//! function answers with a [`Status`]; none unwinds into the caller. What the
//! interface checks: NULL, alignment, size, version of the interface, memory
//! that holds no such object, a second thread or a re-entry, a fork, and the
//! floating-point state of the host. What it cannot check: that memory is
//! readable at all, and that the host leaves an object's bytes alone.
#![allow(unsafe_code)]

mod config;
mod controller;
mod file;
mod float;
mod fork;
mod memory;
mod name;
mod status;
mod tick;

pub use config::{
    Config, FITMAC_CONFIG_STORAGE, fitmac_config_alignment, fitmac_config_check,
    fitmac_config_init, fitmac_config_parse, fitmac_config_set, fitmac_config_size,
};
pub use controller::{
    Controller, FITMAC_CONTROLLER_STORAGE, FITMAC_SNAPSHOT_STORAGE, Snapshot,
    fitmac_controller_alignment, fitmac_controller_deinit, fitmac_controller_init,
    fitmac_controller_size, fitmac_reset, fitmac_restore, fitmac_snapshot_alignment,
    fitmac_snapshot_size, fitmac_take_snapshot,
};
pub use float::{
    FITMAC_FLOAT_DENORMALS_ZERO, FITMAC_FLOAT_FLUSH_TO_ZERO, FITMAC_FLOAT_ROUNDING,
    FITMAC_FLOAT_TRAPS, fitmac_float_state,
};
pub use name::{Vocabulary, fitmac_name};
pub use status::{Status, fitmac_status_text};
pub use tick::{Input, Output, fitmac_tick};

/// Version of this interface. A caller hands over the one that it was compiled
/// with; another one is refused.
pub const FITMAC_ABI_VERSION: u32 = 1;

/// The version of the interface that the library speaks: `FITMAC_ABI_VERSION`
/// of the header that it was built with.
#[unsafe(no_mangle)]
pub extern "C" fn fitmac_abi_version() -> u32 {
    FITMAC_ABI_VERSION
}

/// The version of the library, as text like `0.1.0`.
#[unsafe(no_mangle)]
pub extern "C" fn fitmac_version() -> *const core::ffi::c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}
