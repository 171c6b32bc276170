//! One suite for every transport: what the endpoints rely on.

use fitmac_core::{
    Controller, Params,
    message::{ActionChunk, CHUNK_CAPACITY, Command, GroundingRecord, PolicyQuery, StateSample},
};
use fitmac_rt::{
    endpoint::{AgentsEndpoint, ControllerEndpoint, HarnessEndpoint, PolicyEndpoint},
    envelope::{Envelope, HeaderFault},
    instance::Instance,
    layout::Payload,
    message::PromptText,
    port::{Receiver, Sender, Session},
    service::{self, Service},
    transport::{ConnectError, Ipc, Lockstep, Transport},
};

fn chunk(sequence: u64) -> ActionChunk {
    ActionChunk {
        sequence,
        horizon: CHUNK_CAPACITY as u32,
        actions: core::array::from_fn(|i| [sequence as f32 + i as f32; 7]),
        ..ActionChunk::default()
    }
}

fn sender<T: Payload, Tr: Transport>(t: &Tr, s: &Service<T>) -> Sender<T, Tr> {
    Sender::connect(t, s, Session(7)).expect("a sender connects")
}

fn receiver<T: Payload, Tr: Transport>(t: &Tr, s: &Service<T>) -> Receiver<T, Tr> {
    Receiver::connect(t, s).expect("a receiver connects")
}

fn every_byte_arrives_in_order_and_once<Tr: Transport>(t: &Tr) {
    const DEEP: Service<ActionChunk> = Service::new("deep", 8, 0);
    let mut out = sender(t, &DEEP);
    let (mut a, mut b) = (receiver(t, &DEEP), receiver(t, &DEEP));
    for i in 1..=8 {
        out.send(100 + i, &chunk(i)).expect("sends");
    }
    for receiver in [&mut a, &mut b] {
        for i in 1..=8 {
            let got = receiver.poll().expect("a message waits");
            assert_eq!(got.payload.as_bytes(), chunk(i).as_bytes());
            assert_eq!(got.header, Envelope::<ActionChunk>::header(7, i, 100 + i));
        }
        assert!(receiver.poll().is_none());
        assert_eq!(receiver.counts().received, 8);
        assert_eq!(receiver.counts().overwritten, 0);
    }
}

fn a_full_buffer_drops_the_oldest_and_the_sender_goes_on<Tr: Transport>(t: &Tr) {
    let mut out = sender(t, &service::CHUNK);
    // One that never reads, as a stopped process, and one that reads late.
    let _stopped = receiver(t, &service::CHUNK);
    let mut late = receiver(t, &service::CHUNK);
    for i in 1..=1000 {
        out.send(i, &chunk(i)).expect("the sender never waits");
    }
    assert_eq!(late.poll().map(|e| e.payload.sequence), Some(1000));
    assert!(late.poll().is_none());
    out.send(0, &chunk(1001)).expect("sends");
    out.send(0, &chunk(1002)).expect("sends");
    assert_eq!(late.poll().map(|e| e.payload.sequence), Some(1002));
    assert_eq!(late.counts().overwritten, 1);
}

fn late_receivers_get_the_history_and_no_more<Tr: Transport>(t: &Tr) {
    let mut state = sender(t, &service::STATE);
    let mut chunks = sender(t, &service::CHUNK);
    for i in 1..=3 {
        let sample = StateSample {
            sequence: i,
            ..StateSample::default()
        };
        state.send(0, &sample).expect("sends");
        chunks.send(0, &chunk(i)).expect("sends");
    }
    let mut late = receiver(t, &service::STATE);
    let mut without = receiver(t, &service::CHUNK);
    // A sender notices new receivers when it sends, so send on.
    state
        .send(
            0,
            &StateSample {
                sequence: 4,
                ..StateSample::default()
            },
        )
        .expect("sends");
    assert_eq!(late.poll().map(|e| e.payload.sequence), Some(4));
    assert!(without.poll().is_none(), "the chunk service keeps nothing");
    // One that seldom sends refreshes instead.
    let mut later = receiver(t, &service::STATE);
    state.refresh().expect("sends");
    assert_eq!(later.poll().map(|e| e.payload.sequence), Some(4));
    state.refresh().expect("sends");
    assert!(later.poll().is_none(), "the history comes once");

    let mut prompts = sender(t, &service::PROMPT);
    let mut texts = receiver(t, &service::PROMPT);
    for id in 0..5 {
        let prompt = PromptText::new(id, 0, 0, "lift the can").expect("fits");
        prompts.send(0, &prompt).expect("sends");
    }
    let ids: Vec<u32> = core::iter::from_fn(|| texts.poll().map(|e| e.payload.prompt_id)).collect();
    assert_eq!(ids, [0, 1, 2, 3, 4]);
}

fn a_second_sender_is_refused_until_the_first_has_gone<Tr: Transport>(t: &Tr) {
    let first = sender(t, &service::COMMAND);
    match Sender::connect(t, &service::COMMAND, Session(8)).err() {
        Some(ConnectError::SenderExists { service, limit: 1 }) => assert_eq!(service, "command"),
        other => panic!("a second sender was not refused: {other:?}"),
    }
    drop(first);
    let mut second = Sender::connect(t, &service::COMMAND, Session(8)).expect("room again");
    let mut robot = receiver(t, &service::COMMAND);
    second.send(0, &Command::zeroed()).expect("sends");
    assert_eq!(robot.poll().map(|e| e.header.session), Some(8));
}

fn receivers_have_a_limit<Tr: Transport>(t: &Tr) {
    let all: Vec<_> = (0..service::CHUNK.max_subscribers)
        .map(|_| receiver(t, &service::CHUNK))
        .collect();
    assert!(matches!(
        Receiver::connect(t, &service::CHUNK).err(),
        Some(ConnectError::TooManyReceivers { limit: 8, .. })
    ));
    drop(all);
    receiver(t, &service::CHUNK);
}

fn another_type_under_the_same_name_is_refused<Tr: Transport>(t: &Tr) {
    const WRONG: Service<GroundingRecord> = Service::new("state", 1, 1);
    let _right = sender(t, &service::STATE);
    assert!(matches!(
        Receiver::connect(t, &WRONG).err(),
        Some(ConnectError::Incompatible {
            service: "state",
            ..
        })
    ));
    assert!(matches!(
        Sender::connect(t, &WRONG, Session(1)).err(),
        Some(ConnectError::Incompatible { .. })
    ));
}

fn a_wrong_head_is_dropped_counted_and_named<Tr: Transport>(t: &Tr) {
    let mut out = sender(t, &service::CHUNK);
    let mut inlet = receiver(t, &service::CHUNK);
    let good = Envelope::<ActionChunk>::header(7, 1, 0);
    let spoilt = [
        fitmac_rt::envelope::Header { magic: 0, ..good },
        fitmac_rt::envelope::Header {
            abi_version: 2,
            ..good
        },
        fitmac_rt::envelope::Header {
            payload_size: 3,
            ..good
        },
        fitmac_rt::envelope::Header {
            schema_hash: 4,
            ..good
        },
    ];
    for (n, header) in spoilt.into_iter().enumerate() {
        out.send_raw(header, &chunk(1)).expect("sends");
        assert!(inlet.poll().is_none(), "{header:?} was let through");
        assert_eq!(inlet.counts().malformed, n as u64 + 1);
    }
    assert_eq!(
        inlet.newest_fault(),
        Some(HeaderFault::Schema {
            found: 4,
            expected: Envelope::<ActionChunk>::SCHEMA_HASH
        })
    );
    out.send_raw(good, &chunk(1)).expect("sends");
    assert!(inlet.poll().is_some(), "a good one is read after them");
}

fn a_receiver_outlives_its_sender_and_sees_the_next<Tr: Transport>(t: &Tr) {
    let mut inlet = receiver(t, &service::CHUNK);
    for session in [1, 2] {
        let mut out =
            Sender::connect(t, &service::CHUNK, Session(session)).expect("a sender connects");
        out.send(0, &chunk(session)).expect("sends");
        assert_eq!(inlet.poll().map(|e| e.header.session), Some(session));
    }
    assert!(inlet.poll().is_none());
    assert_eq!(inlet.counts().sessions, 1);
}

fn the_roles_reach_each_other<Tr: Transport>(t: &Tr) {
    let mut controller = ControllerEndpoint::connect(t, Session(1)).expect("connects");
    let mut harness = HarnessEndpoint::connect(t, Session(2)).expect("connects");
    let mut policy = PolicyEndpoint::connect(t, Session(3)).expect("connects");
    let mut agents = AgentsEndpoint::connect(t, Session(4)).expect("connects");

    let mut sample = StateSample::default();
    harness.publish_state(10, &mut sample).expect("sends");
    let mut record = GroundingRecord::default();
    agents.send_grounding(11, &mut record).expect("sends");
    agents.send_grounding(12, &mut record).expect("sends");

    controller.poll();
    let input = controller.input();
    assert_eq!(input.state.map(|s| (s.session, s.sequence)), Some((2, 1)));
    assert_eq!(input.grounding.map(|g| g.sequence), Some(1));
    assert!(input.chunk.is_none() && input.plan.is_none() && input.critic.is_none());
    assert_eq!(policy.poll_state().map(|s| s.sequence), Some(1));
    assert_eq!(agents.poll_state().map(|s| s.sequence), Some(1));

    // Records queue up, one a tick; samples don't.
    controller.poll();
    assert_eq!(controller.input().grounding.map(|g| g.sequence), Some(2));
    assert!(controller.input().state.is_none());

    let mut core = Controller::new(
        Params::default()
            .validate()
            .expect("the defaults are valid"),
    );
    let mut output = core.tick(20, &controller.input());
    let query = PolicyQuery {
        query_id: 9,
        stamp_ns: 20,
        state_sequence: 1,
        policy_step: 0,
        epoch: 3,
        subtask: 1,
        prompt_id: 4,
    };
    output.query = Some(query);
    controller.publish(20, &output).expect("sends");
    let command = harness.poll_command().expect("a command came");
    assert_eq!(command.payload, output.command);
    assert_eq!(command.header.session, 1);

    assert_eq!(policy.poll_query(), Some(query));
    assert_eq!(policy.poll_query(), None);
    policy.send_chunk(21, &query, &mut chunk(0)).expect("sends");
    controller.poll();
    let got = controller.input().chunk.copied().expect("a chunk came");
    assert_eq!(
        (got.query_id, got.epoch, got.subtask, got.prompt_id),
        (9, 3, 1, 4)
    );
    assert_eq!((got.session, got.sequence, got.stamp_ns), (3, 1, 21));
}

macro_rules! conformance {
    ($($case:ident),+ $(,)?) => {
        mod lockstep {
            $(#[test] fn $case() { super::$case(&super::Lockstep::new()); })+
        }
        mod ipc {
            $(#[test] fn $case() {
                let instance = super::Instance::temporary().expect("a temporary instance");
                let transport = super::Ipc::join(&instance).expect("joins");
                super::$case(&transport);
                drop(transport);
                assert_eq!(instance.files(), Vec::<std::path::PathBuf>::new());
            })+
        }
    };
}

conformance!(
    every_byte_arrives_in_order_and_once,
    a_full_buffer_drops_the_oldest_and_the_sender_goes_on,
    late_receivers_get_the_history_and_no_more,
    a_second_sender_is_refused_until_the_first_has_gone,
    receivers_have_a_limit,
    another_type_under_the_same_name_is_refused,
    a_wrong_head_is_dropped_counted_and_named,
    a_receiver_outlives_its_sender_and_sees_the_next,
    the_roles_reach_each_other,
);
