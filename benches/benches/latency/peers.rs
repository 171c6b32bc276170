//! The process beside the loop: a policy, agents, and in the loaded condition
//! work for the robot's core.

use std::{
    hint::black_box,
    io::Read as _,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use anyhow::Context;
use fitmac_rt::{instance::Instance, realtime, transport::Ipc};
use fitmac_tests::cell::{AgentsState, PolicyState, Shared, agents, policy};

/// The argument by which this program becomes the peers.
pub(crate) const ROLE: &str = "--peers";
/// How long a policy that computes takes for a chunk.
const COMPUTE: Duration = Duration::from_millis(30);
/// What the load walks through, bytes: more than the caches of a core hold.
const WALK: usize = 16 << 20;

/// The running process; it ends with the value.
pub(crate) struct Peers(Child);

impl Peers {
    /// Starts the peers off the control core.
    pub(crate) fn start(instance: &Instance, control: usize, loaded: bool) -> anyhow::Result<Self> {
        let child = Command::new(std::env::current_exe()?)
            .args([ROLE, if loaded { "loaded" } else { "idle" }])
            .args([&control.to_string(), &*instance.root().to_string_lossy()])
            .stdin(Stdio::piped())
            .spawn()
            .context("the policy's process does not start")?;
        Ok(Self(child))
    }
}

impl Drop for Peers {
    fn drop(&mut self) {
        // It waits for the end of its input.
        drop(self.0.stdin.take());
        let _ = self.0.wait();
    }
}

/// Is the peers, until the input ends.
pub(crate) fn run(arguments: &[String]) -> anyhow::Result<()> {
    let [condition, control, root] = arguments else {
        anyhow::bail!("the peers need three arguments");
    };
    realtime::keep_off(control.parse()?);
    let loaded = condition == "loaded";
    let instance = Instance::at(Path::new(root))?;
    let (theirs, ours) = (instance.clone(), instance);
    thread::spawn(move || {
        let mut state = PolicyState::moving();
        if loaded {
            state.spoil_with(|_| compute());
        }
        policy(&Ipc::join(&theirs).expect("joins"), &Shared::new(state));
    });
    thread::spawn(move || {
        let transport = Ipc::join(&ours).expect("joins");
        agents(&transport, &Shared::new(AgentsState::default()));
    });
    if loaded {
        thread::spawn(walk);
    }
    std::io::stdin().read_to_end(&mut Vec::new())?;
    std::process::exit(0);
}

/// Computes for as long as a small policy would.
fn compute() {
    let begun = Instant::now();
    let mut matrix = [[0.5_f32; 64]; 64];
    while begun.elapsed() < COMPUTE {
        for row in &mut matrix {
            for x in row.iter_mut() {
                *x = x.mul_add(0.999, 1e-3);
            }
        }
        black_box(&mut matrix);
    }
}

/// Walks through memory without end.
fn walk() {
    let mut memory = vec![1_u8; WALK];
    loop {
        for line in memory.chunks_mut(64) {
            line[0] = line[0].wrapping_add(1);
        }
        black_box(&mut memory);
    }
}
