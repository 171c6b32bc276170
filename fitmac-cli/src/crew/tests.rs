use std::{
    os::unix::process::ExitStatusExt,
    path::Path,
    process::Command,
    time::{Duration, Instant},
};

use super::{Crew, Ending, Loss, Report};

const AT_ONCE: Ending = Ending::AtOnce(Duration::from_millis(500));
const IN_ORDER: Ending = Ending::InOrder(Duration::from_secs(30));

fn shell(script: &str) -> Command {
    let mut command = Command::new("/bin/sh");
    command.args(["-c", script]);
    command
}

/// A crew of `role` and a bystander that runs for a minute unless it is stopped.
fn crew(folder: &Path, script: &str) -> Crew {
    let mut crew = Crew::new();
    crew.start(
        "bystander",
        &mut shell("exec sleep 60"),
        folder.join("bystander.log"),
    )
    .unwrap();
    crew.start("policy", &mut shell(script), folder.join("policy.log"))
        .unwrap();
    crew
}

/// Looks until something happens.
fn wait(crew: &mut Crew) -> Result<(&'static str, Report), Loss> {
    let give_up = Instant::now() + Duration::from_secs(30);
    loop {
        if let Some(report) = crew.next()? {
            return Ok(report);
        }
        assert!(Instant::now() < give_up, "nothing happened");
    }
}

fn is_alive(pid: u32) -> bool {
    Path::new(&format!("/proc/{pid}")).exists()
}

#[test]
fn reports_arrive_with_their_role_and_other_lines_do_not() {
    let folder = tempfile::tempdir().unwrap();
    let script =
        r#"echo hello; echo '{"report":"nonsense"}'; echo '{"report":"ready"}'; exec sleep 60"#;
    let mut crew = crew(folder.path(), script);
    assert_eq!(wait(&mut crew), Ok(("policy", Report::Ready)));
    assert_eq!(crew.stop(AT_ONCE), []);
}

#[test]
fn a_killed_member_is_named_and_the_others_end() {
    let folder = tempfile::tempdir().unwrap();
    let mut crew = crew(folder.path(), "echo out of luck >&2; kill -9 $$");
    let bystander = crew.members[0].child.id();
    let loss = wait(&mut crew).unwrap_err();
    assert_eq!((loss.role, loss.status.signal()), ("policy", Some(9)));
    let text = loss.to_string();
    assert!(text.contains("the policy process (pid "), "{text}");
    assert!(
        text.contains("ended by signal 9; its last words: out of luck"),
        "{text}"
    );
    crew.stop(AT_ONCE);
    assert!(!is_alive(bystander));
}

#[test]
fn a_member_that_ends_by_itself_is_a_loss_too() {
    let folder = tempfile::tempdir().unwrap();
    let loss = wait(&mut crew(folder.path(), "exit 3")).unwrap_err();
    assert!(loss.to_string().contains("ended with status 3"), "{loss}");
}

#[test]
fn the_last_report_of_a_member_that_is_asked_to_end_is_heard() {
    let folder = tempfile::tempdir().unwrap();
    let script = r#"
trap 'echo "{\"report\":\"ready\"}"; exit 0' TERM
echo '{"report":"ready"}'
while :; do sleep 0.01; done"#;
    let mut crew = crew(folder.path(), script);
    wait(&mut crew).unwrap();
    assert_eq!(crew.stop(IN_ORDER), [("policy", Report::Ready)]);
}

#[test]
fn a_member_that_ignores_the_request_is_killed() {
    let folder = tempfile::tempdir().unwrap();
    let script = r#"trap '' TERM; echo '{"report":"ready"}'; while :; do sleep 0.01; done"#;
    let mut crew = crew(folder.path(), script);
    wait(&mut crew).unwrap();
    let pid = crew.members[1].child.id();
    crew.stop(AT_ONCE);
    assert!(!is_alive(pid));
}

#[test]
fn a_dropped_crew_leaves_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let crew = crew(folder.path(), "exec sleep 60");
    let pids: Vec<u32> = crew
        .members
        .iter()
        .map(|member| member.child.id())
        .collect();
    drop(crew);
    assert!(pids.into_iter().all(|pid| !is_alive(pid)));
}

#[test]
fn a_log_that_cannot_be_written_names_the_remedy() {
    let error = Crew::new().start("policy", &mut shell("exit 0"), "/proc/none/log".into());
    let text = format!("{:#}", error.unwrap_err());
    assert!(
        text.contains("/proc/none/log cannot be written: choose another --out"),
        "{text}"
    );
}

#[test]
fn in_order_the_last_started_ends_before_the_first_is_asked() {
    let folder = tempfile::tempdir().unwrap();
    let note = |name: &str, wait: &str| {
        let file = folder.path().join("order");
        let ready = r#"echo '{"report":"ready"}'"#;
        let file = file.display();
        format!(
            "trap '{wait} echo {name} >> {file}; exit 0' TERM; {ready}; while :; do sleep 0.01; done"
        )
    };
    let mut crew = Crew::new();
    crew.start(
        "first",
        &mut shell(&note("first", "")),
        folder.path().join("1.log"),
    )
    .unwrap();
    let slow = note("last", "sleep 0.2;");
    crew.start("last", &mut shell(&slow), folder.path().join("2.log"))
        .unwrap();
    wait(&mut crew).unwrap();
    wait(&mut crew).unwrap();
    crew.stop(IN_ORDER);
    let order = std::fs::read_to_string(folder.path().join("order")).unwrap();
    assert_eq!(order, "last\nfirst\n");
}
