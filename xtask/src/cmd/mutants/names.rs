//! What a mutant is called, and how it is found again once lines have moved.

use std::{fs, path::Path};

use crate::lists::{self, Exception};

/// Where the core's source is.
pub(super) const SOURCE: &str = "fitmac-core/src/";

/// A mutant as cargo-mutants names it: `fitmac-core/src/gate.rs:26:9: replace ...`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Mutant {
    file: String,
    line: usize,
    column: usize,
    change: String,
    /// Line and column behind the text that is replaced, from 1.
    end: (usize, usize),
    /// What stands there instead.
    replacement: String,
}

impl Mutant {
    /// Reads an entry of the list that `cargo mutants --list --json` prints.
    pub(super) fn read(entry: &serde_json::Value) -> Option<Self> {
        let (place, change) = entry.get("name")?.as_str()?.split_once(": ")?;
        let mut parts = place.rsplitn(3, ':');
        let column = parts.next()?.parse().ok()?;
        let line = parts.next()?.parse().ok()?;
        let end = entry.get("span")?.get("end")?;
        let number = |key: &str| usize::try_from(end.get(key)?.as_u64()?).ok();
        Some(Self {
            file: parts.next()?.to_owned(),
            line,
            column,
            change: change.trim_end().to_owned(),
            end: (number("line")?, number("column")?),
            replacement: entry.get("replacement")?.as_str()?.to_owned(),
        })
    }

    /// The file's text with the change made.
    pub(super) fn apply(&self, text: &str) -> Option<String> {
        let from = offset(text, (self.line, self.column))?;
        let to = offset(text, self.end)?;
        let (before, behind) = (text.get(..from)?, text.get(to.max(from)..)?);
        Some(format!("{before}{}{behind}", self.replacement))
    }

    /// The name again.
    pub(super) fn name(&self) -> String {
        let Self {
            file,
            line,
            column,
            change,
            ..
        } = self;
        format!("{file}:{line}:{column}: {change}")
    }

    /// The file, from the workspace's root.
    pub(super) fn file(&self) -> &str {
        &self.file
    }

    /// The file below the core's source.
    pub(super) fn short_file(&self) -> &str {
        short(&self.file)
    }

    /// It and the text of its line in the checkout.
    pub(super) fn site(&self, root: &Path) -> Site<'_> {
        let text = fs::read_to_string(root.join(&self.file)).unwrap_or_default();
        let line = text.lines().nth(self.line.saturating_sub(1));
        Site {
            mutant: self,
            line: line.unwrap_or_default().trim().to_owned(),
        }
    }
}

/// The byte at this line and column, both from 1.
fn offset(text: &str, (line, column): (usize, usize)) -> Option<usize> {
    let mut start = 0;
    for _ in 1..line {
        start += text.get(start..)?.find('\n')? + 1;
    }
    let rest = text.get(start..)?.char_indices().map(|(at, _)| at);
    let mut places = rest.chain([text.len() - start]);
    Some(start + places.nth(column.checked_sub(1)?)?)
}

/// A file below the core's source.
pub(super) fn short(file: &str) -> &str {
    file.strip_prefix(SOURCE).unwrap_or(file)
}

/// A mutant and the text of its line.
pub(super) struct Site<'a> {
    pub(super) mutant: &'a Mutant,
    line: String,
}

impl Site<'_> {
    /// What finds it again.
    pub(super) fn key(&self) -> Key {
        Key {
            line: self.line.clone(),
            mutant: format!("{}: {}", self.mutant.column, self.mutant.change),
        }
    }

    /// Whether this entry of the list is its own.
    pub(super) fn is_explained_by(&self, entry: &Exception) -> bool {
        self.key().is(self.mutant.short_file(), entry)
    }

    /// Its entry without a reason.
    pub(super) fn draft(&self) -> String {
        self.key().draft(self.mutant.short_file())
    }
}

/// What finds a mutant again in its file: the text of its line, and column and change.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    pub(super) line: String,
    pub(super) mutant: String,
}

impl Key {
    /// Whether this entry of the list is its own.
    pub(super) fn is(&self, short: &str, entry: &Exception) -> bool {
        entry.is_about(&format!("{SOURCE}{short}"), &self.line, &self.mutant)
    }

    /// Its entry without a reason.
    pub(super) fn draft(&self, short: &str) -> String {
        let file = format!("{SOURCE}{short}");
        lists::draft(
            "survivor",
            &file,
            &self.line,
            Some(("mutant", &self.mutant)),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mutant(name: &str, end: (usize, usize), replacement: &str) -> Option<Mutant> {
        Mutant::read(&serde_json::json!({
            "name": name,
            "span": {"end": {"line": end.0, "column": end.1}},
            "replacement": replacement,
        }))
    }

    #[test]
    fn a_name_is_read_and_written() {
        let name = "fitmac-core/src/lock.rs:49:9: replace A::b -> Result<(), C> with Ok(())";
        let mutant = mutant(name, (50, 3), "Ok(())").expect("a name");
        assert_eq!(mutant.name(), name);
        assert_eq!(mutant.short_file(), "lock.rs");
        assert_eq!((mutant.line, mutant.column), (49, 9));
        assert_eq!(Mutant::read(&serde_json::json!({"name": "ok"})), None);
    }

    #[test]
    fn a_change_is_made_where_it_belongs() {
        let text = "fn a() {\n    µ(1 + 2)\n}\n";
        let plus = mutant("a.rs:2:9: replace + with -", (2, 10), "-").expect("a name");
        assert_eq!(
            plus.apply(text).as_deref(),
            Some("fn a() {\n    µ(1 - 2)\n}\n")
        );
        let body = mutant("a.rs:1:8: replace a", (3, 2), "{}").expect("a name");
        assert_eq!(body.apply(text).as_deref(), Some("fn a() {}\n"));
        let beyond = mutant("a.rs:7:1: replace a", (7, 2), "").expect("a name");
        assert_eq!(beyond.apply(text), None);
    }
}
