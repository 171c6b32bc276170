//! `fitmac vla --openpi` in the set of processes that docs/openpi.md shows, as
//! written there but for the port: the robot moves by the server's actions.

use fitmac_tests::{
    fitmac::{Finished, Place, Run, wait_for},
    link::blocks,
    openpi::{Behaviour, Question, Role, StandIn},
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

/// The processes of the page: simulator, policy, agents, controller.
fn start(place: &Place, server: &StandIn) -> [Run; 4] {
    let page = blocks("openpi.md", "sh").concat();
    let page = page.replace("ws://127.0.0.1:8000", &server.url());
    let lines = page.lines().filter_map(|line| line.strip_prefix("fitmac "));
    let runs = lines.map(|line| place.start(&line.split_whitespace().collect::<Vec<_>>()));
    let runs: Vec<Run> = runs.collect();
    runs.try_into().expect("four processes")
}

fn wait_for_questions(server: &StandIn, count: usize) -> Vec<Question> {
    wait_for("questions", || {
        let questions = server.questions();
        (questions.len() >= count).then_some(questions)
    })
}

#[test]
fn the_processes_of_the_page_move_the_robot_by_the_servers_actions() {
    let server = StandIn::start(Role::sound(up));
    let place = Place::new();
    let [sim, vla, agents, rt] = start(&place, &server);
    wait_for_questions(&server, 8);
    let [vla, rt, agents, sim] = [vla, rt, agents, sim].map(end);
    let said = format!(
        "vla: {}\nrt: {}\nagents: {}\nsim: {}",
        vla.stderr, rt.stderr, agents.stderr, sim.stderr
    );
    assert!(vla.status.success() && rt.status.success(), "{said}");
    assert!(vla.stderr.contains("cast by rays"), "{said}");
    let questions = server.questions();
    let (first, last) = (&questions[0], &questions[7]);
    assert!(first.prompt.contains("basket"), "{}", first.prompt);
    let blank = first.image.iter().all(|byte| *byte == first.image[0]);
    assert!(!blank, "an empty picture");
    let risen_m = last.state[2] - first.state[2];
    assert!(risen_m > 0.02, "the hand rose by {risen_m} m\n{said}");
    let counts = vla.stderr.lines().last().unwrap_or_default();
    assert!(
        counts.starts_with("openpi: connections 1, answers "),
        "{said}"
    );
    for failure in ["refused", "malformed", "unreachable", "disconnected"] {
        assert!(!vla.stderr.contains(failure), "{said}");
    }
}

#[test]
fn a_broken_server_is_waited_for_and_the_robot_goes_on() {
    let server = StandIn::start(Role::sound(up));
    let place = Place::new();
    let [sim, vla, agents, rt] = start(&place, &server);
    wait_for_questions(&server, 2);
    server.behave(Behaviour::Puts(3, 2, f64::NAN));
    let before = server.questions().len();
    wait_for_questions(&server, before + 2);
    let port = server.port();
    drop(server);
    let server = StandIn::start_at(port, Role::sound(up));
    let questions = wait_for_questions(&server, 4);
    let [vla, rt, _, _] = [vla, rt, agents, sim].map(end);
    let said = format!("vla: {}\nrt: {}", vla.stderr, rt.stderr);
    assert!(vla.status.success() && rt.status.success(), "{said}");
    let risen_m = questions[3].state[2] - questions[0].state[2];
    assert!(risen_m > 0.005, "the hand rose by {risen_m} m\n{said}");
    let counts = vla.stderr.lines().last().unwrap_or_default();
    assert!(counts.starts_with("openpi: connections 2, "), "{said}");
    for failure in [
        "refused (not_finite): action 3, component 2",
        "disconnected 1",
        "not_finite",
    ] {
        assert!(vla.stderr.contains(failure), "{failure}: {said}");
    }
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
