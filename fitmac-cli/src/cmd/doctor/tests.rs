use std::{fs, path::Path};

use super::{
    Level::{self, Advice, Missing, Ok},
    checks,
    machine::{Machine, parse_core_list},
};

/// A machine of files: a tuned one unless the test overwrites some.
struct Fake(tempfile::TempDir);

impl Fake {
    fn tuned() -> Self {
        let fake = Self(tempfile::tempdir().unwrap());
        fake.write(
            "proc/self/status",
            "CapEff:\t0000000000000000\nCpus_allowed_list:\t0-3\n",
        );
        fake.limits("98", "unlimited");
        fake.write("proc/sys/kernel/osrelease", "6.1.0-rt\n");
        fake.write("proc/sys/kernel/sched_rt_runtime_us", "-1\n");
        fake.write("proc/swaps", "Filename Type Size Used Priority\n");
        fake.write("sys/kernel/realtime", "1\n");
        fake.write("sys/devices/system/cpu/isolated", "3\n");
        fake.write(
            "sys/devices/system/clocksource/clocksource0/current_clocksource",
            "tsc\n",
        );
        fs::create_dir_all(fake.0.path().join("dev/shm")).unwrap();
        fake
    }

    fn limits(&self, priority: &str, memory: &str) {
        self.write(
            "proc/self/limits",
            &format!(
                "Limit Soft Hard Units\nMax locked memory  {memory} {memory} bytes\n\
                 Max realtime priority  {priority} {priority}\n"
            ),
        );
    }

    fn write(&self, path: &str, text: &str) {
        let path = self.0.path().join(path);
        fs::create_dir_all(path.parent().unwrap_or(Path::new("/"))).unwrap();
        fs::write(path, text).unwrap();
    }

    fn levels(&self) -> Vec<(&'static str, Level)> {
        let findings = checks::all(&Machine::at(self.0.path()));
        for finding in &findings {
            assert_eq!(finding.remedy.is_none(), finding.level == Ok, "{finding:?}");
        }
        findings
            .iter()
            .map(|finding| (finding.name, finding.level))
            .collect()
    }

    /// What is not as it should be.
    fn complaints(&self) -> Vec<(&'static str, Level)> {
        let mut levels = self.levels();
        levels.retain(|(_, level)| *level != Ok);
        levels
    }
}

#[test]
fn a_tuned_machine_gives_no_complaint() {
    assert_eq!(Fake::tuned().complaints(), []);
}

#[test]
fn each_thing_that_stops_the_loop_is_missing() {
    let fake = Fake::tuned();
    fake.limits("0", "8388608");
    fake.write(
        "proc/self/status",
        "CapEff:\t0000000000000000\nCpus_allowed_list:\t2\n",
    );
    fs::remove_dir(fake.0.path().join("dev/shm")).unwrap();
    assert_eq!(
        fake.complaints(),
        [
            ("SCHED_FIFO", Missing),
            ("locked memory", Missing),
            ("shared memory", Missing),
            ("cores", Missing)
        ]
    );
}

#[test]
fn a_capability_replaces_the_limit_and_only_its_own() {
    let fake = Fake::tuned();
    fake.limits("0", "8388608");
    let status = |mask: u64| {
        let text = format!("CapEff:\t{mask:016x}\nCpus_allowed_list:\t0-3\n");
        fake.write("proc/self/status", &text);
    };
    status(1 << 23);
    assert_eq!(fake.complaints(), [("locked memory", Missing)]);
    status(1 << 14);
    assert_eq!(fake.complaints(), [("SCHED_FIFO", Missing)]);
}

#[test]
fn what_only_costs_latency_is_advice() {
    let fake = Fake::tuned();
    fs::remove_file(fake.0.path().join("sys/kernel/realtime")).unwrap();
    fake.write("proc/sys/kernel/sched_rt_runtime_us", "950000\n");
    fake.write("sys/devices/system/cpu/isolated", "\n");
    fake.write(
        "sys/devices/system/cpu/cpu1/cpufreq/scaling_governor",
        "powersave\n",
    );
    fake.write(
        "sys/devices/system/clocksource/clocksource0/current_clocksource",
        "hpet\n",
    );
    fake.write("proc/swaps", "Filename Type\n/dev/sda2 partition\n");
    let names = [
        "kernel",
        "real-time throttling",
        "isolated cores",
        "frequency governor",
        "clock",
        "swap",
    ];
    assert_eq!(fake.complaints(), names.map(|name| (name, Advice)));
}

#[test]
fn core_lists_are_read_as_the_kernel_writes_them() {
    assert_eq!(parse_core_list("0-2,5"), [0, 1, 2, 5]);
    assert!(parse_core_list("").is_empty());
    assert_eq!(parse_core_list("x,7"), [7]);
}
