//! The library as a C or C++ program finds it: installed, linked by CMake and
//! by pkg-config, with the same answers as the Rust core.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use fitmac_core::wire::Route;
use fitmac_tests::{
    link::{assert_same_bytes, blocks, install, recordings, run, tool},
    oracle::workspace_root,
};

fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the folder can be made");
    folder
}

/// Installed, then moved: nothing may remember where it was built or installed.
fn installed(folder: &Path) -> PathBuf {
    let (first, prefix) = (folder.join("first"), folder.join("prefix"));
    install(&first);
    fs::rename(&first, &prefix).expect("the tree can be moved");
    prefix
}

fn pkg_config(prefix: &Path, asked: &[&str]) -> Vec<String> {
    let flags = run(Command::new(tool("pkgconf"))
        .args(asked)
        .arg("fitmac")
        .env("PKG_CONFIG_PATH", prefix.join("lib/pkgconfig")));
    flags.split_whitespace().map(str::to_owned).collect()
}

fn examples(prefix: &Path, build: &Path) {
    run(Command::new(tool("cmake"))
        .arg("-S")
        .arg(workspace_root().join("fitmac-capi/examples"))
        .arg("-B")
        .arg(build)
        .arg(format!("-DCMAKE_PREFIX_PATH={}", prefix.display())));
    run(Command::new(tool("cmake")).arg("--build").arg(build));
    let said = run(&mut Command::new(build.join("minimal")));
    assert!(said.starts_with("3000 commands, mode hold"), "{said}");
    let said = run(&mut Command::new(build.join("franka_loop")));
    assert!(said.contains("allocations in the loop 0"), "{said}");
    let said = run(&mut Command::new(build.join("ros2_controller")));
    assert!(said.contains("allocations in update 0"), "{said}");
}

/// The page's own program, built by the page's own lines.
fn as_the_page_says(prefix: &Path, folder: &Path) {
    let [program] = &blocks("link-cpp.md", "cpp")[..] else {
        panic!("one program")
    };
    let [lists] = &blocks("link-cpp.md", "cmake")[..] else {
        panic!("one CMakeLists.txt")
    };
    fs::create_dir_all(folder).expect("the folder can be made");
    fs::write(folder.join("main.cpp"), program).expect("it can be written");
    fs::write(folder.join("CMakeLists.txt"), lists).expect("it can be written");
    let [install, build] = &blocks("link-cpp.md", "sh")[..] else {
        panic!("two commands")
    };
    assert_eq!(install.trim(), "cargo xtask install --prefix /opt/fitmac"); // done above
    let line = build.replace("/opt/fitmac", &prefix.display().to_string());
    let cmake = tool("cmake");
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", cmake.parent().expect("a folder").display());
    let said = run(Command::new("sh")
        .args(["-ec", &line])
        .env("PATH", path)
        .current_dir(folder));
    assert_eq!(said.lines().last(), Some("mode hold"), "{said}");
}

/// Compiles the replaying host; `flags` come from pkg-config.
fn replaying_host(program: &Path, flags: &[String], last: &[&str]) {
    run(Command::new("g++")
        .args([
            "-std=c++17",
            "-O2",
            "-Wall",
            "-Wextra",
            "-Wpedantic",
            "-Werror",
        ])
        .arg(workspace_root().join("fitmac-capi/tests/cpp/replay.cpp"))
        .arg("-o")
        .arg(program)
        .args(flags)
        .args(last));
}

fn replays_to_the_bit(program: &Path, folder: &Path, library: &Path) {
    let mut routes = std::collections::BTreeSet::new();
    for recording in recordings() {
        let (inputs, outputs) = (folder.join("inputs"), folder.join("outputs"));
        fs::write(&inputs, &recording.inputs).expect("inputs can be written");
        let said = run(Command::new(program)
            .arg(&inputs)
            .arg(&outputs)
            .env("LD_LIBRARY_PATH", library));
        let expected = format!("ticks {}, allocations 0", recording.ticks);
        assert_eq!(said.trim(), expected);
        let got = fs::read(&outputs).expect("outputs can be read");
        assert_same_bytes(&recording.outputs, &got);
        routes.extend(recording.routes);
    }
    assert_eq!(
        routes.into_iter().collect::<Vec<_>>(),
        Route::ALL,
        "all routes"
    );
}

#[test]
fn an_installed_library_links_and_answers_as_the_core_does() {
    let folder = scratch("link-cpp");
    let prefix = installed(&folder);
    examples(&prefix, &folder.join("build"));
    as_the_page_says(&prefix, &folder.join("page"));
    let library = prefix.join("lib");

    let shared = folder.join("replay-shared");
    let flags = pkg_config(&prefix, &["--cflags", "--libs"]);
    replaying_host(&shared, &flags, &[]);
    replays_to_the_bit(&shared, &folder, &library);

    let fixed = folder.join("replay-static");
    let flags = pkg_config(&prefix, &["--cflags", "--libs", "--static"]);
    let flags: Vec<String> = flags
        .into_iter()
        .map(|flag| {
            if flag == "-lfitmac" {
                "-l:libfitmac.a".to_owned()
            } else {
                flag
            }
        })
        .collect();
    replaying_host(&fixed, &flags, &[]);
    replays_to_the_bit(&fixed, &folder, Path::new("/nowhere"));
}
