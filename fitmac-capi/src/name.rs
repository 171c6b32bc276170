//! Names of the codes and bits that messages carry.

use core::{ffi::c_char, fmt::Write as _};

use fitmac_core::{evidence, intake::Refusal, reason, wire};

use crate::{memory::TextOut, status::Status};

/// What a code is a member of.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vocabulary {
    /// `FITMAC_MODE_*`.
    Mode = 0,
    /// `FITMAC_ROUTE_*`.
    Route = 1,
    /// `FITMAC_PHASE_*`.
    Phase = 2,
    /// `FITMAC_SUB_PHASE_*`.
    SubPhase = 3,
    /// `FITMAC_DIAGNOSIS_*`.
    Diagnosis = 4,
    /// `FITMAC_EVENT_KIND_*`.
    EventKind = 5,
    /// `FITMAC_VERDICT_*`.
    Verdict = 6,
    /// The number of a bit of `FITMAC_REASON_*`: 0 to 63.
    Reason = 7,
    /// The number of a bit of `FITMAC_EVIDENCE_*`: 0 to 63.
    Evidence = 8,
    /// `detail` of a record of a refused message.
    Refusal = 9,
}

/// Writes the name of `code`, a member of `vocabulary` (`FITMAC_VOCABULARY_*`), as
/// traces and tables show it; at most `size` bytes with the NUL.
///
/// # Safety
/// `name` has room for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fitmac_name(
    vocabulary: u32,
    code: u32,
    name: *mut c_char,
    size: usize,
) -> Status {
    // SAFETY: promised.
    let mut out = unsafe { TextOut::new(name, size) };
    if name.is_null() {
        return Status::NullPointer;
    }
    match text_of(vocabulary, code) {
        // A text that is cut is no failure.
        Some(text) => out
            .write_str(text)
            .map_or(Status::WrongSize, |()| Status::Ok),
        None => Status::UnknownKey,
    }
}

fn text_of(vocabulary: u32, code: u32) -> Option<&'static str> {
    macro_rules! member {
        ($name:ident) => {
            wire::$name::try_from(u8::try_from(code).ok()?).ok()?.name()
        };
    }
    Some(match vocabulary {
        v if v == Vocabulary::Mode as u32 => member!(Mode),
        v if v == Vocabulary::Route as u32 => member!(Route),
        v if v == Vocabulary::Phase as u32 => member!(Phase),
        v if v == Vocabulary::SubPhase as u32 => member!(SubPhase),
        v if v == Vocabulary::Diagnosis as u32 => member!(Diagnosis),
        v if v == Vocabulary::EventKind as u32 => member!(EventKind),
        v if v == Vocabulary::Verdict as u32 => member!(Verdict),
        v if v == Vocabulary::Reason as u32 => bit(reason::ALL, code)?,
        v if v == Vocabulary::Evidence as u32 => bit(evidence::ALL, code)?,
        v if v == Vocabulary::Refusal as u32 => {
            Refusal::ALL.iter().find(|r| r.code() == code)?.name()
        }
        _ => return None,
    })
}

fn bit(all: &[(u64, &'static str)], number: u32) -> Option<&'static str> {
    let bit = 1_u64.checked_shl(number)?;
    all.iter().find(|(b, _)| *b == bit).map(|&(_, name)| name)
}
