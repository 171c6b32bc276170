//! openpi's own ends: its Python client asks the stand-in, and our client asks
//! a server of the documentation that speaks by openpi's `msgpack_numpy`.

use std::{
    fs,
    net::{TcpListener, TcpStream},
    path::Path,
    process::{Child, Command},
};

use fitmac_openpi::{Conventions, Settings};
use fitmac_tests::{
    fitmac::wait_for,
    link::{blocks, run},
    openpi::{Behaviour, Role, StandIn},
    oracle::{python, workspace_root},
};

use super::{HORIZON, ask, client, echo};

/// A Python program, killed if the test forgets it.
struct Program(Child);

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn openpis_client_understands_the_stand_in() {
    let role = Role {
        metadata: vec![("model", "pi05_libero")],
        ..Role::sound(echo)
    };
    let server = StandIn::start(role);
    let script = workspace_root().join("tests/oracles/openpi_client_asks.py");
    let ask = |expect: &str| {
        let mut command = Command::new(python());
        command
            .arg(&script)
            .arg(server.port().to_string())
            .arg(expect);
        run(&mut command)
    };
    for behaviour in [Behaviour::Answers, Behaviour::AnswersNarrow] {
        server.behave(behaviour);
        let said = ask("answer");
        assert_eq!(said.trim(), "pi05_libero (10, 7) 0.25 0.09 1.0 1.5");
    }
    server.behave(Behaviour::Fails("ValueError: no model"));
    let said = ask("error");
    assert!(said.contains("ValueError: no model"), "{said}");
    let question = server.questions().pop().expect("a question");
    assert_eq!(question.state, [0.25, 0.0, 0.5, 3.0, 0.0, 0.0, 0.04, -0.04]);
    assert_eq!((question.image[0], question.wrist_image[0]), (7, 9));
    assert_eq!(question.prompt, "put the can on the plate");
}

/// The server of the page, on another port.
fn page_server(port: u16) -> Program {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("openpi-{port}"));
    fs::create_dir_all(&folder).expect("a folder");
    let code = blocks("openpi.md", "python").concat();
    assert!(code.contains("8000"), "the page's port");
    let script = folder.join("server.py");
    fs::write(&script, code.replace("8000", &port.to_string())).expect("written");
    let child = Command::new(python()).arg(&script).spawn();
    let program = Program(child.expect("python starts"));
    wait_for("the server", || {
        TcpStream::connect(("127.0.0.1", port)).ok()
    });
    program
}

fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    listener.local_addr().expect("bound").port()
}

#[test]
fn our_client_understands_openpis_message_format() {
    let port = free_port();
    let _server = page_server(port);
    let address = format!("ws://127.0.0.1:{port}")
        .parse()
        .expect("an address");
    let mut client = client(Settings::new(address, Conventions::libero(HORIZON)));
    for _ in 0..3 {
        let answer = ask(&mut client, 0.25).expect("an answer");
        assert_eq!(answer.actions.len(), HORIZON);
        assert_eq!(answer.actions[9], [0.0, 0.0, 0.2, 0.0, 0.0, 0.0, -1.0]);
    }
    let metadata = client.metadata().expect("a connection");
    assert_eq!(metadata.text("model").as_deref(), Some("stand-in"));
    assert_eq!(client.counters().connections, 1);
}
