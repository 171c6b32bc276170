//! The Python package: installed by pip from the clone, tested as a user meets
//! it, with the same answers as the Rust core.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use fitmac_core::{
    Params,
    message::{
        ActionChunk, CriticReport, GroundingRecord, Input, Plan, StateSample, VerifierReport,
    },
};
use fitmac_core_tests::world::{Agent, Behaviour, Policy, Scene, Session};
use fitmac_rt::{
    config,
    frame::{Parts, Tick, TickHead},
    replay::{Parting, replay},
    trace::{TraceReader, TraceWriter},
};
use fitmac_tests::{
    link::{assert_same_bytes, blocks, recordings, run, tool},
    oracle::{python, workspace_root},
};

/// Two episodes as `fitmac eval` writes them, shortened.
const RESULTS: &str = concat!(
    r#"{"schema":1,"suite":"object","task":"milk","perturbation":"pos","level":"standard","#,
    r#""backbone":"openvla-like","config":"full","profile":"guarded","perception":"truth","#,
    r#""knowledge":"agents","seed":7,"episode":0,"success":true,"intervened":true}"#,
    "\n",
    r#"{"schema":1,"suite":"object","task":"milk","perturbation":"pos","level":"standard","#,
    r#""backbone":"openvla-like","config":"full","profile":"guarded","perception":"truth","#,
    r#""knowledge":"agents","seed":7,"episode":1,"success":false,"intervened":true}"#,
    "\n",
);
/// Ticks of the replayed trace.
const TICKS: u64 = 2000;

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

/// Ticks of a policy that stalls above the can, as the recorder gets them.
fn stalled_ticks() -> Vec<Tick> {
    let scene = Scene::can_to_plate();
    let agent = Agent::knowing(&scene);
    let policy = Policy::new(Behaviour::StallsAbove(0.05));
    let mut session = Session::new(Params::guarded(), scene, policy, agent);
    let tick = |number: u64| {
        let mut told = None;
        let output = session.tick_with(|input| told = Some(Told::of(input)));
        let told = told.expect("the core is told something");
        let head = TickHead {
            tick: number,
            now_ns: session.world.now_ns(),
            ..TickHead::default()
        };
        let mut bytes = Vec::new();
        Parts::of(head, &told.input(), &output).for_each(|part| bytes.extend_from_slice(part));
        Tick::decode(&bytes).expect("a whole frame")
    };
    (1..=TICKS).map(tick).collect()
}

/// What the core was told, kept.
struct Told {
    state: Option<StateSample>,
    chunk: Option<ActionChunk>,
    grounding: Option<GroundingRecord>,
    plan: Option<Plan>,
    verifier: Option<VerifierReport>,
    critic: Option<CriticReport>,
    request: u8,
}

impl Told {
    fn of(input: &Input<'_>) -> Self {
        Self {
            state: input.state.copied(),
            chunk: input.chunk.copied(),
            grounding: input.grounding.copied(),
            plan: input.plan.copied(),
            verifier: input.verifier.copied(),
            critic: input.critic.copied(),
            request: input.request,
        }
    }

    fn input(&self) -> Input<'_> {
        Input {
            state: self.state.as_ref(),
            chunk: self.chunk.as_ref(),
            grounding: self.grounding.as_ref(),
            plan: self.plan.as_ref(),
            verifier: self.verifier.as_ref(),
            critic: self.critic.as_ref(),
            request: self.request,
        }
    }
}

/// A trace as `fitmac rt` records it is replayed by Python as by Rust, and a what-if parts at the
/// same tick.
fn replays_agree(folder: &Path, ask: impl Fn(&[&str]) -> String) {
    let path = folder.join("run.mcap");
    let params = Params::guarded().validate().expect("the profile is valid");
    let metadata = [("params".to_owned(), config::to_text(&params))].into();
    let file = fs::File::create(&path).expect("a file");
    let mut writer = TraceWriter::new(file, &metadata).expect("a trace");
    for tick in stalled_ticks() {
        writer.tick(&tick).expect("written");
    }
    writer.finish().expect("written");
    let path = path.display().to_string();

    assert_eq!(ask(&[&path]), format!("{TICKS} 0 None\n-\n-\n"));
    let other = config::assign(&params, &["gate.failure_streak=2"]).expect("valid");
    let found = replay(
        &mut TraceReader::open(path.as_ref()).expect("a trace"),
        other,
    );
    let (first, (decision, _)) = (
        found.first.expect("parts"),
        found.first_decision.expect("parts"),
    );
    let place = |parting: &Parting| {
        let field = parting.difference.as_ref().map_or("", |d| &d.field);
        format!("{} {}.{field}", parting.tick, parting.what)
    };
    let expected = format!(
        "{TICKS} {} None\n{}\n{}\n",
        found.different_ticks,
        place(&first),
        place(&decision)
    );
    assert_eq!(ask(&[&path, "gate.failure_streak=2"]), expected);

    // A file that ends in the middle is replayed up to there.
    let whole = fs::read(&path).expect("a trace");
    fs::write(&path, &whole[..whole.len() / 2]).expect("written");
    let said = ask(&[&path]);
    assert!(said.contains("cannot be read to its end"), "{said}");
    assert!(said.ends_with("\n-\n-\n"), "{said}");
    fs::write(&path, &whole).expect("written");
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

    replays_agree(&folder, |arguments| {
        ask(&[&[test("replay_trace.py").as_str()], arguments].concat())
    });

    // The page, with the files that it reads.
    fs::create_dir_all(folder.join("results")).expect("a folder");
    fs::write(folder.join("results/episodes-0-of-1.jsonl"), RESULTS).expect("results");
    let said = ask(&["-c", &blocks("wrap-python.md", "python").concat()]);
    assert!(said.starts_with("True "), "{said}");
    let parts = [
        "True (6, 7)\n".to_owned(),
        format!("True {TICKS} None\n"),
        "object pos full SR 50.0 [9.5, 90.5]".to_owned(),
    ];
    for part in parts {
        assert!(said.contains(&part), "{part:?} is not in: {said}");
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
