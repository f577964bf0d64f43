//! The client's side of a remote serial port (RFC 2217): what it asks for, and what the server makes of it.
//!
//! It asks for eight-bit data both ways and the serial port option, then for eight data bits, no parity, one stop bit,
//! no flow control by the server (the session does Xon/Xoff, so 11h and 13h have to pass both ways), silence about
//! modem lines, and last the line rate. Servers answer in order, so the answer to the rate says that all the others
//! are settled. What a server leaves unanswered beside the rate is taken as done; what it answers must be what was
//! asked for, then and later.

use super::options::{Change, Options, Side};
use super::{Decoder, Heard, IAC, SB, SE};

/// Why a remote serial port is of no use.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// There is telnet, but no serial port to set up.
    #[error("the server speaks telnet, but refuses RFC 2217 (COM-PORT-OPTION)")]
    NoComPort,
    /// Telnet without eight-bit data adds a NUL after every CR.
    #[error("the server refuses to pass all bytes unchanged (telnet BINARY)")]
    NoBinary,
    /// Another line rate, in baud.
    #[error("the server runs at {set} baud when asked for {asked}")]
    Baud {
        /// What was asked for.
        asked: u32,
        /// What it set.
        set: u32,
    },
    /// Another setting, as RFC 2217 numbers its values.
    #[error("asked for {setting}, the server answers {answer}")]
    Setting {
        /// What was to be set, e.g. `no parity`.
        setting: &'static str,
        /// What the server says it has set.
        answer: u8,
    },
    /// A command that has no end.
    #[error("the server says something that is not telnet")]
    Nonsense,
}

/// What a server that is not ready still owes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Awaited {
    /// Any word of telnet: it may be a raw socket.
    Telnet,
    /// Its answer to the serial port option.
    ComPort,
    /// Its answer to the line rate.
    Baud,
}

/// One connection to a remote serial port.
#[derive(Debug)]
pub struct Client {
    decoder: Decoder,
    options: Options,
    baud: u32,
    awaited: Option<Awaited>,
    refusal: Option<Refusal>,
    /// Whether the server has asked us to send nothing for now.
    suspended: bool,
    replies: Vec<u8>,
}

const BINARY: u8 = 0;
const SUPPRESS_GO_AHEAD: u8 = 3;
const COM_PORT: u8 = 44;

// What a client asks of the port. The server's answer has 100 more.
const SET_BAUD: u8 = 1;
const SET_DATA_BITS: u8 = 2;
const SET_PARITY: u8 = 3;
const SET_STOP_BITS: u8 = 4;
const SET_CONTROL: u8 = 5;
const SUSPEND: u8 = 8;
const RESUME: u8 = 9;
const SET_LINE_STATE_MASK: u8 = 10;
const SET_MODEM_STATE_MASK: u8 = 11;
const ANSWER: u8 = 100;

/// "Use no flow control".
const NO_FLOW_CONTROL: u8 = 1;
/// Values of SET_CONTROL by which a server says that it does flow control on what we send.
const FLOW_CONTROLS: [u8; 4] = [2, 3, 17, 19];

/// What is asked for, in this order. The serial port comes last: with its answer the others are settled.
const WANTED: [(Side, u8); 5] = [
    (Side::Theirs, BINARY),
    (Side::Ours, BINARY),
    (Side::Theirs, SUPPRESS_GO_AHEAD),
    (Side::Ours, SUPPRESS_GO_AHEAD),
    (Side::Ours, COM_PORT),
];

/// Some servers offer to speak of the serial port instead of waiting to be told to listen; both are meant to be agreed.
const WELCOME: [(Side, u8); 1] = [(Side::Theirs, COM_PORT)];

impl Client {
    /// A connection just made, whose port is to have this line rate. The first requests wait in
    /// [`poll_transmit`](Client::poll_transmit).
    pub fn new(baud: u32) -> Self {
        let mut replies = Vec::new();
        Client {
            decoder: Decoder::default(),
            options: Options::ask(&WANTED, &WELCOME, &mut replies),
            baud,
            awaited: Some(Awaited::Telnet),
            refusal: None,
            suspended: false,
            replies,
        }
    }

    /// Takes received bytes, in any pieces, and appends what the serial port received to `data`.
    pub fn receive(&mut self, bytes: &[u8], data: &mut Vec<u8>) {
        let mut heard = Vec::new();
        self.decoder.decode(bytes, data, |item| heard.push(item));
        for item in heard {
            self.hear(&item);
        }
    }

    /// What has to be sent to the server, as it is.
    pub fn poll_transmit(&mut self) -> Option<Vec<u8>> {
        (!self.replies.is_empty()).then(|| std::mem::take(&mut self.replies))
    }

    /// Whether the port is set up.
    pub fn is_ready(&self) -> bool {
        self.awaited.is_none() && self.refusal.is_none()
    }

    /// What the server owes; `None` when the port is set up.
    pub fn awaited(&self) -> Option<Awaited> {
        self.awaited
    }

    /// Why the port is of no use, the first reason. May come late: another client may change the port.
    pub fn refusal(&self) -> Option<&Refusal> {
        self.refusal.as_ref()
    }

    /// Whether the server has asked us to send nothing for now.
    pub fn is_suspended(&self) -> bool {
        self.suspended
    }

    fn hear(&mut self, heard: &Heard) {
        if self.awaited == Some(Awaited::Telnet) {
            self.awaited = Some(Awaited::ComPort);
        }
        match self.options.hear(heard, &mut self.replies) {
            // Some servers agree, some offer, most do both.
            Some(Change::Agreed(_, COM_PORT)) if self.awaited == Some(Awaited::ComPort) => self.set_up(),
            Some(Change::Refused(Side::Ours, COM_PORT)) => self.refuse(Refusal::NoComPort),
            Some(Change::Refused(_, BINARY)) => self.refuse(Refusal::NoBinary),
            Some(Change::Agreed(..) | Change::Refused(..)) | None => {}
        }
        match heard {
            Heard::Subnegotiation(content) => {
                if let [COM_PORT, command, value @ ..] = content.as_slice() {
                    self.answer(*command, value);
                }
            }
            Heard::Endless => self.refuse(Refusal::Nonsense),
            Heard::Will(_) | Heard::Wont(_) | Heard::Do(_) | Heard::Dont(_) => {}
        }
    }

    fn set_up(&mut self) {
        self.awaited = Some(Awaited::Baud);
        for (command, value) in [
            (SET_CONTROL, NO_FLOW_CONTROL),
            (SET_LINE_STATE_MASK, 0),
            (SET_MODEM_STATE_MASK, 0),
            (SET_DATA_BITS, 8),
            (SET_PARITY, 1),
            (SET_STOP_BITS, 1),
        ] {
            self.request(command, &[value]);
        }
        self.request(SET_BAUD, &self.baud.to_be_bytes());
    }

    fn request(&mut self, command: u8, value: &[u8]) {
        self.replies.extend([IAC, SB, COM_PORT, command]);
        self.replies.extend(super::escape(value));
        self.replies.extend([IAC, SE]);
    }

    /// An answer, or what the server says of itself. What has the wrong length is not an answer.
    fn answer(&mut self, command: u8, value: &[u8]) {
        // Before the option is agreed on nothing was asked, so nothing is answered.
        if !matches!(self.awaited, None | Some(Awaited::Baud)) {
            return;
        }
        let setting = |setting, answer| Refusal::Setting { setting, answer };
        match (command.wrapping_sub(ANSWER), value) {
            (SET_BAUD, &[a, b, c, d]) => {
                let set = u32::from_be_bytes([a, b, c, d]);
                if super::rate_is_close(self.baud, set) {
                    self.awaited = None;
                } else {
                    self.refuse(Refusal::Baud { asked: self.baud, set });
                }
            }
            (SET_DATA_BITS, &[answer]) if answer != 8 => self.refuse(setting("8 data bits", answer)),
            (SET_PARITY, &[answer]) if answer != 1 => self.refuse(setting("no parity", answer)),
            (SET_STOP_BITS, &[answer]) if answer != 1 => self.refuse(setting("one stop bit", answer)),
            (SET_CONTROL, &[answer]) if FLOW_CONTROLS.contains(&answer) => {
                self.refuse(setting("no flow control", answer));
            }
            (SUSPEND, _) => self.suspended = true,
            (RESUME, _) => self.suspended = false,
            _ => {}
        }
    }

    fn refuse(&mut self, refusal: Refusal) {
        self.refusal.get_or_insert(refusal);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(client: &mut Client, command: u8, value: &[u8]) {
        let mut bytes = vec![IAC, SB, COM_PORT, command];
        bytes.extend(super::super::escape(value));
        bytes.extend([IAC, SE]);
        client.receive(&bytes, &mut Vec::new());
    }

    fn agreed(baud: u32) -> Client {
        let mut client = Client::new(baud);
        client.poll_transmit().expect("requests");
        client.receive(b"\xff\xfb\x00\xff\xfd\x00\xff\xfd\x2c", &mut Vec::new());
        client
    }

    #[test]
    fn a_port_is_asked_for_set_up_and_confirmed() {
        let mut client = Client::new(115_200);
        assert_eq!(client.awaited(), Some(Awaited::Telnet));
        let asked = client.poll_transmit().expect("requests");
        assert_eq!(asked, b"\xff\xfd\x00\xff\xfb\x00\xff\xfd\x03\xff\xfb\x03\xff\xfb\x2c");
        assert_eq!(client.poll_transmit(), None);
        // Nothing is set before the server has said that it knows how: these bytes would reach the unit.
        client.receive(b"\xff\xfb\x03\xff\xfd\x03\xff\xfb\x01", &mut Vec::new());
        assert_eq!(client.poll_transmit().expect("a refusal"), b"\xff\xfe\x01");
        assert_eq!(client.awaited(), Some(Awaited::ComPort));
        client.receive(b"\xff\xfd\x2c", &mut Vec::new());
        assert_eq!(
            client.poll_transmit().expect("the settings"),
            [
                &b"\xff\xfa\x2c\x05\x01\xff\xf0"[..],
                b"\xff\xfa\x2c\x0a\x00\xff\xf0\xff\xfa\x2c\x0b\x00\xff\xf0",
                b"\xff\xfa\x2c\x02\x08\xff\xf0\xff\xfa\x2c\x03\x01\xff\xf0\xff\xfa\x2c\x04\x01\xff\xf0",
                b"\xff\xfa\x2c\x01\x00\x01\xc2\x00\xff\xf0",
            ]
            .concat()
        );
        for (command, value) in [(105, 1), (102, 8), (103, 1), (104, 1)] {
            answer(&mut client, command, &[value]);
            assert_eq!(client.awaited(), Some(Awaited::Baud));
        }
        answer(&mut client, 101, &115_200u32.to_be_bytes());
        assert!(client.is_ready());
        assert_eq!(client.refusal(), None);
    }

    #[test]
    fn a_rate_that_holds_the_command_byte_is_doubled() {
        let mut client = agreed(0x0000_FF00);
        let settings = client.poll_transmit().expect("the settings");
        assert!(settings.ends_with(b"\x2c\x01\x00\x00\xff\xff\x00\xff\xf0"), "{}", settings.escape_ascii());
        answer(&mut client, 101, &[0, 0, 255, 0]);
        assert!(client.is_ready());
    }

    #[test]
    fn an_answer_that_says_otherwise_is_a_refusal_then_and_later() {
        for (command, value, expected) in [
            (101, &9_600u32.to_be_bytes()[..], "the server runs at 9600 baud when asked for 115200"),
            (102, &[7], "asked for 8 data bits, the server answers 7"),
            (103, &[3], "asked for no parity, the server answers 3"),
            (104, &[2], "asked for one stop bit, the server answers 2"),
            (105, &[2], "asked for no flow control, the server answers 2"),
        ] {
            for later in [false, true] {
                let mut client = agreed(115_200);
                if later {
                    answer(&mut client, 101, &115_200u32.to_be_bytes());
                    assert!(client.is_ready());
                }
                answer(&mut client, command, value);
                assert_eq!(client.refusal().map(ToString::to_string).as_deref(), Some(expected));
                assert!(!client.is_ready());
            }
        }
    }

    #[test]
    fn rates_of_a_divider_and_states_of_other_lines_are_taken() {
        let mut client = agreed(115_200);
        // DTR is on; the modem lines; a signature; half an answer; an answer to nobody's option.
        for (command, value) in [(105, &[8][..]), (107, &[0x30]), (0, b"ser2net"), (101, &[1]), (200, &[]), (3, &[])] {
            answer(&mut client, command, value);
        }
        assert_eq!(client.awaited(), Some(Awaited::Baud));
        answer(&mut client, 101, &115_384u32.to_be_bytes());
        assert!(client.is_ready());
    }

    #[test]
    fn servers_that_refuse_what_is_needed_are_told_apart() {
        for (said, refusal) in [
            (&b"\xff\xfe\x2c"[..], Refusal::NoComPort),
            (b"\xff\xfe\x00", Refusal::NoBinary),
            (b"\xff\xfc\x00", Refusal::NoBinary),
            (b"\xff\xfd\x2c\xff\xfe\x2c", Refusal::NoComPort),
        ] {
            let mut client = Client::new(115_200);
            client.receive(said, &mut Vec::new());
            assert_eq!(client.refusal(), Some(&refusal), "{}", said.escape_ascii());
        }
        let mut client = Client::new(115_200);
        client.receive(b"\xff\xfa\x2c", &mut Vec::new());
        client.receive(&[7; 2_000], &mut Vec::new());
        assert_eq!(client.refusal(), Some(&Refusal::Nonsense));
    }

    #[test]
    fn a_raw_socket_is_told_by_its_silence_and_its_bytes_are_data() {
        let mut client = Client::new(115_200);
        let mut data = Vec::new();
        client.receive(b"TC1;20.5\r\n\x11\x13", &mut data);
        assert_eq!(data, b"TC1;20.5\r\n\x11\x13");
        assert_eq!(client.awaited(), Some(Awaited::Telnet));
    }

    #[test]
    fn a_server_may_suspend_and_resume_us() {
        let mut client = agreed(115_200);
        answer(&mut client, 108, &[]);
        assert!(client.is_suspended());
        answer(&mut client, 109, &[]);
        assert!(!client.is_suspended());
    }
}
