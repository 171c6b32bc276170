//! The suites' data are sound: every task can be told, grounded and set up in every perturbation.

use sim_harness::grounding::check_grounding;
use sim_harness::perturb::{Level, Perturbation, instance};
use sim_harness::pose::distance_xy_m;
use sim_harness::scene::Scene;
use sim_harness::suite::Suite;

const SUITES: [&str; 2] = ["object", "spatial"];

#[test]
fn every_instruction_is_grounded_in_every_perturbation() {
    let mut wrong = Vec::new();
    for name in SUITES {
        let suite = Suite::embedded(name).unwrap();
        assert_eq!(suite.tasks.len(), 10);
        for task in &suite.tasks {
            for perturbation in Perturbation::ALL {
                for seed in 0..3 {
                    let made = instance(&suite, task, perturbation, Level::Standard, seed).unwrap();
                    let object = &made.scene.by_id(made.goal.object()).unwrap().name;
                    let place = &made.scene.by_id(made.goal.destination()).unwrap().name;
                    let grounded = check_grounding(&made.scene, &made.instruction, object, place);
                    if let Err(error) = grounded {
                        let cell = format!("{name}/{}/{}", task.name, perturbation.name());
                        wrong.push(format!("{cell} seed {seed}: {error}"));
                    }
                }
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "{} wrong:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
}

#[test]
fn starts_do_not_depend_on_the_perturbation() {
    let suite = Suite::embedded("object").unwrap();
    let task = suite.task("milk").unwrap();
    let make = |p| instance(&suite, task, p, Level::Standard, 7).unwrap();
    let nominal = make(Perturbation::None);
    assert_eq!(nominal.scene, make(Perturbation::Task).scene);
    assert_eq!(nominal.scene, make(Perturbation::Sem).scene);
    assert_ne!(nominal.instruction, make(Perturbation::Sem).instruction);
    assert_ne!(nominal.goal, make(Perturbation::Task).goal);
    for (a, b) in nominal
        .scene
        .objects()
        .iter()
        .zip(make(Perturbation::Env).scene.objects())
    {
        assert_eq!(a.pose.position_m[..2], b.pose.position_m[..2]);
        assert!(b.pose.position_m[2] < a.pose.position_m[2]);
    }
    let swapped = make(Perturbation::Pos).scene;
    let moved: Vec<_> = nominal
        .scene
        .objects()
        .iter()
        .zip(swapped.objects())
        .filter(|(a, b)| a.pose != b.pose)
        .map(|(a, _)| a.name.as_str())
        .collect();
    assert_eq!(moved, ["milk", "salad_dressing"]);
}

#[test]
fn a_displacement_has_its_length_and_touches_nothing() {
    let suite = Suite::embedded("object").unwrap();
    for task in &suite.tasks {
        for distance_m in [0.05, 0.1, 0.2, 0.3] {
            let level = Level::DisplacedM(distance_m);
            let made = instance(&suite, task, Perturbation::Pos, level, 11).unwrap();
            let start = suite.sample_scene(task, 11).unwrap();
            let from = start.by_name(&task.target).unwrap().pose.position_m;
            let to = made.scene.by_name(&task.target).unwrap().pose.position_m;
            assert!(
                (distance_xy_m(from, to) - distance_m).abs() < 1e-9,
                "{}",
                task.name
            );
        }
    }
    // The table is full so far from where this one stands.
    let crowded = suite.tasks.iter().find(|t| t.target == "cream_cheese");
    let level = Level::DisplacedM(0.2);
    let nearly = (0..200).filter(|seed| {
        let crowded = crowded.unwrap();
        let made = instance(&suite, crowded, Perturbation::Pos, level, *seed).unwrap();
        let start = suite.sample_scene(crowded, *seed).unwrap();
        let place = |scene: &Scene| scene.by_name(&crowded.target).unwrap().pose.position_m;
        let moved_m = distance_xy_m(place(&start), place(&made.scene));
        assert!((moved_m - 0.2).abs() < 0.05 + 1e-9, "{moved_m}");
        (moved_m - 0.2).abs() > 1e-9
    });
    assert!(nearly.count() > 0);
    let task = &suite.tasks[0];
    let far = instance(&suite, task, Perturbation::Pos, Level::DisplacedM(3.0), 1);
    assert!(far.unwrap_err().to_string().contains("no free place"));
    let misfit = instance(&suite, task, Perturbation::Sem, Level::Scaled(1.5), 1);
    assert!(misfit.unwrap_err().to_string().contains("no level"));
}

#[test]
fn a_malformed_suite_is_refused_with_its_key() {
    let good = include_str!("../assets/suites/object.toml");
    let cases = [
        (
            r#"kind = "milk", region = "target""#,
            r#"kind = "milkshake", region = "target""#,
            "object `milk`, field `kind`: unknown object `milkshake`; known are",
        ),
        (
            r#"region = "basket""#,
            r#"region = "cellar""#,
            "field `region`: unknown region `cellar`; known are",
        ),
        (
            r#"destination = "basket""#,
            r#"destination = "shelf""#,
            "field `destination`: unknown",
        ),
        ("max_steps = 280", "max_step = 280", "max_step"),
        ("max_steps = 280", "max_steps = 0", "max_steps is 0"),
        (r#"relation = "in""#, r#"relation = "beside""#, "beside"),
    ];
    for (from, to, named) in cases {
        assert!(good.contains(from));
        let error = Suite::parse("mine.toml", &good.replace(from, to))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains(named) && error.starts_with("mine.toml: "),
            "{named}: {error}"
        );
    }
    let empty = "name = \"x\"\nmax_steps = 10\ntask = []\n[regions]\n";
    assert!(
        Suite::parse("mine.toml", empty)
            .unwrap_err()
            .to_string()
            .contains("no task")
    );
}
