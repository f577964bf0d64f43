//! The link of the loop: opened, taken over, lost, looked for, closed.

use std::path::PathBuf;
use std::sync::mpsc::sync_channel;

use super::answers::Found;
use super::player::Player;
use super::{Console, NOTE_PATIENCE};
use crate::host::clock;
use crate::host::comeback::{Cable, Comeback};
use crate::host::link::{self, Connection, LinkError, LinkSpec};
use crate::host::recorder::Recorder;
use crate::host::replay::{Recording, RecordingError};
use crate::host::socket::Dialled;
use crate::record::{LINK_BACK, LINK_LOST};
use crate::time::Instant;
use crate::tui::{Failure, Input, LinkInfo, LinkKind, Noted};

/// A network link that was dialled.
pub(super) struct Dial {
    /// Which of the links asked for so far.
    number: u64,
    name: String,
    spec: LinkSpec,
    result: Result<Dialled, LinkError>,
}

/// A recording that was opened.
pub(super) struct OpenedRecording {
    /// Which of the links asked for so far.
    number: u64,
    name: String,
    path: PathBuf,
    result: Result<Recording, RecordingError>,
}

impl Console {
    /// Opens a link that does not have to be dialled; a recording in a thread.
    pub(super) fn open(&mut self, name: &str, spec: LinkSpec) {
        if let LinkSpec::Replay(path) = spec {
            return self.open_recording(name, path);
        }
        match (self.world.open)(&spec, self.world.baud, self.clock, self.sender.clone()) {
            Ok(connection) => self.begin(name, connection, spec),
            Err(failure) => self.handle(Input::LinkFailed(failure)),
        }
    }

    /// Begins to open a recording, in a thread: a disk may take its time.
    fn open_recording(&mut self, name: &str, path: PathBuf) {
        let (number, name) = (self.dial, name.to_owned());
        self.in_thread(move || {
            let result = Recording::open_file(&path);
            Found::Recording(Box::new(OpenedRecording { number, name, path, result }))
        });
    }

    /// Plays a recording that was opened, unless the user has gone on to something else.
    pub(super) fn take_recording(&mut self, OpenedRecording { number, name, path, result }: OpenedRecording) {
        if number != self.dial {
            return;
        }
        let recording = match result {
            Ok(recording) => recording,
            Err(error) => return self.handle(Input::LinkFailed((self.world.unreadable)(error))),
        };
        self.take_rest();
        self.close_link();
        let player = Player::begin(&name, path, recording, self.now());
        let info = player.link_info(self.world.baud);
        self.player = Some(player);
        self.handle(Input::LinkOpened(info));
    }

    /// Begins to dial a network link, in a thread: a host that is switched off answers nothing for seconds. Dialling ends by
    /// itself, so those that nobody waits for any more do not pile up.
    pub(super) fn dial(&mut self, name: String, spec: LinkSpec) {
        let (number, clock, options) = (self.dial, self.clock, link::Options { baud: self.world.baud });
        self.in_thread(move || {
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
        self.cable = Some(Cable::new(connection, Comeback::of(&spec, options)));
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
            noted: self.noted(name),
            start_of_day,
            start_millis: self.clock.wall(Instant::ZERO).as_millisecond()
                - i64::try_from(self.skew.as_millis()).unwrap_or_default(),
        });
        self.handle(opened);
    }

    /// What is noted of an upload on a link, once everything from before is noted; nothing if the journal keeps everybody
    /// waiting.
    fn noted(&self, link: &str) -> Option<Noted> {
        let (noted, link) = (self.world.noted, link.to_owned());
        let (tell, told) = sync_channel(1);
        self.writer.run(move || {
            let _ = tell.try_send(noted(&link));
        });
        told.recv_timeout(NOTE_PATIENCE).ok().flatten()
    }

    /// The open link has ended by itself.
    pub(super) fn lose_link(&mut self, failure: Failure) {
        let now = self.clock.now();
        let Some(cable) = self.cable.as_mut().filter(|cable| cable.connection().is_some()) else { return };
        let may_come_back = cable.may_come_back();
        // What the reader has brought since the writer noticed the loss, or before a write that was refused.
        let rest = cable.lose(&mut self.inbox, now);
        self.hand_in(rest, Input::Arrived);
        if may_come_back {
            self.recorder.mark(self.now(), LINK_LOST);
        } else {
            self.close_link();
        }
        self.handle(Input::LinkGone(failure));
    }

    /// Looks whether a lost link is there again, if it is time to look.
    pub(super) fn look_for_link(&mut self, now: Instant) {
        let Some(cable) = &mut self.cable else { return };
        let Some(connection) = cable.try_again(now, self.clock, &self.sender) else { return };
        let name = connection.port().to_owned();
        self.recorder.mark(self.now(), &format!("{LINK_BACK}as {name}"));
        self.handle(Input::LinkBack(name));
    }

    /// Closes the link; what it has put on the channel and nobody has taken is forgotten.
    pub(super) fn close_link(&mut self) {
        // The console's time goes on from where the recording's is.
        let now = self.now();
        self.player = None;
        self.skew += now.since(self.now());
        if let Some(cable) = self.cable.take() {
            cable.close(&mut self.inbox);
        }
        self.recorder = Recorder::nothing();
    }

    /// Hands the app what the open link has brought and nobody has taken, as the last of it.
    fn take_rest(&mut self) {
        if let Some(cable) = &self.cable {
            let rest = cable.rest(&mut self.inbox);
            self.hand_in(rest, Input::Arrived);
        }
    }

    /// The open link.
    pub(super) fn connection(&self) -> Option<&Connection> {
        self.cable.as_ref().and_then(Cable::connection)
    }
}
