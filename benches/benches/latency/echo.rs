//! The floor: a bare iceoryx2 echo of the same payloads, in the same rhythm.

use std::thread::{self, JoinHandle};

use anyhow::anyhow;
use fitmac_core::message::{Command, StateSample};
use fitmac_rt::{clock, envelope::Envelope, instance::Instance, layout::Payload, signals::Signals};
use iceoryx2::{
    port::{publisher::Publisher, subscriber::Subscriber},
    prelude::*,
    service::port_factory::publish_subscribe::PortFactory,
};

use crate::{LEAD_NS, PERIOD_NS, in_front};

type Send<T> = Publisher<ipc::Service, Envelope<T>, ()>;
type Receive<T> = Subscriber<ipc::Service, Envelope<T>, ()>;

/// Makes the ends of the echo: nothing of ours is in them but the payloads.
pub(crate) struct Ends {
    node: Node<ipc::Service>,
}

impl Ends {
    pub(crate) fn join(instance: &Instance) -> anyhow::Result<Self> {
        set_log_level_from_env_or(LogLevel::Fatal);
        let bad = |error| anyhow!("{error:?}");
        let mut config = Config::default();
        config.global.prefix = FileName::new(instance.prefix().as_bytes()).map_err(bad)?;
        let root = instance.root().join("echo");
        let root = Path::new(root.as_os_str().as_encoded_bytes());
        config.global.set_root_path(&root.map_err(bad)?);
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()?;
        Ok(Self { node })
    }

    pub(crate) fn sender<T: Payload>(&self, name: &str) -> anyhow::Result<Send<T>> {
        let builder = self.service::<T>(name)?;
        let builder = builder.publisher_builder();
        let builder = builder.backpressure_strategy(BackpressureStrategy::DiscardData);
        Ok(builder.max_loaned_samples(1).create()?)
    }

    pub(crate) fn receiver<T: Payload>(&self, name: &str) -> anyhow::Result<Receive<T>> {
        Ok(self.service::<T>(name)?.subscriber_builder().create()?)
    }

    fn service<T: Payload>(
        &self,
        name: &str,
    ) -> anyhow::Result<PortFactory<ipc::Service, Envelope<T>, ()>> {
        let name = name.try_into().map_err(|error| anyhow!("{error:?}"))?;
        let builder = self.node.service_builder(&name);
        let builder = builder.publish_subscribe::<Envelope<T>>();
        let builder = builder.max_publishers(1).subscriber_max_buffer_size(1);
        let builder = builder.history_size(0).enable_safe_overflow(true);
        Ok(builder.open_or_create()?)
    }
}

/// Starts the echo on `core`: it keeps the rhythm of the samples as the control
/// loop does, and answers each with a command.
pub(crate) fn start(
    instance: &Instance,
    core: usize,
    signals: &Signals,
) -> JoinHandle<anyhow::Result<()>> {
    let (instance, signals) = (instance.clone(), signals.clone());
    thread::spawn(move || {
        let ends = Ends::join(&instance)?;
        let states = ends.receiver::<StateSample>("state")?;
        let commands = ends.sender::<Command>("command")?;
        let _prepared = in_front(core).prepare();
        let mut sample = Box::new(Envelope::<StateSample>::empty());
        let mut command = Command::zeroed();
        let mut due_ns = clock::now_ns() + PERIOD_NS;
        while !signals.stop_requested() {
            clock::sleep_until(due_ns - LEAD_NS);
            if !wait(&states, due_ns + LEAD_NS, &mut sample)? {
                due_ns = clock::now_ns() + PERIOD_NS - LEAD_NS;
                continue;
            }
            command.stamp_ns = clock::now_ns();
            command.sequence += 1;
            let answer = Envelope::new(1, command.sequence, command.stamp_ns, command);
            commands.loan_uninit()?.write_payload(answer).send()?;
            due_ns = sample.header.stamp_ns + PERIOD_NS;
        }
        Ok(())
    })
}

/// Polls until a sample is there, and takes it out, or until `limit_ns`.
fn wait(
    states: &Receive<StateSample>,
    limit_ns: u64,
    into: &mut Envelope<StateSample>,
) -> anyhow::Result<bool> {
    loop {
        if let Some(sample) = states.receive()? {
            // What was sent is read, once: whoever answers it has done that.
            *into = std::hint::black_box(*sample.payload());
            return Ok(true);
        }
        if clock::now_ns() > limit_ns {
            return Ok(false);
        }
        std::hint::spin_loop();
    }
}
