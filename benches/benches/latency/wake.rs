//! When a thread that sleeps until a time wakes: the control loop, and
//! `cyclictest` at the same time on the same core.

use std::{
    process::{Command, Stdio},
    thread,
};

use anyhow::Context;
use fitmac_rt::clock;

use crate::{PERIOD_NS, distribution::Distribution, in_front};

/// Largest latency that `cyclictest` tells apart, us.
const LARGEST_US: u64 = 200_000;

/// What woke beside the loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beside {
    /// `cyclictest`.
    Cyclictest,
    /// A loop of our own around the same system call, where `cyclictest` is missing.
    OwnLoop,
}

impl Beside {
    /// What is there.
    pub(crate) fn found() -> Self {
        let asked = Command::new("cyclictest")
            .arg("--help")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        match asked {
            Ok(_) => Self::Cyclictest,
            Err(_) => Self::OwnLoop,
        }
    }

    /// Its name.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Cyclictest => "cyclictest",
            Self::OwnLoop => {
                "a bare clock_nanosleep loop (cyclictest is missing: install rt-tests)"
            }
        }
    }

    /// How late it woke, so many times, on this core.
    pub(crate) fn measure(self, core: usize, times: u64) -> anyhow::Result<Distribution> {
        match self {
            Self::Cyclictest => cyclictest(core, times),
            Self::OwnLoop => own_loop(core, times),
        }
    }
}

fn cyclictest(core: usize, times: u64) -> anyhow::Result<Distribution> {
    let period_us = PERIOD_NS / 1000;
    let output = Command::new("cyclictest")
        .args(["--quiet", "--mlockall", "--threads=1", "--priority=80"])
        .arg(format!("--affinity={core}"))
        .arg(format!("--interval={period_us}"))
        .arg(format!("--loops={times}"))
        .arg(format!("--histogram={LARGEST_US}"))
        .stderr(Stdio::inherit())
        .output()
        .context("cyclictest does not start")?;
    anyhow::ensure!(
        output.status.success(),
        "cyclictest failed ({})",
        output.status
    );
    parse(&String::from_utf8_lossy(&output.stdout))
}

/// Rows like `000015 000004` (latency in us, how often), and comments.
fn parse(text: &str) -> anyhow::Result<Distribution> {
    let mut all = Distribution::default();
    for line in text.lines() {
        if let Some(beyond) = line.strip_prefix("# Histogram Overflows:") {
            all.add(LARGEST_US * 1000, beyond.trim().parse()?);
        }
        let mut words = line.split_whitespace().map(str::parse::<u64>);
        if let (Some(Ok(us)), Some(Ok(times))) = (words.next(), words.next()) {
            all.add(us * 1000, times);
        }
    }
    anyhow::ensure!(all.count() > 0, "cyclictest printed no histogram: {text}");
    Ok(all)
}

fn own_loop(core: usize, times: u64) -> anyhow::Result<Distribution> {
    let looping = thread::spawn(move || {
        let _prepared = in_front(core).prepare();
        let mut due_ns = clock::now_ns() + PERIOD_NS;
        (0..times)
            .map(|_| {
                clock::sleep_until(due_ns);
                let now_ns = clock::now_ns();
                let late_ns = now_ns - due_ns;
                due_ns += (late_ns / PERIOD_NS + 1) * PERIOD_NS;
                late_ns
            })
            .collect()
    });
    looping
        .join()
        .map_err(|_| anyhow::anyhow!("the bare loop panicked"))
}
