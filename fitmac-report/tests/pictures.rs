//! Pictures of a real episode that is played again.

use fitmac_report::gallery::{choose, film, spec_of};
use sim_harness::evaluation::{
    Config, EpisodeRecord, EpisodeSpec, Knowledge, Profile, Vision, play,
};
use sim_harness::perturb::{Level, Perturbation};

fn spec(config: &str, perturbation: Perturbation, level: Level) -> EpisodeSpec {
    EpisodeSpec {
        suite: "object".to_owned(),
        task: "alphabet_soup".to_owned(),
        perturbation,
        level,
        backbone: "openvla-like".to_owned(),
        config: Config::parse(config).unwrap(),
        profile: Profile::Guarded,
        vision: Vision::Truth,
        knowledge: Knowledge::Agents,
        seed: 1000,
        episode: 0,
    }
}

#[test]
fn an_episode_is_filmed_as_it_was_recorded_and_no_other() {
    let record = play(&spec("base", Perturbation::Pos, Level::Standard)).unwrap();
    let frames = film(&record).unwrap();
    assert!(frames.len() >= 4, "{}", frames.len());
    assert!(frames.iter().all(|f| f.png.starts_with(b"\x89PNG")));
    assert!(frames[0].caption.contains("step"), "{}", frames[0].caption);
    assert!(frames.last().unwrap().caption.starts_with("end"));
    let other = EpisodeRecord {
        steps: record.steps + 1,
        ..record
    };
    let error = film(&other).unwrap_err().to_string();
    assert!(error.contains("another version"), "{error}");
}

#[test]
fn a_record_names_its_episode_whatever_the_level() {
    let levels = [
        (Perturbation::Pos, Level::DisplacedM(0.08)),
        (Perturbation::Obj, Level::Scaled(1.5)),
    ];
    // What was played does not matter here: the names do.
    let record = play(&spec("base", Perturbation::None, Level::Standard)).unwrap();
    for (perturbation, level) in levels {
        let named = EpisodeRecord {
            perturbation: perturbation.name().to_owned(),
            level: level.label(),
            ..record.clone()
        };
        let back = spec_of(&named).unwrap();
        assert_eq!((back.perturbation, back.level), (perturbation, level));
        assert_eq!(back.key(), named.key());
    }
    let unknown = EpisodeRecord {
        level: "twice as far".to_owned(),
        ..record
    };
    let error = spec_of(&unknown).unwrap_err().to_string();
    assert!(error.contains("twice as far"), "{error}");
}

#[test]
fn harmed_episodes_come_first() {
    let alone = play(&spec("base", Perturbation::None, Level::Standard)).unwrap();
    let with = |episode, success| EpisodeRecord {
        config: "full".to_owned(),
        episode,
        success,
        ..alone.clone()
    };
    let base = |episode, success| EpisodeRecord {
        config: "base".to_owned(),
        ..with(episode, success)
    };
    let records = [
        base(0, true),
        base(1, false),
        base(2, false),
        with(0, false),
        with(1, true),
        with(2, false),
    ];
    let order: Vec<u32> = choose(&records, 9).iter().map(|r| r.episode).collect();
    assert_eq!(order, [0, 2, 1], "harmed, failed, saved");
    assert_eq!(choose(&records, 1).len(), 1);
    // An ablation that fails is less telling than what the whole controller does.
    let ablated = EpisodeRecord {
        config: "wo-target".to_owned(),
        ..with(0, false)
    };
    let records = [&[ablated][..], &records].concat();
    let order: Vec<&str> = choose(&records, 9).iter().map(|r| &*r.config).collect();
    assert_eq!(order, ["full", "full", "full", "wo-target"]);
}

#[test]
fn one_of_every_kind_comes_before_the_second_of_any() {
    let alone = play(&spec("base", Perturbation::None, Level::Standard)).unwrap();
    let fails = |episode, task: &str| EpisodeRecord {
        config: "full".to_owned(),
        task: task.to_owned(),
        episode,
        success: false,
        ..alone.clone()
    };
    let records = [fails(0, "milk"), fails(1, "milk"), fails(2, "butter")];
    let order: Vec<u32> = choose(&records, 9).iter().map(|r| r.episode).collect();
    assert_eq!(order, [0, 2, 1]);
}
