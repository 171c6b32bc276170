//! The checks, each a function from the machine to a finding.

use super::{
    Finding,
    Level::{self, Advice, Missing, Ok},
    machine::{Limit, Machine, parse_core_list},
};

/// Numbers of capabilities(7).
const CAP_IPC_LOCK: u32 = 14;
const CAP_SYS_NICE: u32 = 23;

/// The priority that the control loop asks for by default.
const PRIORITY: u64 = 80;
/// Memory that the control process may lock, with room to spare.
const LOCKED_BYTES: u64 = 256 << 20;
/// Shared memory that a set of processes needs, with room to spare.
const SHARED_BYTES: u64 = 64 << 20;

/// Every check, the ones that can stop the loop first.
pub(super) fn all(machine: &Machine) -> Vec<Finding> {
    [
        scheduling,
        memory_lock,
        shared_memory,
        cores,
        kernel,
        throttling,
        isolation,
        governor,
        clock,
        swap,
    ]
    .iter()
    .map(|check| check(machine))
    .collect()
}

fn finding(
    name: &'static str,
    level: Level,
    found: impl Into<String>,
    remedy: &'static str,
) -> Finding {
    Finding {
        name,
        level,
        found: found.into(),
        remedy: (level != Ok).then_some(remedy),
    }
}

/// `Ok` where the condition holds, else the given level.
fn level(holds: bool, otherwise: Level) -> Level {
    if holds { Ok } else { otherwise }
}

fn scheduling(machine: &Machine) -> Finding {
    let limit = machine
        .limit("Max realtime priority")
        .unwrap_or(Limit::Value(0));
    let capable = machine.has_capability(CAP_SYS_NICE);
    let found = match limit {
        _ if capable => "allowed by capability".to_owned(),
        Limit::Unlimited => "allowed".to_owned(),
        Limit::Value(highest) => format!("highest priority {highest}, {PRIORITY} is asked for"),
    };
    finding(
        "SCHED_FIFO",
        level(capable || limit.allows(PRIORITY), Missing),
        found,
        "put `@realtime - rtprio 98` into /etc/security/limits.d/fitmac.conf, add your user to the \
         group realtime and log in again",
    )
}

fn memory_lock(machine: &Machine) -> Finding {
    let limit = machine
        .limit("Max locked memory")
        .unwrap_or(Limit::Value(0));
    let capable = machine.has_capability(CAP_IPC_LOCK);
    let found = match limit {
        _ if capable => "allowed by capability".to_owned(),
        Limit::Unlimited => "unlimited".to_owned(),
        Limit::Value(bytes) => format!("{} MiB", bytes >> 20),
    };
    finding(
        "locked memory",
        level(capable || limit.allows(LOCKED_BYTES), Missing),
        found,
        "put `@realtime - memlock unlimited` into /etc/security/limits.d/fitmac.conf, add your \
         user to the group realtime and log in again",
    )
}

fn shared_memory(machine: &Machine) -> Finding {
    let free = rustix::fs::statvfs(machine.path("dev/shm"))
        .map(|stat| stat.f_bavail.saturating_mul(stat.f_frsize));
    let found = match free {
        Result::Ok(bytes) => format!("{} MiB free in /dev/shm", bytes >> 20),
        Err(error) => format!("/dev/shm: {error}"),
    };
    finding(
        "shared memory",
        level(free.is_ok_and(|bytes| bytes >= SHARED_BYTES), Missing),
        found,
        "mount it (`mount -t tmpfs tmpfs /dev/shm`) or make room; in a container give \
         `--shm-size=256m`",
    )
}

fn cores(machine: &Machine) -> Finding {
    let cores = machine.allowed_cores();
    finding(
        "cores",
        level(cores.len() >= 2, Missing),
        format!("{} allowed to this process", cores.len()),
        "the loop wants a core of its own: allow at least two (taskset, cpuset or container limit)",
    )
}

fn kernel(machine: &Machine) -> Finding {
    let realtime = machine.text("sys/kernel/realtime").as_deref() == Some("1");
    let release = machine
        .text("proc/sys/kernel/osrelease")
        .unwrap_or_default();
    let kind = if realtime {
        "PREEMPT_RT"
    } else {
        "not PREEMPT_RT"
    };
    finding(
        "kernel",
        level(realtime, Advice),
        format!("{release}, {kind}"),
        "without it latency has no bound: install one (Debian: `apt-get install \
         linux-image-rt-amd64`) and boot it",
    )
}

fn throttling(machine: &Machine) -> Finding {
    let runtime = machine
        .text("proc/sys/kernel/sched_rt_runtime_us")
        .unwrap_or_default();
    finding(
        "real-time throttling",
        level(runtime == "-1", Advice),
        if runtime == "-1" {
            "off".to_owned()
        } else {
            format!("{runtime} us a period")
        },
        "a loop that only spins would be stopped: `sysctl kernel.sched_rt_runtime_us=-1`, or keep \
         the loop's sleep (the default)",
    )
}

fn isolation(machine: &Machine) -> Finding {
    let list = machine
        .text("sys/devices/system/cpu/isolated")
        .unwrap_or_default();
    let isolated = parse_core_list(&list);
    finding(
        "isolated cores",
        level(!isolated.is_empty(), Advice),
        if list.is_empty() { "none" } else { &list },
        "keep other work off the loop's core: boot with `isolcpus=N nohz_full=N rcu_nocbs=N` and \
         run `fitmac rt --core N`",
    )
}

fn governor(machine: &Machine) -> Finding {
    let cores = machine.allowed_cores();
    let of_core = |core: &u32| {
        machine.text(&format!(
            "sys/devices/system/cpu/cpu{core}/cpufreq/scaling_governor"
        ))
    };
    let slow = cores
        .iter()
        .filter_map(of_core)
        .find(|governor| governor != "performance");
    finding(
        "frequency governor",
        level(slow.is_none(), Advice),
        slow.unwrap_or_else(|| "performance, or not scaled".to_owned()),
        "clock changes cost microseconds: `cpupower frequency-set --governor performance`",
    )
}

fn clock(machine: &Machine) -> Finding {
    const CURRENT: &str = "sys/devices/system/clocksource/clocksource0/current_clocksource";
    let source = machine.text(CURRENT).unwrap_or_default();
    finding(
        "clock",
        level(
            ["tsc", "arch_sys_counter", "kvm-clock"].contains(&source.as_str()),
            Advice,
        ),
        source,
        "reading this clock enters the kernel: boot with `clocksource=tsc tsc=reliable` if the \
         processor's counter is stable",
    )
}

fn swap(machine: &Machine) -> Finding {
    let areas = machine
        .text("proc/swaps")
        .unwrap_or_default()
        .lines()
        .skip(1)
        .count();
    finding(
        "swap",
        level(areas == 0, Advice),
        if areas == 0 {
            "off".to_owned()
        } else {
            format!("{areas} areas")
        },
        "the loop locks its own memory, the policy and agents do not: `swapoff -a`",
    )
}
