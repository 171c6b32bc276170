//! The openpi client against a stand-in server, whole and broken, and against
//! openpi's own Python client and message format.

#[path = "openpi/faults.rs"]
mod faults;
#[path = "openpi/python.rs"]
mod python;

use std::{
    io::{Read, Write},
    net::TcpStream,
};

use fitmac_openpi::{
    Answer, Client, Conventions, Failure, Image, Observation, Settings, libero_state,
    metadata::Expectation,
};
use fitmac_rt::clock::now_ns;
use fitmac_tests::openpi::{Behaviour, Question, Role, StandIn};

const HORIZON: usize = 10;

/// Goes on for ever.
fn on() -> bool {
    true
}

/// Actions that say which question they answer: the first is the state's x, the
/// gripper closes.
fn echo(question: &Question) -> Vec<[f64; 7]> {
    (0..HORIZON)
        .map(|row| {
            [
                question.state[0],
                0.0,
                0.01 * row as f64,
                0.0,
                0.0,
                0.0,
                1.0,
            ]
        })
        .collect()
}

fn settings(server: &StandIn) -> Settings {
    let address = server.url().parse().expect("an address");
    Settings {
        retry_first_ms: 1,
        retry_max_ms: 20,
        ..Settings::new(address, Conventions::libero(HORIZON))
    }
}

fn client(settings: Settings) -> Client {
    Client::new(settings, now_ns).expect("a sound horizon")
}

fn pictures() -> [Image; 2] {
    [1_u8, 7].map(|step| {
        let bytes = (0..Image::BYTES).map(|i| (i as u8).wrapping_mul(step));
        Image::new(bytes.collect()).expect("a picture")
    })
}

/// Asks with this x of the tool.
fn ask(client: &mut Client, x_m: f64) -> Result<Answer, Failure> {
    let [image, wrist_image] = pictures();
    let observation = Observation {
        image: &image,
        wrist_image: &wrist_image,
        state: libero_state([x_m, 0.0, 0.3], [0.0, 1.0, 0.0, 0.0], 0.08, [0.0; 3]),
        prompt: "put the can on the plate",
    };
    client.infer(&observation, &on)
}

/// Asks until there is a connection to ask over.
fn ask_when_connected(client: &mut Client, x_m: f64) -> Result<Answer, Failure> {
    loop {
        match ask(client, x_m) {
            Err(Failure::Waiting) => std::thread::sleep(std::time::Duration::from_millis(1)),
            other => return other,
        }
    }
}

#[test]
fn a_question_arrives_whole_and_so_does_its_answer() {
    let server = StandIn::start(Role::sound(echo));
    let mut client = client(settings(&server));
    for (round, behaviour) in [Behaviour::Answers, Behaviour::AnswersNarrow]
        .into_iter()
        .enumerate()
    {
        server.behave(behaviour);
        let x_m = 0.25 + 0.25 * round as f64;
        let answer = ask(&mut client, x_m).expect("an answer");
        assert_eq!(answer.actions.len(), HORIZON);
        assert_eq!(
            answer.actions[3],
            [x_m as f32, 0.0, 0.03, 0.0, 0.0, 0.0, 1.0]
        );
        assert_eq!(answer.server_ms, Some(1.5));
    }
    let [first, _] = server.questions().try_into().expect("two questions");
    let [image, wrist_image] = pictures();
    assert_eq!(
        (&first.image[..], &first.wrist_image[..]),
        (image.rgb(), wrist_image.rgb())
    );
    assert_eq!(first.prompt, "put the can on the plate");
    let expected = [0.25, 0.0, 0.3, std::f64::consts::PI, 0.0, 0.0, 0.04, -0.04];
    assert_eq!(first.state, expected);
    assert_eq!(
        (client.counters().connections, client.counters().answers),
        (1, 2)
    );
    assert!(client.counters().failures.is_empty());
}

#[test]
fn the_metadata_is_checked_before_a_question_is_asked() {
    let role = Role {
        metadata: vec![("model", "pi05_libero"), ("robot", "panda")],
        ..Role::sound(echo)
    };
    let server = StandIn::start(role);
    let expect = |value: &str| {
        let expected = vec![Expectation {
            key: "model".into(),
            value: value.into(),
        }];
        client(Settings {
            expected,
            ..settings(&server)
        })
    };
    let mut right = expect("pi05_libero");
    ask(&mut right, 0.5).expect("an answer");
    let metadata = right.metadata().expect("a connection");
    assert_eq!(metadata.text("robot").as_deref(), Some("panda"));
    let mut wrong = expect("pi0_libero");
    let failure = ask(&mut wrong, 0.5).unwrap_err();
    assert!(matches!(failure, Failure::WrongServer(_)), "{failure}");
    assert!(failure.to_string().contains("\"pi05_libero\""), "{failure}");
    assert_eq!(server.questions().len(), 1, "the wrong server was asked");
}

#[test]
fn the_health_page_answers_as_openpis_does() {
    let server = StandIn::start(Role::sound(echo));
    let mut tcp = TcpStream::connect(("127.0.0.1", server.port())).expect("it listens");
    tcp.write_all(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n")
        .expect("sent");
    let mut page = String::new();
    tcp.read_to_string(&mut page).expect("an answer");
    assert!(
        page.starts_with("HTTP/1.1 200") && page.ends_with("OK\n"),
        "{page}"
    );
}
