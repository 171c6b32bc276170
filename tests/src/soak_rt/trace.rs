//! Whether a trace holds every tick that the controller made.

use std::path::Path;

use fitmac_rt::trace::{ReadError, Record, TraceReader};

/// What a trace holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Kept {
    /// Ticks.
    pub ticks: u64,
    /// Ticks that are missing between those, by their numbers.
    pub missing: u64,
    /// Where it is damaged, if it is.
    pub damage: Option<String>,
}

/// Reads a trace to its end.
///
/// # Errors
/// If it is none.
pub fn kept(trace: &Path) -> Result<Kept, ReadError> {
    let mut reader = TraceReader::open(trace)?;
    let (mut kept, mut last) = (Kept::default(), 0);
    for record in reader.by_ref() {
        if let Record::Tick(tick) = record {
            kept.ticks += 1;
            kept.missing += (tick.head.tick - last).saturating_sub(1);
            last = tick.head.tick;
        }
    }
    kept.damage = reader.damage().map(ToString::to_string);
    Ok(kept)
}

/// A count in what the controller says at its end: `counted ticks 12, overruns 0`.
#[must_use]
pub fn count(said: &str, name: &str) -> Option<u64> {
    let line = said.lines().find_map(|line| line.strip_prefix("counted"))?;
    line.split(',').find_map(|pair| {
        let (found, value) = pair.trim().split_once(' ')?;
        (found == name).then(|| value.trim().parse().ok())?
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_found_by_name() {
        let said = "wake-up p50 1 us\ncounted           ticks 120, overruns 3, unrecorded_ticks 0";
        assert_eq!(count(said, "ticks"), Some(120));
        assert_eq!(count(said, "unrecorded_ticks"), Some(0));
        assert_eq!(count(said, "nonsense"), None);
        assert_eq!(count("", "ticks"), None);
    }
}
