//! Child processes.

use std::{
    ffi::OsString,
    io::{self, BufRead, BufReader, Write},
    os::{fd::AsFd, unix::process::CommandExt},
    process::{Command, Stdio},
};

use anyhow::{Context, bail};

use crate::workspace::Workspace;

/// Says on standard error what comes next: standard output belongs to the
/// program that a command runs.
pub(crate) fn step(what: &str) {
    eprintln!("==> {what}");
}

/// A cargo command in the workspace.
pub(crate) fn cargo(workspace: &Workspace) -> Command {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo"));
    let mut command = Command::new(program);
    command.current_dir(workspace.root());
    command
}

/// Runs a command to its end.
pub(crate) fn run(command: &mut Command) -> anyhow::Result<()> {
    let status = command.status().with_context(|| not_started(command))?;
    if !status.success() {
        bail!("`{}` failed ({status})", shown(command));
    }
    Ok(())
}

/// Becomes the command: signals and the exit status are then its own.
pub(crate) fn become_command(command: &mut Command) -> anyhow::Result<()> {
    let error = command.exec();
    Err(anyhow::Error::new(error).context(not_started(command)))
}

/// Runs a command, passes its standard output on line by line as it comes, and
/// shows each line to `observe`. Tells whether it succeeded.
pub(crate) fn run_observed(
    command: &mut Command,
    mut observe: impl FnMut(&str),
) -> anyhow::Result<bool> {
    let mut child = command
        .stdout(Stdio::piped())
        .spawn()
        .with_context(|| not_started(command))?;
    if let Some(stdout) = child.stdout.take() {
        let mut out = io::stdout().lock();
        for line in BufReader::new(stdout).split(b'\n') {
            let line = line.context("reading the command's output")?;
            let text = String::from_utf8_lossy(&line);
            observe(&text);
            writeln!(out, "{text}").context("writing to standard output")?;
        }
    }
    Ok(child
        .wait()
        .context("waiting for the command's end")?
        .success())
}

/// Our standard error, as the standard output of a child whose chatter must
/// not mix with a result.
pub(crate) fn to_stderr() -> Stdio {
    match io::stderr().as_fd().try_clone_to_owned() {
        Ok(fd) => fd.into(),
        Err(_) => Stdio::null(),
    }
}

fn not_started(command: &Command) -> String {
    format!("`{}` could not be started", shown(command))
}

fn shown(command: &Command) -> String {
    let mut text = command.get_program().to_string_lossy().into_owned();
    for argument in command.get_args() {
        text.push(' ');
        text.push_str(&argument.to_string_lossy());
    }
    text
}
