//! Lists of exceptions, each with its reason: tables of TOML, kept by hand.

use std::{fs, path::Path};

use anyhow::{Context, bail};

/// An exception. It names a line by its text, so that it stays true when lines above are added.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Exception {
    /// The file, from the workspace's root.
    pub(crate) file: String,
    /// The line's text, without what is blank around it.
    pub(crate) line: String,
    /// What else tells it apart.
    pub(crate) what: String,
    /// Why it may be.
    pub(crate) reason: String,
}

impl Exception {
    /// Whether it is about this.
    pub(crate) fn is_about(&self, file: &str, line: &str, what: &str) -> bool {
        self.file == file && self.line == line.trim() && self.what == what
    }
}

/// The entries `[[name]]` of a list; `what` is the key of [`Exception::what`], if there is one.
/// Every entry has a reason, and its line still stands in its file below `root`.
pub(crate) fn read(
    root: &Path,
    list: &Path,
    name: &str,
    what: Option<&str>,
) -> anyhow::Result<Vec<Exception>> {
    let text = fs::read_to_string(root.join(list))
        .with_context(|| format!("{} cannot be read", list.display()))?;
    let table: toml::Table = text
        .parse()
        .with_context(|| format!("{} is no TOML", list.display()))?;
    let mut entries = Vec::new();
    for entry in table
        .get(name)
        .and_then(toml::Value::as_array)
        .into_iter()
        .flatten()
    {
        let field = |key: &str| {
            let value = entry.get(key).and_then(toml::Value::as_str);
            let value = value.unwrap_or_default().trim();
            if value.is_empty() {
                bail!("{}: an entry has no `{key}`: {entry}", list.display());
            }
            Ok(value.to_owned())
        };
        let entry = Exception {
            file: field("file")?,
            line: field("line")?,
            what: what.map_or_else(|| Ok(String::new()), field)?,
            reason: field("reason")?,
        };
        let source = fs::read_to_string(root.join(&entry.file))
            .with_context(|| format!("{} names {}", list.display(), entry.file))?;
        if !source.lines().any(|line| line.trim() == entry.line) {
            bail!(
                "{}: the line `{}` is not in {} any more: remove the entry, or correct it",
                list.display(),
                entry.line,
                entry.file
            );
        }
        entries.push(entry);
    }
    Ok(entries)
}

/// An entry as a person pastes it into the list, without its reason.
pub(crate) fn draft(name: &str, file: &str, line: &str, what: Option<(&str, &str)>) -> String {
    let quoted = |text: &str| toml::Value::from(text).to_string();
    let mut text = format!(
        "[[{name}]]\nfile = {}\nline = {}\n",
        quoted(file),
        quoted(line.trim())
    );
    if let Some((key, value)) = what {
        text += &format!("{key} = {}\n", quoted(value));
    }
    text + "reason = \"\"\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(text: &str) -> anyhow::Result<Vec<Exception>> {
        let root = tempfile::tempdir()?;
        fs::write(root.path().join("a.rs"), "fn a() {\n    b(\"c\");\n}\n")?;
        fs::write(root.path().join("list.toml"), text)?;
        read(root.path(), Path::new("list.toml"), "entry", Some("mutant"))
    }

    #[test]
    fn a_draft_with_a_reason_is_an_entry() {
        let draft = draft("entry", "a.rs", "    b(\"c\");", Some(("mutant", "c: d")));
        let entries = list(&draft.replace("\"\"", "\"it is so\"")).expect("sound");
        assert_eq!(entries.len(), 1);
        assert!(entries[0].is_about("a.rs", " b(\"c\"); ", "c: d"));
        assert!(!entries[0].is_about("a.rs", "b(\"c\");", "c: e"));
    }

    #[test]
    fn without_a_reason_or_its_line_it_is_refused() {
        let draft = draft("entry", "a.rs", "b(\"c\");", Some(("mutant", "c: d")));
        let complaint = list(&draft).expect_err("no reason").to_string();
        assert!(complaint.contains("no `reason`"), "{complaint}");
        let gone = draft.replace("\"\"", "\"x\"").replace("c\\\"", "d\\\"");
        let gone = gone.replace("'b(\"c\");'", "'b(\"d\");'");
        let complaint = list(&gone).expect_err("no such line").to_string();
        assert!(complaint.contains("not in a.rs any more"), "{complaint}");
    }
}
