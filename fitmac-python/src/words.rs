//! The words for codes and bits.

use fitmac_core::{evidence, intake::Refusal, reason, wire};
use pyo3::prelude::*;

type Words = Vec<(u32, &'static str)>;
type Bits = Vec<(u64, &'static str)>;

/// Every vocabulary with its codes and their names.
#[pyfunction]
pub(crate) fn vocabularies() -> Vec<(&'static str, Words)> {
    macro_rules! of {
        ($($name:ident),+) => {
            vec![$((
                stringify!($name),
                wire::$name::ALL.iter().map(|m| (u32::from(m.code()), m.name())).collect(),
            )),+]
        };
    }
    let mut all: Vec<(&'static str, Words)> = of!(
        ActionSpace,
        ActionFrame,
        GripperConvention,
        GraspClass,
        DestinationKind,
        PlaceRelation,
        Provenance,
        Verdict,
        CriticLabel,
        Request,
        Phase,
        Diagnosis,
        Route,
        Mode,
        SubPhase,
        EventKind
    );
    let refusals = Refusal::ALL.iter().map(|r| (r.code(), r.name()));
    all.push(("Refusal", refusals.collect()));
    all
}

/// The named bits of reasons and of evidence.
#[pyfunction]
pub(crate) fn bits() -> (Bits, Bits) {
    (reason::ALL.to_vec(), evidence::ALL.to_vec())
}
