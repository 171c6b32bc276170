//! The evaluation: reproducible, resumable, loses nothing.

use std::path::Path;
use std::slice;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use sim_harness::evaluation::{
    CORE_VERSION, Config, Destination, EpisodeRecord, Grid, Knowledge, Moment, Profile, Progress,
    Shard, Store, Summary, Vision, Watch, play_watched, run,
};
use sim_harness::lockstep::Ticked;
use sim_harness::perturb::{Level, Perturbation};
use sim_harness::sim::Sim;

fn grid(episodes: u32) -> Grid {
    Grid {
        suites: vec!["object".to_owned()],
        tasks: vec!["butter".to_owned()],
        perturbations: vec![(Perturbation::Pos, Level::Standard)],
        backbones: vec!["openvla-like".to_owned()],
        configs: vec![
            Config::parse("base").unwrap(),
            Config::parse("full").unwrap(),
        ],
        profiles: vec![Profile::Guarded],
        visions: vec![Vision::Modelled],
        knowledges: vec![Knowledge::Agents],
        seeds: vec![1000],
        episodes,
    }
}

fn run_all(grid: &Grid, folder: &Path, jobs: usize) -> Summary {
    let destination = Destination::whole(folder);
    run(
        slice::from_ref(grid),
        &destination,
        jobs,
        &AtomicBool::new(false),
        &|_| {},
    )
    .unwrap()
}

fn text(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("episodes-0-of-1.jsonl")).unwrap()
}

#[test]
fn one_worker_or_two_write_the_same_bytes() {
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let summary = run_all(&grid(2), one.path(), 1);
    assert_eq!((summary.total, summary.run, summary.stopped), (4, 4, false));
    run_all(&grid(2), two.path(), 2);
    assert_eq!(text(one.path()), text(two.path()));
    let records = Store::load(one.path()).unwrap();
    let successes = |config: &str| {
        records
            .iter()
            .filter(|r| r.config == config && r.success)
            .count()
    };
    assert_eq!(
        successes("base"),
        0,
        "the policy alone takes the distractor"
    );
    assert!(successes("full") > 0, "the controller saves some");
    assert!(records.iter().all(|r| r.intervened == (r.config == "full")));
    assert!(records.iter().all(|r| r.success == r.failure.is_none()));
}

#[test]
fn a_kill_in_the_middle_loses_no_finished_episode() {
    let folder = tempfile::tempdir().unwrap();
    let stop = AtomicBool::new(false);
    let finished = AtomicUsize::new(0);
    let one = |progress: Progress<'_>| {
        if progress.last.is_some() {
            finished.fetch_add(1, Ordering::Relaxed);
            stop.store(true, Ordering::Relaxed);
        }
    };
    let whole = Destination::whole(folder.path());
    let summary = run(&[grid(2)], &whole, 1, &stop, &one).unwrap();
    assert!(summary.stopped && summary.run == finished.load(Ordering::Relaxed));
    let before = text(folder.path());
    assert_eq!(before.lines().count(), summary.run);
    // A kill while a line is written leaves half of it.
    let path = folder.path().join("episodes-0-of-1.jsonl");
    std::fs::write(&path, format!("{before}{{\"suite\":\"obj")).unwrap();
    let rest = run_all(&grid(2), folder.path(), 2);
    assert_eq!((rest.found, rest.run), (summary.run, 4 - summary.run));
    assert!(
        before
            .lines()
            .all(|line| text(folder.path()).contains(line))
    );
    assert_eq!(Store::load(folder.path()).unwrap().len(), 4);
    // Nothing is left to do.
    assert_eq!(run_all(&grid(2), folder.path(), 1).run, 0);
}

#[test]
fn shards_cover_the_grid_once() {
    let keys = |shard: Shard| -> Vec<String> {
        grid(5)
            .episodes()
            .unwrap()
            .iter()
            .enumerate()
            .filter(|(i, _)| *i as u32 % shard.count == shard.index)
            .map(|(_, spec)| spec.key())
            .collect()
    };
    let mut all: Vec<String> = (0..3)
        .flat_map(|i| keys(Shard { index: i, count: 3 }))
        .collect();
    all.sort();
    let mut whole = keys(Shard::WHOLE);
    whole.sort();
    assert_eq!(all, whole);
    assert!(Shard::parse("3/3").is_err() && Shard::parse("x").is_err());
    assert_eq!(Shard::parse("2/3").unwrap(), Shard { index: 2, count: 3 });
}

#[test]
fn what_goes_wrong_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("episodes-0-of-1.jsonl");
    std::fs::write(&path, "{\"suite\": 3}\n").unwrap();
    let error = Store::open(&Destination::whole(folder.path()))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("episodes-0-of-1.jsonl") && error.contains("line 1"),
        "{error}"
    );
    let unknown = Grid {
        backbones: vec!["gpt".to_owned()],
        ..grid(1)
    };
    assert!(
        unknown
            .episodes()
            .unwrap_err()
            .to_string()
            .contains("openvla-like")
    );
    let unknown = Grid {
        suites: vec!["goal".to_owned()],
        ..grid(1)
    };
    assert!(
        unknown
            .episodes()
            .unwrap_err()
            .to_string()
            .contains("spatial")
    );
    let unknown = Grid {
        tasks: vec!["soap".to_owned()],
        ..grid(1)
    };
    assert!(
        unknown
            .episodes()
            .unwrap_err()
            .to_string()
            .contains("alphabet_soup")
    );
    let read_only = Path::new("/proc/nowhere");
    let error = Store::open(&Destination::whole(read_only))
        .unwrap_err()
        .to_string();
    assert!(error.contains("/proc/nowhere"), "{error}");
}

#[test]
fn results_of_another_build_are_refused_unless_they_are_accepted() {
    let folder = tempfile::tempdir().unwrap();
    run_all(&grid(1), folder.path(), 2);
    let path = folder.path().join("episodes-0-of-1.jsonl");
    let older = text(folder.path()).replace(CORE_VERSION, "0.1.0+00000000cafe");
    std::fs::write(&path, &older).unwrap();
    let whole = Destination::whole(folder.path());
    let error = Store::open(&whole).unwrap_err();
    assert!(error.is_bad_input());
    let message = error.to_string();
    let named = [
        CORE_VERSION,
        "episodes-0-of-1.jsonl",
        "--accept-build 0.1.0+00000000cafe",
    ];
    assert!(named.iter().all(|n| message.contains(n)), "{message}");
    let accepted = ["0.1.0+00000000cafe".to_owned()];
    let accepting = Destination {
        accepted_builds: &accepted,
        ..whole
    };
    let none = AtomicBool::new(false);
    let summary = run(&[grid(1)], &accepting, 1, &none, &|_| {}).unwrap();
    assert_eq!((summary.found, summary.run), (2, 0));
    assert_eq!(text(folder.path()), older, "who played them is not changed");
}

#[test]
fn grids_play_once_what_they_have_in_common() {
    let folder = tempfile::tempdir().unwrap();
    let none = AtomicBool::new(false);
    let both = [grid(1), grid(2)];
    let summary = run(&both, &Destination::whole(folder.path()), 2, &none, &|_| {}).unwrap();
    assert_eq!((summary.total, summary.run), (4, 4));
}

#[test]
fn two_programs_do_not_write_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let whole = Destination::whole(folder.path());
    let first = Store::open(&whole).unwrap();
    let error = Store::open(&whole).unwrap_err().to_string();
    assert!(error.contains("another evaluation writes there"), "{error}");
    let half = Shard { index: 0, count: 2 };
    let beside = Destination {
        shard: half,
        ..whole
    };
    Store::open(&beside).expect("another share has a file of its own");
    drop(first);
    Store::open(&whole).expect("the first has ended");
}

#[test]
fn a_folder_of_shares_is_found_by_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let whole = Destination::whole(folder.path());
    for index in 0..2 {
        let shard = Shard { index, count: 2 };
        let share = Destination { shard, ..whole };
        run(&[grid(1)], &share, 1, &AtomicBool::new(false), &|_| {}).unwrap();
    }
    assert_eq!(run_all(&grid(1), folder.path(), 1).run, 0);
}

/// Everything that the controller commanded, told and was told of in an episode.
#[derive(Default)]
struct Tape(String);

impl Watch for Tape {
    fn tick(&mut self, world: &mut Sim, ticked: &Ticked) {
        use std::fmt::Write as _;
        // The shortest text that reads back as the same number: equal texts are equal bits.
        let _ = writeln!(self.0, "{ticked:?} {:?}", world.robot());
    }

    fn moment(&mut self, _: &mut Sim, _: u64, _: Moment) {}
}

/// A target scaled by 1 is the nominal scene under another label.
#[test]
fn the_same_scene_under_two_labels_is_played_alike() {
    let labelled = |perturbation, level, config| {
        let grid = Grid {
            perturbations: vec![(perturbation, level)],
            configs: vec![Config::parse(config).unwrap()],
            ..grid(1)
        };
        let mut tape = Tape::default();
        let record = play_watched(&grid.episodes().unwrap()[0], &mut tape).unwrap();
        (record, tape.0)
    };
    for config in ["base", "full"] {
        let (plain, tape) = labelled(Perturbation::None, Level::Standard, config);
        let (scaled, other) = labelled(Perturbation::Obj, Level::Scaled(1.0), config);
        assert!(tape.lines().count() > 1000 && tape == other);
        assert_ne!(plain.key(), scaled.key());
        let relabelled = EpisodeRecord {
            perturbation: plain.perturbation.clone(),
            level: plain.level.clone(),
            drawn: plain.drawn.clone(),
            ..scaled
        };
        assert_eq!(plain, relabelled);
    }
}
