//! What became of a model's call stands in the controller's trace: real
//! processes, a stand-in server.

use std::{fs, path::Path};

use fitmac_agents::model::stand_in::{Manner, StandIn};
use fitmac_rt::{
    instance::Instance,
    layout::Payload,
    message::{ModelCall, ModelRole},
    port::Receiver,
    service::{self, Service},
    trace::{Damage, Record, TraceReader},
    transport::Ipc,
};
use fitmac_tests::{
    cell::signal,
    fitmac::{Place, wait_for},
};
use rustix::process::Signal;

const CARD: &str = r#"{"instruction": "tidy the mug into the bin", "surface_m": 0.0,
    "surface_colour": [0.5, 0.5, 0.5], "objects": []}"#;

/// The first message of a service, once its instance is there.
fn first<T: Payload>(instance: &Instance, service: &Service<T>) -> T {
    let mut receiver = wait_for(service.name, || {
        let transport = Ipc::join(instance).ok()?;
        Receiver::connect(&transport, service).ok()
    });
    wait_for(service.name, || receiver.poll().map(|e| e.payload))
}

/// The model calls in a trace, up to where it ends.
fn calls(trace: &Path) -> (Vec<ModelCall>, Option<Damage>) {
    let Ok(mut reader) = TraceReader::open(trace) else {
        return (Vec::new(), None);
    };
    let calls = reader.by_ref().filter_map(|record| match record {
        Record::ModelCall(_, call) => Some(*call),
        _ => None,
    });
    let calls = calls.collect();
    (calls, reader.damage().cloned())
}

#[test]
fn a_models_call_stands_in_the_trace_with_its_outcome() {
    let server = StandIn::start(Manner::Content("sure, on my way".into())).expect("a port");
    let place = Place::new();
    let trace = place.folder().join("run.mcap");
    fs::write(place.folder().join("card.json"), CARD).expect("written");
    let rt = [
        "rt",
        "--instance=cell",
        "--allow-non-rt",
        "--trace=run.mcap",
    ];
    let controller = place.start(&rt);
    let instance = Instance::at(&place.folder().join("fitmac/cell")).expect("an instance");
    // From here on the recorder listens.
    first(&instance, &service::STATUS);
    let url = format!("--model-url={}", server.url());
    let agents = ["agents", "--instance=cell", "--card=card.json", "--model=m"];
    let agents = place.start(&[&agents[..], &[&*url]].concat());

    let told = first(&instance, &service::MODEL_CALL);
    // The recorder writes out twice a second.
    wait_for("the call in the trace", || calls(&trace).0.pop());
    signal(agents.pid(), Signal::TERM);
    let said = agents.finish().stderr;
    signal(controller.pid(), Signal::TERM);
    let ended = controller.finish();
    assert!(ended.status.success(), "{}", ended.stderr);

    assert_eq!(told.role, ModelRole::Planner as u8);
    assert_eq!((told.outcome(), told.attempts), (Some("schema"), 1));
    assert!(told.latency_ns > 0 && told.asked_ns > 0);
    assert!(said.contains("didn't help the planner: schema"), "{said}");
    assert_eq!(calls(&trace), (vec![told], None));
    let shown = place.start(&["trace", "events", "run.mcap"]).finish();
    let line = "model call of the planner: schema after ";
    assert!(shown.stdout.contains(line), "{}", shown.stdout);
}
