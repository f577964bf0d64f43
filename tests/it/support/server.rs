//! A server on a free port of this machine, for one client after another.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::shell::PATIENCE;

/// The server. Ends when dropped, once its client has left.
pub struct Server {
    port: u16,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Serves each client like this.
    pub fn start(mut serve: impl FnMut(TcpStream) + Send + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let port = listener.local_addr().expect("an address").port();
        let over = Arc::new(AtomicBool::new(false));
        let ends = over.clone();
        let thread = thread::spawn(move || {
            for client in listener.incoming() {
                if ends.load(Ordering::Relaxed) {
                    return;
                }
                let client = client.expect("a client");
                client.set_read_timeout(Some(PATIENCE)).expect("set");
                client.set_nodelay(true).expect("set");
                serve(client);
            }
        });
        Server { port, over, thread: Some(thread) }
    }

    /// A raw socket with this serial port behind it, at 115,200 baud.
    pub fn of_port(path: &Path) -> Self {
        let path = PathBuf::from(path);
        Server::start(move |client| bridge(&path, client, usize::MAX))
    }

    /// The same; it hangs up when so many bytes have come from its client.
    pub fn of_port_for(path: &Path, bytes: usize) -> Self {
        let path = PathBuf::from(path);
        Server::start(move |client| bridge(&path, client, bytes))
    }

    /// The link to it.
    pub fn link(&self, scheme: &str) -> String {
        format!("{scheme}://127.0.0.1:{}", self.port)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        // It waits for the next client: this one.
        let _ = TcpStream::connect(("127.0.0.1", self.port));
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Carries bytes both ways until the client leaves, the port goes, or so many bytes have come from the client.
fn bridge(path: &Path, mut client: TcpStream, most: usize) {
    let name = path.to_str().expect("UTF-8");
    let mut port = serialport::new(name, 115_200).timeout(Duration::from_millis(20)).open().expect("the port opens");
    let mut reader = port.try_clone().expect("a second handle");
    let mut socket = client.try_clone().expect("a second handle");
    let left = Arc::new(AtomicBool::new(false));
    let over = left.clone();
    let upward = thread::spawn(move || {
        let mut buffer = [0; 4096];
        while !over.load(Ordering::Relaxed) {
            match reader.read(&mut buffer) {
                Ok(0) => panic!("the port has ended"),
                Ok(count) if socket.write_all(&buffer[..count]).is_err() => break,
                Ok(_) => {}
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
                Err(error) => panic!("the port: {error}"),
            }
        }
        let _ = socket.shutdown(Shutdown::Both);
    });
    let mut buffer = [0; 4096];
    let mut carried = 0;
    while carried < most {
        match client.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => {
                carried += count;
                let mut left = &buffer[..count];
                while !left.is_empty() {
                    match port.write(left) {
                        Ok(count) => left = &left[count..],
                        Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
                        Err(error) => panic!("the port: {error}"),
                    }
                }
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            // Whoever kills a client resets the connection.
            Err(_) => break,
        }
    }
    left.store(true, Ordering::Relaxed);
    upward.join().expect("no panic");
}
