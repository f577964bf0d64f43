//! The link of the loop: opened, taken over, lost, looked for, closed.

use std::path::PathBuf;

use super::Console;
use super::answers::Found;
use super::player::Player;
use crate::host::clock;
use crate::host::comeback::Comeback;
use crate::host::link::{self, Connection, LinkError, LinkSpec};
use crate::host::recorder::Recorder;
use crate::host::replay::Recording;
use crate::host::socket::Dialled;
use crate::record::{LINK_BACK, LINK_LOST};
use crate::time::Instant;
use crate::tui::{Failure, Input, LinkInfo, LinkKind};

/// A network link that was dialled.
pub(super) struct Dial {
    /// Which of those dialled so far.
    number: u64,
    name: String,
    spec: LinkSpec,
    result: Result<Dialled, LinkError>,
}

impl Console {
    /// Opens a link that does not have to be dialled.
    pub(super) fn open(&mut self, name: &str, spec: LinkSpec) {
        if let LinkSpec::Replay(path) = spec {
            return self.open_recording(name, path);
        }
        match (self.world.open)(&spec, self.world.baud, self.clock, self.sender.clone()) {
            Ok(connection) => self.begin(name, connection, spec),
            Err(failure) => self.handle(Input::LinkFailed(failure)),
        }
    }

    fn open_recording(&mut self, name: &str, path: PathBuf) {
        let recording = match Recording::open_file(&path) {
            Ok(recording) => recording,
            Err(error) => return self.handle(Input::LinkFailed((self.world.unreadable)(error))),
        };
        self.take_rest();
        self.close_link();
        let player = Player::begin(name, path, recording, self.now());
        let info = player.link_info(self.world.baud);
        self.player = Some(player);
        self.handle(Input::LinkOpened(info));
    }

    /// Begins to dial a network link, in a thread: a host that is switched off answers nothing for seconds.
    pub(super) fn dial(&mut self, name: String, spec: LinkSpec) {
        let (number, clock, options) = (self.dial, self.clock, link::Options { baud: self.world.baud });
        self.ask(move || {
            let result = Connection::dial(&spec, options, clock);
            Found::Dialled(Box::new(Dial { number, name, spec, result }))
        });
    }

    /// Takes what came of dialling, unless the user has gone on to something else.
    pub(super) fn take_dialled(&mut self, Dial { number, name, spec, result }: Dial) {
        if number != self.dial {
            return;
        }
        let options = link::Options { baud: self.world.baud };
        let connection =
            result.and_then(|dialled| Connection::over(&spec, dialled, options, self.clock, self.sender.clone()));
        match connection {
            Ok(connection) => self.begin(&name, connection, spec),
            Err(error) => self.handle(Input::LinkFailed((self.world.explain)(error))),
        }
    }

    /// Takes over an open link and starts its recording.
    fn begin(&mut self, name: &str, connection: Connection, spec: LinkSpec) {
        // What the old link has brought belongs to its own session and recording; what the new one has said since it was
        // opened waits for its own.
        self.take_rest();
        self.close_link();
        self.sessions += 1;
        let plan = self.world.recording.of_session(self.sessions);
        self.recorder = Recorder::start_ahead(&plan, &connection, self.clock, self.skew);
        let recording = self.recorder.path().map(|path| path.display().to_string());
        let options = link::Options { baud: self.world.baud };
        self.comeback = Comeback::of(&spec, options);
        self.link = Some(connection);
        let start_of_day = clock::day_before(self.clock.time_of_day(), self.skew);
        let opened = Input::LinkOpened(LinkInfo {
            link: name.to_owned(),
            baud: self.world.baud,
            kind: match spec {
                LinkSpec::Emulated(product) => LinkKind::Emulated(product),
                LinkSpec::Replay(_) => LinkKind::Recording,
                LinkSpec::Serial(_) | LinkSpec::Tcp(_) | LinkSpec::Rfc2217(_) => LinkKind::Unit,
            },
            recording,
            noted: (self.world.noted)(name),
            start_of_day,
            start_millis: self.clock.wall(Instant::ZERO).as_millisecond()
                - i64::try_from(self.skew.as_millis()).unwrap_or_default(),
        });
        self.handle(opened);
    }

    /// The open link has ended by itself.
    pub(super) fn lose_link(&mut self, failure: Failure) {
        // What the reader has brought since the writer noticed the loss, or before a write that was refused.
        self.take_rest();
        if self.link.is_none() {
            return;
        }
        let recorder = std::mem::take(&mut self.recorder);
        let mut comeback = self.comeback.take();
        self.close_link();
        if let Some(comeback) = &mut comeback {
            comeback.lost();
            self.recorder = recorder;
            self.recorder.mark(self.now(), LINK_LOST);
            self.retry = Some(self.clock.now() + Comeback::RETRY);
        }
        self.comeback = comeback;
        self.handle(Input::LinkGone(failure));
    }

    /// Looks whether the lost link is there again.
    pub(super) fn look_for_link(&mut self) {
        let Some(comeback) = &self.comeback else { return self.retry = None };
        let Some(connection) = comeback.open(self.clock, self.sender.clone()) else {
            self.retry = Some(self.clock.now() + Comeback::RETRY);
            return;
        };
        self.retry = None;
        let name = connection.port().to_owned();
        self.recorder.mark(self.now(), &format!("{LINK_BACK}as {name}"));
        self.link = Some(connection);
        self.handle(Input::LinkBack(name));
    }

    /// Closes the link; what it has put on the channel and nobody has taken is forgotten.
    pub(super) fn close_link(&mut self) {
        // The console's time goes on from where the recording's is.
        let now = self.now();
        self.player = None;
        self.skew += now.since(self.now());
        self.comeback = None;
        self.retry = None;
        if let Some(link) = self.link.take() {
            let id = link.id();
            // Its threads end here, and what they bring meanwhile is nobody's.
            drop(link);
            self.inbox.forget(id);
        }
        self.recorder = Recorder::nothing();
    }

    /// Hands the app what the open link has brought and nobody has taken, as the last of it.
    fn take_rest(&mut self) {
        if let Some(link) = &self.link {
            let rest = self.inbox.rest(link.id());
            self.hand_in(rest, Input::Arrived);
        }
    }
}
