//! The text of a configuration file, line by line, without an allocator.
//!
//! The part of TOML that a configuration of ours consists of: comments,
//! `[stage]` headers and `key = value` lines with numbers, `true`, `false` and
//! plain strings. Anything else is refused with its line.

use fitmac_core::params::{AssignError, Params};

use crate::status::{Outcome, Status};

/// Longest `stage.key`, bytes.
const KEY_MAX: usize = 128;

/// Reads `text` over `params`. On an error `line` says where (from 1).
pub(crate) fn read(params: &mut Params, text: &str, line: &mut u32) -> Outcome<()> {
    let mut stage = "";
    *line = 0;
    for content in text.lines() {
        *line = line.saturating_add(1);
        let content = without_comment(content).trim();
        if content.is_empty() {
            continue;
        }
        if let Some(name) = content.strip_prefix('[') {
            stage = name.strip_suffix(']').ok_or(Status::BadSyntax)?.trim();
            if !is_bare_key(stage) {
                return Err(Status::BadSyntax);
            }
            continue;
        }
        let (key, value) = content.split_once('=').ok_or(Status::BadSyntax)?;
        set(params, stage, key.trim(), value.trim())?;
    }
    *line = 0;
    Ok(())
}

fn set(params: &mut Params, stage: &str, key: &str, value: &str) -> Outcome<()> {
    if !key.split('.').all(is_bare_key) || value.is_empty() {
        return Err(Status::BadSyntax);
    }
    let value = match value.strip_prefix('"') {
        Some(rest) => rest
            .strip_suffix('"')
            .filter(|inner| !inner.contains(['"', '\\']))
            .ok_or(Status::BadSyntax)?,
        None => value,
    };
    if stage.is_empty() && key == "profile" {
        *params = profile(value)?;
        return Ok(());
    }
    let mut buffer = [0; KEY_MAX];
    let key = join(&mut buffer, stage, key).ok_or(Status::UnknownKey)?;
    params.assign(key, value).map_err(refused)
}

/// The parameters that a profile's name stands for.
pub(crate) fn profile(name: &str) -> Outcome<Params> {
    match name {
        "guarded" => Ok(Params::guarded()),
        "paper" => Ok(Params::paper()),
        _ => Err(Status::UnknownKey),
    }
}

pub(crate) const fn refused(error: AssignError) -> Status {
    match error {
        AssignError::UnknownKey => Status::UnknownKey,
        AssignError::NotAValue => Status::BadValue,
    }
}

/// No value of ours holds a `#`.
fn without_comment(line: &str) -> &str {
    line.split_once('#').map_or(line, |(content, _)| content)
}

fn is_bare_key(key: &str) -> bool {
    let bare = |b: u8| b.is_ascii_alphanumeric() || b == b'_' || b == b'-';
    !key.is_empty() && key.bytes().all(bare)
}

fn join<'a>(buffer: &'a mut [u8; KEY_MAX], stage: &str, key: &str) -> Option<&'a str> {
    let dot = if stage.is_empty() { "" } else { "." };
    let mut end = 0;
    for part in [stage, dot, key] {
        let next = end + part.len();
        buffer.get_mut(end..next)?.copy_from_slice(part.as_bytes());
        end = next;
    }
    core::str::from_utf8(buffer.get(..end)?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Params, (Status, u32)> {
        let (mut params, mut line) = (Params::guarded(), 0);
        read(&mut params, text, &mut line).map_err(|status| (status, line))?;
        Ok(params)
    }

    #[test]
    fn a_file_changes_what_it_names() {
        let text = "# ours\nprofile = \"paper\"\r\nout_of_range = \"refuse\" # strict\n\n\
                    [gate]\nfailure_streak = 2\nconfidence=0.2\n[switches]\nhard_pick = false\n";
        let mut expected = Params::paper();
        expected.out_of_range = fitmac_core::params::OutOfRange::Refuse;
        expected.gate.failure_streak = 2;
        expected.gate.confidence = 0.2;
        expected.switches.hard_pick = false;
        assert_eq!(parse(text), Ok(expected));
        assert_eq!(parse(""), Ok(Params::guarded()));
        assert_eq!(
            parse("gate.failure_streak = 2").map(|p| p.gate.failure_streak),
            Ok(2)
        );
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        for (text, expected) in [
            ("[gate]\nfailure_streek = 2", (Status::UnknownKey, 2)),
            ("[gate]\nfailure_streak = two", (Status::BadValue, 2)),
            ("\n[gate", (Status::BadSyntax, 2)),
            ("[[gate]]", (Status::BadSyntax, 1)),
            ("[]", (Status::BadSyntax, 1)),
            ("gate", (Status::BadSyntax, 1)),
            ("gate =", (Status::BadSyntax, 1)),
            ("= 2", (Status::BadSyntax, 1)),
            ("gate = { failure_streak = 2 }", (Status::UnknownKey, 1)),
            ("profile = \"pap\\u0065r\"", (Status::BadSyntax, 1)),
            ("profile = \"brave\"", (Status::UnknownKey, 1)),
        ] {
            assert_eq!(parse(text), Err(expected), "{text}");
        }
        let long = "k".repeat(KEY_MAX);
        assert_eq!(
            parse(&format!("[gate]\n{long} = 1")),
            Err((Status::UnknownKey, 2))
        );
    }
}
