//! What planning and grounding cost, and what a model that hangs costs the control loop: nothing.
//!
//! `cargo xtask bench agents [--no-counts] [--no-cadence]`: microseconds, allocations and
//! instructions a call; then the controller's cadence with and without a hanging model server,
//! turn about. Times hold on the machine at hand; the ratio to parsing the same scene from JSON
//! and the instruction counts say more. About a minute and a half.

use std::alloc::{GlobalAlloc, Layout, System};
use std::hint::black_box;
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::{Context as _, bail};
use fitmac_agents::bind::{self, RecordHeader};
use fitmac_agents::grounder::{Context, ground};
use fitmac_agents::planner::{TaskPlan, plan};
use fitmac_agents::scene::Scene;
use fitmac_agents::synthetic::{Case, DetectorModel, case};
use fitmac_agents::track::{TrackParams, Tracker};
use fitmac_benches::{callgrind, rounds};
use fitmac_core::wire::Provenance;

#[path = "agents/cadence.rs"]
mod cadence;

struct Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

// SAFETY: every call goes to the system's allocator unchanged.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(at, layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `realloc`.
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Generated scenes with their instructions; a batch goes once through all.
const CASES: usize = 50;
const ROUNDS: usize = 60;

/// What is measured: the option's name, what it is.
const CONTESTANTS: [(&str, &str); 6] = [
    ("json", "parse a scene from JSON"),
    ("plan", "plan an instruction"),
    ("track", "track a scene"),
    ("ground", "ground a subtask"),
    ("record", "make the controller's record"),
    ("all", "plan, track, ground, record"),
];

struct Data {
    cases: Vec<Case>,
    scenes: Vec<Scene>,
    plans: Vec<TaskPlan>,
    json: Vec<String>,
}

const HEADER: RecordHeader = RecordHeader {
    sequence: 1,
    session: 1,
    stamp_ns: 0,
    epoch: 1,
    subtask: 0,
    prompt_id: 1,
    provenance: Provenance::Rules,
};

impl Data {
    fn new() -> anyhow::Result<Self> {
        let model = DetectorModel::default();
        let cases: Vec<Case> = (0..CASES as u64).map(|n| case(7, n, &model)).collect();
        let scenes: Vec<Scene> = cases.iter().map(|case| tracked(&case.frames[0])).collect();
        let plans = cases.iter().map(|case| plan(&case.instruction));
        let json = scenes.iter().map(serde_json::to_string);
        Ok(Self {
            plans: plans.collect::<Result<_, _>>()?,
            json: json.collect::<Result<_, _>>()?,
            scenes,
            cases,
        })
    }

    /// One batch of a contestant.
    fn batch(&self, key: &str) {
        for index in 0..CASES {
            match key {
                "json" => drop(black_box(Scene::from_json(&self.json[index]))),
                "plan" => drop(black_box(plan(&self.cases[index].instruction))),
                "track" => drop(black_box(tracked(&self.cases[index].frames[0]))),
                "ground" => drop(black_box(self.grounded(&self.plans[index], index))),
                "record" => {
                    let grounding = self.grounded(&self.plans[index], index);
                    black_box(bind::record(&HEADER, &grounding));
                }
                _ => {
                    let Ok(plan) = plan(&self.cases[index].instruction) else {
                        return;
                    };
                    let scene = tracked(&self.cases[index].frames[0]);
                    let grounding = ground(&plan.subtasks[0], &scene, &Context::default());
                    black_box(bind::record(&HEADER, &grounding));
                }
            }
        }
    }

    fn grounded(&self, plan: &TaskPlan, index: usize) -> fitmac_agents::grounder::Grounding {
        ground(&plan.subtasks[0], &self.scenes[index], &Context::default())
    }
}

fn tracked(frame: &Scene) -> Scene {
    Tracker::new(TrackParams::default()).update(frame).scene
}

fn main() -> anyhow::Result<()> {
    let (mut counts, mut with_cadence) = (true, true);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--bench" => {} // cargo adds it
            "--no-counts" => counts = false,
            "--no-cadence" => with_cadence = false,
            callgrind::OPTION => {
                let contestant = arguments.next().context("a contestant is missing")?;
                let batches: usize = arguments.next().context("the number is missing")?.parse()?;
                let data = Data::new()?;
                (0..batches).for_each(|_| data.batch(&contestant));
                return Ok(());
            }
            other => bail!("{other:?} is not an option; there are: --no-counts, --no-cadence"),
        }
    }
    costs(counts)?;
    if with_cadence {
        cadence::compare()?;
    }
    Ok(())
}

fn costs(counts: bool) -> anyhow::Result<()> {
    let data = Data::new()?;
    let counts = counts && callgrind::installed();
    let mut batches: Vec<_> = CONTESTANTS
        .iter()
        .map(|&(key, _)| {
            let data = &data;
            move || data.batch(key)
        })
        .collect();
    let mut runners: Vec<&mut dyn FnMut()> = batches
        .iter_mut()
        .map(|batch| batch as &mut dyn FnMut())
        .collect();
    let times = rounds::race(ROUNDS, CASES, &mut runners);
    let floor = times[0].median_ns;
    println!(
        "{:<30} {:>9} {:>9} {:>12} {:>13} {:>11}",
        "", "us median", "us best", "allocations", "instructions", "to parsing"
    );
    for (&(key, what), time) in CONTESTANTS.iter().zip(&times) {
        let before = ALLOCATIONS.load(Ordering::Relaxed);
        data.batch(key);
        let allocations = ALLOCATIONS.load(Ordering::Relaxed) - before;
        let instructions = if counts {
            format!("{:.0}", callgrind::count(key, CASES)?)
        } else {
            "-".to_owned()
        };
        println!(
            "{what:<30} {:>9.2} {:>9.2} {:>12.1} {instructions:>13} {:>11.2}",
            time.median_ns / 1e3,
            time.best_ns / 1e3,
            allocations as f64 / CASES as f64,
            time.median_ns / floor
        );
    }
    Ok(())
}
