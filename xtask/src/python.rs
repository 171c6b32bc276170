//! Python: pip brings MuJoCo and the test oracles.

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::bail;

use crate::process;

const INSTALL: &str =
    "install it (Debian, Ubuntu: `apt-get install python3 python3-venv python3-pip`)";

/// An interpreter that runs.
pub(crate) struct Python {
    program: PathBuf,
}

impl Python {
    /// The interpreter on the PATH.
    pub(crate) fn find() -> anyhow::Result<Self> {
        let python3 = |name: &&str| {
            let code = "import sys; sys.exit(sys.version_info < (3, 9))";
            succeeds(Command::new(name).args(["-c", code]))
        };
        match ["python3", "python"].iter().find(|name| python3(name)) {
            Some(name) => Ok(Self {
                program: PathBuf::from(name),
            }),
            None => bail!("Python 3.9 or newer is not on the PATH: {INSTALL} and run this again"),
        }
    }

    /// The interpreter of an environment made by [`Self::create_environment`].
    pub(crate) fn of_environment(environment: &Path) -> Self {
        Self {
            program: environment.join("bin/python"),
        }
    }

    /// Checks that pip is there.
    pub(crate) fn require_pip(&self) -> anyhow::Result<()> {
        if !succeeds(
            self.command(["-m", "pip", "--version"])
                .env("PIP_QUIET", "1"),
        ) {
            bail!("Python is here but its pip is not: {INSTALL} and run this again");
        }
        Ok(())
    }

    /// Checks that virtual environments can be made.
    pub(crate) fn require_venv(&self) -> anyhow::Result<()> {
        if !succeeds(&mut self.command(["-c", "import venv, ensurepip"])) {
            bail!("Python is here but its venv module is not: {INSTALL} and run this again");
        }
        Ok(())
    }

    /// Makes an empty virtual environment, in place of one that is there.
    pub(crate) fn create_environment(&self, environment: &Path) -> anyhow::Result<()> {
        self.require_venv()?;
        let mut command = self.command(["-m", "venv", "--clear"]);
        process::run(command.arg(environment).stdout(process::to_stderr()))
    }

    /// Runs pip; progress and warnings go to standard error. Tells whether it
    /// succeeded.
    pub(crate) fn pip<S: AsRef<OsStr>>(
        &self,
        arguments: impl IntoIterator<Item = S>,
    ) -> anyhow::Result<bool> {
        let mut command = self.command(["-m", "pip", "--disable-pip-version-check"]);
        command.args(arguments).stdout(process::to_stderr());
        Ok(command.status()?.success())
    }

    /// A command that starts the interpreter with these arguments.
    pub(crate) fn command<const N: usize>(&self, arguments: [&str; N]) -> Command {
        let mut command = Command::new(&self.program);
        command.args(arguments).stdin(Stdio::null());
        command
    }
}

fn succeeds(command: &mut Command) -> bool {
    let quiet = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    quiet.status().is_ok_and(|status| status.success())
}
