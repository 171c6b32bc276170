//! One connection of the stand-in.

use std::{
    io::{self, ErrorKind, Read, Write},
    net::{Shutdown, TcpStream},
    sync::atomic::Ordering,
    thread,
    time::Duration,
};

use tungstenite::{Bytes, Error, Message, WebSocket};

use super::{Behaviour, Question, Role, Shared, frame, lock};

/// How often a connection looks whether the server ends.
const LOOK: Duration = Duration::from_millis(20);

/// Serves until the client goes, the server ends, or a behaviour ends it.
pub(super) fn serve(mut tcp: TcpStream, shared: &Shared) -> io::Result<()> {
    let mut start = [0; 13];
    tcp.set_read_timeout(Some(Duration::from_secs(5)))?;
    let count = tcp.peek(&mut start)?;
    if start[..count].starts_with(b"GET /healthz ") {
        // Read first: closing with something unread would take the page back.
        let read = tcp.read(&mut [0; 4096])?;
        debug_assert!(read > 0);
        let head = "HTTP/1.1 200 OK\r\nContent-Length: 3\r\nConnection: close\r\n\r\n";
        return tcp.write_all(format!("{head}OK\n").as_bytes());
    }
    let mut socket = tungstenite::accept(tcp).map_err(io::Error::other)?;
    let metadata = frame::metadata(&lock(&shared.role).metadata);
    send(&mut socket, Message::Binary(metadata.into()))?;
    socket.get_mut().set_read_timeout(Some(LOOK))?;
    while !shared.ended.load(Ordering::SeqCst) {
        match socket.read() {
            Ok(Message::Binary(question)) => {
                if !answer(&mut socket, shared, &question)? {
                    break;
                }
            }
            Ok(Message::Pong(_)) => *lock(&shared.pongs) += 1,
            Ok(Message::Close(_)) => break,
            Ok(_) => {}
            Err(Error::Io(e))
                if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) =>
            {
                send(&mut socket, Message::Ping(Bytes::new()))?;
            }
            Err(error) => return Err(io::Error::other(error)),
        }
    }
    // As a killed process: the stream ends without a farewell.
    socket.get_mut().shutdown(Shutdown::Both)
}

type Socket = WebSocket<TcpStream>;

fn send(socket: &mut Socket, message: Message) -> io::Result<()> {
    socket.send(message).map_err(io::Error::other)
}

/// Answers a question; whether the connection goes on.
fn answer(socket: &mut Socket, shared: &Shared, question: &[u8]) -> io::Result<bool> {
    let question = match Question::read(question) {
        Ok(question) => question,
        Err(error) => return fail(socket, &error),
    };
    lock(&shared.questions).push(question.clone());
    let Role {
        behaviour, policy, ..
    } = lock(&shared.role).clone();
    let rows = policy(&question);
    let sound = || wide(&rows, &[rows.len(), 7], 0);
    let frames = match behaviour {
        Behaviour::Answers => vec![sound()],
        Behaviour::AnswersTwice => vec![sound(), sound()],
        Behaviour::AnswersAfter(wait) => {
            thread::sleep(wait);
            vec![sound()]
        }
        Behaviour::AnswersNarrow => {
            let data = rows
                .iter()
                .flatten()
                .flat_map(|x| (*x as f32).to_le_bytes());
            vec![frame::answer("<f4", &[rows.len(), 7], data.collect(), 0)]
        }
        Behaviour::Shape(shape) => {
            let count = shape.iter().product::<usize>();
            vec![frame::answer("<f8", &shape, vec![0; 8 * count], 0)]
        }
        Behaviour::Puts(row, column, number) => {
            let mut rows = rows.clone();
            rows[row][column] = number;
            vec![wide(&rows, &[rows.len(), 7], 0)]
        }
        Behaviour::Dtype(dtype) => vec![frame::answer(
            dtype,
            &[rows.len(), 7],
            vec![0; 56 * rows.len()],
            0,
        )],
        Behaviour::Sends(bytes) => vec![bytes],
        Behaviour::Oversized(bytes) => vec![wide(&rows, &[rows.len(), 7], bytes)],
        Behaviour::Fails(last_line) => return fail(socket, last_line),
        Behaviour::Hangs => vec![],
        Behaviour::Drips => return drip(socket, shared),
        Behaviour::Closes => return Ok(false),
    };
    for frame in frames {
        send(socket, Message::Binary(frame.into()))?;
    }
    Ok(true)
}

fn wide(rows: &[[f64; 7]], shape: &[usize], padding: usize) -> Vec<u8> {
    let data = rows.iter().flatten().flat_map(|x| x.to_le_bytes());
    frame::answer("<f8", shape, data.collect(), padding)
}

/// As openpi: the traceback as text, then the end.
fn fail(socket: &mut Socket, last_line: &str) -> io::Result<bool> {
    let text = format!("Traceback (most recent call last):\n  File \"policy.py\"\n{last_line}\n");
    send(socket, Message::Text(text.into()))?;
    Ok(false)
}

/// A binary frame of 60000 bytes that comes a byte at a time.
fn drip(socket: &mut Socket, shared: &Shared) -> io::Result<bool> {
    let tcp = socket.get_mut();
    tcp.write_all(&[0x82, 126, 0xea, 0x60])?;
    while !shared.ended.load(Ordering::SeqCst) {
        tcp.write_all(&[0xc0])?;
        thread::sleep(Duration::from_millis(5));
    }
    Ok(false)
}
