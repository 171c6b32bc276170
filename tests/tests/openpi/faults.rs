//! What a policy server can do wrong. Whatever it is, it has a name, no action
//! of it is used, and the next sound answer is.

use std::{
    net::TcpListener,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, Instant},
};

use fitmac_openpi::{Client, Failure, Settings};
use fitmac_tests::{
    fitmac::wait_for,
    openpi::{Behaviour, Role, StandIn},
};

use super::{ask, ask_when_connected, client, echo, on, settings};

/// Longer than any wait here on a busy machine.
const GIVE_UP: Duration = Duration::from_secs(60);

fn impatient(server: &StandIn) -> Client {
    client(Settings {
        answer_timeout_ms: 150,
        first_answer_timeout_ms: 150,
        ..settings(server)
    })
}

#[test]
fn an_unsound_answer_is_refused_by_name_and_the_next_one_used() {
    let server = StandIn::start(Role::sound(echo));
    let mut client = client(settings(&server));
    let cases = [
        (Behaviour::Sends(vec![]), "malformed"),
        (Behaviour::Sends(vec![0xc1; 40]), "malformed"),
        (
            Behaviour::Sends(vec![0xdf, 0xff, 0xff, 0xff, 0xff]),
            "malformed",
        ),
        (
            Behaviour::Sends(b"\x80\x04\x95pickle".to_vec()),
            "malformed",
        ),
        (Behaviour::Shape(vec![70]), "shape"),
        (Behaviour::Shape(vec![10, 8]), "shape"),
        (Behaviour::Shape(vec![1, 10, 7]), "shape"),
        (Behaviour::Shape(vec![0, 7]), "horizon"),
        (Behaviour::Shape(vec![5, 7]), "horizon"),
        (Behaviour::Shape(vec![65, 7]), "horizon"),
        (Behaviour::Dtype("<i8"), "format"),
        (Behaviour::Dtype(">f8"), "format"),
        (Behaviour::Puts(9, 5, f64::NAN), "not_finite"),
        (Behaviour::Puts(0, 0, f64::INFINITY), "not_finite"),
        (Behaviour::Puts(2, 1, 46.0), "out_of_range"),
        (Behaviour::Puts(4, 6, -40.0), "gripper_convention"),
        (Behaviour::Oversized(2 << 20), "oversized"),
        (
            Behaviour::Fails("ValueError: no \x1b[31mmodel"),
            "server_failed",
        ),
        (Behaviour::Closes, "disconnected"),
    ];
    let mut answers = 0;
    for (behaviour, name) in cases {
        server.behave(behaviour.clone());
        let failure = ask_when_connected(&mut client, 0.5).unwrap_err();
        assert_eq!(failure.name(), name, "{behaviour:?}: {failure}");
        assert!(!failure.to_string().contains('\x1b'), "{failure:?}");
        assert!(client.counters().failures[name] > 0);
        server.behave(Behaviour::Answers);
        let answer = ask_when_connected(&mut client, 0.25).expect("an answer");
        assert_eq!(answer.actions[0][0], 0.25, "after {behaviour:?}");
        answers += 1;
        assert_eq!(client.counters().answers, answers);
    }
}

#[test]
fn a_late_answer_is_never_taken_for_the_next_one() {
    let server = StandIn::start(Role::sound(echo));
    let mut client = impatient(&server);
    server.behave(Behaviour::AnswersAfter(Duration::from_millis(400)));
    let failure = ask(&mut client, 0.5).unwrap_err();
    assert_eq!(failure.to_string(), "the answer took too long");
    server.behave(Behaviour::Answers);
    for x_m in [0.125, 0.25, 0.375] {
        let answer = ask_when_connected(&mut client, x_m).expect("an answer");
        assert_eq!(f64::from(answer.actions[0][0]), x_m);
        thread::sleep(Duration::from_millis(150)); // the late one comes meanwhile
    }
    assert_eq!(client.counters().connections, 2);
}

#[test]
fn silence_and_dripping_bytes_end_in_time() {
    let server = StandIn::start(Role::sound(echo));
    let mut client = impatient(&server);
    for behaviour in [Behaviour::Hangs, Behaviour::Drips] {
        server.behave(behaviour.clone());
        let started = Instant::now();
        let failure = ask_when_connected(&mut client, 0.5).unwrap_err();
        assert_eq!(failure.name(), "timed_out", "{behaviour:?}");
        assert!(started.elapsed() < GIVE_UP, "{behaviour:?}");
    }
}

#[test]
fn an_answer_too_many_is_not_kept_for_the_next_question() {
    let server = StandIn::start(Role::sound(echo));
    let mut client = client(settings(&server));
    server.behave(Behaviour::AnswersTwice);
    ask(&mut client, 0.5).expect("the first of them");
    server.behave(Behaviour::Answers);
    let failure = wait_for("the second", || client.tend(&on).err());
    assert_eq!(failure.name(), "unsolicited");
    let answer = ask_when_connected(&mut client, 0.25).expect("an answer");
    assert_eq!(answer.actions[0][0], 0.25);
}

#[test]
fn a_killed_server_is_found_again_when_it_is_back() {
    let server = StandIn::start(Role::sound(echo));
    let mut client = client(settings(&server));
    ask(&mut client, 0.5).expect("an answer");
    let port = server.port();
    drop(server);
    let failure = ask_when_connected(&mut client, 0.5).unwrap_err();
    assert_eq!(failure.name(), "disconnected", "{failure}");
    assert!(client.metadata().is_none());
    let failure = ask_when_connected(&mut client, 0.5).unwrap_err();
    assert_eq!(failure.name(), "unreachable", "{failure}");
    let _server = StandIn::start_at(port, Role::sound(echo));
    let answer = wait_for("the server", || ask(&mut client, 0.25).ok());
    assert_eq!(answer.actions[0][0], 0.25);
    assert_eq!(client.counters().connections, 2);
}

#[test]
fn tries_to_connect_are_spaced() {
    let port = {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        listener.local_addr().expect("bound").port()
    };
    let server = StandIn::start_at(port, Role::sound(echo));
    let settings = Settings {
        retry_first_ms: 3_600_000,
        ..settings(&server)
    };
    drop(server);
    let mut client = client(settings);
    assert_eq!(ask(&mut client, 0.5).unwrap_err().name(), "unreachable");
    for _ in 0..100 {
        assert_eq!(ask(&mut client, 0.5), Err(Failure::Waiting));
    }
    assert_eq!(client.counters().failures["unreachable"], 1);
}

#[test]
fn an_idle_client_answers_pings() {
    let server = StandIn::start(Role::sound(echo));
    let mut client = client(settings(&server));
    wait_for("an answer to a ping", || {
        client.tend(&on).expect("a connection");
        (server.pongs() > 2).then_some(())
    });
    ask(&mut client, 0.5).expect("an answer");
    assert_eq!(client.counters().connections, 1);
}

#[test]
fn a_stop_ends_a_wait() {
    static STOPPED: AtomicBool = AtomicBool::new(false);
    let server = StandIn::start(Role::sound(echo));
    let mut client = client(settings(&server));
    server.behave(Behaviour::Hangs);
    client.tend(&on).expect("a connection");
    let stopper = thread::spawn(|| {
        thread::sleep(Duration::from_millis(100));
        STOPPED.store(true, Ordering::SeqCst);
    });
    let [image, wrist_image] = super::pictures();
    let observation = fitmac_openpi::Observation {
        image: &image,
        wrist_image: &wrist_image,
        state: [0.0; 8],
        prompt: "",
    };
    let started = Instant::now();
    let result = client.infer(&observation, &|| !STOPPED.load(Ordering::SeqCst));
    assert_eq!(result, Err(Failure::Stopped));
    assert!(started.elapsed() < GIVE_UP);
    stopper.join().expect("it ends");
}

#[test]
fn what_is_no_policy_server_is_told_apart() {
    // A page server: HTTP, but no websocket.
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("ws://{}", listener.local_addr().expect("bound"));
    let pages = thread::spawn(move || {
        use std::io::{Read, Write};
        let (mut tcp, _) = listener.accept().expect("a client");
        let mut request = [0; 1024];
        let _ = tcp.read(&mut request).expect("a request");
        tcp.write_all(b"HTTP/1.1 403 Forbidden\r\nContent-Length: 0\r\n\r\n")
            .expect("sent");
    });
    let conventions = fitmac_openpi::Conventions::libero(super::HORIZON);
    let settings = Settings::new(address.parse().expect("an address"), conventions);
    let failure = ask(&mut client(settings), 0.5).unwrap_err();
    assert!(failure.to_string().contains("HTTP status 403"), "{failure}");
    pages.join().expect("it ends");
}
