//! The evaluation: reproducible, resumable, loses nothing.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use sim_harness::evaluation::{
    Config, Grid, Knowledge, Profile, Progress, Shard, Store, Summary, Vision, run,
};
use sim_harness::perturb::{Level, Perturbation};

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

fn run_all(grid: &Grid, shard: Shard, folder: &Path, jobs: usize) -> Summary {
    run(grid, shard, folder, jobs, &AtomicBool::new(false), &|_| {}).unwrap()
}

fn text(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("episodes-0-of-1.jsonl")).unwrap()
}

#[test]
fn one_worker_or_two_write_the_same_bytes() {
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let summary = run_all(&grid(2), Shard::WHOLE, one.path(), 1);
    assert_eq!((summary.total, summary.run, summary.stopped), (4, 4, false));
    run_all(&grid(2), Shard::WHOLE, two.path(), 2);
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
    let summary = run(&grid(2), Shard::WHOLE, folder.path(), 1, &stop, &one).unwrap();
    assert!(summary.stopped && summary.run == finished.load(Ordering::Relaxed));
    let before = text(folder.path());
    assert_eq!(before.lines().count(), summary.run);
    // A kill while a line is written leaves half of it.
    let path = folder.path().join("episodes-0-of-1.jsonl");
    std::fs::write(&path, format!("{before}{{\"suite\":\"obj")).unwrap();
    let rest = run_all(&grid(2), Shard::WHOLE, folder.path(), 2);
    assert_eq!((rest.found, rest.run), (summary.run, 4 - summary.run));
    assert!(
        before
            .lines()
            .all(|line| text(folder.path()).contains(line))
    );
    assert_eq!(Store::load(folder.path()).unwrap().len(), 4);
    // Nothing is left to do.
    assert_eq!(run_all(&grid(2), Shard::WHOLE, folder.path(), 1).run, 0);
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
    let error = Store::open(folder.path(), Shard::WHOLE)
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
    let error = Store::open(read_only, Shard::WHOLE)
        .unwrap_err()
        .to_string();
    assert!(error.contains("/proc/nowhere"), "{error}");
}
