//! MuJoCo's library, from its PyPI wheel.
//!
//! The library is staged in a folder of its own and moved into place by one
//! rename, so that a kill at any moment leaves either nothing or all of it.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use sha2::{Digest, Sha256};

use crate::{
    process::step,
    python::Python,
    workspace::{Workspace, not_writable},
};

const VERSION: &str = "3.17.0";
const LIBRARY: &str = "libmujoco.so.3.17.0";
/// The wheel for CPython 3.11 on x86-64 Linux, as PyPI lists it. Any wheel of
/// this version holds the same library; one is pinned so that it can be checked
/// before it is opened.
const WHEEL_SHA256: &str = "d66928d86a2d1b601bbaa4dc11db50214d17d5301bb8afd84721313b67ff0874";
const LIBRARY_SHA256: &str = "23496b023ee80fb61ab71167e94bc649f9941710fde96b18bb8204fb332523ad";
const STAGING_PREFIX: &str = "staging-";

/// Whether the library is in place and is the right one.
pub(crate) fn is_installed(workspace: &Workspace) -> bool {
    let lib = workspace.mujoco().join("lib");
    let linked = fs::read_link(lib.join("libmujoco.so")).is_ok_and(|to| to == Path::new(LIBRARY));
    linked && sha256(&lib.join(LIBRARY)).is_ok_and(|found| found == LIBRARY_SHA256)
}

/// Makes sure that the library is in place; fetches it if it is not.
pub(crate) fn install(workspace: &Workspace) -> anyhow::Result<()> {
    if is_installed(workspace) {
        return Ok(());
    }
    if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        bail!(
            "MuJoCo {VERSION} is fetched for x86-64 Linux only: on this machine put \
             libmujoco.so of that version somewhere and set MUJOCO_DYNAMIC_LINK_DIR to its folder"
        );
    }
    let home = workspace.mujoco();
    fs::create_dir_all(&home).map_err(|error| not_writable(&home, &error))?;
    let _lock = lock(&home)?;
    if is_installed(workspace) {
        return Ok(()); // another command fetched it while we waited
    }
    remove_leftovers(&home)?;
    let staging = Staging::create(&home)?;

    step(&format!(
        "Fetching MuJoCo {VERSION} from PyPI (26 MB, once)"
    ));
    let python = Python::find()?;
    python.require_pip()?;
    let wheel = download(&python, &staging.0)?;
    check(&wheel, WHEEL_SHA256)?;
    let lib = staging.0.join("lib");
    unpack(&python, &wheel, &lib)?;
    check(&lib.join(LIBRARY), LIBRARY_SHA256)?;
    std::os::unix::fs::symlink(LIBRARY, lib.join("libmujoco.so"))
        .map_err(|error| not_writable(&lib, &error))?;

    let place = home.join("lib");
    if place.exists() {
        step(&format!(
            "{} is damaged: replacing it",
            workspace.shown(&place)
        ));
        let aside = staging.0.join("damaged");
        fs::rename(&place, aside).map_err(|error| not_writable(&place, &error))?;
    }
    fs::rename(&lib, &place).map_err(|error| not_writable(&place, &error))?;
    step(&format!(
        "MuJoCo {VERSION} is in {}",
        workspace.shown(&place)
    ));
    Ok(())
}

/// A folder that goes away with its holder, unless the process is killed.
struct Staging(PathBuf);

impl Staging {
    fn create(home: &Path) -> anyhow::Result<Self> {
        let folder = home.join(format!("{STAGING_PREFIX}{}", std::process::id()));
        fs::create_dir(&folder).map_err(|error| not_writable(&folder, &error))?;
        Ok(Self(folder))
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        // What stays behind is removed by the next run.
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Lets one set-up at a time work in the folder; the system frees the lock with
/// the file, also after a kill.
fn lock(home: &Path) -> anyhow::Result<File> {
    let path = home.join(".lock");
    let file = File::create(&path).map_err(|error| not_writable(home, &error))?;
    file.lock()
        .with_context(|| format!("{} cannot be locked", path.display()))?;
    Ok(file)
}

/// Removes what a killed set-up left. Called under the lock: no other is at work.
fn remove_leftovers(home: &Path) -> anyhow::Result<()> {
    for entry in fs::read_dir(home).map_err(|error| not_writable(home, &error))? {
        let entry = entry?;
        if entry
            .file_name()
            .to_string_lossy()
            .starts_with(STAGING_PREFIX)
        {
            fs::remove_dir_all(entry.path()).map_err(|error| not_writable(home, &error))?;
        }
    }
    Ok(())
}

fn download(python: &Python, folder: &Path) -> anyhow::Result<PathBuf> {
    let requirement = format!("mujoco=={VERSION}");
    let mut arguments = vec![
        "download",
        "--no-deps",
        "--only-binary=:all:",
        "--retries=2",
    ];
    arguments.extend(["--python-version=3.11", "--platform=manylinux_2_28_x86_64"]);
    arguments.extend([&requirement, "--dest"]);
    let arguments = arguments
        .into_iter()
        .map(AsRef::as_ref)
        .chain([folder.as_os_str()]);
    if !python.pip(arguments)? {
        bail!(
            "pip could not fetch MuJoCo {VERSION} (its reason is above): check the network or the \
             proxy, or set PIP_FIND_LINKS to a folder that holds the wheel, and run this again"
        );
    }
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "whl") {
            return Ok(path);
        }
    }
    bail!("pip said that it fetched MuJoCo {VERSION}, but left no wheel: run this again")
}

fn unpack(python: &Python, wheel: &Path, lib: &Path) -> anyhow::Result<()> {
    const CODE: &str = "
import pathlib, sys, zipfile
wheel, member, folder = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
folder.mkdir()
(folder / pathlib.PurePosixPath(member).name).write_bytes(zipfile.ZipFile(wheel).read(member))
";
    let mut command = python.command(["-c", CODE]);
    command.arg(wheel).arg(format!("mujoco/{LIBRARY}")).arg(lib);
    let output = command.output().context("Python could not be started")?;
    if !output.status.success() {
        let text = String::from_utf8_lossy(&output.stderr);
        let reason = text.lines().last().unwrap_or("no reason given");
        bail!("the wheel could not be unpacked ({reason}): make room on the disk, run this again");
    }
    Ok(())
}

/// Checks a file against the SHA-256 that this version was tested with.
fn check(file: &Path, expected: &str) -> anyhow::Result<()> {
    let found = sha256(file).with_context(|| format!("{} cannot be read", file.display()))?;
    if found != expected {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        bail!(
            "{name} has the wrong checksum (SHA-256 {found}, expected {expected}) and was thrown \
             away: clear pip's cache (`python3 -m pip cache purge`), make sure that pip asks PyPI \
             and no altered mirror, and run this again"
        );
    }
    Ok(())
}

fn sha256(file: &Path) -> io::Result<String> {
    let mut file = File::open(file)?;
    let mut hasher = Sha256::new();
    let mut block = vec![0; 1 << 16];
    loop {
        let count = file.read(&mut block)?;
        if count == 0 {
            break;
        }
        hasher.update(&block[..count]);
    }
    Ok(hasher
        .finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect())
}
