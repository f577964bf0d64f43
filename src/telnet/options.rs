//! Which telnet options are in force, and what is answered about them.
//!
//! The rules of RFC 1143, with one more: what was refused or given up once stays so and is not answered a second time.
//! So no server, whatever it repeats, gets more than a handful of bytes out of us for each option.

use super::{Heard, IAC};

/// Whose option it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// We use it: WILL and WONT from us, DO and DONT from the server.
    Ours,
    /// The server uses it: DO and DONT from us, WILL and WONT from the server.
    Theirs,
}

/// Something changed that the owner has to know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// In force now.
    Agreed(Side, u8),
    /// The server refuses it, or has withdrawn it.
    Refused(Side, u8),
}

/// The state of one option on one side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Standing {
    #[default]
    Off,
    /// Asked for by us, not answered.
    Asked,
    On,
    /// Refused or withdrawn: never again.
    Never,
}

/// All options of a connection.
#[derive(Debug)]
pub(super) struct Options {
    ours: [Standing; 256],
    theirs: [Standing; 256],
    welcome: &'static [(Side, u8)],
}

const WILL: u8 = 251;
const WONT: u8 = 252;
const DO: u8 = 253;
const DONT: u8 = 254;

impl Options {
    /// Asks for what is wanted, and will agree to what is welcome; anything else is refused.
    pub(super) fn ask(wanted: &[(Side, u8)], welcome: &'static [(Side, u8)], replies: &mut Vec<u8>) -> Self {
        let mut options = Options { ours: [Standing::Off; 256], theirs: [Standing::Off; 256], welcome };
        for &(side, option) in wanted {
            *options.standing(side, option) = Standing::Asked;
            replies.extend([IAC, if side == Side::Ours { WILL } else { DO }, option]);
        }
        options
    }

    /// Takes what was heard; anything but the four verbs of options is nothing here.
    pub(super) fn hear(&mut self, heard: &Heard, replies: &mut Vec<u8>) -> Option<Change> {
        let (side, wants, option) = match *heard {
            Heard::Will(option) => (Side::Theirs, true, option),
            Heard::Wont(option) => (Side::Theirs, false, option),
            Heard::Do(option) => (Side::Ours, true, option),
            Heard::Dont(option) => (Side::Ours, false, option),
            Heard::Subnegotiation(_) | Heard::Endless => return None,
        };
        let is_welcome = self.welcome.contains(&(side, option));
        let standing = self.standing(side, option);
        let (yes, no) = if side == Side::Ours { (WILL, WONT) } else { (DO, DONT) };
        match (*standing, wants) {
            (Standing::Asked, true) => {
                *standing = Standing::On;
                Some(Change::Agreed(side, option))
            }
            (Standing::Asked, false) => {
                *standing = Standing::Never;
                Some(Change::Refused(side, option))
            }
            (Standing::On, false) => {
                *standing = Standing::Never;
                replies.extend([IAC, no, option]);
                Some(Change::Refused(side, option))
            }
            (Standing::Off, true) if is_welcome => {
                *standing = Standing::On;
                replies.extend([IAC, yes, option]);
                Some(Change::Agreed(side, option))
            }
            (Standing::Off, true) => {
                *standing = Standing::Never;
                replies.extend([IAC, no, option]);
                None
            }
            (Standing::On | Standing::Never, true) | (Standing::Off | Standing::Never, false) => None,
        }
    }

    fn standing(&mut self, side: Side, option: u8) -> &mut Standing {
        let standings = match side {
            Side::Ours => &mut self.ours,
            Side::Theirs => &mut self.theirs,
        };
        &mut standings[usize::from(option)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ECHO: u8 = 1;
    const SGA: u8 = 3;

    #[test]
    fn what_was_asked_for_is_agreed_without_another_word() {
        let mut replies = Vec::new();
        let mut options = Options::ask(&[(Side::Theirs, SGA), (Side::Ours, SGA)], &[], &mut replies);
        assert_eq!(replies, [IAC, DO, SGA, IAC, WILL, SGA]);
        replies.clear();
        assert_eq!(options.hear(&Heard::Will(SGA), &mut replies), Some(Change::Agreed(Side::Theirs, SGA)));
        assert_eq!(options.hear(&Heard::Will(SGA), &mut replies), None);
        assert_eq!(options.hear(&Heard::Dont(SGA), &mut replies), Some(Change::Refused(Side::Ours, SGA)));
        assert!(replies.is_empty());
        // Withdrawn later: that is to be confirmed.
        assert_eq!(options.hear(&Heard::Wont(SGA), &mut replies), Some(Change::Refused(Side::Theirs, SGA)));
        assert_eq!(replies, [IAC, DONT, SGA]);
    }

    #[test]
    fn what_is_offered_is_agreed_to_if_welcome_and_refused_once_otherwise() {
        let mut replies = Vec::new();
        let mut options = Options::ask(&[], &[(Side::Theirs, SGA)], &mut replies);
        assert_eq!(options.hear(&Heard::Will(SGA), &mut replies), Some(Change::Agreed(Side::Theirs, SGA)));
        assert_eq!(options.hear(&Heard::Will(SGA), &mut replies), None);
        assert_eq!(replies, [IAC, DO, SGA]);
        replies.clear();
        for _ in 0..3 {
            assert_eq!(options.hear(&Heard::Will(ECHO), &mut replies), None);
            assert_eq!(options.hear(&Heard::Do(99), &mut replies), None);
            assert_eq!(options.hear(&Heard::Wont(ECHO), &mut replies), None);
        }
        assert_eq!(replies, [IAC, DONT, ECHO, IAC, WONT, 99]);
    }
}
