//! What `cargo xtask setup` says when something is missing: one sentence that
//! names the remedy, a failure status, and nothing half done left behind.
//!
//! The tests start the program itself, on a folder of their own, with a PATH
//! and a pip configuration of their own. None needs the network.

use std::{
    fs,
    os::unix::{fs::PermissionsExt, process::CommandExt},
    path::{Path, PathBuf},
    process::{Command, Output},
};

const XTASK: &str = env!("CARGO_BIN_EXE_xtask");

/// `setup` on `root`, with pip cut off from the network and from caches.
fn setup(root: &Path) -> Command {
    let mut command = Command::new(XTASK);
    command.arg("--root").arg(root).arg("setup");
    command
        .env_remove("PIP_FIND_LINKS")
        .env("PIP_NO_CACHE_DIR", "1");
    command
        .env("PIP_INDEX_URL", "http://127.0.0.1:9/simple")
        .env("PIP_TIMEOUT", "2");
    command
}

/// The command's last line on standard error, which must be the only one of
/// xtask's own.
fn complaint(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let stderr = String::from_utf8_lossy(&output.stderr);
    let own: Vec<&str> = stderr
        .lines()
        .filter(|line| line.starts_with("xtask: "))
        .collect();
    assert_eq!(own.len(), 1, "one sentence, not {own:?}");
    assert_eq!(stderr.lines().last(), own.first().copied(), "the last word");
    own[0].to_owned()
}

fn assert_says(complaint: &str, parts: &[&str]) {
    for part in parts {
        assert!(
            complaint.contains(part),
            "{complaint:?} does not say {part:?}"
        );
    }
}

/// Nothing but the lock file may stay in the folder that set-up works in.
fn assert_nothing_half_done(root: &Path) {
    let home = root.join("third_party/mujoco");
    let left = fs::read_dir(&home)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.file_name());
    let left: Vec<_> = left.filter(|name| name != ".lock").collect();
    assert!(left.is_empty(), "left behind: {left:?}");
}

fn executable(path: &Path, text: &str) {
    fs::write(path, text).unwrap();
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
}

#[test]
fn without_python_it_says_what_to_install() {
    let root = tempfile::tempdir().unwrap();
    let empty = tempfile::tempdir().unwrap();
    let output = setup(root.path())
        .env("PATH", empty.path())
        .output()
        .unwrap();
    let said = complaint(&output);
    assert_says(
        &said,
        &[
            "Python 3.9 or newer is not on the PATH",
            "apt-get install python3",
        ],
    );
    assert_nothing_half_done(root.path());
}

#[test]
fn without_pip_it_says_what_to_install() {
    let root = tempfile::tempdir().unwrap();
    let bin = tempfile::tempdir().unwrap();
    let fake = "#!/bin/sh\n[ \"$2\" = pip ] && exit 1\nexit 0\n";
    executable(&bin.path().join("python3"), fake);
    let output = setup(root.path()).env("PATH", bin.path()).output().unwrap();
    assert_says(
        &complaint(&output),
        &["its pip is not", "apt-get install", "python3-pip"],
    );
    assert_nothing_half_done(root.path());
}

#[test]
fn without_network_it_says_so_and_leaves_nothing() {
    let root = tempfile::tempdir().unwrap();
    let output = setup(root.path()).output().unwrap();
    let said = complaint(&output);
    assert_says(
        &said,
        &[
            "could not fetch MuJoCo 3.17.0",
            "check the network",
            "PIP_FIND_LINKS",
        ],
    );
    assert_nothing_half_done(root.path());
}

/// A wheel that pip takes for MuJoCo's, with another library in it.
fn foreign_wheel(folder: &Path) {
    const CODE: &str = "
import sys, zipfile
info = 'mujoco-3.17.0.dist-info/'
tags = 'cp311-cp311-manylinux_2_28_x86_64'
with zipfile.ZipFile(f'{sys.argv[1]}/mujoco-3.17.0-{tags}.whl', 'w') as wheel:
    wheel.writestr('mujoco/libmujoco.so.3.17.0', b'not MuJoCo')
    wheel.writestr(info + 'METADATA', 'Metadata-Version: 2.1\\nName: mujoco\\nVersion: 3.17.0\\n')
    wheel.writestr(info + 'WHEEL', f'Wheel-Version: 1.0\\nRoot-Is-Purelib: false\\nTag: {tags}\\n')
    wheel.writestr(info + 'RECORD', '')
";
    let status = Command::new("python3")
        .args(["-c", CODE])
        .arg(folder)
        .status()
        .unwrap();
    assert!(status.success());
}

#[test]
fn a_wrong_checksum_is_refused_before_the_wheel_is_opened() {
    let root = tempfile::tempdir().unwrap();
    let wheels = tempfile::tempdir().unwrap();
    foreign_wheel(wheels.path());
    let mut command = setup(root.path());
    command
        .env("PIP_NO_INDEX", "1")
        .env("PIP_FIND_LINKS", wheels.path());
    let said = complaint(&command.output().unwrap());
    assert_says(
        &said,
        &[
            "has the wrong checksum",
            "expected d66928d8",
            "pip cache purge",
        ],
    );
    assert_nothing_half_done(root.path());
}

#[test]
fn a_damaged_library_does_not_count_as_installed() {
    let root = tempfile::tempdir().unwrap();
    let lib = root.path().join("third_party/mujoco/lib");
    fs::create_dir_all(&lib).unwrap();
    fs::write(lib.join("libmujoco.so.3.17.0"), "cut off").unwrap();
    std::os::unix::fs::symlink("libmujoco.so.3.17.0", lib.join("libmujoco.so")).unwrap();
    let said = complaint(&setup(root.path()).output().unwrap());
    assert_says(&said, &["could not fetch MuJoCo 3.17.0"]);
    assert!(lib.exists(), "kept until there is a better one");
}

#[test]
fn what_a_killed_set_up_left_is_removed() {
    let root = tempfile::tempdir().unwrap();
    let leftover = root.path().join("third_party/mujoco/staging-1");
    fs::create_dir_all(&leftover).unwrap();
    fs::write(leftover.join("half.whl"), "half").unwrap();
    complaint(&setup(root.path()).output().unwrap());
    assert_nothing_half_done(root.path());
}

/// A user that may write nowhere in `root`: root itself may write everywhere,
/// so a test that runs as root steps down to another user.
fn as_a_stranger(root: &Path) -> (Command, PathBuf) {
    fs::set_permissions(root, fs::Permissions::from_mode(0o555)).unwrap();
    // The program may lie where only root can read.
    let copy = std::env::temp_dir().join(format!("xtask-{}", std::process::id()));
    fs::copy(XTASK, &copy).unwrap();
    let mut command = Command::new(&copy);
    command.arg("--root").arg(root).arg("setup");
    if rustix::process::geteuid().is_root() {
        command.uid(65534).gid(65534);
    }
    (command, copy)
}

#[test]
fn a_read_only_folder_is_named_before_anything_is_fetched() {
    let root = tempfile::tempdir().unwrap();
    let (mut command, copy) = as_a_stranger(root.path());
    let output = command.output();
    fs::remove_file(copy).unwrap();
    let said = complaint(&output.unwrap());
    assert_says(
        &said,
        &["third_party/mujoco cannot be written", "make it writable"],
    );
}
