//! Exit statuses.

use std::process::ExitCode;

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exit {
    /// Done.
    Done = 0,
    /// Ran to its end, but the answer is no.
    Negative = 1,
    /// Wrong usage: an argument, a configuration or an input file.
    Usage = 2,
    /// The machine or another process got in the way.
    Trouble = 3,
    /// The user asked us to end.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// What the user gave is wrong; the text names the field and the remedy.
///
/// Return it as an error, or add it as context, to end with [`Exit::Usage`].
#[derive(Debug)]
pub(crate) struct BadInput(pub(crate) String);

impl std::fmt::Display for BadInput {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for BadInput {}

/// The status for an error.
pub(crate) fn status_of(error: &anyhow::Error) -> Exit {
    if error.downcast_ref::<BadInput>().is_some() {
        Exit::Usage
    } else {
        Exit::Trouble
    }
}

#[cfg(test)]
mod tests {
    use anyhow::Context as _;

    use super::*;

    #[test]
    fn bad_input_is_found_beneath_and_as_context() {
        let beneath = Err::<(), _>(BadInput("rate".into()))
            .context("config.toml")
            .unwrap_err();
        let above = Err::<(), _>(std::fmt::Error)
            .context(BadInput("x".into()))
            .unwrap_err();
        assert_eq!(status_of(&beneath), Exit::Usage);
        assert_eq!(status_of(&above), Exit::Usage);
        assert_eq!(status_of(&std::fmt::Error.into()), Exit::Trouble);
    }
}
