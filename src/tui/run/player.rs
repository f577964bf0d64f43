//! A recording that is played: at its own pace, faster, all at once; paused; from another place.
//!
//! The console's time is then the recording's: it stops while the recording is paused, and passes in no time while it
//! is played all at once.

use std::path::{Path, PathBuf};

use super::super::{Failure, Input, LinkInfo, LinkKind, Pace, Playback, Playing};
use crate::host::clock;
use crate::host::replay::{Recording, RecordingError};
use crate::record::{Direction, Ending, Piece};
use crate::time::{Duration, Instant};

/// How often the place is shown while nothing happens.
const TICK: Duration = Duration::from_millis(200);

/// A recording that is played.
pub(super) struct Player {
    name: String,
    path: PathBuf,
    recording: Recording,
    /// The console's time at the beginning of the recording.
    begun: Instant,
    /// The console's time now.
    now: Instant,
    /// What comes next, once it has been read.
    next: Option<(Duration, Input)>,
    pace: Pace,
    /// Where the recording stood when its pace was set, and what the clock said then.
    set: (Duration, Instant),
    /// All at once up to here.
    target: Option<Duration>,
    length: Option<Duration>,
    over: bool,
}

/// What is due.
pub(super) enum Step {
    /// Nothing for now.
    Nothing,
    /// Time passes to this moment.
    To(Instant),
    /// At this moment this happened.
    Piece(Instant, Input),
    /// The recording has ended, well or not.
    Over(Option<Failure>),
}

impl Player {
    /// Plays a recording all at once; the console's time is `begun`.
    pub(super) fn begin(name: &str, path: PathBuf, recording: Recording, begun: Instant) -> Self {
        Player {
            name: name.to_owned(),
            path,
            recording,
            begun,
            now: begun,
            next: None,
            pace: Pace::AtOnce,
            set: (Duration::ZERO, Instant::ZERO),
            target: None,
            length: None,
            over: false,
        }
    }

    /// The same recording once more, from its beginning.
    pub(super) fn begin_again(&mut self, recording: Recording) {
        self.recording = recording;
        self.begun = self.now;
        self.next = None;
        self.target = None;
        self.over = false;
    }

    /// The file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The console's time.
    pub(super) fn now(&self) -> Instant {
        self.now
    }

    /// Moves the console's time; never backward.
    pub(super) fn set_now(&mut self, now: Instant) {
        self.now = self.now.max(now);
    }

    /// The recording as a link.
    pub(super) fn link_info(&self, baud: u32) -> LinkInfo {
        let millis = self.recording.header().unix_millis;
        let before = self.begun.since_start();
        LinkInfo {
            link: self.name.clone(),
            baud,
            kind: LinkKind::Recording,
            recording: None,
            noted: None,
            start_of_day: clock::day_before(clock::time_of_day(millis), before),
            start_millis: millis - i64::try_from(before.as_millis()).unwrap_or_default(),
        }
    }

    /// How it is played.
    pub(super) fn playing(&self) -> Playing {
        Playing { position: self.wanted().unwrap_or(self.position()), length: self.length, pace: self.pace }
    }

    /// The place it is on its way to: steering counts from there, not from where it happens to be.
    fn wanted(&self) -> Option<Duration> {
        let target = self.target?;
        match self.length {
            Some(length) => Some(target.min(length)),
            // Its end, wherever that is.
            None => Some(target).filter(|target| *target < Duration::MAX),
        }
    }

    /// Whether it has to restart for that.
    pub(super) fn is_behind(&self, playback: Playback) -> bool {
        match playback {
            Playback::Pace(_) => false,
            Playback::Seek(place) => place < self.position(),
            Playback::Again(_) => true,
        }
    }

    /// Plays it differently. Going back needs [`Player::begin_again`] first.
    pub(super) fn steer(&mut self, clock: Instant, playback: Playback) {
        match playback {
            Playback::Pace(pace) | Playback::Again(pace) => self.pace = pace,
            Playback::Seek(place) => {
                self.target = Some(place);
                // A user who looks for a place wants to see it.
                if self.pace == Pace::AtOnce {
                    self.pace = Pace::Paused;
                }
            }
        }
        self.set = (self.position(), clock);
    }

    /// When the next step is due, by the clock.
    pub(super) fn wake_at(&self, clock: Instant) -> Option<Instant> {
        match (self.pace, &self.next) {
            _ if self.over => None,
            (Pace::AtOnce, _) => Some(clock),
            _ if self.target.is_some() => Some(clock),
            (Pace::Paused, _) => None,
            (Pace::Times(_), None) => Some(clock),
            (Pace::Times(times), Some((at, _))) => {
                let due = self.set.1 + at.saturating_sub(self.set.0) / times.max(1);
                Some(due.min(clock + TICK))
            }
        }
    }

    /// What is due; `unreadable` says why a recording cannot be read.
    pub(super) fn step(&mut self, clock: Instant, unreadable: fn(RecordingError) -> Failure) -> Step {
        if self.over {
            return Step::Nothing;
        }
        let goal = match (self.target, self.pace) {
            (Some(target), _) => target,
            (None, Pace::AtOnce) => Duration::MAX,
            (None, Pace::Times(times)) => self.set.0 + clock.since(self.set.1) * times,
            (None, Pace::Paused) => return Step::Nothing,
        };
        if self.next.is_none() {
            self.next = match self.read(unreadable) {
                Ok(next) => Some(next),
                Err(failure) => {
                    self.over = true;
                    self.target = None;
                    self.length = Some(self.position());
                    return Step::Over(failure);
                }
            };
        }
        if let Some((at, input)) = self.next.take_if(|(at, _)| *at <= goal) {
            return Step::Piece(self.begun + at, input);
        }
        if self.target.take().is_some() {
            self.set = (goal, clock);
        }
        let moment = self.begun + goal;
        if moment > self.now { Step::To(moment) } else { Step::Nothing }
    }

    fn position(&self) -> Duration {
        self.now.since(self.begun)
    }

    /// The next piece that matters; at the end why it has ended, if it should not have.
    fn read(&mut self, unreadable: fn(RecordingError) -> Failure) -> Result<(Duration, Input), Option<Failure>> {
        loop {
            let (at, input) = match self.recording.next() {
                Ok(Some(Piece::Header(_))) => continue,
                Ok(Some(Piece::Bytes { at, direction: Direction::FromUnit, bytes })) => (at, Input::Bytes(bytes)),
                Ok(Some(Piece::Bytes { at, direction: Direction::ToUnit, bytes })) => (at, Input::Sent(bytes)),
                Ok(Some(Piece::Mark { at, text })) => (at, Input::Mark(text)),
                Ok(None) => {
                    let cut = self.recording.ending() == Some(Ending::CutShort);
                    let text =
                        "The recording ends in the middle of a line: the program that wrote it was killed, or its \
                                disk was full."
                            .to_owned();
                    return Err(cut.then(|| Failure { text, hints: Vec::new() }));
                }
                Err(error) => return Err(Some(unreadable(error))),
            };
            return Ok((at.since_start(), input));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::endpoint::Secrecy;
    use crate::record::{Cast, Header};

    /// A recording with a byte in every second, `a` at second 0.
    struct Shelf {
        folder: tempfile::TempDir,
    }

    impl Shelf {
        fn new() -> Self {
            let shelf = Shelf { folder: tempfile::tempdir().expect("a folder") };
            let header = Header { port: "u0".into(), settings: "115200 8N1".into(), part: 1, ..Header::default() };
            let file = std::fs::File::create(shelf.path()).expect("a file");
            let mut cast = Cast::begin(file, &header, Instant::ZERO).expect("begun");
            for (second, byte) in (b'a'..=b'k').enumerate() {
                let at = Instant::from_millis(1000 * second as u64);
                cast.push(at, Direction::FromUnit, Secrecy::Open, &[byte]).expect("written");
            }
            shelf
        }

        fn path(&self) -> PathBuf {
            self.folder.path().join("x.cast")
        }

        fn recording(&self) -> Recording {
            Recording::open(&self.path()).expect("a recording")
        }

        fn player(&self) -> Player {
            Player::begin("replay:x", self.path(), self.recording(), Instant::from_millis(500))
        }
    }

    fn unreadable(error: RecordingError) -> Failure {
        Failure { text: error.to_string(), hints: Vec::new() }
    }

    fn clock(millis: u64) -> Instant {
        Instant::from_millis(millis)
    }

    /// Everything that is due by the clock, as the bytes heard; `.` for the end.
    fn heard(player: &mut Player, clock: Instant) -> String {
        let mut heard = String::new();
        loop {
            match player.step(clock, unreadable) {
                Step::Nothing => return heard,
                Step::To(moment) => player.set_now(moment),
                Step::Piece(moment, Input::Bytes(bytes)) => {
                    player.set_now(moment);
                    heard.push_str(&String::from_utf8_lossy(&bytes));
                }
                Step::Piece(..) => heard.push('?'),
                Step::Over(failure) => {
                    assert_eq!(failure, None);
                    heard.push('.');
                }
            }
        }
    }

    #[test]
    fn all_at_once_then_back_and_on_at_a_pace() {
        let shelf = Shelf::new();
        let mut player = shelf.player();
        assert_eq!(heard(&mut player, clock(0)), "abcdefghijk.");
        let seconds = Duration::from_secs;
        assert_eq!(player.playing(), Playing { position: seconds(10), length: Some(seconds(10)), pace: Pace::AtOnce });
        assert_eq!(player.wake_at(clock(0)), None, "at its end nothing wakes anybody");

        let seek = Playback::Seek(Duration::from_millis(3500));
        assert!(player.is_behind(seek));
        player.begin_again(shelf.recording());
        player.steer(clock(100), seek);
        assert_eq!(heard(&mut player, clock(100)), "abcd", "up to the place, and not further");
        assert_eq!(player.playing().position, Duration::from_millis(3500));
        assert_eq!((player.playing().pace, player.wake_at(clock(100))), (Pace::Paused, None));
        assert_eq!(heard(&mut player, clock(60_000)), "", "a pause lasts as long as it lasts");

        player.steer(clock(60_000), Playback::Pace(Pace::Times(2)));
        assert_eq!(heard(&mut player, clock(60_250)), "e", "half a second of the recording");
        assert_eq!(heard(&mut player, clock(61_250)), "fg");
        assert!(player.wake_at(clock(61_250)).is_some_and(|at| at <= clock(61_450)), "the place is shown as it moves");
        player.steer(clock(61_250), Playback::Pace(Pace::Paused));
        assert_eq!(heard(&mut player, clock(99_000)), "");
        let on = Playback::Seek(Duration::from_secs(8));
        assert!(!player.is_behind(on));
        player.steer(clock(99_000), on);
        assert_eq!(heard(&mut player, clock(99_000)), "hi");
        player.steer(clock(99_000), Playback::Pace(Pace::AtOnce));
        assert_eq!(heard(&mut player, clock(99_000)), "jk.");
    }

    #[test]
    fn places_are_counted_from_the_one_that_is_wanted_however_far_the_player_is() {
        let shelf = Shelf::new();
        let mut player = shelf.player();
        heard(&mut player, clock(0));
        let seconds = Duration::from_secs;
        // Three keys before anything has been played up to the first one's place.
        for wanted in [8, 6, 4] {
            let seek = Playback::Seek(player.playing().position.saturating_sub(seconds(2)));
            if player.is_behind(seek) {
                player.begin_again(shelf.recording());
            }
            player.steer(clock(0), seek);
            assert_eq!(player.playing().position, seconds(wanted));
            player.step(clock(0), unreadable);
        }
        assert_eq!(heard(&mut player, clock(0)), "de", "after a, b and c, one for each key, and not further");
        assert_eq!(player.playing().position, seconds(4));
        player.steer(clock(0), Playback::Seek(seconds(99)));
        assert_eq!(player.playing().position, seconds(10), "there is nothing after the end");
        assert_eq!(heard(&mut player, clock(0)), "fghijk.");
        assert_eq!(player.playing().position, seconds(10));
    }

    #[test]
    fn the_consoles_time_never_runs_backward() {
        let shelf = Shelf::new();
        let mut player = shelf.player();
        heard(&mut player, clock(0));
        let before = player.now();
        player.begin_again(shelf.recording());
        player.steer(clock(0), Playback::Again(Pace::Times(1)));
        assert_eq!(player.playing().position, Duration::ZERO);
        assert!(player.now() >= before);
        assert_eq!(heard(&mut player, clock(1_000)), "ab");
    }
}
