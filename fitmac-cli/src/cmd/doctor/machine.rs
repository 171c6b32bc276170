//! What the kernel says of the machine.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// The machine, read through its `/proc`, `/sys` and `/dev`.
pub(super) struct Machine {
    root: PathBuf,
}

/// A limit of this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Limit {
    Value(u64),
    Unlimited,
}

impl Limit {
    /// Whether it allows this much.
    pub(super) fn allows(self, wanted: u64) -> bool {
        match self {
            Self::Value(value) => value >= wanted,
            Self::Unlimited => true,
        }
    }
}

impl Machine {
    /// The machine that we run on.
    pub(super) fn this() -> Self {
        Self::at(Path::new("/"))
    }

    /// A machine whose kernel's files lie under a folder.
    pub(super) fn at(root: &Path) -> Self {
        Self {
            root: root.to_path_buf(),
        }
    }

    /// A file's text without the last newline; `None` if it is absent.
    pub(super) fn text(&self, path: &str) -> Option<String> {
        let text = fs::read_to_string(self.root.join(path)).ok()?;
        Some(text.trim_end().to_owned())
    }

    /// A path on the machine.
    pub(super) fn path(&self, path: &str) -> PathBuf {
        self.root.join(path)
    }

    /// Whether this process holds a capability, by its number in capabilities(7).
    pub(super) fn has_capability(&self, number: u32) -> bool {
        let mask = self
            .status("CapEff")
            .and_then(|hex| u64::from_str_radix(&hex, 16).ok());
        mask.is_some_and(|mask| mask >> number & 1 == 1)
    }

    /// A field of this process's status.
    pub(super) fn status(&self, field: &str) -> Option<String> {
        let text = self.text("proc/self/status")?;
        let line = text
            .lines()
            .find_map(|line| line.strip_prefix(field)?.strip_prefix(':'))?;
        Some(line.trim().to_owned())
    }

    /// The soft limit of this process with that name in `/proc/self/limits`.
    pub(super) fn limit(&self, name: &str) -> Option<Limit> {
        let text = self.text("proc/self/limits")?;
        let line = text.lines().find_map(|line| line.strip_prefix(name))?;
        match line.split_whitespace().next()? {
            "unlimited" => Some(Limit::Unlimited),
            number => number.parse().ok().map(Limit::Value),
        }
    }

    /// The cores that this process may run on.
    pub(super) fn allowed_cores(&self) -> Vec<u32> {
        let list = self.status("Cpus_allowed_list").unwrap_or_default();
        parse_core_list(&list)
    }
}

/// Reads the kernel's list format, `0-2,5`.
pub(super) fn parse_core_list(list: &str) -> Vec<u32> {
    let range = |part: &str| -> Option<std::ops::RangeInclusive<u32>> {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        Some(first.trim().parse().ok()?..=last.trim().parse().ok()?)
    };
    list.split(',').filter_map(range).flatten().collect()
}
