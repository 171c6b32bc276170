//! `cargo xtask install`: the C library where other builds find it.

use std::{
    fs, io,
    os::unix::fs::symlink,
    path::{Path, PathBuf},
    process::Stdio,
};

use anyhow::{Context, bail};
use serde_json::Value;

use crate::{
    process,
    workspace::{Workspace, not_writable},
};

/// Version of the binary interface: the number in the soname, which
/// `fitmac-capi/build.rs` sets.
const ABI: &str = "1";

/// What a program that links the static library needs of the system (what
/// rustc's `--print native-static-libs` says, less what glibc holds itself).
const SYSTEM_LIBRARIES: [&str; 4] = ["gcc_s", "pthread", "m", "dl"];

/// Arguments of `install`.
#[derive(clap::Args)]
#[command(after_help = "Example:
  cargo xtask install --prefix /opt/fitmac
  g++ -std=c++17 main.cpp $(PKG_CONFIG_PATH=/opt/fitmac/lib/pkgconfig pkg-config --cflags --libs fitmac)
  cmake -DCMAKE_PREFIX_PATH=/opt/fitmac ...    find_package(fitmac), target fitmac::fitmac

The installed tree may be moved as a whole.")]
pub(crate) struct Args {
    /// Where to install: include/, lib/, lib/pkgconfig/ and lib/cmake/ below it.
    #[arg(long, value_name = "DIR")]
    prefix: PathBuf,
}

/// Builds the library and installs it with its headers and package files.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    process::step("Building the C library");
    let built = build(workspace)?;
    let source = workspace.root().join("fitmac-capi");
    let version = env!("CARGO_PKG_VERSION");
    let tree = Tree {
        prefix: std::path::absolute(&args.prefix).context("the prefix as a path")?,
    };
    for header in ["fitmac.h", "fitmac.hpp"] {
        tree.copy(&source.join("include").join(header), "include", header)?;
    }
    tree.copy(&built.archive, "lib", "libfitmac.a")?;
    let (full, major) = (
        format!("libfitmac.so.{version}"),
        format!("libfitmac.so.{ABI}"),
    );
    tree.copy(&built.shared, "lib", &full)?;
    tree.link(&full, "lib", &major)?;
    tree.link(&major, "lib", "libfitmac.so")?;
    let packaging = source.join("packaging");
    tree.fill(
        &packaging.join("fitmac.pc"),
        "lib/pkgconfig",
        &pkg_config_values(),
    )?;
    for file in ["fitmacConfig.cmake", "fitmacConfigVersion.cmake"] {
        tree.fill(&packaging.join(file), "lib/cmake/fitmac", &cmake_values())?;
    }
    for licence in ["LICENSE-APACHE", "LICENSE-MIT"] {
        tree.copy(&workspace.root().join(licence), "share/doc/fitmac", licence)?;
    }
    println!(
        "installed FIT-MAC {version} for C and C++ in {}",
        tree.prefix.display()
    );
    Ok(())
}

type Values = [(&'static str, String); 4];

fn values(separator: &str, prefix: &str) -> Values {
    let version = env!("CARGO_PKG_VERSION");
    let libraries = SYSTEM_LIBRARIES.map(|name| format!("{prefix}{name}"));
    let major_minor = version.rsplit_once('.').map_or(version, |(kept, _)| kept);
    [
        ("@VERSION@", version.to_owned()),
        ("@ABI@", ABI.to_owned()),
        ("@MAJOR_MINOR@", major_minor.to_owned()),
        ("@SYSTEM_LIBRARIES@", libraries.join(separator)),
    ]
}

fn pkg_config_values() -> Values {
    values(" ", "-l")
}

fn cmake_values() -> Values {
    values(";", "")
}

/// What cargo built.
struct Built {
    archive: PathBuf,
    shared: PathBuf,
}

fn build(workspace: &Workspace) -> anyhow::Result<Built> {
    let mut command = process::cargo(workspace);
    command.args([
        "build",
        "--release",
        "--locked",
        "--package=fitmac-capi",
        "--lib",
        "--message-format=json-render-diagnostics",
    ]);
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .context("cargo could not be started")?;
    if !output.status.success() {
        bail!("the C library could not be built (the reason is above)");
    }
    let files = artifacts(&output.stdout);
    let ending = |wanted: &str| {
        let fits = |path: &&PathBuf| path.extension().is_some_and(|e| e == wanted);
        files.iter().find(fits).cloned()
    };
    let archive = ending("a").context("cargo names no static library")?;
    let shared = ending("so").context("cargo names no shared library: only Linux is supported")?;
    Ok(Built { archive, shared })
}

/// The files of our library among cargo's messages.
fn artifacts(messages: &[u8]) -> Vec<PathBuf> {
    let messages = messages.split(|byte| *byte == b'\n');
    let values = messages.filter_map(|line| serde_json::from_slice::<Value>(line).ok());
    let ours = values.filter(|value| value["target"]["name"] == "fitmac_capi");
    let files = ours.filter_map(|value| value["filenames"].as_array().cloned());
    let paths = files.flatten();
    paths
        .filter_map(|path| path.as_str().map(PathBuf::from))
        .collect()
}

/// The installed tree.
struct Tree {
    prefix: PathBuf,
}

impl Tree {
    fn place(&self, folder: &str, name: &str) -> anyhow::Result<PathBuf> {
        let folder = self.prefix.join(folder);
        fs::create_dir_all(&folder).map_err(|error| not_writable(&folder, &error))?;
        Ok(folder.join(name))
    }

    /// A file that is in use by a running program is replaced, not overwritten.
    fn clear(&self, folder: &str, name: &str) -> anyhow::Result<PathBuf> {
        let place = self.place(folder, name)?;
        match fs::remove_file(&place) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                Err(not_writable(&place, &error))
            }
            _ => Ok(place),
        }
    }

    fn copy(&self, from: &Path, folder: &str, name: &str) -> anyhow::Result<()> {
        let to = self.clear(folder, name)?;
        fs::copy(from, &to)
            .map(|_| ())
            .with_context(|| format!("{} to {}", from.display(), to.display()))
    }

    fn link(&self, target: &str, folder: &str, name: &str) -> anyhow::Result<()> {
        let place = self.clear(folder, name)?;
        symlink(target, &place).map_err(|error| not_writable(&place, &error))
    }

    fn fill(&self, template: &Path, folder: &str, values: &Values) -> anyhow::Result<()> {
        let mut text = fs::read_to_string(template)
            .with_context(|| format!("{} cannot be read", template.display()))?;
        for (name, value) in values {
            text = text.replace(name, value);
        }
        let name = template.file_name().unwrap_or_default().to_string_lossy();
        let to = self.clear(folder, &name)?;
        fs::write(&to, text).map_err(|error| not_writable(&to, &error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_our_own_library_is_taken_from_cargos_messages() {
        let messages = concat!(
            r#"{"reason":"compiler-artifact","target":{"name":"libm"},"filenames":["/x/libm.a"]}"#,
            "\nnot json\n",
            r#"{"target":{"name":"fitmac_capi"},"filenames":["/t/libfitmac_capi.rlib","/t/libfitmac_capi.a"]}"#,
            "\n{\"reason\":\"build-finished\"}"
        );
        let expected = ["/t/libfitmac_capi.rlib", "/t/libfitmac_capi.a"].map(PathBuf::from);
        assert_eq!(artifacts(messages.as_bytes()), expected);
    }
}
