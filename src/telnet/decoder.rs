//! Received bytes, taken apart: data, options asked for, subnegotiations.

use super::{IAC, SB, SE};

/// What a server said beside the data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Heard {
    /// It wants to use this option itself.
    Will(u8),
    /// It does not, or no longer.
    Wont(u8),
    /// It asks us to use this option.
    Do(u8),
    /// It asks us not to.
    Dont(u8),
    /// What stood between IAC SB and IAC SE: the option, then its own bytes, no byte doubled.
    Subnegotiation(Vec<u8>),
    /// A subnegotiation had no end within [`LONGEST_SUBNEGOTIATION`] bytes. It was left; what follows counts as data.
    Endless,
}

/// Bytes of a subnegotiation at most. Those of a serial port have seven, or the name of a server.
pub const LONGEST_SUBNEGOTIATION: usize = 1024;

/// Takes received bytes apart, in any pieces.
#[derive(Debug, Default)]
pub struct Decoder {
    state: State,
    subnegotiation: Vec<u8>,
}

#[derive(Clone, Copy, Debug, Default)]
enum State {
    #[default]
    Data,
    /// After IAC.
    Command,
    /// After a verb that an option follows.
    Option(Verb),
    Subnegotiation,
    /// After IAC within one.
    SubnegotiationCommand,
}

#[derive(Clone, Copy, Debug)]
enum Verb {
    Will,
    Wont,
    Do,
    Dont,
}

impl Decoder {
    /// Appends what is data to `data`, and says what else was heard, in order. Commands that mean nothing to a serial
    /// port (a pause, "are you there") are left out.
    pub fn decode(&mut self, bytes: &[u8], data: &mut Vec<u8>, mut heard: impl FnMut(Heard)) {
        for &byte in bytes {
            self.state = match self.state {
                State::Data if byte == IAC => State::Command,
                State::Data => {
                    data.push(byte);
                    State::Data
                }
                State::Command if byte == IAC => {
                    data.push(IAC);
                    State::Data
                }
                State::Command => self.command(byte),
                State::Option(verb) => {
                    heard(match verb {
                        Verb::Will => Heard::Will(byte),
                        Verb::Wont => Heard::Wont(byte),
                        Verb::Do => Heard::Do(byte),
                        Verb::Dont => Heard::Dont(byte),
                    });
                    State::Data
                }
                State::Subnegotiation if byte == IAC => State::SubnegotiationCommand,
                State::Subnegotiation => self.collect(byte, &mut heard),
                State::SubnegotiationCommand => match byte {
                    IAC => self.collect(IAC, &mut heard),
                    SE => {
                        heard(Heard::Subnegotiation(std::mem::take(&mut self.subnegotiation)));
                        State::Data
                    }
                    // Its end was lost, and this is the next command.
                    byte => self.command(byte),
                },
            };
        }
    }

    fn command(&mut self, byte: u8) -> State {
        match byte {
            251 => State::Option(Verb::Will),
            252 => State::Option(Verb::Wont),
            253 => State::Option(Verb::Do),
            254 => State::Option(Verb::Dont),
            SB => {
                self.subnegotiation.clear();
                State::Subnegotiation
            }
            _ => State::Data,
        }
    }

    fn collect(&mut self, byte: u8, heard: &mut impl FnMut(Heard)) -> State {
        if self.subnegotiation.len() == LONGEST_SUBNEGOTIATION {
            self.subnegotiation = Vec::new();
            heard(Heard::Endless);
            return State::Data;
        }
        self.subnegotiation.push(byte);
        State::Subnegotiation
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(bytes: &[u8]) -> (Vec<u8>, Vec<Heard>) {
        let (mut data, mut heard) = (Vec::new(), Vec::new());
        Decoder::default().decode(bytes, &mut data, |item| heard.push(item));
        (data, heard)
    }

    #[test]
    fn commands_are_lifted_out_of_the_data() {
        for (bytes, data, heard) in [
            (&b"a\xff\xffb"[..], &b"a\xffb"[..], vec![]),
            (b"a\xff\xfb\x2cb", b"ab", vec![Heard::Will(44)]),
            (b"\xff\xfc\x00\xff\xfd\xff\xff\xfe\x03.", b".", vec![Heard::Wont(0), Heard::Do(255), Heard::Dont(3)]),
            (b"a\xff\xf1b\xff\xf9", b"ab", vec![]),
            (
                b"\xff\xfa\x2c\x65\x00\x01\xc2\x00\xff\xf0!",
                b"!",
                vec![Heard::Subnegotiation(vec![44, 101, 0, 1, 194, 0])],
            ),
            // A byte of 255 in it is doubled as well.
            (b"\xff\xfa\x2c\xff\xff\xff\xf0!", b"!", vec![Heard::Subnegotiation(vec![44, 255])]),
            (b"\xff\xfa\xff\xf0!", b"!", vec![Heard::Subnegotiation(vec![])]),
            // XON and XOFF are data like any other.
            (b"\x13\x11", b"\x13\x11", vec![]),
        ] {
            assert_eq!(decode(bytes), (data.to_vec(), heard), "{}", bytes.escape_ascii());
        }
    }

    #[test]
    fn a_subnegotiation_whose_end_was_lost_ends_with_the_next_command() {
        assert_eq!(decode(b"\xff\xfa\x2c\x65\xff\xfb\x03x"), (b"x".to_vec(), vec![Heard::Will(3)]));
        let again = b"\xff\xfa\x2c\x65\xff\xfa\x2c\x66\xff\xf0x";
        assert_eq!(decode(again), (b"x".to_vec(), vec![Heard::Subnegotiation(vec![44, 102])]));
    }

    #[test]
    fn a_subnegotiation_without_an_end_swallows_no_more_than_it_may() {
        let mut bytes = b"\xff\xfa".to_vec();
        bytes.extend([b'x'; LONGEST_SUBNEGOTIATION]);
        assert_eq!(decode(&bytes), (vec![], vec![]));
        bytes.extend(b"yz");
        assert_eq!(decode(&bytes), (b"z".to_vec(), vec![Heard::Endless]));
    }
}
