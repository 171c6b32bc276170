//! Lets this crate's tests find MuJoCo's library where `cargo xtask setup` put it, and gives the
//! results of episodes the fingerprint of what decides them.
//!
//! The fingerprint is made of files, not of a version control system's state: it is the same in a
//! checkout, in a tarball and with changes that were not committed.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

/// The crates whose sources and data decide how an episode goes.
const DECIDING: [&str; 4] = ["fitmac-core", "kinematics", "fitmac-agents", "sim-harness"];
/// What of them is read.
const PARTS: [&str; 4] = ["src", "assets", "data", "Cargo.toml"];
/// The crate whose dependencies decide, too.
const PLAYS: &str = "sim-harness";

fn main() {
    let own = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    println!(
        "cargo:rustc-link-arg=-Wl,-rpath,{}/../third_party/mujoco/lib",
        own.display()
    );
    println!("cargo:rerun-if-changed=build.rs");
    let root = own.join("..");
    let mut digest = Sha256::new();
    // Floating point agrees everywhere in Rust; the physics is a library built for one processor.
    digest.update(std::env::var("CARGO_CFG_TARGET_ARCH").unwrap_or_default());
    for part in DECIDING
        .iter()
        .flat_map(|name| PARTS.map(|part| format!("{name}/{part}")))
    {
        // Without a file a directive makes cargo run this each time.
        if root.join(&part).exists() {
            println!("cargo:rerun-if-changed=../{part}");
            add(&mut digest, &root, &part);
        }
    }
    let lock = fs::read_to_string(root.join("Cargo.lock")).unwrap_or_default();
    if !lock.is_empty() {
        println!("cargo:rerun-if-changed=../Cargo.lock");
    }
    for dependency in dependencies(&lock) {
        digest.update(dependency);
    }
    let hex: String = digest
        .finalize()
        .iter()
        .take(6)
        .map(|byte| format!("{byte:02x}"))
        .collect();
    println!("cargo:rustc-env=SIM_HARNESS_FINGERPRINT={hex}");
}

/// Adds a file, or the files of a folder in the order of their names, each with its path.
fn add(digest: &mut Sha256, root: &Path, part: &str) {
    let path = root.join(part);
    if path.is_dir() {
        let mut names: Vec<String> = fs::read_dir(&path)
            .expect("a folder of the sources can be read")
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .collect();
        names.sort();
        for name in names {
            add(digest, root, &format!("{part}/{name}"));
        }
    } else if !part.ends_with("/tests.rs") {
        let bytes = fs::read(&path).expect("a file of the sources can be read");
        digest.update((part.len() as u64).to_le_bytes());
        digest.update(part);
        digest.update((bytes.len() as u64).to_le_bytes());
        digest.update(bytes);
    }
}

/// Name and version of everything that [`PLAYS`] is linked with, out of the lock file.
fn dependencies(lock: &str) -> BTreeSet<String> {
    let parsed: toml::Table = toml::from_str(lock).unwrap_or_default();
    let packages: BTreeMap<&str, &toml::Table> = parsed
        .get("package")
        .and_then(toml::Value::as_array)
        .into_iter()
        .flatten()
        .filter_map(|package| {
            let package = package.as_table()?;
            Some((package.get("name")?.as_str()?, package))
        })
        .collect();
    let (mut found, mut waiting) = (BTreeSet::new(), vec![PLAYS]);
    while let Some(name) = waiting.pop() {
        let Some(package) = packages.get(name) else {
            continue;
        };
        let version = package.get("version").and_then(toml::Value::as_str);
        if found.insert(format!("{name} {}\n", version.unwrap_or_default())) {
            let needed = package.get("dependencies").and_then(toml::Value::as_array);
            // Of a crate in two versions an entry names one; the name is enough here.
            waiting.extend(
                needed
                    .into_iter()
                    .flatten()
                    .filter_map(|entry| entry.as_str()?.split(' ').next()),
            );
        }
    }
    found
}
