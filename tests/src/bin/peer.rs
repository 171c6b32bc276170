//! A peer of a controller as a process of its own, for tests that kill it:
//! `peer robot|policy|agents|listener DIRECTORY`.

use std::path::Path;

use fitmac_rt::{instance::Instance, port::Receiver, service, transport::Ipc};
use fitmac_tests::cell::{AgentsState, PolicyState, RobotState, Shared, agents, policy, robot};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [role, root] = arguments.as_slice() else {
        panic!("usage: peer robot|policy|agents|listener DIRECTORY");
    };
    let instance = Instance::at(Path::new(root)).expect("a short path");
    let transport = Ipc::join(&instance).expect("joins");
    match role.as_str() {
        "robot" => robot(&transport, &Shared::new(RobotState::default())),
        "policy" => policy(&transport, &Shared::new(PolicyState::moving())),
        "agents" => agents(&transport, &Shared::new(AgentsState::default())),
        "listener" => {
            let mut states = Receiver::connect(&transport, &service::STATE).expect("connects");
            let mut commands = Receiver::connect(&transport, &service::COMMAND).expect("connects");
            loop {
                let _ = (states.poll(), commands.poll());
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
        }
        other => panic!("there is no role {other}"),
    }
}
