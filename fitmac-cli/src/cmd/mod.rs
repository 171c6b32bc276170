//! The commands, one a file.

pub(crate) mod agents;
pub(crate) mod arm;
pub(crate) mod config;
pub(crate) mod demo;
pub(crate) mod doctor;
pub(crate) mod eval;
pub(crate) mod fk;
pub(crate) mod ground;
pub(crate) mod ik;
pub(crate) mod otg;
pub(crate) mod plan;
pub(crate) mod replay;
pub(crate) mod report;
pub(crate) mod rt;
pub(crate) mod sim;
pub(crate) mod trace;
pub(crate) mod vla;

/// Keeps this process off the core that a controller takes by default, where
/// there is another one.
fn leave_control_core() {
    if let Some(core) = fitmac_rt::realtime::allowed_cores().last() {
        fitmac_rt::realtime::keep_off(*core);
    }
}
