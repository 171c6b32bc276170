//! The Python package: installed by pip from the clone, tested as a user meets
//! it, with the same answers as the Rust core.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use fitmac_tests::{
    link::{assert_same_bytes, blocks, recordings, run, tool},
    oracle::{python, workspace_root},
};

/// `pip install .` into a folder; by the profile that the tests were built with,
/// to save a second build, and with the environment's own maturin.
fn installed(folder: &Path) -> PathBuf {
    let packages = folder.join("packages");
    let maturin = tool("maturin");
    let path = std::env::var("PATH").unwrap_or_default();
    run(Command::new(python())
        .args([
            "-m",
            "pip",
            "install",
            "--quiet",
            "--no-deps",
            "--no-build-isolation",
            "--target",
        ])
        .arg(&packages)
        .arg(".")
        .env("MATURIN_PEP517_ARGS", "--profile=dev")
        .env(
            "PATH",
            format!("{}:{path}", maturin.parent().expect("a folder").display()),
        )
        .current_dir(workspace_root()));
    packages
}

#[test]
fn the_package_installs_and_answers_as_the_core_does() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("link-python");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the folder can be made");
    let packages = installed(&folder);
    let ask = |arguments: &[&str]| {
        run(Command::new(python())
            .args(arguments)
            .env("PYTHONPATH", &packages)
            .env("MYPYPATH", &packages)
            .current_dir(&folder))
    };
    let tests = workspace_root().join("fitmac-python/tests");
    let test = |name: &str| tests.join(name).display().to_string();

    ask(&[&test("test_fitmac.py")]);

    let said = ask(&["-m", "fitmac.demo", "--seeds", "2"]);
    let rows: Vec<Vec<&str>> = said
        .lines()
        .skip(1)
        .map(|line| line.split_whitespace().collect())
        .collect();
    let shares: Vec<_> = rows
        .iter()
        .map(|row| row[row.len() - 3..row.len() - 1].to_vec())
        .collect();
    assert_eq!(
        shares,
        [["2/2", "2/2"], ["0/2", "2/2"], ["0/2", "2/2"]],
        "{said}"
    );

    let said = ask(&["-c", &blocks("wrap-python.md", "python").concat()]);
    assert!(said.starts_with("True "), "{said}");

    for recording in recordings() {
        let (inputs, outputs) = (folder.join("inputs"), folder.join("outputs"));
        fs::write(&inputs, &recording.inputs).expect("inputs can be written");
        let said = ask(&[&test("replay.py"), "inputs", "outputs"]);
        assert_eq!(said.trim(), format!("ticks {}", recording.ticks));
        assert_same_bytes(
            &recording.outputs,
            &fs::read(&outputs).expect("outputs can be read"),
        );
    }

    // The stubs say what the extension has, and the package fits them.
    ask(&[
        "-m",
        "mypy.stubtest",
        "--ignore-disjoint-bases",
        "fitmac._fitmac",
    ]);
    ask(&["-m", "mypy", "--strict", "-p", "fitmac"]);
}
