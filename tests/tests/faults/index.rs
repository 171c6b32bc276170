//! The table of faults is whole: every row has a test that exists, and every
//! test here stands in a row.

use std::{collections::BTreeSet, fs};

use fitmac_tests::{
    faults::{FAULTS, SECTIONS},
    oracle::workspace_root,
};

/// Rows that say what is not defended: there is no reaction to show.
const STATED: [&str; 1] = ["D10"];

#[test]
fn every_row_names_tests_that_exist() {
    for fault in FAULTS {
        assert_eq!(
            fault.tests.is_empty(),
            STATED.contains(&fault.row),
            "{}",
            fault.row
        );
        let path = workspace_root().join(fault.file);
        let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", fault.file));
        for test in fault.tests {
            assert!(
                text.contains(&format!("fn {test}()")),
                "{}: no {test}",
                fault.row
            );
        }
    }
}

#[test]
fn rows_are_numbered_without_a_gap() {
    for (letter, _) in SECTIONS {
        let rows = FAULTS.iter().filter(|f| f.row.starts_with(*letter));
        for (n, fault) in rows.enumerate() {
            assert_eq!(fault.row, format!("{letter}{}", n + 1));
        }
    }
}

#[test]
fn every_test_here_stands_in_its_row() {
    let named: BTreeSet<&str> = FAULTS.iter().flat_map(|f| f.tests).copied().collect();
    for file in [
        "policy",
        "perception",
        "time",
        "transport",
        "process",
        "configuration",
    ] {
        let path = workspace_root().join(format!("tests/tests/faults/{file}.rs"));
        let text = fs::read_to_string(&path).expect("it is here");
        for test in text.split("#[test]\nfn ").skip(1) {
            let name = test.split('(').next().unwrap_or_default();
            assert!(named.contains(name), "{name} stands in no row");
            let row = name.split('_').next().unwrap_or_default().to_uppercase();
            let stands = |f: &&fitmac_tests::faults::Fault| f.row == row;
            let fault = FAULTS.iter().find(stands).expect("a row");
            assert!(fault.tests.contains(&name), "{name} is not in row {row}");
        }
    }
}
