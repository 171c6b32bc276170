//! Prints a page that is made from the code's own tables:
//! `cargo run -p fitmac-tests --example page state-machine`.

use std::process::ExitCode;

use fitmac_tests::docs::PAGES;

fn main() -> ExitCode {
    let asked = std::env::args().nth(1).unwrap_or_default();
    match PAGES.iter().find(|page| page.name == asked) {
        Some(page) => {
            print!("{}", (page.make)());
            ExitCode::SUCCESS
        }
        None => {
            let known: Vec<_> = PAGES.iter().map(|page| page.name).collect();
            eprintln!(
                "there is no page {asked:?}; there are: {}",
                known.join(", ")
            );
            ExitCode::from(2)
        }
    }
}
