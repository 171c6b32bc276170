//! From lines of results to figures that were computed by hand.

use std::fs;
use std::path::{Path, PathBuf};

use fitmac_report::Report;
use fitmac_report::gallery::Frame;
use fitmac_report::load::{Loaded, load};
use fitmac_report::render::{html, json, markdown, page};
use fitmac_report::table::{Cell, Table};
use serde_json::{Value, json};

/// An episode that succeeds on the policy alone; `with` changes fields.
fn line(with: Value) -> Value {
    let mut line = json!({
        "schema": 1, "core": "0.1.0", "suite": "object", "task_index": 0, "task": "milk",
        "perturbation": "pos", "level": "standard", "backbone": "openvla-like",
        "backbone_hash": "0123456789ab", "config": "base", "profile": "guarded",
        "perception": "modelled", "knowledge": "agents", "seed": 7, "episode": 0,
        "success": true, "intervened": false, "activations": [], "onset_step": null,
        "first_failure_step": null, "first_intervention_step": null, "steps": 120,
        "sim_seconds": 6.0, "failure": null, "gate_reasons": [], "rebinds": 0, "graspable": true,
        "end_distance_m": 0.01, "drawn": "milk exchanged with butter",
    });
    let (Some(fields), Value::Object(with)) = (line.as_object_mut(), with) else {
        panic!("fields are given as an object")
    };
    for (name, value) in with {
        assert!(
            fields.insert(name.clone(), value).is_some(),
            "{name} is no field"
        );
    }
    line
}

fn failed(mut line: Value) -> Value {
    line["success"] = json!(false);
    line["failure"] = json!("wrong-object");
    line
}

/// A pick from step 40 to 59 and a place from 60 to 99, after an onset at 30.
fn corrected(mut line: Value) -> Value {
    line["intervened"] = json!(true);
    line["onset_step"] = json!(30);
    line["first_failure_step"] = json!(36);
    line["first_intervention_step"] = json!(40);
    line["activations"] = json!([
        {"correction": 0, "kind": "pick", "start_step": 40, "end_step": 59, "outcome": "continued"},
        {"correction": 0, "kind": "place", "start_step": 60, "end_step": 99, "outcome": "corrected"},
    ]);
    line
}

/// Ten episodes of one cell. Alone: 0 to 5 succeed, 6 to 9 fail. With FIT-MAC: 0 to 3 succeed
/// untouched, 4 succeeds although corrected, 5 is corrected and fails, 6 to 8 are corrected and
/// succeed, 9 fails uncorrected.
fn cell() -> Vec<Value> {
    let mut lines = Vec::new();
    for episode in 0..10 {
        let alone = line(json!({"episode": episode}));
        lines.push(if episode < 6 { alone } else { failed(alone) });
        let with = line(json!({"episode": episode, "config": "full"}));
        lines.push(match episode {
            0..=3 => with,
            5 => failed(corrected(with)),
            9 => failed(with),
            _ => corrected(with),
        });
    }
    lines
}

fn write(folder: &Path, name: &str, lines: &[Value]) {
    let text: String = lines.iter().map(|l| format!("{l}\n")).collect();
    fs::write(folder.join(name), text).unwrap();
}

fn loaded(lines: &[Value]) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "episodes-0-of-1.jsonl", lines);
    load(&[folder.path().to_owned()]).unwrap()
}

fn report(lines: &[Value]) -> Report {
    let loaded = loaded(lines);
    assert_eq!(loaded.problems, [], "the lines are well formed");
    Report::of(&loaded).unwrap()
}

fn table<'a>(report: &'a Report, id: &str) -> &'a Table {
    let ids: Vec<&str> = report.tables.iter().map(|t| &*t.id).collect();
    report
        .tables
        .iter()
        .find(|t| t.id == id)
        .unwrap_or_else(|| panic!("no table {id} among {ids:?}"))
}

fn row<'a>(table: &'a Table, name: &str) -> &'a [Cell] {
    let names: Vec<&str> = table.rows.iter().map(|r| &*r.name).collect();
    &table
        .rows
        .iter()
        .find(|r| r.name == name)
        .unwrap_or_else(|| panic!("no row {name} among {names:?}"))
        .cells
}

fn texts(cells: &[Cell]) -> Vec<String> {
    cells.iter().map(Cell::ours).collect()
}

#[test]
fn own_grounding_stands_beside_what_the_simulator_knows() {
    // Ours: 0 to 4 and 6 to 8 succeed. The simulator's: all but 0 and 9.
    let mut lines = cell();
    for episode in 0..10 {
        let with = line(json!({"episode": episode, "config": "full", "knowledge": "simulator"}));
        lines.push(if matches!(episode, 0 | 9) {
            failed(with)
        } else {
            with
        });
    }
    let report = report(&lines);
    let name = "pos, openvla-like surrogate: guarded profile, modelled poses, own grounding";
    let cells = texts(row(table(&report, "knowledge"), name));
    assert_eq!(cells, ["10", "80.0", "80.0", "1", "1"]);
}

#[test]
fn a_contrast_has_its_table_and_no_others() {
    let mut lines = cell();
    lines.push(line(
        json!({"episode": 3, "config": "full", "knowledge": "simulator"}),
    ));
    lines.push(line(
        json!({"episode": 3, "config": "wo-target", "knowledge": "simulator"}),
    ));
    let report = report(&lines);
    let ids: Vec<&str> = report.tables.iter().map(|t| t.id.as_str()).collect();
    assert!(ids.contains(&"knowledge"), "{ids:?}");
    assert!(ids.iter().any(|id| id.ends_with("-agents")), "{ids:?}");
    assert!(!ids.iter().any(|id| id.ends_with("-simulator")), "{ids:?}");
    // Nor has a part that was switched off elsewhere only.
    assert!(!ids.iter().any(|id| id.starts_with("ablation")), "{ids:?}");
}

#[test]
fn pairs_are_what_the_hand_counts() {
    let report = report(&cell());
    let pairs = &report.verdicts[0].pairs;
    let count = |share: Option<fitmac_report::stats::Share>| share.map(|s| (s.hits, s.of));
    assert_eq!(pairs.pairs, 10);
    assert_eq!(count(pairs.harmed), Some((1, 6)));
    assert_eq!(count(pairs.unneeded), Some((2, 6)));
    assert_eq!(count(pairs.saved), Some((3, 4)));
    // McNemar of 1 against 3: 2 (C(4,0) + C(4,1)) / 2^4.
    assert!((pairs.p_value - 10.0 / 16.0).abs() < 1e-12);
    // One of six: the bound p solves (1-p)^6 + 6 p (1-p)^5 = 0.05.
    let p = pairs.harmed_upper.unwrap();
    let at = (1.0 - p).powi(6) + 6.0 * p * (1.0 - p).powi(5);
    assert!((at - 0.05).abs() < 1e-9, "{p}");
    assert_eq!(
        pairs.harmed_keys,
        ["object/milk/pos/standard/openvla-like/7/5/full/guarded/modelled/agents"]
    );
    let cost = row(
        table(&report, "cost"),
        "openvla-like surrogate, all scenes: guarded profile, \
                    modelled poses, own grounding",
    );
    let expected = ["10", "6", "1", "16.7", "58.18", "33.3", "75.0", "0.625"];
    assert_eq!(texts(cost), expected);
}

#[test]
fn the_papers_layout_has_its_figures_beside_ours() {
    let report = report(&cell());
    let main = table(&report, "main-guarded-modelled-agents");
    let names: Vec<String> = main
        .columns
        .iter()
        .map(|c| format!("{} {}", c.group, c.name))
        .collect();
    let expected = [
        "Object nominal",
        "Object obj",
        "Object pos",
        "Object sem",
        "Object task",
        "Object env",
        "Spatial nominal",
        "Spatial obj",
        "Spatial pos",
        "Spatial sem",
        "Spatial task",
        "Spatial env",
        " mean of ten",
    ];
    assert_eq!(names, expected);
    let with = row(main, "openvla-like surrogate with FIT-MAC");
    assert_eq!(
        (with[2].ours(), with[2].paper()),
        ("80.0".to_owned(), Some("93.4".to_owned()))
    );
    assert_eq!(with[2].interval().unwrap(), "49.0–94.3");
    assert_eq!(
        (with[12].ours(), with[12].paper().unwrap()),
        ("–".to_owned(), "78.7".to_owned())
    );
    assert_eq!(
        row(main, "openvla-like surrogate alone")[12]
            .paper()
            .unwrap(),
        "45.9"
    );
    assert_eq!(row(main, "NORA (published)")[1].paper().unwrap(), "86.0");
    let behaviour = row(table(&report, "behaviour-guarded-modelled-agents"), "pos");
    assert_eq!(texts(&behaviour[..3]), ["80.0", "50.0", "80.0"]);
    assert_eq!(behaviour[1].paper().unwrap(), "99.5");
    let five = table(&report, "backbones-object-guarded-modelled-agents");
    assert_eq!(
        row(five, "openvla-like surrogate alone")[1].ours(),
        "60.0/0.0/–"
    );
}

#[test]
fn timing_and_failures_are_counted() {
    let report = report(&cell());
    let detection = table(&report, "detection-openvla-like-guarded-modelled-agents");
    // Five corrected after an onset at 30, first acting at 40.
    assert_eq!(
        texts(row(detection, "Object, pos")),
        ["10", "0", "5", "0", "10", "10", "10"]
    );
    let corrections = table(&report, "corrections-openvla-like-guarded-modelled-agents");
    assert_eq!(
        texts(&row(corrections, "pick")[..4]),
        ["5", "20", "20", "20"]
    );
    assert_eq!(
        texts(&row(corrections, "place")[..4]),
        ["5", "40", "40", "40"]
    );
    let failures = table(
        &report,
        "failures-openvla-like-full-guarded-modelled-agents",
    );
    assert_eq!(texts(row(failures, "Object, pos")), ["10", "2", "2", "0"]);
}

#[test]
fn modules_sweeps_and_seeds_have_their_tables() {
    let cells = ["obj", "pos", "sem", "task", "env"];
    let mut lines = Vec::new();
    for suite in ["object", "spatial"] {
        for (i, perturbation) in cells.iter().enumerate() {
            for (config, wins) in [
                ("full", 5),
                ("wo-execution", i),
                ("full+gate.failure_streak=2", 4),
            ] {
                for seed in [7, 11] {
                    for episode in 0..5 {
                        let one = line(json!({"suite": suite, "perturbation": perturbation,
                            "config": config, "seed": seed, "episode": episode}));
                        lines.push(if episode < wins { one } else { failed(one) });
                    }
                }
            }
        }
    }
    let report = report(&lines);
    let modules = table(&report, "ablation-openvla-like-guarded-modelled-agents");
    // Of five: 0, 1, 2, 3, 4 succeed, which is 40 % on average.
    let without = row(modules, "without execution correction");
    assert_eq!(texts(without), ["40.0", "40.0", "40.0", "-60.0", "-60.0"]);
    let paper: Vec<_> = without.iter().map(|c| c.paper().unwrap()).collect();
    assert_eq!(paper, ["47.0", "62.4", "54.7", "-38.4", "-9.6"]);
    assert_eq!(texts(row(modules, "without hard pick")), ["–"; 5]);
    let sweep = table(
        &report,
        "sweep-gate.failure_streak-openvla-like-guarded-modelled-agents",
    );
    assert_eq!(texts(row(sweep, "gate.failure_streak = 2")), ["80.0"; 3]);
    let default = row(sweep, "gate.failure_streak = 3 (default)");
    assert_eq!(
        (default[0].ours(), default[1].paper().unwrap()),
        ("100.0".into(), "70.6".into())
    );
    let seeds = table(&report, "seeds-openvla-like-object-guarded-modelled-agents");
    assert_eq!(row(seeds, "seed 11")[0].ours(), "100.0/0.0/–");
    assert_eq!(row(seeds, "SR, mean ± sd")[0].ours(), "100.0 ± 0.0");
}

#[test]
fn kinds_of_seeds_are_never_pooled_and_tuning_is_marked() {
    let mut lines = cell();
    lines.push(failed(line(json!({"seed": 1000, "config": "full"}))));
    let mixed = report(&lines);
    assert_eq!((mixed.about.episodes, mixed.about.left_out), (20, 1));
    assert!(
        mixed.about.warnings[0].contains("left out"),
        "{:?}",
        mixed.about.warnings
    );
    let tuning = report(&[line(json!({"seed": 1000}))]);
    for text in [markdown(&tuning), html(&tuning).unwrap()] {
        assert!(
            text.contains("no result") && text.contains("tuning seeds"),
            "{text}"
        );
    }
}

#[test]
fn no_figure_of_ours_is_called_by_a_models_name() {
    let report = report(&cell());
    let page = html(&report).unwrap();
    assert!(page.contains("surrogates in a simulator, not the models"));
    for table in &report.tables {
        for row in &table.rows {
            let measured = row.cells.iter().any(|c| !["", "–"].contains(&&*c.ours()));
            assert!(
                !(measured && row.name.contains("OpenVLA")),
                "{}: {}",
                table.id,
                row.name
            );
        }
        assert!(table.columns.iter().all(|c| !c.name.contains("OpenVLA")));
    }
}

#[test]
fn a_wrong_line_is_named_and_the_rest_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let good = line(json!({}));
    let mut unknown = line(json!({"episode": 1}));
    unknown["colour"] = json!("red");
    let mut missing = line(json!({"episode": 2}));
    missing.as_object_mut().unwrap().remove("steps");
    let newer = line(json!({"episode": 3, "schema": 9}));
    let absurd = line(json!({"episode": 4, "failure": "dropped"}));
    let second = failed(line(json!({})));
    let lines = [&good, &unknown, &missing, &newer, &absurd, &second, &good];
    let mut text: String = lines.iter().map(|l| format!("{l}\n")).collect();
    text.push_str("not JSON\n{\"half\": tr");
    fs::write(folder.path().join("a.jsonl"), text).unwrap();
    let loaded = load(&[folder.path().to_owned()]).unwrap();
    assert_eq!((loaded.records.len(), loaded.repeated), (1, 1));
    let said: Vec<String> = loaded.problems.iter().map(ToString::to_string).collect();
    let expected = [
        (2, "unknown field `colour`"),
        (3, "missing field `steps`"),
        (4, "`schema` is 9, this program reads 1"),
        (5, "`failure` contradicts `success`"),
        (6, "a.jsonl:1"),
        (8, "no line of JSON"),
        (9, "cut off"),
    ];
    assert_eq!(said.len(), expected.len(), "{said:#?}");
    for (said, (line, what)) in said.iter().zip(expected) {
        assert!(
            said.contains(&format!("a.jsonl:{line}: ")) && said.contains(what),
            "{said}"
        );
        assert!(said.contains("; "), "a remedy follows: {said}");
    }
    let report = Report::of(&loaded).unwrap();
    assert!(markdown(&report).contains("a.jsonl:3"));
    assert!(html(&report).unwrap().contains("missing field `steps`"));
}

#[test]
fn folders_without_results_and_missing_ones_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let error = load(&[folder.path().to_owned()]).unwrap_err().to_string();
    assert!(error.contains("fitmac eval") && error.contains(folder.path().to_str().unwrap()));
    let error = load(&[PathBuf::from("/nowhere/at/all")])
        .unwrap_err()
        .to_string();
    assert!(error.contains("/nowhere/at/all"), "{error}");
    assert!(Report::of(&Loaded::default()).is_err());
}

#[test]
fn the_page_needs_nothing_else_and_its_data_read_back() {
    let mut lines = cell();
    lines[0]["drawn"] = json!("</script><b>milk & \"butter\"");
    let page = html(&report(&lines)).unwrap();
    for outside in [
        "src=\"http",
        "href=\"http",
        "@import",
        "url(",
        "fetch(",
        "XMLHttpRequest",
    ] {
        assert!(!page.contains(outside), "{outside}");
    }
    let (_, data) = page.split_once("id=\"episodes-data\">").unwrap();
    let (data, _) = data.split_once("</script>").unwrap();
    let list: Vec<Value> = serde_json::from_str(data).unwrap();
    assert_eq!(list.len(), 20);
    assert_eq!(list[0]["y"], lines[0]["drawn"]);
    assert_eq!(
        page.matches("<table>").count(),
        page.matches("</table>").count()
    );
    assert_eq!(
        page.matches("<svg ").count(),
        page.matches("</svg>").count()
    );
    assert!(page.contains("lang=\"en\"") && page.contains("scope=\"row\""));
}

#[test]
fn json_holds_counts_and_intervals() {
    let report = report(&cell());
    let value: Value = serde_json::from_str(&json(&report).unwrap()).unwrap();
    assert_eq!(value["verdicts"][0]["pairs"]["harmed"]["hits"], 1);
    let tables = value["tables"].as_array().unwrap();
    let main = tables
        .iter()
        .find(|t| t["id"] == "main-guarded-modelled-agents")
        .unwrap();
    let cell = &main["rows"].as_array().unwrap().last().unwrap()["cells"][2];
    assert_eq!(
        (&cell["ours"]["sr"]["hits"], &cell["ours"]["sr"]["of"]),
        (&json!(8), &json!(10))
    );
    assert_eq!(cell["paper"]["sr"], 93.4);
}

#[test]
fn markdown_is_as_it_was() {
    let text = markdown(&report(&cell()));
    let head = "| method | Object: nominal | Object: obj | Object: pos |";
    let (_, table) = text.split_once("### Success: guarded profile").unwrap();
    assert!(table.contains(head), "{table}");
    let ours = table
        .lines()
        .find(|l| l.starts_with("| openvla-like surrogate with FIT-MAC"))
        .unwrap();
    assert!(
        ours.starts_with(
            "| openvla-like surrogate with FIT-MAC | – | – (99.0) | 80.0 [49.0–94.3] (93.4) | – (98.8) |"
        ),
        "{ours}"
    );
}

#[test]
fn what_still_fails_is_named_task_by_task() {
    let report = report(&cell());
    let remaining = table(&report, "remaining-openvla-like-guarded-modelled-agents");
    assert_eq!(
        texts(row(remaining, "Object, pos, milk")),
        ["2", "10", "wrong-object", "–", "7/5, 7/9"]
    );
    assert_eq!(remaining.rows.len(), 1);
    let ids: Vec<&str> = report.tables.iter().map(|t| &*t.id).collect();
    assert!(!ids.iter().any(|id| id.starts_with("ceilings")), "{ids:?}");
}

#[test]
fn a_ceiling_is_shown_where_targets_do_not_fit() {
    let mut lines = cell();
    for line in &mut lines {
        // Of the two failures with the controller, one is of a target that does not fit.
        if line["episode"] == 9 {
            line["graspable"] = json!(false);
        }
    }
    let report = report(&lines);
    let ceilings = table(&report, "ceilings-openvla-like-guarded-modelled-agents");
    let cells = row(ceilings, "Object, pos");
    assert_eq!(texts(cells), ["90.0", "80.0", "88.9"]);
}

#[test]
fn the_page_for_the_documentation_has_its_pictures_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut report = report(&cell());
    let frame = |caption: &str| Frame {
        caption: caption.to_owned(),
        png: b"picture".to_vec(),
    };
    let failed = "object/milk/pos/standard/openvla-like/7/5/full/guarded/modelled/agents";
    let frames = ["before: step 11", "onset: step 30", "end: step 120"].map(frame);
    report.pictures.insert(failed.to_owned(), frames.to_vec());
    let path = folder.path().join("evaluation.md");
    let files = page(&report, &path).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.starts_with("# Evaluation") && text.contains("cargo xtask evaluate"));
    assert!(text.contains("surrogate") && text.contains("(93.4)"));
    assert!(text.contains("seed 7, episode 5: wrong-object"), "{text}");
    assert!(
        !text.contains("before: step 11"),
        "onset and end are enough"
    );
    // Every picture that the page names is there, and no other file was written.
    let named: Vec<&str> = text
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')').map(|(name, _)| name))
        .collect();
    assert!(named.len() > 2);
    for name in &named {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
    assert_eq!(files.len(), named.len() + 1);
}

#[test]
fn a_table_compares_on_the_same_draws() {
    let mut lines = cell();
    // Another seed with FIT-MAC only, and an ablation with half of the episodes.
    for episode in 0..10 {
        let with = json!({"episode": episode, "config": "full", "seed": 11});
        lines.push(failed(line(with)));
        let without = json!({"episode": episode, "config": "wo-target"});
        if episode < 5 {
            lines.push(line(without));
        }
    }
    let report = report(&lines);
    let main = table(&report, "main-guarded-modelled-agents");
    let with = &row(main, "openvla-like surrogate with FIT-MAC")[2];
    assert_eq!(with.count().unwrap(), "8 of 10");
    let modules = table(
        &report,
        "ablation-openvla-like-object-guarded-modelled-agents",
    );
    for (name, count) in [
        ("FIT-MAC", "5 of 5"),
        ("without target correction", "5 of 5"),
    ] {
        assert_eq!(row(modules, name)[1].count().unwrap(), count, "{name}");
    }
    let seeds = table(&report, "seeds-openvla-like-object-guarded-modelled-agents");
    assert_eq!(row(seeds, "seed 11")[1].count().unwrap(), "0 of 10");
}
