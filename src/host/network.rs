//! From an address to a connection, and a remote serial port set up on it.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;

use super::address::Address;
use super::clock::Clock;
use super::link::WRITE_PATIENCE;
use crate::telnet::{Awaited, Client, Refusal};
use crate::time::Duration;

/// Why a network link does not open, or what became of it.
#[derive(Debug, thiserror::Error)]
pub enum NetworkError {
    /// The name leads nowhere.
    #[error("the host '{host}' is not found ({error})")]
    UnknownHost {
        /// The name.
        host: String,
        /// What the resolver says.
        error: io::Error,
    },
    /// The host is there; nobody listens on that port.
    #[error("nothing listens there (connection refused)")]
    Refused,
    /// Nobody answers at all.
    #[error("there is no answer within {} s", after.as_secs())]
    NoAnswer {
        /// How long it was waited for.
        after: Duration,
    },
    /// The connection does not come about for another reason.
    #[error("cannot connect ({0})")]
    Unreachable(io::Error),
    /// The other side has hung up instead of setting up its port.
    #[error("the other side closed the connection{}", said.as_ref().map(|said| format!(", saying '{said}'")).unwrap_or_default())]
    Closed {
        /// What it said, where it said something.
        said: Option<String>,
    },
    /// It answers, but its serial port is of no use.
    #[error(transparent)]
    Port(Refusal),
    /// It owes an answer about its serial port.
    #[error("{} within {} s", missing(*.awaited), after.as_secs())]
    Unset {
        /// What it owes.
        awaited: Awaited,
        /// How long it was waited for.
        after: Duration,
    },
    /// An open connection was lost on the way.
    #[error("the network has lost the other side ({0})")]
    Lost(io::Error),
}

fn missing(awaited: Awaited) -> &'static str {
    match awaited {
        Awaited::Telnet => "what listens there says no word of telnet",
        Awaited::ComPort => "the server speaks telnet, but does not answer to RFC 2217 (COM-PORT-OPTION)",
        Awaited::Baud => "the server does not confirm the line rate",
    }
}

/// How long the system may take to find the addresses of a name: its resolver asks a second server when the first has been
/// silent for 5 s.
pub const LOOK_UP_PATIENCE: Duration = Duration::from_secs(8);

/// How long the other side may take to accept a connection, all its addresses together: three lost packets on a slow
/// network, and as long as a person assumes that something happens.
pub const CONNECT_PATIENCE: Duration = Duration::from_secs(4);

/// How long a server may take to set up its port: some messages there and back, and a serial port that is opened.
pub const SET_UP_PATIENCE: Duration = Duration::from_secs(3);

/// Addresses of a name that are tried.
const ADDRESSES: usize = 4;

/// Bytes of a unit that are kept while the server sets up its port: more than a line carries in that time.
const EARLY: usize = 1 << 20;

/// Characters quoted of what a server said before it closed the connection.
const QUOTED: usize = 80;

/// Connects. Every byte leaves at once, and writing takes no longer than [`WRITE_PATIENCE`] for nothing.
///
/// # Errors
/// If the name leads nowhere, or nobody there accepts.
pub fn connect(address: &Address, clock: Clock) -> Result<TcpStream, NetworkError> {
    let unknown = |error| NetworkError::UnknownHost { host: address.host().to_owned(), error };
    let name = (address.host().to_owned(), address.port());
    let found = look_up(move || name.to_socket_addrs().map(Iterator::collect), LOOK_UP_PATIENCE).map_err(unknown)?;
    let found = &found[..found.len().min(ADDRESSES)];
    let deadline = clock.now() + CONNECT_PATIENCE;
    let mut failure = unknown(io::Error::new(ErrorKind::NotFound, "it has no address"));
    for (left, address) in (1..=found.len() as u32).rev().zip(found) {
        // An address that does not answer must not take the time of those after it. Zero would be no timeout.
        let share = (clock.until(deadline) / left).max(Duration::from_millis(1));
        failure = match TcpStream::connect_timeout(address, share) {
            Ok(socket) => {
                set_up(&socket).map_err(NetworkError::Unreachable)?;
                return Ok(socket);
            }
            Err(error) => match error.kind() {
                ErrorKind::ConnectionRefused => NetworkError::Refused,
                ErrorKind::TimedOut | ErrorKind::WouldBlock => NetworkError::NoAnswer { after: CONNECT_PATIENCE },
                _ => NetworkError::Unreachable(error),
            },
        };
    }
    Err(failure)
}

/// Asks the system for the addresses of a name. Nothing calls its resolver off, so one that takes too long is left to
/// itself, in its thread.
fn look_up(
    ask: impl FnOnce() -> io::Result<Vec<SocketAddr>> + Send + 'static,
    patience: Duration,
) -> io::Result<Vec<SocketAddr>> {
    let (answer, answered) = sync_channel(1);
    thread::Builder::new().name("resolver".into()).spawn(move || {
        let _ = answer.send(ask());
    })?;
    answered.recv_timeout(patience).unwrap_or_else(|error| {
        Err(match error {
            RecvTimeoutError::Timeout => {
                let what = format!("the system has not found its address within {} s", patience.as_secs());
                io::Error::new(ErrorKind::TimedOut, what)
            }
            RecvTimeoutError::Disconnected => io::Error::other("the system's resolver has failed"),
        })
    })
}

fn set_up(socket: &TcpStream) -> io::Result<()> {
    // Keys and records are short, and each waits for its answer.
    socket.set_nodelay(true)?;
    socket.set_write_timeout(Some(WRITE_PATIENCE))?;
    keep_alive(socket);
    Ok(())
}

/// Lets the system find out that the other side is gone although nothing is said: a console listens for hours, a host
/// that lost its power says no goodbye, and routers forget connections on which nothing moves. A system that cannot do
/// it only notices later.
#[cfg(any(target_os = "linux", target_os = "macos"))]
fn keep_alive(socket: &TcpStream) {
    use rustix::net::sockopt;

    /// Silence before the first question, between questions, and how many go unanswered: gone within half a minute.
    const IDLE: Duration = Duration::from_secs(15);
    const INTERVAL: Duration = Duration::from_secs(5);
    const QUESTIONS: u32 = 3;
    let _ = sockopt::set_socket_keepalive(socket, true);
    let _ = sockopt::set_tcp_keepidle(socket, IDLE);
    let _ = sockopt::set_tcp_keepintvl(socket, INTERVAL);
    let _ = sockopt::set_tcp_keepcnt(socket, QUESTIONS);
    // The same for bytes that nobody acknowledges, which questions do not cover.
    #[cfg(target_os = "linux")]
    let _ = sockopt::set_tcp_user_timeout(socket, (IDLE + INTERVAL * QUESTIONS).as_millis() as u32);
}

#[cfg(not(any(target_os = "linux", target_os = "macos")))]
fn keep_alive(_socket: &TcpStream) {}

/// Agrees with the server about its serial port. What the unit said meanwhile is appended to `early`.
///
/// # Errors
/// If the server refuses, sets something else, or does not answer in time.
pub fn negotiate(
    socket: &TcpStream,
    client: &mut Client,
    clock: Clock,
    early: &mut Vec<u8>,
) -> Result<(), NetworkError> {
    let deadline = clock.now() + SET_UP_PATIENCE;
    let mut buffer = [0; 4096];
    loop {
        while let Some(request) = client.poll_transmit() {
            let mut socket = socket;
            socket.write_all(&request).map_err(|error| ended(error, early))?;
        }
        if let Some(refusal) = client.refusal() {
            return Err(NetworkError::Port(refusal.clone()));
        }
        let Some(awaited) = client.awaited() else {
            return socket.set_read_timeout(None).map_err(NetworkError::Lost);
        };
        let left = clock.until(deadline);
        if left.is_zero() || early.len() > EARLY {
            return Err(NetworkError::Unset { awaited, after: SET_UP_PATIENCE });
        }
        socket.set_read_timeout(Some(left)).map_err(NetworkError::Lost)?;
        let mut reading = socket;
        match reading.read(&mut buffer) {
            Ok(0) => return Err(NetworkError::Closed { said: quoted(early) }),
            Ok(count) => client.receive(&buffer[..count], early),
            // Time is over, or a signal came: the loop knows.
            Err(error)
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(error) => return Err(ended(error, early)),
        }
    }
}

fn ended(error: io::Error, said: &[u8]) -> NetworkError {
    if is_hang_up(&error) { NetworkError::Closed { said: quoted(said) } } else { NetworkError::Lost(error) }
}

/// Whether an error of a socket means that the other side has closed the connection.
pub fn is_hang_up(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::ConnectionReset | ErrorKind::ConnectionAborted | ErrorKind::BrokenPipe | ErrorKind::NotConnected
    )
}

/// The beginning of what a server said in words ("port already in use"), in one harmless line.
fn quoted(said: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(said);
    let words: Vec<&str> =
        text.split(|c: char| c.is_whitespace() || c.is_control()).filter(|w| !w.is_empty()).collect();
    let line: String = words.join(" ").chars().take(QUOTED).collect();
    (!line.is_empty()).then_some(line)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resolver_that_does_not_answer_is_not_waited_for() {
        let (never, ends) = std::sync::mpsc::channel::<()>();
        let stuck = move || {
            let _ = ends.recv();
            Ok(Vec::new())
        };
        let error = look_up(stuck, Duration::from_millis(1)).expect_err("no answer");
        assert_eq!(error.kind(), ErrorKind::TimedOut);
        drop(never);
        let found = look_up(|| Ok(vec![([127, 0, 0, 1], 2000).into()]), Duration::from_secs(60));
        assert_eq!(found.ok(), Some(vec![([127, 0, 0, 1], 2000).into()]));
    }
}
