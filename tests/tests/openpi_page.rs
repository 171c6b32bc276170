//! `fitmac vla --openpi` in the set of processes that docs/openpi.md shows, as
//! written there but for the port: the robot moves by the server's actions.

use std::time::Duration;

use fitmac_tests::{
    fitmac::{Finished, Place, Run},
    link::blocks,
    openpi::{Question, Role, StandIn},
};
use rustix::process::{Pid, Signal, kill_process};

/// Up, with an open gripper.
fn up(_: &Question) -> Vec<[f64; 7]> {
    vec![[0.0, 0.0, 0.2, 0.0, 0.0, 0.0, -1.0]; 10]
}

fn end(run: Run) -> Finished {
    let pid = Pid::from_raw(i32::try_from(run.pid()).expect("a pid")).expect("not zero");
    let _ = kill_process(pid, Signal::TERM); // it may have ended
    run.finish()
}

#[test]
fn the_processes_of_the_page_move_the_robot_by_the_servers_actions() {
    let server = StandIn::start(Role::sound(up));
    let place = Place::new();
    let page = blocks("openpi.md", "sh").concat();
    let page = page.replace("ws://127.0.0.1:8000", &server.url());
    let lines = page.lines().filter_map(|line| line.strip_prefix("fitmac "));
    let [sim, vla, agents, rt]: [Run; 4] = lines
        .map(|line| {
            let mut arguments: Vec<&str> = line.split_whitespace().collect();
            if arguments[0] == "rt" {
                arguments.extend(["--ticks", "8000"]);
            }
            place.start(&arguments)
        })
        .collect::<Vec<_>>()
        .try_into()
        .expect("four processes");
    let rt = rt.finish();
    assert!(rt.status.success(), "{}", rt.stderr);
    let (vla, agents, sim) = (end(vla), end(agents), end(sim));
    let said = format!(
        "vla: {}\nagents: {}\nsim: {}",
        vla.stderr, agents.stderr, sim.stderr
    );
    assert!(vla.status.success(), "{said}");
    assert!(vla.stderr.contains("cast by rays"), "{said}");
    let questions = server.questions();
    assert!(
        questions.len() >= 3,
        "{} questions\n{said}",
        questions.len()
    );
    let count = |line: &str| vla.stderr.lines().any(|l| l == line);
    let summary = format!("openpi: connections 1, answers {}", questions.len());
    assert!(count(&summary), "{summary:?} in {said}");
    let first = &questions[0];
    assert!(first.prompt.contains("basket"), "{}", first.prompt);
    assert!(
        first.image.iter().any(|byte| *byte != first.image[0]),
        "an empty picture"
    );
    let risen_m = questions[questions.len() - 1].state[2] - first.state[2];
    assert!(risen_m > 0.02, "the hand rose by {risen_m} m\n{said}");
    drop(server);
    std::thread::sleep(Duration::from_millis(10));
}

#[test]
fn a_wrong_server_and_wrong_declarations_end_with_the_reason() {
    let server = StandIn::start(Role::sound(up));
    let place = Place::new();
    let sim = place.start(&["sim", "--instance", "cell", "--card", "scene.json"]);
    let url = server.url();
    let vla = |more: &[&str]| {
        let common = [
            "vla",
            "--instance",
            "cell",
            "--card",
            "scene.json",
            "--openpi",
            &url,
        ];
        place.start(&[&common[..], more].concat()).finish()
    };
    for (more, says) in [
        (
            &["--openpi-horizon", "10", "--openpi-expect", "model=pi05"][..],
            "metadata has no `model`",
        ),
        (
            &["--openpi-horizon", "65"],
            "--openpi-horizon: horizon is 65",
        ),
        (
            &["--openpi-horizon", "10", "--openpi-gripper", "left"],
            "minus_one_open, one_open",
        ),
        (&[], "--openpi-horizon"),
    ] {
        let finished = vla(more);
        assert_eq!(
            finished.status.code(),
            Some(2),
            "{more:?}: {}",
            finished.stderr
        );
        assert!(
            finished.stderr.contains(says),
            "{more:?}: {}",
            finished.stderr
        );
    }
    let _ = end(sim);
    assert!(server.questions().is_empty());
}
