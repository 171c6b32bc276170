//! What the agents make of the suites' instructions, beside what the simulator knows.
//!
//! Every task of both suites, nominal and under each perturbation, is planned and grounded by the
//! agents that the evaluation uses, from the instruction and what perception tells after the
//! settling steps, and compared with the task's goal. `cargo test -p sim-harness --test knowledge
//! -- --nocapture` prints the table.

use std::collections::BTreeMap;

use sim_harness::action::WAIT;
use sim_harness::agents::{Agents, Occasion, OracleAgents, View};
use sim_harness::evaluation::Vision;
use sim_harness::grounding::RuleAgents;
use sim_harness::perception::{Perception, Sighting};
use sim_harness::perturb::{Instance, Level, Perturbation, instance};
use sim_harness::sim::Sim;
use sim_harness::suite::Suite;

/// Physics steps before the first look: ten policy steps.
const SETTLE_TICKS: u64 = 250;
const PHYSICS_NS: u64 = 2_000_000;

/// Cases of a cell, and what differed.
#[derive(Clone, Copy, Default)]
struct Cell {
    cases: u32,
    unread: u32,
    other_target: u32,
    other_destination: u32,
    /// Another target, and sure of it.
    sure_and_wrong: u32,
}

fn sightings(sim: &mut Sim, vision: Vision, seed: u64) -> Vec<Sighting> {
    let source = vision.source().expect("embedded parameters");
    let mut perception = Perception::new(source, sim, seed);
    sim.apply(&WAIT).expect("a valid action");
    for tick in 0..=SETTLE_TICKS {
        perception.capture(tick, tick * PHYSICS_NS, sim);
        perception.update(tick * PHYSICS_NS, sim);
        sim.step_physics();
    }
    perception.sightings().copied().collect()
}

fn compare(made: Instance, vision: Vision, seed: u64, cell: &mut Cell) -> Option<String> {
    let goal = made.goal;
    let mut sim = Sim::new(made.scene).expect("a scene");
    let sightings = sightings(&mut sim, vision, seed);
    let view = View {
        now_ns: SETTLE_TICKS * PHYSICS_NS,
        scene: sim.scene(),
        sightings: &sightings,
    };
    let mut agents = RuleAgents::new();
    let plan = agents.plan(&made.instruction);
    let told = agents.ground(&view, 0, 1, Occasion::First);
    let known = OracleAgents::new(goal).ground(&view, 0, 1, Occasion::First);
    let (told, known) = (told.unwrap_or_default(), known.expect("the goal's record"));
    cell.cases += 1;
    let unread = plan.subtask_count != 1 || plan.confidence_permille < 500;
    let other_target = told.target != known.target;
    let other_destination = told.destination != known.destination;
    cell.unread += u32::from(unread);
    cell.other_target += u32::from(other_target);
    cell.other_destination += u32::from(other_destination);
    cell.sure_and_wrong += u32::from(other_target && told.confidence >= 0.9);
    (unread || other_target || other_destination).then(|| {
        format!(
            "{}: target {} for {}, destination {} for {}, kappa {:.2}",
            made.instruction,
            told.target,
            known.target,
            told.destination,
            known.destination,
            told.confidence
        )
    })
}

/// Cells by perception, suite and perturbation, and a line for each difference.
fn table(vision: Vision, seeds: &[u64]) -> (BTreeMap<String, Cell>, Vec<String>) {
    let (mut cells, mut lines) = (BTreeMap::new(), Vec::new());
    for name in ["object", "spatial"] {
        let suite = Suite::embedded(name).expect("an embedded suite");
        for perturbation in Perturbation::ALL {
            let key = format!("{name:<8} {:<5}", perturbation.name());
            let cell: &mut Cell = cells.entry(key).or_default();
            for (task, &seed) in suite
                .tasks
                .iter()
                .flat_map(|task| seeds.iter().map(move |seed| (task, seed)))
            {
                let made = instance(&suite, task, perturbation, Level::Standard, seed);
                let made = made.expect("an instance");
                lines.extend(compare(made, vision, seed, cell));
            }
        }
    }
    (cells, lines)
}

fn print(vision: Vision, cells: &BTreeMap<String, Cell>, lines: &[String]) {
    println!("{}", vision.name());
    println!("suite    pert.  cases  unread  other target  other destination  sure and wrong");
    for (key, cell) in cells {
        println!(
            "{key} {:>6} {:>7} {:>13} {:>18} {:>15}",
            cell.cases, cell.unread, cell.other_target, cell.other_destination, cell.sure_and_wrong
        );
    }
    lines.iter().for_each(|line| println!("  {line}"));
}

/// With the simulator's poses the agents' answer is the simulator's, in every cell.
#[test]
fn with_true_poses_the_agents_know_what_the_simulator_knows() {
    let (cells, lines) = table(Vision::Truth, &[7, 11, 13]);
    print(Vision::Truth, &cells, &lines);
    assert!(cells.values().all(|cell| cell.cases == 30));
    assert!(lines.is_empty());
}

/// With a modelled perception they may differ; what is reported sure hardly ever does.
#[test]
fn with_modelled_poses_the_agents_are_seldom_wrong_and_not_sure_of_it() {
    let (cells, lines) = table(Vision::Modelled, &[7]);
    print(Vision::Modelled, &cells, &lines);
    let sum = |part: fn(&Cell) -> u32| cells.values().map(part).sum::<u32>();
    assert_eq!(sum(|cell| cell.unread), 0);
    assert!(sum(|cell| cell.other_target) * 20 <= sum(|cell| cell.cases));
    assert!(sum(|cell| cell.sure_and_wrong) * 100 <= sum(|cell| cell.cases));
}
