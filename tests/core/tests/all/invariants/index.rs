//! The index is complete: every number has a test, every test a number.

use std::{collections::BTreeSet, fs};

use fitmac_core_tests::{
    invariants::{INVARIANTS, Invariant},
    workspace_root,
};

/// The invariants that the test functions of a file name: `inv_17_...`,
/// `inv_57_and_58_...`.
fn named_in(file: &str) -> BTreeSet<u32> {
    let path = workspace_root().join(file);
    let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{file}: {e}"));
    let mut found = BTreeSet::new();
    for line in text.lines() {
        let Some(name) = line.trim_start().strip_prefix("fn inv_") else {
            continue;
        };
        let mut words = name.split('_');
        while let Some(number) = words.next().and_then(|w| w.parse().ok()) {
            found.insert(number);
            if words.next() != Some("and") {
                break;
            }
        }
    }
    found
}

#[test]
fn the_numbers_are_one_to_seventy() {
    let numbers: Vec<u32> = INVARIANTS.iter().map(|i| i.number).collect();
    assert_eq!(numbers, (1..=70).collect::<Vec<_>>());
}

#[test]
fn every_invariant_has_a_test_that_names_its_number_in_each_of_its_files() {
    for Invariant { number, files, .. } in INVARIANTS {
        assert!(!files.is_empty(), "{number}");
        for file in *files {
            assert!(
                named_in(file).contains(number),
                "no test inv_{number:02}_... in {file}"
            );
        }
    }
}

#[test]
fn every_test_that_names_a_number_stands_in_the_index() {
    let files: BTreeSet<&str> = INVARIANTS.iter().flat_map(|i| i.files).copied().collect();
    for file in files {
        for number in named_in(file) {
            let known = INVARIANTS
                .iter()
                .any(|i| i.number == number && i.files.contains(&file));
            assert!(
                known,
                "{file} tests inv_{number:02}, the index does not say so"
            );
        }
    }
}
