//! Fetching and building what we are compared with.
//!
//! Everything lies under `target/bench-peers`. A step that is done leaves a note of what it was
//! made from, written last, and is repeated when that changes.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::{fs, io};

use anyhow::{Context, bail};

/// Where the peers are kept.
#[must_use]
pub fn folder() -> PathBuf {
    let benches = Path::new(env!("CARGO_MANIFEST_DIR"));
    benches.join("../target/bench-peers")
}

/// The root of the workspace.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A file that comes with the benchmarks.
#[must_use]
pub fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("peers")
        .join(name)
}

/// Pinocchio's C++ library behind the interface of `pinocchio.cpp`: a shared library.
///
/// # Errors
/// Where the packages cannot be fetched or the compiler is missing or fails.
pub fn pinocchio() -> anyhow::Result<PathBuf> {
    let packages = folder().join("pinocchio-packages");
    let requirements = source("requirements.txt");
    once(&packages, &read(&requirements)?, || {
        step("Fetching Pinocchio's C++ library from PyPI (once, about 60 MB)");
        let mut pip = pip("install");
        pip.args(["--only-binary=:all:", "--target"]);
        pip.arg(&packages).arg("--requirement").arg(&requirements);
        run(&mut pip, PIP_REMEDY)
    })?;
    let prefix = packages.join("cmeel.prefix");
    let code = source("pinocchio.cpp");
    let built = folder().join("pinocchio-peer");
    let library = built.join("libpinocchio_peer.so");
    once(&built, &read(&code)?, || {
        step("Compiling the Pinocchio peer (once, a minute or two)");
        let mut gxx = gxx(&library);
        // The wheel's Boost is configured for longer type lists than Boost's own headers.
        gxx.args([
            "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
            "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
        ]);
        for include in ["include", "include/eigen3", "include/urdfdom_headers"] {
            gxx.arg("-isystem").arg(prefix.join(include));
        }
        gxx.arg(&code).arg("-L").arg(prefix.join("lib"));
        gxx.args(["-lpinocchio_default", "-lpinocchio_parsers"]);
        let lib = fs::canonicalize(prefix.join("lib"))?;
        gxx.arg(format!("-Wl,-rpath,{0},-rpath-link,{0}", lib.display()));
        run(&mut gxx, GXX_REMEDY)
    })?;
    Ok(library)
}

/// Ruckig's source and the interface of `ruckig.cpp`: a shared library.
///
/// # Errors
/// As for [`pinocchio`].
pub fn ruckig() -> anyhow::Result<PathBuf> {
    const VERSION: &str = "0.19.4";
    let folder = folder();
    let archive = folder.join("ruckig-source");
    once(&archive, VERSION, || {
        step("Fetching Ruckig's source from PyPI (once)");
        let mut pip = pip("download");
        pip.args(["--no-binary", "ruckig", "--dest"]).arg(&archive);
        run(pip.arg(format!("ruckig=={VERSION}")), PIP_REMEDY)?;
        let mut tar = Command::new("tar");
        tar.arg("-xzf");
        tar.arg(archive.join(format!("ruckig-{VERSION}.tar.gz")));
        run(tar.arg("-C").arg(&archive), "install tar")
    })?;
    let tree = archive.join(format!("ruckig-{VERSION}"));
    let code = source("ruckig.cpp");
    let built = folder.join("ruckig-peer");
    let library = built.join("libruckig_peer.so");
    once(&built, &(VERSION.to_owned() + &read(&code)?), || {
        step("Compiling the Ruckig peer (once)");
        let mut gxx = gxx(&library);
        gxx.arg("-isystem").arg(tree.join("include")).arg(&code);
        gxx.args(ruckig_sources(&tree.join("src/ruckig"))?);
        run(&mut gxx, GXX_REMEDY)
    })?;
    Ok(library)
}

/// The control loop in C of the benchmark `ffi`: a shared library.
///
/// # Errors
/// Where the compiler is missing or fails.
pub fn ffi_loop() -> anyhow::Result<PathBuf> {
    let code = source("ffi_loop.c");
    let header = root().join("fitmac-capi/include");
    let built = folder().join("ffi-loop");
    let library = built.join("libffi_loop.so");
    let made_from = read(&code)? + &read(&header.join("fitmac.h"))?;
    once(&built, &made_from, || {
        let mut cc = Command::new("cc");
        cc.args(["-std=c11", "-O2", "-fPIC", "-shared", "-o"]);
        cc.arg(&library).arg("-I").arg(&header).arg(&code);
        run(&mut cc, "check that a C compiler is installed as cc")
    })?;
    Ok(library)
}

/// The interpreter of the test oracles' environment.
///
/// # Errors
/// Where there is none, with the remedy.
pub fn python() -> anyhow::Result<PathBuf> {
    let environment = std::env::var_os("FITMAC_VENV");
    let environment = environment.map_or_else(|| root().join(".venv"), PathBuf::from);
    let python = environment.join("bin/python");
    if !python.exists() {
        bail!(
            "no Python with numpy and maturin at {}: run `cargo xtask test`, which makes it, or \
             leave Python out with --no-python",
            python.display()
        );
    }
    Ok(python)
}

/// The Python package, installed by pip from this tree, optimised: a folder of packages.
///
/// # Errors
/// Where there is no Python, or the package does not build.
pub fn python_package() -> anyhow::Result<PathBuf> {
    step("Building the Python package (a minute or two where it has changed)");
    let packages = folder().join("python-packages");
    let python = python()?;
    let tools = python.parent().unwrap_or(&python).as_os_str().to_owned();
    let mut path = tools;
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap_or_default());
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "--disable-pip-version-check", "install"]);
    pip.args(["--quiet", "--no-deps", "--no-build-isolation", "--upgrade"]);
    pip.arg("--target").arg(&packages).arg(".");
    pip.current_dir(root()).env("PATH", path);
    run(
        &mut pip,
        "run `cargo xtask test` once, which installs what it needs",
    )?;
    Ok(packages)
}

/// Ruckig's own source files: not its Python module and not its client of an online service.
fn ruckig_sources(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let shown = folder.display();
    let entries = fs::read_dir(folder).with_context(|| format!("{shown} cannot be read"))?;
    let mut sources = Vec::new();
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.ends_with(".cpp") && !["python.cpp", "cloud_client.cpp"].contains(&name.as_ref()) {
            sources.push(path);
        }
    }
    if sources.is_empty() {
        bail!("{shown} has no C++ sources: delete target/bench-peers and run this again");
    }
    sources.sort();
    Ok(sources)
}

const PIP_REMEDY: &str = "check that Python 3 with pip is installed (Debian, Ubuntu: `apt-get \
                          install python3 python3-pip`) and that PyPI can be reached";
const GXX_REMEDY: &str = "check that a C++20 compiler is installed as g++ (Debian, Ubuntu: \
                          `apt-get install g++`)";

fn pip(verb: &str) -> Command {
    let mut pip = Command::new("python3");
    pip.args(["-m", "pip", "--disable-pip-version-check", verb]);
    pip.args(["--quiet", "--retries=2", "--no-deps"]);
    pip
}

fn gxx(library: &Path) -> Command {
    let mut gxx = Command::new("g++");
    gxx.args(["-std=c++20", "-O3", "-DNDEBUG", "-fPIC", "-shared", "-o"]);
    gxx.arg(library);
    gxx
}

/// Does `work` for `folder` unless it was done from the same `made_from`.
fn once(
    folder: &Path,
    made_from: &str,
    work: impl FnOnce() -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let note = folder.join("made-from.txt");
    if fs::read_to_string(&note).is_ok_and(|made| made == made_from) {
        return Ok(());
    }
    let unwritable = || format!("{} cannot be written", folder.display());
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            return Err(error).with_context(unwritable);
        }
        _ => {}
    }
    fs::create_dir_all(folder).with_context(unwritable)?;
    work()?;
    fs::write(&note, made_from).with_context(unwritable)
}

/// Runs a command whose chatter must not mix with the figures.
fn run(command: &mut Command, remedy: &str) -> anyhow::Result<()> {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command.stdin(Stdio::null()).output();
    let output = output.with_context(|| format!("{program} could not be started: {remedy}"))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        let begin = said.char_indices().rev().nth(4000).map_or(0, |(at, _)| at);
        bail!("{program} failed: {remedy}. It said:\n{}", &said[begin..]);
    }
    Ok(())
}

fn read(file: &Path) -> anyhow::Result<String> {
    fs::read_to_string(file).with_context(|| format!("{} cannot be read", file.display()))
}

fn step(what: &str) {
    eprintln!("==> {what}");
}
