//! Whether what a process holds grows.

use super::Sample;

/// Memory may be so much more at the end, KiB: allocators keep some.
const RESIDENT_KIB: u64 = 2048;
/// And so much more with each second of the trace, KiB: an MCAP file ends with
/// the index of its chunks, which the recorder keeps until then. It writes two
/// to three chunks a second.
const INDEX_KIB_A_SECOND: u64 = 2;

/// A figure of a sample.
type Figure = fn(&Sample) -> u64;

/// What grew from the first half of the samples to the second; they were all
/// taken in the same situation. Numbers of files and threads must not rise at
/// all; memory by no more than the trace's index and an allocator's play.
#[must_use]
pub fn grown(samples: &[Sample]) -> Vec<String> {
    let (before, after) = samples.split_at(samples.len() / 2);
    let most = |of: Figure, half: &[Sample]| half.iter().map(of).max().unwrap_or(0);
    let lasted = |of: &[Sample]| Some(of.last()?.at.saturating_sub(of.first()?.at).as_secs());
    let index = INDEX_KIB_A_SECOND * lasted(samples).unwrap_or(0);
    let figures: [(&str, Figure, u64); 4] = [
        ("KiB resident", |s| s.resident_kib, RESIDENT_KIB + index),
        ("open files", |s| s.open_files, 0),
        ("threads", |s| s.threads, 0),
        ("files of the instance", |s| s.instance_files, 0),
    ];
    let mut grown = Vec::new();
    for (what, of, play) in figures {
        let (first, second) = (most(of, before), most(of, after));
        if second > first + play {
            grown.push(format!("{first} {what} became {second}"));
        }
    }
    grown
}

#[cfg(test)]
mod tests {
    use super::*;

    type Leak = fn(u64, &mut Sample);

    fn samples(change: impl Fn(u64, &mut Sample)) -> Vec<Sample> {
        let steady = Sample {
            resident_kib: 90_000,
            open_files: 60,
            threads: 3,
            instance_files: 20,
            ..Sample::default()
        };
        (0..10)
            .map(|i| {
                let mut sample = steady;
                change(i, &mut sample);
                sample
            })
            .collect()
    }

    #[test]
    fn what_stays_or_wavers_has_not_grown() {
        assert_eq!(grown(&samples(|_, _| {})), Vec::<String>::new());
        let wavers = |i, s: &mut Sample| {
            s.open_files += i % 2;
            s.resident_kib += 300 * (i % 3);
            s.trace_mib = 10 * i;
        };
        assert_eq!(grown(&samples(wavers)), Vec::<String>::new());
    }

    #[test]
    fn each_leak_is_named() {
        let leaks: [(&str, Leak); 4] = [
            ("resident", |i, s| s.resident_kib += 500 * i),
            ("open files", |i, s| s.open_files += i / 4),
            ("threads", |i, s| s.threads += i / 6),
            ("files of the instance", |i, s| s.instance_files += i),
        ];
        for (name, leak) in leaks {
            let grown = grown(&samples(leak));
            assert_eq!(grown.len(), 1, "{name}: {grown:?}");
            assert!(grown[0].contains(name), "{grown:?}");
        }
    }
}
