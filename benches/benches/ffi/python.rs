//! The loop in Python: the package as pip installs it, in an interpreter that waits for a line
//! before each run.

use std::{
    fs,
    io::{BufRead, BufReader, Write},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
};

use anyhow::{Context, bail, ensure};
use fitmac_benches::peers;

/// An interpreter with the inputs read.
pub(crate) struct Host {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
}

impl Host {
    /// Installs the package and starts the interpreter.
    pub(crate) fn start(inputs: &[u8]) -> anyhow::Result<Self> {
        let packages = peers::python_package()?;
        let recording = peers::folder().join("ffi-inputs");
        fs::write(&recording, inputs).context("the inputs cannot be written")?;
        let mut command = Command::new(peers::python()?);
        command.arg(peers::source("ffi_loop.py")).arg(&recording);
        command.env("PYTHONPATH", packages);
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().context("Python cannot be started")?;
        let (Some(to), Some(from)) = (child.stdin.take(), child.stdout.take()) else {
            bail!("Python has no pipes");
        };
        let mut host = Self {
            child,
            to,
            from: BufReader::new(from),
        };
        ensure!(host.line()? == "ready", "Python did not read the inputs");
        Ok(host)
    }

    /// Runs through the inputs once, from the start.
    pub(crate) fn run(&mut self) {
        let said = writeln!(self.to, "go")
            .and_then(|()| self.to.flush())
            .map_err(anyhow::Error::from)
            .and_then(|()| self.line());
        assert!(
            said.is_ok_and(|said| said == "done"),
            "the loop in Python failed"
        );
    }

    fn line(&mut self) -> anyhow::Result<String> {
        let mut line = String::new();
        self.from.read_line(&mut line)?;
        Ok(line.trim().to_owned())
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
