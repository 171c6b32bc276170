//! The swarm, as far as every test run affords it; `cargo xtask swarm` runs it
//! for longer.

use fitmac_core::{
    Controller, State,
    message::{Input, Output},
    wire::Mode,
};
use fitmac_core_tests::swarm::{Controls, Failure, Run, sweep};

#[test]
fn a_million_ticks_of_faults_break_no_invariant() {
    let sum = sweep(0, 1_000_000, |_, _| {}).unwrap_or_else(|failure: Failure| panic!("{failure}"));
    assert!(sum.ticks >= 1_000_000);
    // The swarm must reach what it is there for.
    assert!(sum.faulty > sum.ticks / 100, "{sum:?}");
    assert!(sum.corrections > 1000 && sum.rebinds > 100, "{sum:?}");
}

#[test]
fn a_seed_tells_the_whole_story() {
    let run = |seed| Run::new(seed).to_end().unwrap_or_else(|f| panic!("{f}"));
    for seed in [3, 77] {
        assert_eq!(run(seed), run(seed));
    }
    assert_ne!(run(3).fingerprint, run(4).fingerprint);
}

/// Bugs of the kind that real controllers had.
#[derive(Clone, Copy, Debug)]
enum Bug {
    /// A hold repeats the last action instead of standing still.
    RepeatsInHold,
    /// The stop is forgotten after a while.
    ForgetsTheStop,
    /// A number that is not finite gets through once in a while.
    LetsNanThrough,
    /// Once in a while a command is sent twice.
    RepeatsACommand,
    /// The setpoint jumps at the seam between two chunks.
    JumpsAtSeams,
    /// After a while nothing new is played.
    StaysDead,
}

struct Spoilt {
    core: Controller,
    bug: Bug,
    ticks: u64,
    last: Option<Output>,
}

impl Controls for Spoilt {
    fn tick(&mut self, now_ns: u64, input: &Input<'_>) -> Output {
        self.ticks += 1;
        let mut output = self.core.tick(now_ns, input);
        let mode = output.command.mode();
        let once_in_a_while = self.ticks.is_multiple_of(997);
        match (self.bug, &self.last) {
            (Bug::RepeatsInHold, Some(last)) if mode == Some(Mode::Hold) => {
                output.command.action = last.command.action;
            }
            (Bug::ForgetsTheStop, _) if once_in_a_while && mode == Some(Mode::Stop) => {
                output.command.mode = Mode::Hold.code();
            }
            (Bug::LetsNanThrough, _) if once_in_a_while => output.command.action[3] = f64::NAN,
            (Bug::RepeatsACommand, Some(last)) if once_in_a_while => output = *last,
            (Bug::JumpsAtSeams, _) if output.query.is_some() => {
                output.command.setpoint_position_m[1] += 0.01;
            }
            (Bug::StaysDead, Some(last)) if self.ticks > 3000 => {
                let sequence = output.command.sequence;
                output = *last;
                output.command.sequence = sequence;
                (output.query, output.trace) = (None, None);
            }
            _ => {}
        }
        self.last = Some(output);
        output
    }

    fn state(&self) -> &State {
        self.core.state()
    }
}

fn hunt(bug: Bug) -> Option<Failure> {
    (0..200).find_map(|seed| {
        let spoilt = |params| Spoilt {
            core: Controller::new(params),
            bug,
            ticks: 0,
            last: None,
        };
        Run::with(seed, spoilt).to_end().err()
    })
}

#[test]
fn planted_bugs_are_found_and_their_seed_is_named() {
    for (bug, invariant) in [
        (Bug::RepeatsInHold, "9: a hold"),
        (Bug::ForgetsTheStop, "latched"),
        (Bug::LetsNanThrough, "finite"),
        (Bug::RepeatsACommand, "numbered one higher"),
        (Bug::JumpsAtSeams, "10: the setpoint"),
        (Bug::StaysDead, ""),
    ] {
        let failure = hunt(bug).unwrap_or_else(|| panic!("{bug:?} was not found"));
        let text = failure.to_string();
        assert!(
            text.contains(&format!("--seed {} ", failure.seed)),
            "{text}"
        );
        assert!(
            failure.broken.invariant.contains(invariant),
            "{bug:?}: {text}"
        );
        // Without the bug the seed is sound.
        Run::new(failure.seed)
            .to_end()
            .unwrap_or_else(|f| panic!("{f}"));
    }
}
