//! `cargo xtask bare-metal`: the core without an operating system.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Context, bail};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, read::archive::ArchiveFile};
use serde_json::Value;

use crate::{bare_rust::Compiler, process, workspace::Workspace};

/// A small processor with double precision (Cortex-M4F and up) and a large one.
const TARGETS: [&str; 2] = ["thumbv7em-none-eabihf", "aarch64-unknown-none"];
const LIBRARIES: [&str; 2] = ["fitmac_core", "kinematics"];

/// Arguments of `bare-metal`.
#[derive(clap::Args)]
pub(crate) struct Args {}

/// Builds the tick for both targets and prints what it takes of their memory.
pub(crate) fn run(workspace: &Workspace, _args: &Args) -> anyhow::Result<()> {
    let compiler = Compiler::find(workspace, &TARGETS)?;
    println!("{}", compiler.version()?);
    println!(
        "{:<24} {:<14} {:>12} {:>12}",
        "target", "library", "code", "constants"
    );
    for target in TARGETS {
        process::step(&format!(
            "Building fitmac-core and kinematics for {target} (two minutes the first time)"
        ));
        let built = build(workspace, &compiler, target)?;
        for library in LIBRARIES {
            let size = archive_size(built.archive(&format!("lib{library}-"))?)?;
            println!(
                "{target:<24} {library:<14} {:>10} B {:>10} B",
                size.code, size.constants
            );
        }
        let whole = built.archive("libbare_metal")?;
        println!(
            "{target:<24} a controller has {} bytes, the answer of a tick {}",
            symbol_size(whole, "FITMAC_CONTROLLER")?,
            symbol_size(whole, "FITMAC_OUTPUT")?
        );
    }
    println!("cargo xtask bare-metal: both targets build");
    Ok(())
}

/// The archives that cargo made.
struct Built(Vec<PathBuf>);

impl Built {
    fn archive(&self, prefix: &str) -> anyhow::Result<&Path> {
        let named = |path: &&PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with(prefix) && (name.ends_with(".rlib") || name.ends_with(".a"))
        };
        let found = self.0.iter().find(named);
        found
            .map(PathBuf::as_path)
            .with_context(|| format!("cargo names no library {prefix}*"))
    }
}

fn build(workspace: &Workspace, compiler: &Compiler, target: &str) -> anyhow::Result<Built> {
    let mut cargo = process::cargo(workspace);
    // The harness is a workspace of its own, with its own profile.
    cargo.current_dir(workspace.root().join("tests/bare_metal"));
    cargo.args([
        "build",
        "--release",
        "--locked",
        "--message-format=json-render-diagnostics",
        "--target",
        target,
        "--target-dir",
    ]);
    cargo.arg(workspace.root().join("target/bare-metal/build"));
    cargo.env_remove("RUSTFLAGS");
    compiler.equip(&mut cargo);
    let output = cargo
        .stderr(Stdio::inherit())
        .output()
        .context("cargo could not be started")?;
    if !output.status.success() {
        bail!("{target}: something needs an operating system (the compiler says what, above)");
    }
    Ok(Built(files(&output.stdout)))
}

/// All files that cargo's messages name.
fn files(messages: &[u8]) -> Vec<PathBuf> {
    let messages = messages.split(|byte| *byte == b'\n');
    let values = messages.filter_map(|line| serde_json::from_slice::<Value>(line).ok());
    let names = values.filter_map(|value| value["filenames"].as_array().cloned());
    let names = names.flatten();
    names
        .filter_map(|name| name.as_str().map(PathBuf::from))
        .collect()
}

/// What a library takes before the linker drops what is not used, in bytes.
#[derive(Default, Debug, PartialEq)]
struct Size {
    code: u64,
    constants: u64,
}

fn archive_size(file: &Path) -> anyhow::Result<Size> {
    let mut size = Size::default();
    each_object(file, |object| {
        for section in object.sections() {
            match section.kind() {
                SectionKind::Text => size.code += section.size(),
                SectionKind::ReadOnlyData | SectionKind::ReadOnlyString => {
                    size.constants += section.size();
                }
                _ => {}
            }
        }
    })?;
    Ok(size)
}

fn symbol_size(file: &Path, name: &str) -> anyhow::Result<u64> {
    let mut found = None;
    each_object(file, |object| {
        let mut symbols = object.symbols();
        if let Some(symbol) = symbols.find(|s| s.name() == Ok(name) && s.is_definition()) {
            found = Some(symbol.size());
        }
    })?;
    found.with_context(|| format!("{} does not define {name}", file.display()))
}

fn each_object(file: &Path, mut visit: impl FnMut(&object::File<'_>)) -> anyhow::Result<()> {
    let unreadable = || format!("{} cannot be read", file.display());
    let data = fs::read(file).with_context(unreadable)?;
    let archive = ArchiveFile::parse(data.as_slice()).with_context(unreadable)?;
    for member in archive.members() {
        let member = member.with_context(unreadable)?;
        let content = member.data(data.as_slice()).with_context(unreadable)?;
        // A Rust library also holds metadata, which is no object.
        if let Ok(object) = object::File::parse(content) {
            visit(&object);
        }
    }
    Ok(())
}

/// Whether a program answers to `--version`.
pub(crate) fn is_installed(program: &str) -> bool {
    let mut command = Command::new(program);
    command.arg("--version");
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cargos_messages_name_the_libraries() {
        let messages = concat!(
            r#"{"filenames":["/t/libfitmac_core-12.rlib","/t/libfitmac_core-12.rmeta"]}"#,
            "\nnot json\n",
            r#"{"filenames":["/t/libbare_metal.a"]}"#,
        );
        let built = Built(files(messages.as_bytes()));
        let core = built.archive("libfitmac_core-").unwrap();
        assert_eq!(core, Path::new("/t/libfitmac_core-12.rlib"));
        let whole = built.archive("libbare_metal").unwrap();
        assert_eq!(whole, Path::new("/t/libbare_metal.a"));
        assert!(built.archive("libkinematics-").is_err());
    }
}
