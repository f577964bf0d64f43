//! A recording in place of a unit: what the loop does while one is played.

use super::Console;
use super::player::Step;
use crate::host::replay::Recording;
use crate::time::Instant;
use crate::tui::{Input, Playback};

/// Pieces of a recording between two looks at the keyboard.
const PIECES: usize = 64;

impl Console {
    /// Plays what is due of a recording.
    pub(super) fn play(&mut self) {
        for _ in 0..PIECES {
            let (clock, unreadable) = (self.clock.now(), self.world.unreadable);
            let Some(player) = &mut self.player else { return };
            let step = player.step(clock, unreadable);
            match step {
                Step::Nothing => return,
                Step::To(moment) => self.pass_time_to(moment),
                Step::Piece(moment, input) => {
                    self.pass_time_to(moment);
                    self.handle(input);
                }
                Step::Over(failure) => self.handle(Input::RecordingOver(failure)),
            }
            let Some(player) = &self.player else { return };
            self.handle(Input::Playing(player.playing()));
        }
    }

    /// Lets the recording's time pass, with the timers that expire meanwhile.
    fn pass_time_to(&mut self, moment: Instant) {
        while let Some(due) = self.app.poll_timeout().filter(|due| *due <= moment && *due > self.now()) {
            if let Some(player) = &mut self.player {
                player.set_now(due);
            }
            self.handle(Input::Timeout);
        }
        if let Some(player) = &mut self.player {
            player.set_now(moment);
        }
    }

    /// Plays the recording differently.
    pub(super) fn steer(&mut self, playback: Playback) {
        let clock = self.clock.now();
        let Some(player) = &mut self.player else { return };
        if player.is_behind(playback) {
            match Recording::open_file(player.path()) {
                Ok(recording) => player.begin_again(recording),
                Err(error) => {
                    let failure = (self.world.unreadable)(error);
                    return self.handle(Input::RecordingOver(Some(failure)));
                }
            }
            let info = player.link_info(self.world.baud);
            self.handle(Input::PlayedAnew(info));
        }
        if let Some(player) = &mut self.player {
            player.steer(clock, playback);
            let playing = player.playing();
            self.handle(Input::Playing(playing));
        }
    }
}
