//! Pages that are made from the code's own tables, so that they can't go stale:
//! `cargo xtask docs` writes them, a test compares them.

use std::fmt::Write as _;

use fitmac_core::{
    gate::Authorisation,
    ladder::REACTIONS,
    phase, reason, recovery,
    route::route,
    wire::{Mode, Phase, Route, SubPhase},
};

/// A page: its name, its place in the workspace, and what makes it.
#[derive(Clone, Copy, Debug)]
pub struct Page {
    /// Its name, as `cargo run -p fitmac-tests --example page` takes it.
    pub name: &'static str,
    /// The file.
    pub path: &'static str,
    /// Its text.
    pub make: fn() -> String,
}

/// All pages.
pub const PAGES: &[Page] = &[
    Page {
        name: "state-machine",
        path: "docs/state-machine.md",
        make: state_machine,
    },
    #[cfg(feature = "programs")]
    Page {
        name: "faults",
        path: crate::faults::PAGE,
        make: crate::faults::page,
    },
];

const MADE: &str = "<!-- Made by `cargo xtask docs`: do not edit. -->\n";

/// Routes, phases, the steps of a recovery and the ladder, as Mermaid diagrams.
#[must_use]
pub fn state_machine() -> String {
    let mut page = format!(
        "{MADE}# The state machine\n\n\
         Drawn from the code's own tables and functions.\n\n\
         ## Routes of a query\n\n\
         What `fitmac_core::route::route` answers: one route a query, the one furthest down \
         wins.\n\n{}\n\
         ## Phases of an attempt\n\n\
         Drawn from `fitmac_core::phase::EDGES`. A new phase must be seen for \
         `phase.hysteresis_steps` policy steps; a release counts at once. From every \
         place phase, and from a lift, the way back to `approach` begins a new attempt.\n\n",
        routes()
    );
    let phases: Vec<&str> = Phase::ALL.iter().map(|p| p.name()).collect();
    let edges: Vec<_> = phase::EDGES
        .iter()
        .map(|(a, b)| (a.name(), b.name()))
        .collect();
    let picks = |p: &&Phase| phase::is_pick(**p);
    let places = |p: &&Phase| phase::is_place(**p);
    let group = |keep: &dyn Fn(&&Phase) -> bool| {
        Phase::ALL
            .iter()
            .filter(keep)
            .map(|p| p.name())
            .collect::<Vec<_>>()
    };
    page += &diagram(
        &phases,
        &edges,
        &[("pick", group(&picks)), ("place", group(&places))],
        phases.first().copied(),
    );
    page += "\n## Steps of a recovery\n\n\
        Drawn from `fitmac_core::recovery::EDGES`. A query may take up to four of these \
        edges at once. From every step a correction may also end (`idle`): by success, by a \
        lost validity, or because its budget is spent. Those edges are left out.\n\n";
    let steps: Vec<&str> = SubPhase::ALL.iter().map(|s| s.name()).collect();
    let edges: Vec<_> = recovery::EDGES
        .iter()
        .map(|(a, b)| (a.name(), b.name()))
        .collect();
    page += &diagram(&steps, &edges, &[], steps.first().copied());
    page += "\n## Reactions to faults\n\n\
        Drawn from `fitmac_core::ladder::REACTIONS`. The severest reaction wins; a hold ends with \
        its cause, a stop with a reset.\n\n";
    page += &ladder();
    page
}

/// Which route each answer of the gate leads to.
fn routes() -> String {
    let cases = [
        (true, Authorisation::Closed(0), "a correction is pending"),
        (true, Authorisation::Target(0), "a correction is pending"),
        (true, Authorisation::Execution(0), "a correction is pending"),
        (
            false,
            Authorisation::Target(0),
            "the gate allows target correction",
        ),
        (
            false,
            Authorisation::Execution(0),
            "the gate allows execution correction",
        ),
        (false, Authorisation::Closed(0), "the gate is closed"),
    ];
    let mut text = "```mermaid\nflowchart LR\n    query{query}\n".to_owned();
    for &to in Route::ALL {
        let mut reasons: Vec<_> = cases
            .iter()
            .filter(|(pending, gate, _)| route(*pending, *gate) == to)
            .map(|&(_, _, why)| why)
            .collect();
        reasons.dedup();
        let _infallible = writeln!(text, "    query -->|{}| {to}", reasons.join(", or "));
    }
    text + "```\n"
}

/// Modes and what leads to them.
fn ladder() -> String {
    let edges: Vec<_> = Mode::ALL
        .iter()
        .flat_map(|&from| Mode::ALL.iter().map(move |&to| (from, to)))
        .filter(|&(from, to)| from != to && from != Mode::Stop)
        .map(|(from, to)| (from.name(), to.name()))
        .chain([(Mode::Stop.name(), "normal: reset")])
        .collect();
    let modes: Vec<_> = Mode::ALL.iter().map(|m| m.name()).collect();
    let mut text = diagram(&modes, &edges, &[], Some(Mode::Hold.name()));
    text += "\n| mode | reason | from when on |\n|---|---|---|\n";
    for r in REACTIONS {
        let names: Vec<_> = reason::names(r.reason).collect();
        let _infallible = writeln!(
            text,
            "| {} | `{}` | {} |",
            r.mode,
            names.join("` `"),
            r.when
        );
    }
    text
}

fn diagram(
    states: &[&str],
    edges: &[(&str, &str)],
    groups: &[(&str, Vec<&str>)],
    first: Option<&str>,
) -> String {
    let mut text = "```mermaid\nstateDiagram-v2\n".to_owned();
    for (name, members) in groups {
        let _infallible = writeln!(text, "    state {name} {{");
        for member in members {
            let _infallible = writeln!(text, "        {member}");
        }
        text += "    }\n";
    }
    for state in states {
        let grouped = groups.iter().any(|(_, members)| members.contains(state));
        let drawn = edges.iter().any(|(a, b)| a == state || b == state);
        if !grouped && !drawn {
            let _infallible = writeln!(text, "    {state}");
        }
    }
    if let Some(first) = first {
        let _infallible = writeln!(text, "    [*] --> {first}");
    }
    for (from, to) in edges {
        let _infallible = writeln!(text, "    {from} --> {to}");
    }
    text + "```\n"
}
