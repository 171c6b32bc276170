//! One hop of a message between two cores: two threads that throw it to each other and poll.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
};

use anyhow::{Context, anyhow};
use iceoryx2::{
    port::{publisher::Publisher, subscriber::Subscriber},
    prelude::{
        Config, FileName, LogLevel, NodeBuilder, Path, SemanticString, SignalHandlingMode,
        ZeroCopySend, ipc, set_log_level_from_env_or,
    },
};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

/// Hops of a batch: two to a round trip.
pub(crate) const BATCH: usize = 200;

#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
struct Message {
    number: u64,
    rest: [u64; 63],
}

/// One side.
struct Side {
    send: Publisher<ipc::Service, Message, ()>,
    receive: Subscriber<ipc::Service, Message, ()>,
    last: u64,
}

impl Side {
    fn join(folder: &std::path::Path, to: &str, from: &str) -> anyhow::Result<Self> {
        set_log_level_from_env_or(LogLevel::Fatal);
        let mut config = Config::default();
        let bad = |error| anyhow!("{error:?}");
        config.global.prefix = FileName::new(b"fitmac_bench_").map_err(bad)?;
        let path = Path::new(folder.as_os_str().as_encoded_bytes());
        config.global.set_root_path(&path.map_err(bad)?);
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()?;
        let service = |name: &str| -> anyhow::Result<_> {
            let name = name.try_into().map_err(|error| anyhow!("{error:?}"))?;
            let builder = node.service_builder(&name).publish_subscribe::<Message>();
            let builder = builder.max_publishers(1).max_subscribers(1).history_size(0);
            let builder = builder.subscriber_max_buffer_size(1).max_nodes(2);
            Ok(builder.enable_safe_overflow(true).open_or_create()?)
        };
        Ok(Self {
            send: service(to)?.publisher_builder().create()?,
            receive: service(from)?.subscriber_builder().create()?,
            last: 0,
        })
    }

    fn throw(&self, number: u64) {
        if let Ok(sample) = self.send.loan_uninit() {
            let rest = [number; 63];
            // A failure shows as a catch that never comes, and ends by `given_up`.
            let _ = sample.write_payload(Message { number, rest }).send();
        }
    }

    /// Polls until a new message comes, or `ended`.
    fn catch(&mut self, ended: &AtomicBool) -> Option<u64> {
        loop {
            if let Ok(Some(sample)) = self.receive.receive()
                && sample.number != self.last
            {
                self.last = sample.number;
                return Some(sample.number);
            }
            if ended.load(Ordering::Relaxed) {
                return None;
            }
            std::hint::spin_loop();
        }
    }
}

/// Two sides, one of them a thread on another core.
pub(crate) struct Hop {
    side: std::cell::RefCell<Side>,
    ended: Arc<AtomicBool>,
    other: JoinHandle<anyhow::Result<()>>,
    _folder: tempfile::TempDir,
}

impl Hop {
    /// Binds this thread to one core and the other side to another, where there is one.
    pub(crate) fn start() -> anyhow::Result<Self> {
        let folder = tempfile::tempdir().context("a folder for the message's services")?;
        let cores = sched_getaffinity(None)?;
        let mut cores = (0..CpuSet::MAX_CPU).filter(|&core| cores.is_set(core));
        let first = cores.next().context("no core")?;
        let second = cores.next().context("a hop needs two cores")?;
        bind(first)?;
        let side = Side::join(folder.path(), "ping", "pong")?;
        let ended = Arc::new(AtomicBool::new(false));
        let (path, end) = (folder.path().to_owned(), Arc::clone(&ended));
        let (ready, is_ready) = std::sync::mpsc::channel();
        let other = thread::spawn(move || {
            bind(second)?;
            let mut side = Side::join(&path, "pong", "ping")?;
            ready.send(()).context("the other side is gone")?;
            while let Some(number) = side.catch(&end) {
                side.throw(number);
            }
            Ok(())
        });
        if is_ready.recv().is_err() {
            let joined = other.join().map_err(|_| anyhow!("the other side died"))?;
            return Err(joined
                .err()
                .unwrap_or_else(|| anyhow!("the other side ended")));
        }
        Ok(Self {
            side: std::cell::RefCell::new(side),
            ended,
            other,
            _folder: folder,
        })
    }

    /// Half as many round trips as hops.
    pub(crate) fn batch(&self) {
        let mut side = self.side.borrow_mut();
        for _ in 0..BATCH / 2 {
            let number = side.last + 1;
            side.throw(number);
            side.catch(&self.ended);
        }
    }

    /// Ends the other side.
    pub(crate) fn end(self) -> anyhow::Result<()> {
        self.ended.store(true, Ordering::Relaxed);
        let joined = self.other.join();
        joined.map_err(|_| anyhow!("the other side died"))?
    }
}

fn bind(core: usize) -> anyhow::Result<()> {
    let mut cores = CpuSet::new();
    cores.set(core);
    sched_setaffinity(None, &cores).context("a thread cannot be bound to a core")
}
