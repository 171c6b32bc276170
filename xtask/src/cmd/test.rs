//! `cargo xtask test`.

use std::ffi::OsString;

use anyhow::bail;

use crate::{mujoco, oracles, process, workspace::Workspace};

/// Arguments of `test`.
#[derive(clap::Args, Default)]
pub(crate) struct Args {
    /// Further arguments for `cargo test --workspace`.
    #[arg(
        trailing_var_arg = true,
        allow_hyphen_values = true,
        value_name = "ARGUMENT"
    )]
    arguments: Vec<OsString>,
}

/// Sets up everything and runs every test of the workspace.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    mujoco::install(workspace)?;
    oracles::install(workspace)?;
    process::step("Testing the workspace");
    let mut test = process::cargo(workspace);
    test.args(["test", "--workspace", "--locked", "--no-fail-fast"])
        .args(&args.arguments);
    let mut total = Tally::default();
    let green = process::run_observed(&mut test, |line| total.read(line))?;
    println!(
        "cargo xtask test: {} passed, {} failed, {} ignored in {} test programs",
        total.passed, total.failed, total.ignored, total.programs
    );
    if !green {
        bail!("tests failed: the first `failures:` section above says which");
    }
    Ok(())
}

/// Sums the closing lines of the test programs.
#[derive(Default, Debug, PartialEq)]
struct Tally {
    programs: u64,
    passed: u64,
    failed: u64,
    ignored: u64,
}

impl Tally {
    /// Reads `test result: ok. 3 passed; 0 failed; 1 ignored; ...`.
    fn read(&mut self, line: &str) {
        let Some(counts) = line.strip_prefix("test result: ") else {
            return;
        };
        let words: Vec<&str> = counts.split([' ', ';']).filter(|w| !w.is_empty()).collect();
        let count = |name: &str| {
            let at = words.iter().position(|word| *word == name);
            let number = at.and_then(|at| words.get(at.wrapping_sub(1)));
            number
                .and_then(|number| number.parse::<u64>().ok())
                .unwrap_or(0)
        };
        self.programs += 1;
        self.passed += count("passed");
        self.failed += count("failed");
        self.ignored += count("ignored");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closing_lines_are_summed_and_other_lines_are_not() {
        let mut tally = Tally::default();
        tally.read("test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out");
        tally.read("test foo::passed ... ok");
        tally.read("test result: FAILED. 3 passed; 2 failed; 0 ignored; 0 measured");
        let expected = Tally {
            programs: 2,
            passed: 15,
            failed: 2,
            ignored: 1,
        };
        assert_eq!(tally, expected);
    }
}
