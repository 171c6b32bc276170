//! The pages that are made from the code are what the code says.

use std::fs;

use fitmac_core::{
    ladder::REACTIONS,
    reason,
    wire::{Phase, Route, SubPhase},
};
use fitmac_tests::{
    docs::{PAGES, state_machine},
    oracle::workspace_root,
};

#[test]
fn no_page_is_stale() {
    for page in PAGES {
        let path = workspace_root().join(page.path);
        let found = fs::read_to_string(&path).unwrap_or_default();
        assert!(
            found == (page.make)(),
            "{} is stale: run `cargo xtask docs` and commit what it writes",
            page.path
        );
    }
}

#[test]
fn every_state_stands_on_its_page() {
    let page = state_machine();
    let phases = Phase::ALL.iter().map(|p| p.name());
    for name in phases.chain(SubPhase::ALL.iter().map(|s| s.name())) {
        assert!(page.contains(&format!(" {name}\n")), "{name}");
    }
    for route in Route::ALL {
        assert!(page.contains(&format!("| {route}\n")), "{route}");
    }
    for r in REACTIONS {
        let name = reason::names(r.reason).next().unwrap_or("none");
        let row = format!("| {} | `{name}` | {} |\n", r.mode, r.when);
        assert!(page.contains(&row), "{row}");
    }
}
