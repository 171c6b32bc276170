//! One connection: bounded in time and size, whatever the other end does.

use std::{
    io::{self, ErrorKind, Read, Write},
    net::{TcpStream, ToSocketAddrs},
    time::Duration,
};

use tungstenite::{
    Bytes, Error, HandshakeError, Message, WebSocket,
    client::{IntoClientRequest, client_with_config},
    http::header::AUTHORIZATION,
    protocol::WebSocketConfig,
};

use crate::{
    client::{Failure, Settings},
    refusal::Refusal,
};

/// How often a wait looks whether it shall go on, ns.
const SLICE_NS: u64 = 50_000_000;

/// How long a read or a write may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Patience {
    /// What is there now.
    None,
    /// Until then.
    Until(u64),
}

/// A stream whose reads and writes end with [`ErrorKind::WouldBlock`] when their time is over. A
/// read that gets a byte now and then ends too: the time is absolute.
#[derive(Debug)]
struct Timed {
    tcp: TcpStream,
    clock: fn() -> u64,
    patience: Patience,
}

impl Timed {
    /// The time that is left; none if it is over.
    fn left(&self, until_ns: u64) -> io::Result<Duration> {
        match until_ns.saturating_sub((self.clock)()) {
            0 => Err(ErrorKind::WouldBlock.into()),
            // The system rounds a shorter time-out to none, which means for ever.
            left_ns => Ok(Duration::from_nanos(left_ns).max(Duration::from_millis(1))),
        }
    }

    fn patiently<T>(
        &mut self,
        limit: fn(&TcpStream, Option<Duration>) -> io::Result<()>,
        call: impl FnOnce(&mut TcpStream) -> io::Result<T>,
    ) -> io::Result<T> {
        let result = match self.patience {
            Patience::None => {
                self.tcp.set_nonblocking(true)?;
                let result = call(&mut self.tcp);
                self.tcp.set_nonblocking(false)?;
                result
            }
            Patience::Until(until_ns) => {
                limit(&self.tcp, Some(self.left(until_ns)?))?;
                call(&mut self.tcp)
            }
        };
        result.map_err(|error| match error.kind() {
            ErrorKind::TimedOut | ErrorKind::Interrupted => ErrorKind::WouldBlock.into(),
            _ => error,
        })
    }
}

impl Read for Timed {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.patiently(TcpStream::set_read_timeout, |tcp| tcp.read(buffer))
    }
}

impl Write for Timed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.patiently(TcpStream::set_write_timeout, |tcp| tcp.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.tcp.flush()
    }
}

/// A websocket to a server.
#[derive(Debug)]
pub(crate) struct Link {
    socket: WebSocket<Timed>,
    clock: fn() -> u64,
    max_bytes: usize,
}

impl Link {
    /// Connects and shakes hands until `deadline_ns`.
    pub(crate) fn open(
        settings: &Settings,
        clock: fn() -> u64,
        deadline_ns: u64,
    ) -> Result<Self, Failure> {
        let unreachable = |problem: String| Failure::Unreachable { problem };
        let tcp = connect(settings, clock, deadline_ns).map_err(unreachable)?;
        tcp.set_nodelay(true)
            .map_err(|error| unreachable(error.to_string()))?;
        let uri = settings.address.uri().clone();
        let mut request = uri
            .into_client_request()
            .map_err(|error| unreachable(error.to_string()))?;
        if let Some(key) = &settings.api_key {
            request.headers_mut().insert(AUTHORIZATION, key.header());
        }
        let config = WebSocketConfig::default()
            .max_message_size(Some(settings.answer_max_bytes))
            .max_frame_size(Some(settings.answer_max_bytes));
        let stream = Timed {
            tcp,
            clock,
            patience: Patience::Until(deadline_ns),
        };
        match client_with_config(request, stream, Some(config)) {
            Ok((socket, _)) => Ok(Self {
                socket,
                clock,
                max_bytes: settings.answer_max_bytes,
            }),
            Err(HandshakeError::Interrupted(_)) => Err(Failure::TimedOut {
                stage: "the handshake",
            }),
            Err(HandshakeError::Failure(Error::Http(response))) => Err(unreachable(format!(
                "it answered with HTTP status {}: no websocket server, or the key is wrong",
                response.status()
            ))),
            Err(HandshakeError::Failure(error)) => Err(unreachable(error.to_string())),
        }
    }

    /// Sends a frame.
    pub(crate) fn send(
        &mut self,
        frame: Vec<u8>,
        deadline_ns: u64,
        keep_going: &dyn Fn() -> bool,
    ) -> Result<(), Failure> {
        const STAGE: &str = "sending the observation";
        self.slice(STAGE, deadline_ns, keep_going)?;
        let mut sent = self.socket.write(Message::Binary(frame.into()));
        loop {
            match sent {
                Ok(()) => match self.socket.flush() {
                    Ok(()) => return Ok(()),
                    again => sent = again,
                },
                Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => {
                    self.slice(STAGE, deadline_ns, keep_going)?;
                    sent = Ok(()); // the frame is queued: go on with it
                }
                Err(error) => return Err(self.failure(error)),
            }
        }
    }

    /// The next binary frame; `stage` says what is waited for.
    pub(crate) fn receive(
        &mut self,
        stage: &'static str,
        deadline_ns: u64,
        keep_going: &dyn Fn() -> bool,
    ) -> Result<Bytes, Failure> {
        loop {
            self.slice(stage, deadline_ns, keep_going)?;
            if let Some(frame) = self.read()? {
                return Ok(frame);
            }
        }
    }

    /// Answers what the server sends between two questions: pings. It closes a connection that
    /// leaves them unanswered.
    pub(crate) fn tend(&mut self) -> Result<(), Failure> {
        /// Frames that are looked at in one go.
        const FRAMES_MAX: usize = 64;
        self.socket.get_mut().patience = Patience::None;
        for _ in 0..FRAMES_MAX {
            match self.socket.read() {
                Ok(message) if message.is_binary() || message.is_text() => {
                    return Err(Failure::Refused(Refusal::Unsolicited));
                }
                Ok(Message::Close(_)) => return Err(disconnected("the server closed")),
                Ok(_) => {}
                Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) => return Err(self.failure(error)),
            }
        }
        Ok(())
    }

    /// A frame, or none yet.
    fn read(&mut self) -> Result<Option<Bytes>, Failure> {
        match self.socket.read() {
            Ok(Message::Binary(frame)) => Ok(Some(frame)),
            Ok(Message::Text(text)) => Err(Failure::Refused(Refusal::server_failed(&text))),
            Ok(Message::Close(_)) => Err(disconnected("the server closed")),
            Ok(Message::Ping(_) | Message::Pong(_) | Message::Frame(_)) => Ok(None),
            Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => Ok(None),
            Err(error) => Err(self.failure(error)),
        }
    }

    /// Lets the next reads and writes last for a slice of the time until the deadline.
    fn slice(
        &mut self,
        stage: &'static str,
        deadline_ns: u64,
        keep_going: &dyn Fn() -> bool,
    ) -> Result<(), Failure> {
        if !keep_going() {
            return Err(Failure::Stopped);
        }
        let now_ns = (self.clock)();
        if now_ns >= deadline_ns {
            return Err(Failure::TimedOut { stage });
        }
        let until_ns = now_ns.saturating_add(SLICE_NS).min(deadline_ns);
        self.socket.get_mut().patience = Patience::Until(until_ns);
        Ok(())
    }

    fn failure(&self, error: Error) -> Failure {
        match error {
            Error::Capacity(_) => Failure::Refused(Refusal::Oversized {
                max_bytes: self.max_bytes,
            }),
            Error::ConnectionClosed | Error::AlreadyClosed => disconnected("the server closed"),
            other => disconnected(&other.to_string()),
        }
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.socket.get_mut().patience = Patience::None;
        // A farewell, if there is room for it; the server sees the end of the stream anyway.
        let _ = self.socket.close(None);
    }
}

fn disconnected(problem: &str) -> Failure {
    Failure::Disconnected {
        problem: problem.to_owned(),
    }
}

/// The first of the host's addresses that answers.
fn connect(settings: &Settings, clock: fn() -> u64, deadline_ns: u64) -> Result<TcpStream, String> {
    let address = &settings.address;
    let found = (address.host(), address.port()).to_socket_addrs();
    let found = found.map_err(|error| format!("its name cannot be looked up: {error}"))?;
    let mut problem = "its name has no address".to_owned();
    for socket in found {
        let left = Duration::from_nanos(deadline_ns.saturating_sub(clock()));
        if left.is_zero() {
            return Err("it does not answer in time".to_owned());
        }
        match TcpStream::connect_timeout(&socket, left) {
            Ok(tcp) => return Ok(tcp),
            Err(error) => problem = error.to_string(),
        }
    }
    Err(problem)
}
