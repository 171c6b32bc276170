use super::*;
use crate::planner::plan;
use crate::scene::{Camera, Part, Table};
use crate::synthetic::{DetectorModel, Outcome, calibration_error, case, reliability, run};

fn thing(label: &str, position_m: [f64; 3], size_m: [f64; 3]) -> Detection {
    Detection {
        id: 0,
        label: label.to_owned(),
        confidence: 0.9,
        position_m,
        size_m,
        orientation: None,
        box_px: None,
        colour: None,
        parts: Vec::new(),
    }
}

const BOWL: [f64; 3] = [0.107, 0.107, 0.05];

/// LIBERO-Spatial's table with two bowls.
fn spatial(bowls: [[f64; 3]; 2]) -> Scene {
    let mut objects: Vec<Detection> = bowls
        .iter()
        .map(|at| thing("akita_black_bowl", *at, BOWL))
        .collect();
    objects.push(thing("plate_1", [0.55, 0.20, 0.01], [0.16, 0.16, 0.02]));
    objects.push(thing(
        "glazed_rim_porcelain_ramekin_1",
        [0.50, -0.10, 0.02],
        [0.08, 0.08, 0.04],
    ));
    objects.push(thing("cookies_1", [0.65, -0.05, 0.02], [0.14, 0.07, 0.04]));
    let mut cabinet = thing("wooden_cabinet_1", [0.45, -0.35, 0.12], [0.25, 0.20, 0.24]);
    cabinet.parts = vec![Part {
        name: "top drawer".to_owned(),
        position_m: [0.45, -0.30, 0.19],
        size_m: [0.22, 0.25, 0.07],
    }];
    Scene {
        table: Some(Table {
            centre_m: [0.55, 0.0, 0.0],
            half_extent_m: [0.4, 0.5],
        }),
        objects,
        fixtures: vec![
            cabinet,
            thing("flat_stove_1", [0.30, 0.42, 0.02], [0.2, 0.2, 0.04]),
        ],
        ..Scene::default()
    }
}

fn select(instruction: &str, scene: &Scene) -> Grounding {
    let plan = plan(instruction).expect("a sentence");
    assert!(plan.understood(), "{instruction}");
    ground(&plan.subtasks[0], scene, &Context::default())
}

#[test]
fn relations_of_libero_spatial_choose_the_right_bowl() {
    let on_stove = [0.30, 0.42, 0.065];
    let in_drawer = [0.45, -0.30, 0.19];
    for (at, phrase) in [
        ([0.52, 0.05, 0.025], "between the plate and the ramekin"),
        ([0.42, -0.04, 0.025], "next to the ramekin"),
        ([0.57, 0.02, 0.025], "from table center"),
        ([0.65, -0.05, 0.065], "on the cookie box"),
        (in_drawer, "in the top drawer of the wooden cabinet"),
        ([0.50, -0.10, 0.060], "on the ramekin"),
        ([0.72, 0.05, 0.025], "next to the cookie box"),
        (on_stove, "on the stove"),
        ([0.66, 0.28, 0.025], "next to the plate"),
        ([0.45, -0.35, 0.265], "on the wooden cabinet"),
    ] {
        let other = if phrase.contains("stove") {
            in_drawer
        } else {
            on_stove
        };
        for bowls in [[at, other], [other, at]] {
            let scene = spatial(bowls);
            let instruction = format!("pick up the black bowl {phrase} and place it on the plate");
            let grounding = select(&instruction, &scene);
            let selected = grounding.selected().expect("a bowl");
            let expected = usize::from(bowls[1] == at);
            assert_eq!(selected.seen.index, expected, "{phrase}: {grounding:#?}");
            assert_eq!(
                grounding.verdict,
                Verdict::Resolved,
                "{phrase}: {grounding:#?}"
            );
            let Destination::Direct(anchor) = &grounding.destination else {
                panic!("{phrase}: {:?}", grounding.destination)
            };
            assert_eq!(anchor.label, "plate_1");
            let negated = format!("pick up the black bowl not {phrase} and place it on the plate");
            if !phrase.contains("from") {
                let selected = select(&negated, &scene)
                    .selected()
                    .expect("a bowl")
                    .seen
                    .index;
                assert_eq!(selected, 1 - expected, "not {phrase}");
            }
        }
    }
}

#[test]
fn left_and_right_follow_the_declared_viewer() {
    let scene = |camera| Scene {
        camera,
        objects: vec![
            thing("plate_1", [0.5, 0.2, 0.01], [0.16, 0.16, 0.02]),
            thing("plate_2", [0.5, -0.2, 0.01], [0.16, 0.16, 0.02]),
            thing("red_mug", [0.4, 0.0, 0.04], [0.08, 0.08, 0.08]),
        ],
        ..Scene::default()
    };
    // A camera opposite the robot: its right is +y.
    let camera = Camera {
        name: "agentview".to_owned(),
        image_size_px: [256, 256],
        focal_px: [300.0, 300.0],
        principal_px: [128.0, 128.0],
        position_m: [1.2, 0.0, 0.6],
        rotation: [
            [0.0, 0.5, -0.866_025_4],
            [1.0, 0.0, 0.0],
            [0.0, -0.866_025_4, -0.5],
        ],
    };
    let step = &plan("put the red mug on the left plate")
        .expect("sentence")
        .subtasks[0];
    let anchor = |scene: &Scene, viewpoint| {
        let context = Context {
            viewpoint,
            ..Context::default()
        };
        match ground(step, scene, &context).destination {
            Destination::Direct(anchor) => anchor.label,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(anchor(&scene(None), Viewpoint::Camera), "plate_1");
    let with_camera = scene(Some(camera));
    assert_eq!(with_camera.check(), Ok(()));
    assert_eq!(anchor(&with_camera, Viewpoint::Camera), "plate_2");
    assert_eq!(anchor(&with_camera, Viewpoint::Robot), "plate_1");
}

#[test]
fn names_find_their_products() {
    let labels = [
        "alphabet_soup_1",
        "cream_cheese_1",
        "salad_dressing_1",
        "bbq_sauce_1",
        "ketchup_1",
        "tomato_sauce_1",
        "butter_1",
        "milk_1",
        "chocolate_pudding_1",
        "orange_juice_1",
    ];
    let mut scene = Scene::default();
    for (index, label) in labels.iter().enumerate() {
        let at = [0.4 + 0.05 * index as f64, 0.1, 0.05];
        scene.objects.push(thing(label, at, [0.04, 0.04, 0.1]));
    }
    scene
        .objects
        .push(thing("basket_1", [0.6, -0.2, 0.06], [0.2, 0.2, 0.12]));
    for (name, label) in [
        ("alphabet soup", "alphabet_soup_1"),
        ("can of alphabet soup", "alphabet_soup_1"),
        ("cream cheese box", "cream_cheese_1"),
        ("philadelphia cream cheese", "cream_cheese_1"),
        ("bottle of salad dressing", "salad_dressing_1"),
        ("barbecue sauce", "bbq_sauce_1"),
        ("heinz ketchup bottle", "ketchup_1"),
        ("tomato sauce can", "tomato_sauce_1"),
        ("stick of butter", "butter_1"),
        ("milk carton", "milk_1"),
        ("chocolate pudding", "chocolate_pudding_1"),
        ("orange juice carton", "orange_juice_1"),
    ] {
        let grounding = select(&format!("put the {name} in the basket"), &scene);
        assert_eq!(
            grounding.selected().expect(name).seen.label,
            label,
            "{name}"
        );
        assert_eq!(
            grounding.verdict,
            Verdict::Resolved,
            "{name}: {grounding:#?}"
        );
    }
    for (name, verdict) in [
        ("sauce", Verdict::Ambiguous),
        ("bottle", Verdict::Ambiguous),
        ("wine bottle", Verdict::NotFound),
        ("soy sauce", Verdict::Unsatisfied),
        ("knife", Verdict::NotFound),
    ] {
        let grounding = select(&format!("put the {name} in the basket"), &scene);
        assert_eq!(grounding.verdict, verdict, "{name}: {grounding:#?}");
        assert!(
            grounding.confidence < 0.7,
            "{name}: {}",
            grounding.confidence
        );
    }
}

#[test]
fn a_relational_destination_is_no_anchor() {
    let scene = spatial([[0.5, 0.0, 0.025], [0.35, 0.3, 0.065]]);
    let left = select("put the ramekin to the left of the plate", &scene);
    assert!(matches!(left.destination, Destination::Relational { .. }));
    let drawer = select(
        "put the ramekin in the top drawer of the wooden cabinet",
        &scene,
    );
    let Destination::Direct(anchor) = drawer.destination else {
        panic!("an anchor")
    };
    assert!((anchor.position_m[2] + anchor.region_offset_m[2] - 0.225).abs() < 1e-9);
    assert!((anchor.region_half_extent_m[2] - 0.07).abs() < 1e-9);
}

#[test]
fn a_region_lies_in_the_frame_of_its_anchor_however_it_is_turned() {
    let anchor = |orientation| {
        let mut scene = spatial([[0.5, 0.0, 0.025], [0.35, 0.3, 0.065]]);
        scene.fixtures[0].orientation = orientation;
        let text = "put the ramekin in the top drawer of the wooden cabinet";
        match select(text, &scene).destination {
            Destination::Direct(anchor) => anchor,
            other => panic!("{other:?}"),
        }
    };
    let half = core::f64::consts::FRAC_1_SQRT_2;
    // The drawer is 5 cm along the base's y axis; a quarter turn makes that the cabinet's x.
    for (orientation, offset_m, half_m) in [
        (None, [0.0, 0.05, 0.105], [0.11, 0.125, 0.07]),
        (
            Some([half, 0.0, 0.0, half]),
            [0.05, 0.0, 0.105],
            [0.125, 0.11, 0.07],
        ),
        (
            Some([half, 0.0, 0.0, -half]),
            [-0.05, 0.0, 0.105],
            [0.125, 0.11, 0.07],
        ),
        (
            Some([0.0, 0.0, 0.0, 1.0]),
            [0.0, -0.05, 0.105],
            [0.11, 0.125, 0.07],
        ),
    ] {
        let found = anchor(orientation);
        for axis in 0..3 {
            let miss = found.region_offset_m[axis] - offset_m[axis];
            assert!(miss.abs() < 1e-12, "{orientation:?}: {found:?}");
            let miss = found.region_half_extent_m[axis] - half_m[axis];
            assert!(miss.abs() < 1e-12, "{orientation:?}: {found:?}");
        }
    }
}

#[test]
fn bad_scenes_name_their_field() {
    let good =
        serde_json::to_string(&spatial([[0.5, 0.0, 0.025], [0.35, 0.3, 0.065]])).expect("json");
    assert!(Scene::from_json(&good).is_ok());
    for (from, to, expected) in [
        ("0.107,0.107,0.05", "0.107,-0.107,0.05", "objects[0].size_m"),
        ("[0.5,0.0,0.025]", "[500.0,0.0,0.025]", "metres"),
        (
            "\"confidence\":0.9",
            "\"confidence\":1.5",
            "objects[0].confidence",
        ),
        ("akita_black_bowl", "bowl\\u0007", "objects[0].label"),
        ("\"objects\"", "\"things\"", "things"),
        ("\"id\":0", "\"id\":70000", "70000"),
        (
            "\"size_m\":[0.107,0.107,0.05]",
            "\"size_m\":[0.107,0.107,0.05],\"orientation\":[1,1,0,0]",
            "objects[0].orientation",
        ),
        (
            "\"half_extent_m\":[0.4",
            "\"half_extent_m\":[-1",
            "table.half_extent_m",
        ),
    ] {
        let bad = good.replacen(from, to, 1);
        assert_ne!(bad, good, "{from}");
        let error = Scene::from_json(&bad).expect_err(to).to_string();
        assert!(error.contains(expected), "{error}");
    }
}

fn outcomes(seeds: &[u64], scenes: u64, model: &DetectorModel) -> Vec<Outcome> {
    let numbers = |seed: u64| (0..scenes).map(move |number| (seed, number));
    let all = seeds.iter().copied().flat_map(numbers);
    all.map(|(seed, number)| run(&case(seed, number, model)).1)
        .collect()
}

/// Locks at 0.9 and above, and how many of them are right.
fn sure(outcomes: &[Outcome]) -> (u32, u32) {
    let sure = outcomes.iter().filter(|outcome| outcome.kappa >= 0.9);
    sure.fold((0, 0), |(all, right), outcome| {
        (all + 1, right + u32::from(outcome.right))
    })
}

/// The figures that the documentation quotes, on the seeds of the report.
#[test]
fn two_thousand_generated_scenes() {
    let outcomes = outcomes(&[7, 11, 13, 17, 23], 400, &DetectorModel::default());
    let (clear, other): (Vec<_>, Vec<_>) = outcomes.iter().partition(|outcome| outcome.clear);
    let right = clear.iter().filter(|outcome| outcome.right).count();
    let reported = other
        .iter()
        .filter(|outcome| outcome.verdict != Verdict::Resolved)
        .count();
    println!(
        "{right} of {} right, {reported} of {} reported",
        clear.len(),
        other.len()
    );
    assert!(clear.len() > 1000 && other.len() > 500);
    assert!(right * 100 >= clear.len() * 99);
    assert!(reported * 100 >= other.len() * 95);
}

/// On seeds that neither the fit nor the report has seen: of the locks at 0.9
/// nine in ten are right, with either detector, and what is told is what holds.
#[test]
fn kappa_means_what_it_says_on_fresh_seeds() {
    for (model, locks_min) in [
        (DetectorModel::default(), 400),
        (DetectorModel::harsh(), 100),
    ] {
        let outcomes = outcomes(&[201, 202, 203, 204], 250, &model);
        let (locks, right) = sure(&outcomes);
        let error = calibration_error(&reliability(&outcomes));
        println!("{right} of {locks} at 0.9 or more, calibration error {error:.3}");
        assert!(locks >= locks_min);
        assert!(right * 10 >= locks * 9);
        assert!(error < 0.06);
    }
}

/// Noise that swamps the margins must cost: the measure isn't blind.
#[test]
fn a_harsh_detector_is_worse_and_says_so() {
    let outcomes = outcomes(&[7], 300, &DetectorModel::harsh());
    let clear: Vec<_> = outcomes.iter().filter(|outcome| outcome.clear).collect();
    let right = clear.iter().filter(|outcome| outcome.right).count();
    assert!(right * 100 < clear.len() * 97);
    let mean = |right: bool| {
        let kappas: Vec<f64> = outcomes
            .iter()
            .filter(|o| o.right == right)
            .map(|o| o.kappa)
            .collect();
        kappas.iter().sum::<f64>() / kappas.len() as f64
    };
    assert!(mean(true) > mean(false) + 0.3);
}
