//! The link of the loop: opened, taken over, lost, looked for, closed.

use super::player::Player;
use super::{Console, in_thread};
use crate::host;
use crate::host::clock;
use crate::host::comeback::Comeback;
use crate::host::link::{self, Connection, LinkError, LinkSpec};
use crate::host::recorder::Recorder;
use crate::host::replay::Recording;
use crate::host::socket::Dialled;
use crate::record::{LINK_BACK, LINK_LOST};
use crate::time::Instant;
use crate::tui::{Failure, Input, LinkInfo};

/// Which dial, of what, and what came of it.
pub(super) type DialResult = (u64, String, LinkSpec, Result<Dialled, LinkError>);

impl Console {
    /// Opens a link that does not have to be dialled. Gives `true` when the console is to end.
    pub(super) fn open(&mut self, name: &str, spec: LinkSpec) -> bool {
        if let LinkSpec::Replay(path) = &spec {
            let mut leaves = false;
            let input = match Recording::open(path) {
                Ok(recording) => {
                    leaves |= self.take_rest();
                    self.close_link();
                    let player = Player::begin(name, path.clone(), recording, self.now());
                    let info = player.link_info(self.world.baud);
                    self.player = Some(player);
                    Input::LinkOpened(info)
                }
                Err(error) => Input::LinkFailed((self.world.unreadable)(error)),
            };
            return self.handle(input) || leaves;
        }
        match (self.world.open)(&spec, self.world.baud, self.clock, self.sender.clone()) {
            Ok(connection) => self.begin(name, connection, spec),
            Err(failure) => self.handle(Input::LinkFailed(failure)),
        }
    }

    /// Begins to dial a network link, in a thread: a host that is switched off answers nothing for seconds.
    pub(super) fn dial(&mut self, name: String, spec: LinkSpec) {
        let (dial, clock, options) = (self.dial, self.clock, link::Options { baud: self.world.baud });
        let (dialling, sender) = (self.dialling.clone(), self.sender.clone());
        in_thread("dial", move || {
            let result = Connection::dial(&spec, options, clock);
            if dialling.send((dial, name, spec, result)).is_ok() {
                let _ = sender.try_send(host::Input::Wake);
            }
        });
    }

    /// Takes what came of dialling, unless the user has gone on to something else. Gives `true` when it is to end.
    pub(super) fn take_dialled(&mut self, (dial, name, spec, result): DialResult) -> bool {
        if dial != self.dial {
            return false;
        }
        let options = link::Options { baud: self.world.baud };
        let connection =
            result.and_then(|dialled| Connection::over(&spec, dialled, options, self.clock, self.sender.clone()));
        match connection {
            Ok(connection) => self.begin(&name, connection, spec),
            Err(error) => self.handle(Input::LinkFailed((self.world.explain)(error))),
        }
    }

    /// Takes over an open link and starts its recording. Gives `true` when the console is to end.
    fn begin(&mut self, name: &str, connection: Connection, spec: LinkSpec) -> bool {
        // What the old link has brought belongs to its own session and recording; what the new one has said since it is
        // open waits for them to be there.
        let leaves = self.take_rest();
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
            read_only: false,
            recording,
            noted: (self.world.noted)(name),
            start_of_day,
            start_millis: self.clock.wall(Instant::ZERO).as_millisecond()
                - i64::try_from(self.skew.as_millis()).unwrap_or_default(),
        });
        self.handle(opened) || leaves
    }

    /// The open link has ended by itself. Gives `true` when the console is to end.
    pub(super) fn lose_link(&mut self, failure: Failure) -> bool {
        // What the reader has brought behind the loss that the writer has noticed, or before a write that was refused.
        let leaves = self.take_rest();
        if self.link.is_none() {
            return leaves;
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
        self.handle(Input::LinkGone(failure)) || leaves
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
        // The console's time goes on from where the recording's stands.
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

    /// Hands the app what the open link has brought and nobody has taken, as the last of it. Gives `true` when it is to
    /// end.
    fn take_rest(&mut self) -> bool {
        let rest = self.link.as_ref().map(|link| self.inbox.rest(link.id()));
        self.hand_in(rest.unwrap_or_default(), Input::Arrived)
    }
}
